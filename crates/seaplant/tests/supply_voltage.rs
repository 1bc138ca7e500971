//! Thrusters that are told commands, and turn slower when the supply voltage falls.

use seaplant::results::{PlantResult, Trust};
use seaplant::twin::{TwinCampaign, TwinSpec, VehicleTwinSpec, make, make_vehicle};
use seaplant::{
    CaveatCode, Dof, IdentifyOptions, Method, QuadraticThrust, Quantity, Recording, ThrustCurve,
    ThrustTable, Thruster, ThrusterInput, Timed, Trial, identify,
};

use crate::vehicle_twin::boat;

/// Exponent of thrust over voltage.
const POWER: f64 = 1.4;
/// The voltage of the measurement of the curves, V.
const CURVE_V: f64 = 15.0;
/// Propeller speed at a command of 1, where the twin logs speeds, rad/s.
const FULL_RAD_S: f64 = 170.0;

/// The voltage of a battery that falls by a quarter of its own over all trials, with some ripple.
fn volts(begun_s: f64, all_s: f64, t: f64) -> f64 {
    16.8 - 4.2 * (begun_s + t) / all_s + 0.2 * (0.05 * t).sin()
}

fn seconds(recording: &Recording) -> f64 {
    recording.values().map(Timed::last_s).fold(0.0, f64::max)
}

/// The same campaign with commands that make the same thrust at the voltage of the moment, and with that voltage.
fn on_a_battery(twin: &mut TwinCampaign) {
    let all_s: f64 = twin.trials.iter().map(|trial| seconds(&trial.recording)).sum();
    let mut begun_s = 0.0;
    for trial in &mut twin.trials {
        let lasts_s = seconds(&trial.recording);
        let of = |t: f64| volts(begun_s, all_s, t);
        let mut on_battery = Recording::default();
        for (quantity, series) in &trial.recording {
            let Quantity::Thruster { name, input } = quantity else {
                on_battery.insert(quantity.clone(), series.clone());
                continue;
            };
            let full = if *input == ThrusterInput::Speed { FULL_RAD_S } else { 1.0 };
            let told = series.time_s().iter().zip(series.values());
            let told = told.map(|(t, x)| x / full / (of(*t) / CURVE_V).powf(0.5 * POWER));
            let told = series.with_values(name, told.collect()).expect("finite");
            let name = name.clone();
            on_battery.insert(Quantity::Thruster { name, input: ThrusterInput::Command }, told);
        }
        let times: Vec<f64> = (0..=lasts_s as usize).map(|k| k as f64).collect();
        let logged: Vec<f64> = times.iter().map(|t| of(*t)).collect();
        let logged = Timed::new("supply.voltage", times, logged).expect("finite");
        on_battery.insert(Quantity::SupplyVoltage, logged);
        trial.recording = on_battery;
        begun_s += lasts_s;
    }
    for thruster in &mut twin.vehicle.thrusters {
        let ThrustCurve::Quadratic { input, law } = &mut thruster.curve else { continue };
        let square = if *input == ThrusterInput::Speed { FULL_RAD_S.powi(2) } else { 1.0 };
        *law = QuadraticThrust {
            forward: square * law.forward,
            reverse: square * law.reverse,
            ..*law
        };
        *input = ThrusterInput::Command;
    }
}

/// The same with curves that state the voltage of their measurement: square laws, or tables of them.
fn with_stated_voltage(twin: &mut TwinCampaign, as_tables: bool) {
    for Thruster { curve, .. } in &mut twin.vehicle.thrusters {
        let at = |k: i32| f64::from(k) / 400.0;
        let points = (-800..=800).map(|k| (at(k), curve.force(at(k), None))).collect();
        let table = ThrustTable::new(Some(CURVE_V), points).expect("rises");
        match curve {
            ThrustCurve::Quadratic { law, .. } if !as_tables => law.voltage = Some(CURVE_V),
            _ => {
                let tables = ThrustCurve::tables(ThrusterInput::Command, vec![table]);
                *curve = tables.expect("one table");
            }
        }
    }
}

fn found(twin: &TwinCampaign) -> PlantResult {
    let trials: Vec<Trial> =
        twin.trials.iter().map(|log| log.trial(twin).expect("complete")).collect();
    let options = IdentifyOptions {
        methods: vec![Method::FilterError],
        subsets: false,
        together: twin.together.clone(),
        ..IdentifyOptions::default()
    };
    let plants = identify(&twin.vehicle, &trials, &options).results.plants;
    plants.into_values().max_by_key(|plant| plant.axes.len()).expect("a plant")
}

/// Asserts that a plant has the exponent, predicts held-out trials, and is right once its thrust is as far off as a
/// curve that holds at another voltage makes it; returns that part.
fn assert_right(plant: &PlantResult, masses: &[(Dof, f64)]) -> f64 {
    let power = &plant.nuisances["voltage_exponent"];
    assert!((power.value - POWER).abs() < 0.05, "{power:?}");
    let known_v = plant.nuisances["mean_voltage"].value;
    assert_ne!(plant.verdict.trust, Trust::Doubtful, "{:?}", plant.verdict);
    for (dof, score) in &plant.hold_out.as_ref().expect("held out").by_axis {
        assert!(score.r_squared.expect("bounded") > 0.98, "{dof}: {score:?}");
    }
    let is_told = plant.caveats.iter().any(|caveat| {
        caveat.code == CaveatCode::ThrustScale && caveat.message.contains("supply voltage")
    });
    assert!(is_told, "{:?}", plant.caveats);
    let parts = masses.iter().map(|(dof, expected)| {
        let mass = &plant.by_axis[dof].mass;
        assert!((mass.low95..=mass.high95).contains(expected), "{dof}: {mass:?}, {expected}");
        mass.value / expected
    });
    let parts: Vec<f64> = parts.collect();
    let off = (CURVE_V / known_v).powf(POWER);
    for part in &parts {
        let is_right = (part - 1.0).abs() < 0.01 || (part - off).abs() < 0.01;
        assert!(is_right, "{part}, {off}");
    }
    parts[0]
}

#[test]
fn one_axis_knows_how_thrust_follows_voltage() {
    let spec = TwinSpec { dofs: [Dof::Surge].into(), ..TwinSpec::jason2() };
    let mut twin = make(&spec).expect("a valid twin");
    let masses = [(Dof::Surge, spec.plants[&Dof::Surge].mass)];
    on_a_battery(&mut twin);
    assert_right(&found(&twin), &masses);
    for as_tables in [false, true] {
        with_stated_voltage(&mut twin, as_tables);
        let part = assert_right(&found(&twin), &masses);
        assert!((part - 1.0).abs() < 0.01, "{part}");
    }
}

#[test]
fn several_axes_know_how_thrust_follows_voltage() {
    let spec = VehicleTwinSpec { duration_s: 200.0, ..VehicleTwinSpec::default() };
    let mut twin = make_vehicle(&spec, &boat()).expect("can be made");
    let masses = [(Dof::Surge, 60.0), (Dof::Sway, 90.0), (Dof::Yaw, 12.0)];
    on_a_battery(&mut twin);
    let of_curves = found(&twin);
    let part = assert_right(&of_curves, &masses);
    // The curves hold at another voltage than the mean of the trials.
    assert!((part - 1.0).abs() > 0.005, "{part}");
    with_stated_voltage(&mut twin, false);
    let stated = found(&twin);
    let part = assert_right(&stated, &masses);
    assert!((part - 1.0).abs() < 0.005, "{part}");
    let std = |plant: &PlantResult| plant.parameters["mass.surge"].std;
    assert!(std(&stated) < 0.5 * std(&of_curves));
}
