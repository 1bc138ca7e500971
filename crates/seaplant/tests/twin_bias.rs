//! What the estimators make of the twin, whose truth is known: the paper's filter
//! misleads, equal filtering does not, and an ignored lag misleads both.

use seaplant::estimate::steady::{SteadyFit, SteadyOptions, fit_steady};
use seaplant::estimate::{EquationError, Paper};
use seaplant::twin::{Disturbance, TwinCampaign, TwinSpec, TwinTrial, make};
use seaplant::{Dof, PhysicalParameters, Role, Trial, TrialSetup, VelocitySource};

const DOFS: [Dof; 4] = [Dof::Surge, Dof::Sway, Dof::Heave, Dof::Yaw];
const SEEDS: std::ops::RangeInclusive<u64> = 1..=5;

fn campaigns(disturbances: &str) -> Vec<TwinCampaign> {
    let make_one = |seed| {
        let disturbances = Disturbance::parse_list(disturbances).expect("known");
        make(&TwinSpec { seed, disturbances, ..TwinSpec::jason2() }).expect("can be made")
    };
    SEEDS.map(make_one).collect()
}

fn trial(campaign: &TwinCampaign, made: &TwinTrial) -> Trial {
    let setup = TrialSetup {
        name: made.name.clone(),
        role: made.role,
        dofs: made.dofs.clone(),
        ..Default::default()
    };
    Trial::new(setup, &made.recording, &campaign.vehicle).expect("complete")
}

fn paper(dof: Dof, trial: &Trial) -> PhysicalParameters {
    let axis = trial.axis(dof, VelocitySource::Position).expect("navigated");
    Paper::default().fit(&[axis]).expect("excited").physical()
}

fn equation_error(dof: Dof, trial: &Trial) -> PhysicalParameters {
    let axis = trial.axis(dof, VelocitySource::Measured).expect("measured");
    EquationError::default().fit(&[axis]).expect("excited").physical()
}

/// Median errors of mass and quadratic drag over the seeds, %.
fn median_errors(
    campaigns: &[TwinCampaign],
    dof: Dof,
    fit: fn(Dof, &Trial) -> PhysicalParameters,
) -> (f64, f64) {
    let (mut mass, mut drag) = (Vec::new(), Vec::new());
    for campaign in campaigns {
        let of_dof = |made: &&TwinTrial| made.dofs == [dof] && made.role == Role::Fit;
        let made = campaign.trials.iter().find(of_dof).expect("one to fit");
        let found = fit(dof, &trial(campaign, made));
        let truth = campaign.truth.plants[&dof];
        mass.push(100.0 * (found.mass / truth.mass - 1.0));
        drag.push(100.0 * (found.d_quadratic / truth.quadratic_drag - 1.0));
    }
    (median(mass), median(drag))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Without a disturbance what is left is noise, rounding and jitter: below 1 %.
const EQUATION_ERROR_PERCENT: f64 = 2.0;

#[test]
fn equal_filtering_finds_the_undisturbed_plant() {
    let campaigns = campaigns("none");
    for dof in DOFS {
        let (mass, drag) = median_errors(&campaigns, dof, equation_error);
        assert!(mass.abs() < EQUATION_ERROR_PERCENT, "{dof} mass: {mass:.2} %");
        assert!(drag.abs() < EQUATION_ERROR_PERCENT, "{dof} drag: {drag:.2} %");
    }
}

/// m / |H(f)| at the excited frequencies, give or take the joystick's slower motion: +98,
/// +7, +14 and +319 % over many seeds.
const PAPER_MASS_PERCENT: [(f64, f64); 4] =
    [(90.0, 107.0), (4.0, 11.0), (8.0, 20.0), (290.0, 350.0)];
/// A prototype in Python had +14, 0, +12 and +112 (medians of 20 runs); yaw varies by ±20
/// from seed to seed with the joystick.
const PAPER_DRAG_PERCENT: [(f64, f64); 4] = [(5.0, 23.0), (-6.0, 5.0), (5.0, 20.0), (95.0, 150.0)];

#[test]
fn the_papers_filter_makes_vehicles_heavier_than_they_are() {
    let campaigns = campaigns("none");
    for (k, dof) in DOFS.into_iter().enumerate() {
        let (mass, drag) = median_errors(&campaigns, dof, paper);
        let inside = |(low, high): (f64, f64), x: f64| (low..high).contains(&x);
        assert!(inside(PAPER_MASS_PERCENT[k], mass), "{dof} mass: {mass:.1} %");
        assert!(inside(PAPER_DRAG_PERCENT[k], drag), "{dof} drag: {drag:.1} %");
    }
}

#[test]
fn a_lag_that_is_ignored_hides_most_of_the_drag() {
    let campaigns = campaigns("lag");
    let (mass, drag) = median_errors(&campaigns, Dof::Surge, equation_error);
    assert!((2.0..15.0).contains(&mass), "{mass:.1} %");
    // Thrust that acts 0.3 s later than it is logged makes the mass look like a negative
    // drag of m ω² 0.3 s = 2400 N/(m/s) at the sine's frequency, as large as the true one.
    assert!((-120.0..-70.0).contains(&drag), "{drag:.1} %");
}

fn steady(campaign: &TwinCampaign) -> SteadyFit {
    let runs = campaign.trials.iter().filter(|made| made.role == Role::Steady);
    let runs: Vec<Trial> = runs.map(|made| trial(campaign, made)).collect();
    let runs: Vec<&Trial> = runs.iter().collect();
    fit_steady(Dof::Heave, &runs, &SteadyOptions::default()).expect("steady after a while")
}

/// A run counts as steady a little before it is: half a per cent.
const STEADY_DRAG_PERCENT: f64 = 5.0;
const STEADY_BIAS_N: f64 = 60.0;

#[test]
fn steady_runs_up_and_down_tell_drag_from_ballast() {
    for campaign in campaigns("none") {
        let fit = steady(&campaign);
        let truth = campaign.truth.steady[&Dof::Heave];
        let joint = fit.joint.expect("both directions");
        let drag = 100.0 * (joint.d_quadratic.value / truth.quadratic_drag - 1.0);
        assert!(drag.abs() < STEADY_DRAG_PERCENT, "{drag:.1} %");
        let bias = joint.bias_force.value - truth.bias_force;
        assert!(bias.abs() < STEADY_BIAS_N, "{bias:.0} N");
        // By itself, a slow run down looks 78 % draggier than it is.
        let slow = fit.segments.iter().find(|s| s.trial == "heave down 30 %").expect("found");
        assert!(slow.d_quadratic.value > 1.5 * truth.quadratic_drag);
    }
}
