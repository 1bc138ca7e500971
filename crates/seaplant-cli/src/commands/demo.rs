use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;

use anyhow::Result;
use seaplant::results::TruePlant;
use seaplant::twin::{Disturbance, TwinSpec, VehicleTwinSpec};
use seaplant_campaign::{Campaign, TwinFile};

use super::identify::{exit_code, finish, quoted};
use crate::args::Demo;
use crate::output::Output;
use crate::progress::fitted;
use crate::writing::{Made, Permit, Target};

pub fn run(arguments: &Demo, output: Output) -> Result<ExitCode> {
    let spec = spec(arguments)?;
    let twin = spec.make()?;
    let permit = Permit::new(&[], arguments.force);
    let target = Target { folder: &arguments.out, made: Some(Made::Report), permit };
    target.check(&["results.json", "report.html"])?;
    super::twin::write(&twin, &arguments.out, permit)?;
    let campaign = Campaign::open(&arguments.out.join("campaign.toml"))?;
    let mut found = fitted(output, &campaign, &command_line(arguments));
    found.results.provenance.seed = Some(arguments.seed);
    found.results.truth = match &spec {
        TwinFile::OneAxis(spec) => Some(truth(spec)),
        TwinFile::SeveralAxes(_) => twin.truth.vehicle.map(|vehicle| vehicle.coefficients),
    };
    finish(&found, &campaign.trials, &target, output)?;
    Ok(exit_code(&found.results, &campaign.options.methods))
}

fn spec(arguments: &Demo) -> Result<TwinFile> {
    let disturbances = Disturbance::parse_list(&arguments.disturbances)?;
    let seed = arguments.seed;
    Ok(match &arguments.vehicle {
        None => TwinFile::OneAxis(Box::new(TwinSpec { seed, disturbances, ..TwinSpec::jason2() })),
        Some(vehicle) => TwinFile::SeveralAxes(Box::new(VehicleTwinSpec {
            vehicle: vehicle.clone(),
            seed,
            disturbances,
            ..VehicleTwinSpec::default()
        })),
    })
}

/// Returns the true coefficients by name.
fn truth(spec: &TwinSpec) -> BTreeMap<String, f64> {
    let plant = |plant: &seaplant::twin::TwinPlant| TruePlant {
        mass: plant.mass,
        quadratic_drag: plant.d_quadratic,
        linear_drag: plant.d_linear,
        bias_force: plant.bias_force,
    };
    spec.plants.iter().flat_map(|(dof, of)| plant(of).coefficients(*dof)).collect()
}

fn command_line(arguments: &Demo) -> String {
    let vehicle = arguments.vehicle.as_ref();
    let vehicle = vehicle.map(|vehicle| format!(" --vehicle {}", quoted(Path::new(vehicle))));
    format!(
        "seaplant demo{} --seed {} --disturbances {} --out {}",
        vehicle.unwrap_or_default(),
        arguments.seed,
        arguments.disturbances,
        quoted(&arguments.out)
    )
}
