use std::process::ExitCode;

use clap::CommandFactory;

use crate::args::{Arguments, Completions};

pub fn run(arguments: &Completions) -> anyhow::Result<ExitCode> {
    let mut command = Arguments::command();
    clap_complete::generate(arguments.shell, &mut command, "seaplant", &mut std::io::stdout());
    Ok(ExitCode::SUCCESS)
}
