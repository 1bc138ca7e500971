//! Writes an m-file in the style of MSS, for MATLAB and Octave.

use seaplant::exchange::PlantModel;

use crate::actuators::{CurveSyntax, Fitted, neutral};
use crate::code::{Syntax, axes, block, input_of, names, number, numbers};
use crate::remarks::{commented, harmless};
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

const CURVES: CurveSyntax = CurveSyntax {
    input: "input",
    supply_v: "supply_v",
    list: |all| format!("[{all}]"),
    interpolated: "interpolated",
};

impl Exporter for Octave {
    fn name(&self) -> &'static str {
        "octave"
    }

    fn about(&self) -> &'static str {
        "m-files in MSS style for MATLAB and Octave: the plant, thrusters with lag and delay"
    }

    fn files(&self, model: &PlantModel) -> Result<Exported, Error> {
        let remarks = c::remarks(model, "octave");
        let theta: String = model
            .plant
            .coefficients()
            .iter()
            .zip(names(model))
            .map(|(value, name)| format!("        {}; ... % {name}\n", number(*value)))
            .collect();
        let own = axes(model).iter().map(|k| (k + 1).to_string()).collect::<Vec<_>>().join(" ");
        let comment = commented(&remarks.lines(), "%").trim_end().to_owned();
        let places = [
            ("REMARKS", comment.clone()),
            ("THETA", theta),
            ("AXES", own),
            ("MASS", block(&SYNTAX.mass(model, "M"), "")),
            ("FORCES", block(&SYNTAX.forces(model), "")),
            ("HELD", block(&SYNTAX.held(model), "")),
        ];
        let bytes = fill(include_str!("templates/plant.m"), &places).into_bytes();
        let mut files = vec![ExportedFile { path: "seaplant_plant.m".to_owned(), bytes }];
        if !model.thrusters.is_empty() {
            let bytes = thrusters(model, comment).into_bytes();
            files.push(ExportedFile { path: "seaplant_thrusters.m".to_owned(), bytes });
        }
        Ok(Exported { files, notes: remarks.notes() })
    }
}

/// Returns the thrusters' code, if the plant has thrusters.
fn thrusters(model: &PlantModel, comment: String) -> String {
    let (mut inputs, mut allocation, mut cases) = (String::new(), String::new(), String::new());
    for (k, thruster) in model.thrusters.iter().enumerate() {
        let (k, name) = (k + 1, harmless(&thruster.name));
        inputs += &format!("%   {k}  {name}: {}\n", input_of(&thruster.curve));
        allocation += &format!("    {}; ...\n", numbers(thruster.unit_wrench()));
        cases += &format!("    case {k}, f = {};\n", CURVES.thrust(&thruster.curve));
    }
    let mut places = vec![
        ("REMARKS", comment),
        ("INPUTS", inputs),
        ("ALLOCATION", allocation),
        ("NEUTRAL", neutral(model)),
        ("CASES", cases),
    ];
    places.extend(Fitted::from_model(model).places(["    ", "; ...\n"]));
    fill(include_str!("templates/thrusters.m"), &places)
}
