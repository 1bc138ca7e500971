//! The summary that `identify` prints in the terminal.

mod planned;
mod plant;
mod steering;

use std::fmt::Write;
use std::path::Path;

use comfy_table::presets::NOTHING;
use comfy_table::{CellAlignment, Table};
use seaplant::results::{Parameter, Results, SteadyResult, Trust, Verdict};
use seaplant::{Caveat, Dof, Severity};
use seaplant_report::number::{Rounded, signed_percent, significant, with_minus};

use crate::output::{FAINT, SEVERE, STRONG, WARNING};
use crate::sketch::Sketches;

/// Formats the complete summary.
pub fn of(results: &Results, sketches: &Sketches, folder: &Path) -> String {
    let mut text = String::new();
    for model in &results.steering {
        text.push_str(&steering::block(model));
    }
    let together = results.together().map(|(_, plant)| plant);
    for plant in together.chain(results.alone().map(|(_, plant, _)| plant)) {
        text.push_str(&plant::block(plant, results, sketches));
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

fn parameter_row(name: &str, parameter: &Parameter, truth: Option<f64>) -> Vec<String> {
    let Rounded { value, std, low95, high95 } = Rounded::of(parameter);
    let mut row = vec![
        format!("  {name}"),
        value,
        format!("± {std}"),
        format!("[{low95}, {high95}]"),
        parameter.unit.clone(),
    ];
    row.extend(truth.map(|truth| beside_truth(parameter.value, truth)));
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
