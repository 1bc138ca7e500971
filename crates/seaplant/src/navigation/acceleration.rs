//! Conversion of accelerometer readings to acceleration of the vehicle's origin.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::Vector3;

use super::attitude::AttitudeRecord;
use super::gravity::Gravity;
use super::{AXES, TRANSLATIONS};
use crate::series::Reader;
use crate::{Caveat, CaveatCode, Dof, Error, Quantity, Recording, Sensors, Timed};

/// Acceleration of the vehicle's origin along one body axis, as means over windows of time.
///
/// An accelerometer at r measures the specific force `f = ν̇ + ω × v + ω̇ × r + ω × (ω × r) − Rᵀ
/// g`. The result is `ν̇`, plus `ω × v` where other velocities were not measured, m/s²; the mean of
/// ω̇ over a window is the change of ω in it, so that no rate is differentiated.
#[derive(Clone, Debug, PartialEq)]
pub struct MeanAcceleration {
    /// The mean over each window, at the window's end, m/s².
    pub mean: Timed,
    /// Start of each window, s; shape (n,). Windows do not overlap.
    pub from_s: Arc<[f64]>,
}

/// One window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MeanOver {
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
    /// m/s².
    pub(crate) mean: f64,
}

impl MeanAcceleration {
    /// Returns the means whose windows lie within a span, s.
    pub(crate) fn window(&self, from_s: f64, to_s: f64) -> Option<Self> {
        let first = self.from_s.partition_point(|t| *t < from_s);
        let last = self.mean.time_s().partition_point(|t| *t <= to_s);
        let rows = first..last.max(first);
        let time_s = self.mean.time_s()[rows.clone()].to_vec();
        let mean = Timed::new("acceleration", time_s, self.mean.values()[rows.clone()].to_vec());
        Some(Self { mean: mean.ok()?, from_s: self.from_s[rows].into() })
    }

    /// Returns all means in order of time.
    pub(crate) fn windows(&self) -> impl Iterator<Item = MeanOver> + '_ {
        let ends = self.mean.time_s().iter().zip(self.mean.values());
        let all = self.from_s.iter().zip(ends);
        all.map(|(&from_s, (&to_s, &mean))| MeanOver { from_s, to_s, mean })
    }
}

/// Readings of an accelerometer.
pub(super) struct Accelerometer {
    /// Specific force along its own axes, m/s².
    channels: [Option<Timed>; 3],
}

/// Faster logs are averaged over this time, s: vehicles and propellers respond more slowly.
pub(super) const LONGEST_MEAN_S: f64 = 0.1;

/// A step longer than this many median ones is a gap.
const GAP_STEPS: f64 = 2.5;

/// Rates above this, rad/s rms, add significant products with the other velocities to the readings.
const TURNING: f64 = 0.2;

impl Accelerometer {
    pub(super) fn take(recording: &mut Recording) -> Self {
        Self { channels: AXES.map(|axis| recording.remove(&Quantity::Acceleration(axis))) }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.channels.iter().all(Option::is_none)
    }

    /// Computes acceleration along a translation; `None` if the axes that it needs were not logged.
    ///
    /// # Errors
    /// [`Error::MissingChannel`] without the tilt that separates gravity from acceleration;
    /// [`Error::Accelerometer`] if readings are not those of an accelerometer.
    pub(super) fn along(
        &self,
        dof: Dof,
        trial: &str,
        sensors: &Sensors,
        attitude: &AttitudeRecord,
        around: &Around<'_>,
        caveats: &mut Vec<Caveat>,
    ) -> Result<Option<MeanAcceleration>, Error> {
        let Some(row) = TRANSLATIONS.iter().position(|one| *one == dof) else { return Ok(None) };
        let Some(force) = self.body_force(row, sensors)? else { return Ok(None) };
        let down = self.body_down(sensors, attitude, &force)?;
        let gravity = Gravity::detect(dof, trial, &force, down.as_ref(), attitude, caveats)?;
        let lever = sensors.imu.position_body;
        caveats.extend(self.doubts(trial, lever, around));
        let mut turned = RotationTerms::new(around, lever, row);
        let mut tilt = attitude.reader();
        let own = |(&t_s, &f): (&f64, &f64)| {
            let down = tilt.at(t_s).inverse() * Vector3::z();
            f + gravity.g() * down[row] - turned.centripetal(t_s) + turned.rigid_body_term(t_s)
        };
        let samples: Vec<f64> = force.time_s().iter().zip(force.values()).map(own).collect();
        let blocks = blocks(force.time_s(), sensors.imu_averages, around.longest_s);
        let mut rates = RotationTerms::new(around, lever, row);
        let (mut ends, mut from, mut means) = (Vec::new(), Vec::new(), Vec::new());
        for Block { rows, from_s, to_s } in blocks {
            let mean = samples[rows.clone()].iter().sum::<f64>() / rows.len() as f64;
            ends.push(to_s);
            from.push(from_s);
            means.push(mean - rates.tangential(from_s, to_s));
        }
        let mean = Timed::new("acceleration", ends, means)?;
        Ok(Some(MeanAcceleration { mean, from_s: from.into() }))
    }

    /// Returns specific force along a body axis, at the samples of the first channel that it needs.
    fn body_force(&self, row: usize, sensors: &Sensors) -> Result<Option<Timed>, Error> {
        let r_bs = sensors.imu.to_body();
        let needed: Vec<usize> = (0..3).filter(|&k| r_bs[(row, k)].abs() > ALIGNED).collect();
        let mut parts = Vec::new();
        for &k in &needed {
            let Some(channel) = &self.channels[k] else { return Ok(None) };
            parts.push((r_bs[(row, k)], channel));
        }
        let Some(&(_, base)) = parts.first() else { return Ok(None) };
        let mut readers: Vec<(f64, Reader<'_>)> =
            parts.iter().map(|(weight, series)| (*weight, series.reader())).collect();
        let at = |&t: &f64| readers.iter_mut().map(|(weight, x)| *weight * x.at(t)).sum();
        let values = base.time_s().iter().map(at).collect();
        base.with_values("acceleration", values).map(Some)
    }

    /// Returns specific force along the world's down, at the samples of another series; `None`
    /// unless all three axes were logged.
    fn body_down(
        &self,
        sensors: &Sensors,
        attitude: &AttitudeRecord,
        like: &Timed,
    ) -> Result<Option<Timed>, Error> {
        let [Some(x), Some(y), Some(z)] = &self.channels else { return Ok(None) };
        let mut readers = [x.reader(), y.reader(), z.reader()];
        let (r_bs, mut tilt) = (sensors.imu.to_body(), attitude.reader());
        let at = |&t: &f64| {
            let felt = Vector3::from_iterator(readers.iter_mut().map(|reader| reader.at(t)));
            (tilt.at(t) * (r_bs * felt)).z
        };
        like.with_values("acceleration", like.time_s().iter().map(at).collect()).map(Some)
    }

    fn doubts(&self, trial: &str, lever: Vector3<f64>, around: &Around<'_>) -> Vec<Caveat> {
        let mut doubts = Vec::new();
        let warn = |message| Caveat::warning(CaveatCode::Navigation, message);
        if lever.norm() > 0.0 && around.rates.is_none() {
            doubts.push(warn("the accelerometer has a lever arm but the log has neither attitude nor rates: what turning adds to its readings is not removed; map rate.roll, .pitch and .yaw".to_owned()));
        }
        let channels = self.channels.iter().zip(AXES);
        for (channel, axis) in channels {
            let Some(part) = channel.as_ref().and_then(clipped) else { continue };
            doubts.push(Caveat::warning(
                CaveatCode::ClippedAccelerometer,
                format!(
                    "trial `{trial}`: {} reaches the limit of its range in {:.1} % of its samples: vibration or shocks are clipped there, which shifts the mean; set a wider range, or mount the instrument softly",
                    Quantity::Acceleration(axis),
                    100.0 * part
                ),
            ));
        }
        doubts
    }
}

/// Axes with a smaller scalar product are orthogonal.
const ALIGNED: f64 = 1e-9;

/// Other data over the accelerometer's record.
pub(super) struct Around<'a> {
    /// ω, rad/s.
    pub(super) rates: Option<&'a [Timed; 3]>,
    /// −(ω × v) along the axis, m/s².
    pub(super) turning: Option<&'a Timed>,
    /// Longest averaging time, s.
    pub(super) longest_s: f64,
}

impl Around<'_> {
    /// Returns a caveat where the vehicle turned at unknown speed.
    pub(super) fn unknown_turning(&self, trial: &str, dof: Dof) -> Option<Caveat> {
        let yaw = &self.rates?[2];
        let square = yaw.values().iter().map(|r| r * r).sum::<f64>() / yaw.len() as f64;
        let rms = square.sqrt();
        (self.turning.is_none() && rms > TURNING).then(|| {
            let message = format!(
                "trial `{trial}`: the vehicle turns at {rms:.2} rad/s rms, and the accelerometer feels the product of that with the speed across {dof}, which was not measured; drive straight, or one axis at a time"
            );
            Caveat::warning(CaveatCode::CoupledAxes, message)
        })
    }
}

/// Contributions of rotation to the readings of an instrument away from the origin.
struct RotationTerms<'a> {
    rates: Option<[Reader<'a>; 3]>,
    turning: Option<Reader<'a>>,
    lever: Vector3<f64>,
    row: usize,
}

impl<'a> RotationTerms<'a> {
    fn new(around: &Around<'a>, lever: Vector3<f64>, row: usize) -> Self {
        let rates = around.rates.filter(|_| lever.norm() > 0.0);
        let rates = rates.map(|rates| rates.each_ref().map(Timed::reader));
        Self { rates, turning: around.turning.map(Timed::reader), lever, row }
    }

    fn omega(&mut self, t_s: f64) -> Option<Vector3<f64>> {
        let rates = self.rates.as_mut()?;
        Some(Vector3::from_iterator(rates.iter_mut().map(|rate| rate.at(t_s))))
    }

    /// Returns ω × (ω × r).
    fn centripetal(&mut self, t_s: f64) -> f64 {
        let lever = self.lever;
        self.omega(t_s).map_or(0.0, |omega| omega.cross(&omega.cross(&lever))[self.row])
    }

    /// Returns the mean of ω̇ × r.
    fn tangential(&mut self, from_s: f64, to_s: f64) -> f64 {
        let (before, after) = (self.omega(from_s), self.omega(to_s));
        let (lever, row) = (self.lever, self.row);
        let of = |(a, b): (Vector3<f64>, Vector3<f64>)| (b - a).cross(&lever)[row];
        before.zip(after).map_or(0.0, of) / (to_s - from_s)
    }

    /// Returns −(ω × v).
    fn rigid_body_term(&mut self, t_s: f64) -> f64 {
        self.turning.as_mut().map_or(0.0, |turning| turning.at(t_s))
    }
}

/// Samples that are averaged, and the time interval of their mean.
#[derive(Clone, Debug, PartialEq)]
struct Block {
    rows: Range<usize>,
    from_s: f64,
    to_s: f64,
}

/// Groups samples into blocks of at most `longest_s`.
///
/// A sample represents the time up to the midpoints to its neighbours; one that is already a mean,
/// the time since the sample before.
fn blocks(time_s: &[f64], averages: bool, longest_s: f64) -> Vec<Block> {
    let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let Some(period_s) = crate::series::median(&mut steps) else { return Vec::new() };
    let size = ((longest_s / period_s + 1e-6).floor() as usize).max(1);
    let half_s = 0.5 * period_s.min(LONGEST_MEAN_S);
    let is_near = |k: usize| time_s[k] - time_s[k - 1] < GAP_STEPS * period_s;
    let joins = |k: usize| is_near(k) && (averages || period_s <= LONGEST_MEAN_S);
    let edge_after = |k: usize| match (averages, k + 1 < time_s.len() && joins(k + 1)) {
        (true, _) => time_s[k],
        (false, true) => 0.5 * (time_s[k] + time_s[k + 1]),
        (false, false) => time_s[k] + half_s,
    };
    let edge_before = |k: usize| match (averages, k > 0 && joins(k)) {
        (_, true) => edge_after(k - 1),
        (true, false) => time_s[k] - period_s,
        (false, false) => time_s[k] - half_s,
    };
    let mut blocks = Vec::new();
    let mut first = 0;
    for k in 0..time_s.len() {
        let ends = k + 1 == time_s.len() || !is_near(k + 1) || k + 1 - first == size;
        if ends {
            let (from_s, to_s) = (edge_before(first), edge_after(k));
            blocks.push(Block { rows: first..k + 1, from_s, to_s });
            first = k + 1;
        }
    }
    blocks
}

/// Least number of samples at an end of the range that indicates clipping …
const LEAST_CLIPPED: usize = 5;
/// … and its least ratio to the number in the next bin of the same width, a hundredth of the range.
const MORE_THAN_BELOW: usize = 3;

/// Returns the fraction of samples at an end of an accelerometer's range; `None` if none are
/// clipped.
fn clipped(series: &Timed) -> Option<f64> {
    let values = series.values();
    let fold = |of: fn(f64, f64) -> f64, from| values.iter().copied().fold(from, of);
    let (low, high) = (fold(f64::min, f64::INFINITY), fold(f64::max, f64::NEG_INFINITY));
    let step = 0.01 * (high - low);
    let within = |from: f64, to: f64| values.iter().filter(|x| (from..=to).contains(*x)).count();
    let tiny = 1e-3 * step;
    let at_end = |end: f64, inwards: f64| {
        let here = within(end - tiny, end + tiny);
        let (a, b) = (end + 2.0 * tiny * inwards, end + step * inwards);
        let below = within(a.min(b), a.max(b));
        if here >= LEAST_CLIPPED && here > MORE_THAN_BELOW * below { here } else { 0 }
    };
    let count = at_end(low, 1.0) + at_end(high, -1.0);
    (count > 0 && step > 0.0).then(|| count as f64 / values.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_instant_represents_the_time_around_it_and_a_mean_the_time_before() {
        let time_s: Vec<f64> = (0..10).map(|k| 0.02 * f64::from(k)).collect();
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        let instant = blocks(&time_s, false, LONGEST_MEAN_S);
        assert_eq!(instant.len(), 2);
        close(instant[0].from_s, -0.01);
        close(instant[0].to_s, 0.09);
        close(instant[1].from_s, 0.09);
        let means = blocks(&time_s, true, LONGEST_MEAN_S);
        close(means[0].from_s, -0.02);
        close(means[0].to_s, 0.08);
        close(means[1].to_s, 0.18);
    }

    #[test]
    fn a_slow_instant_represents_little_time_and_a_gap_none() {
        let slow = blocks(&[0.0, 0.25, 0.5], false, LONGEST_MEAN_S);
        assert_eq!((slow[1].from_s, slow[1].to_s), (0.2, 0.3));
        let gap = blocks(&[0.0, 0.1, 0.2, 5.0, 5.1], false, LONGEST_MEAN_S);
        assert!((gap[2].to_s - 0.25).abs() < 1e-12 && (gap[3].from_s - 4.95).abs() < 1e-12);
    }

    #[test]
    fn detects_a_range_that_clips_and_not_noise() {
        let noise =
            |k: i32| (f64::from(k) * 0.618_034).fract() + (f64::from(k) * 0.754_877).fract();
        let series = |of: &dyn Fn(f64) -> f64| {
            let values: Vec<f64> = (0..3000).map(|k| of(noise(k) - 1.0)).collect();
            let time_s: Vec<f64> = (0..3000).map(|k| 0.02 * f64::from(k)).collect();
            Timed::new("acceleration", time_s, values).expect("valid")
        };
        assert_eq!(clipped(&series(&|x| x)), None);
        assert_eq!(clipped(&series(&|x| (x * 100.0).round() / 100.0)), None);
        let part = clipped(&series(&|x| x.clamp(-0.8, 0.8))).expect("cut");
        assert!((0.02..0.06).contains(&part), "{part}");
    }
}
