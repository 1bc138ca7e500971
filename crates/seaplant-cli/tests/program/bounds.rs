//! Inputs that would take forever, or exhaust memory: refused at once with a message.
//!
//! No test measures time: the runner of the tests ends one that hangs.

use crate::workshop::{Workshop, assert_within, number};

const QUADRATIC: &str = "forward = 0.04, reverse = 0.04";

/// Writes the sled's log with its column of propeller speed as a force, and one number replaced.
fn with_wrench(workshop: &Workshop, number: &str) {
    workshop.change("log.csv", "prop [rpm]", "tau [N]");
    workshop.change(
        "campaign.toml",
        "\"thruster.prop.speed\" = { column = \"prop\" }",
        "\"wrench.surge\" = { column = \"tau\" }",
    );
    let text = workshop.read("log.csv");
    let rows =
        text.lines().enumerate().map(|(k, row)| match row.split(',').collect::<Vec<_>>()[..] {
            [time_s, _, speed] if k == 601 => format!("{time_s},{number},{speed}\n"),
            _ => format!("{row}\n"),
        });
    workshop.write("log.csv", rows.collect::<String>());
}

#[test]
fn a_force_whose_square_overflows_is_refused_with_its_time() {
    for number in ["1e154", "-1.7976931348623157e308"] {
        let workshop = Workshop::new();
        with_wrench(&workshop, number);
        let message = workshop.refusal();
        let start = "trial `run 1`, wrench.surge: column `tau` holds ";
        assert!(message.starts_with(start), "{message}");
        let end = " N at 60 s, which no vehicle has; check the unit, and drop faulty samples";
        assert!(message.ends_with(end), "{message}");
    }
}

#[test]
fn a_curve_whose_forces_overflow_is_refused_in_its_line() {
    for number in ["1e154", "1e300"] {
        let workshop = Workshop::new();
        let law = format!("forward = {number}, reverse = 0.04");
        workshop.change("vehicle.toml", QUADRATIC, &law);
        let message = workshop.refusal();
        assert!(message.contains("curve: holds a number above 1e9; check its unit"), "{message}");
        assert!(message.ends_with("^^^^^"), "{message}");
    }
}

#[test]
fn speeds_whose_squares_overflow_end_every_method() {
    let workshop = Workshop::new();
    let text = workshop.read("log.csv");
    let rows = text.lines().enumerate().map(|(k, row)| match row.rsplit_once(',') {
        Some((before, _)) if k > 600 => format!("{before},1.7e308\n"),
        _ => format!("{row}\n"),
    });
    workshop.write("log.csv", rows.collect::<String>());
    let words = "the surge trial holds numbers so large that their squares are not finite";
    for method in seaplant::Method::ALL {
        let words_given = ["identify", "campaign.toml", "--out", "out", "--method", method.name()];
        let message = workshop.failure(&words_given);
        assert!(message.contains(words), "{method}: {message}");
    }
}

#[cfg(unix)]
#[test]
fn a_pipe_or_a_device_is_no_file_to_read() {
    let no_file = "is a pipe or a device, not a regular file; save its content to a file and \
                   name that";
    for name in ["log.csv", "vehicle.toml", "campaign.toml"] {
        let workshop = Workshop::new();
        std::fs::remove_file(workshop.join(name)).expect("a file");
        let made = std::process::Command::new("mkfifo").arg(workshop.join(name)).status();
        assert!(made.expect("mkfifo runs").success());
        let refused = workshop.seaplant(&["identify", "campaign.toml"]).assert().code(1);
        let said = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
        assert!(said.trim_end().ends_with(&format!("{name} {no_file}")), "{said}");
    }
    let workshop = Workshop::new();
    for words in [
        &["identify", "/dev/zero"][..],
        &["inspect", "/dev/zero"],
        &["init", "/dev/zero", "--out", "begun"],
        &["thruster", "/dev/zero"],
        &["twin", "/dev/zero", "--out", "out"],
        &["validate", "/dev/zero", "campaign.toml"],
        &["compare", "/dev/zero", "/dev/zero"],
        &["simulate", "/dev/zero", "log.csv"],
    ] {
        let message = workshop.failure(words);
        assert!(message.ends_with(&format!("/dev/zero {no_file}")), "{words:?}: {message}");
    }
}

#[cfg(unix)]
#[test]
fn a_file_of_settings_that_is_far_too_large_is_not_read() {
    let workshop = Workshop::new();
    let file = std::fs::File::create(workshop.join("large.toml")).expect("a file");
    // The file is sparse.
    file.set_len(1 << 40).expect("a sparse file");
    let message = workshop.seaplant(&["identify", "large.toml"]).assert().code(1);
    let said = String::from_utf8_lossy(&message.get_output().stderr).into_owned();
    assert!(
        said.contains("large.toml is larger than 64 MB, too large for this kind of file"),
        "{said}"
    );
}

#[test]
fn no_more_threads_are_made_than_a_system_has() {
    let workshop = Workshop::empty();
    let words = ["monte-carlo", "--runs", "1", "--threads", "1000000000"];
    let refused = workshop.seaplant(&words).assert().code(2);
    let said = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
    assert!(said.contains("1000000000 is not in 1..=1024"), "{said}");
}

#[test]
fn settings_of_one_axis_are_refused_for_several_axes() {
    let workshop = Workshop::empty();
    workshop.write("whole.toml", "vehicle = \"published:rexrov\"\n");
    for (option, what_to_do) in [
        (["--dof", "surge"], "state `axes` in its file"),
        (["--method", "paper"], "fitted by filter error: leave it out"),
    ] {
        let words = ["monte-carlo", "whole.toml", option[0], option[1]];
        let refused = workshop.seaplant(&words).assert().code(1);
        let said = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
        assert!(said.contains("this twin has `vehicle`"), "{said}");
        assert!(said.contains(what_to_do), "{said}");
    }
}

#[test]
fn a_gap_of_a_year_is_no_trial_but_either_side_of_it_is() {
    let workshop = Workshop::quick();
    let sound = workshop.json(&["identify", "campaign.toml", "--json"]);
    let text = workshop.read("log.csv");
    let later = text.lines().skip(1).map(|row| {
        let (time_s, rest) = row.split_once(',').expect("a row");
        format!("{:.1},{rest}\n", time_s.parse::<f64>().expect("a time") + 3.2e7)
    });
    workshop.write("log.csv", text.clone() + &later.collect::<String>());
    workshop.success(&["inspect", "log.csv"]);
    let message = workshop.refusal();
    let words = "velocity.surge has no sample from 119.9 to 32000000.0 s, which is more than a day; \
                 make a trial of each part by from_s and to_s";
    assert!(message.contains(words) && message.ends_with("^^^^^^^"), "{message}");
    workshop.change("campaign.toml", "[channels]", "to_s = 3600.0\n[channels]");
    let found = workshop.json(&["identify", "campaign.toml", "--json"]);
    let mass = |found| number(found, "plants.surge.by_axis.surge.mass.value");
    // The same samples, except for the thrust that is held past the last.
    assert_within("mass", mass(&found), mass(&sound), 1e-3);
}

#[test]
fn a_campaign_of_too_many_trials_is_refused_before_its_logs_are_read() {
    let workshop = Workshop::new();
    let campaign = workshop.read("campaign.toml");
    let (head, rest) = campaign.split_once("[[trial]]").expect("a trial");
    let (_, tail) = rest.split_once("[channels]").expect("channels");
    let trial = |k: usize| format!("[[trial]]\nname = \"t{k}\"\nlog = \"absent.csv\"\n");
    let trials: String = (0..10_001).map(trial).collect();
    workshop.write("campaign.toml", format!("{head}{trials}[channels]{tail}"));
    let message = workshop.refusal();
    let words = "trial: makes more than 10000 trials; split the campaign";
    assert!(message.contains(words), "{message}");
}
