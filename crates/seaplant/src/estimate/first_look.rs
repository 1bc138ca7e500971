//! A first plant for records of acceleration alone, where no regression on velocity can be made.

use nalgebra::Matrix4;

use crate::estimate::{DelayedFit, Fit, Method, Records};
use crate::navigation::MeanOver;
use crate::signal::rms;
use crate::terms::Term;
use crate::{AxisRecord, Dof, Error, LumpedParameters, Terms};

/// A plant to begin with, by simulating one after another from rest on a grid of masses, speeds and
/// delays, and comparing accelerations without the mean of each trial.
///
/// # Errors
/// [`Error::TooShort`] without acceleration; [`Error::NotExciting`] if thrust does not vary.
pub(crate) fn first_look(
    records: Records<'_>,
    delays_s: impl Iterator<Item = f64>,
) -> Result<DelayedFit, Error> {
    let (dof, axes) = (records.dof()?, records.fit);
    let plain: Vec<Trace> = axes.iter().map(|axis| Trace::of(axis, 0.0)).collect();
    let samples: usize = plain.iter().map(|trace| trace.tau.len()).sum();
    if samples < LEAST_SAMPLES {
        let name = format!("the acceleration in {dof}");
        return Err(Error::TooShort { name, found: samples, needed: LEAST_SAMPLES });
    }
    let tau_rms = rms(plain.iter().flat_map(|trace| &trace.tau));
    let mut best: Option<(f64, f64, LumpedParameters)> = None;
    for delay_s in delays_s.filter(|delay_s| *delay_s < MOST_DELAY_S) {
        let traces: Vec<Trace> = axes.iter().map(|axis| Trace::of(axis, delay_s)).collect();
        let Some(alpha) = direct_alpha(&traces) else { continue };
        for lumped in grid(alpha, tau_rms) {
            let left: f64 = traces.iter().map(|trace| trace.unexplained(&lumped)).sum();
            if left.is_finite() && best.is_none_or(|(least, ..)| left < least) {
                best = Some((left, delay_s, lumped));
            }
        }
    }
    let (left, delay_s, lumped) = best.ok_or(Error::NotExciting { dof, rank: 0, needed: 2 })?;
    let residual_rms = (left / samples as f64).sqrt();
    Ok(DelayedFit { delay_s, fit: fit(dof, lumped, samples, residual_rms)? })
}

/// Fewer say nothing.
const LEAST_SAMPLES: usize = 30;

/// Propellers are not later than this by any first look, s.
const MOST_DELAY_S: f64 = 0.55;

/// Drag hides part of what thrust does, so that mass is no more than its first guess.
const MASSES: [f64; 5] = [1.0, 0.8, 0.6, 0.45, 0.3];

/// Speeds at the usual thrust, m/s.
const SPEEDS: [f64; 9] = [0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.5, 2.5, 5.0];

fn grid(alpha: f64, tau_rms: f64) -> impl Iterator<Item = LumpedParameters> {
    MASSES.into_iter().flat_map(move |part| {
        let alpha = alpha / part;
        SPEEDS.into_iter().map(move |speed| {
            let beta = -alpha.abs() * tau_rms / (speed * speed);
            LumpedParameters { alpha, beta, mu: 0.0, bias: 0.0 }
        })
    })
}

/// What thrust did and what was felt over the same windows.
struct Trace {
    tau: Vec<f64>,
    felt: Vec<MeanOver>,
}

impl Trace {
    fn of(axis: &AxisRecord, delay_s: f64) -> Self {
        let felt: Vec<MeanOver> = axis.acceleration.iter().flat_map(|all| all.windows()).collect();
        let mut force = axis.force.reader();
        let held = |over: &MeanOver| force.held_at(0.5 * (over.from_s + over.to_s) - delay_s);
        Self { tau: felt.iter().map(held).collect(), felt }
    }

    /// Σ (a − a_model − mean)² of a simulation from rest.
    fn unexplained(&self, lumped: &LumpedParameters) -> f64 {
        let (mut v, mut before_s) = (0.0_f64, f64::INFINITY);
        let (mut sum, mut square) = (0.0, 0.0);
        for (tau, over) in self.tau.iter().zip(&self.felt) {
            // Nothing is known of what happened in a gap.
            v = if over.from_s - before_s > RESTART_S { 0.0 } else { v };
            before_s = over.to_s;
            let h = over.to_s - over.from_s;
            // Drag taken at the end of the step keeps large steps stable.
            let pushed = v + h * lumped.alpha * tau;
            let next = pushed / (1.0 - h * lumped.beta * pushed.abs());
            let off = over.mean - (next - v) / h;
            v = next;
            sum += off;
            square += off * off;
        }
        square - sum * sum / self.felt.len().max(1) as f64
    }
}

/// After a gap longer than this a vehicle is taken to be at rest, s.
const RESTART_S: f64 = 5.0;

/// α by least squares of acceleration on thrust, both without their means, as if there were no drag.
fn direct_alpha(traces: &[Trace]) -> Option<f64> {
    let (mut xx, mut xy) = (0.0, 0.0);
    for trace in traces {
        let n = trace.tau.len().max(1) as f64;
        let mean_x = trace.tau.iter().sum::<f64>() / n;
        let mean_y = trace.felt.iter().map(|over| over.mean).sum::<f64>() / n;
        for (tau, over) in trace.tau.iter().zip(&trace.felt) {
            xx += (tau - mean_x).powi(2);
            xy += (tau - mean_x) * (over.mean - mean_y);
        }
    }
    // A wrong sign is kept: the judges refuse it.
    (xx > 0.0 && xy != 0.0).then(|| xy / xx)
}

/// The plant as a fit without uncertainty: nothing but its numbers is looked at.
fn fit(
    dof: Dof,
    lumped: LumpedParameters,
    samples: usize,
    residual_rms: f64,
) -> Result<Fit, Error> {
    Ok(Fit {
        history: None,
        dof,
        method: Method::FilterError,
        terms: Terms::new(&[Term::Force, Term::Quadratic])?,
        lumped,
        covariance: Matrix4::zeros(),
        thrust_covariance: Matrix4::zeros(),
        t_freedom: samples as f64,
        condition: 1.0,
        inflation: Vec::new(),
        samples,
        effective_samples: samples as f64,
        residual_rms,
        filters: Default::default(),
        nuisances: Default::default(),
        structure: Vec::new(),
        steady_test: None,
        innovations: Vec::new(),
        caveats: Vec::new(),
        start: None,
    })
}
