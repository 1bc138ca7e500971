//! Tables of errors, by axis and by trial.

use seaplant::results::{Part, PlantResult, Score};
use seaplant::{Dof, ScoredMotion};

use super::{Methods, axes_of_kind, of_kind};
use crate::number::{ABSENT, Decimals, count, or_absent, significant};
use crate::page::card::best_null;
use crate::page::table::{Row, Table};
use crate::words;

/// Returns the errors of each axis, and the plant that held-out trials support.
pub(super) fn tables(plant: &PlantResult) -> Vec<Table> {
    let mut tables = vec![by_axis(plant)];
    tables.extend(changes(plant));
    tables
}

/// Returns the errors on each trial, of translations and of rotations, which have other units.
pub(super) fn by_trial(plant: &PlantResult, methods: &Methods<'_>) -> [Table; 2] {
    [false, true].map(|is_rotation| errors(plant, methods, is_rotation))
}

fn r_squared(score: Option<&Score>) -> String {
    or_absent(score.and_then(|score| score.r_squared), 4)
}

fn by_axis(plant: &PlantResult) -> Table {
    let quantity = quantity(plant);
    let row = |dof: &Dof| {
        let (own, held) = (plant.fitted(*dof), plant.held_out(*dof));
        let cells = |score: Option<&Score>| {
            [
                or_absent(score.and_then(|score| score.mean_abs_error), 3),
                or_absent(score.map(|score| score.null_error), 3),
                r_squared(score),
            ]
        };
        let scored = held.or(own);
        let mut row = vec![words::capitalised(dof.name()), quantity.unit(*dof).to_owned()];
        row.extend(cells(held));
        row.push(scored.map_or_else(|| ABSENT.to_owned(), best_null));
        row.push(or_absent(scored.and_then(|score| score.disturbance_error), 3));
        row.extend(cells(own));
        row.push(r_squared(plant.single_axes.get(dof)));
        Row::new(row)
    };
    let still = words::still(quantity).to_lowercase();
    let head = [
        "Axis",
        "unit",
        "held out: e",
        &still,
        "R²",
        "best without a plant",
        "disturbance: e",
        "fitted: e",
        &still,
        "R²",
        "R² alone",
    ];
    Table::new("Prediction from forces alone", head, plant.axes.iter().map(row).collect())
        .left(2)
        .without_empty_columns()
        .noted(note(plant))
}

/// Explains the columns of the table by axis that a plant has.
fn note(plant: &PlantResult) -> &'static str {
    match plant.axes.len() {
        1 => {
            "The axis is simulated freely from the start of each trial, from its force alone; e is the mean |simulated − measured| of what is scored."
        }
        _ => {
            "All axes are simulated together and freely from the start of each trial; e is the mean |simulated − measured| velocity. “Disturbance” is what forces that are not logged, as strong as they were found, do to a simulation by themselves. “Alone” is an axis with a plant of its own, on held-out trials if there are any: the difference is what coupling explains."
        }
    }
}

fn quantity(plant: &PlantResult) -> ScoredMotion {
    plant.fitted(plant.first_axis()).map(|score| score.quantity).unwrap_or_default()
}

/// Returns the changes of mass and drag that the held-out trials support.
fn changes(plant: &PlantResult) -> Option<Table> {
    let row = |dof: &Dof| {
        let score = plant.held_out(*dof)?;
        let likely = score.likely_change;
        let (mass, drag) = match likely {
            Some(change) => (change.mass, change.drag),
            None => score.change.map(|change| (change.mass, change.drag))?,
        };
        let part = |part: Part| {
            let half = 50.0 * (part.high95 - part.low95);
            let decimals = Decimals::of_std(half, half);
            format!("{} ± {} %", decimals.write(100.0 * part.value), decimals.write(half))
        };
        Some(Row::new([
            words::capitalised(dof.name()),
            part(mass),
            part(drag),
            or_absent(likely.map(|change| change.whiteness), 3),
            or_absent(likely.map(|change| change.surprise), 3),
        ]))
    };
    let rows: Vec<Row> = plant.axes.iter().filter_map(row).collect();
    let head = ["Axis", "mass", "drag", "correlation", "size"];
    (!rows.is_empty()).then(|| {
        let note = match plant.is_alone() {
            true => "Change of mass and drag that would lower the error on the held-out trials most, with 95 % intervals: those of a plant that holds include zero.",
            false => "Change of mass and drag that the held-out trials alone support, allowing for unlogged forces and a current of their own, with 95 % intervals: those of a plant that holds include zero. “Correlation” in time and “size” are those of what the filter fails to predict: 1 where the plant lacks nothing, and the trials are disturbed as those that were fitted.",
        };
        Table::new("The plant that held-out trials support", head, rows)
            .without_empty_columns()
            .noted(note)
    })
}

fn errors(plant: &PlantResult, methods: &Methods<'_>, is_rotation: bool) -> Table {
    let axes = axes_of_kind(plant, is_rotation);
    let Some(first) = axes.first() else { return Table::default() };
    let quantity = quantity(plant);
    let still = words::still(quantity);
    let unit = quantity.unit(*first);
    let head = [
        "Axis".to_owned(),
        "Method".to_owned(),
        "Trial".to_owned(),
        "Use".to_owned(),
        format!("e, {unit}"),
        format!("{still}, {unit}"),
        "R²".to_owned(),
        format!("Position e, {}", first.units().position),
        "Position R²".to_owned(),
        "Samples".to_owned(),
    ];
    let mut rows = Vec::new();
    for dof in axes {
        for (method, plant, is_recommended) in methods.iter() {
            let held_out = plant.hold_out.iter().flat_map(|score| score.trials(dof));
            let fitted = plant.fit.trials(dof).map(|trial| ("fitted", trial));
            for (role, (name, trial)) in fitted.chain(held_out.map(|trial| ("held out", trial))) {
                let e = trial.mean_abs_error;
                let row = Row::new([
                    words::capitalised(dof.name()),
                    method.clone(),
                    name.clone(),
                    role.to_owned(),
                    e.map_or_else(|| "diverges".to_owned(), |e| significant(e, 3)),
                    significant(trial.null_error, 3),
                    or_absent(trial.r_squared, 4),
                    or_absent(trial.position_mean_abs_error, 3),
                    or_absent(trial.position_r_squared, 4),
                    match trial.samples {
                        0 => ABSENT.to_owned(),
                        samples => count(samples as u64),
                    },
                ]);
                rows.push(row.strong_if(is_recommended));
            }
        }
    }
    let title = match quantity {
        ScoredMotion::Velocity => "Error e of each plant on each trial, on raw velocity",
        ScoredMotion::Acceleration => {
            "Error e of each plant on each trial, on mean acceleration over half a second"
        }
    };
    Table::new(&of_kind(title, plant, is_rotation), head, rows).left(4).without_empty_columns()
}
