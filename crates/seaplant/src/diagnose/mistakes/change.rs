//! Possible mistakes, as changes of a log.

use std::collections::BTreeSet;
use std::f64::consts::FRAC_PI_2;

use nalgebra::{Vector3, Vector6};

use super::weak::View;
use crate::axes::listed;
use crate::plant::Signal;
use crate::quantity::World;
use crate::trial::{Logged, LoggedEffect, Miswired, OverGround};
use crate::{Dof, Quantity, Sensors};

/// A change of a log.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Change {
    /// The velocities of some axes have the opposite sign.
    Reversed(Vec<Dof>),
    /// The logged wrench of an axis has the opposite sign.
    ReversedWrench(Dof),
    /// The thrust of a thruster has the opposite sign, or the inputs of two are exchanged.
    Thrusters(Miswired),
    /// All thrusters that act on an axis have the opposite sign.
    ReversedThrusters(Dof),
    /// The velocities along two axes are exchanged, or the rates about two.
    Exchanged(Dof, Dof),
    /// The wrenches of two axes are exchanged.
    ExchangedWrenches(Dof, Dof),
    /// The velocity sensor, or the compass that turns velocity over ground, is rotated about the vertical by this
    /// angle, deg, to starboard.
    Turned(f64),
    /// The angle of a rudder or fin has the opposite sign.
    ReversedFin(Signal),
    /// The heading by which velocity over ground is turned is another.
    Heading(Heading),
    /// A direction of the world has the opposite sign.
    ReversedWorld(World),
    /// North and east are exchanged.
    ExchangedWorld,
}

/// A heading that is not clockwise from north in the stated unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Heading {
    /// Counterclockwise from north.
    Reversed,
    /// Counterclockwise from east.
    FromEast,
    /// In degrees, read as radians.
    Degrees,
    /// In radians, read as degrees.
    Radians,
}

impl Heading {
    const ALL: [Self; 4] = [Self::Reversed, Self::FromEast, Self::Degrees, Self::Radians];

    /// Returns the heading clockwise from north, rad.
    fn correct(self, heading: f64) -> f64 {
        match self {
            Self::Reversed => -heading,
            Self::FromEast => FRAC_PI_2 - heading,
            Self::Degrees => heading.to_radians(),
            Self::Radians => heading.to_degrees(),
        }
    }
}

/// Angles at which velocity sensors are commonly mounted, by mistake or undocumented, deg.
const TURNS_DEG: [f64; 7] = [45.0, -45.0, 90.0, -90.0, 135.0, -135.0, 180.0];

/// Axes reversed if forward-port-up data are read as forward-starboard-down: of all sensors, of the
/// velocity sensor, of the gyroscope.
const OTHER_FRAMES: [&[Dof]; 3] = [
    &[Dof::Sway, Dof::Heave, Dof::Pitch, Dof::Yaw],
    &[Dof::Sway, Dof::Heave],
    &[Dof::Pitch, Dof::Yaw],
];

impl Change {
    /// Returns every change that trials allow, the simplest first.
    pub(super) fn all(trials: &[&Logged]) -> Vec<Self> {
        let moves = |dof: &Dof| trials.iter().any(|trial| trial.velocity[dof.index()].is_some());
        let is_wrench = |dof: &Dof| trials.iter().any(|trial| trial.wrench[dof.index()].is_some());
        let is_turned = trials.iter().any(|trial| trial.over_ground.is_some());
        let by_heading = |dof: &Dof| match dof {
            Dof::Surge | Dof::Sway => is_turned,
            Dof::Yaw => is_turned && is_of_heading(trials),
            _ => false,
        };
        let moving: Vec<Dof> =
            Dof::ALL.into_iter().filter(|dof| moves(dof) && !by_heading(dof)).collect();
        let pushed: Vec<Dof> = Dof::ALL.into_iter().filter(is_wrench).collect();
        let mut names: Vec<&String> = Vec::new();
        for thruster in trials.iter().flat_map(|trial| &trial.thrusters) {
            if !names.contains(&&thruster.name) {
                names.push(&thruster.name);
            }
        }
        let mut all: Vec<Self> = moving.iter().map(|dof| Self::Reversed(vec![*dof])).collect();
        all.extend(pushed.iter().map(|dof| Self::ReversedWrench(*dof)));
        all.extend(names.iter().map(|name| Self::Thrusters(Miswired::Reversed((*name).clone()))));
        if names.len() > 1 {
            all.extend(groups(trials).into_iter().map(Self::ReversedThrusters));
        }
        // One sensor measures velocities, another rates.
        let (turning, along): (Vec<Dof>, Vec<Dof>) =
            moving.iter().partition(|dof| dof.is_rotation());
        for of_sensor in [along, turning] {
            all.extend(pairs(&of_sensor, &|a, b| Self::Exchanged(*a, *b)));
        }
        all.extend(pairs(&pushed, &|a, b| Self::ExchangedWrenches(*a, *b)));
        let exchanged = |a: &&String, b: &&String| {
            Self::Thrusters(Miswired::Exchanged([(*a).clone(), (*b).clone()]))
        };
        all.extend(pairs(&names, &exchanged));
        if [Dof::Surge, Dof::Sway].iter().all(moves) {
            all.extend(TURNS_DEG.map(Self::Turned));
        }
        let mut frames: Vec<Vec<Dof>> = Vec::new();
        for axes in OTHER_FRAMES {
            let axes: Vec<Dof> = axes.iter().copied().filter(|dof| moving.contains(dof)).collect();
            if axes.len() > 1 && !frames.contains(&axes) {
                frames.push(axes);
            }
        }
        all.extend(frames.into_iter().map(Self::Reversed));
        let effects = trials.iter().flat_map(|trial| &trial.effects);
        let angles: BTreeSet<&Signal> = effects
            .flat_map(|effect| effect.signals.iter().map(|(signal, _)| signal))
            .filter(|signal| matches!(signal, Signal::Angle { .. }))
            .collect();
        all.extend(angles.into_iter().cloned().map(Self::ReversedFin));
        if is_turned {
            all.extend(Heading::ALL.map(Self::Heading));
            let by_course = is_by_course(trials);
            all.extend((!by_course).then_some(Self::ReversedWorld(World::North)));
            all.extend([Self::ReversedWorld(World::East), Self::ExchangedWorld]);
        }
        all
    }

    /// Returns the number of channels that it changes.
    pub(super) fn channels(&self) -> usize {
        match self {
            Self::Reversed(axes) => axes.len(),
            Self::ReversedWrench(_)
            | Self::Thrusters(Miswired::Reversed(_))
            | Self::ReversedFin(_)
            | Self::Heading(_)
            | Self::ReversedWorld(_) => 1,
            _ => 2,
        }
    }

    /// Returns whether it turns a velocity, whose components then share their variances otherwise.
    pub(super) fn turns(&self) -> bool {
        matches!(self, Self::Heading(_) | Self::ReversedWorld(_) | Self::ExchangedWorld)
    }

    /// Applies the change to a log.
    pub(super) fn apply(&self, log: &mut Logged) {
        let reverse = |series: &mut Option<Vec<f64>>| {
            series.iter_mut().flatten().for_each(|x| *x = -*x);
        };
        match self {
            Self::Reversed(axes) => {
                axes.iter().for_each(|dof| reverse(&mut log.velocity[dof.index()]));
            }
            Self::ReversedWrench(dof) => reverse(&mut log.wrench[dof.index()]),
            Self::Thrusters(Miswired::Reversed(name)) => {
                let named = log.thrusters.iter_mut().filter(|thruster| thruster.name == *name);
                named.for_each(|thruster| thruster.thrust.iter_mut().for_each(|x| *x = -*x));
            }
            Self::ReversedThrusters(dof) => {
                let acts = log.thrusters.iter_mut().filter(|t| t.wrench[dof.index()] != 0.0);
                acts.for_each(|thruster| thruster.thrust.iter_mut().for_each(|x| *x = -*x));
            }
            Self::Exchanged(a, b) => log.velocity.swap(a.index(), b.index()),
            Self::ExchangedWrenches(a, b) => log.wrench.swap(a.index(), b.index()),
            Self::Thrusters(Miswired::Exchanged([a, b])) => {
                let place = |name: &String| log.thrusters.iter().position(|t| t.name == *name);
                if let Some((a, b)) = place(a).zip(place(b)) {
                    let kept = std::mem::take(&mut log.thrusters[a].thrust);
                    log.thrusters[a].thrust = std::mem::replace(&mut log.thrusters[b].thrust, kept);
                }
            }
            Self::ReversedFin(angle) => {
                let signals = log.effects.iter_mut().flat_map(|effect| &mut effect.signals);
                let own = signals.filter(|(signal, _)| signal == angle);
                own.for_each(|(_, angle)| angle.iter_mut().for_each(|x| *x = -*x));
            }
            Self::Heading(heading) => over_ground(log, |own| own.turn(|x| heading.correct(x))),
            Self::ReversedWorld(way) => over_ground(log, |own| {
                let [north, east] = &mut own.velocity;
                let reversed = if *way == World::North { north } else { east };
                *reversed = reversed.map(|x| -x);
            }),
            Self::ExchangedWorld => over_ground(log, |own| own.velocity.reverse()),
            Self::Turned(degrees) if log.over_ground.is_some() => {
                over_ground(log, |own| own.turn(|x| x - degrees.to_radians()));
            }
            Self::Turned(degrees) => {
                let (sin, cos) = degrees.to_radians().sin_cos();
                let [surge, sway, ..] = &mut log.velocity;
                let (Some(surge), Some(sway)) = (surge, sway) else { return };
                for (u, v) in surge.iter_mut().zip(sway) {
                    (*u, *v) = (cos * *u - sin * *v, sin * *u + cos * *v);
                }
            }
        }
    }

    /// Formats the change.
    pub(super) fn words(&self, trials: &[&Logged]) -> String {
        match self {
            Self::Reversed(axes) if axes.len() > 1 => format!(
                "the velocities of {} look reversed, as of axes forward, port and up (FLU) that are read as forward, starboard and down",
                listed(axes)
            ),
            Self::Reversed(axes) => format!("the velocity of {} looks reversed", listed(axes)),
            Self::ReversedWrench(dof) => format!("the wrench of {dof} looks reversed"),
            Self::Thrusters(Miswired::Reversed(name)) => {
                format!("thruster `{name}` looks reversed")
            }
            Self::ReversedThrusters(dof) => {
                format!("all thrusters that act in {dof} look reversed")
            }
            Self::Exchanged(a, b) => format!("the velocities of {a} and {b} look exchanged"),
            Self::ExchangedWrenches(a, b) => format!("the wrenches of {a} and {b} look exchanged"),
            Self::Thrusters(Miswired::Exchanged([a, b])) => {
                format!("thrusters `{a}` and `{b}` look exchanged")
            }
            Self::Turned(degrees) => {
                let what = match trials.iter().any(|trial| trial.over_ground.is_some()) {
                    true => "compass",
                    false => "velocity sensor",
                };
                format!("the {what} looks turned by {degrees}° about the vertical")
            }
            Self::ReversedFin(angle) => format!("{angle} looks reversed"),
            Self::Heading(heading) => match heading {
                Heading::Reversed => "attitude.heading looks reversed (it is clockwise from north)",
                Heading::FromEast => {
                    "attitude.heading looks counterclockwise from east (it is clockwise from north)"
                }
                Heading::Degrees => "attitude.heading looks in deg and read as rad",
                Heading::Radians => "attitude.heading looks in rad and read as deg",
            }
            .to_owned(),
            Self::ReversedWorld(way) => {
                format!("{} looks reversed", world_channel(trials, *way))
            }
            Self::ExchangedWorld if is_by_course(trials) => {
                "ground.course looks counterclockwise from east (it is clockwise from north)"
                    .to_owned()
            }
            Self::ExchangedWorld => {
                let [north, east] =
                    [World::North, World::East].map(|way| world_channel(trials, way));
                format!("{north} and {east} look exchanged")
            }
        }
    }

    /// Formats the advice on the line of a file to change.
    pub(super) fn advice(&self, trials: &[&Logged], sensors: &Sensors) -> String {
        let source = |dof: Dof| trials.iter().find_map(|trial| trial.source[dof.index()].clone());
        let channel = |dof: Dof| channel(dof, source(dof).as_ref());
        match self {
            Self::Reversed(axes) => {
                let channels: Vec<String> = axes.iter().map(|dof| channel(*dof)).collect();
                negate(&channels)
            }
            Self::ReversedWrench(dof) => negate(&[format!("wrench.{dof}")]),
            Self::Thrusters(Miswired::Reversed(name)) => format!(
                "in vehicle.toml set `reversed = true` for the [[thruster]] named \"{name}\" (if it is set, remove it)"
            ),
            Self::ReversedThrusters(_) => {
                "in vehicle.toml turn the sign of their `direction`, or set `reversed = true` for each".to_owned()
            }
            Self::Exchanged(a, b) => exchange(&channel(*a), &channel(*b)),
            Self::ExchangedWrenches(a, b) => {
                exchange(&format!("wrench.{a}"), &format!("wrench.{b}"))
            }
            Self::Thrusters(Miswired::Exchanged([a, b])) => format!(
                "{}, or their names in vehicle.toml",
                exchange(&format!("thruster.{a}"), &format!("thruster.{b}"))
            ),
            Self::ReversedFin(angle) => negate(&[angle.to_string()]),
            Self::Heading(Heading::Reversed) => negate(&["attitude.heading".to_owned()]),
            Self::Heading(Heading::FromEast) => from_east("attitude.heading"),
            Self::Heading(Heading::Degrees | Heading::Radians) => {
                "in campaign.toml correct `unit` of \"attitude.heading\" under [channels]".to_owned()
            }
            Self::ReversedWorld(way) => negate(&[world_channel(trials, *way)]),
            Self::ExchangedWorld if is_by_course(trials) => from_east("ground.course"),
            Self::ExchangedWorld => {
                let [north, east] = [World::North, World::East].map(|way| world_channel(trials, way));
                exchange(&north, &east)
            }
            Self::Turned(degrees) if trials.iter().any(|trial| trial.over_ground.is_some()) => {
                turn("attitude", sensors.attitude.rotation_rad, *degrees)
            }
            Self::Turned(degrees) => match source(Dof::Surge) {
                Some(Quantity::DvlVelocity(_)) => {
                    turn("dvl", sensors.dvl.rotation_rad, *degrees)
                }
                _ => format!(
                    "in campaign.toml check the columns and signs of {} and {}; velocities in a DVL's own axes are dvl.velocity.x and .y, with `rotation_deg` under [sensor.dvl] in vehicle.toml",
                    channel(Dof::Surge),
                    channel(Dof::Sway)
                ),
            },
        }
    }
}

/// Changes velocity over ground or its heading, and what follows from them.
fn over_ground(log: &mut Logged, change: impl FnOnce(&mut OverGround)) {
    let is_of_heading = is_of_heading(&[log]);
    let Some(own) = &mut log.over_ground else { return };
    change(own);
    let [surge, sway] = own.along_body(log.grid);
    log.velocity[Dof::Surge.index()] = Some(surge);
    log.velocity[Dof::Sway.index()] = Some(sway);
    if is_of_heading {
        log.velocity[Dof::Yaw.index()] = Some(own.yaw_rate(log.grid));
    }
}

/// Returns whether yaw rates are slopes of heading.
fn is_of_heading(trials: &[&Logged]) -> bool {
    let source = trials.iter().find_map(|trial| trial.source[Dof::Yaw.index()].as_ref());
    matches!(source, Some(Quantity::Attitude(_)))
}

/// Returns an axis for each group of thrusters that act together, an identified one if possible.
fn groups(trials: &[&Logged]) -> Vec<Dof> {
    let acting = |dof: Dof| {
        let thrusters = trials.iter().flat_map(|trial| &trial.thrusters);
        let acting = thrusters.filter(move |thruster| thruster.wrench[dof.index()] != 0.0);
        acting.map(|thruster| thruster.name.as_str()).collect::<BTreeSet<&str>>()
    };
    let is_identified = |dof: &Dof| trials.iter().any(|trial| trial.axes.contains(dof));
    let (first, last): (Vec<Dof>, Vec<Dof>) = Dof::ALL.into_iter().partition(is_identified);
    let mut groups: Vec<(Dof, BTreeSet<&str>)> = Vec::new();
    for dof in first.into_iter().chain(last) {
        let group = acting(dof);
        if group.len() > 1 && groups.iter().all(|(_, known)| *known != group) {
            groups.push((dof, group));
        }
    }
    groups.into_iter().map(|(dof, _)| dof).collect()
}

fn pairs<T>(of: &[T], make: &dyn Fn(&T, &T) -> Change) -> Vec<Change> {
    let with_later = |(k, a)| of[k + 1..].iter().map(move |b| make(a, b));
    of.iter().enumerate().flat_map(with_later).collect()
}

/// Returns the channel of an axis's velocity.
fn channel(dof: Dof, source: Option<&Quantity>) -> String {
    source.map_or_else(|| format!("velocity.{dof}"), ToString::to_string)
}

/// Returns whether velocity over ground is logged as speed and course.
fn is_by_course(trials: &[&Logged]) -> bool {
    trials.iter().any(|trial| trial.source[Dof::Surge.index()] == Some(Quantity::GroundSpeed))
}

/// Returns the channel of a motion along north or east.
fn world_channel(trials: &[&Logged], way: World) -> String {
    let source = trials.iter().find_map(|trial| trial.source[Dof::Surge.index()].clone());
    match (source, way) {
        (Some(Quantity::Latitude), World::North) => Quantity::Latitude,
        (Some(Quantity::Latitude), _) => Quantity::Longitude,
        (Some(Quantity::Position(_)), way) => Quantity::Position(way),
        (Some(Quantity::GroundSpeed), _) => Quantity::GroundCourse,
        (_, way) => Quantity::WorldVelocity(way),
    }
    .to_string()
}

/// Formats the advice to turn a sensor, with the rotation that its file states.
fn turn(sensor: &str, rotation_rad: [f64; 3], degrees: f64) -> String {
    let [roll, pitch, yaw] = rotation_rad.map(f64::to_degrees);
    let yaw = (yaw + degrees + 180.0).rem_euclid(360.0) - 180.0;
    format!(
        "in vehicle.toml set `rotation_deg = [{roll:.0}, {pitch:.0}, {yaw:.0}]` under [sensor.{sensor}]"
    )
}

fn from_east(channel: &str) -> String {
    format!(
        "in campaign.toml set `negate = true, offset = -90` (in deg) for \"{channel}\" under [channels]"
    )
}

fn negate(channels: &[String]) -> String {
    let quoted: Vec<String> = channels.iter().map(|channel| format!("\"{channel}\"")).collect();
    format!(
        "in campaign.toml set `negate = true` for {} under [channels] (if it is set, remove it)",
        quoted.join(", ")
    )
}

fn exchange(a: &str, b: &str) -> String {
    format!("in campaign.toml exchange the columns of \"{a}\" and \"{b}\" under [channels]")
}

/// Adds ω × r times a factor to the velocity of each translation, with the lever arm r of its sensor.
fn add_turning(log: &mut Logged, factor: f64) {
    let (moves, turns) = log.velocity.split_at_mut(3);
    for (axis, (velocity, lever)) in moves.iter_mut().zip(&log.levers_m).enumerate() {
        for (k, v) in velocity.iter_mut().flatten().enumerate() {
            let rate = |turn: usize, _| turns[turn].as_ref().map_or(0.0, |rate| rate[k]);
            *v += factor * Vector3::from_fn(rate).cross(lever)[axis];
        }
    }
}

/// Returns the view of a log with changes.
pub(super) fn view(log: &Logged, changes: &[Change]) -> View {
    let mut log = log.clone();
    // Changes are of what sensors measure, from which ω × r was subtracted, with a wrong sign of ω, too.
    if !changes.is_empty() {
        match log.over_ground.is_some() {
            true => over_ground(&mut log, |_| ()),
            false => add_turning(&mut log, 1.0),
        }
        changes.iter().for_each(|change| change.apply(&mut log));
        add_turning(&mut log, -1.0);
    }
    let force = Dof::ALL.map(|dof| {
        let axis = dof.index();
        if let Some(wrench) = &log.wrench[axis] {
            return Some(wrench.clone()).filter(|wrench| wrench.iter().any(|x| *x != 0.0));
        }
        let acting = log.thrusters.iter().filter(|thruster| thruster.wrench[axis] != 0.0);
        acting.fold(None, |sum: Option<Vec<f64>>, thruster| {
            let mut sum = sum.unwrap_or_else(|| vec![0.0; log.grid.len]);
            let lever = thruster.wrench[axis];
            sum.iter_mut().zip(&thruster.thrust).for_each(|(sum, thrust)| *sum += lever * thrust);
            Some(sum)
        })
    });
    let velocity_at =
        |k: usize| Vector6::from_fn(|axis, _| log.velocity[axis].as_ref().map_or(0.0, |v| v[k]));
    let of_effect = |LoggedEffect { effect, signals }: &LoggedEffect| {
        let wrench = |k: usize| {
            let signals: Vec<f64> = signals.iter().map(|(_, signal)| signal[k]).collect();
            effect.wrench(&velocity_at(k), &signals, 0.0)
        };
        let wrenches: Vec<Vector6<f64>> = (0..log.grid.len).map(wrench).collect();
        Dof::ALL.map(|dof| {
            let along = wrenches.iter().map(|wrench| wrench[dof.index()]);
            effect.axes().contains(&dof).then(|| along.collect())
        })
    };
    let effects = log.effects.iter().map(of_effect).collect();
    let [roll, pitch, _] = log.angles;
    let thrusts = log.thrusters.into_iter().map(|thruster| thruster.thrust);
    let forces = thrusts.chain(log.wrench.into_iter().flatten()).collect();
    View {
        period_s: log.grid.period_s,
        is_whole: log.is_whole,
        is_turned: log.over_ground.is_some(),
        velocity: log.velocity,
        force,
        effects,
        forces,
        tilt: [roll, pitch],
    }
}
