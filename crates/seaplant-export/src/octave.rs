//! An m-file in the style of MSS, for MATLAB and Octave.

use seaplant::exchange::PlantModel;

use crate::code::{Syntax, axes, block, names, number};
use crate::remarks::commented;
use crate::template::fill;
use crate::{Error, Exported, ExportedFile, Exporter, c};

pub(crate) struct Octave;

fn element(name: &str, k: usize) -> String {
    format!("{name}({})", k + 1)
}

const SYNTAX: Syntax = Syntax {
    element,
    modulus: |x| format!("abs({x})"),
    root: |x| format!("sqrt({x})"),
    entry: |name, i, j| format!("{name}({}, {})", i + 1, j + 1),
    add: |place, value| format!("{place} = {place} + {value};"),
    set: |place, value| format!("{place} = {value};"),
};

impl Exporter for Octave {
    fn name(&self) -> &'static str {
        "octave"
    }

    fn about(&self) -> &'static str {
        "one m-file in MSS style, for MATLAB and Octave"
    }

    fn files(&self, model: &PlantModel) -> Result<Exported, Error> {
        let remarks = c::remarks_of_wrench(model, "octave", "python");
        let theta: String = model
            .plant
            .coefficients()
            .iter()
            .zip(names(model))
            .map(|(value, name)| format!("        {}; ... % {name}\n", number(*value)))
            .collect();
        let own = axes(model).iter().map(|k| (k + 1).to_string()).collect::<Vec<_>>().join(" ");
        let places = [
            ("REMARKS", commented(&remarks.lines(), "%").trim_end().to_owned()),
            ("THETA", theta),
            ("AXES", own),
            ("MASS", block(&SYNTAX.mass(model, "M"), "")),
            ("FORCES", block(&SYNTAX.forces(model), "")),
            ("HELD", block(&SYNTAX.held(model), "")),
        ];
        let bytes = fill(include_str!("templates/plant.m"), &places).into_bytes();
        let path = "seaplant_plant.m".to_owned();
        Ok(Exported { files: vec![ExportedFile { path, bytes }], notes: remarks.notes() })
    }
}
