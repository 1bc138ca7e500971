//! Filters, derivatives and quantiles against SciPy's: `reference/make_scipy_reference.py`.

use seaplant::Timed;
use seaplant::estimate::t_quantile_975;
use seaplant::signal::{LowPass, differentiate, differentiate_timed};
use serde_json::Value;

const SAMPLE_HZ: f64 = 10.0;

/// What the filter promises, of signals of size one.
const FILTER: f64 = 1e-10;
/// Rounding of the same operations in another order.
const ROUNDING: f64 = 1e-12;

fn reference() -> Value {
    let text = include_str!("reference/scipy.json");
    serde_json::from_str(text).expect("made by the script beside it")
}

fn numbers(value: &Value) -> Vec<f64> {
    let array = value.as_array().expect("an array");
    array.iter().map(|x| x.as_f64().expect("a number")).collect()
}

/// As in the script.
fn series(n: usize) -> Vec<f64> {
    let at = |t: f64| (0.785 * t).sin() + 0.3 * (7.1 * t + 0.4).sin() + 0.05 * t;
    (0..n).map(|k| at(k as f64 / SAMPLE_HZ)).collect()
}

fn worst(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn the_zero_phase_filter_is_sosfiltfilt() {
    let reference = reference();
    let filters = reference["filters"].as_array().expect("an array");
    assert_eq!(filters.len(), 8);
    for case in filters {
        let filter = LowPass {
            cutoff_hz: case["cutoff_hz"].as_f64().expect("a number"),
            order: case["order"].as_u64().expect("a number") as usize,
        };
        let y = filter.zero_phase(&series(400), SAMPLE_HZ).expect("long enough");
        let worst = worst(&y, &numbers(&case["y"]));
        assert!(worst < FILTER, "{filter:?}: {worst:e}");
    }
}

#[test]
fn the_shortest_series_is_filtered_alike() {
    let filter = LowPass { cutoff_hz: 0.125, order: 2 };
    let y = filter.zero_phase(&series(10), SAMPLE_HZ).expect("just long enough");
    assert!(worst(&y, &numbers(&reference()["shortest"])) < FILTER);
}

#[test]
fn derivatives_are_numpys_gradient() {
    let reference = reference();
    let even = differentiate(&series(60), 1.0 / SAMPLE_HZ).expect("long enough");
    assert!(worst(&even, &numbers(&reference["gradient"])) < ROUNDING * SAMPLE_HZ);
    let t = numbers(&reference["uneven_time_s"]);
    let x: Vec<f64> = t.iter().map(|t| t.sin()).collect();
    let uneven = differentiate_timed(&Timed::new("x", t, x).expect("valid")).expect("long enough");
    assert!(worst(uneven.values(), &numbers(&reference["uneven_gradient"])) < ROUNDING * 20.0);
}

#[test]
fn quantiles_of_students_t_are_scipys() {
    let reference = reference();
    for (freedom, expected) in reference["t_975"].as_object().expect("an object") {
        let found = t_quantile_975(freedom.parse().expect("a number"));
        let expected = expected.as_f64().expect("a number");
        assert!((found / expected - 1.0).abs() < 1e-9, "{freedom}: {found} and {expected}");
    }
}
