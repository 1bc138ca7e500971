//! Reasons to doubt a plant of several axes.

use super::restoring::restoring;
use super::{Records, correlation, known, scale, thrusters, under_way};
use crate::caveat::{estimated, spoken};
use crate::estimate::{Actuator, NEGLIGIBLE_POWER, PlantFit, damping_power, is_pushed};
use crate::judge::{NOT_WHITE, scoring};
use crate::plant::{Basis, EffectForce};
use crate::results::{PlantResult, ToldBy};
use crate::{BetweenSamples, Caveat, CaveatCode, Dof, Method, SteeringGear, TrialRecord, Vehicle};

/// Two coefficients that are correlated by more cannot be told apart.
const COLLINEAR: f64 = 0.98;
/// By more than this they can where both are known well.
const ALIKE: f64 = 0.9;
/// A variance that others make ten times as large is inflated, by the usual rule.
const INFLATED: f64 = 10.0;
/// A coefficient with a standard deviation of more than this part of it is not known well.
const BLURRED: f64 = 0.05;

/// All doubts, the worst first; `of_axes` are those that [`known::doubts`] has of single axes.
///
/// [`known::doubts`]: super::known::doubts
pub(super) fn doubts(
    fit: &PlantFit,
    plant: &PlantResult,
    records: &Records<'_>,
    vehicle: &Vehicle,
    of_axes: &[(Dof, Caveat)],
) -> Vec<Caveat> {
    let of_vehicle = under_way::doubts(plant, records, vehicle);
    let smooth = smooth_thrust(fit.actuator.between);
    let is_settled =
        |caveat: &Caveat| smooth.is_some() && caveat.code == CaveatCode::ThrustBetweenSamples;
    let of_logs = records.of_logs.iter().filter(|caveat| !is_settled(caveat));
    let mut all: Vec<Caveat> = of_logs.cloned().collect();
    all.extend(smooth);
    let records = records.fit.as_slice();
    all.extend(records.iter().flat_map(|record| record.caveats.clone()));
    all.extend(untold(plant));
    all.extend(of_axes.iter().map(|(_, caveat)| caveat.clone()));
    all.extend(known::wide(fit, records));
    all.extend(collinear(&fit.of_sure_thrust()));
    all.extend(not_driven(fit, plant, records));
    all.extend(turned_round(fit));
    all.extend(of_vehicle);
    all.extend(not_dissipative(fit, records));
    all.extend(restoring(fit, vehicle));
    all.extend(scoring(&plant.fit, plant.hold_out.as_ref()));
    all.extend(not_white(fit));
    all.extend(unsure_thrust(fit));
    all.extend(scale::doubts(fit, records));
    all.extend(fit.thrust_by_another_power());
    all.extend(loaded_thrust(fit));
    all.extend(fit.thrust_by_voltage());
    all.extend(early_thrust(fit));
    all.extend(thrusters::doubts(plant));
    all.extend(fit.thrust_that_changes());
    all.extend(late(fit));
    all.extend(late_surfaces(fit));
    all.extend(turned_heading(fit));
    all.extend(measured_elsewhere(fit));
    all.sort_by_key(|caveat| std::cmp::Reverse(caveat.severity));
    all
}

/// That translations are measured late, by what they were taken to be earlier.
fn late(fit: &PlantFit) -> Option<Caveat> {
    let of =
        |value: f64, std: Option<f64>| std.map(|std| format!("{} s", estimated(value.abs(), std)));
    let way = if fit.report.delay_s > 0.0 { "later" } else { "earlier" };
    let [delay_std, lag_std] = fit.report_std;
    let delay = of(fit.report.delay_s, delay_std)
        .map(|delay| format!("{delay} {way} than thrust and turns"));
    let lag = of(fit.report.lag_s, lag_std).map(|lag| format!("behind a lag of {lag}"));
    let advice = match &delay {
        Some(_) => "; `offset_s` of the trial corrects the clock of a file",
        None => "; log what the instrument measures before it is smoothed",
    };
    let both: Vec<String> = delay.into_iter().chain(lag).collect();
    (!both.is_empty()).then(|| {
        let message = format!(
            "translations are measured {}, as by a DVL that averages or smooths, or by a satellite receiver; this was allowed for{advice}",
            both.join(" and ")
        );
        Caveat::note(CaveatCode::ClockOffset, message)
    })
}

/// That rudders and fins follow what is logged of them late, or no faster than they can.
fn late_surfaces(fit: &PlantFit) -> Option<Caveat> {
    let SteeringGear { delay_s, slew_s_rad } = fit.actuator.steering;
    let [delay_std, slew_std] = fit.steering_std;
    let delay = delay_std.map(|std| format!("{} s late", estimated(delay_s, std)));
    let rate = slew_std.map(|std| {
        let std = std / slew_s_rad.powi(2);
        let most = estimated(slew_s_rad.recip().to_degrees(), std.to_degrees());
        format!("at no more than {most}°/s")
    });
    let both: Vec<String> = delay.into_iter().chain(rate).collect();
    (!both.is_empty()).then(|| {
        let message = format!(
            "rudders and fins follow what is logged of them {}, as where their orders are logged; this was allowed for; log the angles that they have",
            both.join(" and ")
        );
        Caveat::note(CaveatCode::ClockOffset, message)
    })
}

/// The directions of body axes, and the opposite ones.
pub(super) const DIRECTIONS: [(&str, &str); 3] =
    [("forward", "aft"), ("to starboard", "to port"), ("down", "up")];

/// That heading is turned against velocities or fixes along the world's axes.
fn turned_heading(fit: &PlantFit) -> Option<Caveat> {
    let std = fit.misalignment_std[2].filter(|_| fit.is_along_world)?;
    let turned_rad = fit.report.misalignment_rad[2];
    let degrees = estimated(turned_rad.abs().to_degrees(), std.to_degrees());
    let way = if turned_rad > 0.0 { "starboard" } else { "port" };
    let message = format!(
        "heading points {degrees}° too far to {way} of what velocity over ground or fixes say, as of a compass that deviates, or of magnetic north for true; this was allowed for; correct the heading of the log"
    );
    Some(Caveat::note(CaveatCode::InstrumentElsewhere, message))
}

/// Returns the entry of the vehicle file for the instrument that measures translations.
pub(super) const fn entry_of_sensor(fit: &PlantFit) -> &'static str {
    if fit.is_along_world { "[sensor.position]" } else { "[sensor.dvl]" }
}

/// That translations are measured elsewhere than is stated, or by an instrument that is turned.
fn measured_elsewhere(fit: &PlantFit) -> Option<Caveat> {
    let metres: Vec<String> = DIRECTIONS
        .into_iter()
        .zip(fit.report.lever_m)
        .zip(fit.lever_std)
        .filter_map(|(((ahead, behind), metres), std)| {
            let way = if metres < 0.0 { behind } else { ahead };
            Some(format!("{} m {way}", estimated(metres.abs(), std?)))
        })
        .collect();
    let turned = ["x", "y", "z"].into_iter().zip(fit.report.misalignment_rad);
    let degrees: Vec<String> = turned
        .zip(fit.misalignment_std)
        .filter(|((axis, _), _)| *axis != "z" || !fit.is_along_world)
        .filter_map(|((axis, rad), std)| {
            Some(format!("{}° about {axis}", estimated(rad.to_degrees(), std?.to_degrees())))
        })
        .collect();
    let [sits, is_turned] = [
        format!("sits {} of where it is stated to sit", metres.join(", ")),
        format!("is turned by {} from where it is stated to point", degrees.join(", ")),
    ];
    let [position, rotation] = ["where it sits (`position_m`", "how it points (`rotation_deg`"];
    let (how, what) = match (metres.is_empty(), degrees.is_empty()) {
        (true, true) => return None,
        (false, true) => (sits, position.to_owned()),
        (true, false) => (is_turned, rotation.to_owned()),
        (false, false) => {
            (format!("{sits} and {is_turned}"), format!("{position}) and {rotation}"))
        }
    };
    let message = format!(
        "velocities are those of an instrument that {how}; this was allowed for; measure {what} of `{}`), and state it",
        entry_of_sensor(fit)
    );
    Some(Caveat::warning(CaveatCode::InstrumentElsewhere, message))
}

/// That most of what is uncertain of a mass is the scale of thrust.
fn unsure_thrust(fit: &PlantFit) -> Option<Caveat> {
    let terms = fit.plant.structure().terms().iter().zip(fit.plant.coefficients()).enumerate();
    let parts = terms.filter(|(_, (term, _))| matches!(term, Basis::Mass(i, j) if i == j));
    let parts = parts.map(|(k, (term, mass))| {
        let of_thrust = fit.thrust_covariance[(k, k)];
        (of_thrust / fit.covariance[(k, k)], term, of_thrust.sqrt() / mass)
    });
    let most = parts.filter(|(part, ..)| *part > MOST_OF_VARIANCE);
    let (part, term, std) = most.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let message = format!(
        "thrust is not known better than ± {} %, and moves every mass, drag and lever by as much, together: that is {:.0} % of the variance of `{}`; motion, and simulations from the same thrust, do not depend on it",
        spoken(196.0 * std),
        100.0 * part,
        fit.plant.structure().name_of(term)
    );
    Some(Caveat::note(CaveatCode::ThrustScale, message))
}

/// Where thrust makes more than this of a mass's variance, it is told.
const MOST_OF_VARIANCE: f64 = 0.5;

/// Says that thrust falls while other thrusters push, so that its scale depends on the load at which curves
/// are right.
fn loaded_thrust(fit: &PlantFit) -> Option<Caveat> {
    let std = fit.actuator_std[Actuator::LOADED];
    let change = 100.0 * fit.actuator.log_change_loaded.exp_m1();
    std.filter(|_| change.abs() > LOADED_PERCENT).map(|_| {
        let message = format!(
            "thrust changes by {change:+.0} % while all thrusters push at full speed, as with a battery whose voltage falls under load; mass and drag are right if the curves hold for one thruster by itself; how far they are off if the curves hold at the mean load of the trials the intervals include; log propeller speeds, or the supply voltage"
        );
        Caveat::warning(CaveatCode::ThrustScale, message)
    })
}

/// A loss of thrust under full load above this is a warning.
const LOADED_PERCENT: f64 = 5.0;

/// That thrust acts before its log says.
fn early_thrust(fit: &PlantFit) -> Option<Caveat> {
    let delay_std = fit.actuator_std[Actuator::DELAY];
    let (early_s, std) = (-fit.actuator.delay_s, delay_std?);
    (early_s > 0.0).then(|| {
        let spread = fit.thrust_jitter_s.map_or_else(String::new, |(std_s, _)| {
            format!(" on average, and single changes {} s (standard deviation) earlier or later", spoken(std_s))
        });
        let message = format!(
            "thrust acts {} ± {} s before its log says{spread}, as it does where its log is late, or where it is logged less often than it changes and held until the next sample; mass and drag are those of thrust that much earlier, and what it did between samples nobody knows; log what thrusters are told at every change, on the clock of the sensors",
            spoken(early_s),
            spoken(1.96 * std)
        );
        Caveat::warning(CaveatCode::ThrustBetweenSamples, message)
    })
}

/// That slowly logged thrust was taken to move smoothly, in place of what may be wrong with held samples.
fn smooth_thrust(between: BetweenSamples) -> Option<Caveat> {
    let what = match between {
        BetweenSamples::Held => return None,
        BetweenSamples::SmoothSpeed => "the speed of propellers",
        BetweenSamples::SmoothThrust => "thrust",
    };
    let message = format!(
        "thrust is logged slowly, and {what} moves smoothly from sample to sample: that is clearly likelier than samples which are held, and was allowed for; what thrust did in between is not measured, so log it faster next time"
    );
    Some(Caveat::warning(CaveatCode::ThrustBetweenSamples, message))
}

/// Returns why no axis may be trusted where thrust acts so long before its log says that too little is known of
/// it.
pub(super) fn too_early(fit: &PlantFit) -> Option<&'static str> {
    let is_too_early = -fit.actuator.delay_s > TOO_EARLY_S;
    is_too_early.then_some(
        "thrust acts long before its log says: what it did between its samples is not known",
    )
}

/// Thrust that acts so long before its log says, s, is hardly known: a small vehicle rolls to and fro
/// within a second or two.
const TOO_EARLY_S: f64 = 0.25;

fn untold(plant: &PlantResult) -> Option<Caveat> {
    let of = |told_by| {
        let found = plant.parameters.iter().filter(move |(_, x)| x.told_by == told_by);
        found.map(|(name, _)| format!("`{name}`")).collect::<Vec<_>>()
    };
    let nothing = of(ToldBy::Nothing);
    (!nothing.is_empty()).then(|| {
        let message = format!(
            "the trials hardly determine {}: the 95 % interval is wider than the number; drive these axes more, and several at once, or leave them out",
            nothing.join(", ")
        );
        Caveat::note(CaveatCode::Collinear, message)
    })
}

/// Pairs that the trials hardly tell apart: correlated nearly fully; or strongly, where others
/// inflate the variance of one and its error is more than a user minds.
fn collinear(fit: &PlantFit) -> Option<Caveat> {
    let correlation = correlation(fit);
    let looks_alike = |i: usize, j: usize| {
        let r = correlation.value[i][j].abs();
        r > COLLINEAR || r > ALIKE && (is_blurred(fit, i) || is_blurred(fit, j))
    };
    let mut pairs = Vec::new();
    for i in 0..correlation.names.len() {
        for j in (0..i).filter(|j| looks_alike(i, *j)) {
            pairs.push(format!("`{}` and `{}`", correlation.names[j], correlation.names[i]));
        }
    }
    (!pairs.is_empty()).then(|| {
        let message = format!(
            "the trials hardly separate {}: one may be off by more than its interval where the plant lacks something, and the other makes up for it; vary speed within turns, drive at more than one speed, or hold one of two in [[plant]]",
            pairs.join("; ")
        );
        Caveat::warning(CaveatCode::Collinear, message)
    })
}

/// Whether a coefficient is known badly because others look like it.
fn is_blurred(fit: &PlantFit, k: usize) -> bool {
    let (value, std) = (fit.plant.coefficients()[k], fit.covariance[(k, k)].sqrt());
    fit.inflation.get(k).is_some_and(|inflation| *inflation > INFLATED)
        && std > BLURRED * value.abs()
}

fn not_driven(fit: &PlantFit, plant: &PlantResult, records: &[&TrialRecord]) -> Option<Caveat> {
    let undriven = |dof: &&Dof| !is_pushed(fit.plant.structure(), records, **dof);
    let names: Vec<&str> = plant.axes.iter().filter(undriven).map(|dof| dof.name()).collect();
    (!names.is_empty()).then(|| {
        let message = format!(
            "no force or moment acts on {}: only coupling with other axes determines {} coefficients; map a wrench or thrusters there if there are any",
            names.join(" and "),
            if names.len() == 1 { "its" } else { "their" },
        );
        Caveat::note(CaveatCode::UndrivenAxis, message)
    })
}

/// A fin or propeller whose coefficient ends at zero pushes the other way than stated.
fn turned_round(fit: &PlantFit) -> Option<Caveat> {
    let structure = fit.plant.structure();
    let is_zero = |term: &&Basis| match term {
        Basis::Effect(k) => {
            let effect = &structure.effects()[*k];
            let is_main = matches!(
                effect.force,
                EffectForce::Lift { .. }
                    | EffectForce::Slipstream { .. }
                    | EffectForce::Thrust { .. }
            );
            is_main && fit.plant.coefficient(term).is_some_and(|x| x <= 0.0)
        }
        _ => false,
    };
    let names: Vec<String> =
        structure.terms().iter().filter(is_zero).map(|term| structure.name_of(term)).collect();
    (!names.is_empty()).then(|| {
        let message = format!(
            "{} is estimated as zero: in the trials it acts against the direction in vehicle.toml, or hardly at all; reverse its axis or direction, or negate the channel",
            names.join(" and ")
        );
        Caveat::warning(CaveatCode::WrongSign, message)
    })
}

/// Where the vehicle was, damping must take power.
fn not_dissipative(fit: &PlantFit, records: &[&TrialRecord]) -> Option<Caveat> {
    let ranges = records.iter().map(|record| damping_power(&fit.plant, record));
    let (worst, greatest) =
        ranges.fold((0.0_f64, 0.0_f64), |all, own| (all.0.min(own.0), all.1.max(own.1)));
    (worst < -NEGLIGIBLE_POWER * greatest).then(|| {
        let message = format!(
            "damping adds up to {} W to the motion at speeds of the trials, which is unphysical; drop a damping term of another axis, or use trials in which its axes move apart",
            spoken(-worst)
        );
        Caveat::warning(CaveatCode::NotDissipative, message)
    })
}

/// Above this it says that the plant lacks so much that its numbers may be another vehicle's.
const COLOURED: f64 = 4.0;

/// Returns true if the innovations of an axis are so strongly correlated in time that the plant lacks something;
/// where they show no dependence on thrust, that is a disturbance, which is no part of it. Output error has no
/// innovations.
pub(super) fn lacks(fit: &PlantFit, dof: Dof) -> bool {
    let is_coloured =
        fit.method != Method::OutputError && fit.whiteness.get(&dof).is_some_and(|x| *x > COLOURED);
    is_coloured && !shows_no_dependence(fit, dof)
}

/// Smallest probability at which correlation of innovations with the thrusters counts as chance.
const CHANCE: f64 = 0.01;

/// Returns true if the innovations of an axis were tested for dependence on the thrusters, and none was
/// found.
fn shows_no_dependence(fit: &PlantFit, dof: Dof) -> bool {
    fit.independence.get(&dof).is_some_and(|probability| *probability > CHANCE)
}

/// Intervals of output error allow for the colour of its misfit.
fn not_white(fit: &PlantFit) -> Option<Caveat> {
    if fit.method == Method::OutputError {
        return None;
    }
    let far = |(dof, ratio): (&Dof, &f64)| {
        (*ratio > NOT_WHITE).then(|| format!("{dof} ({})", spoken(*ratio)))
    };
    let axes: Vec<String> = fit.whiteness.iter().filter_map(far).collect();
    let mut far = fit.whiteness.iter().filter(|(_, ratio)| **ratio > NOT_WHITE);
    let why = if far.all(|(dof, _)| shows_no_dependence(fit, *dof)) {
        "no dependence on thrust or on the speeds that it causes was found, so it may be waves, gusts or a tether, which intervals allow for; a small missing effect is not excluded"
    } else {
        "the model lacks something, such as waves, a thruster's lag or another coupling; intervals allow for the correlation, not for what is missing"
    };
    (!axes.is_empty()).then(|| {
        let message = format!(
            "what the plant fails to predict is correlated in time in {} (1 for white noise): {why}",
            axes.join(", ")
        );
        Caveat::warning(CaveatCode::ResidualsNotWhite, message)
    })
}
