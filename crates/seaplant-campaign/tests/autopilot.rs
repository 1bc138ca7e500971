//! A published vehicle whose autopilot responds to disturbances that are not logged, or at instants
//! that are not.

use std::path::Path;

use seaplant::estimate::{PlantFit, fit_plant};
use seaplant::plant::{Structure, Symmetry};
use seaplant::twin::{Disturbance, TwinCampaign, VehicleTwinSpec, make_vehicle};
use seaplant::{BetweenSamples, Dof, Role, Timed, Trial, TrialRecord};
use seaplant_campaign::read_plant_file;

/// Bound on normalised errors: normal errors exceed it in one case of several hundred.
const DEVIATIONS: f64 = 3.0;

/// Makes trials of RexROV to fit a plant to, with its truth.
fn rexrov(spec: VehicleTwinSpec) -> (TwinCampaign, Vec<TrialRecord>) {
    let vehicle = "published:rexrov";
    let table = read_plant_file(Path::new(vehicle)).expect("a table").expect("a plant");
    let spec = VehicleTwinSpec { vehicle: vehicle.into(), duration_s: 150.0, ..spec };
    let twin = make_vehicle(&spec, &table.model().expect("possible")).expect("can be made");
    let fitted = twin.trials.iter().filter(|log| log.role == Role::Fit);
    let trials: Vec<Trial> = fitted.map(|log| log.trial(&twin).expect("complete")).collect();
    let measured = |trial: &Trial| trial.record(&Dof::ALL).expect("measured").clone();
    let records = trials.iter().map(measured).collect();
    (twin, records)
}

fn fitted(twin: &TwinCampaign, records: &[TrialRecord]) -> PlantFit {
    let structure = Structure::of(&Dof::ALL, Symmetry::PortStarboard).expect("six axes");
    let records: Vec<&TrialRecord> = records.iter().collect();
    let body = twin.vehicle.rigid_body.as_ref();
    fit_plant(&structure, &records, body, false).expect("an optimum")
}

fn assert_near(twin: &TwinCampaign, fit: &PlantFit, names: &[&str]) {
    let truth = &twin.truth.vehicle.as_ref().expect("a whole vehicle").coefficients;
    for name in names {
        let k = fit.plant.structure().names().iter().position(|own| own == name);
        let k = k.expect("a term of the plant");
        let (found, std) = (fit.plant.coefficients()[k], fit.covariance[(k, k)].sqrt());
        let off = (found - truth[*name]).abs();
        assert!(off < DEVIATIONS * std, "{name}: {found} ± {std}, {}", truth[*name]);
    }
}

/// A gyroscope of 50 Hz with thrust of 10 Hz. With the sample that the autopilot acts on in a mean
/// of three, inertias were 22 and 12 % too large, by 6 and 4 standard deviations.
#[test]
fn an_autopilots_response_is_not_attributed_to_inertia() {
    let disturbances = Disturbance::parse_list("tether").expect("known");
    let mut spec = VehicleTwinSpec { disturbances, ..VehicleTwinSpec::default() };
    spec.strength.tether_correlation_s = 3.0;
    let (twin, records) = rexrov(spec);
    let fit = fitted(&twin, &records);
    assert_near(&twin, &fit, &["mass.roll", "mass.pitch"]);
    let late = fit.actuator.delay_s;
    assert!(late >= 0.0, "thrust is logged as it acts, not {late} s later");
}

/// Thrust that is logged at every other command. Held from sample to sample, linear drag in roll
/// and pitch was a quarter of its true value, by 10 and 12 standard deviations.
#[test]
fn an_autopilots_commands_between_samples_are_not_attributed_to_drag() {
    const KEPT: usize = 2;
    let (twin, mut records) = rexrov(VehicleTwinSpec::default());
    let thinned = |series: &Timed| {
        let kept = |of: &[f64]| of.iter().copied().step_by(KEPT).collect::<Vec<f64>>();
        Timed::new("thrust", kept(series.time_s()), kept(series.values())).expect("valid")
    };
    for record in &mut records {
        for thruster in &mut record.thrusters {
            thruster.track.speed = thinned(&thruster.track.speed);
        }
        record.force = record.force.each_ref().map(|force| force.as_ref().map(thinned));
    }
    let fit = fitted(&twin, &records);
    // Commands that follow a motion are smooth, and each is held for 0.1 s: it acts half of that late.
    assert_ne!(fit.actuator.between, BetweenSamples::Held);
    let late = fit.actuator.delay_s + fit.actuator.lag_s;
    assert!((0.04..0.06).contains(&late), "half of a command is 0.05 s, found {late} s");
    assert_near(&twin, &fit, &["roll: p", "pitch: q", "mass.pitch", "lever.z"]);
}
