//! Section of one plant of several axes.

use std::collections::BTreeMap;

use seaplant::Dof;
use seaplant::results::{
    Coefficient, MatrixResult, Parameter, Part, PlantResult, PrimeCoefficient, Score,
    ThrusterEstimate, ToldBy,
};
use serde::Serialize;

use super::axis_section::{Motions, motions};
use super::table::{Row, Table};
use super::{ChartView, Pictures};
use crate::chart::Subject;
use crate::number::{ABSENT, Decimals, Rounded, or_absent, significant};
use crate::words;

#[derive(Serialize)]
pub(crate) struct SeveralAxesSection {
    name: String,
    title: String,
    trust: &'static str,
    trust_class: String,
    reason: String,
    good_for: String,
    may_be_off: String,
    lead: String,
    motions: Vec<Motions>,
    drag: Vec<ChartView>,
    tables: Vec<Table>,
    details: Vec<Table>,
}

pub(crate) fn view(name: &str, plant: &PlantResult, pictures: Pictures<'_>) -> SeveralAxesSection {
    let mut tables = vec![scores(plant)];
    tables.extend(changes(plant));
    tables.push(matrix("Mass matrix M, rigid body plus added", plant, &plant.mass_matrix).noted(
        "Rows are forces and moments, columns accelerations; kg, kg m and kg m². The matrix is symmetric, and the Coriolis forces follow from it.",
    ));
    if let Some(added) = &plant.added_mass {
        let std = plant.mass_matrix.std.clone();
        let added = MatrixResult { value: added.clone(), std };
        tables.push(matrix("Added mass", plant, &added).noted("M without the dry vehicle."));
    }
    tables.push(matrix("Linear damping, on ν", plant, &plant.linear_damping));
    tables.push(matrix("Quadratic damping, on |ν|ν", plant, &plant.quadratic_damping));
    tables.extend(others(plant));
    tables.extend(thrusters(plant));
    tables.extend(prime(plant));
    let mut details = vec![coefficients(plant), nuisances(&plant.nuisances)];
    details.extend(structure(plant));
    details.push(correlation(plant));
    SeveralAxesSection {
        name: name.to_owned(),
        title: words::capitalised(&axes(plant)),
        trust: plant.verdict.trust.name(),
        trust_class: plant.verdict.trust.name().replace(' ', "-"),
        reason: plant.verdict.reason.clone(),
        good_for: words::good_for(&plant.verdict),
        may_be_off: words::may_be_off(&plant.verdict),
        lead: lead(plant),
        motions: motions(
            |role| {
                pictures.charts(|chart| {
                    chart.plant.as_deref() == Some(name) && chart.subject == Subject::Together(role)
                })
            },
            |role| pictures.drawn.note(name, role),
        ),
        drag: pictures
            .charts(|chart| chart.plant.as_deref() == Some(name) && chart.subject == Subject::Drag),
        tables,
        details,
    }
}

/// Formats `surge, sway, yaw`.
pub(super) fn axes(plant: &PlantResult) -> String {
    let names: Vec<&str> = plant.axes.iter().map(|dof| dof.name()).collect();
    names.join(", ")
}

fn lead(plant: &PlantResult) -> String {
    let told = plant.identifiability.as_ref().map_or_else(String::new, |told| {
        format!(
            " {} coefficients, of which the motion determines {};",
            told.coefficients, told.rank
        )
    });
    let axes = match plant.axes.len() {
        1 => "1 axis".to_owned(),
        several => format!("{several} axes"),
    };
    format!(
        "One plant of {axes} by {},{told} symmetry: {}. Velocities are relative to the water; forces that damp are positive.",
        words::method(plant.method),
        plant.symmetry
    )
}

fn scores(plant: &PlantResult) -> Table {
    let own = |dof: &Dof| plant.fit.by_axis.get(dof);
    let held = |dof: &Dof| plant.hold_out.as_ref().and_then(|score| score.by_axis.get(dof));
    let cells = |score: Option<&Score>| {
        let of = |x: Option<f64>| or_absent(x, 3);
        [
            of(score.and_then(|score| score.mean_abs_error)),
            of(score.map(|score| score.null_error)),
            score
                .and_then(|score| score.r_squared)
                .map_or(ABSENT.to_owned(), |r2| format!("{r2:.3}")),
        ]
    };
    let row = |dof: &Dof| {
        let unit = dof.units().velocity.to_owned();
        let mut row = vec![words::capitalised(dof.name()), unit];
        row.extend(cells(held(dof)));
        let scored = held(dof).or(own(dof));
        row.push(or_absent(scored.and_then(|score| score.disturbance_error), 3));
        row.extend(cells(own(dof)));
        let alone = plant.single_axes.get(dof).and_then(|score| score.r_squared);
        row.push(alone.map_or(ABSENT.to_owned(), |r2| format!("{r2:.3}")));
        Row::new(row)
    };
    let head = [
        "Axis",
        "unit",
        "held out: e",
        "never moving",
        "R²",
        "disturbance: e",
        "fitted: e",
        "never moving",
        "R²",
        "R² alone",
    ];
    Table::new(
        "Prediction from forces alone",
        head,
        plant.axes.iter().map(row).collect(),
    )
    .left(2)
    .noted("All axes are simulated together and freely from the start of each trial; e is the mean |simulated − measured| velocity. “Disturbance” is what forces that are not logged, as strong as they were found, do to a simulation by themselves. “Alone” is an axis with a plant of its own, on held-out trials if there are any: the difference is what coupling explains.")
}

/// Returns the changes of mass and drag that the held-out trials support.
fn changes(plant: &PlantResult) -> Option<Table> {
    let held = &plant.hold_out.as_ref()?.by_axis;
    let row = |dof: &Dof| {
        let change = held.get(dof)?.likely_change?;
        let part = |part: Part| {
            let half = 50.0 * (part.high95 - part.low95);
            let decimals = Decimals::of_std(half, half);
            format!("{} ± {} %", decimals.write(100.0 * part.value), decimals.write(half))
        };
        Some(Row::new([
            words::capitalised(dof.name()),
            part(change.mass),
            part(change.drag),
            significant(change.whiteness, 3),
            significant(change.surprise, 3),
        ]))
    };
    let rows: Vec<Row> = plant.axes.iter().filter_map(row).collect();
    let head = ["Axis", "mass", "drag", "correlation", "size"];
    (!rows.is_empty()).then(|| {
        Table::new("The plant that held-out trials support", head, rows).left(1).noted("Change of mass and drag that the held-out trials alone support, allowing for unlogged forces and a current of their own, with 95 % intervals: those of a plant that holds include zero. “Correlation” in time and “size” are those of what the filter fails to predict: 1 where the plant lacks nothing, and the trials are disturbed as those that were fitted.")
    })
}

fn matrix(caption: &str, plant: &PlantResult, matrix: &MatrixResult) -> Table {
    let cell = |value: f64, std: f64| {
        if std == 0.0 {
            return "·".to_owned();
        }
        let rounded = Rounded::of(&Parameter {
            value,
            std,
            low95: value,
            high95: value,
            unit: String::new(),
        });
        format!("{} ± {}", rounded.value, rounded.std)
    };
    let row = |(i, dof): (usize, &Dof)| {
        let cells = matrix.value[i].iter().zip(&matrix.std[i]).map(|(v, s)| cell(*v, *s));
        Row::new(std::iter::once(words::capitalised(dof.name())).chain(cells))
    };
    let head = std::iter::once(String::new())
        .chain(plant.axes.iter().map(|dof| words::capitalised(dof.name())));
    Table::new(caption, head, plant.axes.iter().enumerate().map(row).collect())
}

/// Returns the coefficients that are in none of the matrices.
fn others(plant: &PlantResult) -> Option<Table> {
    let in_matrix = |name: &str| name.starts_with("mass.") || is_plain_damping(name);
    let found = plant.parameters.iter().filter(|(name, _)| !in_matrix(name));
    let rows: Vec<Row> = found.map(|(name, x)| coefficient_row(name, x)).collect();
    (!rows.is_empty()).then(|| {
        Table::new("Restoring and further terms", COEFFICIENT_HEAD, rows)
            .noted("weight-minus-buoyancy is positive for a vehicle that sinks; lever.z is the righting moment per radian.")
    })
}

/// Returns whether a name such as `surge: u` or `sway: |r|r` is in the damping matrices.
fn is_plain_damping(name: &str) -> bool {
    let Some((_, product)) = name.split_once(": ") else { return false };
    let bare: Vec<char> = product.chars().filter(|c| *c != '|').collect();
    match bare.as_slice() {
        [one] => one.is_alphabetic() && !product.contains('|'),
        [first, second] => first == second && product.contains('|'),
        _ => false,
    }
}

const COEFFICIENT_HEAD: [&str; 5] = ["Coefficient", "value", "±", "95 % interval", "unit"];

fn coefficient_row(name: &str, x: &Coefficient) -> Row {
    let rounded = Rounded::of(&Parameter {
        value: x.value,
        std: x.std,
        low95: x.low95,
        high95: x.high95,
        unit: x.unit.clone(),
    });
    let interval = format!("{} … {}", rounded.low95, rounded.high95);
    let value = match x.told_by {
        ToldBy::Limit => format!("{} (not above zero)", rounded.value),
        ToldBy::Stated => format!("{} (stated)", rounded.value),
        ToldBy::Data | ToldBy::Nothing => rounded.value,
    };
    Row::new([name.to_owned(), value, rounded.std, interval, x.unit.clone()])
}

/// Returns the dimensionless coefficients.
fn prime(plant: &PlantResult) -> Option<Table> {
    let system = plant.nondimensional.as_ref()?;
    let row = |(name, x): (&String, &PrimeCoefficient)| {
        let rounded = Rounded::of(&Parameter {
            value: x.value,
            std: x.std,
            low95: x.low95,
            high95: x.high95,
            unit: String::new(),
        });
        let interval = format!("{} … {}", rounded.low95, rounded.high95);
        Row::new([x.symbol.clone(), rounded.value, rounded.std, interval, name.clone()])
    };
    let note = format!(
        "Forces are divided by ½ρLTU², moments by ½ρL²TU², masses by ½ρL²T, rates by U/L: L = {} m, T = {} m{}, ρ = {} kg/m³, U = {} m/s, the mean speed of the fitted trials, on which coefficients of second degree do not depend. Derivatives have the sign of forces on the vehicle. The Coriolis forces of the whole mass matrix come on top of these: tables without Coriolis forces in yaw have Munk’s moment in N'_v.",
        significant(system.length_m, 4),
        significant(system.depth_m, 4),
        if system.depth_m == system.length_m { " (no draught is stated)" } else { "" },
        significant(system.density_kg_m3, 4),
        significant(system.speed_m_s, 3),
    );
    let head = ["Symbol", "value", "±", "95 % interval", "coefficient"];
    let rows: Vec<Row> = system.coefficients.iter().map(row).collect();
    Some(Table::new("Coefficients without dimension", head, rows).noted(&note))
}

/// Returns what each thruster gives, as far as the trials determine it.
fn thrusters(plant: &PlantResult) -> Option<Table> {
    let with_std = |x: Option<&Parameter>| {
        x.map_or([ABSENT.to_owned(), ABSENT.to_owned()], |x| {
            let Rounded { value, low95, high95, .. } = Rounded::of(x);
            [value, format!("{low95} to {high95}")]
        })
    };
    let row = |(name, own): (&String, &ThrusterEstimate)| {
        let columns = [Some(&own.gain), own.reverse.as_ref(), own.of_curve.as_ref()].map(with_std);
        let is_fitted = if own.is_fitted { "yes" } else { "no" };
        let cells = std::iter::once(name.clone()).chain(columns.into_iter().flatten());
        Row::new(cells.chain([is_fitted.to_owned()])).strong_if(own.is_fitted)
    };
    let rows: Vec<Row> = plant.thruster_estimates.iter().map(row).collect();
    let head = [
        "Thruster",
        "beside most",
        "95 %",
        "in reverse",
        "95 %",
        "of its curve",
        "95 %",
        "in the plant",
    ];
    (!rows.is_empty()).then(|| {
        Table::new("Thrust over that of the curve", head, rows).noted("Beside most: where most other thrusters give what their curves say; in reverse where that is another. Of its curve: with the scale of all thrust, where known forces reveal it. A gain that is not in the plant is what the trials say of it to first order; they do not ask for it.")
    })
}

fn coefficients(plant: &PlantResult) -> Table {
    let inflation = plant.identifiability.as_ref().map(|told| &told.variance_inflation);
    let row = |(name, x): (&String, &Coefficient)| {
        let mut row = coefficient_row(name, x);
        row.cells.push(or_absent(inflation.and_then(|all| all.get(name).copied()), 2));
        row
    };
    let head = COEFFICIENT_HEAD.into_iter().chain(["variance inflation"]);
    Table::new("Every coefficient", head, plant.parameters.iter().map(row).collect()).noted(
        "Variance inflation is the factor by which correlation with the others raises a coefficient’s variance; above 100 they are hardly separable.",
    )
}

fn nuisances(nuisances: &BTreeMap<String, Parameter>) -> Table {
    let row = |(name, x): (&String, &Parameter)| {
        let rounded = Rounded::of(x);
        Row::new([name.clone(), rounded.value, rounded.std, x.unit.clone()])
    };
    let head = ["Beside the plant", "value", "±", "unit"];
    Table::new("Currents, disturbances and noise", head, nuisances.iter().map(row).collect())
}

fn structure(plant: &PlantResult) -> Option<Table> {
    let row = |decision: &seaplant::results::TermDecision| {
        let verdict = if decision.admitted { "kept" } else { "left out" };
        Row::new([
            decision.candidate.clone(),
            verdict.to_owned(),
            significant(decision.likelihood_ratio, 3),
            or_absent(decision.p_value, 2),
        ])
    };
    (!plant.structure.is_empty()).then(|| {
        let head = ["Terms", "", "likelihood ratio", "by chance"];
        Table::new(
            "Couplings and laws of thrust tried",
            head,
            plant.structure.iter().map(row).collect(),
        )
        .left(2)
    })
}

/// Correlation above which coefficients are listed together.
const SHOWN_CORRELATION: f64 = 0.7;

fn correlation(plant: &PlantResult) -> Table {
    let names = &plant.correlation.names;
    let mut pairs = Vec::new();
    for (i, row) in plant.correlation.value.iter().enumerate() {
        for (j, r) in row.iter().enumerate().take(i) {
            if r.abs() > SHOWN_CORRELATION {
                pairs.push((
                    r.abs(),
                    Row::new([names[j].clone(), names[i].clone(), significant(*r, 2)]),
                ));
            }
        }
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    let rows = pairs.into_iter().map(|(_, row)| row).collect();
    Table::new("Correlated coefficients", ["First", "second", "correlation"], rows)
        .left(2)
        .noted("All correlations are in results.json.")
}

#[cfg(test)]
mod tests {
    use super::is_plain_damping;

    #[test]
    fn damping_in_a_matrix_is_distinguished_from_other_products() {
        let plain = ["surge: u", "sway: |r|r", "yaw: |v|v"];
        assert!(plain.iter().all(|name| is_plain_damping(name)));
        let others = ["yaw: |v|r", "sway: ur", "heave: 1", "lever.z", "surge: uuu", "yaw: |r|"];
        assert!(!others.iter().any(|name| is_plain_damping(name)));
    }
}
