//! The vehicle with its actuation: driven axes, forces and thrusters.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, Vector3, Vector6};

use super::VehicleTwinSpec;
use crate::exchange::PlantModel;
use crate::plant::Plant;
use crate::twin::instruments::quantised;
use crate::twin::propellers::{JITTER_CORRELATION_S, Motor, Screw};
use crate::twin::random::{Streams, ornstein_uhlenbeck};
use crate::twin::validate::{above_zero, refused};
use crate::twin::vehicle::YAW_ARM_M;
use crate::twin::{Disturbance, RPM, TICK_HZ, TwinSpec, TwinThrusters};
use crate::{Dof, Error, QuadraticThrust, ThrustCurve, Thruster, ThrusterInput, Vehicle};

/// A vehicle with known true values, prepared for driving.
pub(super) struct Rig<'a> {
    pub(super) spec: &'a VehicleTwinSpec,
    /// The settings in common with the twin of one axis.
    pub(super) shared: TwinSpec,
    pub(super) plant: Plant,
    model: &'a PlantModel,
    /// The thrust law in the analyst's vehicle.
    law: QuadraticThrust,
    /// Wrench per newton of each thruster, and thrusts per unit of force on each axis.
    wrenches: DMatrix<f64>,
    allocation: DMatrix<f64>,
    /// Amplitude of the force on each axis, N or N m; zero on one that is not driven.
    pub(super) force: [f64; 6],
    /// Righting moment per angle, N m, and the gains per angle and per rate by which the pilot
    /// levels roll and pitch, N m and N m s.
    pub(super) righting: f64,
    pub(super) hold: [(f64, f64); 2],
    /// Length scale relative to Jason 2.
    scale: f64,
    /// Which each thruster follows, and its gain.
    acting: Vec<(usize, f64)>,
}

/// Returns the ratio of true reverse thrust to that of the analyst's curve under `thrcoef`, as for
/// Jason 2.
fn weaker_in_reverse() -> f64 {
    let TwinThrusters { forward, reverse, .. } = TwinThrusters::default();
    reverse / forward
}

/// Largest force on an axis, as a fraction of that of the thrusters on it alone.
const FORCE_PART: f64 = 0.4;
/// Natural frequency of the pilot's levelling, rad/s, and its damping ratio.
const LEVELLING: (f64, f64) = (2.0, 0.7);
/// Singular values below this fraction of the greatest count as zero.
const RANK: f64 = 1e-6;
/// Largest relative error of an allocated wrench.
const PUSHED: f64 = 1e-3;
/// Jitter of an input, as a fraction of the greatest: 5 rpm of Jason 2's 1650.
const JITTER_PART: f64 = 5.0 / 1650.0;

impl<'a> Rig<'a> {
    pub(super) fn new(spec: &'a VehicleTwinSpec, model: &'a PlantModel) -> Result<Self, Error> {
        let mut shared = spec.shared()?;
        if !model.plant.structure().signals().is_empty() {
            let expected = "driven by thrusters of known strength alone";
            let found = "a plant with rudders, fins or wind";
            return Err(refused("vehicle", found, expected));
        }
        let (input, law) = law_of(&model.thrusters)?;
        shared.thrusters = thrusters_of(spec.max_rpm, model.max_rpm, (input, law))?;
        if shared.has(Disturbance::Thrcoef) {
            shared.thrusters.reverse *= weaker_in_reverse();
        }
        let wrenches = wrenches_of(&model.thrusters);
        let allocation = wrenches
            .clone()
            .pseudo_inverse(RANK * wrenches.amax())
            .map_err(|reason| refused("vehicle", "thrusters", reason))?;
        let names: Vec<&str> = model.thrusters.iter().map(|own| own.name.as_str()).collect();
        let acting = spec.acting(&names)?;
        let farthest = model.thrusters.iter().map(|t| t.position_body.norm()).fold(0.0, f64::max);
        let scale = farthest / YAW_ARM_M;
        shared.strength.lever_m *= scale;
        let mut rig = Self {
            spec,
            shared,
            plant: model.plant.clone(),
            model,
            law,
            wrenches,
            allocation,
            force: [0.0; 6],
            righting: model.lever()[2],
            hold: [(0.0, 0.0); 2],
            scale,
            acting,
        };
        rig.find_forces()?;
        Ok(rig)
    }

    /// Computes the force on each axis: that for the specified speed, limited by the thrusters.
    fn find_forces(&mut self) -> Result<(), Error> {
        let own = self.plant.axes().to_vec();
        let requested = if self.spec.axes.is_empty() { &own } else { &self.spec.axes };
        let mass = self.plant.mass_matrix_of_six();
        for &dof in requested {
            let greatest = self.greatest(dof);
            let can = greatest > 0.0 && own.contains(&dof);
            if !can && !self.spec.axes.is_empty() {
                let expected = "without it: the plant lacks it, or its thrusters do not push it";
                return Err(refused("list of axes", &format!("with {dof}"), expected));
            }
            if !can {
                continue;
            }
            let most = FORCE_PART * greatest;
            let at = dof.index();
            self.force[at] = match dof {
                Dof::Roll | Dof::Pitch => {
                    let (natural, damping) = LEVELLING;
                    let stiffness = mass[(at, at)] * natural * natural;
                    self.hold[at - 3] = (stiffness, 2.0 * damping * natural * mass[(at, at)]);
                    ((stiffness + self.righting.max(0.0)) * self.spec.tilt_rad).min(most)
                }
                _ => self.drag_at_speed(dof).min(most),
            };
        }
        if self.force.iter().all(|force| *force == 0.0) {
            let expected = "a plant with thrusters that push some of its axes";
            return Err(refused("vehicle", "none that its thrusters push", expected));
        }
        Ok(())
    }

    /// Returns the force on an axis at the specified speed.
    fn drag_at_speed(&self, dof: Dof) -> f64 {
        let mut velocity = Vector6::zeros();
        let speed = if dof.is_rotation() { self.spec.rate_rad_s } else { self.spec.speed_m_s };
        velocity[dof.index()] = speed;
        self.plant.damping_power(&velocity).abs() / speed
    }

    /// Returns the greatest force of the thrusters on an axis and no other, N or N m; zero if they
    /// cannot produce it.
    fn greatest(&self, dof: Dof) -> f64 {
        let thrusts = self.allocation.column(dof.index());
        let made = &self.wrenches * thrusts;
        if (made[dof.index()] - 1.0).abs() > PUSHED {
            return 0.0;
        }
        let full = self.shared.thrusters.max_speed().powi(2);
        let weakest = full * self.law.forward.min(self.law.reverse);
        weakest / thrusts.amax()
    }

    /// Returns the driven axes.
    pub(super) fn driven(&self) -> impl Iterator<Item = Dof> + '_ {
        Dof::ALL.into_iter().filter(|dof| self.force[dof.index()] > 0.0)
    }

    /// Returns W − B, N.
    pub(super) fn weight_excess(&self) -> f64 {
        self.model.weight_excess()
    }

    /// Returns the ratio of reverse thrust to that of the analyst's curve.
    pub(super) fn reverse_ratio(&self) -> f64 {
        self.shared.thrusters.reverse / self.law.reverse
    }

    /// Returns the standard deviation of the tether's force on each driven axis, N or N m.
    pub(super) fn tether(&self) -> BTreeMap<Dof, f64> {
        let part = self.shared.strength_of(Disturbance::Tether, self.spec.tether_part);
        self.driven().map(|dof| (dof, part * self.force[dof.index()])).collect()
    }

    /// Returns the true vehicle.
    pub(super) fn true_vehicle(&self) -> Result<Vehicle, Error> {
        self.vehicle(Vector3::zeros())
    }

    /// Returns the vehicle of the analyst.
    pub(super) fn believed_vehicle(&self, model: &PlantModel) -> Result<Vehicle, Error> {
        let off = self.shared.strength_of(Disturbance::Lever, self.shared.strength.lever_m);
        let vehicle = self.vehicle(Vector3::new(off, 0.0, off))?;
        Ok(Vehicle { rigid_body: model.rigid_body, ..vehicle })
    }

    /// Returns a vehicle with its own thrusters, and the instruments of Jason 2 at positions scaled
    /// to its size, the DVL shifted by `dvl_off` aft and up.
    fn vehicle(&self, dvl_off: Vector3<f64>) -> Result<Vehicle, Error> {
        let mut vehicle = self.shared.true_vehicle()?;
        vehicle.name = self.model.name.clone();
        vehicle.dry_mass_kg = self.model.rigid_body.as_ref().map(|body| body.mass_kg());
        vehicle.size_m = self.model.size_m;
        vehicle.thrusters = self.model.thrusters.clone();
        vehicle.sensors.dvl.position_body *= self.scale;
        vehicle.sensors.dvl.position_body -= dvl_off;
        vehicle.sensors.depth.position_body *= self.scale;
        Ok(vehicle)
    }

    /// Creates the thrusters of one trial, between two fractions of the running time of all, which
    /// lasts `duration_s`.
    pub(super) fn thrusters(
        &self,
        streams: &Streams<'_>,
        ticks: usize,
        ((before, after), duration_s): ((f64, f64), f64),
    ) -> Thrusters<'_> {
        let most = self.shared.thrusters.max_speed();
        let jitter = |thruster: &Thruster| {
            let stream = streams.stream(&format!("{} jitter", thruster.name));
            ornstein_uhlenbeck(stream, JITTER_PART * most, JITTER_CORRELATION_S, ticks)
        };
        let sag = self.shared.strength_of(Disturbance::BatterySag, self.shared.strength.sag_part);
        Thrusters {
            rig: self,
            screw: Screw::new(&self.shared),
            motor: Motor::new(&self.shared),
            delay_s: self.shared.strength_of(Disturbance::Delay, self.shared.strength.delay_s),
            jitter: self.model.thrusters.iter().map(jitter).collect(),
            sag: (sag * before, sag * (after - before) / duration_s),
            commands: vec![Vec::with_capacity(ticks); self.model.thrusters.len()],
            speeds: vec![0.0; self.model.thrusters.len()],
        }
    }
}

/// Returns the law that all thrusters share.
fn law_of(thrusters: &[Thruster]) -> Result<(ThrusterInput, QuadraticThrust), Error> {
    let expected = "a plant with thrusters, all by one quadratic curve in command or speed; add `[[thruster]]` to its file";
    let Some(first) = thrusters.first() else {
        return Err(refused("vehicle", "a plant without thrusters", expected));
    };
    if let Some(other) = thrusters.iter().find(|thruster| thruster.curve != first.curve) {
        let found = format!("thruster `{}`, whose curve is unlike that of the first", other.name);
        return Err(refused("vehicle", &found, expected));
    }
    match first.curve {
        ThrustCurve::Quadratic {
            input: input @ (ThrusterInput::Speed | ThrusterInput::Command),
            law,
        } if law.exponent == 2.0
            && law.neutral == 0.0
            && law.forward > 0.0
            && law.reverse > 0.0 =>
        {
            Ok((input, law))
        }
        _ => Err(refused(
            "vehicle",
            "a plant whose thrust curve is not quadratic about zero",
            expected,
        )),
    }
}

/// Returns the thrusters of the twin, limited to the requested speed, or otherwise that of their
/// table.
fn thrusters_of(
    requested: Option<f64>,
    stated: Option<f64>,
    (input, law): (ThrusterInput, QuadraticThrust),
) -> Result<TwinThrusters, Error> {
    let max_rpm = match (input, requested) {
        (ThrusterInput::Speed, _) => requested.or(stated).ok_or_else(|| {
            let expected = "stated, here or by the thrusters of the vehicle's file: its thrust is by propeller speed";
            refused("max_rpm", "missing", expected)
        })?,
        (_, None) => 1.0 / RPM,
        (_, Some(rpm)) => {
            let expected = "left out: the vehicle's thrust is by command, of which 1 is full";
            return Err(refused("max_rpm", &rpm.to_string(), expected));
        }
    };
    above_zero("max_rpm", max_rpm)?;
    Ok(TwinThrusters { forward: law.forward, reverse: law.reverse, max_rpm })
}

fn wrenches_of(thrusters: &[Thruster]) -> DMatrix<f64> {
    let columns: Vec<[f64; 6]> = thrusters.iter().map(Thruster::unit_wrench).collect();
    DMatrix::from_fn(6, columns.len(), |axis, at| columns[at][axis])
}

/// The thrusters during a simulation.
pub(super) struct Thrusters<'a> {
    rig: &'a Rig<'a>,
    screw: Screw,
    motor: Motor,
    delay_s: f64,
    jitter: Vec<Vec<f64>>,
    sag: (f64, f64),
    /// The commands of each at every tick so far.
    pub(super) commands: Vec<Vec<f64>>,
    speeds: Vec<f64>,
}

impl Thrusters<'_> {
    /// Allocates a wrench, N and N m, to commands.
    pub(super) fn allocate(&mut self, wrench: &Vector6<f64>) {
        let thrusts = &self.rig.allocation * wrench;
        for (at, commands) in self.commands.iter_mut().enumerate() {
            let jitter = self.jitter[at][commands.len()];
            let wanted = self.screw.speed_for(thrusts[at]) + jitter;
            let is_command = self.rig.model.thrusters[at].curve.input() == ThrusterInput::Command;
            commands.push(if is_command { quantised(wanted) } else { wanted });
        }
    }

    /// Advances the thrusters by a step from `t_s`; returns the wrench in its middle, at a velocity
    /// `through_water`.
    pub(super) fn advance(
        &mut self,
        t_s: f64,
        h: f64,
        through_water: &Vector6<f64>,
    ) -> Vector6<f64> {
        // A step lies within one tick; a millionth of one allows for rounding.
        let tick = (TICK_HZ * (t_s - self.delay_s) + 1e-6).floor();
        let mut wrench = Vector6::zeros();
        for (at, speed) in self.speeds.iter_mut().enumerate() {
            let (follows, gain) = self.rig.acting[at];
            let wanted = if tick < 0.0 { 0.0 } else { self.commands[follows][tick as usize] };
            let wanted = self.motor.turned_by(wanted);
            let middle = self.motor.after(0.5 * h, *speed, wanted);
            *speed = self.motor.after(h, *speed, wanted);
            let unit = self.rig.wrenches.fixed_view::<6, 1>(0, at);
            wrench += unit * (gain * self.screw.thrust(middle, unit.dot(through_water)));
        }
        let (before, per_s) = self.sag;
        wrench * (1.0 - before - per_s * t_s)
    }
}
