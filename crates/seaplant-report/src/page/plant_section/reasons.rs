//! Tables of what led to a plant: regressions, choice of terms, nuisances, correlation.

use seaplant::Dof;
use seaplant::results::{Alone, Parameters, PlantResult, Results, TermDecision};

use super::{Methods, coefficients, scores, with_interval};
use crate::number::{ABSENT, count, or_absent, significant};
use crate::page::table::{Row, Table};
use crate::words;

pub(super) fn tables(plant: &PlantResult, methods: &Methods<'_>, results: &Results) -> Vec<Table> {
    let dof = plant.first_axis();
    let mut tables = Vec::from(scores::by_trial(plant, methods));
    tables.extend([coefficients::every(plant), nuisances(plant), structure(plant)]);
    tables.extend([correlation(plant), regression(methods)]);
    if let Some(alone) = &plant.alone {
        tables.extend(subsets(dof, results));
        tables.extend(steady_test(dof, alone));
    }
    tables
}

fn nuisances(plant: &PlantResult) -> Table {
    let rows = plant.nuisances.iter().map(|(name, parameter)| {
        // The part after a stop or a space is the name of a trial, and unchanged.
        let (own, trial) = name.split_at(name.find(['.', ' ', ':']).unwrap_or(name.len()));
        let name = words::capitalised(&format!("{}{trial}", own.replace('_', " ")));
        Row::new([name, with_interval(Some(parameter)), parameter.unit.clone()])
    });
    let head = ["Parameter", "Value ± standard deviation [95 % interval]", "Unit"];
    Table::new("Nuisance parameters, fitted together with the plant", head, rows.collect())
}

/// Returns the table of reasons for the model's structure.
fn structure(plant: &PlantResult) -> Table {
    let row = |decision: &TermDecision| {
        Row::new([
            words::capitalised(&decision.candidate.replace('-', " ")),
            if decision.admitted { "yes" } else { "no" }.to_owned(),
            significant(decision.likelihood_ratio, 3),
            or_absent(decision.p_value, 2),
            or_absent(decision.needed, 3),
            or_absent(decision.size.map(|size| 100.0 * size), 2),
        ])
        .strong_if(decision.admitted)
    };
    let head = [
        "Part",
        "In the model",
        "Twice the gain in log-likelihood",
        "By chance",
        "Gain required",
        "Size, %",
    ];
    let has_size = plant.structure.iter().any(|decision| decision.size.is_some());
    let table = Table::new(
        "Which parts of the model the logs support",
        head,
        plant.structure.iter().map(row).collect(),
    )
    .left(2)
    .without_empty_columns();
    match has_size {
        true => table.noted("Size of linear drag: as a part of quadratic drag at the usual speed; of a bias force: the end of its interval farther from zero, as a part of the usual thrust. A bias force stays unless the logs show that it is small."),
        false => table,
    }
}

/// Number of coefficients up to which all correlations are shown.
const FEW: usize = 8;

/// Correlation above which more coefficients are listed together.
const SHOWN_CORRELATION: f64 = 0.7;

fn correlation(plant: &PlantResult) -> Table {
    let names = &plant.correlation.names;
    let signed = |r: &f64| format!("{r:.2}").replace('-', "−");
    if names.len() <= FEW {
        let head = std::iter::once("").chain(names.iter().map(String::as_str));
        let rows = names.iter().zip(&plant.correlation.value).map(|(name, row)| {
            Row::new(std::iter::once(name.clone()).chain(row.iter().map(signed)))
        });
        return Table::new("Correlation of the estimates", head, rows.collect());
    }
    let mut pairs = Vec::new();
    for (i, row) in plant.correlation.value.iter().enumerate() {
        for (j, r) in row.iter().enumerate().take(i) {
            if r.abs() > SHOWN_CORRELATION {
                pairs.push((r.abs(), Row::new([names[j].clone(), names[i].clone(), signed(r)])));
            }
        }
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    let rows = pairs.into_iter().map(|(_, row)| row).collect();
    Table::new("Correlated coefficients", ["First", "second", "correlation"], rows)
        .left(2)
        .noted("All correlations are in results.json.")
}

/// Returns the statistics of each method's regression; empty without one.
fn regression(methods: &Methods<'_>) -> Table {
    let head = [
        "Method",
        "Terms",
        "Samples",
        "Effective samples",
        "Condition",
        "Variance inflation",
        "Residual (rms)",
        "Low-pass",
    ];
    let rows = methods.iter().filter_map(|(method, plant, is_recommended)| {
        let alone = plant.alone.as_ref()?;
        let r = &alone.regression;
        let inflation: Vec<String> = r
            .variance_inflation
            .iter()
            .map(|(term, vif)| format!("{} {}", words::term_symbol(*term), significant(*vif, 3)))
            .collect();
        let row = Row::new([
            method,
            words::terms(&alone.terms),
            count(plant.samples as u64),
            significant(r.effective_samples, 3),
            significant(r.condition, 3),
            if inflation.is_empty() { ABSENT.to_owned() } else { inflation.join(", ") },
            significant(r.residual_rms, 3),
            words::filters(&r.filters),
        ]);
        Some(row.strong_if(is_recommended))
    });
    Table::new("Details of each fit", head, rows.collect()).left(2)
}

fn subsets(dof: Dof, results: &Results) -> Option<Table> {
    let subsets = results.subsets.get(&dof).filter(|subsets| !subsets.is_empty())?;
    let unit = dof.units().velocity;
    let head = [
        "Terms".to_owned(),
        "α".to_owned(),
        "β".to_owned(),
        "μ".to_owned(),
        "bias".to_owned(),
        "Stable".to_owned(),
        format!("e fitted, {unit}"),
        format!("e held out, {unit}"),
        "Condition".to_owned(),
    ];
    let rows = subsets.iter().map(|subset| {
        let lumped = subset.lumped;
        Row::new([
            words::terms(&subset.terms),
            significant(lumped.alpha, 3),
            significant(lumped.beta, 3),
            significant(lumped.mu, 3),
            significant(lumped.bias, 3),
            if subset.stable { "yes" } else { "no" }.to_owned(),
            or_absent(subset.fit_error, 3),
            or_absent(subset.hold_out_error, 3),
            significant(subset.condition, 3),
        ])
    });
    let table =
        Table::new("Every choice of terms, by the recommended method", head, rows.collect());
    Some(table.noted("A lower error on the fitted trials alone does not justify a term: compare the held-out column."))
}

/// Returns the table of the test whether steady runs support the same plant.
fn steady_test(dof: Dof, alone: &Alone) -> Option<Table> {
    let test = alone.steady_test.as_ref()?;
    let units = dof.units();
    let row = |name: &str, parameters: &Parameters| {
        Row::new([
            name.to_owned(),
            with_interval(parameters.quadratic_drag.as_ref()),
            with_interval(parameters.linear_drag.as_ref()),
            with_interval(parameters.bias_force.as_ref()),
        ])
    };
    let head = [
        "Trials".to_owned(),
        format!("Quadratic drag, {}", units.quadratic_drag),
        format!("Linear drag, {}", units.linear_drag),
        format!("Bias force, {}", units.force),
    ];
    let rows = vec![row("unsteady trials", &test.unsteady), row("steady runs", &test.steady)];
    let outcome = if test.agrees {
        "they agree, and the plant is fitted to both"
    } else {
        "they differ, and the plant is fitted to the unsteady trials alone"
    };
    let note = format!(
        "One mass for both. Twice the gain in log-likelihood if the rest may differ: {} for {} numbers, which chance alone makes with probability {}: {outcome}.",
        significant(test.likelihood_ratio, 3),
        test.numbers,
        significant(test.p_value, 2),
    );
    Some(Table::new("Steady runs beside the other trials", head, rows).noted(&note))
}
