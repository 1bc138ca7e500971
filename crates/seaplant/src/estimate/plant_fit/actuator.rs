//! How thrust follows what is logged of it: lag, delay and reverse thrust, the same of all thrusters.
//!
//! A propeller lags in speed n, and its thrust is k n|n|:
//!
//! ```text
//! T ṅ(t) + n(t) = n_logged(t − D),   F = k n|n|,   times κ in reverse
//! ```
//!
//! T may be another where a propeller slows down or where n falls, towards full reverse, and thrust another power of
//! speed than the second.
//!
//! A logged wrench, of which nobody knows what makes it, lags itself:
//!
//! ```text
//! T τ̇(t) + τ(t) = u(t − D)
//! ```
//!
//! The speed of a propeller may have a greatest rate of change: it needs a slew time from rest to the
//! greatest speed of the trials.
//!
//! A propeller that is told a command or a pulse width turns slower when the supply voltage V falls. Where V is
//! logged, and no curve accounts for it, thrust is in proportion to a power of it:
//!
//! ```text
//! F = k n|n| (V/V̄)^c,   V̄ as the curve states it, otherwise the mean of the trials
//! ```
//!
//! Thrust may change beside what its log says, as with the voltage of a battery: by a factor e^a from
//! the beginning to the end of each trial, and by e^b from the first trial to the last, 1 on average;
//! and by e^(c ℓ) under the load ℓ of all thrusters, since current lowers the voltage:
//!
//! ```text
//! ℓ = Σ (k n²)^(3/2) / Σ (k n_max²)^(3/2)
//! ```
//!
//! The power of a propeller in place grows with its thrust to the power 3/2. A curve is right without load,
//! as it is measured of one thruster by itself.
//!
//! A propeller may not turn below a part p of the greatest speed n_max that is told:
//!
//! ```text
//! n_told' = sign(n_told) max(|n_told| − p n_max, 0) / (1 − p)
//! ```
//!
//! D is negative where thrust acts before its log says. That of commands which are logged every h, while
//! they are given m times as often, is −h/2 (1 − 1/m) on average: what is held until the next sample has
//! long become something else. A pilot who works against the motion then looks like mass.
//!
//! Both are held between samples, or follow cubics through them if they move smoothly. A step of the filter
//! takes the mean of what acts over each slice in closed form; of a wrench `∫τ dt = ∫u(t − D) dt − T [τ]`.

mod signals;
mod wrench;

use std::sync::Arc;

use nalgebra::Vector6;

use super::super::inputs::Inputs;
use super::super::propellers::{Drive, DriveLaw, DriveNumber, Push, phase};
use super::search::ADMITTED;
use crate::motion::{HeldForces, PUSHED_BY, Slice};
use crate::series::union;
use crate::{
    BetweenSamples, Dof, Error, PlacedThruster, SteeringGear, Supply, ThrusterTrack, Timed,
    TrialRecord,
};
use wrench::{Lagging, finely_held};

/// What stands between logged thrust and the thrust that acts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Actuator {
    /// Time constant T of the lag, s.
    pub lag_s: f64,
    /// Delay D, s; negative where thrust acts before its log says.
    pub delay_s: f64,
    /// Logarithm of the reverse-thrust ratio κ: what thrusters push in reverse, over what their
    /// curves say.
    pub log_reverse_ratio: f64,
    /// Logarithm of the lag of a propeller that slows down over that of one that speeds up.
    pub log_lag_ratio: f64,
    /// Exponent of thrust over propeller speed, less 2.
    pub beyond_square: f64,
    /// Time that a propeller needs from rest to `full_speed` at its greatest rate of change, s; 0 without
    /// a limit.
    pub slew_s: f64,
    /// Exponent of thrust over the logged supply voltage.
    pub voltage_exponent: f64,
    /// Part of `full_speed` below which propellers do not turn.
    pub dead_band: f64,
    /// Logarithm of thrust at the end of each trial over that at its beginning, beside what its log
    /// says.
    pub log_change_within: f64,
    /// The same of the last trial over the first.
    pub log_change_between: f64,
    /// Logarithm of thrust while all thrusters push at full speed over what their curves say.
    pub log_change_loaded: f64,
    /// Logarithm of the scale of all thrust: what acts over what curves and logs say. Only known forces
    /// reveal it.
    pub log_scale: f64,
    /// Logarithm of the lag of a propeller whose speed falls, towards full reverse, over that of one whose speed rises.
    pub log_falling_lag_ratio: f64,
    /// The greatest propeller speed, where another exponent and a dead band leave thrust as its curve says.
    pub full_speed: f64,
    /// Logarithms of the mean supply voltage, V, where another exponent leaves thrust as curves say that state none,
    /// and of the greatest; the mean again if all state one.
    pub ln_voltage: [f64; 2],
    /// What propellers, or logged forces, do between their samples.
    pub between: BetweenSamples,
    /// The gear of rudders and fins; records of a fit are corrected for it.
    pub steering: SteeringGear,
}

/// The greatest dead band, as a part of full speed.
const MOST_DEAD_BAND: f64 = 0.4;

/// How finely a force that lags is held in a simulation, s.
const FINEST_S: f64 = 0.05;

/// Initial lag, s.
const FIRST_LAG_S: f64 = 0.1;

/// So many time constants after the last change, a lag is over.
const OVER: f64 = 8.0;

/// A lag shorter than this is none, s.
const NO_LAG_S: f64 = 1e-6;

/// What a lag or a delay has to show.
const LATE_SHOWS: f64 = 9.0;

/// Thrust that acts less than this before its log says, s, acts as it says: no log tells instants
/// better.
const LEAST_EARLY_S: f64 = 0.005;

/// Thrust in reverse is in proportion to all thrust if less than this part of it is not.
const OUT_OF_PROPORTION: f64 = 0.01;

/// What of [`Drive`]'s derivatives belongs to each number of an actuator.
const SHAPED_BY: [(usize, DriveNumber); 9] = [
    (Actuator::LAG, DriveNumber::Lag),
    (Actuator::DELAY, DriveNumber::Delay),
    (Actuator::REVERSE, DriveNumber::Reverse),
    (Actuator::LAG_RATIO, DriveNumber::LagRatio),
    (Actuator::EXPONENT, DriveNumber::Exponent),
    (Actuator::SLEW, DriveNumber::Slew),
    (Actuator::VOLTAGE, DriveNumber::Voltage),
    (Actuator::DEAD_BAND, DriveNumber::DeadBand),
    (Actuator::FALLING_LAG_RATIO, DriveNumber::FallingLagRatio),
];

/// Whether what pushes in reverse is in proportion to all that pushes, on all axes and at all times:
/// of a pair that turns a vehicle one pushes ahead and the other astern, by as much.
fn is_reverse_in_proportion(records: &[&TrialRecord], axes: &[Dof]) -> bool {
    let (mut all_all, mut all_reverse, mut reverse_reverse) = (0.0, 0.0, 0.0);
    for record in records {
        let times = union(record.thrusters.iter().map(|own| own.track.speed.time_s()));
        for t in times {
            let (mut all, mut reverse) = (Vector6::zeros(), Vector6::zeros());
            for PlacedThruster { track, wrench, .. } in &record.thrusters {
                let n = track.speed.held_at(t);
                let k = if n < 0.0 { track.reverse } else { track.forward };
                let push = wrench * (k * n * n.abs());
                all += push;
                reverse += if n < 0.0 { push } else { Vector6::zeros() };
            }
            for axis in axes.iter().map(|dof| dof.index()) {
                all_all += all[axis] * all[axis];
                all_reverse += all[axis] * reverse[axis];
                reverse_reverse += reverse[axis] * reverse[axis];
            }
        }
    }
    // What of reverse thrust is left beside its part of all.
    let left = reverse_reverse - all_reverse * all_reverse / all_all;
    all_reverse > 0.0 && left <= OUT_OF_PROPORTION * reverse_reverse
}

impl Actuator {
    /// How many numbers that is.
    pub const COUNT: usize = PUSHED_BY;

    /// Index of the lag.
    pub const LAG: usize = 0;
    /// Index of the delay.
    pub const DELAY: usize = 1;
    /// Index of the reverse-thrust ratio.
    pub const REVERSE: usize = 2;
    /// Index of the ratio of lags of propellers that slow down and speed up.
    pub const LAG_RATIO: usize = 3;
    /// Index of the exponent.
    pub const EXPONENT: usize = 4;
    /// Index of the slew time.
    pub const SLEW: usize = 5;
    /// Index of the exponent of supply voltage.
    pub const VOLTAGE: usize = 6;
    /// Index of the dead band.
    pub const DEAD_BAND: usize = 7;
    /// Index of the change of thrust within each trial.
    pub const CHANGE_WITHIN: usize = 8;
    /// Index of the change of thrust from the first trial to the last.
    pub const CHANGE_BETWEEN: usize = 9;
    /// Index of the change of thrust under load.
    pub const LOADED: usize = 10;
    /// Index of the scale of all thrust.
    pub const SCALE: usize = 11;
    /// Index of the ratio of lags of falling and rising speeds.
    pub const FALLING_LAG_RATIO: usize = 12;

    /// The ratios of lags.
    pub(super) const LAG_RATIOS: [usize; 2] = [Self::LAG_RATIO, Self::FALLING_LAG_RATIO];

    /// Between what they stay.
    pub(super) const LIMITS: [(f64, f64); Self::COUNT] = [
        (0.0, 3.0),
        (-0.5, 3.0),
        (-1.5, 1.5),
        (-2.5, 2.5),
        (-1.0, 1.0),
        (0.0, 5.0),
        (-1.0, 4.0),
        (0.0, MOST_DEAD_BAND),
        (-1.5, 1.5),
        (-1.5, 1.5),
        (-1.5, 0.5),
        (-2.5, 2.5),
        (-2.5, 2.5),
    ];

    /// Their standard deviations before anything is measured.
    pub(super) const PRIOR_STD: [f64; Self::COUNT] =
        [1.0, 1.0, 0.3, 1.0, 0.3, 1.0, 1.5, 0.1, 0.3, 0.3, 0.3, 1.0, 1.0];

    /// One is kept if its square is so many times its variance: chance makes as much of a lag or a
    /// delay once in 500; what contradicts the log or the curve of a thruster has to be seen as clearly
    /// as a coupling.
    pub(super) fn shows(k: usize, value: f64) -> f64 {
        match k {
            Self::DELAY if value < 0.0 && value > -LEAST_EARLY_S => f64::INFINITY,
            Self::DELAY if value < 0.0 => ADMITTED,
            Self::LAG | Self::DELAY => LATE_SHOWS,
            // Known forces are there to reveal it, even where it is 1.
            Self::SCALE => 0.0,
            _ => ADMITTED,
        }
    }

    /// Which of its numbers the trials can show: of a wrench that nobody knows the thrusters of, not how these
    /// push; of propellers, what their speeds can show; of thrusters of which a part as large always pushes in reverse, not
    /// what that pushes, as it looks like all of them stronger; of a supply voltage that hardly varies, no exponent of it;
    /// of one trial, no change from trial to trial; without a known force, no scale. A slew time has no slope where it is
    /// zero, a dead band is another exponent to begin with, and the change under load imitates thrusters that are not
    /// alike: these are tried later.
    pub(super) fn shown_by(records: &[&TrialRecord], axes: &[Dof]) -> [bool; Self::COUNT] {
        let lag = records.iter().any(|record| record.force.iter().any(Option::is_some));
        let tracks = records.iter().flat_map(|record| &record.thrusters);
        let inputs = Inputs::new(tracks.map(|thruster| &thruster.track));
        let reverse = inputs.show_reverse_ratio() && !is_reverse_in_proportion(records, axes);
        let (lag_ratio, exponent) = (inputs.show_lag_ratio(), inputs.show_exponent());
        let scale = lag && records.iter().any(|record| !record.known.is_empty());
        let between = lag && records.len() > 1;
        let voltage = inputs.show_voltage();
        let ([slew, dead_band, loaded], within) = ([false; 3], lag);
        [
            lag, lag, reverse, lag_ratio, exponent, slew, voltage, dead_band, within, between,
            loaded, scale, lag_ratio,
        ]
    }

    /// What is fitted of it, in the order of its fields.
    pub(super) const fn numbers(&self) -> [f64; Self::COUNT] {
        [
            self.lag_s,
            self.delay_s,
            self.log_reverse_ratio,
            self.log_lag_ratio,
            self.beyond_square,
            self.slew_s,
            self.voltage_exponent,
            self.dead_band,
            self.log_change_within,
            self.log_change_between,
            self.log_change_loaded,
            self.log_scale,
            self.log_falling_lag_ratio,
        ]
    }

    /// How far thrust goes from its mean in the course of the trials, beside what its log says: the
    /// logarithm of the greatest part.
    pub(super) fn greatest_from_mean(&self) -> f64 {
        let [within, between] = [self.log_change_within, self.log_change_between];
        0.5 * (within + between).abs().max(within.abs()).max(between.abs())
    }

    /// The logarithm of thrust under the mean load of a trial over that of the curves.
    pub(super) fn under_mean_load(&self, logged: &LoggedThrust) -> f64 {
        let Some((load, _)) = &logged.load else { return 0.0 };
        let times = load.time_s().iter();
        let all: f64 = times.map(|t| logged.load(*t, self.full_speed)).sum();
        self.log_change_loaded * all / load.len() as f64
    }

    /// How far thrust is from its curve at the greatest supply voltage of the trials: the logarithm of the part.
    pub(super) fn at_greatest_voltage(&self) -> f64 {
        let [mean, greatest] = self.ln_voltage;
        self.voltage_exponent.abs() * (greatest - mean)
    }

    /// How far thrust at half of full speed is from a square law that is right at full speed: the
    /// logarithm of the part.
    pub(crate) fn at_half_speed(&self) -> f64 {
        let turning = (1.0 - 2.0 * self.dead_band) / (1.0 - self.dead_band);
        (self.beyond_square * std::f64::consts::LN_2 - 2.0 * turning.ln()).abs()
    }

    /// The same with such numbers.
    pub(super) const fn with(&self, numbers: [f64; Self::COUNT]) -> Self {
        let [lag_s, delay_s, log_reverse_ratio, log_lag_ratio, beyond_square, slew_s, ..] = numbers;
        let [
            ..,
            voltage_exponent,
            dead_band,
            log_change_within,
            log_change_between,
            log_change_loaded,
            log_scale,
            log_falling_lag_ratio,
        ] = numbers;
        Self {
            lag_s,
            delay_s,
            log_reverse_ratio,
            log_lag_ratio,
            beyond_square,
            slew_s,
            voltage_exponent,
            dead_band,
            log_change_within,
            log_change_between,
            log_change_loaded,
            log_scale,
            log_falling_lag_ratio,
            ..*self
        }
    }

    /// One that does nothing, for thrusters that turn as fast as in these trials.
    pub(super) fn prompt(records: &[&TrialRecord]) -> Self {
        let thrusters = records.iter().flat_map(|record| &record.thrusters);
        let speeds = thrusters.flat_map(|thruster| thruster.track.speed.values());
        let full_speed = speeds.fold(0.0, |most: f64, n| most.max(n.abs()));
        Self { full_speed, ln_voltage: mean_and_greatest_supply(records), ..Self::default() }
    }

    /// Returns the actuator from which a fit begins: with some lag where thrust is known.
    pub(super) fn first(records: &[&TrialRecord]) -> Self {
        let has_thrust = records.iter().any(|record| record.force.iter().any(Option::is_some));
        let lag_s = if has_thrust { FIRST_LAG_S } else { 0.0 };
        Self { lag_s, ..Self::prompt(records) }
    }

    /// The force on each axis as it acts, held over steps of at most 0.05 s where it lags.
    ///
    /// # Errors
    /// [`Error::NotFinite`] or another of [`Timed::new`] if a number is not finite.
    pub fn acting(&self, record: &TrialRecord) -> Result<[Option<Timed>; 6], Error> {
        if self.numbers() == [0.0; Self::COUNT] && !self.is_smooth() {
            return Ok(record.force.clone());
        }
        let slices = self.slices(&record.force);
        let pushes = self.pushes(
            &LoggedThrust::of(record, 0.0, self.log_change_loaded != 0.0),
            &slices,
            &Dof::ALL,
        );
        let mut acting = [const { None }; 6];
        for (axis, _) in record.force.iter().enumerate().filter(|(_, logged)| logged.is_some()) {
            let values = pushes.each().map(|push| push.force[axis]).collect::<Vec<f64>>();
            let times = slices.iter().map(|slice| slice.from_s).collect::<Vec<f64>>();
            acting[axis] = Some(Timed::new("force", times, values)?);
        }
        Ok(acting)
    }

    /// Whether thrust moves smoothly from sample to sample.
    pub(super) fn is_smooth(&self) -> bool {
        self.between != BetweenSamples::Held
    }

    /// How long after its last change thrust still changes, s.
    fn settles_s(&self) -> f64 {
        let ratios = [self.log_lag_ratio, self.log_falling_lag_ratio];
        let longest_s =
            self.lag_s * ratios.map(|log_ratio| log_ratio.exp().max(1.0)).iter().product::<f64>();
        // From full speed ahead to full speed astern takes two slew times.
        OVER * longest_s + 2.0 * self.slew_s
    }

    /// From change to change as these act, finely where they lag, until the lag is over.
    fn slices(&self, logged: &[Option<Timed>; 6]) -> Vec<Slice> {
        let changes = union(logged.iter().flatten().map(Timed::time_s));
        let mut edges: Vec<f64> = changes.first().copied().into_iter().collect();
        edges.extend(changes.iter().map(|t| t + self.delay_s).filter(|t| *t > changes[0]));
        edges.extend(edges.last().map(|last| last + self.settles_s().max(FINEST_S)));
        let mut slices = Vec::new();
        for pair in edges.windows(2) {
            let length_s = pair[1] - pair[0];
            let is_held = self.settles_s() < NO_LAG_S && !self.is_smooth();
            let count = if is_held { 1.0 } else { (length_s / FINEST_S).ceil() };
            let length_s = length_s / count;
            slices.extend((0..count as usize).map(|k| {
                let from_s = pair[0] + k as f64 * length_s;
                Slice { from_s, length_s, ..Slice::default() }
            }));
        }
        slices
    }

    /// The mean force on some axes over each of some slices, one after the other, with its derivatives
    /// by the numbers of the actuator.
    pub(super) fn pushes(
        &self,
        logged: &LoggedThrust,
        slices: &[Slice],
        axes: &[Dof],
    ) -> HeldForces {
        let mut pushes = HeldForces::zeros(axes.len(), slices.len());
        for thruster in &logged.thrusters {
            self.add_thruster(thruster, slices, axes, &mut pushes);
        }
        for (place, dof) in axes.iter().enumerate() {
            let Some(series) = &logged.wrench[dof.index()] else { continue };
            let fine = self.is_smooth().then(|| finely_held(series)).flatten();
            let lagging = Lagging::new(fine.as_ref().unwrap_or(series), *self);
            let mut reader = lagging.reader();
            for ((force, all_by), slice) in pushes.each_mut().zip(slices) {
                let before = reader.at(slice.from_s);
                let after = reader.at(slice.from_s + slice.length_s);
                let (mean, by) = lagging.mean(&before, &after, slice.length_s);
                force[place] = mean;
                for (column, by) in all_by.chunks_exact_mut(axes.len()).zip(by) {
                    column[place] = by;
                }
            }
        }
        for (push, slice) in pushes.each_mut().zip(slices) {
            let middle_s = slice.from_s + 0.5 * slice.length_s;
            let load = logged.load(middle_s - self.delay_s, self.full_speed);
            self.change(push, logged.phases(middle_s), load);
        }
        pushes
    }

    /// Scales a force, and changes it by how far it is through its trial and through all trials, from −½ to ½, and by the
    /// load of all thrusters.
    fn change(
        &self,
        (force, by): (&mut [f64], &mut [f64]),
        [within, between]: [f64; 2],
        load: f64,
    ) {
        let slow = self.log_change_within * within + self.log_change_between * between;
        let ratio = (self.log_scale + slow + self.log_change_loaded * load).exp();
        force.iter_mut().chain(by.iter_mut()).for_each(|x| *x *= ratio);
        let in_force = [
            (Self::CHANGE_WITHIN, within),
            (Self::CHANGE_BETWEEN, between),
            (Self::LOADED, load),
            (Self::SCALE, 1.0),
        ];
        for (number, part) in in_force {
            let own = &mut by[number * force.len()..][..force.len()];
            own.iter_mut().zip(force.iter()).for_each(|(by, force)| *by = force * part);
        }
    }

    fn add_thruster(
        &self,
        PlacedThruster { track, wrench, .. }: &PlacedThruster,
        slices: &[Slice],
        axes: &[Dof],
        pushes: &mut HeldForces,
    ) {
        let wrench: Vec<f64> = axes.iter().map(|dof| wrench[dof.index()]).collect();
        let add = |sum: &mut [f64], tau: f64| {
            sum.iter_mut().zip(&wrench).for_each(|(sum, lever)| *sum += lever * tau);
        };
        let mut pushes = pushes.each_mut();
        // Without a dead band none is fitted: it is tried from one that is not zero.
        self.drive(track, slices, self.dead_band > 0.0, |push| {
            let Some((force, all_by)) = pushes.next() else { return };
            add(force, push.tau);
            for (k, by) in SHAPED_BY {
                add(&mut all_by[k * axes.len()..][..axes.len()], push.tau_by[by as usize]);
            }
        });
    }

    /// Follows a thruster over some slices, one after the other; with the derivative by the dead band if required.
    fn drive(
        &self,
        track: &ThrusterTrack,
        slices: &[Slice],
        has_dead_band: bool,
        mut each: impl FnMut(&Push),
    ) {
        let Some(first) = slices.first() else { return };
        let law = DriveLaw {
            lag_s: self.lag_s,
            log_lag_ratio: self.log_lag_ratio,
            log_falling_lag_ratio: self.log_falling_lag_ratio,
            slew_s: self.slew_s,
            delay_s: self.delay_s,
            log_reverse_ratio: self.log_reverse_ratio,
            beyond_square: self.beyond_square,
            full_speed: self.full_speed,
            between: self.between,
            dead_band: self.dead_band,
            has_exponent: true,
            has_dead_band,
            voltage_exponent: self.voltage_exponent,
            ln_mean_voltage: self.ln_voltage[0],
        };
        // What it was told shortly before is still on its way.
        let lead_s = (first.from_s - track.speed.first_s()).clamp(0.0, self.settles_s());
        let steps = (lead_s / FINEST_S).ceil();
        let from_s = first.from_s - lead_s;
        let mut drive = Drive::new(std::slice::from_ref(track), None, &law, from_s);
        for k in 0..steps as usize {
            let length_s = lead_s / steps;
            let time_s = from_s + (k as f64 + 1.0) * length_s;
            drive.until(time_s, length_s);
        }
        for slice in slices {
            let time_s = slice.from_s + slice.length_s;
            each(&drive.until(time_s, slice.length_s));
        }
    }
}

/// Returns the mean and the greatest logarithm of the supply voltage in trials; the mean twice if all curves state the
/// voltage of their measurement, and zero without any.
fn mean_and_greatest_supply(records: &[&TrialRecord]) -> [f64; 2] {
    let of_trial = |record: &&TrialRecord| {
        let mut supplies = record.thrusters.iter().filter_map(|own| own.track.supply.clone());
        supplies.next()
    };
    let supplies: Vec<Arc<Supply>> = records.iter().filter_map(of_trial).collect();
    let all = || supplies.iter().flat_map(|supply| supply.ln_volts.values()).copied();
    let (sum, count) = all().fold((0.0, 0), |(sum, count), x| (sum + x, count + 1));
    if count == 0 {
        return [0.0; 2];
    }
    let mean = sum / f64::from(count);
    let thrusters = records.iter().flat_map(|record| &record.thrusters);
    let is_open = |supply: &Arc<Supply>| supply.of_curve.is_none();
    let is_any_open = thrusters.filter_map(|own| own.track.supply.as_ref()).any(is_open);
    [mean, if is_any_open { all().fold(f64::MIN, f64::max) } else { mean }]
}

/// What pushes a vehicle in a trial, as logged.
pub(super) struct LoggedThrust {
    thrusters: Vec<PlacedThruster>,
    /// The force on each axis on which no thruster acts, held.
    wrench: [Option<Timed>; 6],
    /// From when to when the trial lasts, s.
    window_s: (f64, f64),
    /// How far through all trials it is, from −½ to ½.
    between: f64,
    /// `Σ (k n²)^(3/2)` of all thrusters, and what it is of each at a speed of 1 rad/s; none of a wrench, and
    /// where thrust does not depend on it.
    load: Option<(Timed, f64)>,
}

impl LoggedThrust {
    /// What pushes in a trial that is so far through all trials, from −½ of the first to ½ of the last; with the
    /// load of all thrusters if thrust may depend on that.
    pub(super) fn of(record: &TrialRecord, between: f64, has_load: bool) -> Arc<Self> {
        let is_of_thrusters =
            |axis: usize| record.thrusters.iter().any(|thruster| thruster.wrench[axis] != 0.0);
        let wrench = std::array::from_fn(|axis| match is_of_thrusters(axis) {
            true => None,
            false => record.force[axis].clone(),
        });
        let (thrusters, window_s) = (record.thrusters.clone(), record.window_s);
        let load = has_load.then(|| total_load(&thrusters)).flatten();
        Arc::new(Self { thrusters, wrench, window_s, between, load })
    }

    /// The load of all thrusters at an instant of their logs, 1 if all have a speed.
    fn load(&self, time_s: f64, full_speed: f64) -> f64 {
        let of = |(load, each): &(Timed, f64)| load.held_at(time_s) / (each * full_speed.powi(3));
        self.load.as_ref().filter(|_| full_speed > 0.0).map_or(0.0, of)
    }

    /// How far through its trial an instant is, and how far through all trials.
    fn phases(&self, time_s: f64) -> [f64; 2] {
        [phase(self.window_s, time_s), self.between]
    }
}

/// `Σ (k n²)^(3/2)` of some thrusters over time, and `Σ k^(3/2)`; none of fewer than two.
fn total_load(thrusters: &[PlacedThruster]) -> Option<(Timed, f64)> {
    if thrusters.len() < 2 {
        return None;
    }
    let times = union(thrusters.iter().map(|own| own.track.speed.time_s()));
    let of = |track: &ThrusterTrack, t: f64| {
        let n = track.speed.held_at(t);
        let k = if n < 0.0 { track.reverse } else { track.forward };
        (k.abs() * n * n).powf(1.5)
    };
    let sum = |t: &f64| thrusters.iter().map(|own| of(&own.track, *t)).sum::<f64>();
    let values: Vec<f64> = times.iter().map(sum).collect();
    let each = thrusters.iter().map(|own| own.track.forward.abs().powf(1.5)).sum::<f64>();
    let load = Timed::new("load", times, values).ok()?;
    (each > 0.0).then_some((load, each))
}

#[cfg(test)]
mod tests;
