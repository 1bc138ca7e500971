//! Simulated measurements of a motion.

use std::f64::consts::TAU;

use nalgebra::{Rotation3, Vector3, Vector6};
use rand_chacha::ChaCha8Rng;

use super::faults::Faults;
use super::motion::{STEP_S, TrialMotion};
use super::random::Streams;
use super::vehicle::{DEPTH_QUANTUM_M, InstrumentNoise, pair};
use super::water::{Attitude, Water};
use super::{Disturbance, RPM, STEPS_PER_TICK, TwinAccelerometer, TwinSpec, tick_time};
use crate::navigation::Recording;
use crate::quantity::{Attitude as Angle, Axis};
use crate::random::normal;
use crate::{Dof, Error, Quantity, Sensors, ThrusterInput, Timed, Vehicle};

/// Rate of the depth sensor, Hz [Jason2, table 3].
const DEPTH_HZ: f64 = 0.6;
/// m/s².
const GRAVITY: f64 = 9.80665;
/// Resolution of the logged propeller speed, rad/s.
const SPEED_QUANTUM: f64 = 10.0 * RPM;
/// Quantum of a command, whose greatest value is 1: a microsecond of a pulse of 1500 ± 400 µs.
const COMMAND_QUANTUM: f64 = 1.0 / 400.0;

/// Random streams of the noise of roll, pitch and heading, of the DVL and of the gyroscope.
const ANGLES: [&str; 3] = ["roll", "pitch", "heading"];
const DVL: [&str; 3] = ["dvl x", "dvl y", "dvl z"];
const GYRO: [&str; 3] = ["gyro x", "gyro y", "gyro z"];

/// A motion in steps of 0.02 s, for the simulation of instruments.
pub(super) trait Path {
    /// Returns the number of steps.
    fn steps(&self) -> usize;
    /// Returns the attitude after a step, at `t_s`.
    fn attitude(&self, step: usize, t_s: f64) -> Attitude;
    /// Returns the velocity of the origin over ground after a step, body axes, m/s.
    fn velocity(&self, step: usize) -> Vector3<f64>;
    /// Returns the depth of the origin below its start after a step, m, and its rate, m/s.
    fn sunk(&self, step: usize) -> (f64, f64);
    /// Returns the commanded input of a thruster at a tick, in the unit of its curve.
    fn command(&self, thruster: usize, tick: usize) -> f64;
}

/// A motion in one degree of freedom.
pub(super) struct OneAxisPath<'a> {
    pub(super) dof: Dof,
    pub(super) moved: &'a TrialMotion,
    pub(super) water: &'a Water,
}

impl Path for OneAxisPath<'_> {
    fn steps(&self) -> usize {
        self.moved.velocity.len() - 1
    }

    fn attitude(&self, step: usize, t_s: f64) -> Attitude {
        self.water.attitude(t_s, self.moved.position[step], self.moved.velocity[step])
    }

    fn velocity(&self, step: usize) -> Vector3<f64> {
        let mut v = Vector3::zeros();
        if !self.dof.is_rotation() {
            v[self.dof.index()] = self.moved.velocity[step];
        }
        v
    }

    fn sunk(&self, step: usize) -> (f64, f64) {
        let sinking = if self.dof == Dof::Heave { self.moved.velocity[step] } else { 0.0 };
        (self.moved.sunk[step], sinking)
    }

    fn command(&self, thruster: usize, tick: usize) -> f64 {
        let driven = pair(self.dof).iter().position(|&driven| driven == thruster);
        driven.map_or(0.0, |which| self.moved.speeds[which][tick])
    }
}

/// The instruments that record a motion, and their noise.
pub(super) struct Observer<'a> {
    pub(super) spec: &'a TwinSpec,
    pub(super) vehicle: &'a Vehicle,
    pub(super) streams: &'a Streams<'a>,
    pub(super) noise: InstrumentNoise,
}

/// Records the log of one trial.
///
/// # Errors
/// As [`Timed::new`], if the motion is not finite.
pub(super) fn record(observer: &Observer<'_>, path: &dyn Path) -> Result<Recording, Error> {
    let Observer { spec, vehicle, streams, noise } = *observer;
    let mut recording = Recording::new();
    let ticks = path.steps() / STEPS_PER_TICK;
    let faults = Faults::new(spec, streams, ticks);
    let logged: Vec<usize> = (0..ticks).step_by(faults.ticks_per_speed()).collect();
    let times: Vec<f64> = logged.iter().map(|tick| tick_time(*tick)).collect();
    for (at, thruster) in vehicle.thrusters.iter().enumerate() {
        let input = thruster.curve.input();
        let speed = |tick: &usize| to_grid(path.command(at, *tick), quantum(input));
        let quantity = Quantity::Thruster { name: thruster.name.clone(), input };
        let speed = logged.iter().map(speed).collect();
        let [series] = faults.logged("speed", None, &times, [speed])?;
        recording.insert(quantity, series);
    }
    let attitude = |tick| path.attitude(tick * STEPS_PER_TICK, tick_time(tick));
    let attitudes = (0..=ticks).map(attitude).collect();
    let sensors = &vehicle.sensors;
    let sensing = Sensing { attitudes, spec, path, sensors, streams, noise, faults };
    sensing.attitude(&mut recording)?;
    match &spec.accelerometer {
        None => sensing.dvl(&mut recording)?,
        Some(imu) => sensing.accelerometer(imu, &mut recording)?,
    }
    sensing.depth(&mut recording)?;
    if noise.gyro.is_some() {
        sensing.gyro(&mut recording)?;
    }
    Ok(recording)
}

/// Measurement errors at successive ticks, the same as in the log: an autopilot has the errors of
/// its instruments.
pub(super) struct MeasurementErrors {
    noise: InstrumentNoise,
    dvl_to_body: Rotation3<f64>,
    angles: [ChaCha8Rng; 3],
    dvl: [ChaCha8Rng; 3],
    gyro: [ChaCha8Rng; 3],
}

impl MeasurementErrors {
    pub(super) fn new(streams: &Streams<'_>, noise: InstrumentNoise, sensors: &Sensors) -> Self {
        let all = |names: [&str; 3]| names.map(|name| streams.stream(name));
        let dvl_to_body = sensors.dvl.to_body();
        Self { noise, dvl_to_body, angles: all(ANGLES), dvl: all(DVL), gyro: all(GYRO) }
    }

    /// Returns the errors of roll, pitch and heading, rad, and of velocity in body axes, m/s and
    /// rad/s, at the next tick.
    pub(super) fn next(&mut self) -> ([f64; 3], Vector6<f64>) {
        let stds = self.noise.of_angles();
        let angles = std::array::from_fn(|k| stds[k] * normal(&mut self.angles[k]));
        let dvl = Vector3::from_fn(|k, _| self.noise.dvl * normal(&mut self.dvl[k]));
        let gyro = self.gyro.each_mut().map(|rng| {
            let read = self.noise.gyro.unwrap_or(0.0) * normal(rng);
            // The gyroscope is sampled at every step.
            (1..STEPS_PER_TICK).for_each(|_| _ = normal(rng));
            read
        });
        let dvl = self.dvl_to_body * dvl;
        (angles, Vector6::new(dvl.x, dvl.y, dvl.z, gyro[0], gyro[1], gyro[2]))
    }
}

/// Rounds a command as it is sent and logged.
pub(super) fn quantised(command: f64) -> f64 {
    to_grid(command, COMMAND_QUANTUM)
}

/// Returns the quantum of a logged input: rad/s, or a fraction of full command.
fn quantum(input: ThrusterInput) -> f64 {
    if input == ThrusterInput::Speed { SPEED_QUANTUM } else { COMMAND_QUANTUM }
}

struct Sensing<'a> {
    /// At each tick, and at the end of the last.
    attitudes: Vec<Attitude>,
    spec: &'a TwinSpec,
    path: &'a dyn Path,
    sensors: &'a Sensors,
    streams: &'a Streams<'a>,
    noise: InstrumentNoise,
    faults: Faults<'a>,
}

impl Sensing<'_> {
    /// Returns the instants of the 10 Hz instruments: each tick, and the end of the last.
    fn instants(&self) -> Vec<f64> {
        (0..self.attitudes.len()).map(tick_time).collect()
    }

    fn attitude(&self, recording: &mut Recording) -> Result<(), Error> {
        let stds = self.noise.of_angles();
        let mut read = [0, 1, 2].map(|k| -> Vec<f64> {
            let mut rng = self.streams.stream(ANGLES[k]);
            let noisy = |attitude: &Attitude| attitude.angles[k] + stds[k] * normal(&mut rng);
            self.attitudes.iter().map(noisy).collect()
        });
        self.faults.add_heading_errors(&mut read[2]);
        read[2].iter_mut().for_each(|heading| *heading = heading.rem_euclid(TAU));
        let gaps = Some(Disturbance::HeadingGaps);
        let logged = self.faults.logged("attitude", gaps, &self.instants(), read)?;
        for (angle, series) in [Angle::Roll, Angle::Pitch, Angle::Heading].into_iter().zip(logged) {
            recording.insert(Quantity::Attitude(angle), series);
        }
        Ok(())
    }

    fn dvl(&self, recording: &mut Recording) -> Result<(), Error> {
        let mut rngs = DVL.map(|axis| self.streams.stream(axis));
        let mut read: [Vec<f64>; 3] = Default::default();
        for at_dvl in self.velocities_at_dvl() {
            let scaled = self.faults.dvl_scale() * at_dvl;
            for k in 0..3 {
                read[k].push(scaled[k] + self.noise.dvl * normal(&mut rngs[k]));
            }
        }
        self.faults.spike_dvl(&mut read);
        let gaps = Some(Disturbance::Dropouts);
        let logged = self.faults.logged("DVL", gaps, &self.instants(), read)?;
        for (axis, series) in [Axis::X, Axis::Y, Axis::Z].into_iter().zip(logged) {
            recording.insert(Quantity::DvlVelocity(axis), series);
        }
        Ok(())
    }

    /// Records the specific force `v̇ + ω × v + ω̇ × r + ω × (ω × r) − Rᵀ g` in the middle of each
    /// step, v̇ being the change of velocity over the step.
    fn accelerometer(
        &self,
        imu: &TwinAccelerometer,
        recording: &mut Recording,
    ) -> Result<(), Error> {
        let steps = self.path.steps();
        let at_step = |step: usize| self.path.attitude(step, step as f64 * STEP_S);
        let mut rngs = ["imu x", "imu y", "imu z"].map(|axis| self.streams.stream(axis));
        let mut leaks = [0, 1, 2].map(|k| imu.leak * normal(&mut rngs[k]));
        let kept = (-STEP_S / imu.leak_s).exp();
        let mut read: [Vec<f64>; 3] = Default::default();
        let mut before = at_step(0);
        for step in 0..steps {
            let after = at_step(step + 1);
            let specific_force =
                self.specific_force(step, &before, &after, &Vector3::from(imu.position_m));
            for k in 0..3 {
                let shock = imu.leak * (1.0 - kept * kept).sqrt() * normal(&mut rngs[k]);
                leaks[k] = kept * leaks[k] + shock;
                read[k].push(
                    specific_force[k] + imu.offset + leaks[k] + imu.noise * normal(&mut rngs[k]),
                );
            }
            before = after;
        }
        let times: Vec<f64> = (0..steps).map(|step| (step as f64 + 0.5) * STEP_S).collect();
        for (axis, values) in [Axis::X, Axis::Y, Axis::Z].into_iter().zip(read) {
            let series = Timed::new("acceleration", times.clone(), values)?;
            recording.insert(Quantity::Acceleration(axis), series);
        }
        Ok(())
    }

    fn specific_force(
        &self,
        step: usize,
        before: &Attitude,
        after: &Attitude,
        lever: &Vector3<f64>,
    ) -> Vector3<f64> {
        let (from, to) = (body_rates(before), body_rates(after));
        let (omega, slope) = (0.5 * (from + to), (to - from) / STEP_S);
        let (start, end) = (self.path.velocity(step), self.path.velocity(step + 1));
        let (v, rate) = (0.5 * (start + end), (end - start) / STEP_S);
        let down = before.rotation().inverse() * Vector3::z();
        rate + omega.cross(&v) + slope.cross(lever) + omega.cross(&omega.cross(lever))
            - GRAVITY * down
    }

    /// Returns the noise-free output of the DVL at every tick, m/s.
    fn velocities_at_dvl(&self) -> Vec<Vector3<f64>> {
        if !self.faults.smooths() {
            let at_tick = |(tick, attitude)| self.at_dvl(tick * STEPS_PER_TICK, attitude);
            return self.attitudes.iter().enumerate().map(at_tick).collect();
        }
        let at_step =
            |step: usize| self.at_dvl(step, &self.path.attitude(step, step as f64 * STEP_S));
        self.faults.smoothed((0..=self.path.steps()).map(at_step).collect())
    }

    /// Returns `v_dvl = R_bsᵀ (v + ω × r)`.
    fn at_dvl(&self, step: usize, attitude: &Attitude) -> Vector3<f64> {
        let dvl = self.sensors.dvl;
        let v = self.path.velocity(step);
        dvl.to_body().inverse() * (v + body_rates(attitude).cross(&dvl.position_body))
    }

    fn depth(&self, recording: &mut Recording) -> Result<(), Error> {
        let mut rng = self.streams.stream("depth");
        let lever = self.sensors.depth.position_body;
        let end_s = tick_time(self.attitudes.len() - 1);
        let t: Vec<f64> = (0..=(end_s * DEPTH_HZ) as usize).map(|k| k as f64 / DEPTH_HZ).collect();
        let read = |t: &f64| {
            let step = ((t / STEP_S).round() as usize).min(self.path.steps());
            // The step is within 0.01 s of the sample: the remaining error is below 0.1 mm.
            let late_s = t - step as f64 * STEP_S;
            let (sunk, sinking) = self.path.sunk(step);
            let origin = self.spec.start_depth_m + sunk + late_s * sinking;
            let sensor = origin + (self.path.attitude(step, *t).rotation() * lever).z;
            to_grid(sensor + self.noise.depth * normal(&mut rng), DEPTH_QUANTUM_M)
        };
        let depth: Vec<f64> = t.iter().map(read).collect();
        let [depth] = self.faults.logged("depth", None, &t, [depth])?;
        recording.insert(Quantity::Depth, depth);
        Ok(())
    }

    /// Records angular velocity in body axes, at every step.
    fn gyro(&self, recording: &mut Recording) -> Result<(), Error> {
        let times: Vec<f64> = (0..=self.path.steps()).map(|step| step as f64 * STEP_S).collect();
        let rates = times.iter().enumerate().map(|(step, t)| self.path.attitude(step, *t));
        let rates: Vec<Vector3<f64>> = rates.map(|attitude| body_rates(&attitude)).collect();
        let std = self.noise.gyro.unwrap_or(0.0);
        let read = [0, 1, 2].map(|k| -> Vec<f64> {
            let mut rng = self.streams.stream(GYRO[k]);
            rates.iter().map(|rate| rate[k] + std * normal(&mut rng)).collect()
        });
        let logged = self.faults.logged("gyro", None, &times, read)?;
        for (axis, series) in [Axis::X, Axis::Y, Axis::Z].into_iter().zip(logged) {
            recording.insert(Quantity::Rate(axis), series);
        }
        Ok(())
    }
}

/// Returns angular velocity in body axes from the derivatives of Euler angles, rad/s.
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
    use crate::twin::motion::simulate_trial;
    use crate::twin::plans;

    /// Returns the log of one trial without noise, its motion and its true instruments.
    fn noise_free(disturbances: &str, name: &str) -> (Recording, TrialMotion, Sensors) {
        let spec = TwinSpec {
            disturbances: Disturbance::parse_list(disturbances).expect("known"),
            ..TwinSpec::jason2()
        };
        let plan = plans(&spec).into_iter().find(|plan| plan.name == name).expect("planned");
        let streams = Streams { seed: spec.seed, trial: name };
        let water = Water::new(&spec, plan.dof, &streams, plan.ticks());
        let pilot = plan.pilot(&spec, &streams);
        let moved = simulate_trial(&spec, &plan, pilot, &water, &streams).expect("stable");
        let silent = InstrumentNoise::default();
        let vehicle = spec.true_vehicle().expect("valid");
        let observer =
            Observer { spec: &spec, vehicle: &vehicle, streams: &streams, noise: silent };
        let path = OneAxisPath { dof: plan.dof, moved: &moved, water: &water };
        let log = record(&observer, &path).expect("finite");
        (log, moved, vehicle.sensors)
    }

    /// Number of samples at both ends that the filter of rates distorts.
    const EDGE: usize = 50;

    fn greatest_error(log: &Recording, moved: &TrialMotion, sensors: &Sensors, dof: Dof) -> f64 {
        let nav = navigate("twin", log, sensors).expect("complete");
        let v = nav.measured[&dof].values();
        let error = |tick: usize| (v[tick] - moved.velocity[tick * STEPS_PER_TICK]).abs();
        (EDGE..v.len() - EDGE).map(error).fold(0.0, f64::max)
    }

    #[test]
    fn navigation_corrects_the_rotated_dvl() {
        for (name, dof) in [("surge 1", Dof::Surge), ("sway 1", Dof::Sway), ("heave 1", Dof::Heave)]
        {
            let (log, moved, sensors) = noise_free("none", name);
            let off = greatest_error(&log, &moved, &sensors, dof);
            assert!(off < 1e-12, "{name}: {off}");
        }
    }

    #[test]
    fn navigation_corrects_the_lever_arm_of_a_vehicle_that_rolls_and_pitches() {
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
    fn a_vehicle_that_turns_on_the_spot_does_not_translate() {
        let (log, moved, sensors) = noise_free("none", "yaw 1");
        let nav = navigate("twin", &log, &sensors).expect("complete");
        let fastest = moved.velocity.iter().fold(0.0_f64, |most, r| most.max(r.abs()));
        let sway = nav.measured[&Dof::Sway].values();
        let drift = sway[EDGE..sway.len() - EDGE].iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        // Yaw moves at 1/6 Hz, at which derivatives are accurate to half a per cent of 0.5 m × r.
        assert!(drift < 0.01 * 0.5 * fastest, "{drift} beside {}", 0.5 * fastest);
    }

    #[test]
    fn depth_follows_heave() {
        let (log, moved, sensors) = noise_free("none", "heave 1");
        let depth = &navigate("twin", &log, &sensors).expect("complete").position[&Dof::Heave];
        for (t, z) in depth.time_s().iter().zip(depth.values()) {
            let step = (t / STEP_S).round() as usize;
            // Half a quantum, and 0.01 s at 0.3 m/s.
            assert!((z - 150.0 - moved.position[step]).abs() < 0.5 * DEPTH_QUANTUM_M + 0.003);
        }
    }

    fn dvl_x(log: &Recording) -> &Timed {
        &log[&Quantity::DvlVelocity(Axis::X)]
    }

    fn heading(log: &Recording) -> &Timed {
        &log[&Quantity::Attitude(Angle::Heading)]
    }

    fn speed(log: &Recording) -> &Timed {
        let name = "fore-aft port".to_owned();
        &log[&Quantity::Thruster { name, input: ThrusterInput::Speed }]
    }

    /// Component of surge along the x axis of the rotated DVL.
    const SEEN: f64 = std::f64::consts::FRAC_1_SQRT_2;
    /// Rounding, m/s, rad and s.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn an_averaging_dvl_logs_the_mean_of_the_past_second() {
        let (log, moved, _) = noise_free("velocity-averaging", "surge 1");
        for (tick, x) in dvl_x(&log).values().iter().enumerate().skip(10) {
            let past = &moved.velocity[(tick - 10) * STEPS_PER_TICK..=tick * STEPS_PER_TICK];
            let ends = 0.5 * (past[0] + past[past.len() - 1]);
            let mean = (past.iter().sum::<f64>() - ends) / (past.len() - 1) as f64;
            assert!((x - SEEN * mean).abs() < ROUNDING, "{tick}: {x}");
        }
    }

    #[test]
    fn a_lagging_dvl_approaches_the_velocity() {
        let (log, moved, _) = noise_free("velocity-lag", "surge 1");
        let x = dvl_x(&log).values();
        for tick in 100..x.len() - 1 {
            let lagging = x[tick] / SEEN;
            let slope = (x[tick + 1] - x[tick - 1]) / (0.2 * SEEN);
            let true_v = moved.velocity[tick * STEPS_PER_TICK];
            // Central differences of a motion at 0.1 Hz under a force that changes every 0.1 s.
            assert!((lagging + 0.3 * slope - true_v).abs() < 2e-3, "{tick}");
        }
    }

    #[test]
    fn a_scale_error_of_the_dvl_does_not_affect_depth() {
        let (log, moved, sensors) = noise_free("dvl-scale", "heave 1");
        let nav = navigate("twin", &log, &sensors).expect("complete");
        for (tick, v) in nav.measured[&Dof::Heave].values().iter().enumerate() {
            let truth = moved.velocity[tick * STEPS_PER_TICK];
            assert!((v - 1.03 * truth).abs() < ROUNDING);
        }
        let right = noise_free("none", "heave 1").0;
        assert_eq!(log[&Quantity::Depth], right[&Quantity::Depth]);
    }

    #[test]
    fn half_a_percent_of_samples_are_outliers() {
        let (right, struck) = (noise_free("none", "yaw 1").0, noise_free("spikes", "yaw 1").0);
        let off = |of: fn(&Recording) -> &Timed| -> Vec<f64> {
            let pairs = of(&right).values().iter().zip(of(&struck).values());
            pairs.map(|(a, b)| (a - b).abs()).filter(|off| *off > ROUNDING).collect()
        };
        for (of, most) in [(off(dvl_x), 1.0), (off(heading), 30.0_f64.to_radians())] {
            // Of 4801 samples 24 ± 5; headings near north may differ by a whole turn.
            assert!((8..=40).contains(&of.len()), "{}", of.len());
            assert!(of.iter().all(|off| *off <= most || TAU - off <= most), "{of:?}");
            assert!(of.iter().any(|off| *off > 0.5 * most));
        }
        assert_eq!(speed(&right), speed(&struck));
    }

    /// Returns the gaps of a log, s.
    fn gaps(series: &Timed) -> Vec<f64> {
        series.time_s().windows(2).map(|t| t[1] - t[0]).filter(|gap| *gap > 0.11).collect()
    }

    #[test]
    fn each_sensor_has_its_own_gaps() {
        let (log, _, _) = noise_free("dropouts", "surge 1");
        assert!(!gaps(dvl_x(&log)).is_empty());
        assert!(gaps(dvl_x(&log)).iter().all(|gap| (4.0..=12.1).contains(gap)));
        assert!(gaps(heading(&log)).is_empty() && gaps(speed(&log)).is_empty());
        let (log, _, _) = noise_free("heading-gaps", "surge 1");
        assert!(!gaps(heading(&log)).is_empty() && gaps(dvl_x(&log)).is_empty());
        let (right, _, _) = noise_free("none", "surge 1");
        let known = |t: &f64| right[&Quantity::Attitude(Angle::Heading)].time_s().contains(t);
        assert!(heading(&log).time_s().iter().all(known), "the others keep their stamps");
    }

    #[test]
    fn jittered_time_stamps_leave_samples_unchanged() {
        let (right, late) =
            (noise_free("none", "heave 1").0, noise_free("stamp-jitter", "heave 1").0);
        for (quantity, series) in &late {
            assert_eq!(series.values(), right[quantity].values(), "{quantity}");
            let pairs = series.time_s().iter().zip(right[quantity].time_s());
            let off: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
            assert!(off.iter().all(|off| off.abs() <= 0.02 + ROUNDING), "{quantity}");
            let mean_square = off.iter().map(|x| x * x).sum::<f64>() / off.len() as f64;
            // Uniform over ± 20 ms: 11.5 ms; from 288 depths, known to 4 %.
            assert!((mean_square.sqrt() / 0.01155 - 1.0).abs() < 0.12, "{quantity}");
        }
        assert_ne!(dvl_x(&late).time_s(), heading(&late).time_s(), "each clock has its own errors");
    }

    #[test]
    fn a_slow_log_of_thrust_has_every_fifth_speed() {
        let (right, slow) =
            (noise_free("none", "surge 1").0, noise_free("slow-thrust-log", "surge 1").0);
        let fifth: Vec<f64> = speed(&right).values().iter().copied().step_by(5).collect();
        assert_eq!(speed(&slow).values(), fifth);
        assert!(speed(&slow).time_s().windows(2).all(|t| (t[1] - t[0] - 0.5).abs() < 1e-9));
        assert_eq!(dvl_x(&slow), dvl_x(&right), "the propellers turn as ever");
    }

    #[test]
    fn heading_drifts_by_a_degree_a_minute() {
        let (right, off) =
            (noise_free("none", "surge 1").0, noise_free("heading-drift", "surge 1").0);
        let drift = heading(&off).values()[4800] - heading(&right).values()[4800];
        assert!((drift.rem_euclid(TAU) - 8.0_f64.to_radians()).abs() < ROUNDING, "{drift}");
    }
}
