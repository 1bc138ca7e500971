//! Weighted least squares and the block bootstrap against NumPy, which does all
//! of it from the definitions: `reference/make_regressions_reference.py`.

use seaplant::estimate::{EquationError, Records, WeightedLeastSquares};
use seaplant::regression::{BlockBootstrap, Intervals};
use seaplant::{AxisRecord, Dof, Error, Fit, Grid, Motion, Terms, Timed};
use serde_json::Value;

/// Relative: both filter to 1e-10, and the problem's condition multiplies that.
const SAME: f64 = 1e-7;
/// Relative: where repeated weighing stops, a ten-thousandth of a standard deviation.
const WEIGHING: f64 = 1e-4;
/// Relative: chance in standard deviations over 20000 resamples is 0.5 %, twice.
const RESAMPLING: f64 = 0.03;

fn reference() -> Value {
    let text = include_str!("reference/regressions.json");
    serde_json::from_str(text).expect("made by the script beside it")
}

fn numbers(value: &Value) -> Vec<f64> {
    let array = value.as_array().expect("an array");
    array.iter().map(|x| x.as_f64().expect("a number")).collect()
}

/// As in the script.
fn thrust(k: f64) -> f64 {
    1500.0 * (0.0785 * k).sin() + 500.0 * (0.0211 * k + 1.0).sin()
}

fn axis(velocity: &[f64]) -> AxisRecord {
    let grid = Grid { start_s: 0.0, period_s: 0.1, len: velocity.len() };
    let measured = Timed::on_grid("velocity", grid, velocity.to_vec()).expect("finite");
    let taus = (0..grid.len).map(|k| thrust(k as f64)).collect();
    AxisRecord {
        dof: Dof::Surge,
        trial: "reference".to_owned(),
        force: measured.with_values("thrust", taus).expect("finite"),
        thrusters: Vec::new(),
        motion: Motion::Velocity(measured),
        lever_rates: None,
        turning: None,
        position: None,
        acceleration: None,
        cuts: Vec::new(),
    }
}

fn every() -> Terms {
    "force,quadratic,linear,bias".parse().expect("a plant")
}

/// The coefficients of the fitted terms.
fn assert_agrees(fit: &Fit, expected: &Value, within: f64) {
    let found = fit.lumped.to_vector();
    let found: Vec<f64> = fit.terms.fitted().iter().map(|term| found[*term as usize]).collect();
    for (found, expected) in found.iter().zip(numbers(expected)) {
        assert!((found / expected - 1.0).abs() < within, "{found} and {expected}");
    }
}

#[test]
fn least_squares_is_numpys() {
    let reference = reference();
    let axes = [axis(&numbers(&reference["velocity"]))];
    let fit = EquationError::default().fit(&axes).expect("exciting");
    assert_agrees(&fit, &reference["least_squares"], SAME);
}

#[test]
fn weights_settle_where_numpys_do() {
    let reference = reference();
    let axes = [axis(&numbers(&reference["velocity"]))];
    let weighted = WeightedLeastSquares::default();
    let of = |terms| weighted.fit(Records::from(&axes).with_terms(terms)).expect("settles");
    assert_agrees(&of(Terms::default()), &reference["weighted"], WEIGHING);
    assert_agrees(&of(every()), &reference["weighted_with_linear"], WEIGHING);
}

#[test]
fn resampled_blocks_scatter_as_numpys_do() {
    let reference = reference();
    let axes = [axis(&numbers(&reference["velocity"]))];
    let of = |seed| {
        let bootstrap = BlockBootstrap { resamples: 20_000, seed, block_s: 20.0 };
        let intervals = Intervals::BlockBootstrap;
        EquationError { intervals, bootstrap, ..Default::default() }.fit(&axes).expect("exciting")
    };
    let fit = of(1);
    assert_agrees(&fit, &reference["least_squares"], SAME);
    let std = fit.covariance.diagonal().map(f64::sqrt);
    for (j, expected) in [0, 1, 3].into_iter().zip(numbers(&reference["bootstrap_std"])) {
        assert!((std[j] / expected - 1.0).abs() < RESAMPLING, "{j}: {} and {expected}", std[j]);
    }
    assert_eq!(of(1), fit);
    assert_ne!(of(2).covariance, fit.covariance);
}

#[test]
fn refuses_a_bootstrap_that_says_nothing() {
    let axes = [axis(&numbers(&reference()["velocity"]))];
    for (resamples, block_s) in [(99, 20.0), (usize::MAX, 20.0), (2000, 0.5), (2000, f64::NAN)] {
        let bootstrap = BlockBootstrap { resamples, block_s, ..Default::default() };
        let intervals = Intervals::BlockBootstrap;
        let refused = EquationError { intervals, bootstrap, ..Default::default() }.fit(&axes);
        assert!(matches!(refused, Err(Error::Bootstrap { .. })), "{refused:?}");
    }
}
