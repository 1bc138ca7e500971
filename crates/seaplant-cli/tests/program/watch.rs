//! A campaign that is identified again whenever one of its files changes.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};

use crate::workshop::{Workshop, lively, log};

/// Starts `watch` for two identifications.
fn watching(workshop: &Workshop) -> Child {
    let words = ["watch", "campaign.toml", "--out", "out", "--rounds", "2", "--settle-s", "0.1"];
    Command::new(assert_cmd::cargo::cargo_bin!("seaplant"))
        .current_dir(workshop.path())
        .args(words)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts")
}

/// Returns the output until it waits, and a reader of the rest.
fn until_it_waits(child: &mut Child) -> (String, BufReader<std::process::ChildStdout>) {
    let mut said = BufReader::new(child.stdout.take().expect("standard output"));
    let mut text = String::new();
    while !text.contains("waiting for a change") {
        let read = said.read_line(&mut text).expect("UTF-8");
        assert!(read > 0, "it ended: {text}");
    }
    (text, said)
}

#[test]
fn a_changed_log_is_identified_again() {
    let workshop = Workshop::quick();
    let mut child = watching(&workshop);
    let (first, mut rest) = until_it_waits(&mut child);
    assert!(first.contains("surge by equation-error"), "{first}");
    workshop.write("log.csv", log(|t| 0.8 * lively(t)));
    let mut second = String::new();
    rest.read_to_string(&mut second).expect("UTF-8");
    assert!(child.wait().expect("it ends").success());
    assert!(second.contains("changed: log.csv"), "{second}");
    assert!(
        second.contains("surge mass.surge: ") && second.contains("standard deviations"),
        "{second}"
    );
}

#[test]
fn a_campaign_that_is_broken_is_waited_for() {
    let workshop = Workshop::quick();
    let sound = workshop.read("campaign.toml");
    workshop.change("campaign.toml", "velocity.surge", "velcity.surge");
    let mut child = watching(&workshop);
    let (_, mut rest) = until_it_waits(&mut child);
    workshop.write("campaign.toml", &sound);
    let mut second = String::new();
    rest.read_to_string(&mut second).expect("UTF-8");
    assert!(child.wait().expect("it ends").success());
    assert!(second.contains("changed: campaign.toml"), "{second}");
    let mut errors = String::new();
    child.stderr.take().expect("standard error").read_to_string(&mut errors).expect("UTF-8");
    assert!(errors.contains("did you mean `velocity.surge`?"), "{errors}");
}
