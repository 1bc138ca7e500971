//! Thrusters that do not push as their curves and logs say.

use std::collections::BTreeMap;

use crate::estimate::PlantFit;
use crate::plant::{Effect, EffectForce, ThrusterNumber};
use crate::results::{Coefficient, Parameter, PlantResult, ThrusterEstimate, ThrusterGain};
use crate::{Caveat, CaveatCode, Estimate, ThrusterFault};

/// A thruster that gives less than this part of its curve stands still …
const STILL: f64 = 0.2;

/// … and one below this pushes the other way.
const TURNED_ROUND: f64 = -0.5;

/// A loss of this part is more than thrusters of one kind differ by.
const LOSS: f64 = 0.12;

/// So many standard deviations are no chance.
const CLEARLY: f64 = 3.0;

/// What is wrong with single thrusters, and how they differ.
pub(super) fn doubts(plant: &PlantResult) -> Vec<Caveat> {
    let mut all: Vec<Caveat> = plant.thruster_faults.iter().map(of_trial).collect();
    all.extend(plant.thrusters_exchanged.iter().map(exchanged));
    let gains = plant.thruster_gains();
    all.extend(gains.iter().filter_map(|(name, gain)| fault(name, gain)));
    all.extend(differing(plant));
    all.extend(ThrusterNumber::ALL.into_iter().filter_map(|number| own(plant, number)));
    all
}

/// What trials say of each thruster.
pub(super) fn estimates(fit: &PlantFit, plant: &PlantResult) -> BTreeMap<String, ThrusterEstimate> {
    let both = plant.thruster_gains();
    let parameter =
        |value: f64, std: f64| Parameter::new(Estimate::new(value, std, fit.samples as f64), "1");
    let of = |(name, found): (&String, &crate::estimate::GainBeside)| {
        let in_reverse = both.get(name).map_or(0.0, |own| own.reverse - own.forward);
        let reverse = (in_reverse != 0.0).then(|| parameter(found.gain + in_reverse, found.std));
        let (gain, is_fitted) = (parameter(found.gain, found.std), found.is_fitted);
        let of_curve = found.of_curve.map(|[value, std]| parameter(value, std));
        (name.clone(), ThrusterEstimate { gain, reverse, of_curve, is_fitted })
    };
    fit.gains.iter().map(of).collect()
}

fn exchanged([a, b]: &[String; 2]) -> Caveat {
    let message = format!(
        "thrusters `{a}` and `{b}` are exchanged: each does what the log of the other says, and the plant takes it so; exchange their channels in the campaign, or their places in the vehicle file, and identify again"
    );
    Caveat::warning(CaveatCode::ThrusterFault, message)
}

fn of_trial(fault: &ThrusterFault) -> Caveat {
    let ThrusterFault { trial, thruster, gain } = fault;
    let (does, look) = match *gain < 0.0 {
        true => {
            ("pushes the other way than its log says", "its direction or the sign of its channel")
        }
        false => (
            "stands still, while its log says that it pushes",
            "its motor, its propeller and its channel",
        ),
    };
    let message = format!(
        "thruster `{thruster}` {does} in trial `{trial}`, and not in others; the plant takes it so; look at {look}, and leave the trial out if that is not so"
    );
    Caveat::warning(CaveatCode::ThrusterFault, message)
}

/// What is wrong with a thruster in all trials.
fn fault(name: &str, gain: &ThrusterGain) -> Option<Caveat> {
    let ThrusterGain { forward, reverse, std } = *gain;
    let ways = [("", forward, std[0]), (" in reverse", reverse, std[1])];
    // What it does both ways says more than what it does one way.
    let is_both = (forward - reverse).abs() < LOSS;
    let (way, gain, std) =
        ways.into_iter().take(if is_both { 1 } else { 2 }).min_by(|a, b| a.1.total_cmp(&b.1))?;
    let what = match gain {
        _ if gain < TURNED_ROUND => {
            "it pushes the other way: reverse its direction in the vehicle file, or negate its channel, and identify again"
        }
        _ if gain < STILL => "it stands still: look at its motor, its propeller and its channel",
        _ if 1.0 - gain > LOSS && 1.0 - gain > CLEARLY * std => {
            "as one does whose propeller is fouled, chipped or of another kind, or whose motor is limited"
        }
        _ => return None,
    };
    let message = format!(
        "thruster `{name}` gives {:.2} ± {:.2} of the thrust of its curve{way}, others being as theirs say in the mean: {what}; the plant allows for it",
        gain,
        1.96 * std
    );
    Some(Caveat::warning(CaveatCode::ThrusterFault, message))
}

/// How gains differ from those of the curves.
fn differing(plant: &PlantResult) -> Option<Caveat> {
    let gains = plant.thruster_gains();
    let said: Vec<String> = gains
        .iter()
        .map(|(name, gain)| match (gain.forward - gain.reverse).abs() < LEAST_SAID {
            true => format!("`{name}` {:.2}", gain.forward),
            false => {
                format!("`{name}` {:.2} ahead and {:.2} in reverse", gain.forward, gain.reverse)
            }
        })
        .collect();
    (!said.is_empty()).then(|| {
        let message = format!(
            "thrusters give other parts of the thrust of their curves, which was allowed for: {}; motion shows these beside each other, while their mean is taken for that of the curves",
            said.join(", ")
        );
        Caveat::note(CaveatCode::ThrusterGains, message)
    })
}

/// Returns a note on thrusters with a number of their own.
fn own(plant: &PlantResult, number: ThrusterNumber) -> Option<Caveat> {
    let (scale, unit, advice) = match number {
        ThrusterNumber::Lag => {
            (1.0, "s", ", or for logs of single thrusters whose clocks are early")
        }
        ThrusterNumber::DeadBand => (100.0, "%", ""),
    };
    let said = |effect: &Effect| match &effect.force {
        EffectForce::Own { thruster, number: own } if *own == number => {
            let Coefficient { value, std, .. } = plant.parameters.get(&effect.name)?;
            let [said, half] = [scale * value, 1.96 * scale * std];
            let is_other = value.abs() > LEAST_SAID;
            is_other.then(|| format!("`{}` {said:+.2} ± {half:.2} {unit}", thruster.name))
        }
        _ => None,
    };
    let said: Vec<String> = plant.effects.iter().filter_map(said).collect();
    (!said.is_empty()).then(|| {
        let message = format!(
            "the {} of thrusters is not alike, which was allowed for: beyond that of the others {}; look for motors or controllers of other kinds or settings{advice}",
            number.name(),
            said.join(", ")
        );
        Caveat::note(CaveatCode::ThrusterGains, message)
    })
}

/// Gains that differ by less are reported as one, and lags, s, and dead bands that do as alike.
const LEAST_SAID: f64 = 0.005;

#[cfg(test)]
mod tests {
    use super::*;

    fn said(forward: f64, reverse: f64, std: f64) -> Option<String> {
        let gain = ThrusterGain { forward, reverse, std: [std; 2] };
        fault("T1", &gain).map(|caveat| caveat.message)
    }

    #[test]
    fn a_fault_is_named_by_what_the_thruster_does() {
        assert!(said(0.02, 0.02, 0.01).expect("still").contains("stands still"));
        assert!(said(-0.98, -1.02, 0.05).expect("turned").contains("the other way"));
        let fouled = said(0.8, 0.81, 0.02).expect("weak");
        assert!(fouled.contains("0.80 ± 0.04") && fouled.contains("fouled"), "{fouled}");
        assert!(said(1.0, 0.6, 0.02).expect("weak").contains("in reverse"));
    }

    #[test]
    fn a_loss_that_is_small_or_uncertain_is_no_fault() {
        assert_eq!(said(0.9, 0.9, 0.01), None);
        assert_eq!(said(0.8, 0.8, 0.08), None);
        assert_eq!(said(1.3, 1.3, 0.01), None);
    }
}
