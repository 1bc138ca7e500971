use std::process::ExitCode;

use clap::CommandFactory;

use crate::args::{Arguments, Man};
use crate::output::Output;
use crate::writing::{File, Permit, Target};

pub fn run(arguments: &Man, output: Output) -> anyhow::Result<ExitCode> {
    let command = Arguments::command();
    let mut pages = vec![page("seaplant", command.clone())?];
    for sub in command.get_subcommands().filter(|sub| !sub.is_hide_set()) {
        let name = format!("seaplant-{}", sub.get_name());
        // Manual pages are found by the dashed name: `man seaplant-identify`.
        let dashed: &'static str = Box::leak(name.clone().into_boxed_str());
        pages.push(page(&name, sub.clone().name(dashed))?);
    }
    let permit = Permit::of(&[], false);
    Target { folder: &arguments.out, made: None, permit }.write(&pages)?;
    output.say(&format!("{} manual pages in {}", pages.len(), arguments.out.display()))?;
    Ok(ExitCode::SUCCESS)
}

fn page(name: &str, command: clap::Command) -> anyhow::Result<File> {
    let mut bytes = Vec::new();
    clap_mangen::Man::new(command).render(&mut bytes)?;
    Ok(File { path: format!("{name}.1"), bytes })
}
