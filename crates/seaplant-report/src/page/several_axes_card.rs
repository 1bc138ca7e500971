//! Card of one axis of a plant of several.

use seaplant::Dof;
use seaplant::plant::{Basis, Product};
use seaplant::results::{AxisScore, Coefficient, FittedPlant, Parameter, Results};

use super::card::{Card, ParameterRow, Picture, ScoreRow, added_to, consequences, parameter_row};
use crate::figure::Thumbnails;
use crate::number::{ABSENT, or_absent, significant};
use crate::words;

pub(super) fn of(
    dof: Dof,
    name: &str,
    plant: &FittedPlant,
    results: &Results,
    thumbnails: &Thumbnails,
) -> Card {
    let verdict = plant.verdicts.get(&dof).unwrap_or(&plant.verdict);
    let mass = plant.parameters.get(&Basis::Mass(dof, dof).to_string()).map(parameter);
    let place = plant.axes.iter().position(|axis| *axis == dof);
    let dry = plant
        .rigid_body_mass_matrix
        .as_ref()
        .zip(place)
        .and_then(|(matrix, k)| matrix.get(k)?.get(k).copied());
    let added = dry.zip(mass.as_ref()).map(|(dry, mass)| added_to(dof, dry, mass));
    Card {
        section: name.to_owned(),
        title: words::capitalised(dof.name()),
        method: format!("{}, axes together", words::method(plant.method)),
        trust: verdict.trust.name(),
        trust_class: verdict.trust.name().replace(' ', "-"),
        reason: words::capitalised(&verdict.reason),
        good_for: words::good_for(verdict),
        may_be_off: words::may_be_off(verdict),
        picture: Picture::of(thumbnails.of(Some(name), dof)),
        velocity_unit: dof.units().velocity,
        still: "Never moving",
        rows: rows(dof, plant, results),
        follows: added.into_iter().chain(consequences(dof, results)).collect(),
        stability: None,
        scores: scores(dof, plant),
    }
}

fn parameter(x: &Coefficient) -> Parameter {
    let Coefficient { value, std, low95, high95, unit, .. } = x.clone();
    Parameter { value, std, low95, high95, unit }
}

/// Returns the axis' own coefficients: the diagonal of M and of the damping, weight and righting
/// moment.
fn rows(dof: Dof, plant: &FittedPlant, results: &Results) -> Vec<ParameterRow> {
    let own = [
        (words::mass(dof), words::mass_symbol(dof), Basis::Mass(dof, dof)),
        ("Quadratic drag", "d_Q", Basis::Product(dof, Product::quadratic(dof))),
        ("Linear drag", "d_L", Basis::Product(dof, Product::linear(dof))),
        ("Weight − buoyancy", "W−B", Basis::WeightExcess),
        ("Righting moment", "per rad", Basis::Lever(2)),
    ];
    let truth = results.coupled_truth.as_ref();
    let row = |(label, symbol, basis): (&'static str, &'static str, Basis)| {
        let acts = match basis {
            Basis::WeightExcess => dof == Dof::Heave,
            Basis::Lever(_) => matches!(dof, Dof::Roll | Dof::Pitch),
            _ => true,
        };
        let name = basis.to_string();
        let coefficient = plant.parameters.get(&name).filter(|_| acts)?;
        // A coefficient that the truth does not name is zero there.
        let truth = truth.map(|truth| truth.get(&name).copied().unwrap_or(0.0));
        Some(parameter_row((label, symbol), &parameter(coefficient), truth))
    };
    own.into_iter().filter_map(row).collect()
}

fn scores(dof: Dof, plant: &FittedPlant) -> Vec<ScoreRow> {
    let of = |label: &str, score: Option<&AxisScore>| {
        score.map(|score| ScoreRow {
            label: label.to_owned(),
            e: score.mean_abs_error.map_or_else(|| "diverges".to_owned(), |e| significant(e, 3)),
            null: significant(score.null_error, 3),
            best_null: ABSENT.to_owned(),
            r_squared: or_absent(score.r2, 4),
        })
    };
    let held_out = plant.hold_out.as_ref().and_then(|score| score.by_axis.get(&dof));
    let all = [
        of("Held-out trials", held_out),
        of("Fitted trials", plant.fit.by_axis.get(&dof)),
        of("The axis alone", plant.single_axes.get(&dof)),
    ];
    all.into_iter().flatten().collect()
}
