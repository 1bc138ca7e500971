//! Commands for a vehicle to play back.

use seaplant::ThrusterInput;

use crate::Error;
use crate::drive::{Pilot, drive};
use crate::plan::{Plan, Planned};
use crate::prior::Prior;
use crate::rig::Rig;

/// One revolution a minute, rad/s.
const RPM: f64 = std::f64::consts::PI / 30.0;

/// The inputs of thrusters during a manoeuvre, with neutral ones at its end.
pub(crate) struct Played {
    /// Name and input of each thruster.
    pub(crate) thrusters: Vec<(String, ThrusterInput)>,
    /// Instants, s.
    pub(crate) time_s: Vec<f64>,
    /// The input of each thruster from each instant on, in the unit of its curve.
    pub(crate) inputs: Vec<Vec<f64>>,
}

/// Drives a manoeuvre with the believed plant in still water.
pub(crate) fn played(prior: &Prior, plan: &Plan, planned: &Planned) -> Result<Played, Error> {
    let request = &plan.request;
    let rig = Rig::new(&prior.model, request.limits.thrust_part, request.full_input)?;
    let plant = &prior.model.plant;
    let pilot = Pilot::new(plant, &rig, &request.limits, &planned.manoeuvre);
    let seconds = 60.0 * planned.minutes;
    let driven = drive(plant, &pilot, seconds, None)?;
    let (mut time_s, mut inputs) = (driven.time_s, driven.inputs);
    time_s.push(seconds);
    for (inputs, thruster) in inputs.iter_mut().zip(&rig.thrusters) {
        inputs.push(thruster.curve.neutral());
    }
    let thrusters = rig.thrusters.iter().map(|one| (one.name.clone(), one.curve.input())).collect();
    Ok(Played { thrusters, time_s, inputs })
}

/// Formats the commands of a manoeuvre as CSV: time and the input of every thruster, every 0.1 s,
/// neutral at the end.
///
/// They are those of the prior's plant in still water, including its controller: played back in
/// open loop, a vehicle drifts from them, and its operators must watch the limits. Inputs are in
/// rpm, µs, or from −1 to 1.
///
/// # Errors
/// As [`plan`](crate::plan()), for a prior that is not that of the plan.
pub fn commands_csv(prior: &Prior, plan: &Plan, planned: &Planned) -> Result<String, Error> {
    let played = played(prior, plan, planned)?;
    let mut head = vec!["time [s]".to_owned()];
    let mut factors = Vec::new();
    for (name, input) in &played.thrusters {
        let (unit, factor) = match input {
            ThrusterInput::Speed => ("rpm", 1.0 / RPM),
            ThrusterInput::Pwm => ("us", 1.0),
            ThrusterInput::Command => ("1", 1.0),
            ThrusterInput::Force => ("N", 1.0),
        };
        factors.push(factor);
        head.push(format!("{name} {} [{unit}]", input.name()));
    }
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(&head)?;
    for (row, t) in played.time_s.iter().enumerate() {
        let inputs = played.inputs.iter().zip(&factors);
        let inputs = inputs.map(|(inputs, factor)| format!("{:.4}", inputs[row] * factor));
        table.write_record(std::iter::once(format!("{t:.1}")).chain(inputs))?;
    }
    let bytes = table.into_inner().map_err(|error| csv::Error::from(error.into_error()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
