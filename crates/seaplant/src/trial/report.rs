//! Delay, lag, place and misalignment of the velocity sensor.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::TrialRecord;
use crate::motion::{body_from_world, interpolated_attitude};
use crate::navigation::turning;
use crate::{Dof, Timed};

/// Delay, lag, lever arm and misalignment of the sensor of surge, sway and heave, relative to thrust, angular
/// velocity and the stated position and mounting.
///
/// ```text
/// T ẏ = Rᵀ (ν + ω × r)(t − d) − y,   R = exp(θ ×)
/// ```
///
/// Fixes of position have the delay, and a heading that is turned by θ about the vertical axis. What is measured along
/// the world's axes and turned into the body's by the attitude at t, not at t − d, is turned back.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VelocityReport {
    /// d, s.
    pub delay_s: f64,
    /// T, s; zero without a lag.
    pub lag_s: f64,
    /// r, from the stated position of the instrument to its actual one, in body axes, m.
    pub lever_m: [f64; 3],
    /// θ, the rotation from the stated mounting of the instrument to its actual one, about body axes, rad.
    pub misalignment_rad: [f64; 3],
}

impl VelocityReport {
    /// Applies the lag, but not the delay, to a velocity with `values` at some times.
    pub(crate) fn behind_lag(&self, time_s: &[f64], mut values: Vec<f64>) -> Vec<f64> {
        if self.lag_s == 0.0 {
            return values;
        }
        let mut before = values.first().copied().unwrap_or_default();
        for k in 1..values.len() {
            let (keep, age_s, h) = self.lag_step(time_s[k] - time_s[k - 1]);
            // The mean of the linear interpolation between two values, weighted by the lag.
            let mean = values[k] + (before - values[k]) * age_s / h;
            before = values[k];
            values[k] = keep * values[k - 1] + (1.0 - keep) * mean;
        }
        values
    }

    /// Returns the decay of the output over a step; the time before its end at which a linear input
    /// equals its mean weighted by the lag; and the step, all times in s.
    fn lag_step(&self, h: f64) -> (f64, f64, f64) {
        let keep = (-h / self.lag_s).exp();
        (keep, self.lag_s - h * keep / (1.0 - keep), h)
    }

    /// Inverts the lag.
    ///
    /// `ν = (yₖ − a yₖ₋₁) / (1 − a)` with `a = exp(−h/T)` is the mean over the step, weighted by
    /// the lag; its time is that of a linear input of this value. White noise at the input is
    /// recovered as white.
    fn before_lag(&self, series: Timed) -> Timed {
        if self.lag_s == 0.0 {
            return series;
        }
        let (time_s, values) = (series.time_s(), series.values());
        let longest = series.longest_usual_s();
        let before = |k: usize| {
            let (keep, age_s, h) = self.lag_step(time_s[k] - time_s[k - 1]);
            let mean = (values[k] - keep * values[k - 1]) / (1.0 - keep);
            (h <= longest).then_some((time_s[k] - age_s, mean))
        };
        let (time_s, values): (Vec<f64>, Vec<f64>) = (1..time_s.len()).filter_map(before).unzip();
        Timed::new("velocity", time_s, values).unwrap_or(series)
    }
}

impl TrialRecord {
    /// Returns the record with translations corrected for delay; they still have the lag.
    ///
    /// The lag applies to `ω × r` of an instrument off the origin too, so that its lagged value is
    /// subtracted for the velocity of the origin.
    pub(crate) fn with_translations_in_time(&self, report: &VelocityReport) -> Self {
        let in_time = |read: Timed| read;
        self.with_translations(report, in_time, |swing| {
            let behind = report.behind_lag(swing.time_s(), swing.values().to_vec());
            swing.with_values("what turning adds", behind).unwrap_or(swing)
        })
    }

    /// Returns the record with translations corrected for delay and lag.
    pub(crate) fn with_translations_before(&self, report: &VelocityReport) -> Self {
        self.with_translations(report, |read| report.before_lag(read), |swing| swing)
    }

    /// Returns the record with readings shifted in time and transformed by `readings`, of an
    /// instrument at its actual position, and velocities of the origin less `ω × r` transformed by
    /// `swing`.
    fn with_translations(
        &self,
        report: &VelocityReport,
        readings: impl Fn(Timed) -> Timed,
        swing: impl Fn(Timed) -> Timed,
    ) -> Self {
        let mut changed = self.clone();
        let (mut from, mut to) = self.window_s;
        let aligned = self.aligned(report);
        for axis in (0..3).filter(|axis| self.may_be_late(*axis)) {
            let read = aligned[axis].as_ref();
            let Some(read) = read.map(|read| readings(read.shifted(-report.delay_s))) else {
                continue;
            };
            let lever = self.levers_m[axis] + Vector3::from(report.lever_m);
            let of_origin = self.turning(lever, axis).and_then(|turning| {
                let (times, swing) = (read.time_s().iter(), swing(turning));
                let values = times.zip(read.values()).map(|(t, y)| y - swing.at(*t)).collect();
                read.with_values("velocity", values).ok()
            });
            (from, to) = (from.max(read.first_s()), to.min(read.last_s()));
            changed.levers_m[axis] = of_origin.as_ref().map_or(Vector3::zeros(), |_| lever);
            changed.readings[axis] = of_origin.as_ref().map(|_| read.clone());
            changed.velocity[axis] = Some(of_origin.unwrap_or(read));
        }
        changed.correct_fixes(report);
        for fixes in changed.fixes.iter().flatten().flatten().filter(|_| report.delay_s != 0.0) {
            (from, to) = (from.max(fixes.first_s()), to.min(fixes.last_s()));
        }
        changed.window_s = (from, to);
        changed
    }

    /// Corrects fixes, and velocities that are the slopes of these, for delay and for a heading that is turned: the origin
    /// is where it was by the heading of the time of measurement, north and east are those of the heading.
    ///
    /// ```text
    /// p(t − d) = R_z(θ) (p_read(t) + R(t) r) − R(t − d) r
    /// ```
    fn correct_fixes(&mut self, report: &VelocityReport) {
        let (delay_s, turned_rad) = (report.delay_s, report.misalignment_rad[2]);
        let Some(both) = self.fixes.as_ref().filter(|_| delay_s != 0.0 || turned_rad != 0.0) else {
            return;
        };
        let turn = *Rotation3::from_axis_angle(&Vector3::z_axis(), turned_rad).matrix();
        let at = |series: Option<&Timed>, t: f64| series.map_or(0.0, |series| series.at(t));
        let corrected = |series: &Timed, value: &dyn Fn(f64) -> f64| {
            let values = series.time_s().iter().map(|t| value(*t)).collect();
            let values = series.with_values("position", values);
            values.map_or_else(|_| series.clone(), |values| values.shifted(-delay_s))
        };
        let fixes = [0, 1].map(|k| {
            let place = |t: f64| {
                let [north, east] = both.each_ref().map(|own| at(own.as_ref(), t));
                let antenna = self.to_body(t).transpose() * self.fixes_lever_m;
                let before = self.to_body(t - delay_s).transpose() * self.fixes_lever_m;
                (turn * (Vector3::new(north, east, 0.0) + antenna) - before)[k]
            };
            both[k].as_ref().map(|own| corrected(own, &place))
        });
        let by_slope = [0, 1].map(|k| self.velocity[k].as_ref().filter(|_| self.by_slope[k]));
        let slopes = [0, 1].map(|k| {
            let velocity = |t: f64| {
                let [surge, sway] = by_slope.map(|own| at(own, t));
                let world = self.to_body(t).transpose() * Vector3::new(surge, sway, 0.0);
                (self.to_body(t - delay_s) * turn * world)[k]
            };
            by_slope[k].map(|own| corrected(own, &velocity))
        });
        self.fixes = Some(fixes);
        for (own, slope) in self.velocity.iter_mut().zip(slopes) {
            *own = slope.or_else(|| own.take());
        }
    }

    /// Returns the readings of the translations, at their own times, along the body axes of the time of measurement.
    fn aligned(&self, report: &VelocityReport) -> [Option<Timed>; 3] {
        let read = |axis: usize| {
            let read = self.readings[axis].as_ref().or(self.velocity[axis].as_ref());
            read.filter(|_| self.may_be_late(axis)).cloned()
        };
        let read = [0, 1, 2].map(read);
        let turns_late = self.is_turned && report.delay_s != 0.0;
        if report.misalignment_rad == [0.0; 3] && !turns_late {
            return read;
        }
        let of_mounting = Rotation3::from_scaled_axis(Vector3::from(report.misalignment_rad));
        let rotation_at = |t: f64| match turns_late {
            true => self.to_body(t - report.delay_s) * self.to_body(t).transpose() * of_mounting,
            false => *of_mounting.matrix(),
        };
        let along = |axis: usize| {
            let own = read[axis].as_ref()?;
            let sum = |(t, y): (&f64, &f64)| {
                let rotation = rotation_at(*t);
                let part = |other: usize| match &read[other] {
                    _ if other == axis => rotation[(axis, axis)] * y,
                    Some(read) => rotation[(axis, other)] * read.at(*t),
                    None => 0.0,
                };
                (0..3).map(part).sum()
            };
            let values = own.time_s().iter().zip(own.values()).map(sum).collect();
            own.with_values("velocity", values).ok()
        };
        [0, 1, 2].map(along)
    }

    /// Returns the matrix that turns a vector from the world's axes into the body's at a time.
    fn to_body(&self, t: f64) -> Matrix3<f64> {
        body_from_world(self.attitude.each_ref().map(|own| interpolated_attitude(own.as_ref(), t)))
    }

    /// Returns ω × r along a translation; `None` if r is zero, or if ω was not measured.
    fn turning(&self, lever: Vector3<f64>, axis: usize) -> Option<Timed> {
        let rates = self.rates.as_ref().filter(|_| lever != Vector3::zeros())?;
        turning(rates, lever, axis)
    }

    /// Returns whether an axis, in SNAME order, is a translation with its own instrument, which may
    /// have a delay.
    pub(crate) fn may_be_late(&self, axis: usize) -> bool {
        axis < 3 && self.is_measured(Dof::ALL[axis])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Grid;

    /// The closed-form response to a lag, T ẏ = sin ωt − y; sampled unevenly.
    #[test]
    fn inverting_a_lag_recovers_its_input() {
        let late = VelocityReport { delay_s: 0.1, lag_s: 0.4, ..VelocityReport::default() };
        let omega = 0.9_f64;
        let (gain, phase) = {
            let x = omega * late.lag_s;
            (1.0 / x.hypot(1.0), -x.atan())
        };
        let time_s: Vec<f64> =
            (0..200).map(|k| 0.15 * f64::from(k) + 0.03 * f64::from(k % 3)).collect();
        let reported = |t: &f64| gain * (omega * (t - late.delay_s) + phase).sin();
        let values: Vec<f64> = time_s.iter().map(reported).collect();
        let series = Timed::new("velocity", time_s.clone(), values.clone()).expect("a series");
        let found = late.before_lag(series.shifted(-late.delay_s));
        assert_eq!(found.len(), 199);
        for (t, v) in found.time_s().iter().zip(found.values()) {
            assert!((v - (omega * t).sin()).abs() < 2e-3, "{t}: {v}");
        }
        // Applying the lag again restores the output, after the initial transient.
        let moved = time_s.iter().map(|t| (omega * (t - late.delay_s)).sin()).collect();
        let there = late.behind_lag(&time_s, moved);
        for (a, b) in there.iter().zip(&values).skip(20) {
            assert!((a - b).abs() < 2e-3, "{a} {b}");
        }
    }

    /// A satellite receiver that is late, and a heading that points too far to starboard.
    #[test]
    fn late_velocities_and_fixes_are_turned_back_by_the_heading_of_their_time() {
        const LATE_S: f64 = 0.3;
        const TURNED_RAD: f64 = 0.1;
        let antenna = Vector3::new(0.8, -0.3, 0.0);
        let to_world = |angle: f64| *Rotation3::from_axis_angle(&Vector3::z_axis(), angle).matrix();
        let heading = |t: f64| 0.4 * t + 0.5 * (0.8 * t).sin();
        let read_heading = |t: f64| heading(t) + TURNED_RAD;
        let velocity = |t: f64| Vector3::new(1.0 + 0.3 * (0.7 * t).sin(), 0.2 * t.cos(), 0.0);
        let place = |t: f64| Vector3::new(3.0 * (0.3 * t).sin(), 0.4 * t, 0.0);
        let time_s: Vec<f64> = (0..400).map(|k| 0.05 * f64::from(k)).collect();
        let series = |of: &dyn Fn(f64) -> f64| {
            let values = time_s.iter().copied().map(of).collect::<Vec<f64>>();
            Some(Timed::new("motion", time_s.clone(), values).expect("a series"))
        };
        let read = |t: f64| {
            let before = t - LATE_S;
            to_world(read_heading(t)).transpose() * to_world(heading(before)) * velocity(before)
        };
        let fix = |t: f64| {
            let before = t - LATE_S;
            place(before) + to_world(heading(before)) * antenna
                - to_world(read_heading(t)) * antenna
        };
        let empty = || TrialRecord {
            attitude: [None, None, series(&read_heading)],
            ..TrialRecord::until("a", 19.9)
        };
        let of_velocity = TrialRecord {
            velocity: [series(&|t| read(t).x), series(&|t| read(t).y), None, None, None, None],
            is_turned: true,
            ..empty()
        };
        let of_fixes = TrialRecord {
            velocity: [series(&|t| read(t).x), series(&|t| read(t).y), None, None, None, None],
            by_slope: [true, true, false, false, false, false],
            fixes: Some([series(&|t| fix(t).x), series(&|t| fix(t).y)]),
            fixes_lever_m: antenna,
            ..empty()
        };
        let misalignment_rad = [0.0, 0.0, TURNED_RAD];
        let report =
            VelocityReport { delay_s: LATE_S, misalignment_rad, ..VelocityReport::default() };
        for record in [&of_velocity, &of_fixes] {
            let found = record.with_translations_before(&report);
            assert!((found.window_s.1 - (19.9 - LATE_S)).abs() < 0.1, "{:?}", found.window_s);
            let both = [0, 1].map(|k| found.velocity[k].as_ref().expect("measured"));
            // Heading is known from the start of the log on, and linear between samples.
            for t in [1.0, 7.3, 15.5] {
                let off = Vector3::new(both[0].at(t), both[1].at(t), 0.0) - velocity(t);
                assert!(off.norm() < 2e-3, "{t} s: {off}");
            }
        }
        let fixes = of_fixes.with_translations_before(&report).fixes.expect("there");
        let [north, east] = fixes.map(|own| own.expect("there"));
        for t in [1.0, 7.3, 15.5] {
            let expected = to_world(TURNED_RAD) * place(t);
            let off = Vector3::new(north.at(t), east.at(t), 0.0) - expected;
            assert!(off.norm() < 2e-3, "{t} s: {off}");
        }
    }

    /// A sensor that is turned by Rᵀ reads the velocity of its vehicle along its own axes.
    #[test]
    fn a_turned_sensor_is_turned_back() {
        let turn = Vector3::new(0.1, -0.05, 0.2);
        let grid = Grid { start_s: 0.0, period_s: 0.1, len: 50 };
        let time_s: Vec<f64> = grid.times().collect();
        let velocity = |t: f64| Vector3::new(t.sin(), 0.5 * (2.0 * t).cos(), 0.1 * t);
        let read = |along: usize| {
            let own = |t: &f64| Rotation3::from_scaled_axis(turn).inverse() * velocity(*t);
            let values: Vec<f64> = time_s.iter().map(|t| own(t)[along]).collect();
            Timed::new("dvl", time_s.clone(), values).expect("a series")
        };
        let mut record = TrialRecord::until("a", 4.9);
        (0..3).for_each(|along| record.velocity[along] = Some(read(along)));
        let report = VelocityReport { misalignment_rad: turn.into(), ..VelocityReport::default() };
        let found = record.with_translations_before(&report);
        for along in 0..3 {
            let found = found.velocity[along].as_ref().expect("measured");
            for (t, v) in found.time_s().iter().zip(found.values()) {
                assert!((v - velocity(*t)[along]).abs() < 1e-12, "{along}, {t}: {v}");
            }
        }
        // Of one that lacks an axis, what that would add is left out.
        record.velocity[2] = None;
        let found = record.with_translations_before(&report);
        assert!(found.velocity[0].is_some() && found.velocity[2].is_none());
    }

    #[test]
    fn a_lag_is_not_inverted_across_a_gap() {
        let grid = Grid { start_s: 0.0, period_s: 0.1, len: 40 };
        let time_s: Vec<f64> = grid.times().map(|t| if t > 2.0 { t + 5.0 } else { t }).collect();
        let series = Timed::new("velocity", time_s, vec![1.0; 40]).expect("a series");
        let report = VelocityReport { lag_s: 0.3, ..VelocityReport::default() };
        let found = report.before_lag(series);
        assert_eq!(found.len(), 38);
        assert!(found.values().iter().all(|v| (v - 1.0).abs() < 1e-12));
    }

    /// A DVL ahead of the origin of a vehicle that pitches without translation: it measures `ω × r`
    /// with delay and lag, whether its stated position is right or not.
    #[test]
    fn delay_and_lag_apply_to_the_lever_arm_too() {
        const AHEAD_M: f64 = 0.1;
        let late = VelocityReport { delay_s: 0.15, lag_s: 0.3, ..VelocityReport::default() };
        let time_s: Vec<f64> = (0..600).map(|k| 0.02 * f64::from(k)).collect();
        let rate: Vec<f64> = time_s.iter().map(|t| (2.0 * t).sin()).collect();
        let rate = Timed::new("rate", time_s.clone(), rate).expect("a series");
        let behind: Vec<f64> = rate.values().iter().map(|q| -AHEAD_M * q).collect();
        let behind = late.behind_lag(&time_s, behind);
        let behind = rate.with_values("behind", behind).expect("finite");
        let sampled: Vec<f64> = time_s.iter().copied().step_by(5).collect();
        let read: Vec<f64> = sampled.iter().map(|t| behind.at(t - late.delay_s)).collect();
        let read = Timed::new("dvl", sampled, read).expect("a series");
        for stated_m in [0.0, AHEAD_M] {
            let still = rate.map(|_| 0.0);
            let mut velocity = [const { None }; 6];
            velocity[2] = Some(read.map(|_| 0.0));
            let record = TrialRecord {
                velocity,
                readings: [None, None, Some(read.clone())],
                levers_m: [0.0, 0.0, stated_m].map(|x| Vector3::new(x, 0.0, 0.0)),
                rates: Some([still.clone(), rate.clone(), still]),
                ..TrialRecord::until("a", 12.0)
            };
            let lever_m = [AHEAD_M - stated_m, 0.0, 0.0];
            let found = record.with_translations_before(&VelocityReport { lever_m, ..late });
            let of_origin = found.velocity[2].as_ref().expect("measured");
            assert!(read.values().iter().any(|v| v.abs() > 0.05), "it is read as motion");
            let inside = of_origin.values().iter().skip(3);
            assert!(inside.clone().all(|v| v.abs() < 1e-3), "{inside:?}");
            assert_eq!(found.levers_m[2].x, AHEAD_M);
        }
    }
}
