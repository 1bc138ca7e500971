//! Writes a co-simulation FMU of FMI 3.0: with sources, and with a binary where there is a C
//! compiler.

mod description;
mod variables;

use std::io::{Cursor, Write};
use std::process::Command;

use seaplant::exchange::PlantModel;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use crate::remarks::Remarks;
use crate::template::fill;
use crate::{Error, Exported, ExportedFile, Exporter, c};
use variables::Variables;

pub(crate) struct Fmu;

/// Model identifier.
const IDENTIFIER: &str = "seaplant_plant";

impl Exporter for Fmu {
    fn name(&self) -> &'static str {
        "fmu"
    }

    fn about(&self) -> &'static str {
        "a co-simulation FMU (FMI 3.0), compiled if there is a C compiler, with its sources"
    }

    fn files(&self, model: &PlantModel) -> Result<Exported, Error> {
        let mut remarks = c::remarks(model, "fmu");
        let variables = Variables::from_model(model);
        let header = c::header(model, &remarks);
        let binary = compiled(&source(&variables, "0"), &header);
        match &binary {
            Ok((platform, _)) => remarks.limits.push(format!(
                "the binary inside is for {platform}; other systems compile the sources inside (fmpy compile)"
            )),
            Err(reason) => remarks.limits.push(format!(
                "no binary inside, for {reason}; compile the sources inside (fmpy compile)"
            )),
        }
        let bytes = archive(model, &remarks, &variables, binary.is_ok())?;
        let path = "seaplant_plant.fmu".to_owned();
        Ok(Exported { files: vec![ExportedFile { path, bytes }], notes: remarks.notes() })
    }
}

/// Returns the FMU as a zip archive, which is reproducible except for the compiler's output.
fn archive(
    model: &PlantModel,
    remarks: &Remarks<'_>,
    variables: &Variables,
    is_compiled: bool,
) -> Result<Vec<u8>, Error> {
    let header = c::header(model, remarks);
    let token = description::token(&header);
    let source = source(variables, &token);
    let description = description::description(model, remarks, variables, &token);
    let mut files = vec![
        ("modelDescription.xml".to_owned(), description.into_bytes()),
        ("sources/buildDescription.xml".to_owned(), description::build().into_bytes()),
        ("sources/seaplant_fmu.c".to_owned(), source.clone().into_bytes()),
        ("sources/seaplant_plant.h".to_owned(), header.clone().into_bytes()),
        ("documentation/index.html".to_owned(), description::page(remarks).into_bytes()),
    ];
    if is_compiled {
        let (platform, bytes) =
            compiled(&source, &header).map_err(|reason| Error::Write { reason })?;
        files.push((format!("binaries/{platform}/{IDENTIFIER}{}", ending()), bytes));
    }
    let write = || -> Result<Vec<u8>, Box<dyn std::error::Error>> {
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        let options = SimpleFileOptions::default();
        for (path, bytes) in &files {
            zip.start_file(path.as_str(), options)?;
            zip.write_all(bytes)?;
        }
        Ok(zip.finish()?.into_inner())
    };
    write().map_err(|error| Error::Write { reason: error.to_string() })
}

fn source(variables: &Variables, token: &str) -> String {
    let places = [
        ("TOKEN", token.to_owned()),
        ("COUNT", variables.all.len().to_string()),
        ("STARTS", variables.starts()),
        ("KINDS", variables.kinds()),
        ("TAU", variables.tau()),
        ("CURRENT", variables.current.to_string()),
        ("START", variables.start.to_string()),
        ("THETA", variables.theta.to_string()),
        ("OUTPUT", variables.output.to_string()),
        ("THRUSTERS", thrusters(variables)),
        (
            "ACTUATORS",
            variables
                .thrusters
                .map_or_else(String::new, |_| "    seaplant_actuators actuators;\n".to_owned()),
        ),
        (
            "BEGIN_ACTUATORS",
            variables.thrusters.map_or_else(String::new, |(first, _)| {
                format!("    seaplant_actuators_begin(&fmu->actuators, &fmu->value[{first}]);\n")
            }),
        ),
    ];
    fill(include_str!("templates/fmu.c"), &places)
}

/// Adds the wrench of thrusters to the one that comes in.
fn thrusters(variables: &Variables) -> String {
    let Some((first, voltage)) = variables.thrusters else { return String::new() };
    let supply = voltage.map_or("0.0".to_owned(), |at| format!("fmu->value[{at}]"));
    format!(
        "    {{\n        double wrench[6];\n        seaplant_actuate(&fmu->actuators, &fmu->value[{first}], {supply}, h, wrench);\n        for (k = 0; k < 6; ++k)\n            tau[k] += wrench[k];\n    }}\n"
    )
}

/// Returns FMI's name of this platform, if it has one.
fn platform() -> Option<String> {
    let system = match std::env::consts::OS {
        "linux" => "linux",
        "macos" => "darwin",
        "windows" => "windows",
        _ => return None,
    };
    let processor = match std::env::consts::ARCH {
        known @ ("x86_64" | "aarch64" | "x86") => known,
        _ => return None,
    };
    Some(format!("{processor}-{system}"))
}

const fn ending() -> &'static str {
    if cfg!(target_os = "windows") {
        ".dll"
    } else if cfg!(target_os = "macos") {
        ".dylib"
    } else {
        ".so"
    }
}

/// Compiles with the C compiler in `CC`, or `cc`, and returns the platform and the binary, or else
/// the reason for their absence.
fn compiled(source: &str, header: &str) -> Result<(String, Vec<u8>), String> {
    let platform = platform().ok_or("FMI has no name for this system")?;
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("seaplant_fmu.c"), source).map_err(|error| error.to_string())?;
    std::fs::write(at("seaplant_plant.h"), header).map_err(|error| error.to_string())?;
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".to_owned());
    let run = Command::new(&compiler)
        .args(["-std=c99", "-O2", "-fPIC", "-shared", "-o", "model", "seaplant_fmu.c", "-lm"])
        .current_dir(folder.path())
        .output()
        .map_err(|_| format!("there is no C compiler `{compiler}`"))?;
    if !run.status.success() {
        let message = String::from_utf8_lossy(&run.stderr);
        let first = message.lines().next().unwrap_or("it says nothing").to_owned();
        return Err(format!("the C compiler `{compiler}` failed: {first}"));
    }
    let bytes = std::fs::read(at("model")).map_err(|error| error.to_string())?;
    Ok((platform, bytes))
}
