//! Errors of logging: averaging, outliers, gaps, wrong time stamps.

use nalgebra::Vector3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::Exp1;

use super::motion::STEP_S;
use super::random::Streams;
use super::{Disturbance, DisturbanceStrength, STEPS_PER_TICK, TICK_HZ, TwinSpec};
use crate::{Error, Timed};

/// Fraction of a trial at each end without gaps, so that no log begins or ends with one.
const ENDS_WITHOUT_GAPS: f64 = 0.05;
/// Largest error of a time stamp, as a fraction of the sampling period.
const MOST_JITTER_OF_PERIOD: f64 = 0.45;

/// The logging errors of one trial.
pub(super) struct Faults<'a> {
    spec: &'a TwinSpec,
    streams: &'a Streams<'a>,
    duration_s: f64,
}

impl<'a> Faults<'a> {
    pub(super) fn new(spec: &'a TwinSpec, streams: &'a Streams<'a>, ticks: usize) -> Self {
        Self { spec, streams, duration_s: ticks as f64 / TICK_HZ }
    }

    fn strength(&self) -> &DisturbanceStrength {
        &self.spec.strength
    }

    /// Returns whether the DVL averages or lags.
    pub(super) fn smooths(&self) -> bool {
        self.spec.has(Disturbance::VelocityAveraging) || self.spec.has(Disturbance::VelocityLag)
    }

    /// Returns the DVL's output at every tick for a velocity at every step: the mean over the past,
    /// then a first-order lag.
    pub(super) fn smoothed(&self, mut v: Vec<Vector3<f64>>) -> Vec<Vector3<f64>> {
        if self.spec.has(Disturbance::VelocityAveraging) {
            v = averaged(&v, self.strength().averaging_s);
        }
        if self.spec.has(Disturbance::VelocityLag) {
            v = lagging(&v, self.strength().velocity_lag_s);
        }
        v.into_iter().step_by(STEPS_PER_TICK).collect()
    }

    /// Returns the scale factor of the DVL.
    pub(super) fn dvl_scale(&self) -> f64 {
        1.0 + self.spec.strength_of(Disturbance::DvlScale, self.strength().dvl_scale_error)
    }

    /// Adds outliers to samples of the DVL, on all axes at once.
    pub(super) fn spike_dvl(&self, axes: &mut [Vec<f64>; 3]) {
        let mut rng = self.streams.stream("dvl spikes");
        let samples = axes[0].len();
        for sample in self.outliers(&mut rng, samples) {
            for axis in axes.iter_mut() {
                axis[sample] += self.strength().spike_m_s * rng.random_range(-1.0..=1.0);
            }
        }
    }

    /// Adds drift and outliers to headings, one each tick, rad.
    pub(super) fn add_heading_errors(&self, heading: &mut [f64]) {
        let drift = self
            .spec
            .strength_of(Disturbance::HeadingDrift, self.strength().heading_drift_deg_min)
            .to_radians()
            / 60.0;
        heading.iter_mut().enumerate().for_each(|(tick, x)| *x += drift * tick as f64 / TICK_HZ);
        let mut rng = self.streams.stream("heading spikes");
        let most = self.strength().spike_heading_deg.to_radians();
        for sample in self.outliers(&mut rng, heading.len()) {
            heading[sample] += most * rng.random_range(-1.0..=1.0);
        }
    }

    /// Draws the samples that are outliers.
    fn outliers(&self, rng: &mut ChaCha8Rng, samples: usize) -> Vec<usize> {
        let part = self.spec.strength_of(Disturbance::Spikes, self.strength().spike_part);
        (0..samples).filter(|_| rng.random_bool(part)).collect()
    }

    /// Returns the logged series of one instrument, which share their times: without samples in
    /// gaps of this disturbance, and with time stamps that may be wrong.
    ///
    /// # Errors
    /// As [`Timed::new`].
    pub(super) fn logged<const N: usize>(
        &self,
        instrument: &str,
        gaps: Option<Disturbance>,
        time_s: &[f64],
        series: [Vec<f64>; N],
    ) -> Result<[Timed; N], Error> {
        let gaps_s = match gaps.filter(|disturbance| self.spec.has(*disturbance)) {
            Some(_) => self.gaps(instrument),
            None => Vec::new(),
        };
        let is_logged = |t: &f64| !gaps_s.iter().any(|[from, to]| (from..to).contains(&t));
        let keep: Vec<bool> = time_s.iter().map(is_logged).collect();
        let kept = |x: &[f64]| -> Vec<f64> {
            x.iter().zip(&keep).filter(|(_, keep)| **keep).map(|(x, _)| *x).collect()
        };
        let stamps = kept(&self.stamped(instrument, time_s));
        let mut timed = Vec::with_capacity(N);
        for x in series {
            timed.push(Timed::new(instrument, stamps.clone(), kept(&x))?);
        }
        Ok(timed.try_into().expect("one for each"))
    }

    /// Draws the gaps of an instrument, s.
    fn gaps(&self, instrument: &str) -> Vec<[f64; 2]> {
        let mut rng = self.streams.stream(&format!("{instrument} gaps"));
        let DisturbanceStrength { gap_s, gap_interval_s, .. } = *self.strength();
        let (mut t, last) =
            (ENDS_WITHOUT_GAPS * self.duration_s, (1.0 - ENDS_WITHOUT_GAPS) * self.duration_s);
        let mut gaps = Vec::new();
        loop {
            t += gap_interval_s * rng.sample::<f64, _>(Exp1);
            let until = t + gap_s * rng.random_range(0.5..=1.5);
            if until > last {
                return gaps;
            }
            gaps.push([t, until]);
            t = until;
        }
    }

    /// Returns the time stamps of samples taken at these times, s; none precedes the trial.
    fn stamped(&self, instrument: &str, time_s: &[f64]) -> Vec<f64> {
        let most = self.spec.strength_of(Disturbance::StampJitter, self.strength().stamp_jitter_s);
        if most == 0.0 {
            return time_s.to_vec();
        }
        // Time stamps of a fast instrument must stay in order too.
        let apart_s = time_s.get(1).map_or(f64::INFINITY, |second| second - time_s[0]);
        let most = most.min(MOST_JITTER_OF_PERIOD * apart_s);
        let mut rng = self.streams.stream(&format!("{instrument} stamps"));
        let off = |t: &f64| (t + most * rng.random_range(-1.0..=1.0)).max(0.0);
        time_s.iter().map(off).collect()
    }

    /// Returns the number of ticks per logged propeller speed.
    pub(super) fn ticks_per_speed(&self) -> usize {
        if self.spec.has(Disturbance::SlowThrustLog) {
            (TICK_HZ * self.strength().thrust_log_s).round() as usize
        } else {
            1
        }
    }
}

/// Returns the mean over the past `window_s` at every step, by the trapezoidal rule; initially over
/// the time since the start.
fn averaged(v: &[Vector3<f64>], window_s: f64) -> Vec<Vector3<f64>> {
    let window = (window_s / STEP_S).round() as usize;
    let mut sums = vec![Vector3::zeros()];
    for pair in v.windows(2) {
        let sum = sums[sums.len() - 1];
        sums.push(sum + 0.5 * (pair[0] + pair[1]));
    }
    let mean = |step: usize| match step.min(window) {
        0 => v[step],
        steps => (sums[step] - sums[step - steps]) / steps as f64,
    };
    (0..v.len()).map(mean).collect()
}

/// Applies a first-order lag to a velocity that is linear within each step, in steady state at the
/// start.
fn lagging(v: &[Vector3<f64>], time_constant_s: f64) -> Vec<Vector3<f64>> {
    if time_constant_s == 0.0 {
        return v.to_vec();
    }
    let keep = (-STEP_S / time_constant_s).exp();
    let slope_part = time_constant_s / STEP_S * (1.0 - keep);
    let mut path = vec![v[0]];
    for pair in v.windows(2) {
        let now = path[path.len() - 1];
        path.push(keep * now + (slope_part - keep) * pair[0] + (1.0 - slope_part) * pair[1]);
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    fn along_x(of: impl Fn(f64) -> f64, steps: usize) -> Vec<Vector3<f64>> {
        (0..steps).map(|step| Vector3::new(of(step as f64 * STEP_S), 0.0, 0.0)).collect()
    }

    /// Rounding, m/s.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn the_mean_of_a_ramp_lags_by_half_a_window() {
        let ramp = averaged(&along_x(|t| 0.3 * t, 200), 1.0);
        for (step, v) in ramp.iter().enumerate().skip(50) {
            let t = step as f64 * STEP_S;
            assert!((v.x - 0.3 * (t - 0.5)).abs() < ROUNDING, "{t} s: {}", v.x);
        }
        assert!((ramp[20].x - 0.3 * 0.2).abs() < ROUNDING, "of what has passed");
    }

    #[test]
    fn a_mean_over_a_second_removes_a_sine_of_that_period() {
        let sine = averaged(&along_x(|t| (std::f64::consts::TAU * t).sin(), 300), 1.0);
        assert!(sine.iter().skip(50).all(|v| v.x.abs() < ROUNDING));
    }

    #[test]
    fn a_lag_follows_a_ramp_late_by_its_time_constant() {
        let ramp = lagging(&along_x(|t| 0.3 * t, 400), 0.3);
        for (step, v) in ramp.iter().enumerate() {
            let t = step as f64 * STEP_S;
            let exact = 0.3 * (t - 0.3 + 0.3 * (-t / 0.3).exp());
            assert!((v.x - exact).abs() < ROUNDING, "{t} s: {}", v.x);
        }
    }

    #[test]
    fn gaps_have_their_length_and_interval_and_spare_both_ends() {
        let spec = TwinSpec {
            disturbances: [Disturbance::Dropouts].into(),
            duration_s: 40_000.0,
            ..TwinSpec::jason2()
        };
        let streams = Streams { seed: 1, trial: "surge 1" };
        let gaps = Faults::new(&spec, &streams, 400_000).gaps("dvl");
        // 370 gaps: their mean interval is known to 5 %, and their mean length to 2 %.
        let mean = |of: &mut dyn Iterator<Item = f64>, n: usize| of.sum::<f64>() / n as f64;
        let length = mean(&mut gaps.iter().map(|[from, to]| to - from), gaps.len());
        let between = mean(&mut gaps.windows(2).map(|w| w[1][0] - w[0][1]), gaps.len() - 1);
        assert!((length / 8.0 - 1.0).abs() < 0.06, "{length}");
        assert!((between / 100.0 - 1.0).abs() < 0.15, "{between}");
        assert!(gaps.iter().all(|[from, to]| (4.0..=12.0).contains(&(to - from))));
        assert!(gaps[0][0] > 2000.0 && gaps[gaps.len() - 1][1] < 38_000.0);
    }
}
