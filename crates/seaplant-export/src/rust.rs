//! Writes one module in Rust, with no dependency.

use seaplant::ThrustCurve;
use seaplant::exchange::PlantModel;

use crate::actuators::{CurveSyntax, Fitted, neutral};
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

const CURVES: CurveSyntax = CurveSyntax {
    input: "input",
    supply_v: "supply_v",
    list: |all| format!("&[{all}]"),
    interpolated: "interpolated",
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

/// Returns thrust curves and their dynamics; empty for a plant without thrusters.
fn actuators(model: &PlantModel) -> String {
    if model.thrusters.is_empty() {
        return String::new();
    }
    let row = |thruster: &seaplant::Thruster| {
        let (name, input) = (harmless(&thruster.name), input_of(&thruster.curve));
        format!("    [{}], // {name}: input {input}\n", numbers(thruster.unit_wrench()))
    };
    let case = |(k, thruster): (usize, &seaplant::Thruster)| {
        format!("        {k} => {},\n", CURVES.thrust(&thruster.curve))
    };
    let has = |is_so: fn(&ThrustCurve) -> bool| model.thrusters.iter().any(|t| is_so(&t.curve));
    let mut laws = String::new();
    if has(|curve| matches!(curve, ThrustCurve::Quadratic { .. })) {
        laws += POWER;
    }
    if has(|curve| matches!(curve, ThrustCurve::Table { .. })) {
        laws += INTERPOLATED;
    }
    let mut places = vec![
        ("THRUSTERS", model.thrusters.len().to_string()),
        ("ALLOCATION", model.thrusters.iter().map(row).collect()),
        ("NEUTRAL", neutral(model)),
        ("LAWS", laws),
        ("CASES", model.thrusters.iter().enumerate().map(case).collect()),
    ];
    places.extend(Fitted::from_model(model).places(["    [", "],\n"]));
    fill(include_str!("templates/actuators.rs.txt"), &places)
}

const POWER: &str = "
fn power(forward: f64, reverse: f64, exponent: f64, deadband: f64, neutral: f64, x: f64) -> f64 {
    let s = ((x - neutral).abs() - deadband).max(0.0).powf(exponent);
    if x < neutral { -reverse * s } else { forward * s }
}
";

const INTERPOLATED: &str = "
fn interpolated(x: f64, points: &[f64], values: &[f64]) -> f64 {
    let after = points.partition_point(|point| *point < x);
    if after == 0 {
        return values[0];
    }
    if after == points.len() {
        return values[after - 1];
    }
    let (a, b, low, high) = (points[after - 1], points[after], values[after - 1], values[after]);
    low + (x - a) / (b - a) * (high - low)
}
";
