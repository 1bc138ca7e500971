//! Weight and buoyancy of a plant, compared with those that the vehicle file states.

use std::cmp::Ordering;

use crate::caveat::{estimated, spoken};
use crate::estimate::PlantFit;
use crate::plant::Basis;
use crate::{Caveat, CaveatCode, Vehicle};

/// Returns a caveat if weight minus buoyancy or the righting lever differ from those of the vehicle file. If both
/// are too large, or both too small, thrust has another scale.
pub(super) fn restoring(fit: &PlantFit, vehicle: &Vehicle) -> Option<Caveat> {
    let known = restored(fit, vehicle);
    if let Some(caveat) = thrust_by_weight(&known) {
        return Some(caveat);
    }
    let off: Vec<String> = known.iter().filter(|own| own.is_off).map(Restored::words).collect();
    let all = match weight_and_lever(&known) {
        Some(_) => {
            "; both say that the scale of thrust is wrong, and with it all masses and drags, as where thrusters push less in reverse than their curves or a logged wrench say; log thrusters one by one, or leave out [buoyancy] if it is a guess"
        }
        None => {
            "; weigh the vehicle in water, check the centres of gravity and buoyancy, and the scale of thrust"
        }
    };
    (!off.is_empty()).then(|| {
        let message = format!("{}{all}", off.join(", and "));
        Caveat::warning(CaveatCode::RestoringContradicts, message)
    })
}

/// Returns true if both the weight in water and the righting lever say that thrust has another scale, the
/// same way.
pub(super) fn restoring_refutes(fit: &PlantFit, vehicle: &Vehicle) -> bool {
    weight_and_lever(&restored(fit, vehicle)).is_some()
}

/// Returns the ratios of weight in water and righting lever to those of the vehicle file, if both differ clearly
/// and in the same direction, as with thrust of another scale.
fn weight_and_lever(known: &[Restored]) -> Option<[f64; 2]> {
    let [weight, lever] = known else { return None };
    let times = [weight.times.0, lever.times.0];
    let are_alike = times.iter().all(|times| *times > 1.0)
        || times.iter().all(|times| (0.0..1.0).contains(times));
    let say = |own: &Restored| own.is_off && own.times.0.is_finite();
    (say(weight) && say(lever) && are_alike).then_some(times)
}

/// Returns true if one of weight in water and righting lever shows that thrust is clearly too large (`Greater`) or
/// too small (`Less`).
pub(super) fn restoring_says(fit: &PlantFit, vehicle: &Vehicle, way: Ordering) -> bool {
    restored(fit, vehicle).iter().any(|own| own.says(way))
}

/// Compares weight minus buoyancy and the righting lever, where both the vehicle file and the plant have them.
fn restored(fit: &PlantFit, vehicle: &Vehicle) -> Vec<Restored> {
    let Some((body, buoyancy)) = vehicle.rigid_body.zip(vehicle.buoyancy) else {
        return Vec::new();
    };
    let (excess, lever) = buoyancy.restoring(&body);
    let sure = fit.of_sure_thrust();
    let of = |(term, stated): (Basis, f64)| {
        let (value, std) = (fit.plant.coefficient(&term)?, fit.std(&term)?);
        let is_off =
            (value - stated).abs() > CONTRADICTION * std + CONTRADICTION_PART * stated.abs();
        let times = (value / stated, sure.std(&term)? / stated.abs());
        Some(Restored { term, stated, estimated: (value, std), times, is_off })
    };
    let known = [(Basis::WeightExcess, excess), (Basis::Lever(2), lever.z)];
    known.into_iter().filter_map(of).collect()
}

/// A force or moment of weight and buoyancy, as stated and as estimated.
struct Restored {
    term: Basis,
    stated: f64,
    estimated: (f64, f64),
    /// The estimate relative to the stated value, and the standard deviation of that without the uncertainty of
    /// the scale of thrust.
    times: (f64, f64),
    is_off: bool,
}

impl Restored {
    /// Returns true if it shows that thrust is clearly too large (`Greater`) or too small (`Less`).
    fn says(&self, way: Ordering) -> bool {
        let (times, _) = self.times;
        let is_far = match way {
            Ordering::Greater => times > MOST_OFF,
            Ordering::Less => times > 0.0 && times < 1.0 / MOST_OFF,
            Ordering::Equal => false,
        };
        self.is_off && is_far
    }

    fn words(&self) -> String {
        let Self { term, stated, estimated: (value, std), .. } = self;
        format!(
            "`{term}` is {} {}, but by the vehicle file it is {}",
            estimated(*value, *std),
            term.unit(),
            spoken(*stated)
        )
    }
}

/// Returns a caveat if weight in water and righting lever show the same factor of thrust.
fn thrust_by_weight(known: &[Restored]) -> Option<Caveat> {
    let [first, second] = weight_and_lever(known)?;
    let mean = 0.5 * (first + second);
    let std = known.iter().fold(0.0, |all: f64, own| all.hypot(own.times.1));
    let apart = CONTRADICTION * std + CONTRADICTION_PART * mean;
    let are_sure = known.iter().all(|own| own.times.1 < CONTRADICTION_PART * own.times.0);
    if !are_sure || (first - second).abs() > apart {
        return None;
    }
    let message = format!(
        "weight minus buoyancy is {} times that of the vehicle file, and the righting lever {} times: thrust is as many times too large (its curve, its unit), and with it all masses and drags, or the vehicle file has weight in another unit; correct it and identify again",
        spoken(first),
        spoken(second)
    );
    Some(match (1.0 / MOST_OFF..MOST_OFF).contains(&mean) {
        true => Caveat::warning(CaveatCode::RestoringContradicts, message),
        false => Caveat::severe(CaveatCode::RestoringContradicts, message),
    })
}

/// Factor of thrust from which on it has another unit or another curve; below its inverse likewise.
const MOST_OFF: f64 = 1.25;

/// Difference from a stated value that contradicts it: this many standard deviations, plus this part of the value.
const CONTRADICTION: f64 = 3.0;
const CONTRADICTION_PART: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Severity;

    #[test]
    fn weight_and_lever_that_are_off_alike_say_that_thrust_is() {
        let of = |term, times: f64| Restored {
            term,
            stated: 10.0,
            estimated: (10.0 * times, 0.1),
            times: (times, 0.01),
            is_off: (times - 1.0).abs() > 0.13,
        };
        let severity = |weight: f64, lever: f64| {
            let known = [of(Basis::WeightExcess, weight), of(Basis::Lever(2), lever)];
            thrust_by_weight(&known).map(|caveat| caveat.severity)
        };
        assert_eq!(severity(2.0, 2.04), Some(Severity::Severe));
        assert_eq!(severity(0.45, 0.45), Some(Severity::Severe));
        assert_eq!(severity(1.18, 1.2), Some(Severity::Warning));
        // Those that are off differently show a force beside the scale; the verdict is of both.
        let refutes = |weight: f64, lever: f64| {
            let known = [of(Basis::WeightExcess, weight), of(Basis::Lever(2), lever)];
            weight_and_lever(&known).is_some()
        };
        assert!(refutes(1.18, 1.2) && refutes(2.0, 3.0) && refutes(0.8, 0.3));
        assert!(!refutes(1.0, 1.2) && !refutes(0.8, 1.2) && !refutes(-2.0, -2.0));
        assert!(!refutes(f64::INFINITY, 1.2));
        // One that is off alone is wrong in the vehicle file.
        assert_eq!(severity(2.0, 1.0), None);
        assert_eq!(severity(2.0, 3.0), None);
        assert_eq!(severity(-2.0, -2.0), None);
        let ways = [Ordering::Less, Ordering::Equal, Ordering::Greater];
        let says = |times: f64| ways.map(|way| of(Basis::Lever(2), times).says(way));
        assert_eq!(says(2.0), [false, false, true]);
        assert_eq!(says(0.5), [true, false, false]);
        for unclear in [1.0, 1.2, -2.0] {
            assert_eq!(says(unclear), [false; 3], "{unclear}");
        }
    }
}
