//! First screen: a card for each degree of freedom.

use std::collections::BTreeMap;

use seaplant::exchange::Consequence;
use seaplant::results::{Parameter, PlantResult, Results, Score, TruePlant};
use seaplant::{Dof, ScoredMotion, Stability};
use serde::Serialize;

use super::several_axes_card;
use crate::figure::Thumbnails;
use crate::number::{ABSENT, Decimals, Rounded, or_absent, signed_percent, significant};
use crate::words;

#[derive(Serialize)]
pub(crate) struct Card {
    /// Section with the details.
    pub(super) section: String,
    pub(super) title: String,
    pub(super) method: String,
    pub(super) trust: &'static str,
    pub(super) trust_class: String,
    pub(super) reason: String,
    /// The motion that unseen trials confirm; empty if none was tested.
    pub(super) good_for: String,
    /// By how much numbers may be off; empty if none is named.
    pub(super) may_be_off: String,
    pub(super) picture: Option<Picture>,
    pub(super) velocity_unit: &'static str,
    /// Prediction error of a null model.
    pub(super) still: &'static str,
    pub(super) rows: Vec<ParameterRow>,
    pub(super) follows: Vec<Follows>,
    /// For a plant of one axis.
    pub(super) stability: Option<String>,
    pub(super) scores: Vec<ScoreRow>,
}

#[derive(Serialize)]
pub(super) struct Picture {
    svg: String,
    caption: String,
}

#[derive(Serialize)]
pub(super) struct ParameterRow {
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
pub(super) struct Follows {
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
pub(super) struct ScoreRow {
    pub(super) label: String,
    pub(super) e: String,
    pub(super) null: String,
    pub(super) best_null: String,
    pub(super) r_squared: String,
}

/// Returns a card for each axis: of plants of several axes, and of each axis that only has a plant
/// of its own.
pub(crate) fn all(results: &Results, thumbnails: &Thumbnails) -> Vec<Card> {
    let mut cards: BTreeMap<Dof, Card> = results
        .plants
        .iter()
        .map(|(&dof, plant)| (dof, of(dof, plant, results, thumbnails)))
        .collect();
    for (name, plant) in &results.coupled {
        for &dof in &plant.axes {
            cards.insert(dof, several_axes_card::of(dof, name, plant, results, thumbnails));
        }
    }
    cards.into_values().collect()
}

fn of(dof: Dof, plant: &PlantResult, results: &Results, thumbnails: &Thumbnails) -> Card {
    let judged = &plant.verdict;
    let mut scores = Vec::new();
    if let Some(held_out) = &plant.hold_out {
        scores.push(score_row("Held-out trials", held_out));
    }
    if let Some(left_out) = &plant.left_out {
        scores.push(score_row("Trials left out in turn", left_out));
    }
    scores.push(score_row("Fitted trials", &plant.fit));
    let mut follows: Vec<Follows> = added_mass(dof, plant, results).into_iter().collect();
    follows.extend(consequences(dof, results));
    Card {
        section: dof.name().to_owned(),
        title: words::capitalised(dof.name()),
        method: words::method(plant.method),
        trust: judged.trust.name(),
        trust_class: judged.trust.name().replace(' ', "-"),
        reason: words::capitalised(&judged.reason),
        good_for: words::good_for(judged),
        may_be_off: words::may_be_off(judged),
        picture: Picture::of(thumbnails.of(None, dof)),
        velocity_unit: plant.fit.quantity.unit(dof),
        still: match plant.fit.quantity {
            ScoredMotion::Velocity => "Never moving",
            ScoredMotion::Acceleration => "Never accelerating",
        },
        rows: rows(dof, plant, results.truth.as_ref().and_then(|truth| truth.get(&dof))),
        follows,
        stability: Some(stability(dof, &plant.stability)),
        scores,
    }
}

impl Picture {
    pub(super) fn of(thumbnail: Option<(&str, &str)>) -> Option<Self> {
        thumbnail.map(|(svg, caption)| Self { svg: svg.to_owned(), caption: caption.to_owned() })
    }
}

/// Returns the derived numbers of an axis' plant.
pub(super) fn consequences(dof: Dof, results: &Results) -> impl Iterator<Item = Follows> + '_ {
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

/// Returns the added mass, if the dry vehicle is known.
fn added_mass(dof: Dof, plant: &PlantResult, results: &Results) -> Option<Follows> {
    let body = results.rigid_body.as_ref().and_then(|body| body.body().ok());
    let of_body = body.map(|body| body.mass_matrix()[(dof.index(), dof.index())]);
    let dry = of_body.or(results.dry_mass_kg.filter(|_| !dof.is_rotation()))?;
    Some(added_to(dof, dry, &plant.parameters.mass))
}

/// Subtracts the dry vehicle's mass or inertia.
pub(super) fn added_to(dof: Dof, dry: f64, mass: &Parameter) -> Follows {
    let Parameter { value, std, low95, high95, unit } = mass.clone();
    let added =
        Parameter { value: value - dry, std, low95: low95 - dry, high95: high95 - dry, unit };
    let Rounded { value, std, low95, high95 } = Rounded::of(&added);
    Follows {
        label: if dof.is_rotation() { "Added inertia" } else { "Added mass" }.to_owned(),
        value: format!("{value} ± {std}"),
        unit: added.unit,
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

fn rows(dof: Dof, plant: &PlantResult, truth: Option<&TruePlant>) -> Vec<ParameterRow> {
    let parameters = &plant.parameters;
    let of = |names, parameter: Option<&Parameter>, true_value: fn(&TruePlant) -> f64| {
        parameter.map(|parameter| parameter_row(names, parameter, truth.map(true_value)))
    };
    let all = [
        of((words::mass(dof), words::mass_symbol(dof)), Some(&parameters.mass), |truth| truth.mass),
        of(("Quadratic drag", "d_Q"), parameters.quadratic_drag.as_ref(), |truth| {
            truth.quadratic_drag
        }),
        of(("Linear drag", "d_L"), parameters.linear_drag.as_ref(), |truth| truth.linear_drag),
        of((words::bias_force(dof), "b"), parameters.bias_force.as_ref(), |truth| truth.bias_force),
    ];
    let mut rows: Vec<ParameterRow> = all.into_iter().flatten().collect();
    if let (Some(bias), Some(row)) = (&parameters.bias_force, rows.last_mut()) {
        row.meaning = meaning(dof, bias);
    }
    rows
}

pub(super) fn parameter_row(
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
