//! Propellers that follow their log: lag, greatest rate, delay, and the thrust of their speed.

mod approach;
mod drive;
mod integral;

pub(crate) use drive::{Drive, DriveLaw, DriveNumber, Push};
pub(crate) use integral::{LOST_BETWEEN_SAMPLES, SignalIntegral};

use crate::{ThrustModel, ThrusterTrack, Timed};

/// The longest step, s: drag changes a vehicle's speed over seconds.
pub(crate) const LONGEST_STEP_S: f64 = 0.1;

/// Returns the ends and lengths of steps of at most 0.1 s from one instant to a later one, s; of the first
/// instant itself a step of no length.
pub(crate) fn steps_between(from_s: Option<f64>, to_s: f64) -> impl Iterator<Item = (f64, f64)> {
    // Half a millionth of a step forgives the rounding of decimal time stamps.
    let steps = |from_s: f64| ((to_s - from_s) / LONGEST_STEP_S - 5e-7).ceil().max(1.0);
    let count = from_s.map_or(1, |from_s| steps(from_s) as usize);
    let length_s = from_s.map_or(0.0, |from_s| (to_s - from_s) / count as f64);
    let end = move |made: usize| match from_s.filter(|_| made < count) {
        Some(from_s) => from_s + made as f64 * length_s,
        None => to_s,
    };
    (1..=count).map(move |made| (end(made), length_s))
}

/// Thrust as it acts over a step.
pub(crate) struct DriveStep {
    /// Its end, s.
    pub(crate) time_s: f64,
    /// Its length, s; 0 at the first instant.
    pub(crate) length_s: f64,
    pub(crate) push: Push,
}

/// Returns how far through a trial an instant is, from −½ at its beginning to ½ at its end.
pub(crate) fn phase((from_s, to_s): (f64, f64), time_s: f64) -> f64 {
    ((time_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0) - 0.5
}

/// Returns thrust as it acts in a trial that lasts from `window_s.0` to `window_s.1`, over steps through `times_s`
/// that are at most 0.1 s long.
pub(crate) fn drive_over<'a>(
    tracks: &'a [ThrusterTrack],
    turning: Option<&'a Timed>,
    window_s: (f64, f64),
    times_s: &'a [f64],
    thrust: &ThrustModel,
) -> impl Iterator<Item = DriveStep> + 'a {
    let law = DriveLaw {
        lag_s: thrust.lag_s,
        log_lag_ratio: thrust.lag_ratio.ln(),
        log_falling_lag_ratio: thrust.falling_lag_ratio.ln(),
        slew_s: thrust.slew_s,
        delay_s: thrust.delay_s,
        dead_band: thrust.dead_band,
        log_reverse_ratio: thrust.reverse_ratio.ln(),
        beyond_square: thrust.exponent - 2.0,
        full_speed: thrust.full_speed,
        between: thrust.between,
        has_exponent: false,
        has_dead_band: false,
        voltage_exponent: thrust.voltage_exponent,
        ln_mean_voltage: thrust.mean_voltage_v.max(f64::MIN_POSITIVE).ln(),
    };
    let mut drive = Drive::new(tracks, turning, &law, times_s.first().copied().unwrap_or(0.0));
    let log_change = thrust.change_within.ln_1p();
    let mut before = None;
    let steps = times_s.iter().flat_map(move |t| steps_between(before.replace(*t), *t));
    steps.map(move |(time_s, length_s)| {
        let mut push = if length_s > 0.0 { drive.until(time_s, length_s) } else { Push::default() };
        if log_change != 0.0 {
            push.tau *= (log_change * phase(window_s, time_s - 0.5 * length_s)).exp();
        }
        DriveStep { time_s, length_s, push }
    })
}
