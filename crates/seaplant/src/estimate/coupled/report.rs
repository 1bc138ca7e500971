//! Whether translations are measured late beside thrust and rates of turn, or elsewhere than is stated.

use nalgebra::{DMatrix, DVector};

use super::fit::{ByReport, Optimum, Point, Problem, Tolerance};
use super::uncertainty::{Asked, put_behind};
use super::{Fitted, search};
use crate::{CoupledRecord, Dof, Error, Timed, VelocityReport};

/// Steps towards delay, lag and levers: from the second on they are small.
const MOST_STEPS: usize = 6;

/// A delay or lag of less is none, s: a sample's own rounding …
const LEAST_S: f64 = 0.003;

/// … and of more is another fault, s.
const MOST_S: f64 = 1.5;

/// Levers that are all shorter are none, m: nobody knows better where an instrument measures.
const LEAST_LEVER_M: f64 = 0.02;

/// A lag of less beside that of thrusters is none, s: they are told apart by how the misfit looks.
const LEAST_LAG_S: f64 = 0.03;

/// At no lag its slope is the delay's: it begins at so much or more, s.
const FIRST_LAG_S: f64 = 0.1;

/// A step of less, in standard deviations, changes nothing.
const SETTLED: f64 = 0.5;

/// How translations are reported, and the standard deviations of delay and lag, s, and of levers, m;
/// none of what the trials do not show.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reported {
    pub(super) how: VelocityReport,
    pub(super) std: [Option<f64>; 2],
    pub(super) lever_std: [Option<f64>; 3],
    /// What the lag leaves of a report to the next.
    pub(super) keep: f64,
}

/// A fit to translations that are as they were before their instrument.
struct Prompt<const N: usize> {
    problem: Problem,
    optimum: Optimum<N, N>,
    records: Vec<CoupledRecord>,
    reported: Reported,
}

impl<const N: usize> Fitted<N, N> {
    /// The same with translations of the origin, as they were before they are reported late beside thrust
    /// and rates, or from elsewhere than is stated, if the trials show that, and the records with
    /// these; none if they do not.
    ///
    /// A DVL reports a mean of its pings when it has worked it out, a tenth to half a second
    /// after the middle of them, or behind a filter. What counts is beside rates: a delay of
    /// everything that is measured is the thrusters'. Where it sits somewhere else than is stated it
    /// reports what turning makes of that as well.
    pub(super) fn with_report_that_shows(
        mut self,
        records: &[&CoupledRecord],
    ) -> Result<(Self, Vec<CoupledRecord>), Error> {
        let Problem { structure, by_slope, is_free, .. } = &self.problem;
        let is_rate = |dof: &Dof| dof.is_rotation() && !by_slope[dof.index()];
        let has_rates = structure.axes().iter().any(is_rate);
        let may_be_late = structure.axes().iter().any(|dof| self.problem.may_be_late(*dof));
        if *is_free || !may_be_late {
            return Ok((self, Vec::new()));
        }
        let bar = search::ADMITTED * self.colour_of_translations()?;
        let found = match has_rates {
            true => self.delayed(records, bar).map(|delayed| {
                let is_late = delayed.reported.std[0].is_some();
                let lagging = is_late.then(|| self.lagging(records, &delayed, bar)).flatten();
                lagging.unwrap_or(delayed)
            }),
            false => self.lagging_beside_thrust(records, bar),
        };
        let Some(found) = found else { return Ok((self, Vec::new())) };
        let iterations = self.optimum.iterations + found.optimum.iterations;
        self.optimum = Optimum { iterations, ..found.optimum };
        (self.problem, self.reported) = (found.problem, found.reported);
        Ok((self, found.records))
    }

    /// With translations that are delayed, or measured elsewhere, if that is worth more than the bar.
    fn delayed(&self, records: &[&CoupledRecord], bar: f64) -> Option<Prompt<N>> {
        let mut found: Option<Prompt<N>> = None;
        for _ in 0..MOST_STEPS {
            let (problem, point, mut now) = match &found {
                Some(found) => (&found.problem, &found.optimum.point, found.reported),
                None => (&self.problem, &self.optimum.point, Reported::default()),
            };
            let Some(by) = problem.by_report(point, 0.0) else { break };
            let moves_levers = now.moves_levers(&by, bar);
            let (step, covariance) = by.of_lateness(now.lever_std.map(|std| std.is_some()));
            let (step, variance) = (step[0], covariance[(0, 0)]);
            let is_late = step.abs() >= LEAST_S && step.powi(2) >= bar * variance;
            if !is_late && !moves_levers {
                break;
            }
            let before = now.how.delay_s;
            let mut tries = Vec::new();
            if is_late {
                now.std[0] = Some(variance.sqrt());
                tries.push((before + step, point.clone()));
                // What translations are late by may pass for a delay of the thrusters, from which no
                // small step leads away: thrust changes at instants.
                let of_thrust = point.actuator.delay_s;
                if of_thrust > LEAST_S {
                    let mut prompt = point.clone();
                    prompt.actuator.delay_s = 0.0;
                    tries.push((before + step.max(0.0) + of_thrust, prompt));
                }
            } else {
                tries.push((before, point.clone()));
            }
            let there = tries.into_iter().filter_map(|(delay_s, from)| {
                let how = VelocityReport { delay_s: delay_s.clamp(-MOST_S, MOST_S), ..now.how };
                self.before(records, Reported { how, ..now }, from)
            });
            // Windows differ by less than the delays: costs are compared by sample.
            let by_sample = |it: &Prompt<N>| it.optimum.cost / it.problem.samples() as f64;
            match there.min_by(|a, b| by_sample(a).total_cmp(&by_sample(b))) {
                Some(there) => found = Some(there),
                None => break,
            }
        }
        found
    }

    /// With translations that are behind a lag, and delayed beside it where that is worth more than
    /// the bar, if they are likelier so.
    fn lagging(
        &self,
        records: &[&CoupledRecord],
        delayed: &Prompt<N>,
        bar: f64,
    ) -> Option<Prompt<N>> {
        let lag_s = delayed.reported.how.delay_s.max(FIRST_LAG_S);
        // A delay in the place of a lag leaves of it what may pass for levers: they are found anew.
        let how = VelocityReport { lag_s, ..VelocityReport::default() };
        let mut now = Reported { how, ..Reported::default() };
        let (mut from, mut is_delayed) = (delayed.optimum.point.clone(), false);
        let mut last = None;
        for _ in 0..MOST_STEPS {
            let how = now.how;
            let mut there = self.before(records, now, from)?;
            let by = there.problem.by_report(&there.optimum.point, how.lag_s)?;
            let moves_levers = now.moves_levers(&by, bar);
            let (step, covariance) = by.of_lateness(now.lever_std.map(|std| std.is_some()));
            let (next, std) = stepped(now.how, &step, &covariance, is_delayed);
            let moved = (next.delay_s - how.delay_s).abs().max((next.lag_s - how.lag_s).abs());
            let is_settled = moved < LEAST_S.max(SETTLED * std[1].unwrap_or_default());
            let asks_for_delay =
                !is_delayed && step[0] > LEAST_S && step[0].powi(2) > bar * covariance[(0, 0)];
            (there.reported.std, there.reported.lever_std) = (std, now.lever_std);
            (now.how, from) = (next, there.optimum.point.clone());
            last = Some(there);
            if is_settled && !asks_for_delay && !moves_levers {
                break;
            }
            is_delayed |= is_settled && !moves_levers;
        }
        let lagging = last?;
        (lagging.by_sample().ok()? < delayed.by_sample().ok()?).then_some(lagging)
    }

    /// With translations that are behind a lag, where nothing but thrust tells of it, if that is worth
    /// more than the bar.
    ///
    /// A delay is then that of thrust; a lag is not, as what reaches the next report through it is left
    /// in the noise as well.
    fn lagging_beside_thrust(&self, records: &[&CoupledRecord], bar: f64) -> Option<Prompt<N>> {
        let how = VelocityReport { lag_s: FIRST_LAG_S, ..VelocityReport::default() };
        let mut now = Reported { how, ..Reported::default() };
        let mut from = self.optimum.point.clone();
        for _ in 0..MOST_STEPS {
            let mut there = self.before(records, now, from)?;
            let lag_s = now.how.lag_s;
            let (step, covariance) = there.problem.by_report(&there.optimum.point, lag_s)?.of_lag();
            let std = covariance[(0, 0)].sqrt();
            let next = (lag_s + step[0]).clamp(0.5 * lag_s, 2.0 * lag_s).min(MOST_S);
            if (next - lag_s).abs() < LEAST_S.max(SETTLED * std) {
                there.reported.std[1] = Some(std);
                let samples = there.problem.samples() as f64;
                let before = by_sample(&self.problem, &self.optimum.point, 0.0).ok()?;
                let gained = 2.0 * samples * (before - there.by_sample().ok()?);
                let shows = lag_s >= LEAST_LAG_S && gained > bar && (lag_s / std).powi(2) > bar;
                return shows.then_some(there);
            }
            (now.how.lag_s, from) = (next, there.optimum.point);
        }
        None
    }

    /// The optimum, from a point, of trials whose translations are reported so.
    fn before(
        &self,
        records: &[&CoupledRecord],
        reported: Reported,
        from: Point<N, N>,
    ) -> Option<Prompt<N>> {
        let how = &reported.how;
        let records: Vec<CoupledRecord> =
            records.iter().map(|record| record.with_translations_before(how)).collect();
        let problem = self.problem.of(&records.iter().collect::<Vec<_>>());
        let optimum = problem.descent(from, Tolerance::COARSE).ok()?;
        let keep = left_of_report(how, &records);
        Some(Prompt { problem, optimum, records, reported: Reported { keep, ..reported } })
    }
}

impl Reported {
    /// Takes levers to be as long as the trials ask for, of those that they show; whether that changes
    /// any.
    fn moves_levers(&mut self, by: &ByReport, bar: f64) -> bool {
        let (step, covariance) = by.of_levers();
        let numbers = step + DVector::from(self.how.lever_m.to_vec());
        let mut asked = Asked { numbers, covariance };
        asked.without_unseen(|_, _| bar);
        if asked.numbers.amax() < LEAST_LEVER_M {
            asked.numbers.fill(0.0);
        }
        let mut changes = false;
        for (along, lever) in self.how.lever_m.iter_mut().enumerate() {
            let now = asked.numbers[along];
            let std = asked.covariance[(along, along)].max(0.0).sqrt();
            changes |= (now - *lever).abs() > SETTLED * std;
            *lever = now;
            self.lever_std[along] = (now != 0.0).then_some(std);
        }
        changes
    }
}

/// What a lag of translations leaves of a report to the next.
pub(super) fn left_of_report(report: &VelocityReport, records: &[CoupledRecord]) -> f64 {
    let reported = |record: &CoupledRecord| {
        let axis = (0..3).find(|k| record.may_be_late(*k) && record.velocity[*k].is_some())?;
        record.velocity[axis].as_ref().map(Timed::period_s)
    };
    let period_s = records.iter().find_map(reported);
    period_s.map_or(0.0, |period_s| (-period_s / report.lag_s).exp())
}

impl<const N: usize> Prompt<N> {
    fn by_sample(&self) -> Result<f64, Error> {
        by_sample(&self.problem, &self.optimum.point, self.reported.keep)
    }
}

/// Σ ½ ln of the mean square by which the next report is off, over all samples, by the sample, as
/// windows differ by less than what is late.
///
/// The lag's inverse enlarges what it is given by 1/(1 − a). Noise from after the lag is white where
/// it is put behind it again, noise from before it as it is: the smaller counts.
fn by_sample<const N: usize>(
    problem: &Problem,
    point: &Point<N, N>,
    keep: f64,
) -> Result<f64, Error> {
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

/// Delay and lag after a step, and their standard deviations: of the lag alone where there is no
/// delay.
fn stepped(
    how: VelocityReport,
    step: &DVector<f64>,
    covariance: &DMatrix<f64>,
    is_delayed: bool,
) -> (VelocityReport, [Option<f64>; 2]) {
    let [[of_delay, of_both], [_, of_lag]] = [0, 1].map(|i| [0, 1].map(|j| covariance[(i, j)]));
    let delay_s = if is_delayed { (how.delay_s + step[0]).clamp(0.0, MOST_S) } else { 0.0 };
    // What the delay cannot do the lag does.
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
