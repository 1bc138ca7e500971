//! The first screen: one line for the vehicle, and a card for each degree of freedom.

use seaplant::exchange::{Consequence, Judgement};
use seaplant::results::{Parameter, PlantResult, Results, Score, TruePlant, Trust};
use seaplant::{Dof, ScoredMotion, Stability};
use serde::Serialize;

use crate::figure::Thumbnails;
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
    picture: Option<Picture>,
    velocity_unit: &'static str,
    /// What a model that says nothing does.
    still: &'static str,
    rows: Vec<ParameterRow>,
    follows: Vec<Follows>,
    stability: String,
    scores: Vec<ScoreRow>,
}

/// What is made of some axes, in a clause.
#[derive(Debug, PartialEq, Serialize)]
pub(crate) struct Finding {
    axes: String,
    trust: &'static str,
    trust_class: String,
    /// Empty of what is usable.
    reason: String,
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
    /// What its sign means.
    meaning: &'static str,
    truth: Option<Truth>,
}

/// A number that follows from the plant.
#[derive(Serialize)]
struct Follows {
    label: String,
    value: String,
    unit: String,
    interval: String,
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

/// What is made of the vehicle: its axes by verdict, the best first; equal verdicts without a
/// reason stand together.
pub(crate) fn headline(results: &Results) -> Vec<Finding> {
    // Without a method asked for, every axis has its recommended plant.
    let judgements = Judgement::of_results(results, None).unwrap_or_default();
    let mut judged: Vec<(Trust, String, String)> = Vec::new();
    for judgement in &judgements {
        let names: Vec<&str> = judgement.axes.iter().map(|dof| dof.name()).collect();
        let (trust, axes) = (judgement.verdict.trust, names.join("-"));
        // Warnings stand below; what is doubtful says here why.
        let is_plain = trust >= Trust::UsableWithCare;
        match judged.iter_mut().find(|(other, ..)| is_plain && *other == trust) {
            Some((_, together, _)) => *together += &format!(", {axes}"),
            None if is_plain => judged.push((trust, axes, String::new())),
            None => judged.push((trust, axes, spoken_reason(judgement))),
        }
    }
    judged.sort_by_key(|(trust, ..)| std::cmp::Reverse(*trust));
    let finding = |(trust, axes, reason): (Trust, String, String)| Finding {
        axes: match axes.rsplit_once(", ") {
            Some((first, last)) => words::capitalised(&format!("{first} and {last}")),
            None => words::capitalised(&axes),
        },
        trust: trust.name(),
        trust_class: trust.name().replace(' ', "-"),
        reason,
    };
    judged.into_iter().map(finding).collect()
}

/// Of a plant that is usable with care, which warnings ask for it; else the verdict's reason.
fn spoken_reason(judgement: &Judgement) -> String {
    let verdict = &judgement.verdict;
    let mut warnings: Vec<String> = verdict.codes.iter().map(|code| code.words()).collect();
    warnings.dedup();
    match verdict.trust {
        Trust::UsableWithCare if !warnings.is_empty() => format!("({})", warnings.join(", ")),
        _ => format!("because {}", verdict.reason),
    }
}

pub(crate) fn all(results: &Results, thumbnails: &Thumbnails) -> Vec<Card> {
    results.plants.iter().map(|(&dof, plant)| of(dof, plant, results, thumbnails)).collect()
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
    let picture = thumbnails
        .of(dof)
        .map(|(svg, caption)| Picture { svg: svg.to_owned(), caption: caption.to_owned() });
    let mut follows: Vec<Follows> = added_mass(dof, plant, results).into_iter().collect();
    let of_axis = results.consequences.iter().filter(|follows| follows.axis == dof);
    follows.extend(of_axis.map(consequence));
    Card {
        name: dof.name(),
        title: words::capitalised(dof.name()),
        method: words::method(plant.method),
        trust: judged.trust.name(),
        trust_class: judged.trust.name().replace(' ', "-"),
        reason: words::capitalised(&judged.reason),
        picture,
        velocity_unit: plant.fit.quantity.unit(dof),
        still: match plant.fit.quantity {
            ScoredMotion::Velocity => "Never moving",
            ScoredMotion::Acceleration => "Never accelerating",
        },
        rows: rows(dof, plant, results.truth.as_ref().and_then(|truth| truth.get(&dof))),
        follows,
        stability: stability(dof, &plant.stability),
        scores,
    }
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
    }
}

/// What the water adds, where the dry vehicle is known.
fn added_mass(dof: Dof, plant: &PlantResult, results: &Results) -> Option<Follows> {
    let body = results.rigid_body.as_ref().and_then(|body| body.body().ok());
    let of_body = body.map(|body| body.mass_matrix()[(dof.index(), dof.index())]);
    let dry = of_body.or(results.dry_mass_kg.filter(|_| !dof.is_rotation()))?;
    let Parameter { value, std, low95, high95, unit } = plant.parameters.mass.clone();
    let added =
        Parameter { value: value - dry, std, low95: low95 - dry, high95: high95 - dry, unit };
    let Rounded { value, std, low95, high95 } = Rounded::of(&added);
    Some(Follows {
        label: if dof.is_rotation() { "Added inertia" } else { "Added mass" }.to_owned(),
        value: format!("{value} ± {std}"),
        unit: added.unit,
        interval: format!("{low95} … {high95}"),
    })
}

/// What the sign of a force that acts without thrust means; `b` stands on the left.
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
    fn the_headline_names_each_axis_with_its_verdict() {
        let headline = headline(&fixture::identification().results);
        assert!(!headline.is_empty());
        let worst = headline.last().expect("one");
        assert_eq!((worst.trust, worst.trust_class.as_str()), ("do not use", "do-not-use"));
        assert!(!worst.reason.is_empty());
    }

    #[test]
    fn the_sign_of_buoyancy_is_said_in_words() {
        let b = |value: f64| fixture::parameter(value, 1.0, "N");
        assert!(meaning(Dof::Heave, &b(10.0)).starts_with("rises"));
        assert!(meaning(Dof::Heave, &b(-10.0)).starts_with("sinks"));
        assert!(meaning(Dof::Heave, &b(0.5)).starts_with("may be zero"));
        assert_eq!(meaning(Dof::Surge, &b(10.0)), "");
    }
}
