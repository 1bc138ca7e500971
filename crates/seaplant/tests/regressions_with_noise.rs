//! Which regressions a wandering force pulls away from the truth, and which not.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use seaplant::estimate::{EquationError, Records, WeightedLeastSquares};
use seaplant::regression::Intervals;
use seaplant::signal::LowPass;
use seaplant::twin::{TwinSpec, make};
use seaplant::{
    AxisRecord, CaveatCode, Dof, Error, Fit, Grid, Motion, PhysicalParameters, Role, State, Terms,
    Timed, Trial, TrialSetup, VelocitySource, simulate,
};

const PLANT: PhysicalParameters =
    PhysicalParameters { mass: 1000.0, d_quadratic: 800.0, d_linear: 0.0, bias_force: 20.0 };
const PERIOD_S: f64 = 0.1;

/// A method, with the filters of equation error.
type Method = fn(Records<'_>, EquationError) -> Result<Fit, Error>;

const PLAIN: Method = |records, with| with.fit(records);
const WEIGHTED: Method = |records, with| WeightedLeastSquares(with).fit(records);

fn normals(seed: u64, n: usize) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..n).map(|_| rng.sample(StandardNormal)).collect()
}

/// A vehicle under levels of thrust that chance sets, with a force that no one logs.
fn record(seed: u64, len: usize, noise: f64, unlogged: &[f64]) -> AxisRecord {
    let grid = Grid { start_s: 0.0, period_s: PERIOD_S, len };
    let levels = normals(seed, len / 40 + 1);
    let steps: Vec<f64> = (0..len).map(|k| 400.0 * levels[k / 40]).collect();
    // The method's own filters bend steps, which is not what is looked at here.
    let gentle = LowPass { cutoff_hz: 0.15, order: 2 };
    let thrust = gentle.zero_phase(&steps, 1.0 / PERIOD_S).expect("long enough");
    let force = Timed::on_grid("thrust", grid, thrust).expect("finite");
    let all = force.values().iter().zip(unlogged).map(|(a, b)| a + b).collect();
    let all = force.with_values("all forces", all).expect("finite");
    let times: Vec<f64> = grid.times().collect();
    let plant = PLANT.to_lumped();
    let moved = simulate(Dof::Surge, &plant, &all, State::default(), &times).expect("stable");
    let errors = normals(seed + 1_000_000, len);
    let seen = moved.velocity.iter().zip(errors).map(|(v, e)| v + noise * e).collect();
    AxisRecord {
        dof: Dof::Surge,
        trial: "surge".to_owned(),
        motion: Motion::Velocity(force.with_values("velocity", seen).expect("finite")),
        force,
        thrusters: Vec::new(),
        lever_rates: None,
        turning: None,
        position: None,
        acceleration: None,
        cuts: Vec::new(),
    }
}

/// A force that wanders: its deviation in N, with a correlation time of 20 s.
fn wandering(seed: u64, len: usize, std: f64) -> Vec<f64> {
    let keep = (-PERIOD_S / 20.0).exp();
    let renew = (1.0 - keep * keep).sqrt();
    let step = |x: &mut f64, e: f64| {
        *x = keep * *x + renew * e;
        Some(std * *x)
    };
    normals(seed + 2_000_000, len).into_iter().scan(0.0, step).collect()
}

/// Mean error of drag over some seeds, in parts of the truth.
fn drag_error(method: Method, of: impl Fn(u64) -> AxisRecord) -> f64 {
    let terms: Terms = "force,quadratic,bias".parse().expect("a plant");
    let fits = (0..SEEDS).map(|seed| {
        let records = [of(seed)];
        let records = Records::from(&records).with_terms(terms);
        let fit = method(records, EquationError::default()).expect("exciting");
        fit.physical().d_quadratic / PLANT.d_quadratic - 1.0
    });
    fits.sum::<f64>() / SEEDS as f64
}

const SEEDS: u64 = 20;

#[test]
fn weights_take_most_of_a_wandering_force_away() {
    let of = |seed| record(seed, 6000, 0.003, &wandering(seed, 6000, 60.0));
    let (plain, weighted) = (drag_error(PLAIN, of), drag_error(WEIGHTED, of));
    assert!(plain.abs() > 0.02, "{plain}");
    assert!(weighted.abs() < 0.3 * plain.abs(), "{weighted} and {plain}");
}

fn with_blocks() -> EquationError {
    EquationError { intervals: Intervals::BlockBootstrap, ..Default::default() }
}

#[test]
fn resampled_blocks_and_batch_means_agree_and_cover() {
    let plain = EquationError::default();
    let (mut ratios, mut estimates, mut named) = (Vec::new(), Vec::new(), 0);
    for seed in 0..100 {
        let white: Vec<f64> = normals(seed + 3_000_000, 6000).iter().map(|e| 40.0 * e).collect();
        let axes = [record(seed, 6000, 0.0, &white)];
        let of = |with: &EquationError| with.fit(&axes).expect("exciting");
        let (batches, blocks) = (of(&plain), of(&with_blocks()));
        let moved = batches.lumped.to_vector() - blocks.lumped.to_vector();
        assert!(moved.amax() < 1e-12, "{moved}");
        named += blocks.caveats.len();
        let std = |fit: &Fit| fit.estimates().mass.std;
        ratios.push(std(&blocks) / std(&batches));
        estimates.push(blocks.estimates().mass);
    }
    ratios.sort_by(f64::total_cmp);
    assert!((ratios[50] - 1.0).abs() < 0.05, "{}", ratios[50]);
    // Even a force without memory moves the vehicle, and so the estimate, by 0.2 %. Intervals
    // are there for the scatter about where the estimate comes out on average.
    let mean = estimates.iter().map(|mass| mass.value).sum::<f64>() / 100.0;
    assert!((mean / PLANT.mass - 1.0).abs() < 0.005, "{mean}");
    let covered = estimates.iter().filter(|mass| mass.covers(mean)).count();
    // 95 % of 100, give or take two standard deviations.
    assert!((90..=99).contains(&covered), "{covered} of 100");
    assert!(named <= 2, "a force without memory is taken for one that wanders {named} times");
}

#[test]
fn a_wandering_force_is_named_where_intervals_do_not_show_it() {
    let axes = [record(3, 6000, 0.003, &wandering(3, 6000, 60.0))];
    let caveats = with_blocks().fit(&axes).expect("exciting").caveats;
    assert!(caveats.iter().any(|c| c.code == CaveatCode::ResidualsNotWhite), "{caveats:?}");
}

/// In %: propeller speeds are rounded, and yaw is derived from heading, by 0.4 % too small.
const CLEAN_TWIN: f64 = 1.0;

#[test]
fn weighted_least_squares_finds_the_undisturbed_twin() {
    let campaign = make(&TwinSpec { seed: 4, ..TwinSpec::jason2() }).expect("can be made");
    for dof in [Dof::Surge, Dof::Sway, Dof::Heave, Dof::Yaw] {
        let made = campaign.trials.iter().find(|t| t.dofs == [dof] && t.role == Role::Fit);
        let made = made.expect("one to fit");
        let setup = TrialSetup { name: made.name.clone(), dofs: vec![dof], ..Default::default() };
        let trial = Trial::new(setup, &made.recording, &campaign.vehicle).expect("complete");
        let axes = [trial.axis(dof, VelocitySource::Measured).expect("measured")];
        let truth = campaign.truth.plants[&dof];
        let fit = WEIGHTED(Records::from(&axes), EquationError::default()).expect("exciting");
        let found = fit.physical();
        for (name, found, truth) in
            [("mass", found.mass, truth.mass), ("drag", found.d_quadratic, truth.quadratic_drag)]
        {
            let off = 100.0 * (found / truth - 1.0);
            assert!(off.abs() < CLEAN_TWIN, "{dof} {name}: {off} %");
        }
    }
}
