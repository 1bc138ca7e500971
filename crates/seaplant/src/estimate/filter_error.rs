//! The filter error method: maximum likelihood on the innovations of a Kalman filter.

mod candidate;
mod discrete;
mod driven;
mod first_look;
mod fit;
mod held_out;
mod kalman;
mod minimise;
mod parabola;
mod parameters;
mod problem;
mod schedule;
mod search;
mod spikes;
mod strength;
mod together;
mod whiteness;

pub use candidate::{Candidate, Decision};
pub use fit::{FilterError, first_delays};
pub(crate) use fit::{MOST_SEARCHED, MOST_TRIALS};
pub use together::SteadyTest;

pub(crate) use first_look::first_look;
pub(super) use parameters::Values;

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::parameters::{Shape, Unknown};
    use super::problem::{Belief, Kind, Prior, Problem, Record};
    use super::*;
    use crate::twin::{Disturbance, TwinAccelerometer, TwinSpec, make};
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
        let mut values = Values::none(Shape { full_speed: 150.0, ..Shape::default() });
        for (unknown, value) in [
            (Unknown::Alpha, 8e-5),
            (Unknown::Beta, -0.2),
            (Unknown::Mu, -0.01),
            (Unknown::Bias, 0.015),
            (Unknown::Current, 0.03),
            (Unknown::Lag, 0.2),
            (Unknown::LogLagRatio, 0.4),
            (Unknown::Slew, 0.6),
            (Unknown::Delay, 0.13),
            (Unknown::LogReverseRatio, -0.1),
            (Unknown::Inflow, 0.5),
            (Unknown::InflowAhead, 0.3),
            (Unknown::Exponent, -0.15),
            (Unknown::VelocityScale, 0.03),
            (Unknown::VelocityOffset, 0.01),
            (Unknown::LogSensorLag, (0.3_f64).ln()),
            (Unknown::LogSensorWindow, (0.5_f64).ln()),
            (Unknown::LogSwell, (0.004_f64).ln()),
            (Unknown::LogSwellFrequency, (0.8_f64).ln()),
            (Unknown::LogSwellDamping, (0.1_f64).ln()),
            (Unknown::LogDrift, (0.05_f64).ln()),
            (Unknown::LogDisturbance, (0.004_f64).ln()),
            (Unknown::LogCorrelation, 3.0),
            (Unknown::LogVelocityNoise, (0.004_f64).ln()),
            (Unknown::LogPositionNoise, (0.003_f64).ln()),
            (Unknown::LogAccelerationNoise, (0.02_f64).ln()),
            (Unknown::AccelerationOffset, 0.04),
            (Unknown::LogLeak, (0.05_f64).ln()),
            (Unknown::LogLeakCorrelation, 3.5),
        ] {
            values.set(unknown, value);
        }
        values
    }

    const PLANT: [Unknown; 9] = [
        Unknown::Alpha,
        Unknown::Beta,
        Unknown::Mu,
        Unknown::Bias,
        Unknown::Lag,
        Unknown::Delay,
        Unknown::LogReverseRatio,
        Unknown::LogDisturbance,
        Unknown::LogCorrelation,
    ];

    /// Where velocity changes its sign within a step, the third-order term of the prediction
    /// jumps, and central differences see it; a part of the slope.
    const SLOPE: f64 = 3e-3;

    /// The analytic gradient beside central differences, and the cost that comes with it beside
    /// the cost alone.
    fn gradient_holds(dof: Dof, more: &[Unknown], linear: bool) {
        let noise = match dof {
            Dof::Yaw => vec![Unknown::LogPositionNoise],
            Dof::Heave => vec![Unknown::LogVelocityNoise, Unknown::LogPositionNoise],
            _ => vec![Unknown::LogVelocityNoise],
        };
        gradient_of(&axis(dof, "none", 3), &[&noise, more].concat(), linear);
    }

    fn gradient_holds_on(axis: &AxisRecord, noise: &[Unknown], more: &[Unknown]) {
        gradient_of(axis, &[noise, more].concat(), false);
    }

    fn gradient_of(axis: &AxisRecord, more: &[Unknown], linear: bool) {
        let (dof, record) = (axis.dof, [Record::of(axis, Kind::Unsteady)]);
        let unknowns = [&PLANT[..], more].concat();
        let belief = Belief::Normal { mean: 0.0, std: 0.5 };
        let heavy = Belief::AtMost { limit: 1e-5, log_std: 0.1 };
        let priors = [
            Prior { unknown: Unknown::Lag, belief },
            Prior { unknown: Unknown::Alpha, belief: heavy },
        ];
        // What is not fitted is not there.
        let mut fixed = Values::none(values().shape);
        fixed.shape.linear = linear;
        let problem = Problem::new(&record, &unknowns, &priors, fixed);
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
            let unknown = problem.numbers()[j];
            assert!(off < SLOPE, "{dof} {unknown:?} of {more:?}: {} and {slope}", gradient[j]);
        }
    }

    /// A surge record of acceleration alone.
    fn felt() -> AxisRecord {
        let spec = TwinSpec {
            seed: 5,
            accelerometer: Some(TwinAccelerometer { noise: 0.01, ..Default::default() }),
            ..TwinSpec::jason2()
        };
        let twin = make(&spec).expect("valid");
        let setup = TrialSetup { dofs: vec![Dof::Surge], to_s: Some(200.0), ..Default::default() };
        Trial::new(setup, &twin.trials[0].recording, &twin.vehicle)
            .expect("valid")
            .axis(Dof::Surge, VelocitySource::Measured)
            .expect("there")
    }

    #[test]
    fn gradient_holds_for_an_accelerometer() {
        let more = [
            Unknown::LogAccelerationNoise,
            Unknown::AccelerationOffset,
            Unknown::LogLeak,
            Unknown::LogLeakCorrelation,
        ];
        let axis = felt();
        gradient_holds_on(&axis, &more, &[]);
        gradient_holds_on(&axis, &more, &[Unknown::Inflow, Unknown::LogSensorLag]);
        gradient_holds_on(&axis, &more, &[Unknown::LogSensorWindow]);
        let waves = [Unknown::LogSwell, Unknown::LogSwellFrequency, Unknown::LogSwellDamping];
        gradient_holds_on(&axis, &more, &waves);
    }

    #[test]
    fn gradient_is_that_of_the_cost() {
        gradient_holds(Dof::Surge, &[Unknown::Current, Unknown::Inflow], false);
        gradient_holds(Dof::Yaw, &[Unknown::Inflow], false);
        gradient_holds(Dof::Heave, &[Unknown::VelocityScale, Unknown::VelocityOffset], false);
    }

    #[test]
    fn gradient_holds_for_every_law_of_thrust() {
        gradient_holds(Dof::Surge, &[Unknown::LogLagRatio, Unknown::InflowAhead], false);
        gradient_holds(Dof::Surge, &[Unknown::Slew, Unknown::Inflow], false);
        gradient_holds(Dof::Surge, &[Unknown::Exponent], false);
        gradient_holds(Dof::Yaw, &[Unknown::Slew, Unknown::LogLagRatio], true);
    }

    #[test]
    fn gradient_holds_beside_sensors_waves_and_currents() {
        gradient_holds(Dof::Surge, &[Unknown::LogSensorLag], false);
        gradient_holds(Dof::Surge, &[Unknown::LogSensorWindow, Unknown::Current], false);
        let waves = [Unknown::LogSwell, Unknown::LogSwellFrequency, Unknown::LogSwellDamping];
        gradient_holds(Dof::Surge, &waves, false);
        gradient_holds(Dof::Surge, &[Unknown::LogDrift], false);
        let all = [&waves[..], &[Unknown::LogDrift, Unknown::LogSensorWindow]].concat();
        gradient_holds(Dof::Heave, &all, false);
    }
}
