//! `seaplant`: identifies plant models of marine vehicles from their logs.

mod args;
mod commands;
mod output;
mod progress;
mod sketch;
mod summary;
mod wrap;
mod writing;

use std::process::ExitCode;

use args::{Arguments, Command};
use output::Output;

fn main() -> ExitCode {
    commands::completions::answer();
    keep_readers_quiet();
    writing::leave_nothing_behind();
    let arguments = Arguments::of(std::env::args_os()).unwrap_or_else(|error| misused(&error));
    arguments.color.write_global();
    let Arguments { json, quiet, progress, .. } = arguments;
    let output = Output { json, quiet, progress };
    match run(arguments.command, output) {
        Ok(code) => code,
        Err(error) => {
            output.error(&error);
            ExitCode::FAILURE
        }
    }
}

/// Prints the error of the command line, which a shell may have filled with names of files, or the
/// requested help.
fn misused(error: &clap::Error) -> ! {
    let words = std::env::args_os().map(|word| output::shown(&word.to_string_lossy()).into_owned());
    match Arguments::of(words) {
        Err(plain) if plain.kind() == error.kind() => plain.exit(),
        _ => error.exit(),
    }
}

/// Suppresses the messages of panics of other crates' readers on damaged logs, which are caught and
/// reported as errors.
fn keep_readers_quiet() {
    let print = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !seaplant_log::is_guarded() || cfg!(panic = "abort") {
            print(panic);
        }
    }));
}

fn run(command: Command, output: Output) -> anyhow::Result<ExitCode> {
    match command {
        Command::Demo(arguments) => commands::demo::run(&arguments, output),
        Command::Init(arguments) => commands::init::run(&arguments, output),
        Command::Inspect(arguments) => commands::inspect::run(&arguments, output),
        Command::Plot(arguments) => commands::plot::run(&arguments, output),
        Command::Identify(arguments) => commands::identify::run(&arguments, output),
        Command::Simulate(arguments) => commands::simulate::run(&arguments, output),
        Command::Validate(arguments) => commands::validate::run(&arguments, output),
        Command::Compare(arguments) => commands::compare::run(&arguments, output),
        Command::Export(arguments) => commands::export::run(&arguments, output),
        Command::Control(arguments) => commands::control::run(&arguments, output),
        #[cfg(not(target_family = "wasm"))]
        Command::Plan(arguments) => commands::plan::run(&arguments, output),
        #[cfg(not(target_family = "wasm"))]
        Command::Page(arguments) => commands::page::run(&arguments, output),
        #[cfg(not(target_family = "wasm"))]
        Command::Watch(arguments) => commands::watch::run(&arguments, output),
        Command::Thruster(arguments) => commands::thruster::run(&arguments, output),
        Command::Twin(arguments) => commands::twin::run(&arguments, output),
        Command::MonteCarlo(arguments) => commands::monte_carlo::run(&arguments, output),
        Command::Schema(arguments) => commands::schema::run(&arguments),
        Command::Completions(arguments) => commands::completions::run(&arguments),
        Command::Vehicle(arguments) => commands::vehicle::run(&arguments, output),
        Command::Man(arguments) => commands::man::run(&arguments, output),
    }
}
