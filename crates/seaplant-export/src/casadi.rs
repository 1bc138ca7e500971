//! A module for CasADi, ready for acados.

use seaplant::exchange::PlantModel;
use seaplant::{ThrustCurve, ThrustTable, Thruster};

use crate::code::{Syntax, axes, block, bracket, input_of, number, numbers};
use crate::python::name_list;
use crate::remarks::{commented, harmless};
use crate::template::fill;
use crate::{Error, Exported, ExportedFile, Exporter, c};

pub(crate) struct Casadi;

const SYNTAX: Syntax = Syntax {
    element: bracket,
    modulus: |x| format!("ca.fabs({x})"),
    root: |x| format!("ca.sqrt({x})"),
    entry: |name, i, j| format!("{name}[{i}, {j}]"),
    add: |place, value| format!("{place} += {value}"),
    set: |place, value| format!("{place} = {value}"),
};

impl Exporter for Casadi {
    fn name(&self) -> &'static str {
        "casadi"
    }

    fn about(&self) -> &'static str {
        "one Python module with SX functions f(x, u, p), thrusters with lag, and a model for acados"
    }

    fn files(&self, model: &PlantModel) -> Result<Exported, Error> {
        let remarks = c::remarks(model, "casadi");
        let places = [
            ("REMARKS", commented(&remarks.lines(), "#").trim_end().to_owned()),
            ("NAMES", name_list(model)),
            ("THETA", numbers(model.plant.coefficients().iter().copied())),
            ("AXES", axes(model).iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
            ("MASS", block(&SYNTAX.mass(model, "mass"), "    ")),
            ("FORCES", block(&SYNTAX.forces(model), "    ")),
            ("HELD", block(&SYNTAX.held(model), "    ")),
            ("ACTUATORS", actuators(model)),
        ];
        let text = fill(include_str!("templates/casadi.py"), &places);
        let bytes = (text.trim_end().to_owned() + "\n").into_bytes();
        let path = "seaplant_casadi.py".to_owned();
        Ok(Exported { files: vec![ExportedFile { path, bytes }], notes: remarks.notes() })
    }
}

/// Thrust curves and what stands behind them as expressions; nothing of a plant without thrusters.
fn actuators(model: &PlantModel) -> String {
    if model.thrusters.is_empty() {
        return String::new();
    }
    let of = |line: &dyn Fn(&Thruster) -> String| model.thrusters.iter().map(line).collect();
    let name = |thruster: &Thruster| {
        let name = harmless(&thruster.name).replace('"', "'");
        format!("    \"{name}\",  # input {}\n", input_of(&thruster.curve))
    };
    let row = |thruster: &Thruster| format!("        [{}],\n", numbers(thruster.unit_wrench()));
    let law = |thruster: &Thruster| format!("    lambda x, volts: {},\n", curve(&thruster.curve));
    let fitted = c::fitted(model);
    let places = [
        ("THRUSTERS", of(&name)),
        ("ALLOCATION", of(&row)),
        ("NEUTRAL", numbers(model.thrusters.iter().map(|thruster| thruster.curve.neutral()))),
        ("LAG", numbers(fitted.lag_s)),
        ("FORCE_LAG", numbers(fitted.force_lag_s)),
        ("DELAY", numbers(fitted.delay_s)),
        ("RATIO", numbers(fitted.reverse_ratio)),
        ("CURVES", of(&law)),
    ];
    fill(include_str!("templates/casadi_actuators.py"), &places)
}

fn curve(curve: &ThrustCurve) -> String {
    match curve {
        ThrustCurve::Quadratic { law, .. } => {
            let law = numbers([law.forward, law.reverse, law.deadband, law.neutral]);
            format!("quadratic({law}, x)")
        }
        ThrustCurve::Table { tables, .. } => {
            let of = |table: &ThrustTable| {
                let (inputs, forces): (Vec<f64>, Vec<f64>) = table.points().unzip();
                format!("interpolated(x, [{}], [{}])", numbers(inputs), numbers(forces))
            };
            if tables.len() == 1 {
                return of(&tables[0]);
            }
            let volts = tables.iter().map(|table| number(table.voltage.unwrap_or(0.0)));
            let volts = volts.collect::<Vec<_>>().join(", ");
            let all = tables.iter().map(of).collect::<Vec<_>>().join(", ");
            format!("interpolated(volts, [{volts}], [{all}])")
        }
    }
}
