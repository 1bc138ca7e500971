//! Thrust as it acts: after lag and delay, with the reverse ratio, and what inflow takes.

use super::parameters::{Unknown, Values};
use super::schedule::{HeldIntegral, Schedule};
use crate::ThrusterTrack;

/// The unknowns that shape thrust, in the order of [`Drive`]'s derivatives.
pub(crate) const SHAPING: [Unknown; 3] = [Unknown::Lag, Unknown::Delay, Unknown::LogReverseRatio];

/// Thrust over each step of a schedule.
#[derive(Clone, Debug, Default)]
pub(crate) struct Drive {
    /// Mean force τ*, N or N m.
    pub(crate) tau: Vec<f64>,
    /// Its derivatives by lag, delay and ln κ.
    pub(crate) tau_by: Vec<[f64; 3]>,
    /// γ = Σ lever² |n| of the inflow term.
    pub(crate) gamma: Vec<f64>,
    /// Its derivatives by lag and delay; ln κ does not change it.
    pub(crate) gamma_by: Vec<[f64; 3]>,
}

/// Below this a lag is none, s: a propeller settles within a step.
const LEAST_LAG_S: f64 = 1e-3;

impl Drive {
    /// Thrust of all thrusters over each step.
    ///
    /// n follows the delayed speed by `ṅ* = (n(t − D) − n*)/T_l`; the force of a step is
    /// its mean by Simpson's rule.
    pub(crate) fn of(tracks: &[ThrusterTrack], schedule: &Schedule, values: &Values) -> Self {
        let steps = schedule.time_s.len() - 1;
        let mut drive = Self {
            tau: vec![0.0; steps],
            tau_by: vec![[0.0; 3]; steps],
            gamma: vec![0.0; steps],
            gamma_by: vec![[0.0; 3]; steps],
        };
        for track in tracks {
            drive.add(track, schedule, values);
        }
        drive
    }

    fn add(&mut self, track: &ThrusterTrack, schedule: &Schedule, values: &Values) {
        let (lag_s, delay_s) = (values.get(Unknown::Lag), values.get(Unknown::Delay));
        let kappa = values.get(Unknown::LogReverseRatio).exp();
        let integral = HeldIntegral::new(&track.speed);
        let mut from = 0;
        let mut before = integral.at(schedule.time_s[0] - delay_s, &mut from);
        // The propeller has settled when the trial starts.
        let mut propeller = Propeller { n: before.1, by_lag: 0.0, by_delay: 0.0 };
        for k in 0..self.tau.len() {
            let h = schedule.length(k);
            let after = integral.at(schedule.time_s[k + 1] - delay_s, &mut from);
            let asked = (after.0 - before.0) / h;
            let asked_by_delay = (before.1 - after.1) / h;
            let points = propeller.advance(asked, asked_by_delay, lag_s, h);
            self.add_step(k, track, kappa, &points);
            before = after;
        }
    }

    /// Adds the force of one step: Simpson's rule over its three points.
    fn add_step(&mut self, k: usize, track: &ThrusterTrack, kappa: f64, points: &[Propeller; 3]) {
        for (point, weight) in points.iter().zip([1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0]) {
            let n = point.n;
            let reversed = n < 0.0;
            let strength = if reversed { kappa * track.reverse } else { track.forward };
            let thrust = weight * track.lever * strength * n * n.abs();
            let by_n = 2.0 * weight * track.lever * strength * n.abs();
            self.tau[k] += thrust;
            self.tau_by[k][0] += by_n * point.by_lag;
            self.tau_by[k][1] += by_n * point.by_delay;
            self.tau_by[k][2] += if reversed { thrust } else { 0.0 };
            let area = weight * track.lever * track.lever;
            self.gamma[k] += area * n.abs();
            self.gamma_by[k][0] += area * n.signum() * point.by_lag;
            self.gamma_by[k][1] += area * n.signum() * point.by_delay;
        }
    }
}

/// A propeller's speed with its derivatives by lag and delay.
#[derive(Clone, Copy, Debug)]
struct Propeller {
    n: f64,
    by_lag: f64,
    by_delay: f64,
}

impl Propeller {
    /// Moves on by a step towards the speed asked for; its speed at the start, in the
    /// middle and at the end of it.
    fn advance(&mut self, asked: f64, asked_by_delay: f64, lag_s: f64, h: f64) -> [Self; 3] {
        if lag_s < LEAST_LAG_S {
            // d/dT of exp(−h/T) vanishes here, but what a small lag does is known: it
            // shifts thrust as a delay of the same length would.
            *self = Self { n: asked, by_lag: asked_by_delay, by_delay: asked_by_delay };
            return [*self; 3];
        }
        let start = *self;
        let at = |span: f64| {
            let keep = (-span / lag_s).exp();
            let keep_by_lag = keep * span / (lag_s * lag_s);
            Self {
                n: keep * start.n + (1.0 - keep) * asked,
                by_lag: keep * start.by_lag + keep_by_lag * (start.n - asked),
                by_delay: keep * start.by_delay + (1.0 - keep) * asked_by_delay,
            }
        };
        let points = [start, at(0.5 * h), at(h)];
        *self = points[2];
        points
    }
}
