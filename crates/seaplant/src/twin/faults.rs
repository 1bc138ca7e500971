//! What goes wrong between a motion and its log: smoothing, spikes, gaps, wrong stamps.

use nalgebra::Vector3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::Exp1;

use super::motion::STEP_S;
use super::random::Streams;
use super::{Disturbance, DisturbanceStrength, STEPS_PER_TICK, TICK_HZ, TwinSpec};
use crate::{Error, Timed};

/// Gaps stay this part of a trial away from its ends, so that no log begins or ends with one.
const WHOLE_ENDS: f64 = 0.05;
/// The most that a stamp errs, as a part of the time between two.
const MOST_JITTER_OF_PERIOD: f64 = 0.45;

/// What is wrong with the readings of one trial.
pub(super) struct Faults<'a> {
    spec: &'a TwinSpec,
    streams: &'a Streams<'a>,
    duration_s: f64,
}

impl<'a> Faults<'a> {
    pub(super) fn of(spec: &'a TwinSpec, streams: &'a Streams<'a>, ticks: usize) -> Self {
        Self { spec, streams, duration_s: ticks as f64 / TICK_HZ }
    }

    fn strength(&self) -> &DisturbanceStrength {
        &self.spec.strength
    }

    /// Whether the DVL sees the past as well as the present.
    pub(super) fn smooths(&self) -> bool {
        self.spec.has(Disturbance::VelocityAveraging) || self.spec.has(Disturbance::VelocityLag)
    }

    /// What the DVL makes of the velocity at every step, at every tick: the mean of the past,
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

    /// What the DVL multiplies velocity by.
    pub(super) fn dvl_scale(&self) -> f64 {
        1.0 + self.spec.strength_of(Disturbance::DvlScale, self.strength().dvl_scale_error)
    }

    /// Adds spikes to samples of the DVL: to all axes at once.
    pub(super) fn spike_dvl(&self, axes: &mut [Vec<f64>; 3]) {
        let mut rng = self.streams.of("dvl spikes");
        let samples = axes[0].len();
        for sample in self.struck(&mut rng, samples) {
            for axis in axes.iter_mut() {
                axis[sample] += self.strength().spike_m_s * rng.random_range(-1.0..=1.0);
            }
        }
    }

    /// Adds drift and spikes to headings, one each tick, rad.
    pub(super) fn mislead_compass(&self, heading: &mut [f64]) {
        let drift = self
            .spec
            .strength_of(Disturbance::HeadingDrift, self.strength().heading_drift_deg_min)
            .to_radians()
            / 60.0;
        heading.iter_mut().enumerate().for_each(|(tick, x)| *x += drift * tick as f64 / TICK_HZ);
        let mut rng = self.streams.of("heading spikes");
        let most = self.strength().spike_heading_deg.to_radians();
        for sample in self.struck(&mut rng, heading.len()) {
            heading[sample] += most * rng.random_range(-1.0..=1.0);
        }
    }

    /// The samples that are spikes.
    fn struck(&self, rng: &mut ChaCha8Rng, samples: usize) -> Vec<usize> {
        let part = self.spec.strength_of(Disturbance::Spikes, self.strength().spike_part);
        (0..samples).filter(|_| rng.random_bool(part)).collect()
    }

    /// The series of one instrument, which share their times, as they are logged: without what
    /// falls into gaps of this kind of disturbance, and by stamps that may be off.
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
        let silent = match gaps.filter(|disturbance| self.spec.has(*disturbance)) {
            Some(_) => self.gaps(instrument),
            None => Vec::new(),
        };
        let heard = |t: &f64| !silent.iter().any(|[from, to]| (from..to).contains(&t));
        let keep: Vec<bool> = time_s.iter().map(heard).collect();
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

    /// When an instrument is silent, s.
    fn gaps(&self, instrument: &str) -> Vec<[f64; 2]> {
        let mut rng = self.streams.of(&format!("{instrument} gaps"));
        let DisturbanceStrength { gap_s, gap_interval_s, .. } = *self.strength();
        let (mut t, last) = (WHOLE_ENDS * self.duration_s, (1.0 - WHOLE_ENDS) * self.duration_s);
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

    /// The stamps of samples that were taken at these times, s; none precedes the trial.
    fn stamped(&self, instrument: &str, time_s: &[f64]) -> Vec<f64> {
        let most = self.spec.strength_of(Disturbance::StampJitter, self.strength().stamp_jitter_s);
        if most == 0.0 {
            return time_s.to_vec();
        }
        // Stamps of a fast instrument must not change places either.
        let apart_s = time_s.get(1).map_or(f64::INFINITY, |second| second - time_s[0]);
        let most = most.min(MOST_JITTER_OF_PERIOD * apart_s);
        let mut rng = self.streams.of(&format!("{instrument} stamps"));
        let off = |t: &f64| (t + most * rng.random_range(-1.0..=1.0)).max(0.0);
        time_s.iter().map(off).collect()
    }

    /// In how many ticks propeller speed is logged once.
    pub(super) fn ticks_per_speed(&self) -> usize {
        if self.spec.has(Disturbance::SlowThrustLog) {
            (TICK_HZ * self.strength().thrust_log_s).round() as usize
        } else {
            1
        }
    }
}

/// The mean of the past `window_s` at every step, by the trapezoidal rule; before that much
/// has passed, of all of it.
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

/// A first-order lag of velocity that is linear within each step; at the start it has settled.
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

    /// Rounding, and nothing else, m/s.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn the_mean_of_a_ramp_is_half_a_window_late() {
        let ramp = averaged(&along_x(|t| 0.3 * t, 200), 1.0);
        for (step, v) in ramp.iter().enumerate().skip(50) {
            let t = step as f64 * STEP_S;
            assert!((v.x - 0.3 * (t - 0.5)).abs() < ROUNDING, "{t} s: {}", v.x);
        }
        assert!((ramp[20].x - 0.3 * 0.2).abs() < ROUNDING, "of what has passed");
    }

    #[test]
    fn a_second_of_mean_leaves_no_sine_of_one_second() {
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
    fn gaps_have_their_length_and_distance_and_spare_both_ends() {
        let spec = TwinSpec {
            disturbances: [Disturbance::Dropouts].into(),
            duration_s: 40_000.0,
            ..TwinSpec::jason2()
        };
        let streams = Streams { seed: 1, trial: "surge 1" };
        let gaps = Faults::of(&spec, &streams, 400_000).gaps("dvl");
        // 370 gaps: their mean distance is known to 5 %, and half a length's spread to 2 %.
        let mean = |of: &mut dyn Iterator<Item = f64>, n: usize| of.sum::<f64>() / n as f64;
        let length = mean(&mut gaps.iter().map(|[from, to]| to - from), gaps.len());
        let between = mean(&mut gaps.windows(2).map(|w| w[1][0] - w[0][1]), gaps.len() - 1);
        assert!((length / 8.0 - 1.0).abs() < 0.06, "{length}");
        assert!((between / 100.0 - 1.0).abs() < 0.15, "{between}");
        assert!(gaps.iter().all(|[from, to]| (4.0..=12.0).contains(&(to - from))));
        assert!(gaps[0][0] > 2000.0 && gaps[gaps.len() - 1][1] < 38_000.0);
    }
}
