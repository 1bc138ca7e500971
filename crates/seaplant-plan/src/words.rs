//! Formats a plan as text.

use std::fmt::Write as _;

use seaplant::spoken;

use crate::forecast::Forecast;
use crate::goal::DEGREES;
use crate::plan::Plan;

/// Formats a name, a value with half of its interval before and after, that of a vehicle as believed, its range over
/// vehicles, and the goal.
fn of_forecast(forecast: &Forecast) -> [String; 7] {
    let Forecast { name, unit, value, before, after, as_believed, range90, goal } = forecast;
    let width = |half: f64| half_width(*value, half, unit);
    [
        name.clone(),
        format!("{} {unit}", spoken(*value)),
        before.map_or("not known".to_owned(), width),
        width(*after),
        width(*as_believed),
        range90.map_or(String::new(), |ends| range(*value, ends, unit)),
        goal.map_or(String::new(), width),
    ]
}

/// Formats half of an interval: relative to its value, but of an angle or of a value of zero in its unit.
pub(crate) fn half_width(value: f64, half: f64, unit: &str) -> String {
    match value {
        v if v != 0.0 && unit != DEGREES => format!("±{} %", spoken(100.0 * half / v.abs())),
        _ => format!("±{} {unit}", spoken(half)),
    }
}

/// Formats two half intervals as [`half_width`] formats one.
pub(crate) fn range(value: f64, [low, high]: [f64; 2], unit: &str) -> String {
    match value {
        v if v != 0.0 && unit != DEGREES => {
            let part = |half: f64| spoken(100.0 * half / v.abs());
            format!("±{} to {} %", part(low), part(high))
        }
        _ => format!("±{} to {} {unit}", spoken(low), spoken(high)),
    }
}

/// Formats rows with columns as wide as their widest word.
pub(crate) fn table<const N: usize>(head: [&str; N], rows: &[[String; N]]) -> String {
    let width = |k: usize| {
        let of = |row: &[String; N]| row[k].chars().count();
        rows.iter().map(of).max().unwrap_or(0).max(head[k].chars().count())
    };
    let widths: Vec<usize> = (0..N).map(width).collect();
    let line = |cells: Vec<&str>| {
        let mut text = String::new();
        for (cell, width) in cells.iter().zip(&widths) {
            let _ = write!(text, "  {cell:<width$}");
        }
        text.trim_end().to_owned()
    };
    let mut lines = vec![line(head.to_vec())];
    lines.extend(rows.iter().map(|row| line(row.iter().map(String::as_str).collect())));
    lines.join("\n")
}

/// Returns the header and the rows of the goals.
pub(crate) fn goal_rows(plan: &Plan) -> ([&'static str; 7], Vec<[String; 7]>) {
    let head = ["goal", "believed", "today", "after", "as believed", "9 of 10 vehicles", "wanted"];
    (head, plan.goals.iter().map(of_forecast).collect())
}

/// Formats the complete plan for a terminal.
pub fn words(plan: &Plan) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "{}: {} min of driving", plan.vehicle, spoken(plan.minutes));
    let _ = writeln!(text, "prior: {}\n", plan.prior);
    for (k, planned) in plan.manoeuvres.iter().enumerate() {
        let _ = writeln!(text, "{:>3}. {}", k + 1, planned.words);
    }
    let (head, rows) = goal_rows(plan);
    let _ = writeln!(text, "\n{}\n", table(head, &rows));
    if let Some(needed) = plan.minutes_needed {
        let _ = writeln!(text, "all goals need {} min", spoken(needed));
    }
    if let Some((energy, battery)) = plan.energy_wh.zip(plan.request.battery) {
        let whole = spoken(battery.energy_wh);
        let _ = writeln!(text, "battery: {} of {whole} Wh", spoken(energy));
    }
    let _ = writeln!(
        text,
        "shares of the time: no others of the {} manoeuvres weighed make intervals narrower by more than {:.1} %",
        plan.certificate.candidates,
        100.0 * plan.certificate.gap
    );
    for (kind, minutes) in &plan.unplanned {
        let _ = match minutes {
            Some(minutes) => writeln!(
                text,
                "without a plan, a {} of each axis in turn needs {} min",
                kind.name(),
                spoken(*minutes)
            ),
            None => writeln!(text, "without a plan, a {} never reaches the goals", kind.name()),
        };
    }
    let check = &plan.check;
    if check.runs > 0 {
        let _ = writeln!(
            text,
            "limits: {} of {} simulated runs in disturbances broke one; at most {:.0} % of {} was used",
            check.broken,
            check.runs,
            100.0 * check.greatest,
            check.of
        );
    }
    for doubt in &plan.doubts {
        let _ = writeln!(text, "before the dive: {doubt}");
    }
    for note in &plan.notes {
        let _ = writeln!(text, "note: {note}");
    }
    text.trim_end().to_owned()
}
