//! A published vehicle whose autopilot answers what nobody logs.

use std::path::Path;

use seaplant::estimate::fit_coupled;
use seaplant::plant::{Basis, Structure, Symmetry};
use seaplant::twin::{Disturbance, WholeTwinSpec, make_whole};
use seaplant::{CoupledRecord, Dof, Role, Trial};
use seaplant_campaign::read_plant_file;

/// Of two numbers whose errors are normal, chance puts one in two hundred further off.
const DEVIATIONS: f64 = 3.0;

/// A gyroscope of 50 Hz beside thrust of 10 Hz. With the sample that the autopilot acts on in a
/// mean of three, inertias were 22 and 12 % too large, by 6 and 4 standard deviations.
#[test]
fn what_an_autopilot_answers_does_not_pass_for_inertia() {
    let vehicle = "published:rexrov";
    let table = read_plant_file(Path::new(vehicle)).expect("a table").expect("a plant");
    let mut spec =
        WholeTwinSpec { vehicle: vehicle.into(), duration_s: 150.0, ..WholeTwinSpec::default() };
    spec.disturbances = Disturbance::parse_list("tether").expect("known");
    spec.strength.tether_correlation_s = 3.0;
    let twin = make_whole(&spec, &table.model().expect("possible")).expect("can be made");
    let fitted = twin.trials.iter().filter(|log| log.role == Role::Fit);
    let trials: Vec<Trial> = fitted.map(|log| log.trial(&twin).expect("complete")).collect();
    let records: Vec<&CoupledRecord> =
        trials.iter().map(|trial| trial.coupled(&Dof::ALL).expect("measured")).collect();
    let structure = Structure::of(&Dof::ALL, Symmetry::PortStarboard).expect("six axes");
    let body = twin.vehicle.rigid_body.as_ref();
    let fit = fit_coupled(&structure, &records, body, false).expect("an optimum");
    let truth = &twin.truth.vehicle.as_ref().expect("a whole vehicle").coefficients;
    for (dof, name) in [(Dof::Roll, "mass.roll"), (Dof::Pitch, "mass.pitch")] {
        let found = fit.plant.mass_matrix()[(dof.index(), dof.index())];
        let std = fit.std(&Basis::Mass(dof, dof)).expect("fitted");
        let off = (found - truth[name]).abs();
        assert!(off < DEVIATIONS * std, "{name}: {found} ± {std}, {}", truth[name]);
    }
}
