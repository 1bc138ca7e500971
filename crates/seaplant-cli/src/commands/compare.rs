use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Result, bail};
use schemars::JsonSchema;
use seaplant::exchange::PlantModel;
use seaplant::results::{Parameter, Results};
use seaplant::{
    Compared, DifferenceTest, Differences, Dof, DofDifference, ParameterDifference, Stated,
    differences, other_thrusters,
};
use seaplant_report::number::{ABSENT, Rounded, significant};
use seaplant_report::{is_life_page, life_page};
use serde::Serialize;

use super::plant::{file_of, read_table};
use super::validate::read_results;
use crate::args::Compare;
use crate::output::{FAINT, Output, STRONG, WARNING};
use crate::summary::{align, plain_table, push_caveats};
use crate::writing::{Permit, write_file};

/// Compared fits.
#[derive(Debug, Serialize, JsonSchema)]
struct Comparison {
    /// The results, in the order of every list below.
    results: Vec<String>,
    #[serde(flatten)]
    differences: Differences,
}

pub fn run(arguments: &Compare, output: Output) -> Result<ExitCode> {
    let paths: Vec<PathBuf> = arguments.results.iter().map(|path| file_of(path)).collect();
    let read: Vec<Read> = paths.iter().map(|path| Read::open(path)).collect::<Result<_>>()?;
    let compared: Vec<Compared<'_>> = read.iter().map(Read::compared).collect();
    let found = differences(&compared, arguments.method);
    if found.dofs.is_empty() && found.thrusters.is_empty() {
        let by = arguments.method.map_or(String::new(), |method| format!(" by {method}"));
        bail!("no degree of freedom has a plant{by} in two of the results");
    }
    if let Some(path) = &arguments.out {
        let permit = Permit::new(&paths, arguments.force);
        write_file(path, &life(&read, &found, &paths)?, permit, is_life_page)?;
    }
    let results = paths.iter().map(|path| path.display().to_string()).collect();
    let comparison = Comparison { results, differences: found };
    output.give(&comparison, || words(&comparison))?;
    Ok(ExitCode::SUCCESS)
}

/// Returns the page of a vehicle's thrusters over dives.
fn life(read: &[Read], found: &Differences, paths: &[PathBuf]) -> Result<Vec<u8>> {
    let vehicles: BTreeSet<&str> = read.iter().map(Read::vehicle).collect();
    if vehicles.len() > 1 {
        let names: Vec<&str> = vehicles.into_iter().collect();
        bail!(
            "the results are of different vehicles: {}; give dives of one vehicle, with one name in their vehicle files",
            names.join(", ")
        );
    }
    let compared: Vec<Compared<'_>> = read.iter().map(Read::compared).collect();
    if let Some(caveat) = other_thrusters(&compared) {
        bail!("{}", caveat.message);
    }
    if found.thrusters.is_empty() {
        bail!(
            "no thruster has a gain in two of the results: plants of several axes have them, of two thrusters or more along an axis ([[plant]] in the campaign), by this version of Seaplant; identify the dives again"
        );
    }
    let dives: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    let vehicle = vehicles.into_iter().next().unwrap_or_default();
    let notes: Vec<String> = found.caveats.iter().map(|caveat| caveat.message.clone()).collect();
    Ok(life_page(vehicle, &dives, &found.thrusters, &notes)?)
}

/// A fit, or a plant file.
enum Read {
    Fit(Box<Results>),
    Table(Box<PlantModel>),
}

impl Read {
    fn open(path: &Path) -> Result<Self> {
        match read_table(path)? {
            Some(model) => Ok(Self::Table(Box::new(model))),
            None => Ok(Self::Fit(Box::new(read_results(path)?))),
        }
    }

    fn vehicle(&self) -> &str {
        match self {
            Self::Fit(results) => &results.vehicle,
            Self::Table(model) => &model.name,
        }
    }

    fn compared(&self) -> Compared<'_> {
        match self {
            Self::Fit(results) => Compared::Fit(results),
            Self::Table(model) => Compared::Table(model),
        }
    }
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
    let couplings = &comparison.differences.coefficients;
    if !couplings.is_empty() {
        text += &format!("\n{STRONG}further coefficients{STRONG:#}\n");
        text += &lines_of(
            couplings.iter().map(|(name, row)| (name.clone(), row)),
            comparison.results.len(),
        );
    }
    text += &words_of_thrusters(comparison);
    text += "\n";
    push_caveats(&mut text, &comparison.differences.caveats);
    text
}

/// Returns the gain of each thruster in each of the results, and what has changed.
fn words_of_thrusters(comparison: &Comparison) -> String {
    let thrusters = &comparison.differences.thrusters;
    if thrusters.is_empty() {
        return String::new();
    }
    let mut table = plain_table();
    let heads = (1..=comparison.results.len()).map(|k| format!("[{k}]"));
    let ends = ["chance", ""].map(str::to_owned);
    table.set_header(std::iter::once(String::new()).chain(heads).chain(ends));
    for (name, own) in thrusters {
        let gain = |gain: &Option<Stated>| gain.as_ref().map_or_else(|| ABSENT.to_owned(), short);
        let mut row = vec![format!("  {name}")];
        row.extend(own.gains.iter().map(gain));
        row.push(own.test.as_ref().map_or_else(|| ABSENT.to_owned(), p_value));
        let differs = own.test.is_some_and(|test| test.differs);
        row.push(if differs { "differs".to_owned() } else { String::new() });
        table.add_row(row);
    }
    align(&mut table, 1..comparison.results.len() + 1);
    let table = table.to_string();
    let mut text =
        format!("\n{STRONG}thrust over that of the curves{STRONG:#}\n{}\n", table.trim_end());
    for change in thrusters.values().flat_map(|own| &own.changes) {
        text += &format!("{WARNING}thruster:{WARNING:#} {}\n", change.message);
    }
    text
}

fn short(gain: &Stated) -> String {
    let half = gain.std.map_or_else(String::new, |std| format!(" ± {:.3}", 1.96 * std));
    format!("{:.3}{half}", gain.value)
}

/// States in a sentence whether the plants of one degree of freedom differ.
pub fn verdict(difference: &DofDifference) -> String {
    let Some(test) = difference.test else {
        return "nothing to test: no two plants state the same parameters with standard deviations"
            .to_owned();
    };
    let chance = p_value(&test);
    if test.differs {
        format!("{WARNING}the plants differ{WARNING:#} by more than chance ({chance})")
    } else {
        format!("the plants agree within their intervals ({chance})")
    }
}

fn p_value(test: &DifferenceTest) -> String {
    if test.p_value < 1e-4 {
        return "p < 0.0001".to_owned();
    }
    format!("p = {}", significant(test.p_value, 2))
}

fn table(dof: Dof, difference: &DofDifference) -> String {
    let names = ["mass", "quadratic_drag", "linear_drag", "bias_force"];
    let rows = names.into_iter().filter_map(|name| {
        let shown = if name == "mass" && dof.is_rotation() { "inertia" } else { name };
        Some((shown.replace('_', " "), difference.parameters.get(name)?))
    });
    lines_of(rows, difference.methods.len())
}

/// Returns a row for each number: the estimate of each plant, and the probability of the difference
/// by chance.
fn lines_of<'a>(
    rows: impl Iterator<Item = (String, &'a ParameterDifference)>,
    plants: usize,
) -> String {
    let mut table = plain_table();
    let mut head = vec![String::new()];
    head.extend((1..=plants).map(|k| format!("[{k}]")));
    head.extend(["unit", "chance", ""].map(str::to_owned));
    table.set_header(head);
    for (name, parameter) in rows {
        let mut row = vec![format!("  {name}")];
        row.extend(parameter.estimates.iter().map(|estimate| with_std(estimate.as_ref())));
        let unit = parameter.estimates.iter().flatten().next().map(|p| p.unit.clone());
        row.push(unit.unwrap_or_default());
        row.push(parameter.test.as_ref().map_or_else(|| ABSENT.to_owned(), p_value));
        let differs = parameter.test.is_some_and(|test| test.differs);
        row.push(if differs { "differs".to_owned() } else { String::new() });
        table.add_row(row);
    }
    align(&mut table, 1..plants + 1);
    format!("{}\n", table.to_string().trim_end())
}

fn with_std(estimate: Option<&Stated>) -> String {
    let Some(Stated { value, std, interval95, unit }) = estimate else {
        return ABSENT.to_owned();
    };
    match (std, interval95) {
        (Some(std), Some([low95, high95])) => {
            let (std, low95, high95, unit) = (*std, *low95, *high95, unit.clone());
            let parameter = Parameter { value: *value, std, low95, high95, unit };
            let Rounded { value, std, .. } = Rounded::of(&parameter);
            format!("{value} ± {std}")
        }
        _ => significant(*value, 4),
    }
}
