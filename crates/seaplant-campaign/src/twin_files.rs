//! Writes a twin's logs as ordinary files, which are read like any other logs.

use std::collections::BTreeMap;
use std::path::PathBuf;

use seaplant::twin::{TwinCampaign, TwinTrial};
use seaplant::{
    Quantity, Sensor, ThrustCurve, ThrustUncertainty, Thruster, ThrusterInput, Timed, Vehicle,
};

use crate::bench::BenchColumns;
use crate::campaign_file::{
    BollardPullEntry, CampaignFile, ChannelEntry, FitEntry, LogEntry, TrialEntry,
};
use crate::known_file::KnownEntry;
use crate::plant_file::{PlantEntry, RigidBodyEntry};
use crate::vehicle_file::{
    AttitudeEntry, CurveEntry, DvlEntry, ImuEntry, PositionEntry, QuadraticEntry, SensorEntries,
    ThrusterEntry, UncertaintyEntry, VehicleFile,
};

/// A file to write: its path, relative to the campaign's folder, and its content.
#[derive(Clone, Debug, PartialEq)]
pub struct TextFile {
    /// Path.
    pub path: String,
    /// Content.
    pub text: String,
}

/// One revolution a minute, rad/s.
const RPM: f64 = std::f64::consts::PI / 30.0;

const BENCH_FILE: &str = "bollard-pull.csv";

/// Makes the files of a twin's campaign: `vehicle.toml`, `campaign.toml`, one folder of
/// CSV logs a trial, bollard-pull data and the truth.
///
/// # Errors
/// A TOML or JSON error if a number is not finite, which no twin's is.
pub fn twin_files(twin: &TwinCampaign) -> Result<Vec<TextFile>, Box<dyn std::error::Error>> {
    let mut files = Vec::new();
    let mut channels = BTreeMap::new();
    let mut trials = Vec::new();
    for trial in &twin.trials {
        let mut logs = Vec::new();
        for sheet in sheets(trial, &mut channels) {
            logs.push(PathBuf::from(&sheet.path));
            files.push(sheet);
        }
        trials.push(trial_entry(trial, logs));
    }
    let campaign = CampaignFile {
        vehicle: "vehicle.toml".into(),
        time: None,
        sheet: None,
        trial: trials,
        channels,
        methods: None,
        velocity: None,
        fit: FitEntry::default(),
        plant: twin.together.iter().map(PlantEntry::from_plan).collect(),
        paper: Default::default(),
        equation_error: Default::default(),
        output_error: Default::default(),
        filter_error: Default::default(),
        steady: Default::default(),
        online: Default::default(),
        bollard_pull: (!twin.bollard_pull.is_empty()).then(|| BollardPullEntry {
            file: BENCH_FILE.into(),
            columns: BenchColumns::default(),
            neutral: None,
        }),
    };
    let mut text_file = |path: &str, text: String| {
        files.push(TextFile { path: path.to_owned(), text });
    };
    text_file("vehicle.toml", toml::to_string(&vehicle_file(&twin.vehicle))?);
    text_file("campaign.toml", toml::to_string(&campaign)?);
    text_file("truth.json", format!("{}\n", serde_json::to_string_pretty(&twin.truth)?));
    if !twin.bollard_pull.is_empty() {
        text_file(BENCH_FILE, bench_csv(&twin.bollard_pull));
    }
    Ok(files)
}

fn trial_entry(trial: &TwinTrial, logs: Vec<PathBuf>) -> TrialEntry {
    TrialEntry {
        name: trial.name.clone(),
        log: LogEntry::Several(logs),
        dof: trial.dofs.clone(),
        role: trial.role,
        from_s: None,
        to_s: None,
        segments_s: Vec::new(),
        offset_s: BTreeMap::new(),
        sheet: None,
        channels: BTreeMap::new(),
        known: trial.known.iter().map(KnownEntry::of).collect(),
    }
}

/// Format in which an instrument writes a quantity: file, column, factor from SI, decimals.
struct Format {
    sheet: &'static str,
    column: String,
    factor: f64,
    decimals: usize,
}

fn format(quantity: &Quantity) -> Format {
    let degrees = 180.0 / std::f64::consts::PI;
    let short = |quantity: &Quantity| {
        quantity.to_string().rsplit('.').next().unwrap_or_default().to_owned()
    };
    let of = |sheet, column, factor, decimals| Format { sheet, column, factor, decimals };
    match quantity {
        Quantity::Thruster { name, input: ThrusterInput::Speed } => {
            of("thrusters", format!("{name} [rpm]"), 1.0 / RPM, 1)
        }
        Quantity::Thruster { name, input: ThrusterInput::Command } => {
            of("thrusters", format!("{name} command [1]"), 1.0, 4)
        }
        Quantity::Rate(_) => of("gyro", format!("rate {} [rad/s]", short(quantity)), 1.0, 6),
        Quantity::DvlVelocity(_) => {
            of("dvl", format!("velocity {} [m/s]", short(quantity)), 1.0, 5)
        }
        Quantity::Acceleration(_) => {
            of("imu", format!("acceleration {} [m/s^2]", short(quantity)), 1.0, 5)
        }
        Quantity::Attitude(_) => of("attitude", format!("{} [deg]", short(quantity)), degrees, 4),
        Quantity::Depth => of("depth", "depth [m]".to_owned(), 1.0, 3),
        other => of("other", format!("{other} [SI]"), 1.0, 9),
    }
}

/// Returns the log files of a trial, one for each instrument, and adds their columns to `channels`.
fn sheets(trial: &TwinTrial, channels: &mut BTreeMap<String, ChannelEntry>) -> Vec<TextFile> {
    let mut by_sheet: BTreeMap<&str, Vec<(Format, &Timed)>> = BTreeMap::new();
    for (quantity, series) in &trial.recording {
        let format = format(quantity);
        let entry = ChannelEntry { column: format.column.clone(), ..Default::default() };
        channels.insert(quantity.to_string(), entry);
        by_sheet.entry(format.sheet).or_default().push((format, series));
    }
    let folder = slug(&trial.name);
    by_sheet
        .into_iter()
        .map(|(sheet, columns)| TextFile {
            path: format!("logs/{folder}/{sheet}.csv"),
            text: csv(&columns),
        })
        .collect()
}

/// Formats columns that share the times of the first.
fn csv(columns: &[(Format, &Timed)]) -> String {
    use std::fmt::Write;
    let mut text = "time [s]".to_owned();
    for (format, _) in columns {
        text.push(',');
        text.push_str(&format.column);
    }
    text.push('\n');
    for (row, time_s) in columns[0].1.time_s().iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = write!(text, "{time_s:.4}");
        for (format, series) in columns {
            let value = series.values()[row] * format.factor;
            let _ = write!(text, ",{value:.*}", format.decimals);
        }
        text.push('\n');
    }
    text
}

fn slug(name: &str) -> String {
    let mut slug = String::new();
    for c in name.to_lowercase().chars() {
        if c.is_ascii_alphanumeric() {
            slug.push(c);
        } else if !slug.ends_with('-') {
            slug.push('-');
        }
    }
    slug.trim_matches('-').to_owned()
}

fn bench_csv(points: &[(f64, f64)]) -> String {
    let rows = points.iter().map(|(speed, force)| format!("{:.1},{force:.2}\n", speed / RPM));
    format!("speed [rpm],thrust [N]\n{}", rows.collect::<String>())
}

fn vehicle_file(vehicle: &Vehicle) -> VehicleFile {
    let Sensor { position_body, rotation_rad, std } = vehicle.sensors.dvl;
    let position = |sensor: &Sensor| PositionEntry {
        position_m: sensor.position_body.into(),
        std_m: sensor.std,
    };
    VehicleFile {
        preset: None,
        name: Some(vehicle.name.clone()),
        dry_mass_kg: vehicle.dry_mass_kg,
        size_m: vehicle.size_m,
        draught_m: vehicle.draught_m,
        rigid_body: vehicle.rigid_body.as_ref().map(RigidBodyEntry::from_body),
        buoyancy: None,
        thruster_curve: None,
        thruster: vehicle.thrusters.iter().map(thruster_entry).collect(),
        rudder: Vec::new(),
        fin: Vec::new(),
        wind: None,
        water_density_kg_m3: None,
        sensor: SensorEntries {
            // A vehicle with an accelerometer has it in place of a DVL.
            dvl: (vehicle.sensors.imu == Sensor::default()).then(|| DvlEntry {
                position_m: position_body.into(),
                rotation_deg: rotation_rad.map(f64::to_degrees),
                std_m_s: std,
            }),
            depth: Some(position(&vehicle.sensors.depth)),
            attitude: Some(AttitudeEntry {
                rotation_deg: vehicle.sensors.attitude.rotation_rad.map(f64::to_degrees),
                std_deg: vehicle.sensors.attitude.std.map(f64::to_degrees),
            }),
            position: None,
            imu: (vehicle.sensors.imu != Sensor::default()).then(|| imu_entry(vehicle)),
        },
    }
}

fn imu_entry(vehicle: &Vehicle) -> ImuEntry {
    let Sensor { position_body, rotation_rad, std } = vehicle.sensors.imu;
    ImuEntry {
        position_m: position_body.into(),
        rotation_deg: rotation_rad.map(f64::to_degrees),
        std_m_s2: std.filter(|std| *std > 0.0),
        averages: vehicle.sensors.imu_averages,
    }
}

fn thruster_entry(thruster: &Thruster) -> ThrusterEntry {
    let curve = match &thruster.curve {
        ThrustCurve::Quadratic { input, law } => CurveEntry::Quadratic(QuadraticEntry {
            forward: law.forward,
            reverse: law.reverse,
            exponent: law.exponent,
            input: *input,
            deadband: law.deadband,
            neutral: None,
            voltage_v: law.voltage,
        }),
        ThrustCurve::Table { input, tables } => {
            let points = tables.iter().flat_map(|table| table.points()).map(|(x, f)| [x, f]);
            CurveEntry::Table(crate::vehicle_file::TableEntry {
                input: Some(*input),
                points: points.collect(),
                voltage_v: thruster.curve.voltage(),
                ..Default::default()
            })
        }
    };
    ThrusterEntry {
        name: thruster.name.clone(),
        position_m: Some(thruster.position_body.into()),
        direction: Some(thruster.direction_body.into()),
        azimuth_axis: None,
        reversed: false,
        curve: Some(curve),
        thrust_uncertainty: (thruster.uncertainty != ThrustUncertainty::default()).then(|| {
            let ThrustUncertainty { forward, reverse } = thruster.uncertainty;
            UncertaintyEntry { forward, reverse }
        }),
    }
}
