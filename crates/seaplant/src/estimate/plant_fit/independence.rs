//! Test of innovations for dependence on the thrusters.
//!
//! Waves, gusts and a tether correlate innovations in time, as a missing term of the plant does, but do
//! not depend on the thrusters. Innovations that are independent of all past thrust leave the estimates
//! consistent, and the covariance of blocks gives their uncertainty.

use std::collections::BTreeMap;

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::filter::{DrivenState, Innovation};
use super::problem::{Point, Problem};
use crate::Dof;

/// Delays of the innovations behind the inputs, in samples of their axis.
const DELAYS: [usize; 7] = [0, 1, 2, 4, 8, 16, 32];

/// Length of a block, s: disturbances of different blocks are nearly independent.
const BLOCK_S: f64 = 15.0;

/// Minimum number of blocks for a test.
const LEAST_BLOCKS: usize = 12;

impl Problem {
    /// Computes for each axis the probability that innovations which are independent of the thrusters
    /// correlate with them as much as these do.
    ///
    /// With innovations e of an axis, normalised, an input u and a delay d, the mean over a block of
    /// `e(t) u(t − d)` has mean zero if they are independent; Student's t of the means of all blocks
    /// tests that. Inputs are thrust, the velocities that it causes in a simulation without
    /// disturbances, and their products in pairs; the smallest probability counts, times the number of
    /// tests (Bonferroni). An axis with too few blocks, or a simulation that diverges, has none.
    ///
    /// # Source
    /// [Ljung1999, sec. 16.6], with the variance of blocks instead of that of two stationary series.
    pub(super) fn independence(&self, point: &Point) -> BTreeMap<Dof, f64> {
        let passes = self.each(point, |_, pass| {
            let (states, innovations) = (pass.driven_states(), pass.innovations());
            (states.iter().map(inputs).collect::<Vec<_>>(), innovations)
        });
        let Ok(passes) = passes else { return BTreeMap::new() };
        let of = |(axis, dof): (usize, &Dof)| {
            let mut blocks = Vec::new();
            for (schedule, (inputs, innovations)) in self.schedules.iter().zip(&passes) {
                let own: Vec<&Innovation> =
                    innovations.iter().filter(|own| own.axis == Some(axis)).collect();
                let time_s = |own: &Innovation| schedule.instants[own.instant].time_s;
                add_blocks(&own, inputs, time_s, &mut blocks);
            }
            Some((*dof, probability(&blocks)?))
        };
        self.structure.axes().iter().enumerate().filter_map(of).collect()
    }
}

/// Returns what innovations may depend on: force, velocity and its products in pairs.
fn inputs(state: &DrivenState) -> Vec<f64> {
    let mut all: Vec<f64> = state.force.iter().chain(&state.velocity).copied().collect();
    for (i, x) in state.velocity.iter().enumerate() {
        all.push(x * x.abs());
        all.extend(state.velocity.iter().skip(i + 1).map(|y| x * y));
    }
    all
}

/// Adds the mean products of innovations and delayed inputs over each block of a section.
fn add_blocks(
    innovations: &[&Innovation],
    inputs: &[Vec<f64>],
    time_s: impl Fn(&Innovation) -> f64,
    blocks: &mut Vec<Vec<f64>>,
) {
    let most = DELAYS[DELAYS.len() - 1];
    let (Some(first), Some(count)) = (innovations.first(), inputs.first().map(Vec::len)) else {
        return;
    };
    let samples = innovations.len() as f64;
    let mean =
        |k: usize| innovations.iter().map(|own| inputs[own.instant][k]).sum::<f64>() / samples;
    let means: Vec<f64> = (0..count).map(mean).collect();
    let begin_s = time_s(first);
    let mut sums = vec![0.0; DELAYS.len() * count];
    let (mut block, mut in_block) = (0.0, 0_usize);
    for at in most..innovations.len() {
        let own = innovations[at];
        let now = ((time_s(own) - begin_s) / BLOCK_S).floor();
        if now > block && in_block > 0 {
            let mean = sums.iter().map(|sum| sum / in_block as f64).collect();
            blocks.push(mean);
            (in_block, block) = (0, now);
            sums.fill(0.0);
        }
        let error = own.normalised();
        for (delay, sums) in DELAYS.iter().zip(sums.chunks_exact_mut(count)) {
            let past = &inputs[innovations[at - delay].instant];
            for ((sum, x), mean) in sums.iter_mut().zip(past).zip(&means) {
                *sum += error * (x - mean);
            }
        }
        in_block += 1;
    }
}

/// Computes the smallest two-sided probability of Student's t over all inputs and delays, times their
/// number.
fn probability(blocks: &[Vec<f64>]) -> Option<f64> {
    let n = blocks.len();
    if n < LEAST_BLOCKS || blocks.iter().flatten().any(|x| !x.is_finite()) {
        return None;
    }
    let tests = blocks[0].len();
    let t = |k: usize| {
        let own = || blocks.iter().map(|block| block[k]);
        let mean = own().sum::<f64>() / n as f64;
        let variance = own().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1) as f64;
        let std = (variance / n as f64).sqrt();
        // An input that does not move says nothing.
        if std > 0.0 { (mean / std).abs() } else { 0.0 }
    };
    let greatest = (0..tests).map(t).fold(0.0, f64::max);
    let student = StudentsT::new(0.0, 1.0, (n - 1) as f64).ok()?;
    Some((2.0 * tests as f64 * student.sf(greatest)).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn innovation(instant: usize, error: f64) -> Innovation {
        Innovation { axis: Some(0), number: 0, instant, error, variance: 1.0 }
    }

    /// A pilot's steps of force, and waves; innovations are waves and a part of the force a second ago.
    fn tested(part: f64) -> f64 {
        let (period_s, count) = (0.1, 6000);
        let force =
            |k: usize| if (k / 70).is_multiple_of(3) { 1.0 } else { -0.6 + (k / 310 % 2) as f64 };
        let inputs: Vec<Vec<f64>> = (0..count).map(|k| vec![force(k)]).collect();
        let innovations: Vec<Innovation> = (0..count)
            .map(|k| {
                let t = k as f64 * period_s;
                let waves = (1.1 * t).sin() + (0.83 * t + 1.0).sin() + (0.97 * t).sin();
                innovation(k, waves + part * force(k.saturating_sub(8)))
            })
            .collect();
        let mut blocks = Vec::new();
        let own: Vec<&Innovation> = innovations.iter().collect();
        add_blocks(&own, &inputs, |own| own.instant as f64 * period_s, &mut blocks);
        probability(&blocks).expect("enough blocks")
    }

    #[test]
    fn waves_are_independent_of_thrust_and_a_missing_force_is_not() {
        assert!(tested(0.0) > 0.05, "{}", tested(0.0));
        assert!(tested(0.5) < 1e-3, "{}", tested(0.5));
    }

    #[test]
    fn a_short_trial_is_no_test() {
        assert_eq!(probability(&vec![vec![1.0]; LEAST_BLOCKS - 1]), None);
        assert_eq!(probability(&vec![vec![f64::NAN]; 40]), None);
    }
}
