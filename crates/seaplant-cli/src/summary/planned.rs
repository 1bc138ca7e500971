//! The part of the summary on the plan of the dive.

use std::fmt::Write;

use seaplant::results::{AxisOutcome, GoalOutcome, PlanOutcome};
use seaplant::spoken;
use seaplant_report::number::{half_width, or_absent, significant, with_minus};

use super::{align, plain_table};
use crate::output::{STRONG, WARNING};

/// Formats what of the plan was driven, the goals, and what is still open.
pub(super) fn block(plan: &PlanOutcome) -> String {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{STRONG}plan{STRONG:#} {}: {} of {} min driven, {} of {} goals met",
        plan.file,
        significant(plan.minutes_driven, 3),
        spoken(plan.minutes_planned),
        plan.goals.iter().filter(|goal| goal.is_met).count(),
        plan.goals.len()
    );
    let mut table = plain_table();
    table.add_row(["  axis", "driven", "planned", "", "velocity", "planned", ""]);
    for (dof, axis) in &plan.axes {
        let AxisOutcome { minutes_planned, minutes_driven, velocity_planned, .. } = axis;
        let range =
            |[low, high]: [f64; 2]| format!("{} to {}", significant(low, 2), significant(high, 2));
        table.add_row([
            format!("  {dof}"),
            significant(*minutes_driven, 3),
            spoken(*minutes_planned),
            "min".to_owned(),
            axis.velocity_reached.map_or("not measured".to_owned(), range),
            range(*velocity_planned),
            dof.units().velocity.to_owned(),
        ]);
    }
    align(&mut table, 1..3);
    let _ = writeln!(text, "{}", with_minus(table.to_string().trim_end()));
    let mut table = plain_table();
    table.add_row(["  goal", "found", "interval", "promised", "wanted", ""]);
    for goal in &plan.goals {
        table.add_row(row(goal));
    }
    align(&mut table, 1..5);
    let _ = writeln!(text, "{}", with_minus(table.to_string().trim_end()));
    for open in &plan.open {
        let _ = writeln!(text, "  still open: {}", with_minus(open));
    }
    for doubt in &plan.doubts {
        let _ = writeln!(text, "  {WARNING}warning:{WARNING:#} {}", with_minus(doubt));
    }
    text.push('\n');
    text
}

fn row(goal: &GoalOutcome) -> [String; 6] {
    let GoalOutcome { name, unit, believed, value, obtained, wanted, is_met, .. } = goal;
    let width = |half: f64, of: f64| format!("±{}", half_width([half], of, "", ""));
    let promised = match goal.promised_range90 {
        Some(ends) => format!("±{}", half_width(ends, *believed, "", " to ")),
        None => width(goal.promised, *believed),
    };
    let found = value.unwrap_or(*believed);
    [
        format!("  {name}"),
        format!("{} {unit}", or_absent(*value, 4)),
        obtained.map_or("not found".to_owned(), |half| width(half, found)),
        promised,
        width(*wanted, found),
        if *is_met { "met".to_owned() } else { format!("{WARNING}not met{WARNING:#}") },
    ]
}
