//! Plans a trial from a prior, goals and limits.

use std::collections::BTreeMap;

use seaplant::exchange::Draws;
use seaplant::{Dof, Vehicle, parallel, spoken};

use crate::Error;
use crate::allocate::{Allocation, Criterion};
use crate::battery::HOUR_S;
use crate::drive::{Pilot, Sea, drive};
use crate::forecast::{Forecast, Forecaster, TIMES_MIN};
use crate::limits::{Limits, Use};
use crate::manoeuvre::{Kind, Manoeuvre, library, refinements, unplanned};
use crate::minutes::{STEP_MIN, enough, rounded, within};
use crate::plan::{Certificate, LimitCheck, PLAN_SCHEMA, Plan, Planned};
use crate::prior::Prior;
use crate::request::Request;
use crate::rig::Rig;
use crate::scale::SCALE;
use crate::wave::seed_of;
use crate::weigh::{Bench, Candidate, MARGIN_RUNS, MARGIN_S};

/// Relative widening of intervals below which a manoeuvre of small share is left out.
const WORTH: f64 = 0.02;
/// Share above which a manoeuvre is refined.
const REFINED: f64 = 0.08;
/// Time for which information is first evaluated, minutes.
const FIRST_MIN: f64 = 30.0;
/// Ratio of the interval at full time to the goal above which a goal counts as not excited.
const NOT_EXCITED: f64 = 20.0;

/// Plans a trial.
///
/// # Errors
/// [`Error::Limit`] and [`Error::Setting`] for what cannot be, [`Error::NoMotion`] if limits forbid
/// every manoeuvre, [`Error::Goal`] and [`Error::NotExcited`] for a goal without a coefficient or
/// without a manoeuvre, with the limit that is in the way.
///
/// # Example
/// ```
/// use seaplant::{QuadraticThrust, ThrustCurve, Thruster, ThrusterInput, Vehicle};
/// use seaplant_plan::{Prior, Request, plan};
/// let law = QuadraticThrust { forward: 40.0, reverse: 30.0, ..QuadraticThrust::default() };
/// let curve = ThrustCurve::Quadratic { input: ThrusterInput::Command, law };
/// let vehicle = Vehicle {
///     name: "sled".to_owned(),
///     dry_mass_kg: Some(100.0),
///     size_m: Some([1.2, 0.5, 0.5]),
///     thrusters: vec![Thruster::new("main", [0.0; 3], [1.0, 0.0, 0.0], curve)?],
///     ..Vehicle::default()
/// };
/// let prior = Prior::of_vehicle(&vehicle, &[])?;
/// let request = Request { draws: 2, checks: 2, ..Request::default() };
/// let made = plan(&prior, &vehicle, &request)?;
/// assert!(made.minutes_needed.is_some() && made.certificate.gap < 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn plan(prior: &Prior, vehicle: &Vehicle, request: &Request) -> Result<Plan, Error> {
    request.check()?;
    let rig = Rig::new(&prior.model, request.limits.thrust_part, request.full_input)?;
    request.weight.map_or(Ok(()), |weight| weight.check(&rig))?;
    let plants = prior.plants(Draws { count: request.draws, seed: request.seed })?;
    let noises = request.noises(prior, &rig);
    let bench = Bench {
        plants: &plants,
        vehicle,
        rig: &rig,
        limits: &request.limits,
        battery: request.battery,
        has_scale: request.weight.is_some(),
        logging: &request.logging,
        noises: &noises,
        current: request.current_m_s,
        seed: request.seed,
    };
    let tried = bench.candidates(&library(
        &plants[0],
        &rig,
        &request.limits,
        request.weight,
        request.seed,
    ))?;
    let (mut used, mut refused): (Vec<Candidate>, Vec<Candidate>) =
        tried.into_iter().partition(|candidate| candidate.factor > 0.0);
    if used.is_empty() {
        return Err(no_motion(&refused, request));
    }
    let forecaster = Forecaster::new(prior, &bench, request)?;
    let work = Work { prior, bench: &bench, request, forecaster };
    work.check_goals(&used, &refused)?;
    let mut seconds = 60.0 * request.minutes.unwrap_or(FIRST_MIN);
    let mut allocation = work.forecaster.program(&used, seconds).solve()?;
    let more: Vec<Manoeuvre> = used
        .iter()
        .zip(&allocation.shares)
        .filter(|(_, share)| **share > REFINED)
        .flat_map(|(candidate, _)| refinements(&candidate.manoeuvre))
        .filter(|new| used.iter().all(|old| old.manoeuvre.name != new.name))
        .collect();
    used.extend(bench.candidates(&more)?.into_iter().filter(|candidate| candidate.factor > 0.0));
    allocation = work.with_margins(&mut used, &mut refused, seconds)?;
    work.check_goals(&used, &refused)?;
    let needed = work.forecaster.seconds_needed(&used, &allocation.shares);
    if request.minutes.is_none() {
        seconds = needed.unwrap_or(60.0 * TIMES_MIN[1]);
        if work.knows_already() {
            allocation = work.with_margins(&mut used, &mut refused, seconds)?;
        }
    }
    work.finished(&used, &allocation, seconds, needed)
}

fn no_motion(refused: &[Candidate], request: &Request) -> Error {
    let mut limits: Vec<&str> = refused.iter().map(|candidate| candidate.limit).collect();
    limits.sort_unstable();
    limits.dedup();
    let said = limits.iter().map(|limit| said_limit(limit, &request.limits)).collect::<Vec<_>>();
    Error::NoMotion { reason: format!("{}; widen these", said.join(", ")) }
}

/// Formats a limit with its value.
fn said_limit(name: &str, limits: &Limits) -> String {
    match name {
        "box_m" => format!("box_m = [{}, {}]", limits.box_m[0], limits.box_m[1]),
        "depth_m" => format!("depth_m = [{}, {}]", limits.depth_m[0], limits.depth_m[1]),
        "speed_m_s" => format!("speed_m_s = {}", limits.speed_m_s),
        "rate_rad_s" => format!("rate_rad_s = {}", limits.rate_rad_s),
        "tilt_rad" => format!("tilt_rad = {}", limits.tilt_rad),
        "tether_m" => format!("tether_m = {}", limits.tether_m.unwrap_or(f64::INFINITY)),
        _ => format!("thrust_part = {}", limits.thrust_part),
    }
}

/// Inputs of all steps after the information is computed.
struct Work<'a> {
    prior: &'a Prior,
    bench: &'a Bench<'a>,
    request: &'a Request,
    forecaster: Forecaster<'a>,
}

impl Work<'_> {
    fn knows_already(&self) -> bool {
        self.prior.known.is_some()
    }

    /// Rejects goals and coefficients that no manoeuvre excites, naming the limit that prevents it.
    fn check_goals(&self, used: &[Candidate], refused: &[Candidate]) -> Result<(), Error> {
        let all = self.forecaster.program(used, 60.0 * TIMES_MIN[1] * used.len() as f64);
        let shares = vec![1.0 / used.len() as f64; used.len()];
        let names: Vec<&str> = match all.ratios(&shares) {
            Some(ratios) => {
                let goals = self.forecaster.goals.iter().zip(ratios);
                let wide = goals.filter(|(_, ratio)| ratio.sqrt() > NOT_EXCITED);
                wide.map(|(goal, _)| goal.name.as_str()).collect()
            }
            None => self.forecaster.unexcited(&all),
        };
        let Some(&name) = names.first() else { return Ok(()) };
        let axes = self.axes_of(name);
        let unpushed = axes.iter().find(|dof| self.bench.rig.most[dof.index()] == 0.0);
        let limit = match unpushed {
            Some(dof) => format!("the thrusters do not push {dof} by itself"),
            None => {
                let own = refused.iter().chain(used).filter(|candidate| match name {
                    SCALE => candidate.manoeuvre.weight.is_some(),
                    _ => candidate.manoeuvre.axes.iter().any(|dof| axes.contains(dof)),
                });
                let limits = &self.request.limits;
                let mut in_way: Vec<String> =
                    own.map(|candidate| said_limit(candidate.limit, limits)).collect();
                in_way.sort();
                in_way.dedup();
                match in_way.is_empty() {
                    true => "no manoeuvre drives its axes".to_owned(),
                    false => format!("{} is in the way", in_way.join(" or ")),
                }
            }
        };
        Err(Error::NotExcited { goal: name.to_owned(), limit })
    }

    /// Returns the axes of a goal.
    fn axes_of(&self, name: &str) -> Vec<Dof> {
        let structure = self.bench.plants[0].structure();
        match structure.term_named(name) {
            Some(term) => structure.axes_of(&term),
            None => name.split('.').filter_map(|word| word.parse().ok()).collect(),
        }
    }

    /// Allocates the time to manoeuvres that leave a margin to every limit: those that get some are
    /// driven by many vehicles, weakened where these come too close, and weighed again, until all that
    /// get time are sure.
    fn with_margins(
        &self,
        used: &mut Vec<Candidate>,
        refused: &mut Vec<Candidate>,
        seconds: f64,
    ) -> Result<Allocation, Error> {
        let seed = seed_of(self.request.seed, "margin");
        let plants = self.prior.draws(MARGIN_RUNS + 1, seed)?;
        // The prior's mean comes first; a prior without a spread has nothing else.
        let drawn = if plants.len() > 1 { &plants[1..] } else { &plants[..] };
        loop {
            let allocation = self.forecaster.program(used, seconds).solve()?;
            let shares = self.worth_driving(used, &allocation.shares, seconds);
            let unsure: Vec<usize> =
                (0..used.len()).filter(|k| shares[*k] > 0.0 && !used[*k].is_sure).collect();
            if unsure.is_empty() {
                return Ok(allocation);
            }
            let with_margin = |i: usize| self.bench.with_margin(&used[unsure[i]], drawn);
            let sure = parallel::of_each(unsure.len(), with_margin);
            for (k, candidate) in unsure.into_iter().zip(sure) {
                used[k] = candidate?;
            }
            let before = used.len();
            refused.extend(used.extract_if(.., |candidate| candidate.factor == 0.0));
            if used.is_empty() {
                return Err(Error::NoMotion {
                    reason: "with the vehicles that the prior allows, every manoeuvre comes too close to a limit; widen the limits, or plan from results".to_owned(),
                });
            }
            if used.len() < before {
                self.check_goals(used, refused)?;
            }
        }
    }

    /// Returns the energy that manoeuvres take, Wh; `None` without a battery.
    fn energy_wh(&self, used: &[Candidate], minutes: &[f64]) -> Option<f64> {
        let parts = used.iter().zip(minutes);
        let energies = parts.map(|(candidate, minutes)| Some(60.0 * minutes * candidate.watts?));
        Some(energies.sum::<Option<f64>>()? / HOUR_S)
    }

    /// Returns the minutes of each manoeuvre in so many seconds, or, if minutes are not requested, as many as the goals
    /// need and the battery has; and the minutes that all goals need, if they can be met. `needed` are the seconds for
    /// that by shares of the time.
    fn minutes(
        &self,
        used: &[Candidate],
        allocation: &Allocation,
        seconds: f64,
        needed: Option<f64>,
    ) -> (Vec<f64>, Option<f64>) {
        let program = self.forecaster.program(used, seconds);
        let is_worst = self.request.criterion == Criterion::Worst;
        let whole = |seconds: f64| {
            let shares = self.worth_driving(used, &allocation.shares, seconds);
            rounded(&shares, seconds / 60.0)
        };
        let at_most = |minutes: f64| {
            let near = whole(60.0 * minutes);
            if is_worst { within(&program, near, minutes) } else { near }
        };
        let enough =
            needed.and_then(|seconds| enough(&program, whole(seconds), TIMES_MIN[1], is_worst));
        let needed = enough.as_ref().map(|minutes| minutes.iter().sum::<f64>());
        if self.request.minutes.is_some() {
            return (at_most(seconds / 60.0), needed);
        }
        let mut minutes = enough.unwrap_or_else(|| at_most(seconds / 60.0));
        while let Some(part) = self.battery_part(used, &minutes).filter(|part| *part > 1.0) {
            let total: f64 = minutes.iter().sum();
            let fewer = at_most((total / part).min(total - STEP_MIN).max(STEP_MIN));
            if fewer.iter().sum::<f64>() >= total {
                break;
            }
            minutes = fewer;
        }
        (minutes, needed)
    }

    /// Returns the part of the battery that manoeuvres take; `None` without a battery.
    fn battery_part(&self, used: &[Candidate], minutes: &[f64]) -> Option<f64> {
        Some(self.energy_wh(used, minutes)? / self.request.battery?.energy_wh)
    }

    /// Makes the plan; the arguments are those of [`Work::minutes`].
    fn finished(
        &self,
        used: &[Candidate],
        allocation: &Allocation,
        seconds: f64,
        needed: Option<f64>,
    ) -> Result<Plan, Error> {
        let (minutes, needed) = self.minutes(used, allocation, seconds, needed);
        let total: f64 = minutes.iter().sum();
        let shares: Vec<f64> = minutes.iter().map(|x| x / total).collect();
        let program = self.forecaster.program(used, 60.0 * total);
        let singular = || Error::Allocation { reason: "the information is singular".to_owned() };
        let given = used.iter().zip(&minutes).filter(|(_, minutes)| **minutes > 0.0);
        let given: Vec<(&Manoeuvre, f64)> =
            given.map(|(candidate, minutes)| (&candidate.manoeuvre, *minutes)).collect();
        let afterwards = self.forecaster.afterwards(self.bench, &given)?;
        let mut goals = self.forecaster.forecasts(&program, &shares).ok_or_else(singular)?;
        self.forecaster.add_ranges(&mut goals, &afterwards);
        let coefficients =
            self.forecaster.coefficients(&program, &shares, &afterwards).ok_or_else(singular)?;
        let chart = self.forecaster.chart(used, &shares, total);
        let driven = used.iter().zip(&minutes).zip(&allocation.shares);
        let mut manoeuvres: Vec<Planned> = driven
            .filter(|((_, minutes), _)| **minutes > 0.0)
            .map(|((candidate, minutes), share)| self.planned(candidate, *minutes, *share))
            .collect();
        // The longest first, to balance the load of the threads.
        manoeuvres.sort_by(|a, b| b.minutes.total_cmp(&a.minutes));
        let check = self.limit_check(&manoeuvres)?;
        let unplanned = match self.request.compare {
            true => self.unplanned()?,
            false => BTreeMap::new(),
        };
        let of_plan: Vec<&Manoeuvre> = manoeuvres.iter().map(|one| &one.manoeuvre).collect();
        let axes = self.bench.plants[0].axes().to_vec();
        let lag_s = self.bench.rig.lag_s;
        let mut doubts = self.request.logging.doubts(&axes, lag_s, &of_plan);
        let notes = self.notes(&goals, needed, total);
        let energy_wh = self.energy_wh(used, &minutes);
        if let Some((energy, battery)) = energy_wh.zip(self.request.battery)
            && energy > battery.energy_wh
        {
            doubts.push(format!(
                    "the battery has {} Wh and these minutes take {}: charge between manoeuvres, or leave the last ones out",
                    spoken(battery.energy_wh),
                    spoken(energy)
                ));
        }
        Ok(Plan {
            schema: PLAN_SCHEMA.to_owned(),
            vehicle: self.prior.model.name.clone(),
            axes,
            prior: self.prior.words.clone(),
            request: self.request.clone(),
            manoeuvres,
            minutes: total,
            energy_wh,
            minutes_needed: needed,
            goals,
            coefficients,
            certificate: Certificate {
                criterion: self.request.criterion,
                gap: allocation.gap,
                candidates: used.len(),
            },
            unplanned,
            chart,
            check,
            doubts,
            notes,
        })
    }

    /// Returns the shares without manoeuvres that hardly narrow an interval, starting with the
    /// smallest.
    fn worth_driving(&self, used: &[Candidate], shares: &[f64], seconds: f64) -> Vec<f64> {
        let program = self.forecaster.program(used, seconds);
        let widest = |shares: &[f64]| {
            let ratios = program.ratios(shares)?;
            Some(ratios.into_iter().fold(0.0, f64::max))
        };
        let mut kept = shares.to_vec();
        let mut order: Vec<usize> = (0..shares.len()).filter(|k| shares[*k] < WORTH).collect();
        order.sort_by(|a, b| shares[*a].total_cmp(&shares[*b]));
        for k in order {
            let (share, before) = (kept[k], widest(&kept));
            kept[k] = 0.0;
            let after = widest(&kept);
            let is_needed = match (before, after) {
                (Some(before), Some(after)) => after > before * (1.0 + WORTH),
                _ => true,
            };
            if is_needed {
                kept[k] = share;
            }
        }
        let sum: f64 = kept.iter().sum();
        kept.iter().map(|share| share / sum).collect()
    }

    /// Returns the minutes that driving without a plan needs.
    fn unplanned(&self) -> Result<BTreeMap<Kind, Option<f64>>, Error> {
        let bench = self.bench;
        let of = |kind: Kind| {
            let all = unplanned(kind, &bench.plants[0], bench.rig, bench.limits, self.request.seed);
            let mut driven = bench.candidates(&all)?;
            driven.retain(|candidate| candidate.factor > 0.0);
            let count = driven.len().max(1);
            let shares = vec![1.0 / count as f64; driven.len()];
            let seconds = self.forecaster.seconds_needed(&driven, &shares);
            Ok((kind, seconds.map(|seconds| seconds / 60.0)))
        };
        [Kind::SinusoidAndJoystick, Kind::Sweep].into_iter().map(of).collect()
    }

    fn planned(&self, candidate: &Candidate, minutes: f64, share: f64) -> Planned {
        let manoeuvre = candidate.manoeuvre.clone();
        let velocity: BTreeMap<Dof, [f64; 2]> =
            manoeuvre.axes.iter().map(|dof| (*dof, candidate.velocity[dof.index()])).collect();
        let words = crate::description::manoeuvre(&manoeuvre, minutes, &velocity);
        let limited_by = candidate.limit.to_owned();
        Planned { manoeuvre, minutes, share, velocity, limited_by, words }
    }

    /// Drives every manoeuvre many times, each time with another plant and other disturbances.
    fn limit_check(&self, manoeuvres: &[Planned]) -> Result<LimitCheck, Error> {
        let runs = self.request.checks;
        let seed = seed_of(self.request.seed, "check");
        let plants = self.prior.draws(runs.clamp(1, 64), seed)?;
        let run = |k: usize| {
            let planned = &manoeuvres[k % manoeuvres.len()];
            let pilot = Pilot::new(
                &self.bench.plants[0],
                self.bench.rig,
                self.bench.limits,
                &planned.manoeuvre,
            );
            let sea = Sea { seed: seed ^ k as u64, ..self.bench.sea(&planned.manoeuvre, 0) };
            let seconds = (60.0 * planned.minutes).min(MARGIN_S);
            drive(&plants[k % plants.len()], &pilot, seconds, Some(sea)).map(|driven| driven.worst)
        };
        let all = parallel::of_each(runs, run);
        let mut check = LimitCheck {
            runs,
            broken: 0,
            greatest: 0.0,
            of: "none".to_owned(),
            by_limit: BTreeMap::new(),
        };
        for (k, worst) in all.into_iter().enumerate() {
            // A diverging motion violates every limit.
            let worst = worst.unwrap_or(Use { part: f64::INFINITY, of: "every limit" });
            if worst.part > check.greatest && worst.part.is_finite() {
                (check.greatest, check.of) = (worst.part, worst.of.to_owned());
            }
            if worst.part > 1.0 {
                let name = &manoeuvres[k % manoeuvres.len()].manoeuvre.name;
                let of_limit = check.by_limit.entry(worst.of.to_owned()).or_default();
                *of_limit.entry(name.clone()).or_default() += 1;
                check.broken += 1;
            }
        }
        Ok(check)
    }

    fn notes(&self, goals: &[Forecast], needed: Option<f64>, total: f64) -> Vec<String> {
        let mut notes = Vec::new();
        let missed: Vec<&str> =
            goals.iter().filter(|goal| !goal.is_met()).map(|goal| goal.name.as_str()).collect();
        if !missed.is_empty() {
            let time = match needed {
                Some(minutes) => format!("they need {} min", spoken(minutes)),
                None => format!("{:.0} min would not be enough", TIMES_MIN[1]),
            };
            notes.push(format!("{:.1} min do not reach {}: {time}", total, missed.join(", ")));
        }
        if self.request.minutes.is_none()
            && self.request.battery.is_some()
            && total < needed.unwrap_or(TIMES_MIN[1])
        {
            notes.push(format!("the battery ends the plan after {} min", spoken(total)));
        }
        if self.prior.thrust_part > 0.0 && self.request.weight.is_none() {
            notes.push(format!(
                "thrust is uncertain by {:.1} %, which no motion narrows, but a known weight does (--weight); intervals include it",
                100.0 * self.prior.thrust_part
            ));
        }
        if let Some(minutes) = self.request.minutes
            && total > minutes + STEP_MIN
        {
            notes.push(format!(
                "no manoeuvre is driven for less than a minute, and the goals need all of these, so that {minutes} min become {total}; ask for fewer goals to have fewer manoeuvres"
            ));
        }
        notes.push(
            "intervals are those that the filter error method states for the usual terms; couplings in damping that a search adds widen them".to_owned(),
        );
        if self.request.logging.position_hz == 0.0 {
            notes.push(
                "position is not logged: on board, the box is kept by the position that the vehicle estimates from velocity".to_owned(),
            );
        }
        notes
    }
}
