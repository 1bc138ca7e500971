//! Files of one trial whose clocks differ: the report of `inspect`, and the effect of `offset_s = {
//! "FILE" = "estimate" }` in a campaign.

use std::path::{Path, PathBuf};

use seaplant::results::Results;
use seaplant::twin::{TwinSpec, make};
use seaplant::{CaveatCode, Dof, Severity};
use seaplant_campaign::{
    Campaign, CampaignFile, EstimateWord, InspectedEpoch, InspectedOffset, OffsetEntry, inspect,
    read_toml, twin_files,
};

use crate::common::{Folder, csv, noise, open, said};

/// Returns a yaw rate that never repeats, and the heading that it makes, deg/s and deg.
fn rate(t: f64) -> f64 {
    const WAVES: [[f64; 3]; 6] = [
        [0.11, 3.0, 0.3],
        [0.27, 2.0, 1.7],
        [0.53, 2.5, 4.0],
        [0.91, 1.5, 2.2],
        [1.43, 1.0, 5.1],
        [2.19, 0.7, 0.9],
    ];
    WAVES.iter().map(|[w, a, phase]| a * (w * t + phase + 2.0 * (0.013 * t).sin()).cos()).sum()
}

fn heading(t: f64) -> f64 {
    const STEP_S: f64 = 0.01;
    let steps = (t / STEP_S).round() as usize;
    let sum: f64 = (0..steps).map(|k| rate((k as f64 + 0.5) * STEP_S)).sum();
    100.0 + sum * STEP_S
}

/// Writes an autopilot's gyroscope, and a DVL with its own compass, whose clock reads `dvl_s` where
/// the autopilot's reads 30 s.
fn gyro_and_dvl(folder: &Folder, dvl_s: f64) -> [PathBuf; 2] {
    let jitter = |t: f64| noise((t * 100.0).round() as usize);
    let gyro = csv(20.0, 240.0, &[("yaw rate [deg/s]", &|t| rate(t) + 0.1 * jitter(t))]);
    let mut dvl = "time [s],velocity x [m/s],heading [deg]\n".to_owned();
    for k in 0..=1000 {
        let t = 30.0 + 0.125 * f64::from(k);
        let (u, psi) = (0.3 * (0.2 * t).sin(), heading(t) + 0.1 * noise(k as usize + 7777));
        dvl += &format!("{:.4},{u:.5},{psi:.4}\n", t - 30.0 + dvl_s);
    }
    [folder.write("autopilot.csv", &gyro), folder.write("dvl.csv", &dvl)]
}

fn only_offset(files: &[PathBuf]) -> InspectedOffset {
    let found = inspect(&open(files));
    let [offset] = &found.offsets[..] else { panic!("{:?}", found.offsets) };
    offset.clone()
}

#[test]
fn clocks_of_other_epochs_are_reported_with_the_line_to_write() {
    let folder = Folder::new();
    let files = gyro_and_dvl(&folder, 1_600_000_000.0);
    let found = inspect(&open(&files));
    let epochs: Vec<InspectedEpoch> = found.files.iter().map(|file| file.epoch).collect();
    assert_eq!(epochs, [InspectedEpoch::Unstated, InspectedEpoch::Unix]);
    let [offset] = &found.offsets[..] else { panic!("{:?}", found.offsets) };
    assert!(!offset.same_epoch && offset.overlap_s < 0.0);
    let clock = offset.clock.as_ref().unwrap_or_else(|| panic!("{offset:?}"));
    let off_s = clock.offset_s - (30.0 - 1_600_000_000.0);
    assert!(off_s.abs() < 4.0 * clock.std_s && off_s.abs() < 0.02, "{off_s}: {clock:?}");
    let line = offset.campaign_line.as_ref().expect("a line");
    let seconds =
        line.strip_prefix("offset_s = { \"dvl.csv\" = ").and_then(|l| l.strip_suffix(" }"));
    let seconds: f64 = seconds.unwrap_or_else(|| panic!("{line}")).parse().expect("seconds");
    assert!((seconds - clock.offset_s).abs() < 1e-3);
}

#[test]
fn clocks_that_agree_are_said_to() {
    let folder = Folder::new();
    let offset = only_offset(&gyro_and_dvl(&folder, 30.0));
    assert!(offset.same_epoch && (offset.overlap_s - 125.0).abs() < 1e-9);
    let clock = offset.clock.as_ref().unwrap_or_else(|| panic!("{offset:?}"));
    assert!(clock.offset_s.abs() < 0.02, "{clock:?}");
    assert_eq!(offset.campaign_line, None);
}

#[test]
fn recordings_of_other_times_are_not_compared() {
    let folder = Folder::new();
    let [one, _] = gyro_and_dvl(&folder, 30.0);
    let text = std::fs::read_to_string(&one).expect("written above");
    let files = [one, folder.write("later.csv", &text)];
    assert_eq!(inspect(&open(&files)).offsets, []);
}

#[test]
fn offsets_that_data_cannot_determine_are_refused_with_the_reason() {
    let folder = Folder::new();
    let [gyro, _] = gyro_and_dvl(&folder, 0.0);
    let depth = csv(4.0, 100.0, &[("depth [m]", &|t| 5.0 + (0.1 * t).sin())]);
    let offset = only_offset(&[gyro.clone(), folder.write("depth.csv", &depth)]);
    // A gyroscope and a depth sensor have nothing to compare.
    assert_eq!((offset.clock, offset.refused, offset.campaign_line), (None, None, None));
    let another = |t: f64| 100.0 + 9.0 * (0.7 * t).sin() + 5.0 * (0.0041 * t * t).cos();
    let another = csv(8.0, 200.0, &[("heading [deg]", &another)]);
    let offset = only_offset(&[gyro, folder.write("compass.csv", &another)]);
    let refused = offset.refused.expect("it is of another day");
    assert!(refused.contains("yaw and the rate of attitude.heading: they agree"), "{refused}");
    assert_eq!((offset.clock, offset.campaign_line), (None, None));
}

/// Returns the twin's surge trials with the DVL's clock `behind_s` behind, written as files.
fn twin(folder: &Folder, behind_s: f64) -> PathBuf {
    let spec = TwinSpec { duration_s: 180.0, dofs: [Dof::Surge].into(), ..TwinSpec::jason2() };
    let twin = make(&spec).expect("the twin can be made");
    for file in twin_files(&twin).expect("the files can be written") {
        let is_dvl = file.path.ends_with("dvl.csv");
        let text = if is_dvl { later(&file.text, -behind_s) } else { file.text };
        folder.write(&file.path, &text);
    }
    folder.path().join("campaign.toml")
}

/// Shifts the first column of a table.
fn later(text: &str, by_s: f64) -> String {
    let moved = |line: &str| match line.split_once(',') {
        Some((time, rest)) => match time.parse::<f64>() {
            Ok(time) => format!("{:.6},{rest}\n", time + by_s),
            Err(_) => format!("{line}\n"),
        },
        None => format!("{line}\n"),
    };
    text.lines().map(moved).collect()
}

/// Returns the campaign with an offset for the DVL of every trial.
fn with_offset(path: &Path, offset: OffsetEntry) -> Results {
    let mut file: CampaignFile = read_toml(path).unwrap_or_else(|error| panic!("{error}"));
    for trial in &mut file.trial {
        let dvl = trial.log.files().iter().find(|log| log.ends_with("dvl.csv")).expect("a DVL");
        assert_ne!(dvl, Path::new("dvl.csv"));
        trial.offset_s.insert("dvl.csv".to_owned(), offset);
    }
    file.methods = Some(vec![seaplant::Method::FilterError]);
    let path = path.with_file_name("aligned.toml");
    std::fs::write(&path, toml::to_string(&file).expect("TOML")).expect("written");
    let campaign = Campaign::open(&path).unwrap_or_else(|error| panic!("{error}"));
    campaign.identify("").results
}

#[test]
fn an_estimated_offset_identifies_as_the_true_one_does() {
    const BEHIND_S: f64 = 7.31;
    let folder = Folder::new();
    let path = twin(&folder, BEHIND_S);
    let stated = with_offset(&path, OffsetEntry::Stated(BEHIND_S));
    let told = with_offset(&path, OffsetEntry::Told(EstimateWord::Estimate));
    assert!(stated.trials.iter().all(|trial| trial.offsets.is_empty()));
    for trial in &told.trials {
        let [offset] = &trial.offsets[..] else { panic!("{:?}", trial.offsets) };
        assert!(offset.file.ends_with("dvl.csv"));
        assert!((offset.clock.offset_s - BEHIND_S).abs() < 0.05, "{:?}", offset.clock);
        assert!(offset.clock.pairs[0].of_thrust);
    }
    let [stated, told] = [&stated, &told].map(|results| &results.plants["surge"]);
    let [one, other] = [stated, told].map(|plant| &plant.by_axis[&Dof::Surge]);
    assert!((other.mass.value / one.mass.value - 1.0).abs() < 0.01, "{one:?} {other:?}");
    let drag = |plant: &seaplant::results::Parameters| {
        plant.quadratic_drag.as_ref().expect("drag is fitted").value
    };
    assert!((drag(other) / drag(one) - 1.0).abs() < 0.02, "{one:?} {other:?}");
    let caveat = told.caveats.iter().find(|caveat| caveat.code == CaveatCode::ClockOffset);
    let caveat = caveat.expect("the offset is told");
    assert_eq!(caveat.severity, Severity::Warning);
    for says in [
        "dvl.csv is shifted by +7.3",
        "the force of the thrusters in surge",
        "any lag of the thrusters",
    ] {
        assert!(caveat.message.contains(says), "{}", caveat.message);
    }
}

const VEHICLE: &str = "name = \"sled\"\n";
const CAMPAIGN: &str = r#"vehicle = "vehicle.toml"
[[trial]]
name = "turns"
log = ["autopilot.csv", "dvl.csv"]
dof = ["yaw"]
offset_s = { "dvl.csv" = "estimate" }
[channels]
"wrench.yaw" = { column = "moment" }
"rate.yaw" = { column = "yaw rate" }
"dvl.velocity.x" = { column = "velocity x" }
"#;

fn refusal(folder: &Folder, campaign: &str) -> String {
    folder.write("vehicle.toml", VEHICLE);
    let path = folder.write("campaign.toml", campaign);
    said(&Campaign::open(&path).expect_err("it is refused"), folder)
}

/// Writes an autopilot's table with the moment that it commanded.
fn autopilot(folder: &Folder, turn: &dyn Fn(f64) -> f64) {
    let columns: [(&str, &dyn Fn(f64) -> f64); 2] =
        [("yaw rate [deg/s]", turn), ("moment [N m]", &|t| 100.0 * turn(t + 0.5))];
    folder.write("autopilot.csv", &csv(20.0, 240.0, &columns));
}

#[test]
fn an_unmapped_compass_also_determines_the_clock() {
    let folder = Folder::new();
    gyro_and_dvl(&folder, 1_600_000_000.0);
    autopilot(&folder, &rate);
    folder.write("vehicle.toml", VEHICLE);
    let path = folder.write("campaign.toml", CAMPAIGN);
    let campaign = Campaign::open(&path).unwrap_or_else(|error| panic!("{error}"));
    let caveats = campaign.trials[0].caveats(Dof::Yaw);
    let told = caveats.iter().find(|caveat| caveat.code == CaveatCode::ClockOffset);
    let told = told.expect("the offset is told");
    assert_eq!(told.severity, Severity::Note, "{}", told.message);
    let says = "trial `turns`: the clock of dvl.csv is shifted by -";
    let seconds = told.message.strip_prefix(says).and_then(|rest| rest.split_once(' '));
    let seconds: f64 = seconds.expect("an offset").0.parse().expect("seconds");
    assert!((seconds - (1_600_000_000.0 - 30.0)).abs() < 0.02, "{}", told.message);
}

#[test]
fn a_clock_that_repeats_itself_is_refused_by_file_and_reason() {
    let folder = Folder::new();
    let turn = |t: f64| 5.0 * (0.8 * t).cos();
    autopilot(&folder, &turn);
    let heading = |t: f64| 100.0 + 5.0 / 0.8 * (0.8 * t).sin();
    let columns: [(&str, &dyn Fn(f64) -> f64); 2] =
        [("velocity x [m/s]", &|t| (0.3 * t).sin()), ("heading [deg]", &heading)];
    folder.write("dvl.csv", &csv(8.0, 200.0, &columns));
    let message = refusal(&folder, CAMPAIGN);
    let start = "campaign.toml: trial `turns`, offset_s.\"dvl.csv\": cannot estimate the \
                 clock offset (";
    assert!(message.starts_with(start), "{message}");
    for says in ["rate.yaw and the rate of attitude.heading: ", "the motion is periodic"] {
        assert!(message.contains(says), "{message}");
    }
    assert!(message.contains("set it in seconds"), "{message}");
}

#[test]
fn one_clock_must_count() {
    let folder = Folder::new();
    gyro_and_dvl(&folder, 0.0);
    let all = "{ \"dvl.csv\" = \"estimate\", \"autopilot.csv\" = \"estimate\" }";
    let message = refusal(&folder, &CAMPAIGN.replace("{ \"dvl.csv\" = \"estimate\" }", all));
    assert_eq!(
        message,
        "campaign.toml: trial `turns`, offset_s.\"autopilot.csv\": every file of the trial has an \
         offset; leave out that of the reference clock"
    );
}

#[test]
fn the_end_of_a_path_names_a_file_if_it_is_the_only_one() {
    let folder = Folder::new();
    gyro_and_dvl(&folder, 0.0);
    let twice = CAMPAIGN.replace("\"autopilot.csv\", ", "\"a/dvl.csv\", \"b/dvl.csv\", ");
    let message = refusal(&folder, &twice.replace(", \"dvl.csv\"]", "]"));
    assert_eq!(
        message,
        "campaign.toml: trial `turns`, offset_s.\"dvl.csv\": is the end of several paths in log = \
         [...]; write the file as it is written there"
    );
}

#[test]
fn an_offset_is_a_number_or_the_word() {
    let folder = Folder::new();
    let message = refusal(&folder, &CAMPAIGN.replace("\"estimate\"", "\"guess\""));
    assert!(message.contains("expected a number of seconds or \"estimate\""), "{message}");
}
