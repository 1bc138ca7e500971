//! Thrust that is logged slowly.

use super::*;
use crate::BetweenSamples;
use crate::estimate::Candidate;

/// Time between logged samples of thrust, s.
const SLOW_S: f64 = 0.5;

/// A vehicle of which each axis is pushed by four sinusoids of speed or of thrust, or by the logged samples of these.
fn slowly_logged(trial: &str, seed: u64, between: BetweenSamples) -> TrialRecord {
    let mut random = random(seed);
    let time_s: Vec<f64> = (0..3000).map(|k| 0.05 * f64::from(k)).collect();
    let slow_s: Vec<f64> = (0..300).map(|k| SLOW_S * f64::from(k)).collect();
    let (mut logged, mut acting) = ([const { None }; 6], [const { None }; 6]);
    for (axis, amplitude) in [(0, 12.0), (1, 12.0), (5, 0.8)] {
        let tones: Vec<[f64; 2]> = (1..=4)
            .map(|k| [0.5 * f64::from(k) + 0.1 * random().clamp(-1.0, 1.0), 3.0 * random()])
            .collect();
        let sum = |t: f64| tones.iter().map(|[rate, phase]| (rate * t + phase).sin()).sum::<f64>();
        let force = |t: f64| match between {
            BetweenSamples::SmoothSpeed => amplitude / 4.0 * sum(t) * sum(t).abs(),
            _ => amplitude / 2.0 * sum(t),
        };
        let values: Vec<f64> = slow_s.iter().map(|t| force(*t)).collect();
        let log = Timed::new("force", slow_s.clone(), values).expect("finite");
        let is_held = between == BetweenSamples::Held;
        let at = |t: f64| if is_held { log.held_at(t) } else { force(t) };
        // The mean over a step is that of its middle.
        let values: Vec<f64> = time_s.iter().map(|t| at(t + 0.025)).collect();
        acting[axis] = Some(Timed::new("force", time_s.clone(), values).expect("finite"));
        logged[axis] = Some(log);
    }
    let record = TrialRecord { force: logged, ..TrialRecord::until(trial, 149.5) };
    driven(&planar(), of_thrusters(record), acting, (&time_s, 0.003, &mut random))
}

/// By which part each mass is off.
fn masses(fit: &PlantFit) -> Vec<f64> {
    let of = |plant: &Plant| {
        let matrix = plant.mass_matrix();
        (0..PLANAR.len()).map(|k| matrix[(k, k)]).collect::<Vec<f64>>()
    };
    of(&fit.plant).iter().zip(of(&planar())).map(|(found, truth)| found / truth - 1.0).collect()
}

fn fitted(record: &TrialRecord) -> PlantFit {
    fit_plant(planar().structure(), &[record], None, true).expect("an optimum")
}

fn is_admitted(fit: &PlantFit, candidate: Candidate) -> bool {
    let tried = fit.tried.iter().find(|tried| tried.name == candidate.name());
    tried.is_some_and(|tried| tried.admitted && tried.p_value < 1e-6)
}

#[test]
fn slow_logs_of_thrust_that_moves_smoothly_cost_no_mass() {
    let smooth = [
        (BetweenSamples::SmoothSpeed, Candidate::SmoothSpeed),
        (BetweenSamples::SmoothThrust, Candidate::SmoothThrust),
    ];
    for (between, candidate) in smooth {
        let fit = fitted(&slowly_logged("a", 3, between));
        assert_eq!(fit.actuator.between, between);
        assert!(is_admitted(&fit, candidate));
        // 1 − cos ωT at ωT = 1 of the quickest tone.
        let beyond = &fit.beyond_neighbours;
        assert!(beyond.len() == 3 && beyond.values().all(|x| (0.1..0.5).contains(x)), "{beyond:?}");
        assert!(masses(&fit).iter().all(|off| off.abs() < 0.03), "{:?}", masses(&fit));
    }
}

#[test]
fn slow_logs_of_a_force_that_moves_smoothly_cost_no_mass() {
    let mut record = slowly_logged("a", 3, BetweenSamples::SmoothThrust);
    record.thrusters.clear();
    let fit = fitted(&record);
    assert!(is_admitted(&fit, Candidate::SmoothThrust));
    // Nobody knows propellers whose speed could be smooth.
    assert!(fit.tried.iter().all(|tried| tried.name != Candidate::SmoothSpeed.name()));
    assert!(masses(&fit).iter().all(|off| off.abs() < 0.03), "{:?}", masses(&fit));
}

#[test]
fn slow_logs_of_thrust_that_is_held_stay_held() {
    let fit = fitted(&slowly_logged("a", 3, BetweenSamples::Held));
    assert!(!fit.actuator.is_smooth() && fit.beyond_neighbours.is_empty());
    assert!(masses(&fit).iter().all(|off| off.abs() < 0.02), "{:?}", masses(&fit));
}
