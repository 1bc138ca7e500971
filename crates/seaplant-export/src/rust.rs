//! One module in Rust, with no dependency.

use seaplant::exchange::PlantModel;

use crate::code::{Syntax, block, bracket, names, number, own};
use crate::remarks::commented;
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
        "one Rust module without dependencies: derivative, RK4 step"
    }

    fn files(&self, model: &PlantModel) -> Result<Exported, Error> {
        let remarks = c::remarks_of_wrench(model, "rust", "c");
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
        ];
        let bytes = fill(include_str!("templates/plant.rs.txt"), &places).into_bytes();
        let path = "seaplant_plant.rs".to_owned();
        Ok(Exported { files: vec![ExportedFile { path, bytes }], notes: remarks.notes() })
    }
}
