//! Output streams, and the command line.

use std::io::Read;
use std::process::Stdio;

use predicates::prelude::*;
use seaplant::Method;
use serde_json::Value;

use crate::workshop::{Workshop, seaplant};

#[test]
fn without_a_command_help_is_shown_as_for_a_mistake() {
    let says = predicate::str::contains("Usage: seaplant [OPTIONS] <COMMAND>")
        .and(predicate::str::contains("Start with `seaplant demo`"));
    seaplant().assert().code(2).stdout("").stderr(says);
}

#[test]
fn version_states_the_commit() {
    let version = concat!("seaplant ", env!("CARGO_PKG_VERSION"));
    seaplant().arg("-V").assert().success().stdout(format!("{version}\n"));
    let whole = predicate::str::starts_with(format!("{version}; commit "))
        .and(predicate::str::contains("rustc 1."));
    seaplant().arg("--version").assert().success().stdout(whole);
}

/// Returns the commands that the help lists.
fn commands() -> Vec<String> {
    let help = seaplant().arg("--help").assert().success().get_output().clone();
    let help = String::from_utf8(help.stdout).expect("UTF-8");
    let listed = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let commands: Vec<String> = listed
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.split_whitespace().next())
        .filter(|command| *command != "help")
        .map(str::to_owned)
        .collect();
    assert!(commands.len() > 10, "{commands:?}");
    commands
}

#[test]
fn every_command_has_help_with_its_usage() {
    for command in commands() {
        let usage = format!("Usage: seaplant {command}");
        let says = predicate::str::contains(usage);
        seaplant().args([&command, "--help"]).assert().success().stdout(says);
    }
}

#[test]
fn help_names_every_method() {
    let names = Method::ALL.map(Method::name).join(", ");
    let one = format!("[possible values: {names}]");
    let several = format!("[possible values: {names}, all]");
    for (command, says) in
        [("identify", &several), ("monte-carlo", &several), ("simulate", &one), ("validate", &one)]
    {
        let says = predicate::str::contains(says);
        seaplant().args([command, "-h"]).env("COLUMNS", "300").assert().success().stdout(says);
    }
}

/// Asserts that an invalid command line has an exit code of its own.
fn misuse(words: &[&str], says: &str) {
    let workshop = Workshop::new();
    let before = workshop.everything();
    let hint = predicate::str::contains("For more information, try '--help'.");
    let says = predicate::str::contains(says).and(hint);
    workshop.seaplant(words).assert().code(2).stdout("").stderr(says);
    assert_eq!(workshop.everything(), before, "something was written");
}

#[test]
fn an_invalid_method_is_misuse() {
    misuse(
        &["identify", "campaign.toml", "--method", "papper"],
        "tip: a similar value exists: 'paper'",
    );
}

#[test]
fn an_invalid_term_is_misuse() {
    misuse(
        &["identify", "campaign.toml", "--terms", "force,cubic"],
        "unknown term `cubic`; expected force, quadratic, linear or bias",
    );
}

#[test]
fn terms_that_make_no_plant_are_misuse() {
    misuse(
        &["identify", "campaign.toml", "--terms", "quadratic,bias"],
        "the terms [quadratic, bias] do not make a plant model; keep `force` and at least one of \
         quadratic and linear",
    );
}

#[test]
fn an_invalid_disturbance_is_misuse() {
    misuse(
        &["demo", "--disturbances", "storm"],
        "it must be none, all, or some of tether, current, lag, delay, thrcoef, lever, swell, \
         inflow",
    );
}

#[test]
fn an_invalid_degree_of_freedom_is_misuse() {
    misuse(
        &["simulate", "results.json", "log.csv", "--dof", "rol"],
        "[possible values: surge, sway, heave, roll, pitch, yaw]",
    );
}

#[test]
fn quiet_prints_nothing() {
    let workshop = Workshop::quick();
    let pull = "speed [rad/s],thrust [N]\n-20,-4\n-10,-1\n0,0\n10,1\n20,4\n";
    workshop.write("pull.csv", pull);
    workshop.write("twin.toml", "dofs = [\"surge\"]\nduration_s = 60.0\n");
    for words in [
        &["identify", "campaign.toml", "--out", "out", "--quiet"][..],
        &["--quiet", "validate", "out/results.json", "campaign.toml"],
        &["simulate", "out/results.json", "log.csv", "--out", "run.csv", "-q"],
        &["thruster", "pull.csv", "-q"],
        &["inspect", "log.csv", "-q"],
        &["init", "log.csv", "--out", "begun", "-q"],
        &["twin", "twin.toml", "--out", "logs", "-q"],
        &["man", "--out", "man", "-q"],
    ] {
        assert_eq!(workshop.success(words), "", "{words:?}");
    }
}

#[test]
fn quiet_still_says_what_failed() {
    let workshop = Workshop::new();
    workshop.write("log.csv", crate::workshop::log(|_| 80.0));
    let words = ["identify", "campaign.toml", "--quiet"];
    assert!(workshop.failure(&words).contains("excites 2 of the 3 requested terms"));
}

#[test]
fn json_is_all_that_is_printed() {
    let workshop = Workshop::quick();
    let pull = "speed [rad/s],thrust [N]\n-20,-4\n-10,-1\n0,0\n10,1\n20,4\n";
    workshop.write("pull.csv", pull);
    workshop.write("twin.toml", "dofs = [\"surge\"]\nduration_s = 60.0\n");
    for words in [
        &["identify", "campaign.toml", "--out", "out", "--json"][..],
        &["validate", "out/results.json", "campaign.toml", "--json"],
        &["simulate", "out/results.json", "log.csv", "--json"],
        &["simulate", "out/results.json", "log.csv", "--json", "--out", "run.csv"],
        &["thruster", "pull.csv", "--json"],
        &["inspect", "log.csv", "--json"],
        &["init", "log.csv", "--out", "begun", "--json"],
        &["twin", "twin.toml", "--out", "logs", "--json"],
    ] {
        let value = workshop.json(words);
        assert!(value.is_object() || value.is_array(), "{words:?}");
    }
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let workshop = Workshop::quick();
    workshop.success(&["identify", "campaign.toml", "--out", "out", "-q"]);
    for words in [
        &["identify", "campaign.toml", "--out", "out"][..],
        &["identify", "campaign.toml", "--out", "out", "--json"],
        &["simulate", "out/results.json", "log.csv"],
        &["schema", "results"],
        &["completions", "bash"],
        &["--help"],
    ] {
        let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin!("seaplant"))
            .args(words)
            .current_dir(workshop.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        drop(child.stdout.take());
        let mut said = String::new();
        let mut stderr = child.stderr.take().expect("a pipe");
        stderr.read_to_string(&mut said).expect("UTF-8");
        assert!(child.wait().expect("it ends").success(), "{words:?}: {said}");
        assert_eq!(said, "", "{words:?}");
    }
}

#[test]
fn colour_is_as_requested() {
    const ESCAPE: char = '\u{1b}';
    let workshop = Workshop::quick();
    let identify = |when: &str| {
        workshop.success(&["identify", "campaign.toml", "--out", "out", "--color", when])
    };
    assert!(identify("always").contains(ESCAPE));
    assert!(!identify("never").contains(ESCAPE));
    // Not a terminal.
    assert!(!identify("auto").contains(ESCAPE));
    let error = workshop.failure(&["identify", "none.toml", "--color", "never"]);
    assert!(!error.contains(ESCAPE));
}

#[test]
fn the_summary_contains_mass_drag_doubts_and_the_path_of_the_report() {
    let workshop = Workshop::new();
    let text = workshop.success(&["identify", "campaign.toml", "--out", "out"]);
    for part in [
        "surge by filter-error: ",
        "  mass ",
        "  quadratic drag ",
        " kg ",
        "for a model that never moves",
        "report   out/report.html",
        "numbers  out/results.json",
    ] {
        assert!(text.contains(part), "{part:?} is not in\n{text}");
    }
}

#[test]
fn a_velocity_of_the_wrong_sign_is_not_to_be_used() {
    let workshop = Workshop::new();
    workshop.change("campaign.toml", "\"speed\" }", "\"speed\", negate = true }");
    let words = ["identify", "campaign.toml", "--method", "equation-error", "--out", "out"];
    let text = workshop.failure(&words);
    assert!(text.contains("no plant could be identified"), "{text}");
    assert!(text.contains("thrust in surge seems reversed"), "{text}");
    assert!(text.contains("and the sign of velocity"), "{text}");
}

#[test]
fn every_schema_is_one() {
    for kind in ["results", "vehicle", "campaign", "twin"] {
        let output = seaplant().args(["schema", kind]).assert().success().get_output().clone();
        let schema: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        // A twin has one axis at a time or several together.
        assert!(schema["properties"].is_object() || schema["anyOf"].is_array(), "{kind}");
        assert!(schema["$schema"].is_string(), "{kind}");
    }
}

#[test]
fn shells_get_a_completion_script() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let asks = predicate::str::contains("SEAPLANT_COMPLETE");
        seaplant().args(["completions", shell]).assert().success().stdout(asks);
    }
}

#[cfg(unix)]
#[test]
fn bash_completes_commands_files_and_published_tables() {
    let workshop = Workshop::empty();
    workshop.write("results.json", "{}");
    let bin = assert_cmd::cargo::cargo_bin!("seaplant");
    let folder = bin.parent().expect("a folder").display();
    let completed = |words: &[&str]| {
        let script = format!(
            "PATH=\"{folder}:$PATH\"; . <(seaplant completions bash); COMP_WORDS=({all}); COMP_CWORD={at}; _clap_complete_seaplant seaplant '{last}' x 2> /dev/null; printf '%s\\n' \"${{COMPREPLY[@]}}\"",
            all = words.join(" "),
            at = words.len() - 1,
            last = words[words.len() - 1],
        );
        let ran = std::process::Command::new("bash")
            .args(["-c", &script])
            .current_dir(workshop.path())
            .output()
            .expect("bash runs");
        String::from_utf8(ran.stdout).expect("text")
    };
    assert_eq!(completed(&["seaplant", "ident"]).trim(), "identify");
    assert_eq!(completed(&["seaplant", "export", "published:rex"]).trim(), "published:rexrov");
    assert_eq!(completed(&["seaplant", "compare", "a", "resu"]).trim(), "results.json");
    let offered = completed(&["seaplant", "control", "published:b"]);
    assert!(offered.lines().count() > 1, "{offered}");
    assert!(offered.lines().all(|name| name.starts_with("published:bluerov2")), "{offered}");
}

#[test]
fn every_command_has_a_manual_page() {
    let workshop = Workshop::empty();
    workshop.success(&["man", "--out", "man"]);
    let main = workshop.read("man/seaplant.1");
    assert!(main.contains(".TH seaplant 1"), "{main}");
    for command in commands() {
        let page = workshop.read(&format!("man/seaplant-{command}.1"));
        assert!(page.contains(".SH SYNOPSIS"), "{command}: {page}");
    }
}

/// Control characters of terminals: escape, its eight-bit form, a carriage return, and the reversal
/// of writing direction.
const COMMANDS: [char; 4] = ['\u{1b}', '\u{9b}', '\r', '\u{202e}'];

fn assert_obeyed_by_no_terminal(words: &[&str], output: &std::process::Output) {
    for bytes in [&output.stdout, &output.stderr] {
        let text = String::from_utf8_lossy(bytes);
        let found = text.find(|c: char| c.is_control() && c != '\n');
        assert!(found.is_none() && !text.contains(COMMANDS), "{words:?}: {text:?}");
    }
}

#[test]
fn names_of_foreign_files_reach_no_terminal_but_as_text() {
    let evil = "a\u{1b}]0;owned\u{7}\u{9b}2J\u{202e}b";
    let workshop = Workshop::quick();
    let header = format!("{evil}\r\n,time [s]");
    workshop.write(
        "odd.csv",
        workshop
            .read("log.csv")
            .replacen("time [s]", "time [s],\"x\r\ny\"", 1)
            .replace("speed [m/s]", &format!("speed [m/s],{evil}")),
    );
    workshop.write("no-time.csv", format!("{header}\n1\n2\n").replace(",time [s]", ""));
    workshop.write(&format!("{}.csv", evil.replace('/', "")), workshop.read("log.csv"));
    let file = format!("{}.csv", evil.replace('/', ""));
    let toml = format!("# {evil}\nvehicle = {evil}\n").replace('\u{7}', "");
    workshop.write("broken.toml", toml);
    workshop.write("trial.toml", workshop.read("campaign.toml").replace("run 1", "run \\u001b[2J"));
    workshop.write("bidi.toml", workshop.read("campaign.toml").replace("run 1", "run \u{202e}"));
    for words in [
        &["inspect", "odd.csv"][..],
        &["inspect", "odd.csv", "--json"],
        &["inspect", "no-time.csv"],
        &["inspect", &file],
        &["inspect", &file, "--json"],
        &["init", "odd.csv", "--out", "begun"],
        &["identify", "broken.toml"],
        &["identify", "broken.toml", "--json"],
        &["identify", "trial.toml"],
        &["identify", "bidi.toml"],
        &["identify", "bidi.toml", "--json"],
        &["identify", "campaign.toml", "--out", evil],
        &["thruster", "no-time.csv"],
        &["schema", evil],
        &["identify", "campaign.toml", "--method", evil],
        &["demo", "--disturbances", evil],
        &[evil],
    ] {
        let output = workshop.seaplant(words).output().expect("it runs");
        assert_obeyed_by_no_terminal(words, &output);
    }
    let shown = workshop.seaplant(&["identify", "trial.toml"]).output().expect("it runs");
    let said = String::from_utf8_lossy(&shown.stderr).into_owned();
    assert!(said.contains("its name holds a line break or another control character"), "{said}");
}
