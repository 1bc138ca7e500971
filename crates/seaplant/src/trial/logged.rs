//! The log of all axes of one trial, on one grid, for the detection of users' mistakes.

use nalgebra::Vector3;

use super::TrialSetup;
use super::force::{PlacedThrust, placed_thrust};
use super::signals::signals;
use super::slopes::{slope, velocity_by_fixes};
use crate::navigation::{Motion, Navigated, Recording, navigate, unwrap};
use crate::plant::{Effect, Signal};
use crate::quantity::{Attitude, Axis, World};
use crate::{Dof, Grid, Quantity, Timed, Vehicle, VehicleEffect};

/// A thruster with its thrust and wrench.
#[derive(Clone, Debug)]
pub(crate) struct LoggedThruster {
    /// Name in the vehicle file.
    pub(crate) name: String,
    /// Force and moment on each axis per newton of thrust, 1 and m, in SNAME order.
    pub(crate) wrench: [f64; 6],
    /// Its thrust, N.
    pub(crate) thrust: Vec<f64>,
}

/// A force of unknown strength: of a rudder, a fin or a propeller.
#[derive(Clone, Debug)]
pub(crate) struct LoggedEffect {
    /// Its force per unit of strength.
    pub(crate) effect: Effect,
    /// The signals on which it depends, in its order.
    pub(crate) signals: Vec<(Signal, Vec<f64>)>,
}

/// Velocity over ground, and the heading that turns it to the body's axes.
#[derive(Clone, Debug)]
pub(crate) struct OverGround {
    /// Heading as logged, rad: one in degrees is unwrapped after it is corrected.
    logged: Timed,
    /// Heading, unwrapped, rad.
    heading: Timed,
    /// Velocity of the sensor north and east, m/s.
    pub(crate) velocity: [Timed; 2],
}

impl OverGround {
    /// Returns the velocity of a level vehicle forward and to starboard.
    pub(crate) fn along_body(&self, grid: Grid) -> [Vec<f64>; 2] {
        let [north, east] = &self.velocity;
        let turned = |(t, (north, east)): (&f64, (&f64, &f64))| {
            let (sin, cos) = self.heading.at(*t).sin_cos();
            [cos * north + sin * east, cos * east - sin * north]
        };
        let both = north.values().iter().zip(east.values());
        let both: Vec<[f64; 2]> = north.time_s().iter().zip(both).map(turned).collect();
        [0, 1].map(|k| {
            let values = both.iter().map(|v| v[k]).collect();
            let series = north.with_values("velocity", values);
            series.map_or_else(|_| vec![0.0; grid.len], |series| means(&series, grid))
        })
    }

    /// Returns the yaw rate of a level vehicle.
    pub(crate) fn yaw_rate(&self, grid: Grid) -> Vec<f64> {
        slope(&self.heading).map_or_else(|_| vec![0.0; grid.len], |rate| means(&rate, grid))
    }

    /// Changes the heading.
    pub(crate) fn turn(&mut self, heading: impl Fn(f64) -> f64) {
        self.logged = self.logged.map(heading);
        self.heading = unwrap(&self.logged);
    }
}

/// Forces, velocities, angles and positions of one trial at the same instants.
#[derive(Clone, Debug)]
pub(crate) struct Logged {
    /// The axes that it identifies, alone or together.
    pub(crate) axes: Vec<Dof>,
    /// The instants.
    pub(crate) grid: Grid,
    /// True if all data are present at an instant.
    pub(crate) is_whole: Vec<bool>,
    /// Velocity in body axes, m/s and rad/s, in SNAME order.
    pub(crate) velocity: [Option<Vec<f64>>; 6],
    /// Lever arms of the sensors of surge, sway and heave, m; zero where velocity is measured at the origin.
    pub(crate) levers_m: [Vector3<f64>; 3],
    /// The channel of each velocity.
    pub(crate) source: [Option<Quantity>; 6],
    /// Logged wrenches, N and N m, in SNAME order.
    pub(crate) wrench: [Option<Vec<f64>>; 6],
    /// The thrusters; empty if wrenches are logged.
    pub(crate) thrusters: Vec<LoggedThruster>,
    /// Forces of unknown strength.
    pub(crate) effects: Vec<LoggedEffect>,
    /// Velocity over ground, if surge and sway are that, turned by heading.
    pub(crate) over_ground: Option<OverGround>,
    /// Roll, pitch and heading, unwrapped, rad.
    pub(crate) angles: [Option<Vec<f64>>; 3],
    /// Depth, m.
    pub(crate) depth: Option<Vec<f64>>,
}

/// Longest part of a trial that is examined, s: a mistake is evident in an hour.
const LONGEST_S: f64 = 3600.0;

/// Period of the instants, s, below the time scale of a vehicle.
const PERIOD_S: f64 = 0.2;

/// Least number of instants.
const LEAST_INSTANTS: usize = 150;

/// Steps longer than this, in sampling periods and in seconds, are gaps.
const GAP_PERIODS: f64 = 5.0;
const GAP_S: f64 = 1.0;

impl Logged {
    /// Resamples a recording; `None` for a trial that is too short, or cannot be navigated.
    pub(super) fn new(
        setup: &TrialSetup,
        recording: &Recording,
        vehicle: &Vehicle,
    ) -> Option<Self> {
        let recording = beginning(setup, recording);
        let navigated = navigate(&setup.name, &recording, &vehicle.sensors).ok()?;
        let PlacedThrust { thrusters, .. } = placed_thrust(&recording, vehicle);
        let velocity = velocities(&recording, &navigated);
        let wrench = Dof::ALL.map(|dof| recording.get(&Quantity::Wrench(dof)).cloned());
        let [roll, pitch] =
            [Dof::Roll, Dof::Pitch].map(|dof| navigated.position.get(&dof).cloned());
        let angles = [roll, pitch, navigated.heading.clone()];
        let depth = recording.get(&Quantity::Depth);
        let thrust: Vec<Timed> = thrusters
            .iter()
            .map(|thruster| thruster.track.speed.map(|speed| thruster.track.thrust(speed)))
            .collect();
        let signals = signals(&recording, vehicle, &navigated, &velocity).ok()?;
        let effects: Vec<Effect> = vehicle.effects().into_iter().filter_map(steered).collect();
        let signals_of = |effect: &Effect| {
            let all = effect.signals();
            all.into_iter().map(|one| Some((signals.get(&one)?, one))).collect::<Option<Vec<_>>>()
        };
        let with_signals = |effect: Effect| Some((signals_of(&effect)?, effect));
        let effects: Vec<(Vec<(&Timed, Signal)>, Effect)> =
            effects.into_iter().filter_map(with_signals).collect();

        let moved = || velocity.iter().chain(&angles).flatten().chain(depth);
        let steered = || effects.iter().flat_map(|(signals, _)| signals).map(|(signal, _)| *signal);
        let pushed = || wrench.iter().flatten().chain(&thrust).chain(steered());
        let ends = |series: &Timed| (series.first_s(), series.last_s());
        let held = |series: &Timed| match series.len() {
            1 => (series.first_s(), f64::INFINITY),
            _ => (series.first_s(), series.last_s() + series.period_s()),
        };
        let spans = moved().map(ends).chain(pushed().map(held));
        let (from_s, to_s) = spans.reduce(|all, own| (all.0.max(own.0), all.1.min(own.1)))?;
        let grid = Grid::spanning(from_s, to_s.max(from_s), PERIOD_S);
        if grid.len < LEAST_INSTANTS || !to_s.is_finite() {
            return None;
        }
        let mut is_whole = vec![true; grid.len];
        moved().for_each(|series| {
            cut(&mut is_whole, grid, series, (GAP_PERIODS * series.period_s()).max(GAP_S));
        });
        pushed().for_each(|series| cut(&mut is_whole, grid, series, series.longest_usual_s()));

        let sampled = |series: &Option<Timed>| series.as_ref().map(|series| means(series, grid));
        let together = setup.together.iter().flatten().chain(&setup.dofs);
        let mut axes: Vec<Dof> = together.copied().collect();
        axes.sort();
        axes.dedup();
        let source = Dof::ALL.map(|dof| source(&recording, dof));
        let lever = lever_over_ground(&source, vehicle);
        let levers_m = [Dof::Surge, Dof::Sway, Dof::Heave]
            .map(|dof| navigated.lever(dof).or(lever).unwrap_or_default());
        let logged = recording.get(&Quantity::Attitude(Attitude::Heading));
        let logged = logged.filter(|_| vehicle.sensors.attitude.rotation_rad == [0.0; 3]);
        let over_ground = lever.and_then(|_| over_ground(setup, &recording, vehicle, logged));
        let of_effect = |(signals, effect): &(Vec<(&Timed, Signal)>, Effect)| LoggedEffect {
            effect: effect.clone(),
            signals: signals
                .iter()
                .map(|(series, signal)| {
                    let sampled = match signal.is_held() {
                        true => series.held_means(grid),
                        false => means(series, grid),
                    };
                    (signal.clone(), sampled)
                })
                .collect(),
        };
        let of_thruster = |(thruster, thrust): (&super::PlacedThruster, &Timed)| LoggedThruster {
            name: thruster.name.clone(),
            wrench: thruster.wrench.into(),
            thrust: thrust.held_means(grid),
        };
        Some(Self {
            axes,
            grid,
            is_whole,
            velocity: velocity.each_ref().map(sampled),
            levers_m,
            source,
            wrench: wrench.each_ref().map(|x| x.as_ref().map(|x| x.held_means(grid))),
            thrusters: thrusters.iter().zip(&thrust).map(of_thruster).collect(),
            effects: effects.iter().map(of_effect).collect(),
            over_ground,
            angles: angles.each_ref().map(sampled),
            depth: depth.map(|depth| means(depth, grid)),
        })
    }
}

/// Returns the effect of a rudder, a fin or a propeller that a plant includes initially.
fn steered(known: VehicleEffect) -> Option<Effect> {
    let VehicleEffect { effect, is_usual, .. } = known;
    is_usual.then_some(effect)
}

/// Returns the lever arm of the sensor that measures surge and sway along the world's axes, if one does.
fn lever_over_ground(source: &[Option<Quantity>; 6], vehicle: &Vehicle) -> Option<Vector3<f64>> {
    let is_over_ground = matches!(
        source[Dof::Surge.index()],
        Some(
            Quantity::WorldVelocity(_)
                | Quantity::GroundSpeed
                | Quantity::Position(_)
                | Quantity::Latitude
        )
    );
    is_over_ground.then_some(vehicle.sensors.position.position_body)
}

/// Returns the velocity over ground of the sensor itself, as a lever arm that a wrong heading turns would spoil it.
fn over_ground(
    setup: &TrialSetup,
    recording: &Recording,
    vehicle: &Vehicle,
    logged: Option<&Timed>,
) -> Option<OverGround> {
    let mut sensors = vehicle.sensors;
    sensors.position.position_body = Vector3::zeros();
    let navigated = navigate(&setup.name, recording, &sensors).ok()?;
    let [Some(surge), Some(sway), ..] = velocities(recording, &navigated) else { return None };
    let heading = navigated.heading?;
    let turned = |(&t, (u, v)): (&f64, (&f64, &f64))| {
        let (sin, cos) = heading.at(t).sin_cos();
        [cos * u - sin * v, sin * u + cos * v]
    };
    let both = surge.values().iter().zip(sway.values());
    let both: Vec<[f64; 2]> = surge.time_s().iter().zip(both).map(turned).collect();
    let part = |k: usize| {
        let values = both.iter().map(|v| v[k]).collect();
        surge.with_values("velocity over ground", values).ok()
    };
    let velocity = [part(0)?, part(1)?];
    let logged = logged.unwrap_or(&heading).clone();
    Some(OverGround { logged, heading, velocity })
}

/// Returns the first hour of the trial's window.
fn beginning(setup: &TrialSetup, recording: &Recording) -> Recording {
    let first_s = recording.values().map(Timed::first_s).fold(f64::INFINITY, f64::min);
    let from_s = setup.from_s.unwrap_or(first_s);
    let to_s = setup.to_s.unwrap_or(f64::INFINITY).min(from_s + LONGEST_S);
    let within = |(quantity, series): (&Quantity, &Timed)| {
        Some((quantity.clone(), series.window_held(from_s, to_s)?))
    };
    recording.iter().filter_map(within).collect()
}

/// Returns measured velocities, otherwise derivatives of positions; includes rates that contradict
/// their angle.
fn velocities(recording: &Recording, navigated: &Navigated) -> [Option<Timed>; 6] {
    let fixes = velocity_by_fixes(recording, navigated).ok().flatten();
    Dof::ALL.map(|dof| {
        let rate = if dof.is_rotation() {
            let rate = recording.get(&Quantity::Rate(axis_of(dof)));
            rate.or_else(|| recording.get(&Quantity::Velocity(dof)))
        } else {
            None
        };
        if let Some(measured) = rate.or_else(|| navigated.measured.get(&dof)) {
            return Some(measured.clone());
        }
        match (dof, navigated.by_position.get(&dof)) {
            (Dof::Surge | Dof::Sway, _) => fixes.as_ref().map(|both| both[dof.index()].clone()),
            (_, Some(Motion::Position(path))) => slope(path).ok(),
            _ => None,
        }
    })
}

const fn axis_of(dof: Dof) -> Axis {
    match dof {
        Dof::Surge | Dof::Roll => Axis::X,
        Dof::Sway | Dof::Pitch => Axis::Y,
        Dof::Heave | Dof::Yaw => Axis::Z,
    }
}

/// Returns the channel of the velocity of an axis.
fn source(recording: &Recording, dof: Dof) -> Option<Quantity> {
    let axis = axis_of(dof);
    let candidates = match dof {
        Dof::Surge | Dof::Sway => vec![
            Quantity::Velocity(dof),
            Quantity::DvlVelocity(axis),
            Quantity::WorldVelocity(World::North),
            Quantity::GroundSpeed,
            Quantity::Position(World::North),
            Quantity::Latitude,
        ],
        Dof::Heave => vec![
            Quantity::Velocity(dof),
            Quantity::DvlVelocity(axis),
            Quantity::WorldVelocity(World::Down),
            Quantity::Depth,
            Quantity::Position(World::Down),
        ],
        Dof::Roll | Dof::Pitch | Dof::Yaw => {
            let angle = match dof {
                Dof::Roll => Attitude::Roll,
                Dof::Pitch => Attitude::Pitch,
                _ => Attitude::Heading,
            };
            vec![Quantity::Rate(axis), Quantity::Velocity(dof), Quantity::Attitude(angle)]
        }
    };
    candidates.into_iter().find(|quantity| recording.contains_key(quantity))
}

/// Returns means around the instants of a grid, or interpolated values of a slower series.
fn means(series: &Timed, grid: Grid) -> Vec<f64> {
    match series.period_s() < 0.5 * grid.period_s {
        true => series.held_means(grid),
        false => series.interpolate(grid),
    }
}

/// Clears the instants within gaps of a series.
fn cut(is_whole: &mut [bool], grid: Grid, series: &Timed, longest_s: f64) {
    for gap in series.gaps(longest_s) {
        let at = |t_s: f64| ((t_s - grid.start_s) / grid.period_s).clamp(0.0, grid.len as f64);
        let (from, to) = (at(gap.from_s).floor() as usize, at(gap.to_s).ceil() as usize);
        is_whole[from..to.max(from)].fill(false);
    }
}
