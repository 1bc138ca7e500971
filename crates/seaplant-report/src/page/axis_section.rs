//! Section of one degree of freedom.

use seaplant::results::{Alone, Parameter, Parameters, PlantResult, Results};
use seaplant::{Caveat, Dof, Method, Role, ScoredMotion};
use serde::Serialize;

use super::card::stability;
use super::doubts::{Doubts, collected};
use super::table::{Row, Table};
use super::{ChartView, Pictures};
use crate::chart::Subject;
use crate::number::{ABSENT, Rounded, count, or_absent, significant};
use crate::words;

#[derive(Serialize)]
pub(crate) struct AxisSection {
    name: &'static str,
    title: String,
    method: String,
    terms: String,
    stability: String,
    intervals: Vec<ChartView>,
    motions: Vec<Motions>,
    memory: Vec<ChartView>,
    spectra: Vec<ChartView>,
    drag: Vec<ChartView>,
    tables: Vec<Table>,
    details: Vec<Table>,
    doubts: Doubts,
}

/// Trials of one role.
#[derive(Serialize)]
pub(super) struct Motions {
    title: &'static str,
    role: &'static str,
    /// Note on which of the trials are drawn, if not all are.
    note: Option<String>,
    charts: Vec<ChartView>,
}

/// A plant of an axis alone, by a method.
type OfMethod<'a> = (Method, &'a PlantResult, &'a Alone);

pub(crate) fn view(
    (dof, plant, alone): (Dof, &PlantResult, &Alone),
    results: &Results,
    pictures: Pictures<'_>,
) -> AxisSection {
    let methods = methods((dof, plant, alone), results);
    let of = |subject| pictures.charts(|chart| chart.dof == dof && chart.subject == subject);
    let mut details = vec![regression(&methods, plant.method)];
    details.extend(subsets(dof, results));
    details.push(correlation(plant));
    details.extend(nuisances(plant));
    details.extend(structure(plant));
    details.extend(steady_test(dof, alone));
    AxisSection {
        name: dof.name(),
        title: words::capitalised(dof.name()),
        method: words::method(plant.method),
        terms: words::terms(&alone.terms),
        stability: stability(dof, &alone.stability),
        intervals: of(Subject::Intervals),
        motions: motions(
            |role| of(Subject::Motion(role)),
            |role| pictures.drawn.note(dof.name(), role),
        ),
        memory: of(Subject::Memory),
        spectra: of(Subject::Spectrum),
        drag: pictures.charts(|chart| {
            chart.dof == dof && chart.subject == Subject::Drag && chart.plant.is_none()
        }),
        tables: vec![parameters(dof, &methods, plant.method), scores(dof, &methods, plant.method)],
        details,
        doubts: other_doubts(&methods, plant),
    }
}

/// Orders the recommended method first, the paper's second, then the rest.
fn methods<'a>(
    (dof, plant, alone): (Dof, &'a PlantResult, &'a Alone),
    results: &'a Results,
) -> Vec<OfMethod<'a>> {
    let mut methods = vec![(plant.method, plant, alone)];
    methods.extend(results.methods_of(dof).filter(|(method, ..)| *method != plant.method));
    methods[1..].sort_by_key(|(method, ..)| *method != Method::Paper);
    methods
}

/// Returns the charts of each role that has some, the fitted trials first.
pub(super) fn motions(
    of: impl Fn(Role) -> Vec<ChartView>,
    note: impl Fn(Role) -> Option<String>,
) -> Vec<Motions> {
    let titles = [
        (Role::Fit, "Fitted trials", "fitted"),
        (Role::HoldOut, "Held-out trials", "held-out"),
        (Role::Steady, "Steady trials", "steady"),
    ];
    let of_role =
        |(role, title, class)| Motions { title, role: class, note: note(role), charts: of(role) };
    titles.map(of_role).into_iter().filter(|group| !group.charts.is_empty()).collect()
}

/// Formats `12 970 ± 250 [12 460, 13 480]`.
pub(crate) fn with_interval(parameter: Option<&Parameter>) -> String {
    parameter.map_or_else(
        || ABSENT.to_owned(),
        |parameter| {
            let Rounded { value, std, low95, high95 } = Rounded::of(parameter);
            format!("{value} ± {std} [{low95}, {high95}]")
        },
    )
}

fn parameters(dof: Dof, methods: &[OfMethod<'_>], recommended: Method) -> Table {
    let units = dof.units();
    let head = [
        "Method".to_owned(),
        format!("{}, {}", words::mass(dof), units.mass),
        format!("d_Q, {}", units.quadratic_drag),
        format!("d_L, {}", units.linear_drag),
        format!("{}, {}", words::bias_force(dof), units.force),
        "Stability".to_owned(),
    ];
    let rows = methods.iter().filter_map(|(method, plant, alone)| {
        let p = plant.by_axis.get(&dof)?;
        let row = Row::new([
            words::capitalised(&words::method(*method)),
            with_interval(Some(&p.mass)),
            with_interval(p.quadratic_drag.as_ref()),
            with_interval(p.linear_drag.as_ref()),
            with_interval(p.bias_force.as_ref()),
            stability(dof, &alone.stability),
        ]);
        Some(row.strong_if(*method == recommended))
    });
    Table::new(
        "Parameters by method: value ± standard deviation [95 % interval]",
        head,
        rows.collect(),
    )
}

fn scores(dof: Dof, methods: &[OfMethod<'_>], recommended: Method) -> Table {
    let units = dof.units();
    let quantity = methods
        .first()
        .and_then(|(_, plant, _)| Some(plant.fitted(dof)?.quantity))
        .unwrap_or_default();
    let still = match quantity {
        ScoredMotion::Velocity => "Never moving",
        ScoredMotion::Acceleration => "Never accelerating",
    };
    let head = [
        "Method".to_owned(),
        "Trial".to_owned(),
        "Use".to_owned(),
        format!("e, {}", quantity.unit(dof)),
        format!("{still}, {}", quantity.unit(dof)),
        "R²".to_owned(),
        format!("Position e, {}", units.position),
        "Position R²".to_owned(),
        "Samples".to_owned(),
    ];
    let mut rows = Vec::new();
    for (method, plant, _) in methods {
        let held_out = plant.hold_out.iter().flat_map(|score| score.trials(dof));
        let fitted = plant.fit.trials(dof).map(|trial| ("fitted", trial));
        for (role, (name, trial)) in fitted.chain(held_out.map(|trial| ("held out", trial))) {
            let e = trial.mean_abs_error;
            let row = Row::new([
                words::capitalised(&words::method(*method)),
                name.clone(),
                role.to_owned(),
                e.map_or_else(|| "diverges".to_owned(), |e| significant(e, 3)),
                significant(trial.null_error, 3),
                or_absent(trial.r_squared, 4),
                or_absent(trial.position_mean_abs_error, 3),
                or_absent(trial.position_r_squared, 4),
                count(trial.samples as u64),
            ]);
            rows.push(row.strong_if(*method == recommended));
        }
    }
    let title = match quantity {
        ScoredMotion::Velocity => "Error e of each plant on each trial, on raw velocity",
        ScoredMotion::Acceleration => {
            "Error e of each plant on each trial, on mean acceleration over half a second"
        }
    };
    Table::new(title, head, rows).left(3)
}

fn regression(methods: &[OfMethod<'_>], recommended: Method) -> Table {
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
    let rows = methods.iter().map(|(method, plant, alone)| {
        let r = &alone.regression;
        let inflation: Vec<String> = r
            .variance_inflation
            .iter()
            .map(|(term, vif)| format!("{} {}", words::term_symbol(*term), significant(*vif, 3)))
            .collect();
        Row::new([
            words::capitalised(&words::method(*method)),
            words::terms(&alone.terms),
            count(plant.samples as u64),
            significant(r.effective_samples, 3),
            significant(r.condition, 3),
            if inflation.is_empty() { ABSENT.to_owned() } else { inflation.join(", ") },
            significant(r.residual_rms, 3),
            words::filters(&r.filters),
        ])
        .strong_if(*method == recommended)
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

fn correlation(plant: &PlantResult) -> Table {
    let names = &plant.correlation.names;
    let head = std::iter::once("").chain(names.iter().map(String::as_str));
    let rows = names.iter().zip(&plant.correlation.value).map(|(name, row)| {
        let signed = row.iter().map(|r| format!("{r:.2}").replace('-', "−"));
        Row::new(std::iter::once(name.clone()).chain(signed))
    });
    Table::new("Correlation of the estimates, recommended method", head, rows.collect())
}

fn nuisances(plant: &PlantResult) -> Option<Table> {
    if plant.nuisances.is_empty() {
        return None;
    }
    let rows = plant.nuisances.iter().map(|(name, parameter)| {
        // The part after a stop or a space is the name of a trial, and unchanged.
        let (own, trial) = name.split_at(name.find(['.', ' ', ':']).unwrap_or(name.len()));
        let name = words::capitalised(&format!("{}{trial}", own.replace('_', " ")));
        Row::new([name, with_interval(Some(parameter)), parameter.unit.clone()])
    });
    let head = ["Parameter", "Value ± standard deviation [95 % interval]", "Unit"];
    Some(Table::new("Nuisance parameters, fitted together with the plant", head, rows.collect()))
}

/// Returns the table of reasons for the model's structure.
fn structure(plant: &PlantResult) -> Option<Table> {
    if plant.structure.is_empty() {
        return None;
    }
    let head = [
        "Part".to_owned(),
        "In the model".to_owned(),
        "Twice the gain in log-likelihood".to_owned(),
        "Gain required".to_owned(),
        "Size, %".to_owned(),
    ];
    let rows = plant.structure.iter().map(|decision| {
        Row::new([
            words::capitalised(&decision.candidate.replace('-', " ")),
            if decision.admitted { "yes" } else { "no" }.to_owned(),
            significant(decision.likelihood_ratio, 3),
            or_absent(decision.needed, 3),
            or_absent(decision.size.map(|size| 100.0 * size), 2),
        ])
        .strong_if(decision.admitted)
    });
    let caption = "Which parts of the model the logs support, recommended method";
    let table = Table::new(caption, head, rows.collect()).left(2);
    Some(table.noted("Size of linear drag: as a part of quadratic drag at the usual speed; of a bias force: the end of its interval farther from zero, as a part of the usual thrust. A bias force stays unless the logs show that it is small."))
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
    Some(
        Table::new("Steady runs beside the other trials, recommended method", head, rows)
            .noted(&note),
    )
}

/// Returns the other methods' doubts that the first screen lacks.
fn other_doubts(methods: &[OfMethod<'_>], recommended: &PlantResult) -> Doubts {
    let mut found: Vec<(String, &Caveat)> = Vec::new();
    for (method, plant, _) in &methods[1..] {
        let place = words::capitalised(&words::method(*method));
        let new = plant.caveats.iter().filter(|caveat| !recommended.caveats.contains(caveat));
        found.extend(new.map(|caveat| (place.clone(), caveat)));
    }
    collected(found)
}
