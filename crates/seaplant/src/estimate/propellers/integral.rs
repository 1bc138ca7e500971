//! Integrals of logged signals between any two instants.

use crate::{BetweenSamples, ThrusterTrack, Timed};

/// Part of a sinusoid that cubics through its samples lose, over (1 − cos ωT)²: (ωT)⁴/80 for many samples a
/// period, and this at five.
pub(crate) const LOST_BETWEEN_SAMPLES: f64 = 0.06;

/// A propeller below this part of full speed is still.
const STILL_PART: f64 = 0.01;

/// ∫ x dt of a signal that is held or moves smoothly from sample to sample, for times that rise.
///
/// Smooth: a cubic between samples, with the slope at each from its neighbours. Where thrust moves smoothly, x is
/// n|n| of a propeller speed n, in reverse times what its curve has there over what it has ahead. Samples within
/// a dead band are 0, those beyond it grow to what they are at full speed.
///
/// # Source
/// E. Catmull, R. Rom, "A class of local interpolating splines", *Computer Aided Geometric Design*, 1974.
#[derive(Clone, Debug)]
pub(crate) struct SignalIntegral<'a> {
    series: &'a Timed,
    between: BetweenSamples,
    /// Thrust in reverse over that ahead at the same speed.
    reverse: f64,
    dead_band: DeadBand,
    /// True if x is the derivative by the dead band in place of the signal.
    is_slope: bool,
    /// The sample in effect.
    at: usize,
    /// The integral up to it.
    before: f64,
}

/// Speeds below which a propeller does not turn, as a part p of full speed N:
///
/// ```text
/// n' = sign(n) max(|n| − p N, 0) / (1 − p)
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct DeadBand {
    pub(crate) part: f64,
    pub(crate) full_speed: f64,
}

impl DeadBand {
    /// Returns the speed of a propeller that is told n.
    #[inline]
    fn speed(&self, n: f64) -> f64 {
        if self.part == 0.0 {
            return n;
        }
        ((n.abs() - self.part * self.full_speed).max(0.0) / (1.0 - self.part)).copysign(n)
    }

    /// Returns the derivative of that by p.
    #[inline]
    fn slope(&self, n: f64) -> f64 {
        if n.abs() <= self.part * self.full_speed {
            return 0.0;
        }
        n.signum() * (n.abs() - self.full_speed) / (1.0 - self.part).powi(2)
    }
}

impl<'a> SignalIntegral<'a> {
    pub(crate) fn new(series: &'a Timed, between: BetweenSamples) -> Self {
        let dead_band = DeadBand::default();
        Self { series, between, reverse: 1.0, dead_band, is_slope: false, at: 0, before: 0.0 }
    }

    /// The integral of what a propeller is told.
    pub(crate) fn of(
        track: &'a ThrusterTrack,
        between: BetweenSamples,
        dead_band: DeadBand,
    ) -> Self {
        let reverse = track.reverse / track.forward;
        let reverse = if reverse.is_finite() && reverse > 0.0 { reverse } else { 1.0 };
        Self { reverse, dead_band, ..Self::new(&track.speed, between) }
    }

    /// Returns the integral of the derivative of this signal by the dead band.
    pub(crate) fn by_dead_band(&self) -> Self {
        Self { is_slope: true, ..self.clone() }
    }

    /// x at a sample.
    #[inline]
    fn sample(&self, k: usize) -> f64 {
        let told = self.series.values()[k];
        let n = self.dead_band.speed(told);
        let strength = if n < 0.0 { self.reverse } else { 1.0 };
        match (self.is_slope, self.between == BetweenSamples::SmoothThrust) {
            (false, false) => n,
            (false, true) => strength * n * n.abs(),
            (true, false) => self.dead_band.slope(told),
            (true, true) => 2.0 * strength * n.abs() * self.dead_band.slope(told),
        }
    }

    /// The speed that a mean of x is that of.
    #[inline]
    pub(crate) fn speed(&self, x: f64) -> f64 {
        if self.between != BetweenSamples::SmoothThrust {
            return x;
        }
        if x < 0.0 { -(-x / self.reverse).sqrt() } else { x.sqrt() }
    }

    /// The derivative of such a speed by what x has this derivative by, of propellers that turn up to `full_speed`.
    #[inline]
    pub(crate) fn speed_slope(&self, speed: f64, by: f64, full_speed: f64) -> f64 {
        if self.between != BetweenSamples::SmoothThrust {
            return by;
        }
        // The root has no slope at rest.
        let least = (STILL_PART * full_speed).max(f64::MIN_POSITIVE);
        let strength = if speed < 0.0 { self.reverse } else { 1.0 };
        0.5 * by / strength / speed.abs().max(least)
    }

    /// Where the signal jumps most between where it was last looked at and `to_s`, if by more than
    /// `least`.
    #[inline]
    pub(crate) fn jump_before(&self, to_s: f64, least: f64) -> Option<f64> {
        if self.between != BetweenSamples::Held {
            return None;
        }
        let (t, x) = (self.series.time_s(), self.series.values());
        let (mut greatest, mut found) = (least, None);
        for k in self.at + 1..t.len() {
            if t[k] >= to_s {
                break;
            }
            let jump = (x[k] - x[k - 1]).abs();
            if jump > greatest {
                (greatest, found) = (jump, Some(t[k]));
            }
        }
        found
    }

    /// The integral up to `t_s`, from the first sample on, and the signal there.
    #[inline]
    pub(crate) fn until(&mut self, t_s: f64) -> (f64, f64) {
        let t = self.series.time_s();
        let is_held = self.between == BetweenSamples::Held;
        while self.at + 1 < t.len() && t[self.at + 1] <= t_s {
            let length = t[self.at + 1] - t[self.at];
            self.before += if is_held { self.sample(self.at) * length } else { self.cubic(1.0).0 };
            self.at += 1;
        }
        let (from, since) = (self.sample(self.at), t_s - t[self.at]);
        // Before the first sample and after the last the signal is held.
        if is_held || since <= 0.0 || self.at + 1 == t.len() {
            return (self.before + from * since, from);
        }
        let (integral, value) = self.cubic(since / (t[self.at + 1] - t[self.at]));
        (self.before + integral, value)
    }

    /// The integral from the sample in effect to a part of the way to the next, and the signal there.
    fn cubic(&self, part: f64) -> (f64, f64) {
        let (t, x) = (self.series.time_s(), |k| self.sample(k));
        let (k, last) = (self.at, t.len() - 1);
        let length = t[k + 1] - t[k];
        // Changes over this interval at the slopes of its ends.
        let change = |at: usize| {
            let (from, to) = (at.saturating_sub(1), (at + 1).min(last));
            length * (x(to) - x(from)) / (t[to] - t[from])
        };
        let (x0, x1, d0, d1) = (x(k), x(k + 1), change(k), change(k + 1));
        let c2 = 3.0 * (x1 - x0) - 2.0 * d0 - d1;
        let c3 = 2.0 * (x0 - x1) + d0 + d1;
        let value = x0 + part * (d0 + part * (c2 + part * c3));
        let mean = x0 + part * (d0 / 2.0 + part * (c2 / 3.0 + part * c3 / 4.0));
        (mean * part * length, value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(time_s: &[f64], values: &[f64]) -> Timed {
        Timed::new("test", time_s.to_vec(), values.to_vec()).expect("valid")
    }

    #[test]
    fn an_integral_of_held_samples_goes_on_before_and_after_them() {
        let held = series(&[0.0, 1.0, 3.0], &[2.0, -1.0, 4.0]);
        let mut integral = SignalIntegral::new(&held, BetweenSamples::Held);
        assert_eq!(integral.until(-0.5), (-1.0, 2.0));
        assert_eq!(integral.until(0.5), (1.0, 2.0));
        assert_eq!(integral.until(2.0), (1.0, -1.0));
        assert_eq!(integral.until(4.0), (4.0, 4.0));
    }

    #[test]
    fn the_greatest_jump_ahead_is_found_if_it_is_large_enough() {
        let held = series(&[0.0, 1.0, 2.0, 3.0], &[0.0, 1.0, -4.0, -5.0]);
        let mut integral = SignalIntegral::new(&held, BetweenSamples::Held);
        integral.until(0.5);
        assert_eq!(integral.jump_before(2.5, 0.5), Some(2.0));
        assert_eq!(integral.jump_before(2.0, 0.5), Some(1.0));
        assert_eq!(integral.jump_before(2.0, 1.5), None);
        assert_eq!(
            SignalIntegral::new(&held, BetweenSamples::SmoothSpeed).jump_before(2.5, 0.5),
            None
        );
    }

    #[test]
    fn a_parabola_between_even_samples_is_exact() {
        let time_s: Vec<f64> = (0..6).map(f64::from).collect();
        let moving = series(&time_s, &time_s.iter().map(|t| t * t).collect::<Vec<_>>());
        let mut integral = SignalIntegral::new(&moving, BetweenSamples::SmoothSpeed);
        let [from, to] = [1.2, 3.7].map(|t| integral.until(t));
        let exact = (3.7_f64.powi(3) - 1.2_f64.powi(3)) / 3.0;
        assert!((to.0 - from.0 - exact).abs() < 1e-12 && (to.1 - 3.7 * 3.7).abs() < 1e-12);
    }

    #[test]
    fn smooth_thrust_has_the_speed_of_its_mean() {
        // Thrust grows evenly from −8 to 8, with half the strength in reverse.
        let time_s: Vec<f64> = (0..9).map(f64::from).collect();
        let speeds = time_s.iter().map(|t| match t - 4.0 {
            ahead if ahead > 0.0 => ahead.sqrt(),
            astern => -(-2.0 * astern).sqrt(),
        });
        let track = ThrusterTrack {
            speed: series(&time_s, &speeds.collect::<Vec<_>>()),
            forward: 2.0,
            reverse: 1.0,
            ..ThrusterTrack::of_force(1.0, &series(&[0.0, 1.0], &[0.0; 2]))
        };
        let between = BetweenSamples::SmoothThrust;
        let mut integral = SignalIntegral::of(&track, between, DeadBand::default());
        let (step, full_speed) = (1e-6, 2.0);
        for [from_s, to_s] in [[1.25, 3.25], [4.25, 6.25]] {
            let [from, to] = [from_s, to_s].map(|t| integral.until(t));
            let mean = 0.5 * (to.0 - from.0);
            let speed = integral.speed(mean);
            let exact = 0.5 * (from_s + to_s) - 4.0;
            assert!((track.thrust(speed) / 2.0 - exact).abs() < 1e-12, "{speed}");
            let slope = (integral.speed(mean + step) - speed) / step;
            assert!((integral.speed_slope(speed, 1.0, full_speed) - slope).abs() < 1e-5, "{slope}");
        }
    }

    #[test]
    fn cubics_lose_this_part_of_a_sinusoid() {
        // ωT, by which no sample is at the same phase as another.
        for step in [0.25, 0.51, 1.25_f64] {
            let time_s: Vec<f64> = (0..400).map(|k| step * f64::from(k)).collect();
            let sine = series(&time_s, &time_s.iter().map(|t| t.sin()).collect::<Vec<_>>());
            let mut cubics = SignalIntegral::new(&sine, BetweenSamples::SmoothSpeed);
            let (mut lost, mut all) = (0.0, 0.0);
            for k in 1000..39_000 {
                let t = 0.01 * step * f64::from(k);
                lost += t.sin() * (t.sin() - cubics.until(t).1);
                all += t.sin().powi(2);
            }
            let part = lost / all / (1.0 - step.cos()).powi(2);
            assert!((0.8..1.0).contains(&(part / LOST_BETWEEN_SAMPLES)), "{step}: {part}");
        }
    }

    #[test]
    fn a_smooth_signal_is_held_before_and_after_its_samples() {
        let moving = series(&[0.0, 1.0], &[2.0, -1.0]);
        let mut integral = SignalIntegral::new(&moving, BetweenSamples::SmoothSpeed);
        assert_eq!(integral.until(-0.5), (-1.0, 2.0));
        assert_eq!(integral.until(0.5), (0.625, 0.5));
        assert_eq!(integral.until(2.0), (-0.5, -1.0));
    }
}
