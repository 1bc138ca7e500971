//! The first screen: one card for each degree of freedom.

use seaplant::results::{Parameter, PlantResult, Results, Score, TruePlant};
use seaplant::{Compared, Dof, Stability};
use serde::Serialize;

use crate::number::{ABSENT, Decimals, Rounded, or_absent, signed_percent, significant};
use crate::words;

#[derive(Serialize)]
pub(crate) struct Card {
    name: &'static str,
    title: String,
    method: String,
    trust: &'static str,
    trust_class: String,
    reason: String,
    velocity_unit: &'static str,
    /// What a model that says nothing does.
    still: &'static str,
    rows: Vec<ParameterRow>,
    stability: String,
    scores: Vec<ScoreRow>,
}

#[derive(Serialize)]
struct ParameterRow {
    label: &'static str,
    symbol: &'static str,
    value: String,
    std: String,
    low95: String,
    high95: String,
    unit: String,
    truth: Option<Truth>,
}

#[derive(Serialize)]
struct Truth {
    value: String,
    error: String,
    inside: bool,
}

#[derive(Serialize)]
struct ScoreRow {
    label: String,
    e: String,
    null: String,
    best_null: String,
    r_squared: String,
}

pub(crate) fn all(results: &Results) -> Vec<Card> {
    results
        .plants
        .iter()
        .map(|(&dof, plant)| {
            let truth = results.truth.as_ref().and_then(|truth| truth.get(&dof));
            of(dof, plant, truth)
        })
        .collect()
}

fn of(dof: Dof, plant: &PlantResult, truth: Option<&TruePlant>) -> Card {
    let judged = &plant.verdict;
    let mut scores = Vec::new();
    if let Some(held_out) = &plant.hold_out {
        scores.push(score_row("Held-out trials", held_out));
    }
    if let Some(left_out) = &plant.left_out {
        scores.push(score_row("Trials left out in turn", left_out));
    }
    scores.push(score_row("Fitted trials", &plant.fit));
    Card {
        name: dof.name(),
        title: words::capitalised(dof.name()),
        method: words::method(plant.method),
        trust: judged.trust.name(),
        trust_class: judged.trust.name().replace(' ', "-"),
        reason: words::capitalised(&judged.reason),
        velocity_unit: plant.fit.quantity.unit(dof),
        still: match plant.fit.quantity {
            Compared::Velocity => "Never moving",
            Compared::Acceleration => "Never accelerating",
        },
        rows: rows(dof, plant, truth),
        stability: stability(dof, &plant.stability),
        scores,
    }
}

fn rows(dof: Dof, plant: &PlantResult, truth: Option<&TruePlant>) -> Vec<ParameterRow> {
    let parameters = &plant.parameters;
    let of = |names, parameter: Option<&Parameter>, true_value: fn(&TruePlant) -> f64| {
        parameter.map(|parameter| parameter_row(names, parameter, truth.map(true_value)))
    };
    let all = [
        of((words::mass(dof), "m"), Some(&parameters.mass), |truth| truth.mass),
        of(("Quadratic drag", "d_Q"), parameters.quadratic_drag.as_ref(), |truth| {
            truth.quadratic_drag
        }),
        of(("Linear drag", "d_L"), parameters.linear_drag.as_ref(), |truth| truth.linear_drag),
        of((words::bias_force(dof), "b"), parameters.bias_force.as_ref(), |truth| truth.bias_force),
    ];
    all.into_iter().flatten().collect()
}

fn parameter_row(
    (label, symbol): (&'static str, &'static str),
    parameter: &Parameter,
    truth: Option<f64>,
) -> ParameterRow {
    let Rounded { value, std, low95, high95 } = Rounded::of(parameter);
    let truth = truth.map(|truth| Truth {
        value: Decimals::of_std(parameter.value, parameter.std).write(truth),
        error: error(parameter.value, truth),
        inside: (parameter.low95..=parameter.high95).contains(&truth),
    });
    let unit = parameter.unit.clone();
    ParameterRow { label, symbol, value, std, low95, high95, unit, truth }
}

/// In per cent of the truth; a truth of zero has none, and the difference is written.
fn error(value: f64, truth: f64) -> String {
    if truth == 0.0 {
        format!("off by {}", significant(value, 2))
    } else {
        signed_percent((value - truth) / truth.abs())
    }
}

fn score_row(label: &str, score: &Score) -> ScoreRow {
    ScoreRow {
        label: label.to_owned(),
        e: score.mean_abs_error.map_or_else(|| "runs away".to_owned(), |e| significant(e, 3)),
        null: significant(score.null_error, 3),
        best_null: score.best_null.map_or_else(
            || ABSENT.to_owned(),
            |null| {
                format!("{} ({})", significant(null.mean_abs_error, 3), null.model.description())
            },
        ),
        r_squared: or_absent(score.r_squared, 4),
    }
}

pub(crate) fn stability(dof: Dof, stability: &Stability) -> String {
    match stability {
        Stability::Stable | Stability::Unstable => stability.to_string(),
        other => format!("{other} {}", dof.units().velocity),
    }
}
