use std::process::ExitCode;

use seaplant::exchange::PlantFile;
use seaplant_campaign::{CampaignFile, Profile, TwinFile, VehicleFile};
#[cfg(not(target_family = "wasm"))]
use seaplant_plan::{Plan, Request};

use crate::args::{Schema, SchemaKind};
use crate::output::print;

pub fn run(arguments: &Schema) -> anyhow::Result<ExitCode> {
    let schema = match arguments.kind {
        SchemaKind::Results => seaplant_report::results_schema(),
        SchemaKind::Vehicle => schemars::schema_for!(VehicleFile).to_value(),
        SchemaKind::Campaign => schemars::schema_for!(CampaignFile).to_value(),
        SchemaKind::Plant => schemars::schema_for!(PlantFile).to_value(),
        SchemaKind::Profile => schemars::schema_for!(Profile).to_value(),
        #[cfg(not(target_family = "wasm"))]
        SchemaKind::Request => schemars::schema_for!(Request).to_value(),
        #[cfg(not(target_family = "wasm"))]
        SchemaKind::Plan => schemars::schema_for!(Plan).to_value(),
        SchemaKind::Twin => schemars::schema_for!(TwinFile).to_value(),
    };
    print(&serde_json::to_string_pretty(&schema)?)?;
    Ok(ExitCode::SUCCESS)
}
