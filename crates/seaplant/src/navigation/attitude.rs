//! Attitude and its derivative, angular velocity.

use std::f64::consts::{PI, TAU};

use nalgebra::{Rotation3, Vector3};

use super::Recording;
use super::turns::Turns;
use crate::quantity::{Attitude, Axis};
use crate::series::{Cutter, Reader};
use crate::signal::{LowPass, differentiate, resample, rms, sample_noise, uniform_stretches};
use crate::{Dof, Error, Gap, Grid, Quantity, Sensors, Timed};

/// Cutoff frequencies of the low-pass filter before an angle is differentiated, Hz: the best is chosen.
const CUTOFFS_HZ: [f64; 8] = [0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0];

/// Order of that filter.
const ORDER: usize = 2;

/// Beyond these, rad, roll or pitch has another unit or is another quantity.
const MOST_ROLL: f64 = 2.0 * std::f64::consts::PI;
const MOST_PITCH: f64 = 1.75;

/// Attitude over time; an angle that was not logged is zero.
pub(super) struct AttitudeRecord {
    roll: Option<Timed>,
    pitch: Option<Timed>,
    pub(super) heading: Option<Timed>,
    /// Gaps of heading across which the number of turns is unknown.
    pub(super) cuts: Vec<Gap>,
    sensor_to_body: Rotation3<f64>,
}

impl AttitudeRecord {
    /// Removes the attitude channels from a recording.
    pub(super) fn take(recording: &mut Recording, sensors: &Sensors) -> Self {
        let heading = recording.remove(&Quantity::Attitude(Attitude::Heading));
        let rates = [Quantity::Rate(Axis::Z), Quantity::Velocity(Dof::Yaw)];
        let rate = rates.iter().find_map(|rate| recording.get(rate));
        let turns = heading.map(|heading| Turns::count(&heading, rate));
        let mut angle =
            |which| recording.remove(&Quantity::Attitude(which)).map(|angle| unwrap(&angle));
        let (roll, pitch) = (angle(Attitude::Roll), angle(Attitude::Pitch));
        let (heading, cuts) = turns.map(|turns| (turns.heading, turns.cuts)).unzip();
        let (cuts, sensor_to_body) = (cuts.unwrap_or_default(), sensors.attitude.to_body());
        Self { roll, pitch, heading, cuts, sensor_to_body }
    }

    /// Returns roll, pitch and heading.
    pub(super) fn parts(&self) -> [&Option<Timed>; 3] {
        [&self.roll, &self.pitch, &self.heading]
    }

    pub(super) fn is_empty(&self) -> bool {
        self.parts().iter().all(|part| part.is_none())
    }

    /// Returns whether roll or pitch was measured and is plausible.
    pub(super) fn knows_tilt(&self) -> bool {
        let within = |angle: &Option<Timed>, most: f64| {
            angle.iter().all(|angle| angle.values().iter().all(|x| x.abs() <= most))
        };
        let is_sane = within(&self.roll, MOST_ROLL) && within(&self.pitch, MOST_PITCH);
        is_sane && (self.roll.is_some() || self.pitch.is_some())
    }

    /// Returns readers of roll and pitch for times that never decrease.
    pub(super) fn tilt_reader(&self) -> [Option<Reader<'_>>; 2] {
        [&self.roll, &self.pitch].map(|angle| angle.as_ref().map(Timed::reader))
    }

    /// Returns a reader of the attitude for times that never decrease.
    pub(super) fn reader(&self) -> AttitudeReader<'_> {
        AttitudeReader {
            angles: self.parts().map(|angle| angle.as_ref().map(Timed::reader)),
            body_to_sensor: self.sensor_to_body.inverse(),
        }
    }

    /// Computes the angular velocity of the body in body axes, rad/s, on the times of the attitude
    /// channel with most samples; `None` without attitude.
    pub(super) fn body_rates(&self) -> Result<Option<[Timed; 3]>, Error> {
        let longest = self.parts().into_iter().flatten().max_by_key(|angle| angle.len());
        let Some(longest) = longest.filter(|angle| angle.len() > 2) else { return Ok(None) };
        let grids = self.grids(longest)?;
        if grids.is_empty() {
            return Ok(None);
        }
        let heading_rate = AngleOn::new(self.heading.as_ref(), &grids)?.slope;
        let AngleOn { angle: pitch, slope: pitch_rate } =
            AngleOn::new(self.pitch.as_ref(), &grids)?;
        let AngleOn { angle: roll, slope: roll_rate } = AngleOn::new(self.roll.as_ref(), &grids)?;
        let [mut p, mut q, mut r] = [roll_rate, pitch_rate, heading_rate];
        // The slopes of the angles are overwritten by the body's rates one by one.
        let slopes = p.iter_mut().zip(&mut q).zip(&mut r);
        for (((p, q), r), (roll, pitch)) in slopes.zip(roll.iter().zip(&pitch)) {
            let (roll_slope, pitch_slope, heading_slope) = (*p, *q, *r);
            let sensor = Vector3::new(
                roll_slope - heading_slope * pitch.sin(),
                pitch_slope * roll.cos() + heading_slope * pitch.cos() * roll.sin(),
                -pitch_slope * roll.sin() + heading_slope * pitch.cos() * roll.cos(),
            );
            let body = self.sensor_to_body * sensor;
            (*p, *q, *r) = (body.x, body.y, body.z);
        }
        drop((roll, pitch));
        let p = match &grids[..] {
            [whole] => Timed::on_grid("angular rate", *whole, p)?,
            _ => Timed::new(
                "angular rate",
                grids.iter().flat_map(Grid::times).collect::<Vec<f64>>(),
                p,
            )?,
        };
        let q = p.with_values("angular rate", q)?;
        let r = p.with_values("angular rate", r)?;
        Ok(Some([p, q, r]))
    }

    /// Returns grids over an angle's samples, without its gaps and cuts.
    fn grids(&self, angle: &Timed) -> Result<Vec<Grid>, Error> {
        let (mut grids, mut from_s) = (Vec::new(), angle.first_s());
        let ends = self.cuts.iter().map(|cut| (cut.from_s, cut.to_s));
        for (to_s, next_s) in ends.chain([(angle.last_s(), angle.last_s())]) {
            if let Some(part) = angle.window(from_s, to_s) {
                let found = uniform_stretches(&part, angle.period_s(), LEAST_INSTANTS)?.stretches;
                grids.extend(found.iter().map(|stretch| stretch.grid));
            }
            from_s = next_s;
        }
        Ok(grids)
    }
}

/// Two instants determine a slope, a third confirms it.
const LEAST_INSTANTS: usize = 3;

/// A smoothed angle on consecutive grids, and the part of its slope that is motion.
struct AngleOn {
    angle: Vec<f64>,
    slope: Vec<f64>,
}

impl AngleOn {
    fn new(angle: Option<&Timed>, grids: &[Grid]) -> Result<Self, Error> {
        let len = grids.iter().map(|grid| grid.len).sum();
        let Some(samples) = angle else {
            return Ok(Self { angle: vec![0.0; len], slope: vec![0.0; len] });
        };
        let period_s = grids.first().map_or(0.0, |grid| grid.period_s);
        let noise = sample_noise([samples]).unwrap_or(0.0);
        let part = |grid: &Grid| {
            let (from_s, to_s) = (grid.start_s, grid.time(grid.len - 1));
            resample(&Cutter::default().around(samples, (from_s, to_s)), *grid)
        };
        let longest = grids.iter().max_by_key(|grid| grid.len).map(part).transpose()?;
        let filter = rate_filter(&longest.unwrap_or_default(), noise, period_s);
        let mut found = Self { angle: Vec::new(), slope: Vec::new() };
        for grid in grids {
            let mut x = part(grid)?;
            // An angle too short or too slow for the filter stays unfiltered.
            if let Some(filter) = filter {
                let _ = filter.zero_phase_in_place(&mut x, 1.0 / grid.period_s);
            }
            append(&mut found.slope, differentiate(&x, grid.period_s)?);
            append(&mut found.angle, x);
        }
        let gain = |f| filter.map_or(1.0, |filter| sampled_gain(&filter, f, period_s));
        let noise = noise * noise * noise_of_slope(period_s, |f| gain(f).powi(2));
        let believed = believed_part(noise, &found.slope);
        found.slope.iter_mut().for_each(|slope| *slope *= believed);
        Ok(found)
    }
}

/// Returns the filter whose slope of an angle is probably nearest to the true one; `None` if the angle is too short
/// or too slow.
///
/// With smoothing S, differentiation D and an angle y that has white noise σ, Stein's unbiased estimate of the squared
/// error is `|D S y − D y|² + 2 σ² tr(Dᵀ D S)`, less a number that is the same for all S.
///
/// # Source
/// [Stein1981]
fn rate_filter(y: &[f64], noise: f64, period_s: f64) -> Option<LowPass> {
    let raw = differentiate(y, period_s).ok()?;
    let error = |filter: &LowPass| {
        let smooth = differentiate(&filter.zero_phase(y, 1.0 / period_s).ok()?, period_s).ok()?;
        let lost: f64 = smooth.iter().zip(&raw).map(|(a, b)| (a - b).powi(2)).sum();
        let trace = noise_of_slope(period_s, |f| sampled_gain(filter, f, period_s));
        Some(lost + 2.0 * noise * noise * trace * y.len() as f64)
    };
    let filters =
        CUTOFFS_HZ.iter().map(|cutoff_hz| LowPass { cutoff_hz: *cutoff_hz, order: ORDER });
    let errors = filters.filter_map(|filter| Some((error(&filter)?, filter)));
    errors.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, filter)| filter)
}

/// Returns the gain of a sampled zero-phase filter, whose frequencies are those of the analogue one, warped.
fn sampled_gain(filter: &LowPass, frequency_hz: f64, period_s: f64) -> f64 {
    let warped = |hz: f64| (PI * hz * period_s).tan();
    let cutoff_hz = warped(filter.cutoff_hz);
    LowPass { cutoff_hz, ..*filter }.zero_phase_gain(warped(frequency_hz))
}

/// Returns the mean square of the slope, by central differences, of white noise of variance one whose power is
/// weighted by frequency, 1/s²: `2h ∫ sin²(2π f h) / h² · w(f) df` from 0 to 1/(2h).
fn noise_of_slope(period_s: f64, weight: impl Fn(f64) -> f64) -> f64 {
    const POINTS: usize = 256;
    let at = |k: usize| {
        let cycles = 0.5 * (k as f64 + 0.5) / POINTS as f64;
        (TAU * cycles).sin().powi(2) * weight(cycles / period_s)
    };
    (0..POINTS).map(at).sum::<f64>() / (POINTS as f64 * period_s * period_s)
}

/// Appends a part; most records consist of one, which needs no copy.
fn append(all: &mut Vec<f64>, part: Vec<f64>) {
    if all.is_empty() {
        *all = part;
    } else {
        all.extend(part);
    }
}

/// Returns the part of a smoothed angle's slope that is motion rather than sensor noise: `1 −
/// noise / slope²` of mean squares, the gain of a Wiener filter.
///
/// Without it, a vehicle that hardly turns would get the attitude sensor's noise times its lever
/// arm as velocity.
fn believed_part(noise: f64, slope: &[f64]) -> f64 {
    let slope = rms(slope).powi(2);
    if slope > noise { 1.0 - noise / slope } else { 0.0 }
}

/// A reader of the attitude at times that never decrease.
pub(super) struct AttitudeReader<'a> {
    angles: [Option<Reader<'a>>; 3],
    body_to_sensor: Rotation3<f64>,
}

impl AttitudeReader<'_> {
    /// Returns the rotation from body to world.
    pub(super) fn at(&mut self, t_s: f64) -> Rotation3<f64> {
        let [roll, pitch, heading] =
            self.angles.each_mut().map(|angle| angle.as_mut().map_or(0.0, |angle| angle.at(t_s)));
        Rotation3::from_euler_angles(roll, pitch, heading) * self.body_to_sensor
    }
}

/// Removes the jumps of whole turns from an angle, rad.
pub(crate) fn unwrap(angle: &Timed) -> Timed {
    let is_jump = |pair: &[f64]| ((pair[1] - pair[0]) / TAU).round() != 0.0;
    if !angle.values().windows(2).any(is_jump) {
        return angle.clone();
    }
    let mut turns = 0.0;
    let mut before = angle.values()[0];
    let unwrapped = angle.values().iter().map(|&x| {
        turns -= ((x - before) / TAU).round();
        before = x;
        x + turns * TAU
    });
    let unwrapped = unwrapped.collect();
    // Finite angles stay finite, and the times are the same.
    angle.with_values("angle", unwrapped).unwrap_or_else(|_| angle.clone())
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::random::normal;

    /// An angle of 10 Hz that swings at a frequency, with noise of 2 mrad.
    fn angle(frequency_hz: f64, amplitude: f64) -> (Timed, Vec<f64>) {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let time_s: Vec<f64> = (0..6000).map(|k| 0.1 * f64::from(k)).collect();
        let phase = |t: &f64| TAU * frequency_hz * t;
        let mut noisy = |t: &f64| amplitude * phase(t).sin() + 2e-3 * normal(&mut random);
        let values: Vec<f64> = time_s.iter().map(&mut noisy).collect();
        let slope = time_s.iter().map(|t| amplitude * TAU * frequency_hz * phase(t).cos());
        (Timed::new("pitch", time_s.clone(), values).expect("in order"), slope.collect())
    }

    fn grid(angle: &Timed) -> Grid {
        Grid { start_s: 0.0, period_s: 0.1, len: angle.len() }
    }

    /// Root mean square error of a slope, relative to the true one.
    fn error(found: &[f64], slope: &[f64]) -> f64 {
        rms(found.iter().zip(slope).map(|(a, b)| a - b)) / rms(slope)
    }

    #[test]
    fn a_fast_swing_and_a_slow_turn_keep_their_rates() {
        let of = |frequency_hz, amplitude| {
            let (measured, slope) = angle(frequency_hz, amplitude);
            let found = AngleOn::new(Some(&measured), &[grid(&measured)]).expect("long").slope;
            let fixed = LowPass { cutoff_hz: 1.0, order: ORDER };
            let fixed = fixed.zero_phase(measured.values(), 10.0).expect("long");
            let fixed = differentiate(&fixed, 0.1).expect("long");
            (error(&found, &slope), error(&fixed, &slope))
        };
        let (fast, at_1_hz) = of(0.9, 5e-3);
        assert!(fast < 0.33 && fast < 0.8 * at_1_hz, "{fast}, and {at_1_hz} by a filter of 1 Hz");
        let (slow, _) = of(0.05, 0.1);
        assert!(slow < 0.1, "{slow}");
    }

    #[test]
    fn noise_has_no_rate() {
        let (measured, _) = angle(0.0, 0.0);
        let found = AngleOn::new(Some(&measured), &[grid(&measured)]).expect("long").slope;
        assert!(rms(&found) < 2e-4, "{}", rms(&found));
    }

    #[test]
    fn a_heading_past_north_continues() {
        let measured = Timed::new("heading", vec![0.0, 1.0, 2.0], vec![6.2, 0.1, 0.3]);
        let heading = unwrap(&measured.expect("in order"));
        for (found, expected) in heading.values().iter().zip([6.2, 0.1 + TAU, 0.3 + TAU]) {
            assert!((found - expected).abs() < 1e-12, "{found} and {expected}");
        }
    }
}
