//! Records of trials for plants of several axes.

use std::collections::BTreeMap;

use nalgebra::{Vector3, Vector6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::force::{PlacedThrust, ThrusterTrack, placed_thrust};
use super::gained::{between, gained};
use super::signals::signals;
use super::slopes::{new_fixes, slope, velocity_by_fixes};
use super::{Role, TrialSetup, saturations};
use crate::motion::{KnownForce, KnownKind, smoothed_attitude};
use crate::navigation::{MeanAcceleration, Motion, Navigated, Recording, navigate};
use crate::plant::{Signal, ThrusterNumber};
use crate::series::{ROUNDING_S, union};
use crate::{Caveat, CaveatCode, Dof, Error, Grid, Timed, Vehicle};

/// A thruster of a plant of several axes: the wrench `w F`, with F its thrust.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedThruster {
    /// Name in channels.
    pub name: String,
    /// Its speed and thrust, with a lever arm of 1.
    pub track: ThrusterTrack,
    /// w, force and moment on each axis per newton of thrust, 1 and m, in SNAME order.
    pub wrench: Vector6<f64>,
}

impl PlacedThruster {
    /// Returns its speed and thrust as signals of effects, of a thruster without numbers of its own.
    pub(crate) fn signals(&self) -> [(Signal, Timed); 4] {
        let ThrusterTrack { speed, forward, reverse, .. } = &self.track;
        let thrust = speed.map(|n| n * n.abs() * if n < 0.0 { *reverse } else { *forward });
        let (name, speed, none) = (|| self.name.clone(), speed.clone(), speed.map(|_| 0.0));
        let by = |number| Signal::ThrustBy { number, thruster: name() };
        [
            (Signal::PropellerSpeed(name()), speed),
            (Signal::Thrust(name()), thrust),
            (by(ThrusterNumber::Lag), none.clone()),
            (by(ThrusterNumber::DeadBand), none),
        ]
    }
}

/// A thruster whose thrust in a trial differs from its log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ThrusterFault {
    /// Name of the trial.
    pub trial: String,
    /// Name of the thruster.
    pub thruster: String,
    /// Ratio of thrust to that of the log: 0 for one at rest, −1 for a reversed one.
    pub gain: f64,
}

/// Thrusters that do not follow their own log in any trial.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Miswired {
    /// One pushes the other way.
    Reversed(String),
    /// Each of two does what the log of the other says.
    Exchanged([String; 2]),
}

/// Forces, velocities and attitude of one trial, for a plant of several axes.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialRecord {
    /// Name of the trial.
    pub trial: String,
    /// Its role.
    pub role: Role,
    /// Force and moment on each axis, held, N and N m, in SNAME order; `None` without force.
    pub force: [Option<Timed>; 6],
    /// The thrusters that produce it; an axis without thrusters has a logged wrench.
    pub thrusters: Vec<PlacedThruster>,
    /// Velocity over ground in body axes, m/s and rad/s, in SNAME order.
    pub velocity: [Option<Timed>; 6],
    /// Variance of each sample of velocity relative to the mean, in SNAME order: a mean of n
    /// samples has 1/n of that of one; `None` for samples as logged.
    pub spread: [Option<Timed>; 6],
    /// True if velocity is the difference quotient of measured positions, in SNAME order:
    /// neighbouring errors are anticorrelated.
    pub by_slope: [bool; 6],
    /// True if a translational velocity is integrated from acceleration, without changes slower
    /// than [`GAINED_S`](crate::GAINED_S).
    pub by_acceleration: [bool; 3],
    /// North and east of the origin since the first fix, m, if surge or sway has no measured
    /// velocity; the second is absent along a straight line.
    pub fixes: Option<[Option<Timed>; 2]>,
    /// Depth of the origin, m, if heave has no measured velocity.
    pub depth: Option<Timed>,
    /// Heading, unwrapped, rad, if yaw has no measured velocity.
    pub heading: Option<Timed>,
    /// `ν̇ + ω × v` of the origin along surge, sway and heave, m/s², for those without measured
    /// velocity.
    pub acceleration: [Option<MeanAcceleration>; 3],
    /// Surge, sway and heave as measured at the instrument's position, `ν + ω × r`, m/s, at the
    /// times of `velocity`; `None` for an instrument at the origin.
    pub readings: [Option<Timed>; 3],
    /// r of each, from the origin in body axes, m.
    pub levers_m: [Vector3<f64>; 3],
    /// True if translations were measured along the world's axes, as by a satellite receiver, and turned into body
    /// axes by the attitude at their times: with a delay, that is not the attitude at which they were measured.
    pub is_turned: bool,
    /// From the origin to what measures fixes, in body axes, m.
    pub fixes_lever_m: Vector3<f64>,
    /// Logged angular velocity `[p, q, r]`, rad/s, if rates or attitude were logged.
    pub rates: Option<[Timed; 3]>,
    /// Roll, pitch and heading, unwrapped, rad; smoothed with the rates if these were measured.
    pub attitude: [Option<Timed>; 3],
    /// Measured roll and pitch, rad, if their rates were measured too.
    pub inclination: [Option<Timed>; 2],
    /// Variance of each sample of these relative to the mean.
    pub inclination_spread: [Option<Timed>; 2],
    /// Signals of effects: angles, inputs of propellers, velocity of the air.
    pub signals: BTreeMap<Signal, Timed>,
    /// Known forces.
    pub known: Vec<KnownForce>,
    /// Time window with complete data, s.
    pub window_s: (f64, f64),
    /// Reasons to doubt the record.
    pub caveats: Vec<Caveat>,
}

impl TrialRecord {
    /// Creates a record without data.
    pub(super) fn empty(trial: &str) -> Self {
        Self {
            trial: trial.to_owned(),
            role: Role::Fit,
            force: [const { None }; 6],
            thrusters: Vec::new(),
            velocity: [const { None }; 6],
            spread: [const { None }; 6],
            by_slope: [false; 6],
            by_acceleration: [false; 3],
            fixes: None,
            depth: None,
            heading: None,
            acceleration: [const { None }; 3],
            readings: [const { None }; 3],
            levers_m: [Vector3::zeros(); 3],
            is_turned: false,
            fixes_lever_m: Vector3::zeros(),
            rates: None,
            attitude: [const { None }; 3],
            inclination: [const { None }; 2],
            inclination_spread: [const { None }; 2],
            signals: BTreeMap::new(),
            known: Vec::new(),
            window_s: (0.0, 0.0),
            caveats: Vec::new(),
        }
    }

    /// Creates a record without data, for tests.
    #[cfg(test)]
    pub(crate) fn until(trial: &str, last_s: f64) -> Self {
        Self { window_s: (0.0, last_s), ..Self::empty(trial) }
    }
}

/// Time after the start of the log, s, until thrust is independent of its unknown past: ten time
/// constants of a propeller …
const SETTLING_S: f64 = 3.0;
/// … or this fraction of a short trial.
const SETTLING_PART: f64 = 0.05;

/// Least number of samples of an axis.
const LEAST_SAMPLES: usize = 30;

impl TrialRecord {
    /// Returns the measured velocity at a time, interpolated; zero on axes without.
    pub(crate) fn velocity_at(&self, t_s: f64) -> Vector6<f64> {
        let at = |series: &Timed| series.at(t_s);
        Vector6::from_fn(|k, _| self.velocity[k].as_ref().map_or(0.0, at))
    }

    /// Creates the record of some axes from a recording.
    ///
    /// Velocity is the measured one, otherwise the derivative of heading, roll, pitch or depth, or
    /// of position fixes, or the integral of acceleration, with a caveat.
    ///
    /// # Errors
    /// [`Error::MissingChannel`] if an axis has no motion or no axis has a force,
    /// [`Error::NoOverlap`] if they do not overlap in time, [`Error::TooShort`] if an axis has
    /// fewer than 30 samples.
    pub fn new(
        setup: &TrialSetup,
        recording: &Recording,
        vehicle: &Vehicle,
        axes: &[Dof],
    ) -> Result<Self, Error> {
        let navigated = navigate(&setup.name, recording, &vehicle.sensors)?;
        let mut caveats = Vec::new();
        let PlacedThrust { force, thrusters, saturated } = placed_thrust(recording, vehicle);
        caveats.extend(saturations(&setup.name, &saturated));
        let force = force.map(|force| Some(held_means(&force?)));
        let thrusters: Vec<PlacedThruster> =
            thrusters.into_iter().map(PlacedThruster::thinned).collect();
        let mut velocity = Dof::ALL.map(|dof| navigated.measured.get(&dof).cloned());
        let (mut by_fixes, mut by_slope) = (None, [false; 6]);
        for &dof in axes {
            if velocity[dof.index()].is_some() {
                continue;
            }
            let found = match (dof, navigated.by_position.get(&dof)) {
                (Dof::Surge | Dof::Sway, _) => {
                    if by_fixes.is_none() {
                        by_fixes = velocity_by_fixes(recording, &navigated)?;
                    }
                    by_fixes.as_ref().map(|both| both[dof.index()].clone())
                }
                (_, Some(Motion::Position(path))) => Some(slope(path)?),
                _ => None,
            };
            by_slope[dof.index()] = found.is_some();
            velocity[dof.index()] = found;
        }
        let unmeasured = |dof: Dof| axes.contains(&dof) && !navigated.measured.contains_key(&dof);
        let depth = navigated.depth.as_ref().filter(|_| unmeasured(Dof::Heave));
        let depth = depth.map(|depth| means_over(depth, &[], DEPTH_S).0);
        let instants = instants(axes, &navigated, &force, depth.as_ref());
        let mut acceleration = [const { None }; 3];
        for dof in [Dof::Surge, Dof::Sway, Dof::Heave].into_iter().filter(|dof| unmeasured(*dof)) {
            let from_acceleration = navigated.acceleration.get(&dof);
            let from_acceleration = from_acceleration
                .map(|from_acceleration| between(from_acceleration, &instants))
                .transpose()?;
            acceleration[dof.index()] = from_acceleration;
        }
        let by_acceleration = gained(&acceleration, navigated.rates.as_ref(), &mut velocity)?;
        for &dof in axes {
            if velocity[dof.index()].is_none() {
                return Err(missing_motion(&setup.name, dof));
            }
        }
        let lacks_surge_or_sway = unmeasured(Dof::Surge) || unmeasured(Dof::Sway);
        let fixes = match navigated.heading.is_some() && lacks_surge_or_sway {
            true => new_fixes(recording, &navigated)?.map(|both| both.map(Some)),
            false => None,
        };
        let heading = navigated.heading.as_ref().filter(|_| unmeasured(Dof::Yaw));
        let heading = heading.map(|heading| means(heading, &[]).0);
        caveats.extend(unmeasured_axes(&setup.name, &by_slope, by_acceleration));
        let signals = signals(recording, vehicle, &navigated, &velocity)?;
        let drives = signals.iter().filter(|(signal, _)| signal.is_held());
        let drives: Vec<Timed> = drives.map(|(_, x)| held_means(x)).collect();
        let pushes = force.iter().flatten().chain(&drives);
        let changes = union(pushes.map(Timed::time_s));
        let mut signals: BTreeMap<Signal, Timed> = signals
            .into_iter()
            .map(|(signal, x)| (signal.clone(), signal_means(&signal, &x, &changes)))
            .collect();
        signals.extend(thrusters.iter().flat_map(PlacedThruster::signals));
        let is_pushed = signals.keys().any(Signal::pushes);
        let has_force = |dof: &Dof| force[dof.index()].is_some();
        if !is_pushed && !axes.iter().any(has_force) {
            return Err(Error::MissingChannel {
                trial: setup.name.clone(),
                what: format!("force on any of {}", names(axes)),
                advice: "give thrusters, rudders or fins in vehicle.toml, or map wrench.surge, say"
                    .to_owned(),
            });
        }
        let readings = [0, 1, 2].map(|axis| {
            let read = navigated.readings(Dof::ALL[axis], velocity[axis].as_ref()?)?;
            Some(means(&read, &changes).0)
        });
        let mut spread = [const { None }; 6];
        for (series, spread) in velocity.iter_mut().zip(&mut spread) {
            if let Some(series) = series {
                (*series, *spread) = means(series, &changes);
            }
        }
        let turns = [Dof::Roll, Dof::Pitch, Dof::Yaw];
        let angles = turns.map(|dof| match dof {
            Dof::Yaw => navigated.heading.clone(),
            _ => navigated.position.get(&dof).cloned(),
        });
        let mut inclination_spread = [const { None }; 2];
        let mut inclination = [0, 1].map(|which| {
            let has_rate = navigated.measured.contains_key(&turns[which]);
            angles[which].clone().filter(|_| has_rate)
        });
        for (series, spread) in inclination.iter_mut().zip(&mut inclination_spread) {
            if let Some(series) = series {
                (*series, *spread) = means(series, &changes);
            }
        }
        let attitude = smoothed_attitude(angles, turns.map(|dof| navigated.measured.get(&dof)));
        let mut record = Self {
            trial: setup.name.clone(),
            role: setup.role,
            force,
            thrusters,
            velocity,
            spread,
            by_slope,
            by_acceleration,
            fixes,
            depth,
            heading,
            acceleration,
            readings,
            levers_m: [0, 1, 2].map(|axis| navigated.lever(Dof::ALL[axis]).unwrap_or_default()),
            is_turned: navigated.is_turned,
            fixes_lever_m: vehicle.sensors.position.position_body,
            rates: navigated.rates.clone(),
            attitude,
            inclination,
            inclination_spread,
            signals,
            known: setup.known.clone(),
            window_s: (0.0, 0.0),
            caveats,
        };
        record.check_known(axes)?;
        record.window_s = record.common_window(setup, axes)?;
        record.check_length(axes)?;
        Ok(record)
    }

    /// Returns whether an instrument measures the velocity of an axis; also true for the derivative
    /// of roll or pitch, for which the filter has no state.
    pub(crate) fn is_measured(&self, dof: Dof) -> bool {
        let axis = dof.index();
        let is_of_attitude = matches!(dof, Dof::Roll | Dof::Pitch);
        let is_made = self.by_slope[axis] || self.by_acceleration.get(axis).is_some_and(|by| *by);
        self.velocity[axis].is_some() && (is_of_attitude || !is_made)
    }

    /// Refuses a weight whose force on the axes depends on attitude that was not logged.
    fn check_known(&self, axes: &[Dof]) -> Result<(), Error> {
        let is_weight = |known: &KnownForce| matches!(known.kind, KnownKind::Weight { .. });
        let acts_level = axes.iter().any(|dof| matches!(dof, Dof::Heave | Dof::Roll | Dof::Pitch));
        let is_tilted = self.attitude[..2].iter().any(Option::is_some);
        match self.known.iter().any(is_weight) && !acts_level && !is_tilted {
            false => Ok(()),
            true => Err(Error::MissingChannel {
                trial: self.trial.clone(),
                what: format!("roll and pitch, by which a known weight acts on {}", names(axes)),
                advice: "map attitude.roll and attitude.pitch, add heave to the axes, or give a line in place of the weight".to_owned(),
            }),
        }
    }

    /// Returns the forces that no thruster makes, by their axes.
    fn forces_without_thrusters(&self) -> impl Iterator<Item = (usize, ThrusterTrack)> {
        let is_of_thrusters =
            |axis: usize| self.thrusters.iter().any(|own| own.wrench[axis] != 0.0);
        let forces = self.force.iter().enumerate();
        forces
            .filter(move |(axis, _)| !is_of_thrusters(*axis))
            .filter_map(|(axis, force)| Some((axis, ThrusterTrack::of_force(1.0, force.as_ref()?))))
    }

    /// Returns the longest time between samples of thrust that was logged so slowly that its values between samples
    /// matter, s; 0 if none was.
    pub(crate) fn slow_thrust_period_s(&self) -> f64 {
        self.longest_thrust_period_s(ThrusterTrack::is_slow)
    }

    /// Returns the longest time between samples of thrust, s; 0 if none was logged.
    pub(crate) fn thrust_period_s(&self) -> f64 {
        self.longest_thrust_period_s(|_| true)
    }

    fn longest_thrust_period_s(&self, counts: impl Fn(&ThrusterTrack) -> bool) -> f64 {
        let of_forces: Vec<ThrusterTrack> =
            self.forces_without_thrusters().map(|(_, track)| track).collect();
        let of_thrusters = self.thrusters.iter().map(|own| &own.track);
        let counted = of_thrusters.chain(&of_forces).filter(|track| counts(track));
        counted.map(|track| track.speed.period_s()).fold(0.0, f64::max)
    }

    /// Returns how far slowly logged thrust on an axis is at a sample from the mean of its neighbours, relative to
    /// all thrust on it and as a root mean square: 1 − cos ωT for a sinusoid.
    pub(crate) fn thrust_beyond_neighbours(&self, dof: Dof) -> f64 {
        let [mut all, mut beyond] = [0.0, 0.0];
        let mut add = |track: &ThrusterTrack, lever: f64| {
            let [of_all, of_beyond] = track.beyond_neighbours();
            all += lever * lever * of_all;
            beyond += if track.is_slow() { lever * lever * of_beyond } else { 0.0 };
        };
        self.thrusters.iter().for_each(|own| add(&own.track, own.wrench[dof.index()]));
        let forces = self.forces_without_thrusters().filter(|(axis, _)| *axis == dof.index());
        forces.for_each(|(_, track)| add(&track, 1.0));
        (beyond / all.max(f64::MIN_POSITIVE)).sqrt()
    }

    /// Returns whether an axis has a force.
    pub fn is_driven(&self, dof: Dof) -> bool {
        let force = self.force[dof.index()].as_ref();
        force.is_some_and(|force| force.values().iter().any(|x| *x != 0.0))
    }

    /// Returns the values of some signals at an instant; zero for missing ones.
    pub(crate) fn signals_at(&self, wanted: &[Signal], t_s: f64) -> Vec<f64> {
        wanted.iter().map(|signal| self.signal_at(signal, t_s)).collect()
    }

    /// Returns the record with the thrust of a thruster multiplied by a gain.
    ///
    /// # Errors
    /// As [`Timed::new`], if a force is not finite.
    pub(crate) fn with_gain(&self, thruster: &str, gain: f64) -> Result<Self, Error> {
        self.with_track(thruster, |track| {
            let (forward, reverse) = (gain * track.forward, gain * track.reverse);
            Ok(ThrusterTrack { forward, reverse, ..track.clone() })
        })
    }

    /// The same with another track of a thruster.
    pub(crate) fn with_track(
        &self,
        thruster: &str,
        changed: impl Fn(&ThrusterTrack) -> Result<ThrusterTrack, Error>,
    ) -> Result<Self, Error> {
        let mut record = self.clone();
        for own in record.thrusters.iter_mut().filter(|own| own.name == thruster) {
            let [_, (_, before), ..] = own.signals();
            own.track = changed(&own.track)?;
            let [_, (_, after), ..] = own.signals();
            for (force, way) in record.force.iter_mut().zip(own.wrench.iter()) {
                let Some(series) = force.as_mut().filter(|_| *way != 0.0) else { continue };
                let more =
                    |(t, x): (&f64, &f64)| x + way * (after.held_at(*t) - before.held_at(*t));
                let values = series.time_s().iter().zip(series.values()).map(more).collect();
                *series = series.with_values("force", values)?;
            }
            record.signals.extend(own.signals());
        }
        Ok(record)
    }

    /// The same with two thrusters of which each does what the log of the other says.
    ///
    /// # Errors
    /// As [`Self::with_gain`].
    pub(crate) fn with_exchanged(&self, a: &str, b: &str) -> Result<Self, Error> {
        let speed = |name: &str| {
            let own = self.thrusters.iter().find(|own| own.name == name);
            own.map(|own| own.track.speed.clone())
        };
        let Some((of_a, of_b)) = speed(a).zip(speed(b)) else { return Ok(self.clone()) };
        self.with_speed(a, &of_b)?.with_speed(b, &of_a)
    }

    /// The same with logs as thrusters follow them.
    pub(crate) fn with_miswired(&self, which: &Miswired) -> Result<Self, Error> {
        match which {
            Miswired::Reversed(name) => self.with_gain(name, -1.0),
            Miswired::Exchanged([a, b]) => self.with_exchanged(a, b),
        }
    }

    /// The same with several pairs.
    pub(crate) fn with_all_exchanged(&self, pairs: &[[String; 2]]) -> Result<Self, Error> {
        pairs.iter().try_fold(self.clone(), |record, [a, b]| record.with_exchanged(a, b))
    }

    /// The same with another speed of a thruster.
    fn with_speed(&self, thruster: &str, speed: &Timed) -> Result<Self, Error> {
        let mut record = self.clone();
        for own in record.thrusters.iter_mut().filter(|own| own.name == thruster) {
            let [_, (_, before), ..] = own.signals();
            own.track.speed = speed.clone();
            let [_, (_, now), ..] = own.signals();
            for (force, way) in record.force.iter_mut().zip(own.wrench.iter()) {
                let Some(series) = force.as_mut().filter(|_| *way != 0.0) else { continue };
                let first_s = series.first_s();
                let mut times = union([series.time_s(), speed.time_s()].into_iter());
                times.retain(|t| *t >= first_s);
                let moved =
                    |t: &f64| series.held_at(*t) + way * (now.held_at(*t) - before.held_at(*t));
                let values: Vec<f64> = times.iter().map(moved).collect();
                *series = Timed::new("force", times, values)?;
            }
            record.signals.extend(own.signals());
        }
        Ok(record)
    }

    /// The same with the force of axes that no thruster explains as many times as great.
    pub(crate) fn with_wrench_scaled(&self, scale: f64) -> Result<Self, Error> {
        let mut record = self.clone();
        for (axis, force) in record.force.iter_mut().enumerate() {
            let is_logged = !self.thrusters.iter().any(|own| own.wrench[axis] != 0.0);
            if let Some(series) = force.as_mut().filter(|_| is_logged) {
                let values = series.values().iter().map(|x| scale * x).collect();
                *series = series.with_values("force", values)?;
            }
        }
        Ok(record)
    }

    /// Returns the value of a signal at an instant; zero if missing.
    pub(crate) fn signal_at(&self, signal: &Signal, t_s: f64) -> f64 {
        self.signals.get(signal).map_or(0.0, |x| signal.value(x, t_s))
    }

    fn common_window(&self, setup: &TrialSetup, axes: &[Dof]) -> Result<(f64, f64), Error> {
        let mut from = setup.from_s.unwrap_or(f64::NEG_INFINITY);
        let mut to = setup.to_s.unwrap_or(f64::INFINITY);
        let span = |what: String, series: &Timed| {
            format!("{what}, from {:.1} to {:.1} s,", series.first_s(), series.last_s())
        };
        let mut before = "the trial's window".to_owned();
        for &dof in axes {
            let motion = self.velocity[dof.index()].as_ref().map(|x| ("motion", x, x.last_s()));
            let force = self.force[dof.index()].as_ref().map(|x| {
                let held = if x.len() == 1 { f64::INFINITY } else { x.last_s() + x.period_s() };
                ("force", x, held)
            });
            for (what, series, last) in motion.into_iter().chain(force) {
                from = from.max(series.first_s());
                to = to.min(last);
                let what = span(format!("the {dof} {what}"), series);
                if from >= to {
                    return Err(Error::NoOverlap {
                        trial: self.trial.clone(),
                        first: before,
                        second: what,
                    });
                }
                before = what;
            }
        }
        for (signal, series) in &self.signals {
            let held = if signal.is_held() { series.period_s() } else { 0.0 };
            (from, to) = (from.max(series.first_s()), to.min(series.last_s() + held));
            let what = span(signal.to_string(), series);
            if from >= to {
                return Err(Error::NoOverlap {
                    trial: self.trial.clone(),
                    first: before,
                    second: what,
                });
            }
            before = what;
        }
        // Lagging thrust depends on inputs before the start of its log.
        let logged_s = self.force.iter().flatten().map(Timed::first_s).reduce(f64::min);
        let settling_s = SETTLING_S.min(SETTLING_PART * (to - from));
        Ok((logged_s.map_or(from, |logged_s| from.max(logged_s + settling_s)), to))
    }

    fn check_length(&self, axes: &[Dof]) -> Result<(), Error> {
        for &dof in axes {
            let (from, to) = self.window_s;
            let velocity = self.velocity[dof.index()].as_ref();
            let found = velocity.and_then(|x| x.window(from, to)).map_or(0, |x| x.len());
            if found < LEAST_SAMPLES {
                return Err(Error::TooShort {
                    name: format!("the {dof} motion of trial `{}`", self.trial),
                    found,
                    needed: LEAST_SAMPLES,
                });
            }
        }
        Ok(())
    }
}

/// Averaging window of depth, s: acceleration and thrust determine faster motion.
const DEPTH_S: f64 = 0.2;

/// Returns the instants of the filter's updates, between which means of acceleration need no
/// updates of their own.
fn instants(
    axes: &[Dof],
    navigated: &Navigated,
    force: &[Option<Timed>; 6],
    depth: Option<&Timed>,
) -> Vec<f64> {
    let changes = union(force.iter().flatten().map(Timed::time_s));
    let measured = axes.iter().filter_map(|dof| navigated.measured.get(dof));
    let measured: Vec<Timed> = measured.map(|series| means(series, &changes).0).collect();
    let instants = union(measured.iter().chain(depth).map(Timed::time_s));
    let from_acceleration = navigated.acceleration.values().next();
    match from_acceleration
        .filter(|from_acceleration| instants.len() < from_acceleration.mean.len() / 20)
    {
        Some(from_acceleration) => from_acceleration.mean.time_s().to_vec(),
        None => instants,
    }
}

fn names(axes: &[Dof]) -> String {
    let names: Vec<&str> = axes.iter().map(|dof| dof.name()).collect();
    names.join(", ")
}

/// Returns caveats on axes without a measured velocity, with the measurements used instead.
fn unmeasured_axes(trial: &str, by_slope: &[bool; 6], by_acceleration: [bool; 3]) -> Vec<Caveat> {
    let note_on = |wanted: &dyn Fn(Dof) -> bool, from: &str| {
        let axes: Vec<Dof> = Dof::ALL.into_iter().filter(|dof| wanted(*dof)).collect();
        (!axes.is_empty()).then(|| {
            let message = format!(
                "trial `{trial}`: no instrument measures the velocity of {}: the filter estimates it from {from}",
                names(&axes)
            );
            (axes, message)
        })
    };
    let is_angle = |dof: Dof| matches!(dof, Dof::Roll | Dof::Pitch);
    let by_position =
        note_on(&|dof| by_slope[dof.index()] && !is_angle(dof), "position, depth or heading");
    let by_angle = note_on(&|dof| by_slope[dof.index()] && is_angle(dof), "the slope of the angle");
    let from_acceleration = note_on(
        &|dof| by_acceleration.get(dof.index()) == Some(&true),
        "acceleration and thrust, and scores compare it without what changes in more than 10 s",
    );
    let note = |(_, message): (Vec<Dof>, String)| Caveat::note(CaveatCode::Navigation, message);
    let warning = |(_, message): (Vec<Dof>, String)| {
        let advice = "log rates, such as a gyroscope's";
        Caveat::warning(CaveatCode::Navigation, format!("{message}; {advice}"))
    };
    let notes = by_position.into_iter().chain(from_acceleration).map(note);
    notes.chain(by_angle.map(warning)).collect()
}

fn missing_motion(trial: &str, dof: Dof) -> Error {
    let advice = match dof {
        Dof::Surge | Dof::Sway => format!(
            "map velocity.{dof} or dvl.velocity, or position (north and east, or latitude and longitude) and attitude.heading, or acceleration with attitude.roll and attitude.pitch; or leave {dof} out of axes"
        ),
        Dof::Heave => "map velocity.heave, dvl.velocity.z or depth".to_owned(),
        Dof::Roll => "map rate.roll or attitude.roll, or leave roll out of axes".to_owned(),
        Dof::Pitch => "map rate.pitch or attitude.pitch, or leave pitch out of axes".to_owned(),
        Dof::Yaw => "map rate.yaw or attitude.heading".to_owned(),
    };
    Error::MissingChannel { trial: trial.to_owned(), what: format!("velocity for {dof}"), advice }
}

/// Averaging window of series with a higher sampling rate, s: below the time scale of the
/// coefficients, to save filter steps.
const FINEST_S: f64 = 0.05;

/// Averages a series to this period, each mean at the mean of its times; also returns the variance
/// of each relative to the mean.
///
/// No mean extends over an instant of `changes`, increasing times at which forces change, and the
/// last sample before it is kept as it is: an autopilot reacts to it, and a filter without that
/// sample would attribute the autopilot's response to the vehicle.
pub(super) fn means(series: &Timed, changes: &[f64]) -> (Timed, Option<Timed>) {
    means_over(series, changes, FINEST_S)
}

/// Averages as [`means`], to another period.
fn means_over(series: &Timed, changes: &[f64], finest_s: f64) -> (Timed, Option<Timed>) {
    if series.period_s() >= 0.9 * finest_s {
        return (series.clone(), None);
    }
    let times = series.time_s();
    let before = |t: f64| changes.partition_point(|change| *change < t - ROUNDING_S);
    let bin = |k: usize| {
        let (t, change) = (times[k], before(times[k]));
        let from = if change > 0 { changes[change - 1] } else { series.first_s() };
        let is_last = times.get(k + 1).is_some_and(|next| before(*next) > change);
        (change, is_last, ((t - from - ROUNDING_S) / finest_s).ceil())
    };
    let samples: Vec<usize> = (0..series.len()).collect();
    let parts: Vec<&[usize]> = samples.chunk_by(|a, b| bin(*a) == bin(*b)).collect();
    let mean =
        |part: &[usize], of: &[f64]| part.iter().map(|k| of[*k]).sum::<f64>() / part.len() as f64;
    let time_s: Vec<f64> = parts.iter().map(|part| mean(part, times)).collect();
    let values: Vec<f64> = parts.iter().map(|part| mean(part, series.values())).collect();
    let shares: Vec<f64> = parts.iter().map(|part| 1.0 / part.len() as f64).collect();
    let all = shares.iter().sum::<f64>() / shares.len() as f64;
    let spread: Vec<f64> = shares.iter().map(|share| share / all).collect();
    // Means of increasing times increase.
    match Timed::new("means", time_s.clone(), values) {
        Ok(means) => (means, Timed::new("spread", time_s, spread).ok()),
        Err(_) => (series.clone(), None),
    }
}

/// Averages a held series to this period, with the same mean over each step.
pub(super) fn held_means(force: &Timed) -> Timed {
    if force.len() < 2 || force.period_s() >= 0.9 * FINEST_S {
        return force.clone();
    }
    let first_s = force.first_s() + 0.5 * FINEST_S;
    let grid = Grid::spanning(first_s, force.last_s(), FINEST_S);
    let starts: Vec<f64> = grid.times().map(|t| t - 0.5 * FINEST_S).collect();
    Timed::new("force", starts, force.held_means(grid)).unwrap_or_else(|_| force.clone())
}

impl PlacedThruster {
    /// Averages speed to this period, with the same mean thrust over each step.
    pub(super) fn thinned(self) -> Self {
        let squares = held_means(&self.track.speed.map(|n| n * n.abs()));
        let speed = squares.map(|square| square.abs().sqrt().copysign(square));
        Self { track: ThrusterTrack { speed, ..self.track }, ..self }
    }
}

/// Averages a signal of an effect.
fn signal_means(signal: &Signal, series: &Timed, changes: &[f64]) -> Timed {
    if signal.is_held() { held_means(series) } else { means(series, changes).0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_at_200_hz_is_averaged_to_20_hz() {
        let time_s: Vec<f64> = (0..2000).map(|k| 0.005 * f64::from(k)).collect();
        let ramp = Timed::new("ramp", time_s.clone(), time_s.clone()).expect("valid");
        let (found, _) = means(&ramp, &[]);
        assert!((found.period_s() - FINEST_S).abs() < 1e-9, "{}", found.period_s());
        // A mean at the mean of its times is on the line.
        let off = found.time_s().iter().zip(found.values()).map(|(t, x)| (t - x).abs());
        assert!(off.fold(0.0, f64::max) < 1e-9);
        let force = held_means(&ramp);
        let middle = |t: f64| force.held_at(t);
        assert!((middle(1.01) - 1.0225).abs() < 3e-3, "{}", middle(1.01));
        let slow = Timed::new("slow", vec![0.0, 0.1, 0.2], vec![1.0; 3]).expect("valid");
        assert_eq!((means(&slow, &[]), held_means(&slow)), ((slow.clone(), None), slow));
    }

    #[test]
    fn the_last_sample_before_a_change_of_thrust_is_kept() {
        let time_s: Vec<f64> = (0..51).map(|k| 0.02 * f64::from(k)).collect();
        let ramp = Timed::new("ramp", time_s.clone(), time_s).expect("valid");
        // The same for a change at a sample and between two.
        for late in [0.0, 0.007] {
            let changes: Vec<f64> = (0..10).map(|k| 0.1 * f64::from(k) + late).collect();
            let (found, spread) = means(&ramp, &changes);
            // 0, then the means of 0.02 and 0.04 and of 0.06 and 0.08, and 0.1.
            let wanted = [0.0, 0.03, 0.07, 0.1, 0.13, 0.17, 0.2];
            for (found, wanted) in found.time_s().iter().zip(wanted) {
                assert!((found - wanted).abs() < 1e-12, "{late}: {found}, not {wanted}");
            }
            let spread = spread.expect("means of one and of two");
            assert!((spread.values()[3] / spread.values()[2] - 2.0).abs() < 1e-12);
        }
    }
}
