//! Passes build information to the program, for `seaplant --version`.

use std::path::Path;
use std::process::Command;

fn main() {
    let said = |program: &str, words: &[&str]| {
        let output = Command::new(program).args(words).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        output.status.success().then(|| text.trim().to_owned())
    };
    let variable = |name| std::env::var(name).unwrap_or_else(|_| "unknown".to_owned());
    // A package from a registry has no git history.
    let commit = said("git", &["rev-parse", "--short=12", "HEAD"]);
    let compiler = said(&variable("RUSTC"), &["--version"]).unwrap_or_default();
    let build = format!(
        "{}; commit {}; {}, {}, {compiler}",
        variable("CARGO_PKG_VERSION"),
        commit.as_deref().unwrap_or("unknown"),
        variable("TARGET"),
        variable("PROFILE"),
    );
    println!("cargo::rustc-env=SEAPLANT_BUILD={build}");
    println!("cargo::rerun-if-changed=build.rs");
    // Changes with every commit.
    if let Some(log) = said("git", &["rev-parse", "--git-path", "logs/HEAD"])
        && Path::new(&log).exists()
    {
        println!("cargo::rerun-if-changed={log}");
    }
}
