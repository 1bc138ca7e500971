//! Tables of commands for a vehicle to play back.

use seaplant::ThrusterInput;

use crate::Error;
use crate::drive::{Pilot, drive};
use crate::plan::{Plan, Planned};
use crate::prior::Prior;
use crate::rig::Rig;

/// One revolution a minute, rad/s.
const RPM: f64 = std::f64::consts::PI / 30.0;

/// Formats the commands of a manoeuvre as CSV: time and the input of every thruster, every 0.1 s.
///
/// They are those of the prior's plant in still water, including its controller: played back in
/// open loop, a vehicle drifts from them, and its operators must watch the limits. Inputs are in
/// rpm, µs, or from −1 to 1.
///
/// # Errors
/// As [`plan`](crate::plan()), for a prior that is not that of the plan.
pub fn commands_csv(prior: &Prior, plan: &Plan, planned: &Planned) -> Result<String, Error> {
    let request = &plan.request;
    let rig = Rig::new(&prior.model, request.limits.thrust_part, request.full_input)?;
    let plant = &prior.model.plant;
    let pilot = Pilot::new(plant, &rig, &request.limits, &planned.manoeuvre);
    let driven = drive(plant, &pilot, 60.0 * planned.minutes, None)?;
    let mut head = vec!["time [s]".to_owned()];
    let mut factors = Vec::new();
    for thruster in &rig.thrusters {
        let (unit, factor) = match thruster.curve.input() {
            ThrusterInput::Speed => ("rpm", 1.0 / RPM),
            ThrusterInput::Pwm => ("us", 1.0),
            ThrusterInput::Command => ("1", 1.0),
            ThrusterInput::Force => ("N", 1.0),
        };
        factors.push(factor);
        head.push(format!("{} {} [{unit}]", thruster.name, thruster.curve.input().name()));
    }
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(&head)?;
    for (row, t) in driven.time_s.iter().enumerate() {
        let inputs = driven.inputs.iter().zip(&factors);
        let inputs = inputs.map(|(inputs, factor)| format!("{:.4}", inputs[row] * factor));
        table.write_record(std::iter::once(format!("{t:.1}")).chain(inputs))?;
    }
    let bytes = table.into_inner().map_err(|error| csv::Error::from(error.into_error()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
