//! Two files of one trial whose clocks differ, as a user detects and corrects it.

use crate::workshop::{Workshop, number};

/// Lag of the DVL's clock, s.
const BEHIND_S: f64 = 41.25;

fn rate(t: f64) -> f64 {
    4.0 * (0.31 * t + 3.0 * (0.05 * t).sin()).sin() + 2.0 * (0.83 * t + 0.0021 * t * t).cos()
}

/// Makes a workshop with an autopilot's gyroscope, and a DVL with a compass.
fn workshop() -> Workshop {
    let workshop = Workshop::empty();
    let (mut gyro, mut dvl) =
        ("time [s],yaw rate [deg/s]\n".to_owned(), "time [s],heading [deg]\n".to_owned());
    let mut heading = 100.0;
    for k in 0..4000 {
        let t = 0.05 * f64::from(k);
        gyro += &format!("{t:.2},{:.4}\n", rate(t));
        if k % 2 == 0 {
            dvl += &format!("{:.2},{heading:.4}\n", t - BEHIND_S);
        }
        heading += 0.05 * rate(t + 0.025);
    }
    workshop.write("autopilot.csv", gyro);
    workshop.write("dvl.csv", dvl);
    workshop
}

#[test]
fn inspect_reports_clock_offsets_and_the_campaign_line() {
    let workshop = workshop();
    let words = workshop.success(&["inspect", "autopilot.csv", "dvl.csv"]);
    for says in [
        "clock of autopilot.csv: seconds since a start that is not stated, 0.000 to 199.950",
        "dvl.csv and autopilot.csv: overlap by 158.7 s with the recorded clocks",
        "by their measurements, move dvl.csv by +41.25",
        "the rate of attitude.heading",
        "in campaign.toml, under [[trial]]: offset_s = { \"dvl.csv\" = 41.25",
    ] {
        assert!(words.contains(says), "{says}: {words}");
    }
    let found = workshop.json(&["inspect", "autopilot.csv", "dvl.csv", "--json"]);
    let offset_s = number(&found["offsets"][0], "clock.offset_s");
    let std_s = number(&found["offsets"][0], "clock.std_s");
    assert!((offset_s - BEHIND_S).abs() < 0.01 && std_s < 0.01, "{offset_s} {std_s}");
    assert_eq!(found["files"][1]["epoch"], "unstated");
}

#[test]
fn one_file_has_no_clock_to_be_compared_with() {
    let workshop = workshop();
    let words = workshop.success(&["inspect", "autopilot.csv"]);
    assert!(!words.contains("clock"), "{words}");
}
