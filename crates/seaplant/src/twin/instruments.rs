//! What the instruments make of a motion.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;

use super::motion::{Moved, STEP_S};
use super::random::{Streams, normal};
use super::vehicle::{DEPTH_QUANTUM_M, InstrumentNoise, pair};
use super::water::{Attitude, Water};
use super::{RPM, STEPS_PER_TICK, TwinSpec, tick_time};
use crate::navigation::Recording;
use crate::quantity::{Attitude as Angle, Axis};
use crate::{Dof, Error, Quantity, Sensors, ThrusterInput, Timed};

/// Rate of the depth sensor, Hz [Jason2, table 3].
const DEPTH_HZ: f64 = 0.6;
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
    noise: InstrumentNoise,
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
    let attitudes = (0..=ticks)
        .map(|tick| {
            let step = tick * STEPS_PER_TICK;
            water.attitude(tick_time(tick), moved.position[step], moved.velocity[step])
        })
        .collect();
    let sensing =
        Sensing { attitudes, spec, dof, moved, water, sensors: &vehicle.sensors, streams, noise };
    sensing.attitude(&mut recording)?;
    sensing.dvl(&mut recording)?;
    sensing.depth(&mut recording)?;
    Ok(recording)
}

struct Sensing<'a> {
    /// At each tick, and at the end of the last.
    attitudes: Vec<Attitude>,
    spec: &'a TwinSpec,
    dof: Dof,
    moved: &'a Moved,
    water: &'a Water,
    sensors: &'a Sensors,
    streams: &'a Streams<'a>,
    noise: InstrumentNoise,
}

impl Sensing<'_> {
    /// The instants of the 10 Hz instruments: each tick, and the end of the last.
    fn instants(&self) -> Vec<f64> {
        (0..self.attitudes.len()).map(tick_time).collect()
    }

    fn attitude(&self, recording: &mut Recording) -> Result<(), Error> {
        let stds = [self.noise.tilt, self.noise.tilt, self.noise.heading];
        let purposes = ["roll", "pitch", "heading"];
        for (k, angle) in [Angle::Roll, Angle::Pitch, Angle::Heading].into_iter().enumerate() {
            let mut rng = self.streams.of(purposes[k]);
            let read = |attitude: &Attitude| {
                let x = attitude.angles[k] + stds[k] * normal(&mut rng);
                if angle == Angle::Heading { x.rem_euclid(TAU) } else { x }
            };
            let (t, x): (_, Vec<f64>) =
                (self.instants(), self.attitudes.iter().map(read).collect());
            recording.insert(Quantity::Attitude(angle), Timed::new(purposes[k], t, x)?);
        }
        Ok(())
    }

    /// `v_dvl = R_bsᵀ (v + ω × r)`.
    fn dvl(&self, recording: &mut Recording) -> Result<(), Error> {
        let dvl = self.sensors.dvl;
        let to_instrument = dvl.to_body().inverse();
        let mut rngs: [ChaCha8Rng; 3] =
            ["dvl x", "dvl y", "dvl z"].map(|axis| self.streams.of(axis));
        let t = self.instants();
        let mut seen: [Vec<f64>; 3] = Default::default();
        for (tick, attitude) in self.attitudes.iter().enumerate() {
            let omega = body_rates(attitude);
            let mut v = Vector3::zeros();
            if !self.dof.is_rotation() {
                v[self.dof.index()] = self.moved.velocity[tick * STEPS_PER_TICK];
            }
            let at_dvl = to_instrument * (v + omega.cross(&dvl.position_body));
            for k in 0..3 {
                seen[k].push(at_dvl[k] + self.noise.dvl * normal(&mut rngs[k]));
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
            // Heading does not matter to depth.
            let sensor = origin + (self.water.attitude(*t, 0.0, 0.0).rotation() * lever).z;
            to_grid(sensor + self.noise.depth * normal(&mut rng), DEPTH_QUANTUM_M)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigation::navigate;
    use crate::twin::motion::move_vehicle;
    use crate::twin::{Disturbance, plans};

    /// The log of one trial without noise, its motion and its true instruments.
    fn noise_free(disturbances: &str, name: &str) -> (Recording, Moved, Sensors) {
        let spec = TwinSpec {
            disturbances: Disturbance::parse_list(disturbances).expect("known"),
            ..TwinSpec::jason2()
        };
        let plan = plans(&spec).into_iter().find(|plan| plan.name == name).expect("planned");
        let streams = Streams { seed: spec.seed, trial: name };
        let water = Water::of(&spec, plan.dof, &streams, plan.ticks());
        let pilot = plan.pilot(&spec, &streams);
        let moved = move_vehicle(&spec, &plan, pilot, &water, &streams).expect("stable");
        let silent = InstrumentNoise::default();
        let log = record(&spec, plan.dof, &moved, &water, &streams, silent).expect("finite");
        (log, moved, spec.true_vehicle().expect("valid").sensors)
    }

    /// The filter on rates leaves its mark this deep at both ends, in samples.
    const EDGE: usize = 50;

    fn greatest_error(log: &Recording, moved: &Moved, sensors: &Sensors, dof: Dof) -> f64 {
        let nav = navigate("twin", log, sensors).expect("complete");
        let v = nav.measured[&dof].values();
        let error = |tick: usize| (v[tick] - moved.velocity[tick * STEPS_PER_TICK]).abs();
        (EDGE..v.len() - EDGE).map(error).fold(0.0, f64::max)
    }

    #[test]
    fn navigation_undoes_the_turned_dvl() {
        for (name, dof) in [("surge 1", Dof::Surge), ("sway 1", Dof::Sway), ("heave 1", Dof::Heave)]
        {
            let (log, moved, sensors) = noise_free("none", name);
            let off = greatest_error(&log, &moved, &sensors, dof);
            assert!(off < 1e-12, "{name}: {off}");
        }
    }

    #[test]
    fn navigation_undoes_the_lever_arm_of_a_vehicle_that_rolls_and_pitches() {
        for (name, dof) in [("surge 1", Dof::Surge), ("sway 1", Dof::Sway), ("heave 1", Dof::Heave)]
        {
            let (log, moved, mut sensors) = noise_free("lever", name);
            // Rates are derivatives of attitude, 1 % low at 0.3 Hz: of 0.8 m × 0.1 rad/s.
            let off = greatest_error(&log, &moved, &sensors, dof);
            assert!(off < 2e-3, "{name}: {off}");
            sensors.dvl.position_body -= Vector3::new(0.8, 0.0, 0.8);
            let misled = greatest_error(&log, &moved, &sensors, dof);
            assert!(misled > 0.03, "{name}: {misled}");
        }
    }

    #[test]
    fn a_turning_vehicle_stays_where_it_is() {
        let (log, moved, sensors) = noise_free("none", "yaw 1");
        let nav = navigate("twin", &log, &sensors).expect("complete");
        let fastest = moved.velocity.iter().fold(0.0_f64, |most, r| most.max(r.abs()));
        let sway = nav.measured[&Dof::Sway].values();
        let drift = sway[EDGE..sway.len() - EDGE].iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        // Yaw moves at 1/6 Hz, where derivatives are good to half a per cent of 0.5 m × r.
        assert!(drift < 0.01 * 0.5 * fastest, "{drift} beside {}", 0.5 * fastest);
    }

    #[test]
    fn depth_follows_heave() {
        let (log, moved, sensors) = noise_free("none", "heave 1");
        let depth = &navigate("twin", &log, &sensors).expect("complete").position[&Dof::Heave];
        for (t, z) in depth.time_s().iter().zip(depth.values()) {
            let step = (t / STEP_S).round() as usize;
            // Half a quantum, and what 0.01 s at 0.3 m/s add.
            assert!((z - 150.0 - moved.position[step]).abs() < 0.5 * DEPTH_QUANTUM_M + 0.003);
        }
    }
}
