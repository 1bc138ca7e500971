//! The part of the summary on a plant, of one axis or several.

use std::fmt::Write;

use comfy_table::Table;
use seaplant::Dof;
use seaplant::results::{
    Coefficient, NullModel, Parameter, PlantResult, PlantScore, Results, Score, ThrusterEstimate,
    ToldBy, TruePlant,
};
use seaplant_report::number::{Rounded, decimals, significant};

use super::{align, parameter_row, plain_table, push_caveats, push_good_for, spoken_verdict};
use crate::output::{FAINT, STRONG};
use crate::sketch::Sketches;

/// Formats the block of a plant: coefficients and drag of each axis, thrusters, predictions, doubts.
pub(super) fn block(plant: &PlantResult, results: &Results, sketches: &Sketches) -> String {
    let mut text = String::new();
    let names: Vec<&str> = plant.axes.iter().map(|dof| dof.name()).collect();
    let _ = writeln!(
        text,
        "{STRONG}{}{STRONG:#}{} by {}: {}",
        names.join(", "),
        if is_of_several(plant) { " together," } else { "" },
        plant.method,
        spoken_verdict(&plant.verdict)
    );
    push_good_for(&mut text, &plant.verdict);
    push_table(&mut text, coefficients(plant, results), 1..4);
    push_thrusters(&mut text, plant);
    push_scores(&mut text, plant, sketches);
    push_caveats(&mut text, &plant.caveats);
    text.push('\n');
    text
}

fn is_of_several(plant: &PlantResult) -> bool {
    plant.axes.len() > 1
}

/// Adds a table with these columns aligned to the right, if it has rows.
fn push_table(text: &mut String, mut table: Table, numbers: std::ops::Range<usize>) {
    if !table.is_empty() {
        align(&mut table, numbers);
        let _ = writeln!(text, "{}", table.to_string().trim_end());
    }
}

/// Lists the coefficients axis by axis, each with the drag as a force; those of several axes are last.
fn coefficients(plant: &PlantResult, results: &Results) -> Table {
    let mut table = plain_table();
    for place in plant.axes.iter().map(|&dof| Some(dof)).chain([None]) {
        let mut rows = Vec::new();
        if let Some(dof) = place {
            rows.extend(usual_rows(plant, results, dof));
            rows.extend(drag_rows(plant, results, dof));
        }
        rows.extend(further_rows(plant, results, place));
        if is_of_several(plant) && !rows.is_empty() {
            let heading = place.map_or("several axes", Dof::name);
            table.add_row([format!("  {STRONG}{heading}{STRONG:#}")]);
            rows.iter_mut().for_each(|row| row[0].insert_str(0, "  "));
        }
        table.add_rows(rows);
    }
    table
}

/// Lists mass, drag by its own velocity and constant force of an axis.
fn usual_rows(plant: &PlantResult, results: &Results, dof: Dof) -> Vec<Vec<String>> {
    let Some(own) = plant.by_axis.get(&dof) else { return Vec::new() };
    let mass = if dof.is_rotation() { "inertia" } else { "mass" };
    let labels = [mass, "quadratic drag", "linear drag", "bias force"];
    let values = [
        Some(&own.mass),
        own.quadratic_drag.as_ref(),
        own.linear_drag.as_ref(),
        own.bias_force.as_ref(),
    ];
    let truth = results.truth_of(dof).map(|x| {
        let TruePlant { mass, quadratic_drag, linear_drag, bias_force } = x;
        [mass, quadratic_drag, linear_drag, bias_force]
    });
    let names = usual_names(dof);
    let row = |k: usize| {
        let told_by = plant.parameters.get(&names[k]).map_or(ToldBy::Data, |x| x.told_by);
        Some(row(labels[k], values[k]?, truth.map(|truth| truth[k]), told_by))
    };
    (0..labels.len()).filter_map(row).collect()
}

/// Returns the names of the coefficients of mass, quadratic drag, linear drag and constant force of an axis.
fn usual_names(dof: Dof) -> [String; 4] {
    let zero = TruePlant { mass: 0.0, quadratic_drag: 0.0, linear_drag: 0.0, bias_force: 0.0 };
    zero.coefficients(dof).map(|(name, _)| name)
}

/// Lists the drag of an axis as a force, which is determined even where its parts are not: at the usual speed
/// and, of a plant of one axis, at the greatest.
fn drag_rows(plant: &PlantResult, results: &Results, dof: Dof) -> Vec<Vec<String>> {
    let units = dof.units();
    let most = if is_of_several(plant) { 1 } else { usize::MAX };
    let speeds = results.usual_and_greatest_speed(dof).into_iter().take(most);
    let row = |speed: f64| {
        let force = plant.drag_at(dof, speed);
        let name = format!("drag at {speed} {}", units.velocity);
        let force = Parameter::new(force, units.force);
        let truth = true_drag(plant, results, dof, speed);
        (force.std > 0.0 && force.std.is_finite()).then(|| parameter_row(&name, &force, truth))
    };
    speeds.filter_map(row).collect()
}

/// Computes the true drag of an axis by its own velocity, if the logs are those of a twin that has the axis.
fn true_drag(plant: &PlantResult, results: &Results, dof: Dof, speed: f64) -> Option<f64> {
    let truth = results.truth.as_ref().filter(|_| results.truth_of(dof).is_some())?;
    let exact = |x: f64| Coefficient {
        value: x,
        std: 0.0,
        low95: x,
        high95: x,
        unit: String::new(),
        on: Vec::new(),
        told_by: ToldBy::Stated,
    };
    let mut twin = PlantResult::empty(plant.axes.clone(), plant.method);
    twin.parameters = truth.iter().map(|(name, x)| (name.clone(), exact(*x))).collect();
    Some(twin.drag_at(dof, speed).value)
}

/// Lists the other coefficients that act on this axis only, or for `None` on several, by name: masses first.
fn further_rows(plant: &PlantResult, results: &Results, on: Option<Dof>) -> Vec<Vec<String>> {
    let only_axis = |x: &Coefficient| match x.on[..] {
        [only] => Some(only),
        _ => None,
    };
    let usual: Vec<String> = plant.by_axis.keys().flat_map(|dof| usual_names(*dof)).collect();
    let is_shown = |name: &String, x: &Coefficient| only_axis(x) == on && !usual.contains(name);
    let mut all: Vec<(&String, &Coefficient)> =
        plant.parameters.iter().filter(|(name, x)| is_shown(name, x)).collect();
    all.sort_by_key(|(name, _)| (!name.starts_with("mass."), name.chars().count()));
    let row = |(name, x): (&String, &Coefficient)| {
        // A coefficient that the twin does not have is zero.
        let truth = results.truth.as_ref().map(|all| all.get(name).copied().unwrap_or(0.0));
        row(name, &Parameter::from(x), truth, x.told_by)
    };
    all.into_iter().map(row).collect()
}

/// Formats a coefficient, with a remark if the trials do not determine it.
fn row(name: &str, x: &Parameter, truth: Option<f64>, told_by: ToldBy) -> Vec<String> {
    let remark = match told_by {
        ToldBy::Data => None,
        ToldBy::Limit => Some("not above zero"),
        ToldBy::Stated => Some("stated, not fitted"),
        ToldBy::Nothing => Some("hardly determined"),
    };
    let mut row = parameter_row(name, x, truth);
    row.extend(remark.map(|remark| format!("{FAINT}{remark}{FAINT:#}")));
    row
}

/// Lists what each thruster gives, if the plant has gains or known forces reveal the scale of thrust.
fn push_thrusters(text: &mut String, plant: &PlantResult) {
    let all = &plant.thruster_estimates;
    let is_told = |own: &ThrusterEstimate| own.is_fitted || own.of_curve.is_some();
    if !all.values().any(is_told) {
        return;
    }
    let mut table = plain_table();
    table.add_row([
        format!("  {STRONG}thrusters{STRONG:#}"),
        "beside most".to_owned(),
        "of its curve".to_owned(),
    ]);
    let half = |x: &Parameter| {
        let Rounded { value, low95, high95, .. } = Rounded::of(x);
        format!("{value} [{low95}, {high95}]")
    };
    for (name, own) in all {
        let of_curve = own.of_curve.as_ref().map_or(String::new(), half);
        table.add_row([format!("    {name}"), half(&own.gain), of_curve]);
    }
    push_table(text, table, 0..0);
}

/// Adds the errors on unseen trials, or else on fitted ones, and a sketch of each axis.
fn push_scores(text: &mut String, plant: &PlantResult, sketches: &Sketches) {
    if let Some(hold_out) = &plant.hold_out {
        push_score(text, "held out", plant, hold_out, Some(sketches));
        return;
    }
    if let Some(left_out) = &plant.left_out {
        push_score(text, "left out in turn", plant, left_out, None);
    }
    let is_one = plant.fit.by_trial.len() == 1;
    let own = if is_one { "on its own trial" } else { "on its own trials" };
    push_score(text, own, plant, &plant.fit, Some(sketches));
}

/// Adds the errors of a simulation, a line for each axis; sketches are of the same simulation.
fn push_score(
    text: &mut String,
    of: &str,
    plant: &PlantResult,
    score: &PlantScore,
    sketches: Option<&Sketches>,
) {
    if is_of_several(plant) && !score.by_axis.is_empty() {
        let _ = writeln!(text, "  simulated from forces alone, {of}:");
    }
    for &dof in &plant.axes {
        if let Some(line) = score_line(dof, score, plant.single_axes.get(&dof)) {
            let name = if is_of_several(plant) { format!("  {dof}") } else { of.to_owned() };
            let _ = writeln!(text, "  {name}: {line}");
        }
        text.push_str(sketches.map_or("", |sketches| sketches.of(plant, dof)));
    }
}

/// Formats the error in an axis, that of the best models without a plant, and R²: also of a plant of this axis alone.
fn score_line(dof: Dof, of: &PlantScore, alone: Option<&Score>) -> Option<String> {
    let score = of.by_axis.get(&dof)?;
    let unit = score.quantity.unit(dof);
    let error = score.mean_abs_error.map_or_else(
        || "the simulation diverges".to_owned(),
        |e| format!("e = {} {unit}", significant(e, 3)),
    );
    let plain = [NullModel::NeverMoves, NullModel::NeverAccelerates];
    let best = score.best_null.filter(|null| !plain.contains(&null.model));
    let best = best.map_or_else(String::new, |null| {
        format!(", {} for {}", significant(null.mean_abs_error, 3), null.model.description())
    });
    let r2 = score.r_squared.map_or(String::new(), |r2| format!(", R² {}", decimals(r2, 3)));
    let alone = alone.map_or_else(String::new, |alone| match alone.r_squared {
        Some(r2) => format!(" ({dof} alone: R² {})", decimals(r2, 3)),
        None => format!(" ({dof} alone: diverges)"),
    });
    let positions: Vec<String> = of
        .trials(dof)
        .filter_map(|(_, trial)| trial.position_r_squared)
        .map(|r2| decimals(r2, 3))
        .collect();
    let positions = match &positions[..] {
        [] => String::new(),
        all => format!("; of position, by trial: R² {}", all.join(", ")),
    };
    Some(format!(
        "{error}, {} {unit} for {}{best}{r2}{alone}{positions}",
        significant(score.null_error, 3),
        score.quantity.null_model()
    ))
}
