//! A trial divided into slices between its measurements, once for all passes of the filter.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Matrix3x2, Vector3, Vector6};

use super::actuator::LoggedThrust;
use super::filter::{InstrumentNoise, Layout, MOST_NAVIGATION, Reading};
use super::sensor_lag::SensorLag;
use crate::motion::{
    Around, KnownForce, Load, Slice, body_from_world, down_body, interpolated_attitude, known_at,
    known_changes,
};
use crate::navigation::MeanAcceleration;
use crate::plant::{Signal, Structure};
use crate::series::{ROUNDING_S, median, union};
use crate::signal::rms;
use crate::{Dof, Timed, TrialRecord};

/// Maximum length of a slice, s: keeps the Runge–Kutta error of a vehicle that rolls at 4 rad/s
/// below 1e-4.
const LONGEST_SLICE_S: f64 = 0.05;
/// The same of one axis, which nothing but drag slows down.
const LONGEST_ALONE_S: f64 = 0.1;

/// Returns the position of a trial in the sequence: from −½ for the first to ½ for the last; 0 for
/// a single one.
fn order(trial: usize, trials: usize) -> f64 {
    if trials > 1 { trial as f64 / (trials - 1) as f64 - 0.5 } else { 0.0 }
}

/// Number of evenly spaced pieces of each trial with which a fit starts, and the fraction of the
/// trial that they cover.
const PIECES: usize = 4;
pub(super) const PIECES_PART: f64 = 0.25;

/// Treatment of attitude: known from measurements, or a state of the filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Attitude {
    Known,
    State,
}

impl Attitude {
    /// Selects a state where roll and pitch are axes of the plant and these angles and their rates
    /// were measured in every trial.
    ///
    /// Attitude smoothed with the rates contains their noise, which the filter would have to
    /// predict; the worse the attitude sensor, the more.
    pub(super) fn of(records: &[&TrialRecord], structure: &Structure) -> Self {
        let has = |dof: &Dof| structure.axes().contains(dof);
        let is_measured = |record: &&TrialRecord| record.inclination.iter().all(Option::is_some);
        match [Dof::Roll, Dof::Pitch].iter().all(has) && records.iter().all(is_measured) {
            true => Self::State,
            false => Self::Known,
        }
    }
}

/// A filter instant: the measurements at one time, and the slices that lead to it.
pub(super) struct FilterInstant {
    /// Time, s.
    pub(super) time_s: f64,
    /// Slices since the previous instant.
    pub(super) slices: Range<usize>,
    /// Their total length, s.
    pub(super) length_s: f64,
    /// Measured velocity over ground by axis in SNAME order: of the origin, plus `ω × r` at the
    /// sensor for rates that are axes of the plant.
    pub(super) measured: [Option<f64>; 6],
    /// Variance of each, relative to that of its axis.
    pub(super) spread: [f64; 6],
    /// For measured roll and pitch, the direction in body axes, perpendicular to the down vector,
    /// in which an increase of the angle moves it.
    pub(super) across: [Option<Vector3<f64>>; 2],
    /// Variance of each, relative to the nominal one.
    pub(super) spread_across: [f64; 2],
    /// The two columns of R(η)ᵀ that convert a horizontal current to body axes.
    pub(super) water: Matrix3x2<f64>,
    /// The same columns at the previous instant.
    pub(super) water_before: Matrix3x2<f64>,
    /// Measurements of navigation states.
    pub(super) readings: Vec<Reading>,
    /// Navigation states that restart from zero afterwards, where windows of mean acceleration
    /// start.
    pub(super) reset_states: Vec<usize>,
}

/// A step is a gap if it is longer than this, s, and than `GAP` median steps.
const LONGEST_STEP_S: f64 = 2.0;
const GAP: f64 = 5.0;

/// A trial, or a continuous section of it, as processed by the filter.
pub(super) struct Schedule {
    /// Index of the trial.
    pub(super) trial: usize,
    /// Lever arms of the sensors of surge, sway and heave, m.
    pub(super) levers_m: [Vector3<f64>; 3],
    /// Velocity over ground at the first instant, on all known axes.
    pub(super) start: Vector6<f64>,
    /// Its standard deviation on axes without a velocity sensor, in SNAME order.
    pub(super) start_std: [f64; 6],
    /// True for axes with a measured velocity, in SNAME order; others have navigation states.
    pub(super) is_measured: [bool; 6],
    /// True if translations were measured along the world's axes.
    pub(super) is_turned: bool,
    /// Indices of the navigation states.
    pub(super) layout: Layout,
    /// Their values at the first instant.
    pub(super) first_navigation: [f64; MOST_NAVIGATION],
    /// Measured down vector in body axes at the first instant.
    pub(super) start_down: Vector3<f64>,
    /// The filter instants; the first has no slices.
    pub(super) instants: Vec<FilterInstant>,
    pub(super) slices: Vec<Slice>,
    /// How the velocity sensors smooth, which have states for it.
    pub(super) sensor: SensorLag,
    /// Logged inputs of the actuators.
    pub(super) thrust: Arc<LoggedThrust>,
}

/// How schedules are made.
#[derive(Clone, Copy)]
struct How<'a> {
    structure: &'a Structure,
    attitude: Attitude,
    loads: &'a [Load],
    sensor: SensorLag,
}

impl Schedule {
    /// Prepares all records for a plant.
    pub(super) fn complete(
        records: &[&TrialRecord],
        structure: &Structure,
        attitude: Attitude,
        sensor: SensorLag,
    ) -> Arc<[Self]> {
        let loads = &loads(records);
        let how = How { structure, attitude, loads, sensor };
        let has_load = structure.axes().len() > 1;
        let of = |(trial, record): (usize, &&TrialRecord)| {
            let thrust = LoggedThrust::of(record, order(trial, records.len()), has_load);
            Self::stretches(trial, record, &thrust, record.window_s, how)
        };
        records.iter().enumerate().flat_map(of).collect()
    }

    /// Prepares a quarter of each record, in evenly spaced pieces with separate initial states.
    pub(super) fn pieces(
        records: &[&TrialRecord],
        structure: &Structure,
        attitude: Attitude,
        sensor: SensorLag,
    ) -> Arc<[Self]> {
        let loads = &loads(records);
        let how = How { structure, attitude, loads, sensor };
        let has_load = structure.axes().len() > 1;
        let of = |(trial, record): (usize, &&TrialRecord)| {
            let (from, to) = record.window_s;
            let thrust = LoggedThrust::of(record, order(trial, records.len()), has_load);
            let spacing = (to - from) / PIECES as f64;
            let piece = |k: usize| {
                let middle = from + (k as f64 + 0.5) * spacing;
                let half = 0.5 * PIECES_PART * spacing;
                let window = (middle - half, middle + half);
                Self::stretches(trial, record, &thrust, window, how)
            };
            (0..PIECES).flat_map(piece).collect::<Vec<_>>()
        };
        records.iter().enumerate().flat_map(of).collect()
    }

    /// Splits a window of a record at gaps without measurements; each section has its own initial
    /// state.
    ///
    /// Over a gap only the model propagates the state: an inaccurate plant ends far from the
    /// vehicle, with a heading off by any number of turns.
    fn stretches(
        trial: usize,
        record: &TrialRecord,
        thrust: &Arc<LoggedThrust>,
        (from, to): (f64, f64),
        how: How<'_>,
    ) -> Vec<Self> {
        let schedule = |window| Self::new(trial, record, thrust, window, how);
        let Some(whole) = schedule((from, to)) else { return Vec::new() };
        let mut steps: Vec<f64> =
            whole.instants[1..].iter().map(|instant| instant.length_s).collect();
        let longest = LONGEST_STEP_S.max(GAP * median(&mut steps).unwrap_or(0.0));
        let is_gap = |instant: &&FilterInstant| instant.length_s > longest;
        let gaps: Vec<f64> =
            whole.instants.iter().filter(is_gap).map(|instant| instant.time_s).collect();
        if gaps.is_empty() {
            return vec![whole];
        }
        let starts = std::iter::once(from).chain(gaps.iter().copied());
        let ends = gaps.iter().map(|after| after - longest).chain([to]);
        starts.zip(ends).filter_map(schedule).collect()
    }

    /// Prepares a window of a record; `None` if it has no measurements.
    fn new(
        trial: usize,
        record: &TrialRecord,
        thrust: &Arc<LoggedThrust>,
        (from, to): (f64, f64),
        How { structure, attitude, loads, sensor }: How<'_>,
    ) -> Option<Self> {
        let axes = structure.axes();
        let mut navigation = NavigationData::new(record, axes, (from, to));
        if sensor.time_s > 0.0 {
            navigation.layout = navigation.layout.with_lagged(sensor.is_window, |dof| {
                axes.contains(&dof) && record.may_be_late(dof.index())
            });
        }
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
        let starts = navigation.starts();
        let navigation_times = navigation.times().chain(starts.iter().map(Vec::as_slice));
        let times = union(all.map(Timed::time_s).chain(navigation_times));
        let held_inputs = record.signals.iter().filter(|(signal, _)| signal.is_held());
        let held_inputs = held_inputs.filter(|(signal, _)| structure.signals().contains(signal));
        let held = record.force.iter().flatten().chain(held_inputs.map(|(_, series)| series));
        let known_force_changes = known_changes(&record.known);
        let changes = union(held.map(Timed::time_s).chain([known_force_changes.as_slice()]));
        let mut before = *times.first()?;
        let mut schedule = Self {
            trial,
            levers_m: record.levers_m,
            start: record.velocity_at(before),
            start_std: std::array::from_fn(|axis| start_std(record, axis)),
            is_measured,
            is_turned: record.is_turned,
            layout: navigation.layout,
            first_navigation: navigation.first(before),
            start_down: start_down(record, before),
            instants: Vec::with_capacity(times.len()),
            slices: Vec::new(),
            sensor,
            thrust: Arc::clone(thrust),
        };
        let (mut readers, mut inclined_readers) = (vec![0; measured.len()], [0; 2]);
        let mut navigation_reader = navigation.reader();
        let mut water_before = current_columns(record, before);
        for &time_s in &times {
            let first = schedule.slices.len();
            schedule.slice(record, (structure, loads), &changes, before, time_s);
            let mut instant = FilterInstant {
                time_s,
                slices: first..schedule.slices.len(),
                length_s: time_s - before,
                measured: [None; 6],
                spread: [1.0; 6],
                across: [None; 2],
                spread_across: [1.0; 2],
                water: current_columns(record, time_s),
                water_before,
                readings: Vec::new(),
                reset_states: Vec::new(),
            };
            water_before = instant.water;
            navigation_reader.read(time_s, &mut instant);
            for ((dof, series), at) in measured.iter().zip(&mut readers) {
                let is_now = series.time_s().get(*at).is_some_and(|t| *t <= time_s + ROUNDING_S);
                if is_now {
                    let others = velocity_from_other_rates(record, axes, dof.index(), time_s);
                    instant.measured[dof.index()] = Some(series.values()[*at] - others);
                    if let Some(spread) = &record.spread[dof.index()] {
                        instant.spread[dof.index()] = spread.held_at(time_s + ROUNDING_S);
                    }
                    *at += 1;
                }
            }
            for (which, at) in inclined_readers.iter_mut().enumerate() {
                let Some(series) = &inclined[which] else { continue };
                let is_now = series.time_s().get(*at).is_some_and(|t| *t <= time_s + ROUNDING_S);
                if is_now {
                    instant.across[which] =
                        Some(down_direction(record, which, series.values()[*at], time_s));
                    if let Some(spread) = &record.inclination_spread[which] {
                        instant.spread_across[which] = spread.held_at(time_s + ROUNDING_S);
                    }
                    *at += 1;
                }
            }
            schedule.instants.push(instant);
            before = time_s;
        }
        schedule.slices.shrink_to_fit();
        Some(schedule)
    }

    /// Returns the number of scalar measurements after the first instant.
    pub(super) fn samples(&self) -> usize {
        let of = |instant: &FilterInstant| {
            instant.measured.iter().flatten().count()
                + instant.across.iter().flatten().count()
                + instant.readings.len()
        };
        self.instants.iter().skip(1).map(of).sum()
    }

    fn slice(
        &mut self,
        record: &TrialRecord,
        (structure, loads): (&Structure, &[Load]),
        changes: &[f64],
        from: f64,
        to: f64,
    ) {
        let first = changes.partition_point(|&t| t <= from + ROUNDING_S);
        let inside = changes[first..].iter().copied().take_while(|&t| t < to - ROUNDING_S);
        let mut at = from;
        for until in inside.chain([to]).filter(|until| *until > from) {
            let is_alone = structure.axes().len() == 1;
            let longest_s = if is_alone { LONGEST_ALONE_S } else { LONGEST_SLICE_S };
            let count = ((until - at) / longest_s - 1e-9).ceil().max(1.0);
            let h = (until - at) / count;
            for k in 0..count as usize {
                let before = self.slices.last().map(|slice| &slice.around);
                let mut slice = slice(record, structure, (at + k as f64 * h, h), before);
                let load = Load::at(&record.known, slice.from_s + 0.5 * h);
                slice.load = load.and_then(|load| loads.iter().position(|own| *own == load));
                self.slices.push(slice);
            }
            at = until;
        }
    }
}

/// Returns the sets of known forces that act together at any time of some trials, one for each
/// distinct sum.
pub(super) fn known_together(records: &[&TrialRecord]) -> Vec<Vec<KnownForce>> {
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

/// Returns the sums of the known forces that act together.
fn loads(records: &[&TrialRecord]) -> Vec<Load> {
    known_together(records).iter().map(|acting| Load::of(acting)).collect()
}

/// Measurements of the navigation states in a window.
struct NavigationData {
    layout: Layout,
    position: Option<[Option<Timed>; 2]>,
    depth: Option<Timed>,
    heading: Option<Timed>,
    acceleration: [Option<MeanAcceleration>; 3],
    /// Axes to which innovations of position north and east, depth and heading are assigned; `None`
    /// for axes with an accelerometer.
    axes: [Option<usize>; 4],
}

impl NavigationData {
    fn new(record: &TrialRecord, axes: &[Dof], (from, to): (f64, f64)) -> Self {
        let wants = |dof: Dof| axes.contains(&dof) && !record.is_measured(dof);
        let window = |series: &Option<Timed>| series.as_ref()?.window(from, to);
        let translations = [Dof::Surge, Dof::Sway, Dof::Heave];
        let fixes = record.fixes.as_ref().filter(|_| wants(Dof::Surge) || wants(Dof::Sway));
        let position = fixes.map(|both| both.each_ref().map(window));
        let position = position.filter(|both| both.iter().any(Option::is_some));
        let depth = window(&record.depth).filter(|_| wants(Dof::Heave));
        let heading = window(&record.heading).filter(|_| wants(Dof::Yaw));
        let acceleration = translations.map(|dof| {
            let windows = record.acceleration[dof.index()].as_ref().filter(|_| wants(dof))?;
            windows.window(from, to)
        });
        let has_acceleration = acceleration.each_ref().map(Option::is_some);
        let layout =
            Layout::of(position.is_some(), depth.is_some(), heading.is_some(), has_acceleration);
        let counts = |axis: usize| (axis > 2 || !has_acceleration[axis]).then_some(axis);
        let axes = [0, 1, 2, 5].map(counts);
        Self { layout, position, depth, heading, acceleration, axes }
    }

    /// Returns the times of the measurements.
    fn times(&self) -> impl Iterator<Item = &[f64]> {
        let means = self.acceleration.iter().flatten().map(|windows| &windows.mean);
        let positions = self.position.iter().flatten().flatten();
        let readings = positions.chain(&self.depth).chain(&self.heading);
        readings.chain(means).map(Timed::time_s)
    }

    /// Returns the start times of windows of mean acceleration.
    fn starts(&self) -> Vec<Vec<f64>> {
        self.acceleration.iter().flatten().map(|windows| windows.from_s.to_vec()).collect()
    }

    fn first(&self, time_s: f64) -> [f64; MOST_NAVIGATION] {
        let mut first = [0.0; MOST_NAVIGATION];
        let mut set = |state: usize, series: &Timed| first[state] = series.at(time_s);
        if let (Some(north), Some(both)) = (self.layout.position, &self.position) {
            both.iter().enumerate().for_each(|(k, series)| {
                series.iter().for_each(|series| set(north + k, series));
            });
        }
        if let (Some(state), Some(series)) = (self.layout.depth, &self.depth) {
            set(state, series);
        }
        if let (Some(state), Some(series)) = (self.layout.heading, &self.heading) {
            set(state, series);
        }
        first
    }

    fn reader(&self) -> NavigationReader<'_> {
        let mut readings = Vec::new();
        let mut add = |state: usize, number: usize, axis: Option<usize>, series| {
            readings.push((series, Reading { state, number, axis, value: 0.0, spread: 1.0 }, 0));
        };
        if let (Some(north), Some(both)) = (self.layout.position, &self.position) {
            for (k, series) in both.iter().enumerate() {
                let Some(series) = series else { continue };
                add(north + k, InstrumentNoise::POSITION, self.axes[k], series);
            }
        }
        if let (Some(state), Some(series)) = (self.layout.depth, &self.depth) {
            add(state, InstrumentNoise::DEPTH, self.axes[2], series);
        }
        if let (Some(state), Some(series)) = (self.layout.heading, &self.heading) {
            add(state, InstrumentNoise::HEADING, self.axes[3], series);
        }
        NavigationReader {
            navigation: self,
            readings,
            windows_ended: [0; 3],
            windows_started: [0; 3],
        }
    }
}

/// Reader of the measurements in order of time.
struct NavigationReader<'a> {
    navigation: &'a NavigationData,
    /// Series, template of the reading, and the number of samples already read.
    readings: Vec<(&'a Timed, Reading, usize)>,
    /// Number of acceleration windows that have ended, by axis.
    windows_ended: [usize; 3],
    /// Number of acceleration windows that have started, by axis.
    windows_started: [usize; 3],
}

impl NavigationReader<'_> {
    /// Adds the measurements at a time to a filter instant.
    fn read(&mut self, time_s: f64, instant: &mut FilterInstant) {
        let is_now = |t: Option<&f64>| t.is_some_and(|t| *t <= time_s + ROUNDING_S);
        for (series, reading, at) in &mut self.readings {
            if is_now(series.time_s().get(*at)) {
                instant.readings.push(Reading { value: series.values()[*at], ..*reading });
                *at += 1;
            }
        }
        for (axis, windows) in self.navigation.acceleration.iter().enumerate() {
            let (Some(windows), Some(state)) = (windows, self.navigation.layout.gained[axis])
            else {
                continue;
            };
            let at = &mut self.windows_ended[axis];
            if is_now(windows.mean.time_s().get(*at)) {
                let window_s = windows.mean.time_s()[*at] - windows.from_s[*at];
                let value = windows.mean.values()[*at] * window_s;
                let number = InstrumentNoise::ACCELERATION + axis;
                let spread = window_s * window_s;
                instant.readings.push(Reading { state, number, axis: Some(axis), value, spread });
                *at += 1;
            }
            let at = &mut self.windows_started[axis];
            if is_now(windows.from_s.get(*at)) {
                instant.reset_states.push(state);
                *at += 1;
            }
        }
    }
}

/// Returns the initial standard deviation of an axis's velocity where no sensor measures it.
fn start_std(record: &TrialRecord, axis: usize) -> f64 {
    let of_axis = record.velocity[axis].as_ref();
    of_axis.map_or(0.0, |series| rms(series.values().iter().copied())).max(LEAST_START)
}

/// Its lower limit, m/s or rad/s.
const LEAST_START: f64 = 1e-3;

fn slice(
    record: &TrialRecord,
    structure: &Structure,
    (from, h): (f64, f64),
    before: Option<&Arc<Around>>,
) -> Slice {
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
    // Held inputs take their value at the middle of the slice, as force does.
    let held = record.signals_at(structure.signals(), instants[1]);
    let changing = structure.signals().iter().enumerate().filter(|(_, x)| !x.is_held());
    let changing: Vec<(usize, &Signal)> = changing.collect();
    let signals = |t: f64| {
        let mut now = held.clone();
        changing.iter().for_each(|(k, signal)| now[*k] = record.signal_at(signal, t));
        now
    };
    let around = Around { down_body: instants.map(down), others: instants.map(others) };
    Slice {
        from_s: from,
        length_s: h,
        around: match before.filter(|before| ***before == around) {
            Some(same) => Arc::clone(same),
            None => Arc::new(around),
        },
        signals: instants.map(signals),
        load: None,
    }
}

/// Returns the unit direction of ∂k/∂φ for roll (0) or ∂k/∂θ for pitch (1) in body axes, at a
/// measured angle, rad; k is the down vector.
fn down_direction(record: &TrialRecord, which: usize, angle: f64, t: f64) -> Vector3<f64> {
    if which == 0 {
        return Vector3::new(0.0, angle.cos(), -angle.sin());
    }
    let roll = interpolated_attitude(record.attitude[0].as_ref(), t);
    Vector3::new(-angle.cos(), -angle.sin() * roll.sin(), -angle.sin() * roll.cos())
}

/// Returns the measured down vector in body axes.
fn start_down(record: &TrialRecord, t: f64) -> Vector3<f64> {
    let [roll, pitch] = [0, 1].map(|which| {
        let measured = record.inclination[which].as_ref().or(record.attitude[which].as_ref());
        measured.map_or(0.0, |angle| angle.at(t))
    });
    down_body(roll, pitch)
}

fn current_columns(record: &TrialRecord, t: f64) -> Matrix3x2<f64> {
    let angles = record.attitude.each_ref().map(|angle| interpolated_attitude(angle.as_ref(), t));
    body_from_world(angles).fixed_columns::<2>(0).into_owned()
}

/// Returns the component of ω × r at the sensor of an axis that is due to measured rates that are
/// not axes of the plant.
fn velocity_from_other_rates(record: &TrialRecord, axes: &[Dof], axis: usize, t: f64) -> f64 {
    let lever = record.levers_m.get(axis).filter(|lever| **lever != Vector3::zeros());
    let (Some(lever), Some(rates)) = (lever, &record.rates) else { return 0.0 };
    let is_axis = |k: usize| axes.contains(&Dof::ALL[3 + k]);
    let others = Vector3::from_fn(|k, _| if is_axis(k) { 0.0 } else { rates[k].at(t) });
    others.cross(lever)[axis]
}
