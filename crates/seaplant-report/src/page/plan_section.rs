//! Section on the plan of the dive: what was driven, which goals are met, what is still open.

use seaplant::results::{AxisOutcome, GoalOutcome, ManoeuvreOutcome, PlanOutcome};
use seaplant::{Dof, spoken};
use serde::Serialize;

use super::table::{Row, Table};
use crate::number::{ABSENT, half_width, or_absent, significant};
use crate::words;

#[derive(Serialize)]
pub(crate) struct PlanSection {
    lead: String,
    tables: Vec<Table>,
    open: Vec<String>,
    doubts: Vec<String>,
}

pub(crate) fn view(plan: &PlanOutcome) -> PlanSection {
    let met = plan.goals.iter().filter(|goal| goal.is_met).count();
    PlanSection {
        lead: format!(
            "`{}` for {}: the logs follow {} of its {} min, and {met} of {} goals are met.",
            plan.file,
            plan.vehicle,
            significant(plan.minutes_driven, 3),
            spoken(plan.minutes_planned),
            plan.goals.len()
        ),
        tables: vec![goals(plan), axes(plan), manoeuvres(plan)],
        open: plan.open.clone(),
        doubts: plan.doubts.clone(),
    }
}

fn goals(plan: &PlanOutcome) -> Table {
    let row = |goal: &GoalOutcome| {
        let GoalOutcome { name, unit, believed, value, obtained, wanted, is_met, .. } = goal;
        let found = value.unwrap_or(*believed);
        let width = |half: f64, of: f64| format!("± {}", half_width([half], of, unit, ""));
        let promised = match goal.promised_range90 {
            Some(ends) => format!("± {}", half_width(ends, *believed, unit, " … ")),
            None => width(goal.promised, *believed),
        };
        let met = if *is_met { "met" } else { "not met" };
        Row::new([
            name.clone(),
            met.to_owned(),
            significant(*believed, 4),
            or_absent(*value, 4),
            unit.clone(),
            promised,
            obtained.map_or(ABSENT.to_owned(), |half| width(half, found)),
            width(*wanted, found),
        ])
    };
    let head = ["Goal", "", "believed", "found", "unit", "promised", "obtained", "wanted"];
    Table::new("Goals", head, plan.goals.iter().map(row).collect()).left(2).noted(
        "Half 95 % intervals. “Promised” is that of the plan, for nine of ten vehicles that its prior allows; goals in per cent are those of the value that was found.",
    )
}

fn axes(plan: &PlanOutcome) -> Table {
    let range =
        |[low, high]: [f64; 2]| format!("{} … {}", significant(low, 2), significant(high, 2));
    let row = |(dof, axis): (&Dof, &AxisOutcome)| {
        Row::new([
            words::capitalised(dof.name()),
            significant(axis.minutes_driven, 3),
            spoken(axis.minutes_planned),
            axis.velocity_reached.map_or(ABSENT.to_owned(), range),
            range(axis.velocity_planned),
            dof.units().velocity.to_owned(),
        ])
    };
    let head = ["Axis", "driven, min", "planned, min", "velocity", "planned", "unit"];
    Table::new("Axes", head, plan.axes.iter().map(row).collect())
}

fn manoeuvres(plan: &PlanOutcome) -> Table {
    let row = |one: &ManoeuvreOutcome| {
        let place = |stretch: &seaplant::results::DrivenStretch| {
            format!(
                "{} from {} to {} s",
                stretch.trial,
                spoken(stretch.from_s.round()),
                spoken(stretch.to_s.round())
            )
        };
        let places: Vec<String> = one.stretches.iter().map(place).collect();
        let places = if places.is_empty() { ABSENT.to_owned() } else { places.join(", ") };
        let force = one.force_ratio.map_or(ABSENT.to_owned(), |ratio| significant(ratio, 2));
        Row::new([
            one.name.clone(),
            significant(one.minutes_driven, 3),
            spoken(one.minutes_planned),
            force,
            places,
        ])
    };
    let head = ["Manoeuvre", "driven, min", "planned, min", "force", "where"];
    Table::new("Manoeuvres", head, plan.manoeuvres.iter().map(row).collect()).noted(
        "A manoeuvre counts as driven where logged forces follow the planned ones. “Force” is the root mean square of logged over planned forces; holding a vehicle near its start takes some of it.",
    )
}
