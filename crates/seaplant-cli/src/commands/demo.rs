use std::collections::BTreeMap;
use std::process::ExitCode;

use anyhow::Result;
use seaplant::results::TruePlant;
use seaplant::twin::{Disturbance, TwinSpec, make};
use seaplant_campaign::Campaign;

use super::identify::{exit_code, finish, quoted};
use crate::args::Demo;
use crate::output::Output;
use crate::progress::fitting;
use crate::writing::{Made, Permit, Target};

pub fn run(arguments: &Demo, output: Output) -> Result<ExitCode> {
    let spec = TwinSpec {
        seed: arguments.seed,
        disturbances: Disturbance::parse_list(&arguments.disturbances)?,
        ..TwinSpec::jason2()
    };
    let twin = make(&spec)?;
    let permit = Permit::of(&[], arguments.force);
    let target = Target { folder: &arguments.out, made: Some(Made::Report), permit };
    target.check(&["results.json", "report.html"])?;
    super::twin::write(&twin, &arguments.out, permit)?;
    let campaign = Campaign::open(&arguments.out.join("campaign.toml"))?;
    let mut found =
        fitting(output, |watch| campaign.identify_watched(&command_line(arguments), watch));
    found.results.provenance.seed = Some(spec.seed);
    found.results.truth = Some(truth(&spec));
    finish(&found, &campaign.trials, &target, output)?;
    Ok(exit_code(&found.results))
}

fn truth(spec: &TwinSpec) -> BTreeMap<seaplant::Dof, TruePlant> {
    let plant = |plant: &seaplant::twin::TwinPlant| TruePlant {
        mass: plant.mass,
        quadratic_drag: plant.d_quadratic,
        linear_drag: plant.d_linear,
        bias_force: plant.bias_force,
    };
    spec.plants.iter().map(|(dof, of)| (*dof, plant(of))).collect()
}

fn command_line(arguments: &Demo) -> String {
    format!(
        "seaplant demo --seed {} --disturbances {} --out {}",
        arguments.seed,
        arguments.disturbances,
        quoted(&arguments.out)
    )
}
