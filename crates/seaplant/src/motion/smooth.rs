//! Smoothing of attitude by rates.

use super::attitude::interpolated;
use crate::Timed;

/// Smooths roll, pitch and heading with the body's rates.
///
/// The righting moment depends on attitude, so that noise of an attitude sensor biases its
/// least-squares estimate towards zero: 0.2° on a vehicle that rolls by 2° costs 1 %. Each angle is
/// therefore the smoothed state of `x_{k+1} = x_k + ∫ ẋ dt + w`, with ẋ from the measured rates and
/// the ratio of the two noise variances by maximum likelihood: with uninformative rates the angles
/// do not change.
///
/// # Source
/// \[Rauch1965\]; rates of angles as in [Fossen2021, ch. 2].
pub(crate) fn smoothed_attitude(
    angles: [Option<Timed>; 3],
    rates: [Option<&Timed>; 3],
) -> [Option<Timed>; 3] {
    let slopes: Vec<Option<Vec<f64>>> = (0..3)
        .map(|which| {
            let angle = angles[which].as_ref()?;
            // An angle whose own rate was not measured stays as it is.
            rates[which]?;
            Some(angle.time_s().iter().map(|&t| slope(which, &angles, &rates, t)).collect())
        })
        .collect();
    let mut smoothed = angles.clone();
    for (angle, slope) in smoothed.iter_mut().zip(slopes) {
        if let Some((series, slope)) = angle.as_ref().zip(slope) {
            *angle = Some(smooth(series, &slope));
        }
    }
    smoothed
}

/// Returns the rate of an Euler angle, rad/s.
fn slope(which: usize, angles: &[Option<Timed>; 3], rates: &[Option<&Timed>; 3], t: f64) -> f64 {
    let [p, q, r] = rates.map(|rate| interpolated(rate, t));
    let [roll, pitch, _] = angles.each_ref().map(|angle| interpolated(angle.as_ref(), t));
    let across = q * roll.sin() + r * roll.cos();
    match which {
        0 => p + pitch.tan() * across,
        1 => q * roll.cos() - r * roll.sin(),
        _ => across / pitch.cos(),
    }
}

/// Number of candidate ratios of step variance to sample variance, from perfect rates to perfect
/// angles.
const RATIOS: usize = 25;
const LEAST_RATIO: f64 = 1e-5;

/// Fewer samples cannot distinguish the two variances.
const LEAST_SAMPLES: usize = 20;

fn smooth(angle: &Timed, slope: &[f64]) -> Timed {
    let n = angle.len();
    if n < LEAST_SAMPLES {
        return angle.clone();
    }
    let steps: Vec<(f64, f64)> = (1..n).map(|k| step(angle, slope, k)).collect();
    let ratio = |j: usize| LEAST_RATIO * 10_f64.powf(j as f64 / 3.0);
    let cost = |j: usize| filter(angle.values(), &steps, ratio(j)).cost;
    let best = (0..RATIOS).min_by(|a, b| cost(*a).total_cmp(&cost(*b))).unwrap_or(0);
    let values = filter(angle.values(), &steps, ratio(best)).smoothed(&steps);
    angle.with_values("attitude", values).unwrap_or_else(|_| angle.clone())
}

/// Returns the change of the angle between two samples by its rate, and its variance relative to
/// that of a usual step.
fn step(angle: &Timed, slope: &[f64], k: usize) -> (f64, f64) {
    let time_s = angle.time_s();
    let h = time_s[k] - time_s[k - 1];
    let (first, last) = (slope[k - 1], slope[k]);
    let regular = k >= 2 && k + 1 < slope.len() && {
        let near = |h2: f64| (h2 - h).abs() < 0.2 * h;
        near(time_s[k - 1] - time_s[k - 2]) && near(time_s[k + 1] - time_s[k])
    };
    // The cubic through four samples, otherwise the straight line through two.
    let change = if regular {
        h / 24.0 * (13.0 * (first + last) - slope[k - 2] - slope[k + 1])
    } else {
        0.5 * h * (first + last)
    };
    (change, (h / angle.period_s()).powi(2))
}

/// A forward pass: means and variances before and after each sample, in units of the sample
/// variance.
struct Forward {
    after: Vec<(f64, f64)>,
    before: Vec<(f64, f64)>,
    cost: f64,
}

fn filter(values: &[f64], steps: &[(f64, f64)], ratio: f64) -> Forward {
    let (mut after, mut before) = (vec![(values[0], 1.0)], vec![(values[0], 1.0)]);
    let (mut logs, mut squares) = (0.0, 0.0);
    for (k, (change, times)) in steps.iter().enumerate() {
        let (x, p) = after[k];
        let (x, p) = (x + change, p + ratio * times);
        let s = p + 1.0;
        let e = values[k + 1] - x;
        logs += s.ln();
        squares += e * e / s;
        before.push((x, p));
        after.push((x + p / s * e, p / s));
    }
    let n = steps.len() as f64;
    Forward { after, before, cost: logs + n * (squares / n).max(f64::MIN_POSITIVE).ln() }
}

impl Forward {
    fn smoothed(&self, steps: &[(f64, f64)]) -> Vec<f64> {
        let mut x: Vec<f64> = self.after.iter().map(|(x, _)| *x).collect();
        for k in (0..steps.len()).rev() {
            let gain = self.after[k].1 / self.before[k + 1].1;
            x[k] += gain * (x[k + 1] - self.before[k + 1].0);
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    #[test]
    fn rates_reduce_the_noise_of_an_angle() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut noise = |std: f64| {
            let x: f64 = StandardNormal.sample(&mut random);
            std * x
        };
        let time_s: Vec<f64> = (0..2000).map(|k| 0.1 * f64::from(k)).collect();
        let truth: Vec<f64> = time_s.iter().map(|t| 0.05 * (3.0 * t).sin()).collect();
        let angle: Vec<f64> = truth.iter().map(|x| x + noise(0.003)).collect();
        let rate: Vec<f64> = time_s.iter().map(|t| 0.15 * (3.0 * t).cos() + noise(0.003)).collect();
        let series = |x: Vec<f64>| Timed::new("test", time_s.clone(), x).expect("valid");
        let rate = series(rate);
        let found = smoothed_attitude([Some(series(angle)), None, None], [Some(&rate), None, None]);
        let found = found[0].as_ref().expect("there");
        let errors = found.values().iter().zip(&truth).map(|(a, b)| (a - b).powi(2));
        let rms = (errors.sum::<f64>() / 2000.0).sqrt();
        assert!(rms < 0.001, "{rms}");
    }
}
