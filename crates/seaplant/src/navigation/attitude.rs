//! Attitude and its derivative, angular velocity.

use nalgebra::{Rotation3, Vector3};

use super::Recording;
use super::turns::Turns;
use crate::quantity::{Attitude, Axis};
use crate::series::{Cutter, Reader};
use crate::signal::{LowPass, differentiate, resample, rms, sample_noise, uniform_stretches};
use crate::{Dof, Error, Gap, Grid, Quantity, Sensors, Timed};

/// Rates for the lever arm are derived from attitude below this frequency: above it, the attitude
/// sensor's noise dominates.
const RATE_FILTER: LowPass = LowPass { cutoff_hz: 1.0, order: 2 };

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
        let mut found = Self { angle: Vec::new(), slope: Vec::new() };
        for grid in grids {
            let (from_s, to_s) = (grid.start_s, grid.time(grid.len - 1));
            let mut x = resample(&Cutter::default().around(samples, (from_s, to_s)), *grid)?;
            // An angle too short or too slow for the filter stays unfiltered.
            let _ = RATE_FILTER.zero_phase_in_place(&mut x, 1.0 / grid.period_s);
            append(&mut found.slope, differentiate(&x, grid.period_s)?);
            append(&mut found.angle, x);
        }
        let period_s = grids.first().map_or(0.0, |grid| grid.period_s);
        let believed = believed_part(samples, &found.slope, period_s);
        found.slope.iter_mut().for_each(|slope| *slope *= believed);
        Ok(found)
    }
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
/// (noise / slope)²` of root mean squares, the gain of a Wiener filter.
///
/// Without it, a vehicle that hardly turns would get the attitude sensor's noise times its lever
/// arm as velocity. Noise of one sample, σ, smoothed and differentiated is
/// `2π σ f_c^{3/2} √(2 h ∫ x²/(1+x⁴)² dx)`, with the integral π√2/16.
fn believed_part(angle: &Timed, slope: &[f64], period_s: f64) -> f64 {
    use std::f64::consts::{PI, SQRT_2};
    let sample = sample_noise([angle]).unwrap_or(0.0).powi(2);
    let passed = 2.0 * PI * RATE_FILTER.cutoff_hz.powf(1.5);
    let noise = sample * passed * passed * 2.0 * period_s * PI * SQRT_2 / 16.0;
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
    use std::f64::consts::TAU;
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
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn a_heading_past_north_continues() {
        let measured = Timed::new("heading", vec![0.0, 1.0, 2.0], vec![6.2, 0.1, 0.3]);
        let heading = unwrap(&measured.expect("in order"));
        for (found, expected) in heading.values().iter().zip([6.2, 0.1 + TAU, 0.3 + TAU]) {
            assert!((found - expected).abs() < 1e-12, "{found} and {expected}");
        }
    }
}
