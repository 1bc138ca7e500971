//! Remarks of `inspect` on a channel: each with its cause, and none without.

use seaplant_campaign::{inspect, inspect_survey};
use seaplant_log::{Log, ReadOptions, Thoroughness, survey};

use crate::common::{Folder, column, data, noise, open, timed};

fn remarks(log: &Log) -> Vec<String> {
    let channels = inspect(log).channels;
    channels.into_iter().flat_map(|channel| channel.remarks).collect()
}

fn only(log: &Log) -> String {
    let found = remarks(log);
    assert_eq!(found.len(), 1, "{found:?}");
    found[0].clone()
}

/// Returns a depth that a sensor measures while the vehicle goes up and down: 30 s at 10 Hz.
fn depth() -> Vec<f64> {
    (0..300).map(|k| 5.0 + (0.04 * k as f64).sin() + 0.01 * noise(k)).collect()
}

#[test]
fn clean_channels_have_no_remarks() {
    let sine = |k: usize| (0.05 * k as f64).sin();
    let measured: Vec<f64> = (0..600).map(|k| sine(k) + 0.01 * noise(k)).collect();
    let held: Vec<f64> = (0..600).map(|k| sine(k / 100 * 100)).collect();
    let command: Vec<f64> = (0..600).map(|k| if k < 300 { 0.0 } else { 500.0 * sine(k) }).collect();
    let square: Vec<f64> = (0..600).map(|k| [1420.0, 1500.0, 1580.0][k / 100 % 3]).collect();
    let coarse: Vec<f64> = measured.iter().map(|x| (x / 0.07).round() * 0.07).collect();
    let ramp: Vec<f64> = (0..600).map(|k| (k as f64 / 20.0).floor() * 0.07).collect();
    for (header, values) in [
        ("depth [m]", &measured),
        ("u [m/s]", &measured),
        ("roll [deg]", &measured),
        ("heading [deg]", &measured),
        ("depth [m]", &coarse),
        ("depth [m]", &ramp),
        ("thruster 1 [rpm]", &command),
        ("T1 [us]", &square),
        ("force cmd", &held),
    ] {
        assert_eq!(remarks(&column(header, values)), Vec::<String>::new(), "{header}");
    }
}

#[test]
fn a_constant_channel_is_said_to_be() {
    let found = only(&column("X [m]", &[0.0; 31]));
    assert_eq!(found, "constant: all 31 samples are 0 m");
}

#[test]
fn a_frozen_sensor_is_found_with_its_times() {
    let mut depth = depth();
    let stuck = depth[100];
    depth[100..180].fill(stuck);
    let found = only(&column("depth [m]", &depth));
    assert!(found.starts_with("frozen: ") && found.contains("from 10.00 to 17.90 s (80 samples)"));
}

#[test]
fn a_short_standstill_is_not_frozen() {
    let mut depth = depth();
    let stuck = depth[100];
    depth[100..140].fill(stuck);
    assert_eq!(remarks(&column("depth [m]", &depth)), Vec::<String>::new());
}

#[test]
fn dropouts_written_as_zero_are_found() {
    let mut depth = depth();
    depth[50..53].fill(0.0);
    depth[200] = 0.0;
    let found = only(&column("depth [m]", &depth));
    assert!(found.starts_with("zero-filled: 4 samples in 2 stretches, exactly 0"), "{found}");
    assert!(found.contains("first at 5.00 s"), "{found}");
}

#[test]
fn long_dropouts_written_as_zero_are_not_called_frozen_too() {
    let mut depth = depth();
    depth[50..150].fill(0.0);
    assert!(only(&column("depth [m]", &depth)).starts_with("zero-filled"));
}

#[test]
fn a_velocity_that_passes_zero_is_not_zero_filled() {
    let coarse = |k: usize| ((0.05 * k as f64).sin() * 100.0).round() / 100.0;
    let values: Vec<f64> = (0..600).map(coarse).collect();
    assert_eq!(remarks(&column("u [m/s]", &values)), Vec::<String>::new());
}

#[test]
fn a_clipped_signal_is_saturated() {
    let clipped = |k: usize| (1500.0 + 600.0 * (0.05 * k as f64).sin()).clamp(1100.0, 1900.0);
    let values: Vec<f64> = (0..600).map(|k| clipped(k).round()).collect();
    let found = only(&column("T1 [us]", &values));
    assert!(found.starts_with("saturated: ") && found.contains(" of 600 samples"), "{found}");
}

#[test]
fn a_wrapping_heading_is_said_to_be_unwrapped() {
    let turning: Vec<f64> = (0..600).map(|k| (2.0 * k as f64) % 360.0).collect();
    let found = only(&column("heading [deg]", &turning));
    assert_eq!(found, "wraps 3 times (jumps of about 360 deg); Seaplant unwraps it");
    let radians: Vec<f64> = turning.iter().map(|x| x.to_radians()).collect();
    assert!(only(&column("Yaw (rad)", &radians)).contains("jumps of about 6.2832 rad"));
}

#[test]
fn degrees_under_a_header_of_radians_are_found() {
    let values: Vec<f64> = (0..600).map(|k| 100.0 + 0.1 * k as f64 + noise(k)).collect();
    let found = only(&column("heading [rad]", &values));
    assert!(found.contains("looks like degrees; state unit = \"deg\""), "{found}");
}

#[test]
fn radians_under_a_header_of_degrees_are_found() {
    let pi = std::f64::consts::PI;
    let values: Vec<f64> = (0..600).map(|k| (0.05 * k as f64 + pi) % (2.0 * pi) - pi).collect();
    let found = remarks(&column("heading [deg]", &values));
    assert!(found.iter().any(|r| r.contains("looks like radians")), "{found:?}");
}

#[test]
fn a_roll_or_a_pitch_beyond_what_it_can_be_is_in_degrees() {
    let wave = |k: usize| (0.05 * k as f64).sin() + 0.01 * noise(k);
    let scaled = |by: f64| (0..600).map(|k| by * wave(k)).collect::<Vec<f64>>();
    let found = only(&column("roll [rad]", &scaled(5.0)));
    assert!(found.contains("so it looks like degrees"), "{found}");
    let found = only(&column("pitch [rad]", &scaled(2.5)));
    assert!(found.contains("so it looks like degrees"), "{found}");
    for (header, by) in [("roll [rad]", 2.5), ("pitch [rad]", 1.2), ("roll rate [rad/s]", 5.0)] {
        assert_eq!(remarks(&column(header, &scaled(by))), Vec::<String>::new(), "{header}");
    }
}

#[test]
fn a_step_of_six_degrees_is_neither_a_turn_nor_a_sign_of_radians() {
    let hop = |k: usize| if k > 300 { 6.1 } else { 0.0 };
    let heading = |k: usize| 180.0 + 2.0 * (0.02 * k as f64).sin() + 0.01 * noise(k) + hop(k);
    let heading: Vec<f64> = (0..600).map(heading).collect();
    assert_eq!(remarks(&column("heading [deg]", &heading)), Vec::<String>::new());
}

#[test]
fn a_heading_that_goes_on_is_unwrapped_already() {
    let heading: Vec<f64> = (0..600).map(|k| 2.0 * k as f64 + 0.1 * noise(k)).collect();
    let found = only(&column("heading [deg]", &heading));
    assert_eq!(found, "spans 3.3 turns without a jump: it is unwrapped already");
}

#[test]
fn a_coarse_sensor_is_frozen_where_it_stands_much_longer_than_ever() {
    let coarse = |k: usize| (30.0 * (0.04 * k as f64).sin() + 0.3 * noise(k)).round() / 100.0;
    let mut speed: Vec<f64> = (0..1500).map(coarse).collect();
    assert_eq!(remarks(&column("u [m/s]", &speed)), Vec::<String>::new());
    let stuck = speed[700];
    speed[700..1000].fill(stuck);
    let found = only(&column("u [m/s]", &speed));
    assert!(found.starts_with("frozen: "), "{found}");
    assert!(found.contains("from 70.00 to 99.90 s"), "{found}");
}

#[test]
fn irregular_sampling_is_reported_with_its_intervals() {
    let mut times = vec![0.0];
    for k in 0..300 {
        times.push(times[k] + if k % 10 == 0 { 0.5 } else { 0.1 });
    }
    let values: Vec<f64> = (0..301).map(noise).collect();
    let found = only(&timed("depth [m]", &times, &values));
    assert!(found.starts_with("irregular sampling: every 0.100 s"), "{found}");
    assert!(found.contains("longer than 0.500 s"), "{found}");
}

#[test]
fn marks_for_no_measurement_are_counted() {
    for mark in [-32768.0, 9999.0, -32.768] {
        let mut values = depth();
        values.iter_mut().step_by(50).for_each(|x| *x = mark);
        let found = only(&column("dvl x [m/s]", &values));
        assert!(found.starts_with(&format!("6 samples are {mark} m/s, far from")), "{found}");
    }
}

#[test]
fn a_second_clock_is_no_measurement() {
    let values: Vec<f64> = (0..300).map(|k| 1e5 + 100.0 * k as f64).collect();
    let found = only(&column("boot", &values));
    assert_eq!(found, "rises evenly with time: a clock or a counter, not a measurement");
}

#[test]
fn a_slow_sensor_logged_fast_is_found() {
    let slow = |k: usize| (0.02 * (k / 16) as f64).sin() + 0.003 * noise(k / 16);
    let values: Vec<f64> = (0..1000).map(slow).collect();
    let found = only(&column("depth [m]", &values));
    assert!(found.starts_with("changes every 1.600 s though logged every 0.100 s"), "{found}");
}

#[test]
fn a_summary_counts_samples_gaps_and_missing_values() {
    let folder = Folder::new();
    let rows =
        |from: usize| (from..from + 50).map(|k| format!("{}.{},{}\n", k / 10, k % 10, noise(k)));
    let text: String = rows(0).chain(rows(100)).collect();
    let path = folder.write("a.csv", &format!("t [s],z [m]\n{text}15.5,\n"));
    let inspection = inspect(&open(&[path]));
    let z = &inspection.channels[0];
    assert_eq!((z.count, z.missing, z.gaps), (100, 1, Some(1)));
    assert!((z.longest_gap_s.unwrap() - 5.1).abs() < 1e-9);
    assert_eq!((z.first_s, z.last_s, z.unit.as_deref()), (0.0, 14.9, Some("m")));
    assert_eq!(inspection.files[0].sha256.as_ref().map(String::len), Some(64));
    assert!(!inspection.files[0].surveyed && z.estimated.is_empty());
}

#[test]
fn estimates_of_a_survey_are_marked() {
    let folder = Folder::new();
    // The vehicle turns from 10 to 345 degrees and back, the long way, in the part that is not
    // read.
    let heading = |k: usize| 10.0 + 335.0 * (1.0 - (k as f64 / 10_000.0 - 1.0).abs()).powi(2);
    let row = |k: usize| format!("{}.{},{:.3},7\n", k / 10, k % 10, heading(k) + noise(k));
    let rows: String = (0..20_000).map(row).collect();
    let path = folder.write("a.csv", &format!("t [s],heading [deg],x [m]\n{rows}"));
    let how = Thoroughness { whole_up_to: 0, parts: 3, part_bytes: 4096 };
    let survey = survey(&path, &ReadOptions::default(), how).unwrap();
    let inspection = inspect_survey(survey);

    let file = &inspection.files[0];
    assert!(file.surveyed && file.bytes_read < 3 * 4096 && file.parts == 3);
    let json = serde_json::to_value(&inspection).unwrap();
    assert_eq!(json["files"][0].get("sha256"), None);
    let [heading, x] = &inspection.channels[..] else { panic!("two channels") };
    assert_eq!(heading.estimated, ["count", "rate_hz"]);
    assert_eq!((heading.first_s, heading.last_s, heading.gaps), (0.0, 1999.9, None));
    // Rows grow longer with time, and the first of three parts counts for a third of the file.
    assert!(heading.count.abs_diff(20_000) < 2000 && heading.read < 1000, "{}", heading.count);
    assert!((heading.rate_hz.unwrap() - 10.0).abs() < 1e-6);
    assert_eq!(heading.remarks, [""; 0], "no turn in which it wraps was seen");
    assert_eq!(x.remarks, [format!("constant: all {} samples are 7 m", x.read)]);
}

#[test]
fn the_pool_log_has_two_columns_that_say_nothing() {
    let Some(path) = data("bolt-auv/yaw_test.csv") else { return };
    let inspection = inspect(&open(&[path]));
    for channel in &inspection.channels {
        let constant = channel.remarks.iter().any(|r| r.starts_with("constant"));
        let still =
            ["X (m)", "Y (m)", "T3 (us)", "T4 (us)", "T5 (us)", "T6 (us)", "T7 (us)", "T8 (us)"];
        assert_eq!(constant, still.contains(&channel.column.as_str()), "{}", channel.column);
        assert!(
            constant || channel.remarks.is_empty(),
            "{}: {:?}",
            channel.column,
            channel.remarks
        );
    }
}

#[test]
fn the_tankers_heading_wraps() {
    let Some(path) = data("esso-osaka/turn_14-Sep-2020_13_39_32.csv") else { return };
    let inspection = inspect(&open(&[path]));
    let heading = inspection.channels.iter().find(|c| c.column == "psi_hat [rad]").unwrap();
    assert!(heading.remarks[0].starts_with("wraps "), "{:?}", heading.remarks);
}
