//! The summary that `identify` prints in the terminal.

mod planned;
mod several_axes;

use std::fmt::Write;
use std::path::Path;

use comfy_table::presets::NOTHING;
use comfy_table::{CellAlignment, Table};
use seaplant::results::{
    NullModel, Parameter, PlantResult, PlantScore, Results, SteadyResult, TruePlant, Trust, Verdict,
};
use seaplant::{Caveat, Dof, Estimate, Severity};
use seaplant_report::number::{Rounded, decimals, signed_percent, significant, with_minus};

use crate::output::{FAINT, SEVERE, STRONG, WARNING};
use crate::sketch::Sketches;

/// Formats the complete summary.
pub fn of(results: &Results, sketches: &Sketches, folder: &Path) -> String {
    let mut text = String::new();
    for model in &results.steering {
        text.push_str(&several_axes::steering(model));
    }
    for (_, plant) in results.together() {
        let usual = |dof: &Dof| Some((*dof, *results.drag_forces(*dof).first()?));
        let drag: Vec<(Dof, (f64, Estimate))> = plant.axes.iter().filter_map(usual).collect();
        text.push_str(&several_axes::block(plant, &drag, results.truth.as_ref()));
    }
    for (dof, plant, _) in results.alone() {
        let drag = results.drag_forces(dof);
        text.push_str(&plant_block((dof, plant), &drag, results.truth_of(dof), sketches));
    }
    for (dof, steady) in &results.steady {
        text.push_str(&steady_block(*dof, steady));
    }
    if let Some(plan) = &results.plan {
        text.push_str(&planned::block(plan));
    }
    for (dof, methods, why) in results.reasons() {
        let _ = writeln!(text, "{SEVERE}failed:{SEVERE:#} {dof} by {methods}: {why}");
    }
    push_caveats(&mut text, &results.caveats);
    let notes = count_notes(results);
    let more = if notes == 1 { "more note" } else { "more notes" };
    if notes > 0 {
        let _ = writeln!(text, "{FAINT}{notes} {more} in the report{FAINT:#}");
    }
    let _ = writeln!(
        text,
        "report   {}\nnumbers  {}",
        folder.join("report.html").display(),
        folder.join("results.json").display()
    );
    text
}

/// Counts the notes of the report's first screen: each once, wherever it was made.
fn count_notes(results: &Results) -> usize {
    let plants = results.plants.values().flat_map(|plant| &plant.caveats);
    let steady = results.steady.values().flat_map(|steady| &steady.caveats);
    let bollard = results.bollard_pull.iter().flat_map(|pull| &pull.caveats);
    let all = plants.chain(steady).chain(bollard).chain(&results.caveats);
    let mut notes: Vec<&Caveat> = Vec::new();
    for caveat in all.filter(|caveat| caveat.severity == Severity::Note) {
        if !notes.contains(&caveat) {
            notes.push(caveat);
        }
    }
    notes.len()
}

/// Formats how far a plant may be trusted, and why.
fn spoken_verdict(verdict: &Verdict) -> String {
    let style = match verdict.trust {
        Trust::DoNotUse => SEVERE,
        Trust::Doubtful | Trust::UsableWithCare => WARNING,
        Trust::Usable => STRONG,
    };
    format!("{style}{}{style:#}; {}", verdict.trust.name(), with_minus(&verdict.reason))
}

/// The motion that unseen trials confirm, and how far numbers may be off, each on a line of its own.
fn push_good_for(text: &mut String, verdict: &Verdict) {
    if let Some(words) = verdict.spoken_good_for() {
        let _ = writeln!(text, "  {}", with_minus(&words));
    }
    if let Some(off) = verdict.spoken_off() {
        let _ = writeln!(text, "  {off}");
    }
}

/// Writes the block of one axis; `drag` has speeds and the drag at each.
fn plant_block(
    (dof, plant): (Dof, &PlantResult),
    drag: &[(f64, Estimate)],
    truth: Option<TruePlant>,
    sketches: &Sketches,
) -> String {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{STRONG}{dof}{STRONG:#} by {}: {}",
        plant.method,
        spoken_verdict(&plant.verdict)
    );
    push_good_for(&mut text, &plant.verdict);
    let p = plant.by_axis.get(&dof);
    let mass = if dof.is_rotation() { "inertia" } else { "mass" };
    let rows = [
        (mass, p.map(|p| &p.mass), truth.map(|t| t.mass)),
        (
            "quadratic drag",
            p.and_then(|p| p.quadratic_drag.as_ref()),
            truth.map(|t| t.quadratic_drag),
        ),
        ("linear drag", p.and_then(|p| p.linear_drag.as_ref()), truth.map(|t| t.linear_drag)),
        ("bias force", p.and_then(|p| p.bias_force.as_ref()), truth.map(|t| t.bias_force)),
    ];
    let mut table = plain_table();
    for (name, parameter, truth) in rows {
        if let Some(parameter) = parameter {
            table.add_row(parameter_row(name, parameter, truth));
        }
    }
    let units = dof.units();
    for (speed, force) in drag {
        let name = format!("drag at {speed} {}", units.velocity);
        let truth = truth.map(|t| t.quadratic_drag * speed * speed + t.linear_drag * speed);
        table.add_row(parameter_row(&name, &Parameter::new(*force, units.force), truth));
    }
    align(&mut table, 1..4);
    let _ = writeln!(text, "{}", table.to_string().trim_end());
    let score = |name: &str, of: &PlantScore| -> Option<String> {
        let score = of.by_axis.get(&dof)?;
        let unit = score.quantity.unit(dof);
        let error = score.mean_abs_error.map_or_else(
            || "the simulation diverges".to_owned(),
            |e| format!("e = {} {unit}", significant(e, 3)),
        );
        let mut r2 =
            score.r_squared.map_or(String::new(), |r2| format!(", R² {}", decimals(r2, 3)));
        let positions: Vec<String> = of
            .trials(dof)
            .filter_map(|(_, trial)| trial.position_r_squared)
            .map(|r2| decimals(r2, 3))
            .collect();
        if !positions.is_empty() {
            r2 += &format!("; of position, by trial: R² {}", positions.join(", "));
        }
        let plain = [NullModel::NeverMoves, NullModel::NeverAccelerates];
        let best = score.best_null.filter(|null| !plain.contains(&null.model));
        let best = best.map_or_else(String::new, |null| {
            format!(", {} for {}", significant(null.mean_abs_error, 3), null.model.description())
        });
        Some(format!(
            "  {name}: {error}, {} {unit} for {}{best}{r2}\n",
            significant(score.null_error, 3),
            score.quantity.null_model()
        ))
    };
    let scores = match &plant.hold_out {
        Some(hold_out) => [score("held out", hold_out), None],
        None => [
            plant.left_out.as_ref().and_then(|left_out| score("left out in turn", left_out)),
            score("on its own trial", &plant.fit),
        ],
    };
    text.extend(scores.into_iter().flatten());
    text.push_str(&sketches.of(dof));
    push_caveats(&mut text, &plant.caveats);
    text.push('\n');
    text
}

fn parameter_row(name: &str, parameter: &Parameter, truth: Option<f64>) -> Vec<String> {
    let Rounded { value, std, low95, high95 } = Rounded::of(parameter);
    let mut row = vec![
        format!("  {name}"),
        value,
        format!("± {std}"),
        format!("[{low95}, {high95}]"),
        parameter.unit.clone(),
    ];
    row.extend(truth.filter(|truth| *truth != 0.0).map(|x| beside_truth(parameter.value, x)));
    row
}

/// Formats the truth, and the error of a value; for a truth of zero there is no relative error.
fn beside_truth(value: f64, truth: f64) -> String {
    if truth == 0.0 {
        return "truth 0".to_owned();
    }
    format!("truth {} ({})", significant(truth, 4), signed_percent((value - truth) / truth.abs()))
}

fn steady_block(dof: Dof, steady: &SteadyResult) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "{STRONG}{dof}, steady{STRONG:#}: {} runs", steady.segments.len());
    let mut table = plain_table();
    if let Some(drag) = &steady.quadratic_drag {
        table.add_row(parameter_row("quadratic drag", drag, None));
    }
    if let Some(bias) = &steady.bias_force {
        table.add_row(parameter_row("bias force", bias, None));
    }
    align(&mut table, 1..4);
    if !table.is_empty() {
        let _ = writeln!(text, "{}", table.to_string().trim_end());
    }
    let _ = writeln!(
        text,
        "  mean of the runs' own drags, as in the paper: {}",
        significant(steady.mean_quadratic_drag, 4)
    );
    push_caveats(&mut text, &steady.caveats);
    text.push('\n');
    text
}

/// Adds warnings and worse, one per line.
pub fn push_caveats(text: &mut String, caveats: &[Caveat]) {
    for caveat in caveats.iter().filter(|caveat| caveat.severity > Severity::Note) {
        let (style, name) = match caveat.severity {
            Severity::Severe => (SEVERE, "severe"),
            _ => (WARNING, "warning"),
        };
        let _ = writeln!(text, "  {style}{name}:{style:#} {}", with_minus(&caveat.message));
    }
}

/// Creates a table without lines.
pub fn plain_table() -> Table {
    let mut table = Table::new();
    table.load_style(NOTHING);
    table
}

/// Aligns columns of numbers to the right.
pub fn align(table: &mut Table, columns: std::ops::Range<usize>) {
    for column in columns {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}
