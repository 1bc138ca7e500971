//! The slope of the likelihood by the noise, from one sweep back through a trial.
//!
//! With the filter's transition Φ, gain K and innovation e of variance S, and what a measurement sees
//! z, going back from `r = 0`, `N = 0`:
//!
//! ```text
//! u = e/S − Kᵀr,   D = 1/S + KᵀNK,                              a measurement,
//! r ← r + z u,     N ← N − z (NK)ᵀ − (NK) zᵀ + z zᵀ D,
//! r ← Φᵀr,         N ← ΦᵀNΦ,                                    a step.
//! ```
//!
//! The log-likelihood changes by `½ tr (r rᵀ − N) ∂Q` with process noise or first covariance, by
//! `½ (u² − D) ∂R` with that of a sample, and by `rᵀ ∂Φ m + tr (r rᵀ − N) ∂Φ P Φᵀ` with the
//! transition.

use std::ops::Range;

use super::follower::{Process, Steps};
use super::noise::Noise;
use super::state::{Covariance, Seen, State, Transition};
use super::{At, Gain, Met, Pass, Run, Slope, finite, half_log};

/// Stops of a block: the filter goes through each once more before the way back, so that what the
/// way back needs is kept of one block only.
const BLOCK: usize = 256;

/// How the log-likelihood of what comes later changes with the mean, and with the covariance: r and N.
struct Adjoint<const N: usize> {
    r: State<N>,
    n: Covariance<N>,
}

impl<const N: usize> Pass<'_, N> {
    /// The negative log-likelihood with its slope by the logarithms of the noise; no information.
    ///
    /// # Source
    /// [Koopman1992], with the filter's linearisation kept.
    pub(in crate::estimate::coupled) fn score(&self) -> Slope {
        let stops = self.schedule.stops.len();
        let blocks: Vec<Range<usize>> =
            (1..stops).step_by(BLOCK).map(|from| from..stops.min(from + BLOCK)).collect();
        let mut run = Run::begin(self);
        let (mut begins, mut slope) = (Vec::new(), Slope::zeros(self.noise.count()));
        for block in &blocks {
            begins.push(run.at);
            self.run(block.clone(), &mut run, |met| {
                let of = |(_, e, gain): &(Seen, f64, Gain<N>)| half_log(*e, gain.variance);
                slope.cost += met.measured.iter().map(of).sum::<f64>();
            });
        }
        let mut slope = finite(slope, &run.at.mean);
        let mut adjoint = Adjoint { r: State::zeros(), n: Covariance::zeros() };
        let (mut kept, mut steps) = (Vec::with_capacity(BLOCK), Steps::default());
        for (block, begin) in blocks.into_iter().zip(begins).rev() {
            run.at = begin;
            self.run(block, &mut run, |met| kept.push(met));
            while let Some(met) = kept.pop() {
                let process = steps.of(met.length_s, |h| Process::new(self, h));
                self.go_back(&met, process, &mut adjoint, &mut slope);
            }
        }
        for (k, follower) in self.noise_followers().iter().enumerate() {
            slope.gradient[k] -= adjoint.by_covariance(&follower.covariance);
        }
        slope
    }

    fn go_back(
        &self,
        met: &Met<N>,
        process: &Process<N>,
        adjoint: &mut Adjoint<N>,
        slope: &mut Slope,
    ) {
        for (seen, e, gain) in met.measured.iter().rev() {
            let (u, d) = adjoint.before_measurement(seen, *e, gain);
            let r = self.noise.velocity[seen.axis].powi(2) * seen.spread;
            slope.gradient[2 * N + seen.axis] -= (u * u - d) * r;
        }
        let Met { before: At { mean, covariance }, transition, .. } = met;
        let with_process = (0..2 * N).chain(Noise::<N>::DRIFT..self.noise.count());
        for k in with_process {
            let change = &process.changes[k];
            slope.gradient[k] -= adjoint.by_covariance(&change.process);
            if let Some(fade) = &change.fade {
                let axis = fade.axis;
                let mut moved = State::zeros();
                moved.velocity = transition.by_disturbance.column(axis) * fade.push;
                moved.disturbance[axis] = fade.by;
                let of_state = (mean.disturbance[axis], covariance.of_disturbance(axis));
                slope.gradient[k] -= adjoint.by_transition(&moved, of_state, transition);
            }
            if change.fade_of_water > 0.0 {
                for direction in 0..2 {
                    let mut moved = State::zeros();
                    moved.water[direction] = change.fade_of_water;
                    let of_state = (mean.water[direction], covariance.of_water(direction));
                    slope.gradient[k] -= adjoint.by_transition(&moved, of_state, transition);
                }
            }
        }
        adjoint.before_step(transition);
    }
}

impl<const N: usize> Adjoint<N> {
    /// Goes back behind a measurement; u and D.
    fn before_measurement(&mut self, seen: &Seen, e: f64, gain: &Gain<N>) -> (f64, f64) {
        let column = self.n.times(&gain.state);
        let u = e / gain.variance - self.r.dot(&gain.state);
        let d = 1.0 / gain.variance + column.dot(&gain.state);
        self.r.velocity[seen.axis] += u;
        self.r.water += seen.water * u;
        // z (NK − ½ D z)ᵀ and its transpose.
        let z = State::of(seen);
        let mut half = column;
        half.add(&z, -0.5 * d);
        self.n.subtract_both(&half, &z);
        (u, d)
    }

    /// Goes back before a step.
    fn before_step(&mut self, step: &Transition<N>) {
        self.r.step_back(step);
        self.n.step_back(step);
    }

    /// `½ tr (r rᵀ − N) ∂Q`.
    fn by_covariance(&self, change: &Covariance<N>) -> f64 {
        let Self { r, n } = self;
        0.5 * (change.times(r).dot(r) - change.dot(n))
    }

    /// `rᵀ ∂Φ m + tr (r rᵀ − N) ∂Φ P Φᵀ` of a change of Φ that takes one part of the state, whose mean
    /// and covariance with all come along, to `moved` times that.
    fn by_transition(
        &self,
        moved: &State<N>,
        (mean, mut covariance): (f64, State<N>),
        step: &Transition<N>,
    ) -> f64 {
        covariance.step(step);
        let by_mean = self.r.dot(moved);
        by_mean * (mean + self.r.dot(&covariance)) - self.n.times(moved).dot(&covariance)
    }
}
