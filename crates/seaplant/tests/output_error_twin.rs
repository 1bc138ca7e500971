//! What output error makes of the twin, whose truth is known.

use seaplant::estimate::OutputError;
use seaplant::twin::{TwinSpec, make};
use seaplant::{Dof, Role, Trial, TrialSetup, VelocitySource};

const SEEDS: std::ops::RangeInclusive<u64> = 1..=5;

/// Rounded propeller speeds, jitter and noise are left: 0.14 % of yaw inertia at worst, in
/// the median of eight seeds.
const PERCENT: f64 = 0.5;

#[test]
fn finds_the_undisturbed_plant() {
    let campaigns: Vec<_> = SEEDS
        .map(|seed| make(&TwinSpec { seed, ..TwinSpec::jason2() }).expect("can be made"))
        .collect();
    for dof in [Dof::Surge, Dof::Sway, Dof::Heave, Dof::Yaw] {
        let (mut mass, mut drag) = (Vec::new(), Vec::new());
        for campaign in &campaigns {
            let made = campaign.trials.iter().find(|t| t.dofs == [dof] && t.role == Role::Fit);
            let made = made.expect("one to fit");
            let setup =
                TrialSetup { name: made.name.clone(), dofs: vec![dof], ..Default::default() };
            let trial = Trial::new(setup, &made.recording, &campaign.vehicle).expect("complete");
            let axes = [trial.axis(dof, VelocitySource::Measured).expect("measured")];
            let found = OutputError::default().fit(&axes).expect("an optimum");
            let (found, truth) = (found.physical(), campaign.truth.plants[&dof]);
            mass.push(100.0 * (found.mass / truth.mass - 1.0).abs());
            drag.push(100.0 * (found.d_quadratic / truth.quadratic_drag - 1.0).abs());
        }
        for (mut errors, name) in [(mass, "mass"), (drag, "drag")] {
            errors.sort_by(f64::total_cmp);
            let median = errors[errors.len() / 2];
            assert!(median < PERCENT, "{dof} {name}: {median:.2} %");
        }
    }
}
