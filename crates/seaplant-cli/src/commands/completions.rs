//! Shell completion, for which the shell calls the program.

use std::process::ExitCode;

use anyhow::Context;
use clap::CommandFactory;
use clap_complete::env::{CompleteEnv, Shells};

use crate::args::{Arguments, Completions};
use crate::output::print;

/// Variable by which a shell's script requests completions.
const VARIABLE: &str = "SEAPLANT_COMPLETE";

/// In bash a colon ends a word, and would split `published:NAME`.
const BASH: &str = "COMP_WORDBREAKS=${COMP_WORDBREAKS//:/}\n";

pub fn run(arguments: &Completions) -> anyhow::Result<ExitCode> {
    let shell = arguments.shell.to_string();
    let known = Shells::builtins();
    let known = known.completer(&shell).with_context(|| format!("{shell} is not known"))?;
    let mut script = Vec::new();
    if shell == "bash" {
        script.extend_from_slice(BASH.as_bytes());
    }
    known.write_registration(VARIABLE, "seaplant", "seaplant", "seaplant", &mut script)?;
    print(&String::from_utf8(script)?)?;
    Ok(ExitCode::SUCCESS)
}

/// Answers a shell that requests completions, and then ends the program.
pub fn answer() {
    CompleteEnv::with_factory(Arguments::command).var(VARIABLE).complete();
}
