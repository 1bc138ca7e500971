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
}

#[test]
fn what_cannot_be_is_told_with_what_would_do() {
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
    assert!(fails(&["--bandwidth", "surge -1 Hz"]).contains("above zero"));
    assert!(fails(&["--lqr", "surge 0.1 m"]).contains("surge 0.1 m 400 N"));
    let output = seaplant().args(["control", BLUEROV, "--law", "magic"]).output().expect("runs");
    assert_eq!(output.status.code(), Some(2));
}
