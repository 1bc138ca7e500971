//! Provenance of the results.

use seaplant::results::Results;
use serde::Serialize;

use super::table::{Row, Table};
use crate::number::{count, significant};

#[derive(Serialize)]
pub(crate) struct Provenance {
    version: String,
    schema: String,
    command: String,
    seed: Option<u64>,
    inputs: Table,
    settings: Table,
}

pub(crate) fn view(results: &Results) -> Provenance {
    let provenance = &results.provenance;
    let inputs = provenance
        .inputs
        .iter()
        .map(|file| Row::new([file.path.clone(), count(file.bytes), file.sha256.clone()]));
    let settings = provenance.settings.iter().map(|(name, value)| Row::new([name, value]));
    Provenance {
        version: results.version.clone(),
        schema: results.schema.clone(),
        command: provenance.command.clone(),
        seed: provenance.seed,
        inputs: Table::new("Files that were read", ["File", "Bytes", "SHA-256"], inputs.collect()),
        settings: Table::new("Settings in force", ["Setting", "Value"], settings.collect()).left(2),
    }
}

/// Returns the line below the title.
pub(crate) fn line(results: &Results) -> String {
    let counted = |n: usize, one: &str| match n {
        1 => format!("1 {one}"),
        n => format!("{n} {one}s"),
    };
    let mut parts = vec![
        counted(results.trials.len(), "trial"),
        counted(results.provenance.inputs.len(), "input file"),
        format!("Seaplant {}", results.version),
    ];
    if let Some(mass) = results.dry_mass_kg {
        parts.insert(0, format!("{} kg in air", significant(mass, 4)));
    }
    if let Some(seed) = results.provenance.seed {
        parts.push(format!("seed {seed}"));
    }
    parts.join(" · ")
}
