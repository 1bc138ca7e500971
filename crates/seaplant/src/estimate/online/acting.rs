//! Samples of one axis: delayed and lagged thrust, and velocity through the water.

use nalgebra::Vector6;

use super::Sample;
use super::logs::{LEAST_SAMPLES, Stretch};
use crate::estimate::Fit;
use crate::estimate::propellers::drive_over;
use crate::trial::ReadyStretch;
use crate::{AxisRecord, Error, Grid, Model};

/// Number of parts of a step, each with its own mean force.
const PARTS: usize = 4;

/// Returns the continuous sections of a record of one axis.
///
/// With a fit of the same trials, `beside`, its nuisances are applied: thrust is delayed, lagged
/// and reduced by inflow, velocity is corrected for sensor errors, and the current is subtracted.
pub(super) fn stretches(axis: &AxisRecord, beside: Option<&Fit>) -> Result<Vec<Stretch>, Error> {
    let beside = beside.map(|fit| (fit, fit.model()));
    let beside = beside.as_ref();
    let ready = axis.ready(LEAST_SAMPLES)?;
    // Steps are not shorter than the interval of the measurements, which determine the motion.
    let hz = if ready.source_hz > 0.0 { ready.source_hz } else { ready.sample_hz };
    let period_s = 1.0 / hz.min(ready.sample_hz);
    let grid = |stretch: &ReadyStretch| {
        let whole = stretch.grid;
        Grid::spanning(whole.start_s, whole.time(whole.len - 1), period_s)
    };
    let all = ready.stretches.iter().map(|stretch| (stretch, grid(stretch)));
    let long = all.filter(|(_, grid)| grid.len > 2);
    long.map(|(stretch, grid)| samples(axis, (stretch, grid), beside)).collect()
}

/// A fit of the same trials, and its model.
type Beside<'a> = (&'a Fit, Model);

fn samples(
    axis: &AxisRecord,
    (stretch, grid): (&ReadyStretch, Grid),
    beside: Option<&Beside<'_>>,
) -> Result<Stretch, Error> {
    let (at, measured) = stretch.velocity_between(grid)?;
    let v = through_water(axis, at, measured, beside);
    let inputs = MeanInputs::new(axis, grid, beside.map(|(_, model)| model));
    let weights = weights(at.len < grid.len);
    let unit = Vector6::from_fn(|i, _| f64::from(u8::from(i == axis.dof.index())));
    let sample = |k: usize| {
        let next = v.get(k + 1).copied().unwrap_or(v[k]);
        let force = inputs.mean(k * PARTS, &weights, 0.5 * (v[k] + next), beside);
        Sample {
            time_s: at.time(k),
            velocity: unit * v[k],
            force: unit * force,
            ..Sample::default()
        }
    };
    let samples: Vec<Sample> = (0..at.len).map(sample).collect();
    let is_sound = |sample: &Sample| {
        (sample.velocity.norm_squared() + sample.force.norm_squared()).is_finite()
    };
    if !samples.iter().all(is_sound) {
        return Err(Error::TooLarge { dof: axis.dof });
    }
    Ok(Stretch { trial: axis.trial.clone(), samples })
}

/// Returns the weights of consecutive part means in a step between two samples: equal for measured
/// velocity; for velocity differentiated from positions, those of their second difference.
fn weights(is_slope: bool) -> Vec<f64> {
    let n = PARTS as f64;
    if !is_slope {
        return vec![1.0 / n; PARTS];
    }
    let rise: Vec<f64> = (0..PARTS).map(|k| (k as f64 + 0.5) / (n * n)).collect();
    rise.iter().chain(rise.iter().rev()).copied().collect()
}

/// Returns the measured velocity corrected for sensor errors and current.
fn through_water(
    axis: &AxisRecord,
    at: Grid,
    mut v: Vec<f64>,
    beside: Option<&Beside<'_>>,
) -> Vec<f64> {
    let Some((fit, model)) = beside else { return v };
    let current = model.thrust.current_of(&axis.trial);
    let lever = fit.nuisances.lever_m.iter().zip(axis.lever_rates.iter().flatten());
    let lever = lever.filter_map(|(lever, rate)| Some((lever.as_ref()?.value, rate)));
    for (metres, rate) in lever {
        v.iter_mut().zip(rate.interpolate(at)).for_each(|(v, rate)| *v -= metres * rate);
    }
    v.iter_mut().for_each(|v| *v = *v / model.sensor.scale - current);
    v
}

/// Means of the inputs over equal parts of the steps of a grid.
struct MeanInputs {
    tau: Vec<f64>,
    /// Σ lever² |n| of the propellers with forward thrust, and of those with reverse thrust.
    gamma: Vec<[f64; 2]>,
    turning: Vec<f64>,
}

impl MeanInputs {
    fn new(axis: &AxisRecord, grid: Grid, model: Option<&Model>) -> Self {
        let (part_s, count) = (grid.period_s / PARTS as f64, grid.len * PARTS);
        let middles = Grid { start_s: grid.start_s + 0.5 * part_s, period_s: part_s, len: count };
        let Some(model) = model else {
            let tau = axis.force.held_means(middles);
            return Self { tau, gamma: vec![[0.0; 2]; count], turning: vec![0.0; count] };
        };
        let edges: Vec<f64> = (0..=count).map(|k| grid.start_s + k as f64 * part_s).collect();
        let mut all =
            Self { tau: vec![0.0; count], gamma: vec![[0.0; 2]; count], turning: vec![0.0; count] };
        let (tracks, mut k) = (axis.tracks(), 0);
        let (turning, window_s) = (axis.turning.as_ref(), axis.common_window_s());
        for step in drive_over(&tracks, turning, window_s, &edges, &model.thrust) {
            let part = step.length_s / part_s;
            if k < count && part > 0.0 {
                all.tau[k] += part * step.push.tau;
                all.turning[k] += part * step.push.turning;
                all.gamma[k].iter_mut().zip(step.push.gamma).for_each(|(sum, x)| *sum += part * x);
            }
            k += usize::from(part > 0.0 && edges.get(k + 1).is_some_and(|end| *end <= step.time_s));
        }
        // Measured motion is lagged and averaged; the same is applied to thrust.
        let times: Vec<f64> = middles.times().collect();
        let alike = crate::VelocitySensor { scale: 1.0, ..model.sensor };
        all.tau = alike.shows(&times, &all.tau);
        all
    }

    /// Computes the mean force over a step that starts at a part, for a velocity through the water.
    fn mean(&self, from: usize, weights: &[f64], v: f64, beside: Option<&Beside<'_>>) -> f64 {
        let mean = |of: &dyn Fn(usize) -> f64| -> f64 {
            // The last step of a differentiated velocity ends with the record.
            let last = self.tau.len() - 1;
            let parts = weights.iter().enumerate();
            parts.map(|(k, weight)| weight * of((from + k).min(last))).sum()
        };
        let tau = mean(&|k| self.tau[k]);
        let Some((fit, Model { thrust, .. })) = beside else { return tau };
        let [forward, backward] = [0, 1].map(|way| mean(&|k| self.gamma[k][way]));
        let ahead = if v < 0.0 { backward } else { forward };
        let lost = thrust.inflow * (forward + backward) + thrust.inflow_ahead * ahead;
        // The acceleration due to turning, as an equivalent force on the mass.
        let turned = fit.physical().mass * thrust.turning * mean(&|k| self.turning[k]);
        tau - lost * v + turned
    }
}
