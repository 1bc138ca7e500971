//! Compares a plan with the logs and the fit of its dive.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::DMatrix;
use seaplant::exchange::PlantModel;
use seaplant::results::{
    AxisOutcome, DrivenStretch, GoalOutcome, ManoeuvreOutcome, PlanOutcome, Results,
};
use seaplant::{Dof, Role, Trial, spoken};
use seaplant_control::Actuators;

use crate::Error;
use crate::follow::{Log, Stretch, followed};
use crate::forecast::Forecast;
use crate::goal::{HALF_95, Width};
use crate::plan::{PLAN_SCHEMA, Plan};
use crate::rig::Rig;
use crate::scale::{Combination, SCALE, Scale};
use crate::words::{half_width, range};

/// Tolerance of a goal: minutes are rounded to halves.
const MET: f64 = 1.02;
/// Force ratio below which a manoeuvre was weaker than planned.
const WEAK: f64 = 0.6;
/// Fraction of the planned minutes from which a manoeuvre counts as driven.
const DRIVEN: f64 = 0.9;
/// Minutes over those that were driven, beyond which more of the same is no advice.
const MOST_MORE: f64 = 10.0;

/// Checks that a plan can be compared with the trials of a campaign.
///
/// # Errors
/// [`Error::Outcome`] for a file of another schema, and if the trials have force on none of the
/// plan's axes.
pub fn check_outcome(plan: &Plan, trials: &[Trial]) -> Result<(), Error> {
    let refuse = |reason: String| Err(Error::Outcome { vehicle: plan.vehicle.clone(), reason });
    if plan.schema != PLAN_SCHEMA {
        let found = &plan.schema;
        return refuse(format!(
            "its schema is `{found}`; expected `{PLAN_SCHEMA}`, that of plan.json"
        ));
    }
    let driven: BTreeSet<Dof> =
        plan.manoeuvres.iter().flat_map(|one| one.manoeuvre.axes.clone()).collect();
    let axes: Vec<Dof> = driven.iter().copied().collect();
    let logged: BTreeSet<Dof> =
        trials.iter().flat_map(|trial| Log::new(trial, &axes).axes()).collect();
    if logged.is_empty() {
        return refuse(format!(
            "it drives {}, and no trial of the campaign has force on any of these axes; name the plan of this vehicle, and give its axes in dof or [[plant]]",
            names(driven)
        ));
    }
    Ok(())
}

/// Compares a plan with what was driven and found: minutes of each manoeuvre and axis, the range of
/// velocity, the interval of each goal, and what is still open.
///
/// `file` names the plan; `next` is the command that plans the next dive, without goals.
///
/// # Errors
/// As [`check_outcome`].
pub fn outcome(
    plan: &Plan,
    file: &str,
    trials: &[Trial],
    results: &Results,
    next: &str,
) -> Result<PlanOutcome, Error> {
    check_outcome(plan, trials)?;
    let fitted = trials.iter().filter(|trial| trial.role() != Role::HoldOut);
    let logs: Vec<Log> = fitted.map(|trial| Log::new(trial, &plan.axes)).collect();
    let stretches = followed(&plan.manoeuvres, &logs);
    let manoeuvres = manoeuvres(plan, &logs, &stretches);
    let minutes_driven = manoeuvres.iter().map(|one| one.minutes_driven).sum();
    let mut doubts = doubts(plan, results, &manoeuvres);
    let goals = goals(plan, results, &mut doubts);
    if minutes_driven >= DRIVEN * plan.minutes {
        doubts.extend(goals.iter().filter_map(wider_than_promised));
    }
    let open = open(plan, &manoeuvres, &goals, minutes_driven, next);
    Ok(PlanOutcome {
        file: file.to_owned(),
        vehicle: plan.vehicle.clone(),
        minutes_planned: plan.minutes,
        minutes_driven,
        axes: axes(plan, &logs, &manoeuvres),
        manoeuvres,
        goals,
        open,
        doubts,
    })
}

fn names(axes: impl IntoIterator<Item = Dof>) -> String {
    axes.into_iter().map(Dof::name).collect::<Vec<_>>().join(", ")
}

fn manoeuvres(plan: &Plan, logs: &[Log], stretches: &[Stretch]) -> Vec<ManoeuvreOutcome> {
    let of = |(m, planned): (usize, &crate::plan::Planned)| {
        let own: Vec<&Stretch> = stretches.iter().filter(|one| one.manoeuvre == m).collect();
        let seconds: f64 = own.iter().map(|one| one.seconds).sum();
        let squares: f64 = own.iter().map(|one| one.seconds * one.force_ratio.powi(2)).sum();
        let stretch = |one: &&Stretch| DrivenStretch {
            trial: logs[one.log].trial.clone(),
            from_s: one.from_s,
            to_s: one.to_s,
        };
        ManoeuvreOutcome {
            name: planned.manoeuvre.name.clone(),
            axes: planned.manoeuvre.axes.clone(),
            minutes_planned: planned.minutes,
            minutes_driven: seconds / 60.0,
            stretches: own.iter().map(stretch).collect(),
            force_ratio: (seconds > 0.0).then(|| (squares / seconds).sqrt()),
        }
    };
    plan.manoeuvres.iter().enumerate().map(of).collect()
}

fn axes(plan: &Plan, logs: &[Log], driven: &[ManoeuvreOutcome]) -> BTreeMap<Dof, AxisOutcome> {
    let mut axes: BTreeMap<Dof, AxisOutcome> = BTreeMap::new();
    let wider = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a.min(c), b.max(d)];
    for (planned, own) in plan.manoeuvres.iter().zip(driven) {
        for (dof, velocity) in &planned.velocity {
            let axis = axes.entry(*dof).or_insert_with(|| AxisOutcome {
                minutes_planned: 0.0,
                minutes_driven: 0.0,
                velocity_planned: *velocity,
                velocity_reached: logs.iter().filter_map(|log| log.velocity(*dof)).reduce(wider),
            });
            axis.minutes_planned += own.minutes_planned;
            axis.minutes_driven += own.minutes_driven;
            axis.velocity_planned = wider(axis.velocity_planned, *velocity);
        }
    }
    axes
}

fn doubts(plan: &Plan, results: &Results, manoeuvres: &[ManoeuvreOutcome]) -> Vec<String> {
    let mut doubts = Vec::new();
    if plan.vehicle != results.vehicle {
        doubts.push(format!(
            "the plan is of `{}`, the campaign of `{}`: check that it is the plan of this vehicle",
            plan.vehicle, results.vehicle
        ));
    }
    if manoeuvres.iter().all(|one| one.stretches.is_empty()) {
        doubts.push(
            "no fitted trial follows any manoeuvre of the plan: the dive was driven otherwise, or the plan is another one".to_owned(),
        );
    }
    for one in manoeuvres {
        if let Some(ratio) = one.force_ratio.filter(|ratio| *ratio < WEAK) {
            doubts.push(format!(
                "{} was driven with {:.0} % of its planned forces",
                one.name,
                100.0 * ratio
            ));
        }
    }
    doubts
}

/// The plant of the fit with its covariance.
struct Found {
    model: PlantModel,
    covariance: DMatrix<f64>,
    rig: Option<Rig>,
}

impl Found {
    fn new(plan: &Plan, results: &Results) -> Option<Self> {
        let model = PlantModel::of_results(results, "results", None).ok()?;
        let covariance = model.covariance.clone()?;
        let request = &plan.request;
        let rig = Rig::new(&model, request.limits.thrust_part, request.full_input).ok();
        Some(Self { model, covariance, rig })
    }

    /// Returns the estimate of a goal and half of its 95 % interval.
    fn goal(&self, plan: &Plan, name: &str) -> Option<(f64, f64)> {
        if name == SCALE {
            let found = self.model.actuation.values().find_map(|own| own.thrust_scale.as_ref())?;
            return Some((found.value, 0.5 * (found.high95 - found.low95)));
        }
        let plants = std::slice::from_ref(&self.model.plant);
        let scale = Scale {
            plants,
            rig: self.rig.as_ref()?,
            request: &plan.request,
            actuators: Actuators::of_model(&self.model),
            thrust_part: 0.0,
            more: 0,
            has_scale: false,
        };
        let Combination { weights, value, .. } = scale.combination(&plants[0], name).ok()?;
        let variance = weights.dot(&(&self.covariance * &weights));
        let half = HALF_95 * variance.max(0.0).sqrt();
        (half > 0.0 && half.is_finite()).then_some((value, half))
    }
}

fn goals(plan: &Plan, results: &Results, doubts: &mut Vec<String>) -> Vec<GoalOutcome> {
    let found = Found::new(plan, results);
    let of = |forecast: &Forecast| {
        let own = found.as_ref().and_then(|found| found.goal(plan, &forecast.name));
        let (value, obtained) = (own.map(|(value, _)| value), own.map(|(_, half)| half));
        let wanted = wanted(plan, forecast, value);
        GoalOutcome {
            name: forecast.name.clone(),
            unit: forecast.unit.clone(),
            believed: forecast.value,
            value,
            promised: forecast.after,
            promised_range90: forecast.range90,
            obtained,
            wanted,
            is_met: obtained.is_some_and(|half| half <= MET * wanted),
        }
    };
    let goals: Vec<GoalOutcome> = plan.goals.iter().map(of).collect();
    let missing: Vec<&str> =
        goals.iter().filter(|goal| goal.value.is_none()).map(|goal| goal.name.as_str()).collect();
    if !missing.is_empty() {
        let which = if missing.len() == goals.len() {
            "none of the goals".to_owned()
        } else {
            missing.join(", ")
        };
        let (verb, known) = match &found {
            Some(found) => (
                if missing.len() == goals.len() { "is" } else { "is not" },
                format!("it has {}", found.model.plant.structure().names().join(", ")),
            ),
            None => ("is", "it has no plant".to_owned()),
        };
        doubts.push(format!("{which} {verb} among the numbers of the fit: {known}"));
    }
    goals
}

/// Returns half of the widest interval that meets a goal; a relative goal is one of the estimate.
fn wanted(plan: &Plan, forecast: &Forecast, value: Option<f64>) -> f64 {
    let own = plan.request.goals.iter().find(|goal| goal.name == forecast.name);
    let half = forecast.goal.unwrap_or(forecast.after);
    match own.map(|goal| goal.width) {
        Some(Width::Amount(half)) => half,
        Some(Width::Part(part)) => part * value.unwrap_or(forecast.value).abs(),
        None if forecast.value != 0.0 => {
            half / forecast.value.abs() * value.unwrap_or(forecast.value).abs()
        }
        None => half,
    }
}

fn open(
    plan: &Plan,
    manoeuvres: &[ManoeuvreOutcome],
    goals: &[GoalOutcome],
    minutes_driven: f64,
    next: &str,
) -> Vec<String> {
    let mut open = Vec::new();
    for one in manoeuvres {
        let left = one.minutes_planned - one.minutes_driven;
        if one.minutes_driven == 0.0 {
            open.push(format!(
                "{} was not driven in a fitted trial: {} min",
                one.name,
                spoken(left)
            ));
        } else if one.minutes_driven < DRIVEN * one.minutes_planned {
            open.push(format!(
                "{} was driven for {} of {} min",
                one.name,
                spoken(one.minutes_driven),
                spoken(one.minutes_planned)
            ));
        }
    }
    let missed: Vec<&GoalOutcome> = goals.iter().filter(|goal| !goal.is_met).collect();
    open.extend(missed.iter().filter_map(|goal| still_wide(goal, minutes_driven)));
    if !missed.is_empty() {
        let goals = missed.iter().map(|goal| quoted(plan, goal)).collect::<String>();
        open.push(format!("plan the next dive: {next}{goals} --out next"));
    }
    open
}

/// Says where an interval is wider than the plan promised, though all was driven.
fn wider_than_promised(goal: &GoalOutcome) -> Option<String> {
    let ([low, high], value, obtained) = (goal.promised_range90?, goal.value?, goal.obtained?);
    // The promise is relative to the believed value.
    let by = if goal.believed == 0.0 { 1.0 } else { (value / goal.believed).abs() };
    (obtained > by * high).then(|| {
        format!(
            "{} is known to {}, and the plan promised {}: disturbances or noise are stronger than it expects, or the vehicle differs more from its prior",
            goal.name,
            half_width(value, obtained, &goal.unit),
            range(goal.believed, [low, high], &goal.unit)
        )
    })
}

/// Formats an interval that is wider than its goal, with the minutes that would narrow it:
/// variances fall as minutes grow.
fn still_wide(goal: &GoalOutcome, minutes: f64) -> Option<String> {
    let (value, obtained) = (goal.value?, goal.obtained?);
    let width = |half: f64| half_width(value, half, &goal.unit);
    let more = (obtained / goal.wanted).powi(2) - 1.0;
    let advice = match minutes > 0.0 && more < MOST_MORE {
        true => format!("about {} min more of the same", spoken((more * minutes).ceil())),
        false => "more of the same will not narrow it enough".to_owned(),
    };
    Some(format!(
        "{} is known to {}, wanted {}: {advice}",
        goal.name,
        width(obtained),
        width(goal.wanted)
    ))
}

/// Formats a goal as an option of the command.
fn quoted(plan: &Plan, goal: &GoalOutcome) -> String {
    let own = plan.request.goals.iter().find(|own| own.name == goal.name).map(|own| own.width);
    let width = match own {
        Some(Width::Amount(half)) => spoken(half),
        Some(Width::Part(part)) => format!("{}%", spoken(100.0 * part)),
        None if goal.believed != 0.0 => {
            let value = goal.value.unwrap_or(goal.believed);
            format!("{}%", spoken(100.0 * goal.wanted / value.abs()))
        }
        None => spoken(goal.wanted),
    };
    let text = format!("{}={width}", goal.name);
    let is_plain = text.chars().all(|c| c.is_ascii_alphanumeric() || "=.%-_".contains(c));
    if is_plain { format!(" --goal {text}") } else { format!(" --goal '{text}'") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_beyond_the_promised_range_is_named() {
        let goal = GoalOutcome {
            name: "mass.surge".to_owned(),
            unit: "kg".to_owned(),
            believed: 100.0,
            value: Some(200.0),
            promised: 3.0,
            promised_range90: Some([2.0, 5.0]),
            obtained: Some(9.9),
            wanted: 10.0,
            is_met: true,
        };
        // 9.9 of 200 kg is less than 5 of 100.
        assert_eq!(wider_than_promised(&goal), None);
        let wide = GoalOutcome { obtained: Some(12.0), ..goal.clone() };
        let said = wider_than_promised(&wide).expect("wider");
        assert!(said.contains("known to ±6.00 %, and the plan promised ±2.00 to 5.00 %"), "{said}");
        assert_eq!(wider_than_promised(&GoalOutcome { promised_range90: None, ..wide }), None);
    }
}
