use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Result, bail};
use schemars::JsonSchema;
use seaplant::results::{Parameter, Results};
use seaplant::{DifferenceTest, Differences, Dof, DofDifference, differences};
use seaplant_report::number::{ABSENT, Rounded, significant};
use serde::Serialize;

use crate::args::Compare;
use crate::commands::validate::read_results;
use crate::output::{FAINT, Output, STRONG, WARNING};
use crate::summary::{align, plain_table, push_caveats};

/// Fits beside each other.
#[derive(Debug, Serialize, JsonSchema)]
struct Comparison {
    /// The results, in the order of every list below.
    results: Vec<String>,
    #[serde(flatten)]
    differences: Differences,
}

pub fn run(arguments: &Compare, output: Output) -> Result<ExitCode> {
    let paths: Vec<PathBuf> = arguments.results.iter().map(|path| results_file(path)).collect();
    let fits: Vec<Results> = paths.iter().map(|path| read_results(path)).collect::<Result<_>>()?;
    let found = differences(&fits.iter().collect::<Vec<_>>(), arguments.method);
    if found.dofs.is_empty() {
        let by = arguments.method.map_or(String::new(), |method| format!(" by {method}"));
        bail!("no two of the results hold a plant{by} of the same degree of freedom");
    }
    let results = paths.iter().map(|path| path.display().to_string()).collect();
    let comparison = Comparison { results, differences: found };
    output.give(&comparison, || words(&comparison))?;
    Ok(ExitCode::SUCCESS)
}

/// The file itself, or that in a folder.
fn results_file(path: &Path) -> PathBuf {
    if path.is_dir() { path.join("results.json") } else { path.to_owned() }
}

fn words(comparison: &Comparison) -> String {
    let mut text = String::new();
    for (k, path) in comparison.results.iter().enumerate() {
        text += &format!("{FAINT}[{}]{FAINT:#} {path}\n", k + 1);
    }
    for (dof, difference) in &comparison.differences.dofs {
        text += &format!("\n{STRONG}{dof}{STRONG:#}: {}\n", verdict(difference));
        text += &table(*dof, difference);
    }
    text += "\n";
    push_caveats(&mut text, &comparison.differences.caveats);
    text
}

/// Whether the plants of one degree of freedom differ, in a sentence.
pub fn verdict(difference: &DofDifference) -> String {
    let Some(test) = difference.test else {
        return "the plants have no parameters in common to test".to_owned();
    };
    let chance = p_value(&test);
    if test.differs {
        format!("{WARNING}the plants differ{WARNING:#} by more than chance ({chance})")
    } else {
        format!("the plants agree, as far as their intervals can tell ({chance})")
    }
}

fn p_value(test: &DifferenceTest) -> String {
    if test.p_value < 1e-4 {
        return "p < 0.0001".to_owned();
    }
    format!("p = {}", significant(test.p_value, 2))
}

fn table(dof: Dof, difference: &DofDifference) -> String {
    let mut table = plain_table();
    let fits = difference.methods.len();
    let mut head = vec![String::new()];
    head.extend((1..=fits).map(|k| format!("[{k}]")));
    head.extend(["unit", "chance", ""].map(str::to_owned));
    table.set_header(head);
    for name in ["mass", "quadratic_drag", "linear_drag", "bias_force"] {
        let Some(parameter) = difference.parameters.get(name) else { continue };
        let name = if name == "mass" && dof.is_rotation() { "inertia" } else { name };
        let mut row = vec![format!("  {}", name.replace('_', " "))];
        row.extend(parameter.estimates.iter().map(|estimate| with_std(estimate.as_ref())));
        let unit = parameter.estimates.iter().flatten().next().map(|p| p.unit.clone());
        row.push(unit.unwrap_or_default());
        row.push(parameter.test.as_ref().map_or_else(|| ABSENT.to_owned(), p_value));
        let differs = parameter.test.is_some_and(|test| test.differs);
        row.push(if differs { "differs".to_owned() } else { String::new() });
        table.add_row(row);
    }
    align(&mut table, 1..fits + 1);
    format!("{}\n", table.to_string().trim_end())
}

fn with_std(estimate: Option<&Parameter>) -> String {
    estimate.map_or_else(
        || ABSENT.to_owned(),
        |parameter| {
            let Rounded { value, std, .. } = Rounded::of(parameter);
            format!("{value} ± {std}")
        },
    )
}
