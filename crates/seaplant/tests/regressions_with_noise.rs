//! Which regressions noise of velocity, a wandering force and a controller pull away from
//! the truth, and which not.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use seaplant::estimate::{EquationError, Records, Sriv, TotalLeastSquares, WeightedLeastSquares};
use seaplant::regression::Intervals;
use seaplant::signal::LowPass;
use seaplant::twin::{TwinSpec, make};
use seaplant::{
    AxisRecord, CaveatCode, Dof, Error, Fit, Grid, Motion, PhysicalParameters, Role, State, Term,
    Terms, Timed, Trial, TrialSetup, VelocitySource, simulate,
};

const PLANT: PhysicalParameters =
    PhysicalParameters { mass: 1000.0, d_quadratic: 800.0, d_linear: 0.0, bias_force: 20.0 };
const PERIOD_S: f64 = 0.1;

/// A method, with the filters of equation error.
type Method = fn(Records<'_>, EquationError) -> Result<Fit, Error>;

const PLAIN: Method = |records, with| with.fit(records);
const WEIGHTED: Method = |records, with| WeightedLeastSquares(with).fit(records);
const TOTAL: Method = |records, with| TotalLeastSquares(with).fit(records);
const SRIV: Method = |records, with| Sriv(with).fit(records);

fn normals(seed: u64, n: usize) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..n).map(|_| rng.sample(StandardNormal)).collect()
}

/// Without v|v|, whose mean noise lifts, noise shows in its pure form.
const LINEAR: PhysicalParameters =
    PhysicalParameters { mass: 1000.0, d_quadratic: 0.0, d_linear: 400.0, bias_force: 20.0 };

/// A vehicle under levels of thrust that chance sets, with a force that no one logs.
fn record(seed: u64, len: usize, noise: f64, unlogged: &[f64]) -> AxisRecord {
    record_of(&PLANT, seed, len, noise, unlogged)
}

fn record_of(
    plant: &PhysicalParameters,
    seed: u64,
    len: usize,
    noise: f64,
    unlogged: &[f64],
) -> AxisRecord {
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
    let plant = plant.to_lumped();
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

/// Mean error of drag over some seeds, in parts of the truth, and how far chance moves
/// that mean.
fn drag_error(
    method: Method,
    terms: &str,
    with: EquationError,
    of: impl Fn(u64) -> AxisRecord,
) -> (f64, f64) {
    let terms: Terms = terms.parse().expect("a plant");
    let fits = (0..SEEDS).map(|seed| {
        let records = [of(seed)];
        let fit = method(Records::from(&records).with_terms(terms), with).expect("exciting");
        let found = fit.physical();
        match terms.has(Term::Linear) {
            true => found.d_linear / LINEAR.d_linear - 1.0,
            false => found.d_quadratic / PLANT.d_quadratic - 1.0,
        }
    });
    let errors: Vec<f64> = fits.collect();
    let n = SEEDS as f64;
    let mean = errors.iter().sum::<f64>() / n;
    let variance = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

const SEEDS: u64 = 20;

/// A filter that lets much noise into v|v|.
fn open() -> EquationError {
    EquationError {
        velocity_filter: LowPass { cutoff_hz: 3.0, order: 2 },
        term_filter: LowPass { cutoff_hz: 1.5, order: 2 },
        ..Default::default()
    }
}

#[test]
fn noise_of_velocity_pulls_least_squares_but_not_sriv_and_total_least_squares() {
    let of = |seed| record_of(&LINEAR, seed, 6000, 0.3, &[0.0; 6000]);
    let error = |method: Method| drag_error(method, "force,linear,bias", open(), of);
    let (plain, _) = error(PLAIN);
    assert!(plain < -0.04, "least squares is off by {plain}");
    for (name, method) in [("SRIV", SRIV), ("total least squares", TOTAL)] {
        let (mean, chance) = error(method);
        assert!(mean.abs() < 3.0 * chance, "{name}: {mean} ± {chance}");
        assert!(chance < 0.2 * plain.abs(), "{name}: {chance}");
    }
}

#[test]
fn intervals_hold_the_truth_under_noise_of_velocity() {
    let terms: Terms = "force,linear,bias".parse().expect("a plant");
    for (method, highest) in [(SRIV, 99), (TOTAL, 100)] {
        let covers = |seed: &u64| {
            let axes = [record_of(&LINEAR, *seed, 6000, 0.1, &[0.0; 6000])];
            let records = Records::from(&axes).with_terms(terms);
            let fit = method(records, open()).expect("exciting");
            let drag = fit.estimates().d_linear.expect("fitted");
            drag.covers(LINEAR.d_linear)
        };
        let covered = (0..100).filter(covers).count();
        // 95 % of 100, give or take two standard deviations. Differences of noise take each
        // other away but at the ends of batches, so that where v is derived intervals are
        // wide: 100 of 100.
        assert!((90..=highest).contains(&covered), "{covered} of 100");
    }
}

#[test]
fn weights_take_most_of_a_wandering_force_away() {
    let of = |seed| record(seed, 6000, 0.003, &wandering(seed, 6000, 60.0));
    let with = EquationError::default();
    let error = |method: Method| drag_error(method, "force,quadratic,bias", with, of);
    let (plain, _) = error(PLAIN);
    let (weighted, _) = error(WEIGHTED);
    assert!(plain.abs() > 0.02, "{plain}");
    assert!(weighted.abs() < 0.3 * plain.abs(), "{weighted} and {plain}");
    // Open loop: what force alone drives knows nothing of the other.
    let (sriv, chance) = error(SRIV);
    assert!(sriv.abs() < 3.0 * chance, "{sriv} ± {chance}");
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
    let caveats = TotalLeastSquares(open()).fit(&axes).expect("exciting").caveats;
    assert!(caveats.iter().any(|c| c.code == CaveatCode::MoreThanNoise), "{caveats:?}");
}

#[test]
fn sriv_gives_no_answer_for_motion_that_force_does_not_make() {
    let len = 2000;
    let other = record(8, len, 0.0, &[0.0; 2000]);
    for seed in 0..10 {
        let axis = AxisRecord {
            motion: other.motion.clone(),
            ..record(seed + 20, len, 0.0, &[0.0; 2000])
        };
        match Sriv::default().fit(&[axis]) {
            Err(
                Error::NotConverged { .. } | Error::Diverged { .. } | Error::NotExciting { .. },
            ) => {}
            Err(other) => panic!("{other}"),
            // By chance one force is like another: then the answer must be unsure.
            Ok(fit) => {
                let mass = fit.estimates().mass;
                assert!(mass.std > 0.1 * mass.value.abs(), "{mass:?}");
            }
        }
    }
}

/// In %: propeller speeds are rounded, and yaw is derived from heading, by 0.4 % too small.
const CLEAN_TWIN: f64 = 1.0;

#[test]
fn all_find_the_undisturbed_twin() {
    let campaign = make(&TwinSpec { seed: 4, ..TwinSpec::jason2() }).expect("can be made");
    for dof in [Dof::Surge, Dof::Sway, Dof::Heave, Dof::Yaw] {
        let made = campaign.trials.iter().find(|t| t.dofs == [dof] && t.role == Role::Fit);
        let made = made.expect("one to fit");
        let setup = TrialSetup { name: made.name.clone(), dofs: vec![dof], ..Default::default() };
        let trial = Trial::new(setup, &made.recording, &campaign.vehicle).expect("complete");
        let axes = [trial.axis(dof, VelocitySource::Measured).expect("measured")];
        let truth = campaign.truth.plants[&dof];
        for method in [WEIGHTED, TOTAL, SRIV] {
            let fit = method(Records::from(&axes), EquationError::default()).expect("exciting");
            let found = fit.physical();
            for (name, found, truth) in [
                ("mass", found.mass, truth.mass),
                ("drag", found.d_quadratic, truth.quadratic_drag),
            ] {
                let off = 100.0 * (found / truth - 1.0);
                assert!(off.abs() < CLEAN_TWIN, "{} {dof} {name}: {off} %", fit.method);
            }
        }
    }
}
