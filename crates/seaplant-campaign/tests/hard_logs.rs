//! Logs that would give wrong numbers: how a trial treats them, and its caveats.

use seaplant::{AxisRecord, Caveat, Dof, Severity, VelocitySource};
use seaplant_campaign::{Campaign, Error};

use crate::common::{Folder, said};

const VEHICLE: &str = r#"name = "sled"
[[thruster]]
name = "prop"
position_m = [0.0, 0.0, 0.0]
direction = [1.0, 0.0, 0.0]
curve = { kind = "quadratic", input = "pwm", forward = 2e-4, reverse = 2e-4, neutral = 1520.0 }
"#;

const CAMPAIGN: &str = r#"vehicle = "vehicle.toml"
[[trial]]
name = "run 1"
log = "log.csv"
dof = ["surge"]
[channels]
"thruster.prop.pwm" = { column = "prop", unit = "us" }
"depth" = { column = "depth", unit = "m" }
"velocity.surge" = { column = "speed", unit = "m/s" }
"#;

/// Cells of a row: time in s, pulse, speed, depth.
type Row = (f64, String, String, String);

const ROWS: usize = 400;

fn row(k: usize) -> Row {
    let t = 0.1 * k as f64;
    let pulse = 1520.0 + (200.0 * (0.5 * t).sin()).round();
    let (speed, depth) = ((0.5 * t - 0.7).sin(), 5.0 + 0.1 * (0.2 * t).sin());
    (t, pulse.to_string(), speed.to_string(), depth.to_string())
}

fn log(header: &str, rows: impl Iterator<Item = Row>) -> String {
    let rows = rows.map(|(t, pulse, speed, depth)| format!("{t},{pulse},{speed},{depth}\n"));
    format!("{header},prop,speed,depth\n{}", rows.collect::<String>())
}

fn open(log: &str, campaign: &str) -> Result<Campaign, Box<(Error, String)>> {
    let folder = Folder::new();
    folder.write("vehicle.toml", VEHICLE);
    folder.write("log.csv", log);
    let path = folder.write("campaign.toml", campaign);
    Campaign::open(&path).map_err(|error| {
        let words = said(&error, &folder);
        Box::new((error, words))
    })
}

/// Returns surge of a log, and its caveats.
fn surge(log: &str) -> (AxisRecord, Vec<Caveat>) {
    let campaign = open(log, CAMPAIGN).unwrap_or_else(|refused| panic!("{}", refused.0));
    let trial = &campaign.trials[0];
    let axis = trial.axis(Dof::Surge, VelocitySource::Measured).expect("surge is measured");
    (axis, trial.caveats(Dof::Surge))
}

fn warnings(caveats: &[Caveat]) -> Vec<&str> {
    let grave = caveats.iter().filter(|caveat| caveat.severity >= Severity::Warning);
    grave.map(|caveat| caveat.message.as_str()).collect()
}

#[test]
fn a_time_without_a_unit_in_milliseconds_requires_the_unit() {
    let in_ms = (0..ROWS).map(row).map(|(t, p, s, d)| (1000.0 * t, p, s, d));
    let log = log("time", in_ms);
    let (_, message) = *open(&log, CAMPAIGN).expect_err("refused");
    assert_eq!(
        message,
        "campaign.toml: trial `run 1`: log.csv: the time column \"time\" states no unit, and in \
         seconds its rows would be 100 s apart: is it ms? Add time = { unit = \"ms\" } to the \
         campaign, or unit = \"s\" if it is in seconds"
    );
    for (unit, span_s) in [("ms", 39.9), ("s", 39_900.0)] {
        let stated = format!("time = {{ unit = \"{unit}\" }}\n{CAMPAIGN}");
        let campaign = open(&log, &stated).unwrap_or_else(|refused| panic!("{}", refused.0));
        let axis = campaign.trials[0].axis(Dof::Surge, VelocitySource::Measured).expect("surge");
        let last_s = axis.force.time_s().last().expect("samples");
        assert!((last_s - span_s).abs() < 1e-9, "{last_s}");
    }
}

#[test]
fn cells_of_a_used_channel_that_are_dropped_are_a_warning() {
    let dropped = |every: usize| {
        let rows = (0..ROWS).map(row).enumerate().map(|(k, (t, p, s, d))| {
            let s = if k % every == 1 { "~1.5".to_owned() } else { s };
            (t, p, s, d)
        });
        surge(&log("time [s]", rows)).1
    };
    let caveats = dropped(20);
    let [warning] = warnings(&caveats)[..] else { panic!("{caveats:?}") };
    assert!(warning.contains("column \"speed\" has 20 cells that are not a number"), "{warning}");
    assert!(warning.ends_with("(5 % of its rows); correct the log"), "{warning}");
    // A few of them are a note.
    let caveats = dropped(200);
    assert_eq!(warnings(&caveats), [""; 0]);
}

#[test]
fn a_code_for_missing_data_is_left_out_of_a_trial() {
    let coded = |code: &str| {
        let rows = (0..ROWS).map(row).enumerate().map(|(k, (t, p, s, d))| {
            let s = if k % 40 == 7 { code.to_owned() } else { s };
            (t, p, s, d)
        });
        surge(&log("time [s]", rows))
    };
    let (empty, _) = coded("");
    for code in ["3276.7", "-32.768", "9999"] {
        let (axis, caveats) = coded(code);
        assert_eq!(axis, empty, "{code}");
        let [warning] = warnings(&caveats)[..] else { panic!("{caveats:?}") };
        assert!(
            warning.contains(&format!(
                "column \"speed\" holds {code} in 10 samples, first at 0.70 s, far from all others"
            )),
            "{warning}"
        );
    }
}

#[test]
fn a_pulse_of_zero_stops_the_thruster() {
    let pulses = |without: &str, from: usize, to: usize| {
        let rows = (0..ROWS).map(row).enumerate().map(|(k, (t, p, s, d))| {
            let p = if (from..to).contains(&k) { without.to_owned() } else { p };
            (t, p, s, d)
        });
        surge(&log("time [s]", rows))
    };
    // Disarmed at the start, and in between.
    for (from, to, warns) in [(0, 30, false), (100, 130, true)] {
        let (disarmed, caveats) = pulses("0", from, to);
        let (stopped, _) = pulses("1520", from, to);
        assert_eq!(disarmed.force, stopped.force);
        let said = caveats.iter().find(|c| c.message.contains("thruster.prop.pwm is 0 us"));
        let said = &said.expect("it is said").message;
        assert!(said.contains("in 30 samples: no pulse"), "{said}");
        assert!(said.contains("taken as 1520 us, which stops the thruster"), "{said}");
        assert_eq!(!warnings(&caveats).is_empty(), warns, "{caveats:?}");
    }
}
