//! A trial cut into slices between its measurements, once for all passes of the filter.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Matrix3x2, Vector3, Vector6};

use super::actuator::LoggedThrust;
use super::filter::{InstrumentNoise, Layout, MOST_NAVIGATION, Reading};
use crate::motion::{
    KnownForce, Load, Slice, body_from_world, down_body, interpolated_attitude, known_at,
    known_changes,
};
use crate::navigation::MeanAcceleration;
use crate::plant::{Signal, Structure};
use crate::series::{ROUNDING_S, median, union};
use crate::signal::rms;
use crate::{CoupledRecord, Dof, Timed};

/// The longest slice, s: a Runge–Kutta step of a vehicle that rolls at 4 rad/s is then right
/// to 1e-4.
const LONGEST_SLICE_S: f64 = 0.05;

/// How far through some trials one is, from −½ of the first to ½ of the last; 0 of the only one.
fn place(trial: usize, trials: usize) -> f64 {
    if trials > 1 { trial as f64 / (trials - 1) as f64 - 0.5 } else { 0.0 }
}

/// Pieces of each trial, evenly spread, on which a fit begins, and what part of it they are.
const PIECES: usize = 4;
pub(super) const PIECES_PART: f64 = 0.25;

/// Whether attitude is known as it was measured, or a state beside ν.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Attitude {
    Known,
    State,
}

impl Attitude {
    /// A state where roll and pitch are axes of the plant and both they and their rates were measured
    /// in every trial.
    ///
    /// Smoothed by the rates, attitude holds of their noise what a filter is asked to predict, and
    /// the more the worse its own sensor is.
    pub(super) fn of(records: &[&CoupledRecord], structure: &Structure) -> Self {
        let has = |dof: &Dof| structure.axes().contains(dof);
        let is_measured = |record: &&CoupledRecord| record.inclination.iter().all(Option::is_some);
        match [Dof::Roll, Dof::Pitch].iter().all(has) && records.iter().all(is_measured) {
            true => Self::State,
            false => Self::Known,
        }
    }
}

/// An instant at which some axes were measured, and how it is reached.
pub(super) struct Stop {
    /// When it is, s.
    time_s: f64,
    /// The slices from the stop before.
    pub(super) slices: Range<usize>,
    /// How long these last, s.
    pub(super) length_s: f64,
    /// Velocity over ground by axis in SNAME order, where it was measured: of the origin, and what
    /// turning about axes of the plant makes of that where an instrument sits.
    pub(super) measured: [Option<f64>; 6],
    /// The variance of each beside that of its axis.
    pub(super) spread: [f64; 6],
    /// The directions across the world's down in body axes, as roll and pitch are measured, in
    /// which more of either moves it.
    pub(super) across: [Option<Vector3<f64>>; 2],
    /// The variance of each beside that of all.
    pub(super) spread_across: [f64; 2],
    /// The two columns of R(η)ᵀ that turn a horizontal current into body axes.
    pub(super) water: Matrix3x2<f64>,
    /// The same at the stop before.
    pub(super) water_before: Matrix3x2<f64>,
    /// Measurements of navigation states.
    pub(super) readings: Vec<Reading>,
    /// Navigation states that restart from zero after it: windows of mean accelerations begin.
    pub(super) begun: Vec<usize>,
}

/// A step longer than this, s, and than so many usual ones is a gap.
const LONGEST_STEP_S: f64 = 2.0;
const GAP: f64 = 5.0;

/// A trial, or a stretch of it, as the filter goes through it.
pub(super) struct Schedule {
    /// Which of the trials.
    pub(super) trial: usize,
    /// Where the instruments of surge, sway and heave sit, m.
    pub(super) levers_m: [Vector3<f64>; 3],
    /// Velocity over ground at the first stop, of all axes that are known.
    pub(super) start: Vector6<f64>,
    /// Its standard deviation on axes without a measured velocity, in SNAME order.
    pub(super) start_std: [f64; 6],
    /// True for axes with a measured velocity, likewise; the others have navigation states.
    pub(super) is_measured: [bool; 6],
    /// The navigation states.
    pub(super) layout: Layout,
    /// Their values at the first stop.
    pub(super) first_navigation: [f64; MOST_NAVIGATION],
    /// The world's down in body axes there, as measured.
    pub(super) start_down: Vector3<f64>,
    /// The stops; the first has no slices.
    pub(super) stops: Vec<Stop>,
    /// All slices.
    pub(super) slices: Vec<Slice>,
    /// What pushes, as logged.
    pub(super) thrust: Arc<LoggedThrust>,
}

impl Schedule {
    /// Cuts every record for a plant of some axes.
    pub(super) fn whole(
        records: &[&CoupledRecord],
        structure: &Structure,
        attitude: Attitude,
    ) -> Arc<[Self]> {
        let loads = &loads(records);
        let of = |(trial, record): (usize, &&CoupledRecord)| {
            let thrust = LoggedThrust::of(record, place(trial, records.len()));
            Self::stretches(trial, record, &thrust, record.window_s, (structure, attitude, loads))
        };
        records.iter().enumerate().flat_map(of).collect()
    }

    /// A quarter of every record in evenly spread pieces, each with a state of its own to begin
    /// with.
    pub(super) fn pieces(
        records: &[&CoupledRecord],
        structure: &Structure,
        attitude: Attitude,
    ) -> Arc<[Self]> {
        let loads = &loads(records);
        let of = |(trial, record): (usize, &&CoupledRecord)| {
            let (from, to) = record.window_s;
            let thrust = LoggedThrust::of(record, place(trial, records.len()));
            let spacing = (to - from) / PIECES as f64;
            let piece = |k: usize| {
                let middle = from + (k as f64 + 0.5) * spacing;
                let half = 0.5 * PIECES_PART * spacing;
                let window = (middle - half, middle + half);
                Self::stretches(trial, record, &thrust, window, (structure, attitude, loads))
            };
            (0..PIECES).flat_map(piece).collect::<Vec<_>>()
        };
        records.iter().enumerate().flat_map(of).collect()
    }

    /// Cuts a window of a record at gaps, in which nothing was measured: each stretch has a state of its
    /// own to begin with.
    ///
    /// Over a gap a vehicle goes where its thrust alone takes it: far from where a plant that is not yet
    /// right has it, and a heading by any number of turns.
    fn stretches(
        trial: usize,
        record: &CoupledRecord,
        thrust: &Arc<LoggedThrust>,
        (from, to): (f64, f64),
        how: (&Structure, Attitude, &[Load]),
    ) -> Vec<Self> {
        let of = |window| Self::of(trial, record, thrust, window, how);
        let Some(whole) = of((from, to)) else { return Vec::new() };
        let mut steps: Vec<f64> = whole.stops[1..].iter().map(|stop| stop.length_s).collect();
        let longest = LONGEST_STEP_S.max(GAP * median(&mut steps).unwrap_or(0.0));
        let is_gap = |stop: &&Stop| stop.length_s > longest;
        let gaps: Vec<f64> = whole.stops.iter().filter(is_gap).map(|stop| stop.time_s).collect();
        if gaps.is_empty() {
            return vec![whole];
        }
        let starts = std::iter::once(from).chain(gaps.iter().copied());
        let ends = gaps.iter().map(|after| after - longest).chain([to]);
        starts.zip(ends).filter_map(of).collect()
    }

    /// Cuts a window of a record; none if nothing was measured in it.
    fn of(
        trial: usize,
        record: &CoupledRecord,
        thrust: &Arc<LoggedThrust>,
        (from, to): (f64, f64),
        (structure, attitude, loads): (&Structure, Attitude, &[Load]),
    ) -> Option<Self> {
        let axes = structure.axes();
        let driven = Driven::of(record, axes, (from, to));
        let is_measured = Dof::ALL.map(|dof| record.is_measured(dof));
        let windowed = |dof: &Dof| {
            let axis = dof.index();
            if !is_measured[axis] {
                return None;
            }
            let read = record.readings.get(axis).and_then(Option::as_ref);
            read.or(record.velocity[axis].as_ref())?.window(from, to)
        };
        let measured: Vec<(Dof, Timed)> =
            axes.iter().filter_map(|dof| Some((*dof, windowed(dof)?))).collect();
        let inclined = |which: usize| match attitude {
            Attitude::Known => None,
            Attitude::State => record.inclination[which].as_ref()?.window(from, to),
        };
        let inclined = [inclined(0), inclined(1)];
        let all = measured.iter().map(|(_, series)| series).chain(inclined.iter().flatten());
        let starts = driven.starts();
        let driven_times = driven.times().chain(starts.iter().map(Vec::as_slice));
        let times = union(all.map(Timed::time_s).chain(driven_times));
        let drives = record.signals.iter().filter(|(signal, _)| signal.is_held());
        let drives = drives.filter(|(signal, _)| structure.signals().contains(signal));
        let held = record.force.iter().flatten().chain(drives.map(|(_, series)| series));
        let hung = known_changes(&record.known);
        let changes = union(held.map(Timed::time_s).chain([hung.as_slice()]));
        let mut before = *times.first()?;
        let mut schedule = Self {
            trial,
            levers_m: record.levers_m,
            start: record.velocity_at(before),
            start_std: std::array::from_fn(|axis| start_std(record, axis)),
            is_measured,
            layout: driven.layout,
            first_navigation: driven.first(before),
            start_down: start_down(record, before),
            stops: Vec::new(),
            slices: Vec::new(),
            thrust: Arc::clone(thrust),
        };
        let (mut readers, mut of_inclined) = (vec![0; measured.len()], [0; 2]);
        let mut of_driven = driven.reader();
        let mut water_before = water(record, before);
        for &time_s in &times {
            let first = schedule.slices.len();
            schedule.slice(record, (structure, loads), &changes, before, time_s);
            let mut stop = Stop {
                time_s,
                slices: first..schedule.slices.len(),
                length_s: time_s - before,
                measured: [None; 6],
                spread: [1.0; 6],
                across: [None; 2],
                spread_across: [1.0; 2],
                water: water(record, time_s),
                water_before,
                readings: Vec::new(),
                begun: Vec::new(),
            };
            water_before = stop.water;
            of_driven.read(time_s, &mut stop);
            for ((dof, series), at) in measured.iter().zip(&mut readers) {
                let is_now = series.time_s().get(*at).is_some_and(|t| *t <= time_s + ROUNDING_S);
                if is_now {
                    let others = turned_by_others(record, axes, dof.index(), time_s);
                    stop.measured[dof.index()] = Some(series.values()[*at] - others);
                    if let Some(spread) = &record.spread[dof.index()] {
                        stop.spread[dof.index()] = spread.held_at(time_s + ROUNDING_S);
                    }
                    *at += 1;
                }
            }
            for (which, at) in of_inclined.iter_mut().enumerate() {
                let Some(series) = &inclined[which] else { continue };
                let is_now = series.time_s().get(*at).is_some_and(|t| *t <= time_s + ROUNDING_S);
                if is_now {
                    stop.across[which] = Some(across(record, which, series.values()[*at], time_s));
                    if let Some(spread) = &record.inclination_spread[which] {
                        stop.spread_across[which] = spread.held_at(time_s + ROUNDING_S);
                    }
                    *at += 1;
                }
            }
            schedule.stops.push(stop);
            before = time_s;
        }
        Some(schedule)
    }

    /// How many numbers were measured after the first stop.
    pub(super) fn samples(&self) -> usize {
        let of = |stop: &Stop| {
            stop.measured.iter().flatten().count()
                + stop.across.iter().flatten().count()
                + stop.readings.len()
        };
        self.stops.iter().skip(1).map(of).sum()
    }

    fn slice(
        &mut self,
        record: &CoupledRecord,
        (structure, loads): (&Structure, &[Load]),
        changes: &[f64],
        from: f64,
        to: f64,
    ) {
        let first = changes.partition_point(|&t| t <= from + ROUNDING_S);
        let inside = changes[first..].iter().copied().take_while(|&t| t < to - ROUNDING_S);
        let mut at = from;
        for until in inside.chain([to]).filter(|until| *until > from) {
            let count = ((until - at) / LONGEST_SLICE_S - 1e-9).ceil().max(1.0);
            let h = (until - at) / count;
            for k in 0..count as usize {
                let mut slice = slice(record, structure, at + k as f64 * h, h);
                let load = Load::at(&record.known, slice.from_s + 0.5 * h);
                slice.load = load.and_then(|load| loads.iter().position(|own| *own == load));
                self.slices.push(slice);
            }
            at = until;
        }
    }
}

/// The known forces that act together at any time in some trials; those of equal sums once.
pub(super) fn known_together(records: &[&CoupledRecord]) -> Vec<Vec<KnownForce>> {
    let (mut loads, mut together): (Vec<Load>, Vec<Vec<KnownForce>>) = Default::default();
    for record in records {
        for pair in known_changes(&record.known).windows(2) {
            let acting = known_at(&record.known, 0.5 * (pair[0] + pair[1]));
            let load = Load::of(&acting);
            if !acting.is_empty() && !loads.contains(&load) {
                loads.push(load);
                together.push(acting);
            }
        }
    }
    together
}

/// Their sums.
fn loads(records: &[&CoupledRecord]) -> Vec<Load> {
    known_together(records).iter().map(|acting| Load::of(acting)).collect()
}

/// Measurements of navigation states in a window.
struct Driven {
    layout: Layout,
    position: Option<[Timed; 2]>,
    depth: Option<Timed>,
    heading: Option<Timed>,
    acceleration: [Option<MeanAcceleration>; 3],
    /// Which axis the innovations of position, depth and heading count to: none that has an
    /// accelerometer.
    axes: [Option<usize>; 4],
}

impl Driven {
    fn of(record: &CoupledRecord, axes: &[Dof], (from, to): (f64, f64)) -> Self {
        let wants = |dof: Dof| axes.contains(&dof) && !record.is_measured(dof);
        let window = |series: &Option<Timed>| series.as_ref()?.window(from, to);
        let translations = [Dof::Surge, Dof::Sway, Dof::Heave];
        let fixes = record.fixes.as_ref().filter(|_| wants(Dof::Surge) || wants(Dof::Sway));
        let position =
            fixes.and_then(|[north, east]| Some([north.window(from, to)?, east.window(from, to)?]));
        let depth = window(&record.depth).filter(|_| wants(Dof::Heave));
        let heading = window(&record.heading).filter(|_| wants(Dof::Yaw));
        let acceleration = translations.map(|dof| {
            let felt = record.acceleration[dof.index()].as_ref().filter(|_| wants(dof))?;
            felt.window(from, to)
        });
        let felt = acceleration.each_ref().map(Option::is_some);
        let layout = Layout::of(position.is_some(), depth.is_some(), heading.is_some(), felt);
        let counts = |axis: usize| (axis > 2 || !felt[axis]).then_some(axis);
        let axes = [0, 1, 2, 5].map(counts);
        Self { layout, position, depth, heading, acceleration, axes }
    }

    /// When something was measured.
    fn times(&self) -> impl Iterator<Item = &[f64]> {
        let felt = self.acceleration.iter().flatten().map(|felt| &felt.mean);
        let alone = self.position.iter().flatten().chain(&self.depth).chain(&self.heading);
        alone.chain(felt).map(Timed::time_s)
    }

    /// When windows of mean accelerations begin.
    fn starts(&self) -> Vec<Vec<f64>> {
        self.acceleration.iter().flatten().map(|felt| felt.from_s.to_vec()).collect()
    }

    fn first(&self, time_s: f64) -> [f64; MOST_NAVIGATION] {
        let mut first = [0.0; MOST_NAVIGATION];
        let mut set = |state: usize, series: &Timed| first[state] = series.at(time_s);
        if let (Some(north), Some(both)) = (self.layout.position, &self.position) {
            (0..2).for_each(|k| set(north + k, &both[k]));
        }
        if let (Some(state), Some(series)) = (self.layout.depth, &self.depth) {
            set(state, series);
        }
        if let (Some(state), Some(series)) = (self.layout.heading, &self.heading) {
            set(state, series);
        }
        first
    }

    fn reader(&self) -> DrivenReader<'_> {
        let mut alone = Vec::new();
        let mut add = |state: usize, number: usize, axis: Option<usize>, series| {
            alone.push((series, Reading { state, number, axis, value: 0.0, spread: 1.0 }, 0));
        };
        if let (Some(north), Some(both)) = (self.layout.position, &self.position) {
            for (k, series) in both.iter().enumerate() {
                add(north + k, InstrumentNoise::POSITION, self.axes[k], series);
            }
        }
        if let (Some(state), Some(series)) = (self.layout.depth, &self.depth) {
            add(state, InstrumentNoise::DEPTH, self.axes[2], series);
        }
        if let (Some(state), Some(series)) = (self.layout.heading, &self.heading) {
            add(state, InstrumentNoise::HEADING, self.axes[3], series);
        }
        DrivenReader { driven: self, alone, felt: [0; 3], begun: [0; 3] }
    }
}

/// Goes through what was measured in order of time.
struct DrivenReader<'a> {
    driven: &'a Driven,
    /// Series, what a sample of each is a reading of, and how many are read.
    alone: Vec<(&'a Timed, Reading, usize)>,
    /// The number of windows of acceleration that have ended, and begun.
    felt: [usize; 3],
    begun: [usize; 3],
}

impl DrivenReader<'_> {
    /// Adds the measurements since the stop before to a stop.
    fn read(&mut self, time_s: f64, stop: &mut Stop) {
        let is_now = |t: Option<&f64>| t.is_some_and(|t| *t <= time_s + ROUNDING_S);
        for (series, reading, at) in &mut self.alone {
            if is_now(series.time_s().get(*at)) {
                stop.readings.push(Reading { value: series.values()[*at], ..*reading });
                *at += 1;
            }
        }
        for (axis, felt) in self.driven.acceleration.iter().enumerate() {
            let (Some(felt), Some(state)) = (felt, self.driven.layout.gained[axis]) else {
                continue;
            };
            let at = &mut self.felt[axis];
            if is_now(felt.mean.time_s().get(*at)) {
                let window_s = felt.mean.time_s()[*at] - felt.from_s[*at];
                let value = felt.mean.values()[*at] * window_s;
                let number = InstrumentNoise::ACCELERATION + axis;
                let spread = window_s * window_s;
                stop.readings.push(Reading { state, number, axis: Some(axis), value, spread });
                *at += 1;
            }
            let at = &mut self.begun[axis];
            if is_now(felt.from_s.get(*at)) {
                stop.begun.push(state);
                *at += 1;
            }
        }
    }
}

/// The standard deviation of an axis's first velocity where no instrument measures it.
fn start_std(record: &CoupledRecord, axis: usize) -> f64 {
    let of_axis = record.velocity[axis].as_ref();
    of_axis.map_or(0.0, |series| rms(series.values().iter().copied())).max(LEAST_START)
}

/// At least so much, m/s or rad/s.
const LEAST_START: f64 = 1e-3;

fn slice(record: &CoupledRecord, structure: &Structure, from: f64, h: f64) -> Slice {
    let axes = structure.axes();
    let instants = [from, from + 0.5 * h, from + h];
    let down = |t: f64| {
        let [roll, pitch, _] = record.attitude.each_ref();
        down_body(interpolated_attitude(roll.as_ref(), t), interpolated_attitude(pitch.as_ref(), t))
    };
    let others = |t: f64| {
        Vector6::from_fn(|k, _| {
            let known = record.velocity[k].as_ref().filter(|_| !axes.contains(&Dof::ALL[k]));
            known.map_or(0.0, |series| series.at(t))
        })
    };
    // Like force, a drive is that of the slice's middle.
    let held = record.signals_at(structure.signals(), instants[1]);
    let changing = structure.signals().iter().enumerate().filter(|(_, x)| !x.is_held());
    let changing: Vec<(usize, &Signal)> = changing.collect();
    let signals = |t: f64| {
        let mut now = held.clone();
        changing.iter().for_each(|(k, signal)| now[*k] = record.signal_at(signal, t));
        now
    };
    Slice {
        from_s: from,
        length_s: h,
        down_body: instants.map(down),
        others: instants.map(others),
        signals: instants.map(signals),
        load: None,
    }
}

/// The direction across the world's down in which more of roll (0) or pitch (1) moves it: ∂k/∂φ or
/// ∂k/∂θ, of length 1, at such an angle.
fn across(record: &CoupledRecord, which: usize, angle: f64, t: f64) -> Vector3<f64> {
    if which == 0 {
        return Vector3::new(0.0, angle.cos(), -angle.sin());
    }
    let roll = interpolated_attitude(record.attitude[0].as_ref(), t);
    Vector3::new(-angle.cos(), -angle.sin() * roll.sin(), -angle.sin() * roll.cos())
}

/// The world's down in body axes as it was measured.
fn start_down(record: &CoupledRecord, t: f64) -> Vector3<f64> {
    let [roll, pitch] = [0, 1].map(|which| {
        let measured = record.inclination[which].as_ref().or(record.attitude[which].as_ref());
        measured.map_or(0.0, |angle| angle.at(t))
    });
    down_body(roll, pitch)
}

fn water(record: &CoupledRecord, t: f64) -> Matrix3x2<f64> {
    let angles = record.attitude.each_ref().map(|angle| interpolated_attitude(angle.as_ref(), t));
    body_from_world(angles).fixed_columns::<2>(0).into_owned()
}

/// What turning about that which is no axis of the plant makes of a translation where its instrument
/// sits, (ω × r) with such ω as it was measured.
fn turned_by_others(record: &CoupledRecord, axes: &[Dof], axis: usize, t: f64) -> f64 {
    let lever = record.levers_m.get(axis).filter(|lever| **lever != Vector3::zeros());
    let (Some(lever), Some(rates)) = (lever, &record.rates) else { return 0.0 };
    let is_axis = |k: usize| axes.contains(&Dof::ALL[3 + k]);
    let others = Vector3::from_fn(|k, _| if is_axis(k) { 0.0 } else { rates[k].at(t) });
    others.cross(lever)[axis]
}
