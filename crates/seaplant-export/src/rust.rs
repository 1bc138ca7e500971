//! One module in Rust, with no dependency.

use seaplant::exchange::PlantModel;
use seaplant::{ThrustCurve, ThrustTable};

use crate::code::{Syntax, block, bracket, input_of, names, number, numbers, own};
use crate::remarks::{commented, harmless};
use crate::template::fill;
use crate::{Error, Exported, ExportedFile, Exporter, c};

pub(crate) struct Rust;

const SYNTAX: Syntax = Syntax {
    element: bracket,
    modulus: |x| format!("{x}.abs()"),
    root: |x| format!("({x}).sqrt()"),
    entry: |name, i, j| format!("{name}[{i}][{j}]"),
    add: |place, value| format!("{place} += {value};"),
    set: |place, value| format!("{place} = {value};"),
};

impl Exporter for Rust {
    fn name(&self) -> &'static str {
        "rust"
    }

    fn about(&self) -> &'static str {
        "one Rust module without dependencies: derivative, RK4 step, thrusters with lag and delay"
    }

    fn files(&self, model: &PlantModel) -> Result<Exported, Error> {
        let remarks = c::remarks(model, "rust");
        let theta: String = model
            .plant
            .coefficients()
            .iter()
            .zip(names(model))
            .map(|(value, name)| format!("    {}, // {name}\n", number(*value)))
            .collect();
        let places = [
            ("REMARKS", commented(&remarks.lines(), "//").trim_end().to_owned()),
            ("COUNT", model.plant.coefficients().len().to_string()),
            ("THETA", theta),
            ("OWN", own(model).map(|x| (x == 1).to_string()).join(", ")),
            ("MASS", block(&SYNTAX.mass(model, "mass"), "    ")),
            ("FORCES", block(&SYNTAX.forces(model), "    ")),
            ("HELD", block(&SYNTAX.held(model), "    ")),
            ("ACTUATORS", actuators(model)),
        ];
        let text = fill(include_str!("templates/plant.rs.txt"), &places);
        let bytes = (text.trim_end().to_owned() + "\n").into_bytes();
        let path = "seaplant_plant.rs".to_owned();
        Ok(Exported { files: vec![ExportedFile { path, bytes }], notes: remarks.notes() })
    }
}

/// Thrust curves and what stands behind them; nothing of a plant without thrusters.
fn actuators(model: &PlantModel) -> String {
    if model.thrusters.is_empty() {
        return String::new();
    }
    let row = |thruster: &seaplant::Thruster| {
        let (name, input) = (harmless(&thruster.name), input_of(&thruster.curve));
        format!("    [{}], // {name}: input {input}\n", numbers(thruster.unit_wrench()))
    };
    let case = |(k, thruster): (usize, &seaplant::Thruster)| {
        format!("        {k} => {},\n", curve(&thruster.curve))
    };
    let has = |is_so: fn(&ThrustCurve) -> bool| model.thrusters.iter().any(|t| is_so(&t.curve));
    let mut laws = String::new();
    if has(|curve| matches!(curve, ThrustCurve::Quadratic { .. })) {
        laws += QUADRATIC;
    }
    if has(|curve| matches!(curve, ThrustCurve::Table { .. })) {
        laws += INTERPOLATED;
    }
    let fitted = c::fitted(model);
    let places = [
        ("THRUSTERS", model.thrusters.len().to_string()),
        ("ALLOCATION", model.thrusters.iter().map(row).collect()),
        ("NEUTRAL", numbers(model.thrusters.iter().map(|t| t.curve.neutral()))),
        ("LAWS", laws),
        ("CASES", model.thrusters.iter().enumerate().map(case).collect()),
        ("LAG", numbers(fitted.lag_s)),
        ("FORCE_LAG", numbers(fitted.force_lag_s)),
        ("DELAY", numbers(fitted.delay_s)),
        ("RATIO", numbers(fitted.reverse_ratio)),
    ];
    fill(include_str!("templates/actuators.rs.txt"), &places)
}

const QUADRATIC: &str = "
fn quadratic(forward: f64, reverse: f64, deadband: f64, neutral: f64, x: f64) -> f64 {
    let s = ((x - neutral).abs() - deadband).max(0.0);
    if x < neutral { -reverse * s * s } else { forward * s * s }
}
";

const INTERPOLATED: &str = "
fn interpolated(points: &[(f64, f64)], x: f64) -> f64 {
    let after = points.partition_point(|point| point.0 < x);
    if after == 0 {
        return points[0].1;
    }
    if after == points.len() {
        return points[after - 1].1;
    }
    let ((a, low), (b, high)) = (points[after - 1], points[after]);
    low + (x - a) / (b - a) * (high - low)
}
";

fn curve(curve: &ThrustCurve) -> String {
    match curve {
        ThrustCurve::Quadratic { law, .. } => {
            let law = numbers([law.forward, law.reverse, law.deadband, law.neutral]);
            format!("quadratic({law}, input)")
        }
        ThrustCurve::Table { tables, .. } => {
            let of = |table: &ThrustTable| {
                let points: Vec<String> = table
                    .points()
                    .map(|(x, force)| format!("({}, {})", number(x), number(force)))
                    .collect();
                format!("interpolated(&[{}], input)", points.join(", "))
            };
            if tables.len() == 1 {
                return of(&tables[0]);
            }
            let point = |table: &ThrustTable| {
                format!("({}, {})", number(table.voltage.unwrap_or(0.0)), of(table))
            };
            let points: Vec<String> = tables.iter().map(point).collect();
            format!("interpolated(&[{}], supply_v)", points.join(", "))
        }
    }
}
