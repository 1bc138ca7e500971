//! Steering models from yaw rate and rudder alone, in addition to plants of several axes.

use super::IdentifyOptions;
use super::plants::Records;
use crate::PlantPlan;
use crate::estimate::{NomotoFit, NomotoOrder, RudderLaw, SteeringTrial, fit_nomoto};
use crate::plant::Signal;
use crate::results::{NomotoResult, Parameter, Results, SecondOrder};
use crate::{Caveat, CaveatCode, Dof, Error, Estimate, Fin, Surface, Trial, TrialRecord, Vehicle};

/// Fits Nomoto's models to every rudder of the vehicle, where a plant includes yaw.
pub(super) fn identify(
    vehicle: &Vehicle,
    trials: &[Trial],
    options: &IdentifyOptions,
    results: &mut Results,
) {
    let has_yaw = |plan: &&PlantPlan| plan.axes.contains(&Dof::Yaw);
    let Some(plan) = options.together.iter().find(has_yaw) else { return };
    // Missing records are reported as the plant's own failure.
    let Ok(records) = Records::of(trials, &plan.axes) else { return };
    for rudder in vehicle.fins.iter().filter(|fin| fin.kind == Surface::Rudder) {
        results.steering.extend(fit_rudder(rudder, &records));
    }
}

/// A model with r³ is reported if its unexplained part is below this fraction of that of the model
/// without.
const CUBIC_PART: f64 = 0.9;

/// Fits the first and the second order, each with the rudder law that explains more.
fn fit_rudder(rudder: &Fin, records: &Records<'_>) -> Vec<NomotoResult> {
    let of = |is_second: bool| {
        let laws = [RudderLaw::Proportional, RudderLaw::Sine];
        let fits = laws.into_iter().filter_map(|law| fit_law(rudder, records, (is_second, law)));
        fits.reduce(|best, other| if other.r2 > best.r2 { other } else { best })
    };
    let found = [of(false), of(true)].into_iter().flatten();
    found.map(|fit| result(rudder, &fit, records)).collect()
}

/// Fits with r³ in addition, and returns that model if it explains more.
fn fit_law(
    rudder: &Fin,
    records: &Records<'_>,
    (is_second, law): (bool, RudderLaw),
) -> Option<NomotoFit> {
    let fit = |is_cubic| fitted(rudder, records, NomotoOrder { is_second, is_cubic, law });
    match (fit(false), fit(true)) {
        (Ok(plain), Ok(cubic)) if cubic.r2 > 1.0 - CUBIC_PART * (1.0 - plain.r2) => Some(cubic),
        (Ok(plain), _) => Some(plain),
        (Err(_), Ok(cubic)) => Some(cubic),
        (Err(_), Err(_)) => None,
    }
}

fn steering<'a>(rudder: &Fin, record: &'a TrialRecord) -> Option<SteeringTrial<'a>> {
    let signal = Signal::Angle { kind: rudder.kind, name: rudder.name.clone() };
    let angle = record.signals.get(&signal)?;
    let rate = record.velocity[Dof::Yaw.index()].as_ref()?;
    Some(SteeringTrial { angle, rate, window_s: record.window_s })
}

fn fitted(rudder: &Fin, records: &Records<'_>, order: NomotoOrder) -> Result<NomotoFit, Error> {
    let trials: Vec<_> = records.fit.iter().filter_map(|record| steering(rudder, record)).collect();
    fit_nomoto(&trials, order)
}

fn result(rudder: &Fin, fit: &NomotoFit, records: &Records<'_>) -> NomotoResult {
    let parameter = |x: Estimate, unit: &str| Parameter::new(x, unit);
    let held = records
        .hold_out
        .iter()
        .filter_map(|record| Some((record.trial.clone(), fit.score(&steering(rudder, record)?))));
    NomotoResult {
        rudder: rudder.name.clone(),
        order: if fit.order.is_second { 2 } else { 1 },
        rudder_law: fit.order.law,
        gain: parameter(fit.gain, "1/s"),
        time: parameter(fit.time, "s"),
        second: fit.second.map(|[sum, product, zero]| SecondOrder {
            time_sum: parameter(sum, "s"),
            time_product: parameter(product, "s²"),
            zero_time: parameter(zero, "s"),
        }),
        cubic: fit.cubic.map(|x| parameter(x, "s²/rad²")),
        neutral_angle: parameter(fit.neutral, "rad"),
        is_stable: fit.is_stable,
        fit_r2: fit.r2,
        hold_out_r2: held.collect(),
        caveats: doubts(rudder, fit, records),
    }
}

/// Fraction of a trial at the rudder's limit above which the trial has hardly any information.
const SATURATED_PART: f64 = 0.5;
/// Distance from its limit at which a rudder counts as saturated, rad.
const AT_LIMIT: f64 = 0.01;

fn doubts(rudder: &Fin, fit: &NomotoFit, records: &Records<'_>) -> Vec<Caveat> {
    let mut all = Vec::new();
    if !fit.is_stable {
        let message = format!(
            "by rudder `{}` the ship does not keep a straight course: K and T are negative, and without r³ the model is valid for small turns only",
            rudder.name
        );
        all.push(Caveat::note(CaveatCode::Unstable, message));
    }
    if let Some(limit) = rudder.limit_rad {
        for record in &records.fit {
            let Some(trial) = steering(rudder, record) else { continue };
            let angles = trial.angle.values();
            let at = angles.iter().filter(|angle| angle.abs() > limit - AT_LIMIT).count();
            if at as f64 > SATURATED_PART * angles.len() as f64 {
                let message = format!(
                    "trial `{}`: rudder `{}` is at its limit for {:.0} % of the time, where it hardly determines its gain; use smaller angles as well",
                    record.trial,
                    rudder.name,
                    100.0 * at as f64 / angles.len() as f64
                );
                all.push(Caveat::warning(CaveatCode::Collinear, message));
            }
        }
    }
    all
}
