//! Tests and estimation of delay, lag, lever arm and misalignment of the velocity sensor relative to
//! thrust and rates of turn.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::descent::{Optimum, Tolerance};
use super::problem::{PLACE, Point, Problem, ReportSlope};
use super::uncertainty::{Asked, put_behind};
use super::{COLOURED, Fitted, search};
use crate::{Dof, Error, Timed, TrialRecord, VelocityReport};

/// Maximum number of steps of delay, lag and lever arm: after the first they are small.
const MOST_STEPS: usize = 6;

/// The same of a lever arm by itself: mass and damping that stand for it follow it slowly.
const MOST_LEVER_STEPS: usize = 12;

/// Delays at which a fit begins where innovations are coloured, s.
const DISTANT_DELAYS_S: [f64; 3] = [0.12, 0.25, 0.5];

/// Minimum delay or lag, s: less is within the sampling error.
const LEAST_S: f64 = 0.003;

/// Maximum delay or lag, s: more indicates another fault.
const MOST_S: f64 = 1.5;

/// Minimum lever arm, m, in any component: the mounting position of a sensor is not known better.
const LEAST_LEVER_M: f64 = 0.02;

/// Minimum misalignment, rad, in any component: half a degree is within what a bracket allows.
const LEAST_MISALIGNMENT_RAD: f64 = 0.009;

/// Maximum misalignment, rad, in any component: more indicates another fault, such as exchanged axes.
const MOST_MISALIGNMENT_RAD: f64 = 1.0;

/// Components of the lever arm, and of the misalignment; of these that of heading, which fixes of position show.
const LEVER: Range<usize> = 0..3;
const MISALIGNMENT: Range<usize> = 3..PLACE;
const OF_HEADING: Range<usize> = 5..PLACE;

/// Minimum lag relative to thrust, s: only the autocorrelation of the misfit separates it from a
/// lag of the thrusters.
const LEAST_LAG_S: f64 = 0.03;

/// Minimum initial lag, s: at zero lag its derivative equals that of the delay.
const FIRST_LAG_S: f64 = 0.1;

/// A step below this many standard deviations is negligible.
const SETTLED: f64 = 0.5;

/// Delay, lag, lever arm and misalignment of the velocity sensor, with standard deviations in s, m and
/// rad; `None` for those that are not significant.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reported {
    pub(super) how: VelocityReport,
    pub(super) std: [Option<f64>; 2],
    pub(super) lever_std: [Option<f64>; 3],
    pub(super) misalignment_std: [Option<f64>; 3],
    /// Part of one sample that the lag carries into the next.
    pub(super) keep: f64,
}

/// A fit to translations corrected for delay, lag, lever arm and misalignment of their sensor.
struct Corrected {
    problem: Problem,
    optimum: Optimum,
    records: Vec<TrialRecord>,
    reported: Reported,
}

impl Fitted {
    /// Estimates delay, lag, lever arm and misalignment of the velocity sensor, if they are significant; of fixes of
    /// position the delay, and how the heading is turned against them.
    /// Returns the fit and the corrected records; no records if nothing is significant.
    ///
    /// A DVL outputs the mean of its pings once it is computed, a tenth to half a second after
    /// their middle, or through a filter. Only the delay relative to the rates is estimated: a
    /// delay common to all measurements is attributed to the thrusters. A lever arm that differs
    /// from the stated one adds `ω × r`. A sensor that is turned reads motion along one axis on another:
    /// thrust then seems to push beside where it does.
    pub(super) fn with_report_that_shows(
        mut self,
        records: &[&TrialRecord],
    ) -> Result<(Self, Vec<TrialRecord>), Error> {
        let Problem { structure, by_slope, is_free, .. } = &self.problem;
        let is_rate = |dof: &Dof| dof.is_rotation() && !by_slope[dof.index()];
        let has_rates = self.problem.has_heading || structure.axes().iter().any(is_rate);
        let has_sensor = self.problem.measures_velocity();
        if *is_free || !(has_sensor || self.problem.has_fixes && has_rates) {
            return Ok((self, Vec::new()));
        }
        let colour = self.colour_of_translations()?;
        let bar = search::ADMITTED * colour;
        let distant = match has_rates && colour > COLOURED {
            true => self.with_distant_delay(records, bar),
            false => None,
        };
        let found = match has_rates {
            true => self.with_delay(records, bar, distant).map(|delayed| {
                let is_late = has_sensor && delayed.reported.std[0].is_some();
                let with_lag = is_late.then(|| self.with_lag(records, &delayed, bar)).flatten();
                with_lag.unwrap_or(delayed)
            }),
            false => self
                .lagging_relative_to_thrust(records, bar)
                .or_else(|| self.placed(records, bar, MISALIGNMENT)),
        };
        let Some(found) = found else { return Ok((self, Vec::new())) };
        let iterations = self.optimum.iterations + found.optimum.iterations;
        self.optimum = Optimum { iterations, ..found.optimum };
        (self.problem, self.reported) = (found.problem, found.reported);
        Ok((self, found.records))
    }

    /// Fits with the likeliest of several delays of the translations, if its gain over none in twice
    /// the log-likelihood of pieces of the trials exceeds the bar: a plant that was fitted without a
    /// delay may have made up for it, so that no small step leads there.
    fn with_distant_delay(&self, records: &[&TrialRecord], bar: f64) -> Option<Corrected> {
        let fitted = |problem: &Problem| {
            let pieces = problem.in_pieces()?;
            let optimum = pieces.descent(self.optimum.point.clone(), Tolerance::COARSE).ok()?;
            let cost = by_sample(&pieces, &optimum.point, 0.0).ok()?;
            Some((cost, pieces.samples() as f64, optimum.point))
        };
        let (without, samples, _) = fitted(&self.problem)?;
        let with = |delay_s: f64| {
            let how = VelocityReport { delay_s, ..VelocityReport::default() };
            let records: Vec<TrialRecord> =
                records.iter().map(|record| record.with_translations_before(&how)).collect();
            let (cost, _, point) = fitted(&self.problem.of(&records.iter().collect::<Vec<_>>()))?;
            Some((cost, how, point))
        };
        let all = DISTANT_DELAYS_S.into_iter().filter_map(with);
        let (cost, how, point) = all.min_by(|a, b| a.0.total_cmp(&b.0))?;
        if 2.0 * samples * (without - cost) < bar {
            return None;
        }
        let mut found =
            self.fit_corrected(records, Reported { how, ..Reported::default() }, point)?;
        let by = found.problem.slope_by_report(&found.optimum.point, 0.0)?;
        let (_, covariance) = by.delay_and_lag_step([false; PLACE]);
        found.reported.std[0] = Some(covariance[(0, 0)].sqrt());
        Some(found)
    }

    /// Fits with a delay, lever arm or misalignment of the translations, if its gain in twice the log-likelihood
    /// exceeds the bar.
    fn with_delay(
        &self,
        records: &[&TrialRecord],
        bar: f64,
        mut found: Option<Corrected>,
    ) -> Option<Corrected> {
        for _ in 0..MOST_STEPS {
            let (problem, point, mut now) = match &found {
                Some(found) => (&found.problem, &found.optimum.point, found.reported),
                None => (&self.problem, &self.optimum.point, Reported::default()),
            };
            let Some(by) = problem.slope_by_report(point, 0.0) else { break };
            let place_changed = now.update_place(&by, bar, problem.places());
            let (step, covariance) = by.delay_and_lag_step(now.has_place());
            let (step, variance) = (step[0], covariance[(0, 0)]);
            // What was admitted is followed to where it settles.
            let least = if now.std[0].is_some() { SETTLED * SETTLED } else { bar };
            // A receiver's fixes are late, never early.
            let is_possible = problem.measures_velocity() || now.how.delay_s + step > 0.0;
            let is_late = is_possible && step.abs() >= LEAST_S && step.powi(2) >= least * variance;
            if !is_late && !place_changed {
                break;
            }
            let before = now.how.delay_s;
            let mut tries = Vec::new();
            if is_late {
                now.std[0] = Some(variance.sqrt());
                tries.push((before + step, point.clone()));
                // A delay of the translations may have been fitted as one of the thrusters. No
                // small step leads away from that, as thrust changes in steps.
                let of_thrust = point.actuator.delay_s;
                if of_thrust > LEAST_S {
                    let mut undelayed = point.clone();
                    undelayed.actuator.delay_s = 0.0;
                    tries.push((before + step.max(0.0) + of_thrust, undelayed));
                }
            } else {
                tries.push((before, point.clone()));
            }
            let there = tries.into_iter().filter_map(|(delay_s, from)| {
                let how = VelocityReport { delay_s: delay_s.clamp(-MOST_S, MOST_S), ..now.how };
                self.fit_corrected(records, Reported { how, ..now }, from)
            });
            // Windows differ in length by less than the delays: costs are compared per sample.
            let by_sample = |it: &Corrected| it.optimum.cost / it.problem.samples() as f64;
            match there.min_by(|a, b| by_sample(a).total_cmp(&by_sample(b))) {
                Some(there) => found = Some(there),
                None => break,
            }
        }
        found
    }

    /// Fits with a lag of the translations, and with a delay in addition where its gain exceeds the
    /// bar; `None` unless this is likelier than the delay alone.
    fn with_lag(
        &self,
        records: &[&TrialRecord],
        delayed: &Corrected,
        bar: f64,
    ) -> Option<Corrected> {
        let lag_s = delayed.reported.how.delay_s.max(FIRST_LAG_S);
        // A delay fitted in place of a lag leaves an error that may pass for a lever arm: the place
        // restarts from the stated one.
        let how = VelocityReport { lag_s, ..VelocityReport::default() };
        let mut now = Reported { how, ..Reported::default() };
        let (mut from, mut is_delayed) = (delayed.optimum.point.clone(), false);
        let mut last = None;
        for _ in 0..MOST_STEPS {
            let how = now.how;
            let mut there = self.fit_corrected(records, now, from)?;
            let by = there.problem.slope_by_report(&there.optimum.point, how.lag_s)?;
            let place_changed = now.update_place(&by, bar, 0..PLACE);
            let (step, covariance) = by.delay_and_lag_step(now.has_place());
            let (next, std) = stepped(now.how, &step, &covariance, is_delayed);
            let moved = (next.delay_s - how.delay_s).abs().max((next.lag_s - how.lag_s).abs());
            let is_settled = moved < LEAST_S.max(SETTLED * std[1].unwrap_or_default());
            let supports_delay =
                !is_delayed && step[0] > LEAST_S && step[0].powi(2) > bar * covariance[(0, 0)];
            there.reported.std = std;
            there.reported.lever_std = now.lever_std;
            there.reported.misalignment_std = now.misalignment_std;
            (now.how, from) = (next, there.optimum.point.clone());
            last = Some(there);
            if is_settled && !supports_delay && !place_changed {
                break;
            }
            is_delayed |= is_settled && !place_changed;
        }
        let with_lag = last?;
        (with_lag.by_sample().ok()? < delayed.by_sample().ok()?).then_some(with_lag)
    }

    /// Fits with a lag of the translations where thrust is the only time reference; `None` unless
    /// the gain exceeds the bar.
    ///
    /// A delay would then be attributed to the thrust. A lag would not: it also leaves
    /// autocorrelation in the noise.
    fn lagging_relative_to_thrust(&self, records: &[&TrialRecord], bar: f64) -> Option<Corrected> {
        let how = VelocityReport { lag_s: FIRST_LAG_S, ..VelocityReport::default() };
        let mut now = Reported { how, ..Reported::default() };
        let mut from = self.optimum.point.clone();
        for _ in 0..MOST_STEPS {
            let mut there = self.fit_corrected(records, now, from)?;
            let lag_s = now.how.lag_s;
            let (step, covariance) =
                there.problem.slope_by_report(&there.optimum.point, lag_s)?.lag_step();
            let std = covariance[(0, 0)].sqrt();
            let next = (lag_s + step[0]).clamp(0.5 * lag_s, 2.0 * lag_s).min(MOST_S);
            if (next - lag_s).abs() < LEAST_S.max(SETTLED * std) {
                there.reported.std[1] = Some(std);
                let samples = there.problem.samples() as f64;
                let before = by_sample(&self.problem, &self.optimum.point, 0.0).ok()?;
                let gained = 2.0 * samples * (before - there.by_sample().ok()?);
                let is_significant =
                    lag_s >= LEAST_LAG_S && gained > bar && (lag_s / std).powi(2) > bar;
                return is_significant.then_some(there);
            }
            (now.how.lag_s, from) = (next, there.optimum.point);
        }
        None
    }

    /// Fits with the components of a lever arm of the velocity sensor that each gain more in twice the log-likelihood
    /// than chance alone, whatever colours the innovations, beside delay and lag as they are; with its records. `None` if
    /// none does.
    pub(super) fn with_lever(&self, records: &[&TrialRecord]) -> Option<(Self, Vec<TrialRecord>)> {
        let found = self.placed(records, search::ADMITTED, LEVER)?;
        let Corrected { problem, optimum, records, reported } = found;
        let iterations = self.optimum.iterations + optimum.iterations;
        let optimum = Optimum { iterations, ..optimum };
        let how = VelocityReport { lever_m: reported.how.lever_m, ..self.reported.how };
        let reported = Reported { how, lever_std: reported.lever_std, ..self.reported };
        Some((Self { problem, optimum, reported, ..self.clone() }, records))
    }

    /// Fits with those components of lever arm and misalignment whose gain in twice the log-likelihood exceeds the bar;
    /// `None` if none does.
    fn placed(
        &self,
        records: &[&TrialRecord],
        bar: f64,
        components: Range<usize>,
    ) -> Option<Corrected> {
        let mut found: Option<Corrected> = None;
        for _ in 0..MOST_LEVER_STEPS {
            let (problem, point, mut now) = match &found {
                Some(found) => (&found.problem, &found.optimum.point, found.reported),
                None => (&self.problem, &self.optimum.point, Reported::default()),
            };
            let by = problem.slope_by_report(point, 0.0)?;
            if !now.update_place(&by, bar, components.clone()) {
                break;
            }
            found = Some(self.fit_corrected(records, now, point.clone())?);
        }
        found
    }

    /// Fits, from a point, records corrected for delay, lag, lever arm and misalignment of the sensor.
    fn fit_corrected(
        &self,
        records: &[&TrialRecord],
        reported: Reported,
        from: Point,
    ) -> Option<Corrected> {
        let how = &reported.how;
        let records: Vec<TrialRecord> =
            records.iter().map(|record| record.with_translations_before(how)).collect();
        let problem = self.problem.of(&records.iter().collect::<Vec<_>>());
        let optimum = problem.descent(from, Tolerance::COARSE).ok()?;
        let keep = left_of_report(how, &records);
        Some(Corrected { problem, optimum, records, reported: Reported { keep, ..reported } })
    }
}

impl Problem {
    /// The components of lever arm and misalignment that the trials may show: of fixes, which hardly show where an
    /// antenna sits, that of heading.
    fn places(&self) -> Range<usize> {
        if self.measures_velocity() { 0..PLACE } else { OF_HEADING }
    }
}

impl Reported {
    /// Updates some components of lever arm and misalignment, if they are significant; returns true if any changes.
    fn update_place(&mut self, by: &ReportSlope, bar: f64, components: Range<usize>) -> bool {
        let (step, covariance) = by.place_step(components.clone());
        let how = &mut self.how;
        let numbers = how.lever_m.iter_mut().chain(&mut how.misalignment_rad);
        let stds = self.lever_std.iter_mut().chain(&mut self.misalignment_std);
        let mut own: Vec<(usize, (&mut f64, &mut Option<f64>))> =
            numbers.zip(stds).enumerate().filter(|(k, _)| components.contains(k)).collect();
        let numbers = step + DVector::from_iterator(own.len(), own.iter().map(|(_, own)| *own.0));
        let mut asked = Asked { numbers, covariance };
        asked.without_unseen(|_, _| bar);
        let lever = (LEVER, LEAST_LEVER_M..f64::INFINITY);
        let misalignment = (MISALIGNMENT, LEAST_MISALIGNMENT_RAD..MOST_MISALIGNMENT_RAD);
        for (part, usual) in [lever, misalignment] {
            let places = || (0..own.len()).filter(|at| part.contains(&own[*at].0));
            let most = places().map(|at| asked.numbers[at].abs()).fold(0.0, f64::max);
            if !usual.contains(&most) {
                places().for_each(|at| asked.numbers[at] = 0.0);
            }
        }
        let mut changes = false;
        for (at, (_, (number, own_std))) in own.iter_mut().enumerate() {
            let now = asked.numbers[at];
            let std = asked.covariance[(at, at)].max(0.0).sqrt();
            changes |= (now - **number).abs() > SETTLED * std;
            **number = now;
            **own_std = (now != 0.0).then_some(std);
        }
        changes
    }

    /// True of the components of lever arm and misalignment that are significant.
    fn has_place(&self) -> [bool; PLACE] {
        std::array::from_fn(|k| match k.checked_sub(MISALIGNMENT.start) {
            None => self.lever_std[k].is_some(),
            Some(k) => self.misalignment_std[k].is_some(),
        })
    }
}

/// Returns the part of a sample that a lag of the translations carries into the next,
/// `exp(−period/lag)`.
pub(super) fn left_of_report(report: &VelocityReport, records: &[TrialRecord]) -> f64 {
    let reported = |record: &TrialRecord| {
        let axis = (0..3).find(|k| record.may_be_late(*k) && record.velocity[*k].is_some())?;
        record.velocity[axis].as_ref().map(Timed::period_s)
    };
    let period_s = records.iter().find_map(reported);
    period_s.map_or(0.0, |period_s| (-period_s / report.lag_s).exp())
}

impl Corrected {
    fn by_sample(&self) -> Result<f64, Error> {
        by_sample(&self.problem, &self.optimum.point, self.reported.keep)
    }
}

/// Computes the sum over all samples of ½ ln of the mean squared one-step prediction error, per
/// sample, since windows differ in length by less than the delay.
///
/// Inversion of the lag enlarges noise by 1/(1 − a). Noise that enters after the lag is white once
/// the lag is applied again, noise that enters before it is white as it is: the smaller error
/// counts.
fn by_sample(problem: &Problem, point: &Point, keep: f64) -> Result<f64, Error> {
    let trials = problem.innovations(point)?;
    let (mut sum, mut count) = (0.0, 0.0);
    for (axis, dof) in problem.structure.axes().iter().enumerate() {
        let keep = if problem.may_be_late(*dof) { keep } else { 0.0 };
        let (mut before, mut after, mut n) = (0.0, 0.0, 0.0);
        for trial in &trials {
            let own = trial.iter().filter(|innovation| innovation.axis == Some(axis));
            let mut e: Vec<f64> = own.map(|own| (1.0 - keep) * own.error).collect();
            before += e.iter().map(|e| e * e).sum::<f64>();
            put_behind(&mut e, keep);
            after += e.iter().map(|e| e * e).sum::<f64>();
            n += e.len() as f64;
        }
        if n > 0.0 {
            sum += 0.5 * n * (before.min(after) / n).ln();
            count += n;
        }
    }
    Ok(sum / count)
}

/// Returns delay and lag after a step, with standard deviations; of the lag alone where there is no
/// delay.
fn stepped(
    how: VelocityReport,
    step: &DVector<f64>,
    covariance: &DMatrix<f64>,
    is_delayed: bool,
) -> (VelocityReport, [Option<f64>; 2]) {
    let [[of_delay, of_both], [_, of_lag]] = [0, 1].map(|i| [0, 1].map(|j| covariance[(i, j)]));
    let delay_s = if is_delayed { (how.delay_s + step[0]).clamp(0.0, MOST_S) } else { 0.0 };
    // The lag takes over the part of the step that the delay cannot make.
    let short = delay_s - how.delay_s - step[0];
    let by = step[1] + of_both / of_delay * short;
    let lag_s = (how.lag_s + by).clamp(0.5 * how.lag_s, 2.0 * how.lag_s).min(MOST_S);
    let alone = of_lag - of_both.powi(2) / of_delay;
    let std = if is_delayed {
        [Some(of_delay.sqrt()), Some(of_lag.sqrt())]
    } else {
        [None, Some(alone.sqrt())]
    };
    (VelocityReport { delay_s, lag_s, ..how }, std)
}
