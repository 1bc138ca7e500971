//! The plant's own response as a filter, and what it makes of a record.

use super::instrumental::Rows;
use crate::estimate::Stretch;
use crate::signal::LowPass;
use crate::simulate::{advance, has_run_away};
use crate::{Dof, Error, Grid, LumpedParameters, State};

/// `F = 1/(s + a)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Prefilter {
    rate: f64,
}

impl Prefilter {
    /// a is the mean rate at which a plant forgets its velocity over some motion; at least
    /// that at which the longest stretch just does.
    pub(super) fn of<'a>(
        plant: &LumpedParameters,
        motion: impl Iterator<Item = &'a f64>,
        longest_s: f64,
    ) -> Self {
        let slope = |v: &f64| 2.0 * plant.beta.abs() * v.abs() + plant.mu.abs();
        let (sum, count) = motion.fold((0.0, 0_usize), |(sum, n), v| (sum + slope(v), n + 1));
        Self { rate: (sum / count.max(1) as f64).max(1.0 / longest_s) }
    }

    /// `exp(−a t)` at each instant.
    fn decay(&self, period_s: f64, len: usize) -> Vec<f64> {
        (0..len).map(|k| (-self.rate * period_s * k as f64).exp()).collect()
    }

    /// F x of a signal that is straight between its instants, from rest.
    fn straight(&self, x: &[f64], period_s: f64) -> Vec<f64> {
        let (keep, mean) = self.over(period_s);
        // ∫₀ʰ exp(−a(h−t)) t/h dt = (1 − mean) / a.
        let of_next = (1.0 - mean) / self.rate;
        let of_last = (mean - keep) / self.rate;
        let mut y = 0.0;
        let after = x.windows(2).map(|pair| {
            y = keep * y + of_last * pair[0] + of_next * pair[1];
            y
        });
        std::iter::once(0.0).chain(after).collect()
    }

    /// F x of a signal that is held over each interval, from rest; one instant more.
    fn held(&self, x: &[f64], period_s: f64) -> Vec<f64> {
        let (keep, mean) = self.over(period_s);
        let mut y = 0.0;
        let after = x.iter().map(|x| {
            y = keep * y + period_s * mean * x;
            y
        });
        std::iter::once(0.0).chain(after).collect()
    }

    /// `exp(−a t)` at the end of an interval, and its mean over it.
    fn over(&self, period_s: f64) -> (f64, f64) {
        let span = self.rate * period_s;
        ((-span).exp(), -(-span).exp_m1() / span)
    }
}

/// A stretch as it was measured.
pub(super) struct Record {
    grid: Grid,
    /// Mean force over each interval.
    tau: Vec<f64>,
    v: Vec<f64>,
    /// v|v|, of v smoothed.
    quadratic: Vec<f64>,
}

impl Record {
    /// # Errors
    /// [`Error::Cutoff`].
    pub(super) fn of(stretch: &Stretch<'_>, smooth: Option<LowPass>) -> Result<Self, Error> {
        let grid = stretch.ready.grid;
        let v = stretch.ready.on(grid)?.v;
        let middles = Grid {
            start_s: grid.start_s + 0.5 * grid.period_s,
            len: grid.len.saturating_sub(1),
            ..grid
        };
        let quadratic = match smooth {
            Some(filter) => signed_square(&filter.zero_phase(&v, stretch.sample_hz)?),
            None => signed_square(&v),
        };
        Ok(Self { grid, tau: stretch.axis.force.held_means(middles), v, quadratic })
    }

    pub(super) fn duration_s(&self) -> f64 {
        self.grid.len as f64 * self.grid.period_s
    }

    pub(super) fn first_velocity(&self) -> f64 {
        self.v[0]
    }

    /// The velocity that force makes of a plant, at each instant.
    ///
    /// # Errors
    /// [`Error::Diverged`].
    pub(super) fn simulate(
        &self,
        dof: Dof,
        plant: &LumpedParameters,
        start: f64,
    ) -> Result<Vec<f64>, Error> {
        let period_s = self.grid.period_s;
        let mut state = State { position: 0.0, velocity: start };
        let mut motion = Vec::with_capacity(self.grid.len);
        motion.push(start);
        for (k, &tau) in self.tau.iter().enumerate() {
            state = advance(|v| plant.acceleration(tau, v), state, period_s);
            if has_run_away(state) {
                return Err(Error::Diverged { dof, after_s: (k + 1) as f64 * period_s });
            }
            motion.push(state.velocity);
        }
        Ok(motion)
    }

    /// Terms and instruments, filtered.
    pub(super) fn rows(&self, prefilter: &Prefilter, simulated: &[f64]) -> Rows {
        let Grid { period_s, len, .. } = self.grid;
        let straight = |x: &[f64]| prefilter.straight(x, period_s);
        let tau = prefilter.held(&self.tau, period_s);
        let one = prefilter.held(&vec![1.0; len - 1], period_s);
        let linear = straight(&self.v);
        let f_v_dot = self.v.iter().zip(&linear).map(|(v, f_v)| v - prefilter.rate * f_v).collect();
        let terms = [tau.clone(), straight(&self.quadratic), linear, one.clone()];
        let instruments = [tau, straight(&signed_square(simulated)), straight(simulated), one];
        Rows::of(period_s, f_v_dot, terms, instruments, prefilter.decay(period_s, len))
    }
}

/// v|v| of each velocity.
fn signed_square(v: &[f64]) -> Vec<f64> {
    v.iter().map(|v| v * v.abs()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of a few hundred sums.
    const ROUNDING: f64 = 1e-13;

    const F: Prefilter = Prefilter { rate: 0.4 };

    #[test]
    fn a_ramp_and_a_step_are_filtered_as_the_closed_form_says() {
        let (h, n) = (0.25, 200);
        let time = |k: usize| h * k as f64;
        // From rest: F t = t/a − (1 − exp(−at))/a², F 1 = (1 − exp(−at))/a.
        let step = |k: usize| -(-F.rate * time(k)).exp_m1() / F.rate;
        let ramp = F.straight(&(0..n).map(time).collect::<Vec<_>>(), h);
        let held = F.held(&vec![1.0; n - 1], h);
        for k in 0..n {
            assert!((held[k] - step(k)).abs() < ROUNDING);
            let exact = (time(k) - step(k)) / F.rate;
            assert!((ramp[k] - exact).abs() < ROUNDING * 100.0, "{k}: {} {exact}", ramp[k]);
        }
    }

    #[test]
    fn the_derivative_is_found_without_deriving() {
        // v = sin ωt + 2: F v̇ = v − a F v − v₀ exp(−at).
        let (h, omega) = (0.01, 0.7);
        let v: Vec<f64> = (0..3000).map(|k| (omega * h * f64::from(k)).sin() + 2.0).collect();
        let slope: Vec<f64> = (0..3000).map(|k| omega * (omega * h * f64::from(k)).cos()).collect();
        let direct = F.straight(&slope, h);
        let (f_v, decay) = (F.straight(&v, h), F.decay(h, v.len()));
        for k in 0..v.len() {
            let without = v[k] - F.rate * f_v[k] - v[0] * decay[k];
            // Straight lines in place of a sine: (ωh)²/12.
            assert!((without - direct[k]).abs() < 1e-5, "{k}");
        }
    }
}
