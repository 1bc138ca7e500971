//! The filter error method: maximum likelihood on the innovations of a Kalman filter.

mod drive;
mod fit;
mod kalman;
mod minimise;
mod parameters;
mod problem;
mod schedule;
mod strength;
mod structure;
mod together;

pub use fit::{FilterErrorOptions, Records, first_delays, fit_filter_error};
pub use structure::{Candidate, Decision};
pub use together::SteadyTest;

use crate::{ThrustModel, ThrusterTrack, Timed};
use drive::{Drive, Push};
use parameters::{UNKNOWNS, Unknown, Values};
use schedule::steps_through;

/// Thrust as it acts over a step.
pub(crate) struct DriveStep {
    /// Its end, s.
    pub(crate) time_s: f64,
    /// Its length, s; 0 at the first instant.
    pub(crate) length_s: f64,
    /// Mean force τ*, N or N m.
    pub(crate) tau: f64,
    /// γ = Σ lever² |n| of the inflow term.
    pub(crate) gamma: f64,
    /// What turning does to the velocity of a rigid body, m/s².
    pub(crate) turning: f64,
}

/// Thrust as it acts, over steps through `times_s` that are at most 0.1 s long.
pub(crate) fn drive_over<'a>(
    tracks: &'a [ThrusterTrack],
    turning: Option<&'a Timed>,
    times_s: &'a [f64],
    thrust: &ThrustModel,
) -> impl Iterator<Item = DriveStep> + 'a {
    let mut values = Values([0.0; UNKNOWNS]);
    values.set(Unknown::Lag, thrust.lag_s);
    values.set(Unknown::Delay, thrust.delay_s);
    values.set(Unknown::LogReverseRatio, thrust.reverse_ratio.ln());
    let mut drive = Drive::new(tracks, turning, &values, times_s.first().copied().unwrap_or(0.0));
    steps_through(times_s).map(move |stop| {
        let push = if stop.length_s > 0.0 { drive.until(&stop) } else { Push::default() };
        let Push { tau, gamma, turning, .. } = push;
        DriveStep { time_s: stop.time_s, length_s: stop.length_s, tau, gamma, turning }
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::problem::{Kind, Prior, Problem, Record};
    use super::*;
    use crate::twin::{Disturbance, TwinSpec, make};
    use crate::{AxisRecord, Dof, Trial, TrialSetup, VelocitySource};

    fn axis(dof: Dof, disturbances: &str, seed: u64) -> AxisRecord {
        let spec = TwinSpec {
            seed,
            disturbances: Disturbance::parse_list(disturbances).expect("known"),
            ..TwinSpec::jason2()
        };
        let twin = make(&spec).expect("valid");
        let trial = twin.trials.iter().find(|t| t.name == format!("{dof} 1")).expect("there");
        let setup = TrialSetup { name: trial.name.clone(), dofs: vec![dof], ..Default::default() };
        Trial::new(setup, &trial.recording, &twin.vehicle)
            .expect("valid")
            .axis(dof, VelocitySource::Measured)
            .expect("there")
    }

    /// Every unknown away from zero, where its sensitivity could hide.
    fn values() -> Values {
        let mut values = Values([0.0; UNKNOWNS]);
        values.set(Unknown::Alpha, 8e-5);
        values.set(Unknown::Beta, -0.2);
        values.set(Unknown::Mu, -0.01);
        values.set(Unknown::Bias, 0.015);
        values.set(Unknown::Current, 0.03);
        values.set(Unknown::Lag, 0.2);
        values.set(Unknown::Delay, 0.13);
        values.set(Unknown::LogReverseRatio, -0.1);
        values.set(Unknown::Inflow, 0.5);
        values.set(Unknown::LogDisturbance, (0.004_f64).ln());
        values.set(Unknown::LogCorrelation, 3.0);
        values.set(Unknown::LogVelocityNoise, (0.004_f64).ln());
        values.set(Unknown::LogPositionNoise, (0.003_f64).ln());
        values
    }

    #[test]
    fn gradient_is_that_of_the_cost() {
        for dof in [Dof::Surge, Dof::Yaw] {
            let record = [Record::of(&axis(dof, "none", 3), Kind::Unsteady)];
            let noise = match dof {
                Dof::Yaw => Unknown::LogPositionNoise,
                _ => Unknown::LogVelocityNoise,
            };
            let unknowns = [
                Unknown::Alpha,
                Unknown::Beta,
                Unknown::Mu,
                Unknown::Bias,
                Unknown::Current,
                Unknown::Lag,
                Unknown::Delay,
                Unknown::LogReverseRatio,
                Unknown::Inflow,
                Unknown::LogDisturbance,
                Unknown::LogCorrelation,
                noise,
            ];
            let priors = [Prior { unknown: Unknown::Lag, mean: 0.0, std: 0.5 }];
            let problem = Problem::new(&record, &unknowns, &priors, values());
            let theta = DVector::from_fn(problem.len(), |j, _| values().get(problem.numbers()[j]));
            let (cost, gradient, _) = problem.evaluate(&theta);
            assert!((cost - problem.cost(&theta)).abs() < 1e-9 * cost.abs());
            for j in 0..theta.len() {
                let step = 1e-6 * theta[j].abs();
                let at = |sign: f64| {
                    let mut moved = theta.clone();
                    moved[j] += sign * step;
                    problem.cost(&moved)
                };
                let slope = (at(1.0) - at(-1.0)) / (2.0 * step);
                let off = (gradient[j] - slope).abs() / slope.abs().max(1.0);
                assert!(
                    off < 1e-3,
                    "{dof} {:?}: {} and {slope}",
                    problem.numbers()[j],
                    gradient[j]
                );
            }
        }
    }
}
