//! A module for NumPy.

use seaplant::exchange::PlantModel;
use seaplant::{ThrustCurve, ThrustTable};

use crate::code::{Syntax, block, bracket, input_of, names, number, numbers, own};
use crate::remarks::{Remarks, commented, harmless};
use crate::template::fill;
use crate::{Error, Exported, ExportedFile, Exporter, c};

pub(crate) struct Python;

const SYNTAX: Syntax = Syntax {
    element: bracket,
    modulus: |x| format!("abs({x})"),
    entry: |name, i, j| format!("{name}[{i}, {j}]"),
    add: |place, value| format!("{place} += {value}"),
    set: |place, value| format!("{place} = {value}"),
};

impl Exporter for Python {
    fn name(&self) -> &'static str {
        "python"
    }

    fn about(&self) -> &'static str {
        "one NumPy module: derivative, step, draws of the coefficients, thrusters"
    }

    fn files(&self, model: &PlantModel) -> Result<Exported, Error> {
        let remarks = c::remarks(model, "python");
        let bytes = module(model, &remarks).into_bytes();
        let path = "seaplant_plant.py".to_owned();
        Ok(Exported { files: vec![ExportedFile { path, bytes }], notes: remarks.notes() })
    }
}

fn module(model: &PlantModel, remarks: &Remarks<'_>) -> String {
    let places = [
        ("REMARKS", commented(&remarks.lines(), "#").trim_end().to_owned()),
        ("NAMES", name_list(model)),
        ("THETA", numbers(model.plant.coefficients().iter().copied())),
        ("COVARIANCE", covariance(model)),
        ("OWN", own(model).map(|x| x.to_string()).join(", ")),
        ("MASS", block(&SYNTAX.mass(model, "mass"), "    ")),
        ("FORCES", block(&SYNTAX.forces(model), "    ")),
        ("ACTUATORS", actuators(model)),
    ];
    fill(include_str!("templates/plant.py"), &places).trim_end().to_owned() + "\n"
}

/// The names of coefficients as a list of Python.
pub(crate) fn name_list(model: &PlantModel) -> String {
    let quoted: Vec<String> = names(model).iter().map(|name| format!("\"{name}\"")).collect();
    format!("[{}]", quoted.join(", "))
}

fn covariance(model: &PlantModel) -> String {
    let Some(covariance) = &model.covariance else { return "None".to_owned() };
    let rows = covariance.row_iter();
    let rows = rows.map(|row| format!("        [{}],\n", numbers(row.iter().copied())));
    format!("np.array(\n    [\n{}    ]\n)", rows.collect::<String>())
}

fn actuators(model: &PlantModel) -> String {
    if model.thrusters.is_empty() {
        return String::new();
    }
    let mut text = "\n\nTHRUSTERS = [\n".to_owned();
    for thruster in &model.thrusters {
        let name = harmless(&thruster.name).replace('"', "'");
        text += &format!("    \"{name}\",  # input {}\n", input_of(&thruster.curve));
    }
    text += "]\n\nALLOCATION = np.array(\n    [\n";
    for thruster in &model.thrusters {
        text += &format!("        [{}],\n", numbers(thruster.unit_wrench()));
    }
    text += "    ]\n)\n\"\"\"The wrench of one newton of each thruster, a row each.\"\"\"\n";
    text += QUADRATIC;
    text += "\n\nCURVES = [\n";
    for thruster in &model.thrusters {
        text += &format!("    lambda x, volts: {},\n", curve(&thruster.curve));
    }
    text + "]\n" + WRENCH
}

const QUADRATIC: &str = "

def quadratic(forward, reverse, deadband, neutral, x):
    s = max(0.0, abs(x - neutral) - deadband)
    return -reverse * s * s if x < neutral else forward * s * s
";

const WRENCH: &str = "

def wrench(inputs, supply_v=None):
    \"\"\"tau (6,) of all thrusters from their inputs, without lag and delay.\"\"\"
    thrust = np.array([curve(x, supply_v) for curve, x in zip(CURVES, inputs, strict=True)])
    return thrust @ ALLOCATION
";

fn curve(curve: &ThrustCurve) -> String {
    match curve {
        ThrustCurve::Quadratic { law, .. } => {
            let law = numbers([law.forward, law.reverse, law.deadband, law.neutral]);
            format!("quadratic({law}, x)")
        }
        ThrustCurve::Table { tables, .. } => {
            let of = |table: &ThrustTable| {
                let (inputs, forces): (Vec<f64>, Vec<f64>) = table.points().unzip();
                format!("np.interp(x, [{}], [{}])", numbers(inputs), numbers(forces))
            };
            if tables.len() == 1 {
                return of(&tables[0]);
            }
            let volts = tables.iter().map(|table| number(table.voltage.unwrap_or(0.0)));
            let volts = volts.collect::<Vec<_>>().join(", ");
            let all = tables.iter().map(of).collect::<Vec<_>>().join(", ");
            format!("np.interp(volts, [{volts}], [{all}])")
        }
    }
}
