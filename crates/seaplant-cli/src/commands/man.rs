use std::process::ExitCode;

use anyhow::Context;
use clap::CommandFactory;

use crate::args::{Arguments, Man};
use crate::output::Output;
use crate::writing::{File, Permit, Target, check_replaceable};

pub fn run(arguments: &Man, output: Output) -> anyhow::Result<ExitCode> {
    let command = Arguments::command();
    let mut pages = vec![page("seaplant", command.clone())?];
    for sub in command.get_subcommands().filter(|sub| !sub.is_hide_set()) {
        let name = format!("seaplant-{}", sub.get_name());
        // `man` looks pages up by the dashed name: `man seaplant-identify`.
        let dashed: &'static str = Box::leak(name.clone().into_boxed_str());
        pages.push(page(&name, sub.clone().name(dashed))?);
    }
    let permit = Permit::new(&[], arguments.force);
    for page in &pages {
        let path = arguments.out.join(&page.path);
        check_replaceable(&path, permit, is_page).with_context(|| path.display().to_string())?;
    }
    Target { folder: &arguments.out, made: None, permit }.write(&pages)?;
    output.say(&format!("{} manual pages in {}", pages.len(), arguments.out.display()))?;
    Ok(ExitCode::SUCCESS)
}

/// Returns whether a file is a manual page of this program, by its first bytes.
fn is_page(first: &[u8]) -> bool {
    const TITLE: &[u8] = b".TH seaplant";
    first.windows(TITLE.len()).any(|bytes| bytes == TITLE)
}

fn page(name: &str, command: clap::Command) -> anyhow::Result<File> {
    let mut bytes = Vec::new();
    clap_mangen::Man::new(command).render(&mut bytes)?;
    Ok(File { path: format!("{name}.1"), bytes })
}
