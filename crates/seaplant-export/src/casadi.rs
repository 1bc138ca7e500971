//! Writes a module for CasADi, ready for acados.

use seaplant::Thruster;
use seaplant::exchange::PlantModel;

use crate::actuators::{CurveSyntax, Fitted, neutral};
use crate::code::{Syntax, axes, block, bracket, input_of, numbers};
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

const CURVES: CurveSyntax = CurveSyntax {
    input: "x",
    supply_v: "volts",
    list: |all| format!("[{all}]"),
    interpolated: "interpolated",
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

/// Returns thrust curves and their dynamics as expressions; empty for a plant without thrusters.
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
    let law =
        |thruster: &Thruster| format!("    lambda x, volts: {},\n", CURVES.thrust(&thruster.curve));
    let mut places = vec![
        ("THRUSTERS", of(&name)),
        ("ALLOCATION", of(&row)),
        ("NEUTRAL", neutral(model)),
        ("CURVES", of(&law)),
    ];
    places.extend(Fitted::from_model(model).places(["        [", "],\n"]));
    fill(include_str!("templates/casadi_actuators.py"), &places)
}
