//! What the instruments make of a motion.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;

use super::motion::{Moved, STEP_S};
use super::random::{Streams, normal};
use super::vehicle::{DEPTH_QUANTUM_M, pair};
use super::water::{Attitude, Water};
use super::{RPM, STEPS_PER_TICK, TwinSpec, tick_time};
use crate::navigation::Recording;
use crate::quantity::{Attitude as Angle, Axis};
use crate::{Dof, Error, Quantity, Sensors, ThrusterInput, Timed};

/// Rate of the depth sensor, Hz [Jason2, table 3].
const DEPTH_HZ: f64 = 0.6;
/// Standard deviation of roll and pitch, rad [Jason2, table 3].
const TILT_STD_RAD: f64 = 0.1 * TAU / 360.0;
/// Resolution of the logged propeller speed, rad/s.
const SPEED_QUANTUM: f64 = 10.0 * RPM;

/// Writes the log of one trial.
///
/// # Errors
/// As [`Timed::new`], if the vehicle moved beyond all numbers.
pub(super) fn record(
    spec: &TwinSpec,
    dof: Dof,
    moved: &Moved,
    water: &Water,
    streams: &Streams<'_>,
) -> Result<Recording, Error> {
    let vehicle = spec.true_vehicle()?;
    let mut recording = Recording::new();
    let ticks = moved.speeds[0].len();
    let held: Vec<f64> = (0..ticks).map(tick_time).collect();
    for (at, thruster) in vehicle.thrusters.iter().enumerate() {
        let speed = match pair(dof).iter().position(|&driven| driven == at) {
            Some(which) => moved.speeds[which].iter().map(|n| to_grid(*n, SPEED_QUANTUM)).collect(),
            None => vec![0.0; ticks],
        };
        let name = thruster.name.clone();
        let quantity = Quantity::Thruster { name, input: ThrusterInput::Speed };
        recording.insert(quantity, Timed::new("speed", held.clone(), speed)?);
    }
    let sensing = Sensing { spec, dof, moved, water, sensors: &vehicle.sensors, streams };
    sensing.attitude(&mut recording)?;
    sensing.dvl(&mut recording)?;
    sensing.depth(&mut recording)?;
    Ok(recording)
}

struct Sensing<'a> {
    spec: &'a TwinSpec,
    dof: Dof,
    moved: &'a Moved,
    water: &'a Water,
    sensors: &'a Sensors,
    streams: &'a Streams<'a>,
}

impl Sensing<'_> {
    /// The instants of the 10 Hz instruments: each tick, and the end of the last.
    fn instants(&self) -> Vec<f64> {
        (0..=self.moved.speeds[0].len()).map(tick_time).collect()
    }

    fn attitude_at(&self, step: usize) -> Attitude {
        let (position, velocity) = (self.moved.position[step], self.moved.velocity[step]);
        self.water.attitude(step as f64 * STEP_S, position, velocity)
    }

    fn attitude(&self, recording: &mut Recording) -> Result<(), Error> {
        let stds = [TILT_STD_RAD, TILT_STD_RAD, self.spec.noise.heading_rad()];
        let purposes = ["roll", "pitch", "heading"];
        for (k, angle) in [Angle::Roll, Angle::Pitch, Angle::Heading].into_iter().enumerate() {
            let mut rng = self.streams.of(purposes[k]);
            let read = |tick: usize| {
                let x =
                    self.attitude_at(tick * STEPS_PER_TICK).angles[k] + stds[k] * normal(&mut rng);
                if angle == Angle::Heading { x.rem_euclid(TAU) } else { x }
            };
            let t = self.instants();
            let x: Vec<f64> = (0..t.len()).map(read).collect();
            recording.insert(Quantity::Attitude(angle), Timed::new(purposes[k], t, x)?);
        }
        Ok(())
    }

    /// `v_dvl = R_bsᵀ (v + ω × r)`.
    fn dvl(&self, recording: &mut Recording) -> Result<(), Error> {
        let dvl = self.sensors.dvl;
        let to_instrument = dvl.to_body().inverse();
        let std = self.spec.noise.dvl_m_s();
        let mut rngs: [ChaCha8Rng; 3] =
            ["dvl x", "dvl y", "dvl z"].map(|axis| self.streams.of(axis));
        let t = self.instants();
        let mut seen: [Vec<f64>; 3] = Default::default();
        for tick in 0..t.len() {
            let step = tick * STEPS_PER_TICK;
            let omega = body_rates(&self.attitude_at(step));
            let mut v = Vector3::zeros();
            if !self.dof.is_rotation() {
                v[self.dof.index()] = self.moved.velocity[step];
            }
            let at_dvl = to_instrument * (v + omega.cross(&dvl.position_body));
            for k in 0..3 {
                seen[k].push(at_dvl[k] + std * normal(&mut rngs[k]));
            }
        }
        for (axis, x) in [Axis::X, Axis::Y, Axis::Z].into_iter().zip(seen) {
            recording.insert(Quantity::DvlVelocity(axis), Timed::new("DVL", t.clone(), x)?);
        }
        Ok(())
    }

    fn depth(&self, recording: &mut Recording) -> Result<(), Error> {
        let mut rng = self.streams.of("depth");
        let lever = self.sensors.depth.position_body;
        let end_s = tick_time(self.moved.speeds[0].len());
        let t: Vec<f64> = (0..=(end_s * DEPTH_HZ) as usize).map(|k| k as f64 / DEPTH_HZ).collect();
        let read = |t: &f64| {
            let step = ((t / STEP_S).round() as usize).min(self.moved.sunk.len() - 1);
            // Within a hundredth of a second of the sample: below 0.1 mm.
            let late_s = t - step as f64 * STEP_S;
            let sinking = if self.dof == Dof::Heave { self.moved.velocity[step] } else { 0.0 };
            let origin = self.spec.start_depth_m + self.moved.sunk[step] + late_s * sinking;
            let sensor = origin + (self.attitude_at(step).rotation() * lever).z;
            to_grid(sensor + self.spec.noise.depth_m() * normal(&mut rng), DEPTH_QUANTUM_M)
        };
        let depth: Vec<f64> = t.iter().map(read).collect();
        recording.insert(Quantity::Depth, Timed::new("depth", t, depth)?);
        Ok(())
    }
}

/// Angular velocity in body axes from the slopes of the angles, rad/s.
fn body_rates(attitude: &Attitude) -> Vector3<f64> {
    let [roll, pitch, _] = attitude.angles;
    let [roll_slope, pitch_slope, heading_slope] = attitude.slopes;
    Vector3::new(
        roll_slope - heading_slope * pitch.sin(),
        pitch_slope * roll.cos() + heading_slope * pitch.cos() * roll.sin(),
        -pitch_slope * roll.sin() + heading_slope * pitch.cos() * roll.cos(),
    )
}

fn to_grid(x: f64, quantum: f64) -> f64 {
    (x / quantum).round() * quantum
}
