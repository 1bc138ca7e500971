//! Rudders and fins that follow what is logged of them late, and no faster than they can.

use super::TrialRecord;
use crate::plant::Signal;
use crate::{Error, Timed};

/// Delay and rate limit of the gear of all rudders and fins, between their orders and their angles.
///
/// ```text
/// δ̇(t) = ω sign(δ_logged(t − d) − δ(t)),   |δ̇| ≤ ω
/// ```
///
/// A log of angles needs none of it; one of orders leaves out the delay d of what is told and the greatest rate of turn ω
/// of the gear.
///
/// # Source
/// \[VanAmerongen1982\]: the rate limit of a steering machine; the time constant of its servo is part of the delay.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SteeringGear {
    /// d, s.
    pub delay_s: f64,
    /// 1/ω, s/rad; zero where the rate has no limit.
    pub slew_s_rad: f64,
}

impl SteeringGear {
    /// Returns the gear with a delay, s, and a greatest rate, rad/s; none of the rate has no limit.
    pub(crate) fn new(delay_s: Option<f64>, rate: Option<f64>) -> Self {
        Self { delay_s: delay_s.unwrap_or(0.0), slew_s_rad: rate.map_or(0.0, f64::recip) }
    }

    /// Returns the greatest rate ω, rad/s; `None` where it has no limit.
    pub fn rate_rad_s(&self) -> Option<f64> {
        (self.slew_s_rad > 0.0).then(|| self.slew_s_rad.recip())
    }

    /// Returns true if angles are as they are logged.
    pub(crate) fn is_prompt(&self) -> bool {
        *self == Self::default()
    }

    /// Returns the angle that follows an order; it begins at the first order.
    ///
    /// # Errors
    /// As [`Timed::new`], if an angle is not finite.
    pub(crate) fn behind(&self, logged: &Timed) -> Result<Timed, Error> {
        let told = logged.shifted(self.delay_s);
        let Some(most) = self.rate_rad_s() else { return Ok(told) };
        let (time_s, goals) = (told.time_s(), told.values());
        let mut angle = goals[0];
        let (mut times, mut angles) = (vec![time_s[0]], vec![angle]);
        for k in 1..time_s.len() {
            let (h, from, to) = (time_s[k] - time_s[k - 1], goals[k - 1], goals[k]);
            let (slope, behind) = ((to - from) / h, from - angle);
            // The goal, which moves as well, is met after this time.
            let closing = most - slope * behind.signum();
            let meets_s = if behind == 0.0 { 0.0 } else { behind.abs() / closing };
            if closing <= 0.0 || meets_s >= h {
                angle += most.copysign(behind) * h;
            } else {
                if meets_s > SAME_S && h - meets_s > SAME_S {
                    times.push(time_s[k - 1] + meets_s);
                    angles.push(from + slope * meets_s);
                }
                let met = from + slope * meets_s;
                let may_follow = slope.abs() <= most;
                angle = if may_follow { to } else { met + most.copysign(slope) * (h - meets_s) };
            }
            times.push(time_s[k]);
            angles.push(angle);
        }
        Timed::new("angle", times, angles)
    }
}

/// Instants that are closer than this are one, s.
const SAME_S: f64 = 1e-6;

impl TrialRecord {
    /// Returns the record with rudders and fins that follow the angles which another record of the trial has of them.
    ///
    /// # Errors
    /// As [`Timed::new`], if an angle is not finite.
    pub(crate) fn with_surfaces_behind(
        &self,
        logged: &Self,
        gear: &SteeringGear,
    ) -> Result<Self, Error> {
        let mut changed = self.clone();
        for (signal, angle) in &logged.signals {
            if matches!(signal, Signal::Angle { .. }) {
                changed.signals.insert(signal.clone(), gear.behind(angle)?);
            }
        }
        Ok(changed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(values: &[(f64, f64)]) -> Timed {
        let (time_s, values): (Vec<f64>, Vec<f64>) = values.iter().copied().unzip();
        Timed::new("order", time_s, values).expect("valid")
    }

    #[test]
    fn a_step_is_followed_late_and_at_the_greatest_rate() {
        let order =
            series(&[(0.0, 0.0), (1.0, 0.0), (1.001, 0.4), (5.0, 0.4), (5.001, -0.2), (9.0, -0.2)]);
        let gear = SteeringGear { delay_s: 0.5, slew_s_rad: 5.0 };
        let angle = gear.behind(&order).expect("valid");
        for (t, wanted) in
            [(1.4, 0.0), (2.5, 0.2), (3.5, 0.4), (5.5, 0.4), (7.5, 0.0), (8.5, -0.2), (9.5, -0.2)]
        {
            assert!((angle.at(t) - wanted).abs() < 1e-3, "{t}: {}", angle.at(t));
        }
    }

    /// Beside small steps of Euler's rule, for an order that moves slower and faster than the gear can.
    #[test]
    fn an_order_that_moves_is_followed_as_by_small_steps() {
        let at = |k: u32| {
            let k = f64::from(k);
            (0.3 * k, 0.5 * (0.02 * k * k).sin())
        };
        let order: Vec<(f64, f64)> = (0..60).map(at).collect();
        let order = series(&order);
        let gear = SteeringGear { delay_s: 0.0, slew_s_rad: 2.0 };
        let angle = gear.behind(&order).expect("valid");
        let (step, mut now) = (1e-4, 0.0);
        for k in 0..170_000 {
            let t = step * f64::from(k);
            assert!((angle.at(t) - now).abs() < 1e-3, "{t}: {} and {now}", angle.at(t));
            now += (order.at(t + step) - now).clamp(-0.5 * step, 0.5 * step);
        }
    }

    #[test]
    fn a_gear_without_limits_is_followed_at_once() {
        let order = series(&[(0.0, 0.1), (1.0, -0.3), (2.0, 0.2)]);
        let angle = SteeringGear::default().behind(&order).expect("valid");
        assert_eq!((angle.time_s(), angle.values()), (order.time_s(), order.values()));
    }
}
