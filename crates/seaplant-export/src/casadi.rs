//! A module for CasADi, ready for acados.

use seaplant::exchange::PlantModel;

use crate::code::{Syntax, axes, block, bracket, numbers};
use crate::python::name_list;
use crate::remarks::commented;
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
        "one Python module with an SX function f(x, u, p) and a model for acados"
    }

    fn files(&self, model: &PlantModel) -> Result<Exported, Error> {
        let remarks = c::remarks_of_wrench(model, "casadi", "python");
        let places = [
            ("REMARKS", commented(&remarks.lines(), "#").trim_end().to_owned()),
            ("NAMES", name_list(model)),
            ("THETA", numbers(model.plant.coefficients().iter().copied())),
            ("AXES", axes(model).iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
            ("MASS", block(&SYNTAX.mass(model, "mass"), "    ")),
            ("FORCES", block(&SYNTAX.forces(model), "    ")),
        ];
        let bytes = fill(include_str!("templates/casadi.py"), &places).into_bytes();
        let path = "seaplant_casadi.py".to_owned();
        Ok(Exported { files: vec![ExportedFile { path, bytes }], notes: remarks.notes() })
    }
}
