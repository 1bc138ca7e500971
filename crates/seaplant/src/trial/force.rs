//! From thruster readings to the force along a degree of freedom.

use crate::navigation::Recording;
use crate::{Dof, Error, Quantity, Thruster, ThrusterInput, Timed, Vehicle};

/// How often a thruster was driven beyond its measured curve.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Saturation {
    /// Which.
    pub(super) thruster: String,
    /// In which part of its samples.
    pub(super) part: f64,
}

/// `τ = Σ [d; r × d] F`, held, at the times of all thrusters that act along `dof`;
/// or the wrench where the log has it.
pub(super) fn force_along(
    trial: &str,
    dof: Dof,
    recording: &Recording,
    vehicle: &Vehicle,
    saturated: &mut Vec<Saturation>,
) -> Result<Timed, Error> {
    if let Some(wrench) = recording.get(&Quantity::Wrench(dof)) {
        return Ok(wrench.clone());
    }
    let mut parts = Vec::new();
    for thruster in vehicle.thrusters.iter().filter(|thruster| Vehicle::acts_on(thruster, dof)) {
        let force = thruster_force(trial, thruster, recording, saturated)?;
        parts.push((thruster.unit_wrench()[dof.index()], force));
    }
    let missing = || Error::MissingChannel {
        trial: trial.to_owned(),
        what: format!("thruster that acts in {dof}"),
        advice: format!("give one in vehicle.toml, or map wrench.{dof}"),
    };
    held_sum(&parts)?.ok_or_else(missing)
}

fn thruster_force(
    trial: &str,
    thruster: &Thruster,
    recording: &Recording,
    saturated: &mut Vec<Saturation>,
) -> Result<Timed, Error> {
    let of = |input| Quantity::Thruster { name: thruster.name.clone(), input };
    if let Some(force) = recording.get(&of(ThrusterInput::Force)) {
        return Ok(force.clone());
    }
    let missing = |what: String, advice: String| Error::MissingChannel {
        trial: trial.to_owned(),
        what,
        advice,
    };
    let wanted = of(thruster.curve.input());
    let input = recording.get(&wanted).ok_or_else(|| {
        missing(wanted.to_string(), "map it under [channels]: its curve reads it".to_owned())
    })?;
    let voltage = recording.get(&Quantity::SupplyVoltage);
    if thruster.curve.needs_voltage() && voltage.is_none() {
        let advice = format!(
            "the curve of `{}` depends on it; map it, or keep the table of one voltage",
            thruster.name
        );
        return Err(missing(Quantity::SupplyVoltage.to_string(), advice));
    }
    let (low, high) = thruster.curve.range();
    let beyond = input.values().iter().filter(|x| !(low..=high).contains(*x)).count();
    let part = beyond as f64 / input.len() as f64;
    let known = saturated.iter().any(|known| known.thruster == thruster.name);
    if beyond > 0 && !known {
        saturated.push(Saturation { thruster: thruster.name.clone(), part });
    }
    let forces = input
        .time_s()
        .iter()
        .zip(input.values())
        .map(|(&t, &x)| thruster.curve.force(x, voltage.map(|voltage| voltage.at(t))))
        .collect();
    input.with_values(&thruster.name, forces)
}

/// Σ weight · series of held series, at every time at which one changes.
fn held_sum(parts: &[(f64, Timed)]) -> Result<Option<Timed>, Error> {
    let Some((_, first)) = parts.first() else { return Ok(None) };
    let together = parts.iter().all(|(_, part)| part.time_s() == first.time_s());
    let times: Vec<f64> = if together {
        first.time_s().to_vec()
    } else {
        // Before the last of them starts, the sum is not known.
        let start = parts.iter().map(|(_, part)| part.first_s()).fold(f64::MIN, f64::max);
        let mut times: Vec<f64> = parts
            .iter()
            .flat_map(|(_, part)| part.time_s())
            .copied()
            .filter(|t| *t >= start)
            .collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    };
    let values: Vec<f64> = if together {
        (0..times.len()).map(|k| parts.iter().map(|(w, part)| w * part.values()[k]).sum()).collect()
    } else {
        times.iter().map(|&t| parts.iter().map(|(w, part)| w * part.held_at(t)).sum()).collect()
    };
    Timed::new("force", times, values).map(Some)
}
