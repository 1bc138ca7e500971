//! Output error against SciPy's integrator and optimiser:
//! `reference/make_output_error_reference.py`.

use seaplant::estimate::{OutputError, Records};
use seaplant::{AxisRecord, Dof, Grid, LumpedParameters, Motion, Terms, Timed};
use serde_json::Value;

/// Relative: what RK4 in steps of 0.1 s is off by, and where both searches stop.
const AGREE: f64 = 1e-6;

const START: LumpedParameters =
    LumpedParameters { alpha: 6e-5, beta: -0.15, mu: -0.01, bias: 0.01 };

fn numbers(value: &Value) -> Vec<f64> {
    let array = value.as_array().expect("an array");
    array.iter().map(|x| x.as_f64().expect("a number")).collect()
}

/// As in the script.
fn thrust(k: f64) -> f64 {
    1500.0 * (0.0785 * k).sin() + 400.0 * (0.0211 * k + 1.0).sin()
}

fn fit(values: Vec<f64>, motion: fn(Timed) -> Motion) -> LumpedParameters {
    let grid = Grid { start_s: 0.0, period_s: 0.1, len: values.len() };
    let measured = Timed::on_grid("motion", grid, values).expect("finite");
    let taus = (0..grid.len).map(|k| thrust(k as f64)).collect();
    let axis = AxisRecord {
        dof: Dof::Surge,
        trial: "reference".to_owned(),
        force: measured.with_values("thrust", taus).expect("finite"),
        thrusters: Vec::new(),
        motion: motion(measured),
        lever_rates: None,
        turning: None,
        position: None,
        acceleration: None,
        cuts: Vec::new(),
    };
    let terms: Terms = "force,quadratic,linear,bias".parse().expect("a plant");
    let records = [axis];
    let records = Records::from(&records).with_terms(terms);
    OutputError::default().fit_from(records, &START).expect("an optimum").lumped
}

fn assert_agrees(found: LumpedParameters, expected: &[f64], tolerance: f64) {
    for (found, expected) in found.to_vector().iter().zip(expected) {
        assert!((found / expected - 1.0).abs() < tolerance, "{found} and {expected}");
    }
}

fn reference() -> Value {
    let text = include_str!("reference/output_error.json");
    serde_json::from_str(text).expect("made by the script beside it")
}

#[test]
fn fits_velocity_as_scipy_does() {
    let reference = reference();
    let found = fit(numbers(&reference["velocity"]), Motion::Velocity);
    assert_agrees(found, &numbers(&reference["fit_of_velocity"]), AGREE);
}

#[test]
fn fits_position_as_scipy_does() {
    let reference = reference();
    let found = fit(numbers(&reference["position"]), Motion::Position);
    assert_agrees(found, &numbers(&reference["fit_of_position"]), AGREE);
}

/// Relative: the walk is found to a hundredth, and the optimum hardly depends on it.
const AGREE_ON_A_WALK: f64 = 1e-3;

#[test]
fn fits_drifting_position_as_a_dense_covariance_does() {
    let reference = reference();
    let found = fit(numbers(&reference["drifting"]), Motion::Position);
    assert_agrees(found, &numbers(&reference["fit_of_drifting"]), AGREE_ON_A_WALK);
}
