//! Tables of the coefficients of a plant.

use seaplant::Dof;
use seaplant::results::{
    Coefficient, MatrixResult, Parameter, PlantResult, PrimeCoefficient, ThrusterEstimate, ToldBy,
};

use super::{Methods, axes_of_kind, of_kind, with_interval};
use crate::number::{ABSENT, Rounded, or_absent, significant};
use crate::page::card::stability;
use crate::page::table::{Row, Table};
use crate::words;

/// Returns mass, drag and bias force of each axis by each method, translations and rotations in
/// tables of their own, for they have other units.
pub(super) fn by_axis(plant: &PlantResult, methods: &Methods<'_>) -> Vec<Table> {
    let table = |is_rotation: bool| {
        let axes = axes_of_kind(plant, is_rotation);
        let first = axes.first()?;
        let units = first.units();
        let head = [
            "Axis".to_owned(),
            "Method".to_owned(),
            format!("{}, {}", words::mass(*first), units.mass),
            format!("d_Q, {}", units.quadratic_drag),
            format!("d_L, {}", units.linear_drag),
            format!("{}, {}", words::bias_force(*first), units.force),
            "Stability".to_owned(),
        ];
        let row = |dof: Dof, (method, plant, is_recommended): (String, &PlantResult, bool)| {
            let p = plant.by_axis.get(&dof)?;
            let row = Row::new([
                words::capitalised(dof.name()),
                method,
                with_interval(Some(&p.mass)),
                with_interval(p.quadratic_drag.as_ref()),
                with_interval(p.linear_drag.as_ref()),
                with_interval(p.bias_force.as_ref()),
                plant
                    .alone
                    .as_ref()
                    .map_or(ABSENT.to_owned(), |alone| stability(dof, &alone.stability)),
            ]);
            Some(row.strong_if(is_recommended))
        };
        let rows = axes.iter().flat_map(|dof| methods.iter().filter_map(|own| row(*dof, own)));
        let caption = "Parameters by method: value ± standard deviation [95 % interval]";
        let caption = of_kind(caption, plant, is_rotation);
        Some(Table::new(&caption, head, rows.collect()).left(2).without_empty_columns())
    };
    [false, true].into_iter().filter_map(table).collect()
}

/// Returns the matrices of a plant of several axes, the coefficients outside them, and those of
/// thrusters.
pub(super) fn tables(plant: &PlantResult) -> Vec<Table> {
    let mut tables = Vec::new();
    if plant.axes.len() > 1 {
        tables.push(matrix("Mass matrix M, rigid body plus added", plant, &plant.mass_matrix).noted(
            "Rows are forces and moments, columns accelerations; kg, kg m and kg m². The matrix is symmetric, and the Coriolis forces follow from it.",
        ));
        tables.extend(plant.added_mass.as_ref().map(|added| {
            let std = plant.mass_matrix.std.clone();
            let added = MatrixResult { value: added.clone(), std };
            matrix("Added mass", plant, &added).noted("M without the dry vehicle.")
        }));
        tables.push(matrix("Linear damping, on ν", plant, &plant.linear_damping));
        tables.push(matrix("Quadratic damping, on |ν|ν", plant, &plant.quadratic_damping));
    }
    tables.extend([others(plant), thrusters(plant), prime(plant)].into_iter().flatten());
    tables
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

/// Returns the coefficients that neither the matrices nor the tables by axis have.
fn others(plant: &PlantResult) -> Option<Table> {
    let is_above =
        |name: &str| name.starts_with("mass.") || name.ends_with(": 1") || is_plain_damping(name);
    let found = plant.parameters.iter().filter(|(name, _)| !is_above(name));
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
        Table::new("Thrust over that of the curve", head, rows).without_empty_columns().noted("Beside most: where most other thrusters give what their curves say; in reverse where that is another. Of its curve: with the scale of all thrust, where known forces reveal it. A gain that is not in the plant is what the trials say of it to first order; they do not ask for it.")
    })
}

pub(super) fn every(plant: &PlantResult) -> Table {
    let inflation = plant.identifiability.as_ref().map(|told| &told.variance_inflation);
    let row = |(name, x): (&String, &Coefficient)| {
        let mut row = coefficient_row(name, x);
        row.cells.push(or_absent(inflation.and_then(|all| all.get(name).copied()), 2));
        row
    };
    let head = COEFFICIENT_HEAD.into_iter().chain(["variance inflation"]);
    Table::new("Every coefficient", head, plant.parameters.iter().map(row).collect()).without_empty_columns().noted(
        "Variance inflation is the factor by which correlation with the others raises a coefficient’s variance; above 100 they are hardly separable.",
    )
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
