//! Writes modelDescription.xml and the other descriptions of the FMU.

use std::fmt::Write;

use seaplant::exchange::PlantModel;
use sha2::{Digest, Sha256};

use super::IDENTIFIER;
use super::variables::{Kind, Variable, Variables};
use crate::code::number;
use crate::gazebo::{escaped, xml_comment};
use crate::remarks::Remarks;

/// Returns the instantiation token, a hash of the model's equation and numbers.
pub(super) fn token(header: &str) -> String {
    let hash = Sha256::digest(header.as_bytes());
    let text: String = hash.iter().take(16).map(|byte| format!("{byte:02x}")).collect();
    format!("{{{text}}}")
}

const UNITS: &str = "  <UnitDefinitions>
    <Unit name=\"s\"><BaseUnit s=\"1\"/></Unit>
    <Unit name=\"m\"><BaseUnit m=\"1\"/></Unit>
    <Unit name=\"rad\"><BaseUnit rad=\"1\"/></Unit>
    <Unit name=\"m/s\"><BaseUnit m=\"1\" s=\"-1\"/></Unit>
    <Unit name=\"rad/s\"><BaseUnit rad=\"1\" s=\"-1\"/></Unit>
    <Unit name=\"N\"><BaseUnit kg=\"1\" m=\"1\" s=\"-2\"/></Unit>
    <Unit name=\"N.m\"><BaseUnit kg=\"1\" m=\"2\" s=\"-2\"/></Unit>
    <Unit name=\"V\"><BaseUnit kg=\"1\" m=\"2\" s=\"-3\" A=\"-1\"/></Unit>
  </UnitDefinitions>
";

pub(super) fn description(
    model: &PlantModel,
    remarks: &Remarks<'_>,
    variables: &Variables,
    token: &str,
) -> String {
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{}<fmiModelDescription fmiVersion=\"3.0\" modelName=\"{}\" instantiationToken=\"{token}\" description=\"Plant model of a marine vehicle\" generationTool=\"Seaplant {}\" variableNamingConvention=\"flat\">\n",
        xml_comment(&remarks.lines()),
        escaped(&model.name),
        env!("CARGO_PKG_VERSION")
    );
    let _ = writeln!(
        text,
        "  <CoSimulation modelIdentifier=\"{IDENTIFIER}\" canHandleVariableCommunicationStepSize=\"true\" canGetAndSetFMUState=\"true\"/>"
    );
    text += UNITS;
    text += "  <DefaultExperiment startTime=\"0\" stopTime=\"60\" stepSize=\"0.1\"/>\n  <ModelVariables>\n";
    for (k, of) in variables.all.iter().enumerate() {
        let _ = writeln!(text, "    {}", variable(k, of));
    }
    text += "  </ModelVariables>\n  <ModelStructure>\n";
    let outputs =
        || (variables.output..variables.all.len()).map(|k| format!("valueReference=\"{k}\""));
    for output in outputs() {
        let _ = writeln!(text, "    <Output {output}/>");
    }
    for output in outputs() {
        let _ = writeln!(text, "    <InitialUnknown {output}/>");
    }
    text + "  </ModelStructure>\n</fmiModelDescription>\n"
}

fn variable(k: usize, of: &Variable) -> String {
    let unit = if of.unit.is_empty() { String::new() } else { format!(" unit=\"{}\"", of.unit) };
    let start = format!(" start=\"{}\"", number(of.start));
    let kind = match of.kind {
        Kind::Time => "causality=\"independent\" variability=\"continuous\"".to_owned(),
        Kind::Input => format!("causality=\"input\" variability=\"continuous\"{start}"),
        Kind::Tunable => format!("causality=\"parameter\" variability=\"tunable\"{start}"),
        Kind::Fixed => format!("causality=\"parameter\" variability=\"fixed\"{start}"),
        Kind::Output => {
            "causality=\"output\" variability=\"continuous\" initial=\"calculated\"".to_owned()
        }
    };
    format!(
        "<Float64 name=\"{}\" valueReference=\"{k}\" description=\"{}\" {kind}{unit}/>",
        of.name,
        escaped(&of.about)
    )
}

pub(super) fn build() -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiBuildDescription fmiVersion=\"3.0\">\n  <BuildConfiguration modelIdentifier=\"{IDENTIFIER}\">\n    <SourceFileSet language=\"C99\">\n      <SourceFile name=\"seaplant_fmu.c\"/>\n    </SourceFileSet>\n  </BuildConfiguration>\n</fmiBuildDescription>\n"
    )
}

pub(super) fn page(remarks: &Remarks<'_>) -> String {
    let lines: String = remarks.lines().iter().map(|line| escaped(line) + "\n").collect();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Plant model</title></head><body><pre>\n{lines}</pre></body></html>\n"
    )
}
