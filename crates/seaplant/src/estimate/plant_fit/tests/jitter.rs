//! Thrust that changes between samples of its log.

use super::*;

/// A vehicle whose forces take new levels at any time, and are logged ten times a second.
fn changing_between_samples(plant: &Plant, trial: &str, seed: u64) -> TrialRecord {
    let mut random = random(seed);
    let times =
        |period_s: f64| (0..(200.0 / period_s) as u32).map(move |k| period_s * f64::from(k));
    let (finely, time_s): (Vec<f64>, Vec<f64>) = (times(0.01).collect(), times(0.1).collect());
    let mut series = |amplitude, dwell| Some(stepped(&finely, &mut random, (amplitude, dwell)));
    let acting = [series(20.0, 123), series(20.0, 177), None, None, None, series(1.0, 59)];
    let at_samples = |force: &Timed| {
        let values: Vec<f64> = time_s.iter().map(|t| force.held_at(t + 0.001)).collect();
        Timed::new("force", time_s.clone(), values).expect("valid")
    };
    let force = acting.each_ref().map(|force| force.as_ref().map(at_samples));
    let empty = TrialRecord::until(trial, time_s[time_s.len() - 1]);
    driven(plant, TrialRecord { force, ..empty }, acting, (&time_s, 0.002, &mut random))
}

/// Ten instants between a sample and the next at which a change may act, evenly: their standard deviation and mean.
const SPREAD_S: f64 = 0.0287;
const MEAN_S: f64 = 0.045;

#[test]
fn thrust_that_changes_between_samples_of_its_log_has_jitter() {
    let plant = planar();
    let records =
        [("a", 1), ("b", 2)].map(|(trial, seed)| changing_between_samples(&plant, trial, seed));
    let records: Vec<&TrialRecord> = records.iter().collect();
    let fit = fit_plant(plant.structure(), &records, None, false).expect("a plant");
    let (jitter_s, _) = fit.thrust_jitter_s.expect("changes act at any time");
    // Some of it remains in the disturbance.
    assert!((jitter_s - SPREAD_S).abs() < 0.2 * SPREAD_S, "{jitter_s} s");
    assert!((fit.actuator.delay_s + MEAN_S).abs() < 0.2 * MEAN_S, "{} s", fit.actuator.delay_s);
    let terms = plant.structure().terms().iter().zip(plant.coefficients());
    for (k, (term, expected)) in terms.enumerate() {
        let (found, std) = (fit.plant.coefficients()[k], fit.covariance[(k, k)].sqrt());
        assert!((found - expected).abs() < 3.5 * std, "{term}: {found} ± {std}, {expected}");
        // Without jitter masses are off by up to 0.6 %, and innovations have a colour of up to 10.
        let is_mass = matches!(term, Basis::Mass(i, j) if i == j);
        assert!(!is_mass || (found / expected - 1.0).abs() < 0.003, "{term}: {found}, {expected}");
    }
    assert!(fit.whiteness.values().all(|colour| *colour < 3.0), "{:?}", fit.whiteness);
}

#[test]
fn thrust_that_changes_when_its_log_says_has_no_jitter() {
    let plant = planar();
    let record = record(&plant, "a", 1, 200, 0.002);
    let fit = fit_plant(plant.structure(), &[&record], None, false).expect("a plant");
    assert_eq!(fit.thrust_jitter_s, None);
}
