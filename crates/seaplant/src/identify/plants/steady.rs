//! Thrust that never changes: it tells the mass in surge from nothing.

use crate::caveat::estimated;
use crate::plant::{Basis, EffectForce, Signal, Structure};
use crate::{Dof, Error, Timed, TrialRecord};

/// Thrust whose standard deviation is less than this part of its mean is steady.
const STEADY_PART: f64 = 0.2;

/// Why a plant with surge does not settle, if thrust along it hardly changes and no mass of it is
/// held.
pub(super) fn reason(structure: &Structure, records: &[&TrialRecord]) -> Option<Error> {
    let mass = Basis::Mass(Dof::Surge, Dof::Surge);
    if structure.index_of(&mass).is_none() || structure.held(&mass).is_some() {
        return None;
    }
    let drives = drives(structure, records);
    let ranges: Vec<[f64; 2]> = drives.iter().map(|(_, values)| spread(values)).collect();
    let is_steady = |[mean, std]: &[f64; 2]| *std < STEADY_PART * mean.abs();
    if ranges.is_empty() || !ranges.iter().all(is_steady) {
        return None;
    }
    let named: Vec<String> = drives
        .iter()
        .zip(&ranges)
        .map(|((name, _), [mean, std])| format!("{name} is {}", estimated(*mean, *std)))
        .collect();
    let reason = format!(
        "surge cannot be identified from these trials: {} in all of them, as at one engine order, so that the mass in surge cannot be separated from thrust and resistance; leave surge out (axes = [\"yaw\"] gives the steering), or add trials with starts, stops or other shaft speeds",
        named.join(" and ")
    );
    Some(Error::Plant { axes: structure.name(), reason })
}

/// What drives surge, by name, over the windows of all trials.
fn drives(structure: &Structure, records: &[&TrialRecord]) -> Vec<(String, Vec<f64>)> {
    let within = |record: &TrialRecord, series: &Timed| {
        let (from, to) = record.window_s;
        series.window(from, to).unwrap_or_else(|| series.clone()).values().to_vec()
    };
    let of_all = |series: &dyn Fn(&TrialRecord) -> Option<Vec<f64>>| {
        records.iter().filter_map(|record| series(record)).flatten().collect::<Vec<f64>>()
    };
    let mut all = Vec::new();
    if records.iter().any(|record| record.is_driven(Dof::Surge)) {
        let force =
            |record: &TrialRecord| Some(within(record, record.force[Dof::Surge.index()].as_ref()?));
        all.push(("thrust in N".to_owned(), of_all(&force)));
    }
    for effect in structure.effects() {
        let propeller = match &effect.force {
            EffectForce::Thrust { propeller, .. } => propeller,
            EffectForce::OpenWater { curve } => &curve.propeller,
            _ => continue,
        };
        let signal = Signal::Drive(propeller.clone());
        let drive = |record: &TrialRecord| Some(within(record, record.signals.get(&signal)?));
        all.push((format!("the drive of `{propeller}`"), of_all(&drive)));
    }
    all
}

/// Mean and standard deviation.
fn spread(values: &[f64]) -> [f64; 2] {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
    [mean, variance.sqrt()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Symmetry;

    fn record(thrust: impl Fn(f64) -> f64) -> TrialRecord {
        let times: Vec<f64> = (0..200).map(f64::from).collect();
        let values: Vec<f64> = times.iter().map(|t| thrust(*t)).collect();
        let mut force = [const { None }; 6];
        force[0] = Some(Timed::new("thrust", times, values).expect("valid"));
        TrialRecord { force, ..TrialRecord::until("zigzag", 199.0) }
    }

    #[test]
    fn one_order_of_the_engine_is_why_surge_does_not_settle() {
        let structure = Structure::of(&[Dof::Surge, Dof::Sway, Dof::Yaw], Symmetry::PortStarboard);
        let structure = structure.expect("a structure");
        let zigzag = record(|t| 47.0 + 4.0 * (0.1 * t).sin());
        let why = reason(&structure, &[&zigzag]).expect("steady").to_string();
        assert!(why.contains("thrust in N is 47.") && why.contains("other shaft speeds"), "{why}");
        let stops = record(|t| if t < 100.0 { 47.0 } else { 0.0 });
        assert!(reason(&structure, &[&stops]).is_none());
        assert!(reason(&structure, &[&zigzag, &stops]).is_none());
        let mass = Basis::Mass(Dof::Surge, Dof::Surge);
        let held = structure.holding(mass, 3500.0).expect("a mass");
        assert!(reason(&held, &[&zigzag]).is_none());
    }
}
