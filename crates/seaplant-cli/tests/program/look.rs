//! Views of logs before a fit: `plot`, and `inspect` with many columns.

use crate::workshop::Workshop;

#[test]
fn a_log_is_drawn_in_the_terminal_with_its_range() {
    let workshop = Workshop::new();
    let words = workshop.success(&["plot", "log.csv"]);
    let lines: Vec<&str> = words.lines().collect();
    assert!(lines[0].starts_with("prop [rpm]") && lines[0].contains('█'), "{words}");
    assert!(lines[1].starts_with("speed [m/s]") && lines[1].ends_with("m/s"), "{words}");
    assert_eq!(lines[2], "over 119.9 s");
}

#[test]
fn a_page_of_a_log_is_written_known_again_and_never_over_the_log() {
    let workshop = Workshop::new();
    workshop.success(&["plot", "log.csv", "--only", "speed", "--out", "look.html", "--quiet"]);
    let page = workshop.read("look.html");
    assert!(page.contains("speed [m/s]") && !page.contains("prop [rpm]"), "a page of one channel");
    assert!(page.contains("data-logs=\"[&quot;log.csv&quot;]\""), "the log as a campaign names it");
    workshop.success(&["plot", "log.csv", "--out", "look.html", "--quiet"]);
    let refused = workshop.failure(&["plot", "log.csv", "--out", "log.csv", "--force"]);
    assert!(refused.contains("log.csv is an input and would be overwritten"), "{refused}");
    let refused = workshop.failure(&["plot", "log.csv", "--out", "campaign.toml"]);
    assert!(refused.contains("campaign.toml"), "{refused}");
}

#[test]
fn a_channel_that_is_not_there_is_said() {
    let workshop = Workshop::new();
    for command in ["plot", "inspect"] {
        let refused = workshop.failure(&[command, "log.csv", "--only", "sonar"]);
        assert!(refused.contains("name contains sonar"), "{refused}");
    }
}

/// Makes a log of an autopilot: many columns of few topics, since 1970.
fn wide() -> Workshop {
    let workshop = Workshop::new();
    let names = |topic: &str| (0..15).map(|k| format!(",{topic}.f{k} [m]")).collect::<String>();
    let mut text = format!("time [s]{}{},X.still [m]\n", names("ATT"), names("RCOU"));
    for row in 0..50 {
        text += &format!("{:.1}", 1.7e9 + 0.1 * f64::from(row));
        (0..30).for_each(|column| text += &format!(",{}", (row * 7 + column) % 5));
        text += ",3\n";
    }
    workshop.write("wide.csv", text);
    workshop
}

#[test]
fn many_columns_are_grouped_by_topic_with_constants_in_a_line_and_relative_times() {
    let words = wide().success(&["inspect", "wide.csv"]);
    assert!(words.contains("starts 2023-11-14 22:13:20 UTC, lasts 4.90 s"), "{words}");
    let topics: Vec<&str> =
        words.lines().map(str::trim).filter(|l| ["ATT", "RCOU"].contains(l)).collect();
    assert_eq!(topics, ["ATT", "RCOU"], "{words}");
    let row = words.lines().find(|line| line.contains("  f3 [m]")).expect("a row");
    let cells: Vec<&str> = row.split_whitespace().collect();
    assert_eq!(cells[5..7], ["0", "4.90000"], "{row}");
    assert!(words.contains("constant: X.still [m] = 3.000 m"), "{words}");
}

#[test]
fn only_requested_columns_are_shown() {
    let words = wide().success(&["inspect", "wide.csv", "--only", "att.f1"]);
    assert!(words.contains("ATT.f1 [m]") && words.contains("ATT.f14 [m]"), "{words}");
    assert!(!words.contains("RCOU") && !words.contains("X.still"), "{words}");
}

#[test]
fn a_pattern_makes_a_trial_of_each_run() {
    let workshop = Workshop::quick();
    let log = workshop.read("log.csv");
    workshop.write("runs/a.csv", &log);
    workshop.write("runs/b.csv", &log);
    workshop.change("campaign.toml", "log = \"log.csv\"", "log = \"runs/*.csv\"");
    let found = workshop.json(&["identify", "campaign.toml", "--json"]);
    let trials = found["trials"].as_array().expect("trials");
    let names: Vec<&str> = trials.iter().filter_map(|trial| trial["name"].as_str()).collect();
    assert_eq!(names, ["run 1 a", "run 1 b"]);
    // Files that match a pattern are inputs, and are not overwritten.
    let refused = workshop.failure(&[
        "simulate",
        "results",
        "--step",
        "surge 100 N",
        "--for",
        "5",
        "--out",
        "runs/a.csv",
    ]);
    assert!(refused.contains("runs/a.csv"), "{refused}");
    workshop.change("campaign.toml", "runs/*.csv", "runs/*.bag");
    let refused = workshop.failure(&["identify", "campaign.toml"]);
    assert!(refused.contains("runs/*.bag matches no file"), "{refused}");
}
