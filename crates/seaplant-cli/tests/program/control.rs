//! `seaplant control`.

use serde_json::Value;

use crate::workshop::{Workshop, seaplant};

const BLUEROV: &str = "published:bluerov2-heavy-von-benzon-2022";

#[test]
fn a_controller_is_written_with_its_margins() {
    let workshop = Workshop::empty();
    let words = [
        "control",
        BLUEROV,
        "--bandwidth",
        "surge 0.1 Hz",
        "--bandwidth",
        "yaw 0.15 Hz",
        "--limit",
        "yaw 10 N m",
        "--out",
        "made",
        "--json",
    ];
    let printed = workshop.success(&words);
    let found: Value = serde_json::from_str(&printed).expect("JSON");
    let surge = &found["gains"]["axes"]["surge"];
    // M11 of the table: 13.5 + 6.36 kg.
    let expected = 19.86 * (std::f64::consts::TAU * 0.1).powi(2);
    assert!((surge["kp"].as_f64().expect("a number") - expected).abs() < 1e-6, "{surge}");
    assert!(surge["margins"]["phase_deg"].as_f64().expect("a number") > 60.0);
    let written: Value = serde_json::from_str(&workshop.read("made/control.json")).expect("JSON");
    assert_eq!(written["axes"]["surge"], *surge);
    assert!(workshop.read("made/seaplant_control.h").contains("seaplant_plant.h"));
    assert!(workshop.read("made/ardusub.param").contains("ATC_RAT_YAW_P,"));
    let page = workshop.read("made/control.html");
    for words in [
        "<th scope=\"row\">surge</th>",
        "surge: phase of the open loop",
        "yaw: a step",
        "error while it follows a sine",
    ] {
        assert!(page.contains(words), "{words}");
    }
    let step = &found["responses"]["surge"]["step"]["estimate"];
    let end = step.as_array().and_then(|all| all.last()?.as_f64()).expect("a step");
    assert!((end - 0.5).abs() < 0.05, "{end}");
}

#[test]
fn impossible_settings_are_refused_with_valid_ones() {
    let workshop = Workshop::empty();
    let fails = |words: &[&str]| {
        let mut all = vec!["control", BLUEROV];
        all.extend(words);
        workshop.failure(&all)
    };
    assert!(fails(&[]).contains("--bandwidth \"surge 0.05 Hz\""));
    let message = fails(&["--bandwidth", "surge 2 Hz", "--lag", "surge 0.5 s"]);
    assert!(message.contains("Hz would do"), "{message}");
    assert!(fails(&["--bandwidth", "surge 0.1 m"]).contains("surge is in Hz"));
    assert!(fails(&["--bandwidth", "surge 0.1"]).contains("has no unit; write \"surge 0.1 Hz\""));
    assert!(fails(&["--bandwidth", "surge -1 Hz"]).contains("above zero"));
    assert!(fails(&["--lqr", "surge 0.1 m"]).contains("surge 0.1 m 400 N"));
    let output = seaplant().args(["control", BLUEROV, "--law", "magic"]).output().expect("runs");
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn settings_that_would_take_hours_are_refused_at_once() {
    let workshop = Workshop::empty();
    for (words, told) in [
        (["--delay", "surge 1e12 s"], "the surge delay, s, is 1000000000000; it must be from 0 to"),
        (["--delay", "roll 1e7 s"], "the roll delay, s, is 10000000; it must be from 0 to"),
        (
            ["--sample-hz", "1e12"],
            "the sampling rate, Hz, is 1000000000000; it must be from 0.1 to",
        ),
        (["--sample-hz", "1e-12"], "the sampling rate, Hz, is 0.000000000001; it must be from 0.1"),
        (
            ["--bandwidth", "surge 1e-12 Hz"],
            "the surge bandwidth, Hz, is 0.000000000001; it must be",
        ),
    ] {
        let words = [&["control", BLUEROV, "--bandwidth", "surge 0.1 Hz"], &words[..]].concat();
        for anyway in [&[][..], &["--anyway"]] {
            let message = workshop.failure(&[&words[..], anyway].concat());
            assert!(message.starts_with(told), "{message}");
        }
    }
}

/// Makes the sled's results with another verdict on surge.
fn judged(trust: &str, reason: &str) -> Workshop {
    let workshop = Workshop::quick();
    workshop.success(&["identify", "campaign.toml", "--quiet"]);
    let results = workshop.read("results/results.json");
    let mut json: Value = serde_json::from_str(&results).expect("JSON");
    let verdict = &mut json["plants"]["surge"]["verdict"];
    (verdict["trust"], verdict["reason"]) = (trust.into(), reason.into());
    workshop.write("judged.json", json.to_string());
    workshop
}

#[test]
fn a_plant_that_should_not_be_used_gets_no_controller_unless_it_carries_the_reasons() {
    let workshop = judged("do-not-use", "it has wheels");
    let mut words = vec!["control", "judged.json", "--bandwidth", "surge 0.02 Hz", "--out", "made"];
    let message = workshop.failure(&words);
    assert!(message.contains("it has wheels") && message.contains("--anyway"), "{message}");
    assert!(!workshop.join("made").exists());
    words.push("--anyway");
    workshop.success(&words);
    for file in ["control.toml", "seaplant_control.h", "control.html"] {
        assert!(workshop.read(&format!("made/{file}")).contains("it has wheels"), "{file}");
    }
}

#[test]
fn a_doubtful_plant_says_so_in_the_gains() {
    let workshop = judged("doubtful", "its drag is anything");
    let words = ["control", "judged.json", "--bandwidth", "surge 0.02 Hz", "--out", "made"];
    assert!(workshop.success(&words).contains("its drag is anything"));
    assert!(workshop.read("made/control.toml").contains("its drag is anything"));
}

#[test]
fn a_limit_that_is_reached_is_reported() {
    let workshop = Workshop::empty();
    let words = ["control", BLUEROV, "--bandwidth", "surge 0.2 Hz", "--limit", "surge 5 N"];
    let said = workshop.success(&words);
    assert!(said.contains("at its limit for"), "{said}");
}
