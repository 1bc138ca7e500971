use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use seaplant_export::{Exported, Permission, export, exporter};
use serde_json::json;

use super::plant::{file_of, read_plant};
use crate::args::Export;
use crate::output::{Output, WARNING};
use crate::writing::{File, Made, Permit, Target};

pub fn run(arguments: &Export, output: Output) -> Result<ExitCode> {
    let model = read_plant(&arguments.plant, arguments.method)?;
    let permission = if arguments.anyway { Permission::Anyway } else { Permission::Checked };
    let Exported { files, notes } = export(exporter(&arguments.to)?, &model, permission)?;
    let files: Vec<File> =
        files.into_iter().map(|file| File { path: file.path, bytes: file.bytes }).collect();
    let inputs = [file_of(&arguments.plant)];
    let permit = Permit::new(&inputs, arguments.force);
    let target = Target { folder: &arguments.out, made: Some(Made::Export), permit };
    target.write(&files)?;
    let paths: Vec<PathBuf> = files.iter().map(|file| arguments.out.join(&file.path)).collect();
    let result = json!({ "format": arguments.to, "files": paths, "notes": notes });
    output.give(&result, || words(&paths, &notes))?;
    Ok(ExitCode::SUCCESS)
}

fn words(paths: &[PathBuf], notes: &[String]) -> String {
    let mut text = String::new();
    for path in paths {
        text += &format!("{}\n", path.display());
    }
    for note in notes {
        text += &format!("{WARNING}note:{WARNING:#} {note}\n");
    }
    text
}
