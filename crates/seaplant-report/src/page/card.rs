//! First screen: a card for each degree of freedom.

use seaplant::exchange::Consequence;
use seaplant::plant::Basis;
use seaplant::results::{Parameter, Parameters, PlantResult, Results, Score, TruePlant};
use seaplant::{Dof, Stability};
use serde::Serialize;

use super::verdict::VerdictView;
use crate::figure::Thumbnails;
use crate::number::{ABSENT, Decimals, Rounded, or_absent, signed_percent, significant};
use crate::words;

#[derive(Serialize)]
pub(crate) struct Card {
    /// Section with the details.
    section: String,
    title: String,
    method: String,
    #[serde(flatten)]
    verdict: VerdictView,
    picture: Option<Picture>,
    velocity_unit: &'static str,
    /// Prediction error of a null model.
    still: &'static str,
    rows: Vec<ParameterRow>,
    follows: Vec<Follows>,
    /// For a plant of one axis.
    stability: Option<String>,
    scores: Vec<ScoreRow>,
}

#[derive(Serialize)]
struct Picture {
    svg: String,
    caption: String,
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
    /// Meaning of its sign.
    meaning: &'static str,
    truth: Option<Truth>,
}

/// A derived number of the plant.
#[derive(Serialize)]
struct Follows {
    label: String,
    value: String,
    unit: String,
    interval: String,
    /// True if a small card omits it.
    is_minor: bool,
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

/// Returns a card for each axis by its preferred plant.
pub(crate) fn all(results: &Results, thumbnails: &Thumbnails) -> Vec<Card> {
    let card = |dof: Dof| {
        let plant = results.preferred(dof)?;
        Some(of(dof, plant.by_axis.get(&dof)?, plant, results, thumbnails))
    };
    Dof::ALL.into_iter().filter_map(card).collect()
}

fn of(
    dof: Dof,
    own: &Parameters,
    plant: &PlantResult,
    results: &Results,
    thumbnails: &Thumbnails,
) -> Card {
    let judged = plant.verdicts.get(&dof).unwrap_or(&plant.verdict);
    let left_out = plant.left_out.as_ref().and_then(|score| score.by_axis.get(&dof));
    let scores = [
        ("Held-out trials", plant.held_out(dof)),
        ("Trials left out in turn", left_out),
        ("Fitted trials", plant.fitted(dof)),
        ("The axis alone", plant.single_axes.get(&dof)),
    ];
    let scores = scores.into_iter().filter_map(|(label, score)| Some(score_row(label, score?)));
    let added = own.added_mass.as_ref().map(|added| added_mass(dof, added));
    let method = words::method(plant.method);
    let quantity = plant.fitted(dof).map(|score| score.quantity).unwrap_or_default();
    Card {
        section: plant.name(),
        title: words::capitalised(dof.name()),
        method: if plant.is_alone() { method } else { format!("{method}, axes together") },
        verdict: VerdictView::of(judged),
        picture: {
            let name = (!plant.is_alone()).then(|| plant.name());
            Picture::of(thumbnails.of(name.as_deref(), dof))
        },
        velocity_unit: quantity.unit(dof),
        still: words::still(quantity),
        rows: rows(dof, own, plant, results),
        follows: added.into_iter().chain(consequences(dof, results)).collect(),
        stability: plant.alone.as_ref().map(|alone| stability(dof, &alone.stability)),
        scores: scores.collect(),
    }
}

impl Picture {
    fn of(thumbnail: Option<(&str, &str)>) -> Option<Self> {
        thumbnail.map(|(svg, caption)| Self { svg: svg.to_owned(), caption: caption.to_owned() })
    }
}

/// Returns the derived numbers of an axis' plant.
fn consequences(dof: Dof, results: &Results) -> impl Iterator<Item = Follows> + '_ {
    results.consequences.iter().filter(move |follows| follows.axis == dof).map(consequence)
}

fn consequence(of: &Consequence) -> Follows {
    let interval = of.interval95.map_or_else(String::new, |[low, high]| {
        format!("{} … {}", significant(low, 3), significant(high, 3))
    });
    Follows {
        label: words::capitalised(&of.name),
        value: significant(of.value, 3),
        unit: of.unit.clone(),
        interval,
        is_minor: ["stopping", "speed without"].iter().any(|start| of.name.starts_with(start)),
    }
}

fn added_mass(dof: Dof, added: &Parameter) -> Follows {
    let Rounded { value, std, low95, high95 } = Rounded::of(added);
    Follows {
        label: if dof.is_rotation() { "Added inertia" } else { "Added mass" }.to_owned(),
        value: format!("{value} ± {std}"),
        unit: added.unit.clone(),
        interval: format!("{low95} … {high95}"),
        is_minor: false,
    }
}

/// Explains the sign of a constant force; `b` is on the left-hand side.
fn meaning(dof: Dof, bias: &Parameter) -> &'static str {
    match (dof, bias.low95 > 0.0, bias.high95 < 0.0) {
        (Dof::Heave, true, _) => "rises without thrust: more buoyancy than weight",
        (Dof::Heave, _, true) => "sinks without thrust: more weight than buoyancy",
        (Dof::Heave, ..) => "may be zero: buoyancy equals weight within the interval",
        _ => "",
    }
}

/// Returns mass, drag and constant force of an axis, and the righting moment of roll and pitch.
fn rows(dof: Dof, own: &Parameters, plant: &PlantResult, results: &Results) -> Vec<ParameterRow> {
    let truth = results.truth_of(dof);
    let of = |names, parameter: Option<&Parameter>, true_value: fn(&TruePlant) -> f64| {
        parameter.map(|parameter| parameter_row(names, parameter, truth.as_ref().map(true_value)))
    };
    let all = [
        of((words::mass(dof), words::mass_symbol(dof)), Some(&own.mass), |truth| truth.mass),
        of(("Quadratic drag", "d_Q"), own.quadratic_drag.as_ref(), |truth| truth.quadratic_drag),
        of(("Linear drag", "d_L"), own.linear_drag.as_ref(), |truth| truth.linear_drag),
        of((words::bias_force(dof), "b"), own.bias_force.as_ref(), |truth| truth.bias_force),
    ];
    let mut rows: Vec<ParameterRow> = all.into_iter().flatten().collect();
    if let (Some(bias), Some(row)) = (&own.bias_force, rows.last_mut()) {
        row.meaning = meaning(dof, bias);
    }
    let lever = Basis::Lever(2).to_string();
    let righting = plant.parameters.get(&lever);
    let righting = righting.filter(|_| matches!(dof, Dof::Roll | Dof::Pitch)).map(|moment| {
        let of_truth = results.truth.as_ref().and_then(|truth| truth.get(&lever).copied());
        parameter_row(("Righting moment", "per rad"), &Parameter::from(moment), of_truth)
    });
    rows.extend(righting);
    rows
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
    ParameterRow { label, symbol, value, std, low95, high95, unit, meaning: "", truth }
}

/// Formats the relative error in per cent; for a truth of zero the difference is written.
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
        e: score.mean_abs_error.map_or_else(|| "diverges".to_owned(), |e| significant(e, 3)),
        null: significant(score.null_error, 3),
        best_null: best_null(score),
        r_squared: or_absent(score.r_squared, 4),
    }
}

/// Formats the error of the best model without a plant, with its name.
pub(crate) fn best_null(score: &Score) -> String {
    score.best_null.map_or_else(
        || ABSENT.to_owned(),
        |null| format!("{} ({})", significant(null.mean_abs_error, 3), null.model.description()),
    )
}

pub(crate) fn stability(dof: Dof, stability: &Stability) -> String {
    match stability {
        Stability::Stable | Stability::Unstable => stability.to_string(),
        other => format!("{other} {}", dof.units().velocity),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture;

    #[test]
    fn the_sign_of_buoyancy_is_said_in_words() {
        let b = |value: f64| fixture::parameter(value, 1.0, "N");
        assert!(meaning(Dof::Heave, &b(10.0)).starts_with("rises"));
        assert!(meaning(Dof::Heave, &b(-10.0)).starts_with("sinks"));
        assert!(meaning(Dof::Heave, &b(0.5)).starts_with("may be zero"));
        assert_eq!(meaning(Dof::Surge, &b(10.0)), "");
    }
}
