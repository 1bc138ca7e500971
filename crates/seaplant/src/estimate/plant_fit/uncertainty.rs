//! Uncertainty of the estimates, and whiteness of the innovations.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use super::filter::{Drift, Innovation, InstrumentNoise, Noise, NoiseNumber};
use super::problem::{Point, Problem};
use super::{AxisNoise, CurrentDrift, SwellForce};
use crate::estimate::PRECISION;
use crate::plant::{Plant, Structure};
use crate::{Dof, Error};

/// Computes the covariance of the plant's coefficients: zero for held ones, with a lower limit from
/// the precision of a log for the others.
pub(super) fn of_coefficients(plant: &Plant, all: &DMatrix<f64>) -> DMatrix<f64> {
    let structure = plant.structure();
    let terms = structure.terms().iter();
    let is_held: Vec<bool> = terms.map(|term| structure.held(term).is_some()).collect();
    let least = |k: usize| (PRECISION * plant.coefficients()[k]).powi(2);
    DMatrix::from_fn(is_held.len(), is_held.len(), |i, j| match is_held[i] || is_held[j] {
        true => 0.0,
        false => all[(i, j)] + if i == j { least(i) } else { 0.0 },
    })
}

/// Estimates with their covariance.
pub(super) struct Asked {
    pub(super) numbers: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
}

impl Asked {
    /// Eliminates insignificant numbers one by one: sets to zero the one with the smallest ratio of
    /// θ²/σ² to `needed`, as long as that is below 1, and conditions the others on it. Returns
    /// their indices.
    pub(super) fn without_unseen(&mut self, needed: impl Fn(usize, f64) -> f64) -> Vec<usize> {
        let Self { numbers, covariance } = self;
        let (mut left, mut unseen): (Vec<usize>, Vec<usize>) =
            ((0..numbers.len()).collect(), Vec::new());
        loop {
            let worth = |k: usize| numbers[k].powi(2) / covariance[(k, k)] / needed(k, numbers[k]);
            let least = left.iter().copied().min_by(|a, b| worth(*a).total_cmp(&worth(*b)));
            let Some(k) = least.filter(|k| worth(*k) < 1.0) else { return unseen };
            let column = covariance.column(k) / covariance[(k, k)];
            *numbers -= &column * numbers[k];
            *covariance -= &column * covariance.row(k).into_owned();
            left.retain(|other| *other != k);
            unseen.push(k);
        }
    }
}

/// Computes the variance inflation factors of the first p numbers, `(I⁻¹)_kk I_kk`.
pub(super) fn inflation(information: &DMatrix<f64>, p: usize) -> Vec<f64> {
    let covariance = inverse(information);
    (0..p).map(|k| covariance[(k, k)] * information[(k, k)]).collect()
}

pub(super) fn disturbances(
    structure: &Structure,
    noise: &Noise,
    covariance: &DMatrix<f64>,
    is_unmeasured: impl Fn(usize) -> bool,
) -> BTreeMap<Dof, AxisNoise> {
    let with_std = |x: f64, k: usize| (x, x * covariance[(k, k)].sqrt());
    let of = |(i, &dof): (usize, &Dof)| {
        let found = AxisNoise {
            disturbance: with_std(noise.disturbance[i], i),
            correlation_s: with_std(
                noise.correlation_s[i],
                noise.place(NoiseNumber::Correlation(i)),
            ),
            velocity: match is_unmeasured(i) {
                true => (noise.velocity[i], f64::INFINITY),
                false => with_std(noise.velocity[i], noise.place(NoiseNumber::Velocity(i))),
            },
        };
        (dof, found)
    };
    structure.axes().iter().enumerate().map(of).collect()
}

pub(super) fn attitude_noise(noise: &Noise, covariance: &DMatrix<f64>) -> Option<(f64, f64)> {
    let k = noise.place(NoiseNumber::Attitude);
    noise.attitude.map(|std| (std, std * covariance[(k, k)].sqrt()))
}

/// Returns the noise of the sensors by its name in results, with standard deviations.
pub(super) fn instruments(
    noise: &Noise,
    covariance: &DMatrix<f64>,
) -> BTreeMap<&'static str, (f64, f64)> {
    let of = |number: usize| {
        let value = noise.instruments.numbers[number];
        let k = noise.place(NoiseNumber::Instrument(number));
        (InstrumentNoise::NAMES[number].0, (value, value * covariance[(k, k)].sqrt()))
    };
    noise.instruments.needed().map(of).collect()
}

pub(super) fn current_drift(noise: &Noise, covariance: &DMatrix<f64>) -> Option<CurrentDrift> {
    let Drift { std_m_s, correlation_s } = noise.drift?;
    let with_std = |x: f64, number| {
        let k = noise.place(number);
        (x, x * covariance[(k, k)].sqrt())
    };
    Some(CurrentDrift {
        std_m_s: with_std(std_m_s, NoiseNumber::Drift),
        correlation_s: with_std(correlation_s, NoiseNumber::DriftCorrelation),
    })
}

pub(super) fn thrust_jitter(noise: &Noise, covariance: &DMatrix<f64>) -> Option<(f64, f64)> {
    let k = noise.place(NoiseNumber::Jitter);
    noise.jitter_s.map(|std| (std, std * covariance[(k, k)].sqrt()))
}

pub(super) fn swell_force(
    structure: &Structure,
    noise: &Noise,
    covariance: &DMatrix<f64>,
) -> Option<SwellForce> {
    let swell = noise.swell.as_ref()?;
    let with_std = |x: f64, number| {
        let k = noise.place(number);
        (x, x * covariance[(k, k)].sqrt())
    };
    let of = |(i, &dof): (usize, &Dof)| (dof, with_std(swell.std[i], NoiseNumber::Swell(i)));
    Some(SwellForce {
        force: structure.axes().iter().enumerate().map(of).collect(),
        period_s: with_std(TAU / swell.frequency, NoiseNumber::SwellFrequency),
        damping: with_std(swell.damping, NoiseNumber::SwellDamping),
    })
}

/// Inverts an information matrix, scaled to a unit diagonal first; undetermined directions get a
/// very large variance.
pub(super) fn inverse(information: &DMatrix<f64>) -> DMatrix<f64> {
    let n = information.nrows();
    let scale = DVector::from_fn(n, |k, _| {
        let own = information[(k, k)];
        if own > 0.0 { 1.0 / own.sqrt() } else { 1.0 }
    });
    let scaled = DMatrix::from_fn(n, n, |i, j| information[(i, j)] * scale[i] * scale[j]);
    let eigen = scaled.symmetric_eigen();
    let values = eigen.eigenvalues.map(|value| 1.0 / value.max(LEAST_INFORMATION));
    let inverse =
        &eigen.eigenvectors * DMatrix::from_diagonal(&values) * eigen.eigenvectors.transpose();
    DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j])
}

/// Lower limit of the eigenvalues of the scaled information: smaller ones are rounding.
const LEAST_INFORMATION: f64 = 1e-12;

/// Interval of the innovations tested on axes differentiated from positions, where neighbouring
/// samples share a fix.
const APART_OF_SLOPES: usize = 2;

/// Number of lags of the whiteness test.
const LAGS: usize = 40;

/// Computes the Box–Pierce statistic of each axis over [`LAGS`], divided by the number of lags.
///
/// Where translations have a lag, noise may enter before it or after it: either the innovations are
/// white, or the innovations filtered by the lag. `keep` is the part of a sample that the lag
/// carries into the next.
pub(super) fn whiteness(
    problem: &Problem,
    point: &Point,
    keep: f64,
) -> Result<BTreeMap<Dof, f64>, Error> {
    let trials = problem.innovations(point)?;
    let of = |(axis, &dof): (usize, &Dof)| {
        let apart = if problem.by_slope[dof.index()] { APART_OF_SLOPES } else { 1 };
        let of_axis = |trial: &Vec<Innovation>| -> Vec<f64> {
            let own =
                trial.iter().filter(|innovation| innovation.axis == Some(axis)).step_by(apart);
            own.map(Innovation::normalised).collect()
        };
        let mut series: Vec<Vec<f64>> = trials.iter().map(of_axis).collect();
        let before = colour(&series);
        if keep == 0.0 || !problem.may_be_late(dof) {
            return (dof, before);
        }
        series.iter_mut().for_each(|e| put_behind(e, keep));
        (dof, before.min(colour(&series)))
    };
    Ok(problem.structure.axes().iter().enumerate().map(of).collect())
}

/// Filters a series by a lag that carries the part `keep` of a sample into the next.
pub(super) fn put_behind(series: &mut [f64], keep: f64) {
    (1..series.len()).for_each(|k| series[k] += keep * series[k - 1]);
}

/// Computes the mean over [`LAGS`] and series of `n r²`: 1 for white noise.
fn colour(series: &[Vec<f64>]) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for e in series {
        let power: f64 = e.iter().map(|x| x * x).sum();
        for lag in 1..=LAGS.min(e.len() / 4) {
            let product: f64 = e.iter().zip(&e[lag..]).map(|(a, b)| a * b).sum();
            let r = product / power;
            sum += e.len() as f64 * r * r;
            count += 1;
        }
    }
    sum / count.max(1) as f64
}
