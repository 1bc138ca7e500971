//! Coefficients without dimension, as the ship world tabulates them.

use std::collections::BTreeMap;

use crate::estimate::PlantFit;
use crate::plant::{Basis, EffectForce, Product, Structure};
use crate::results::{PrimeCoefficient, PrimeSystem};
use crate::{Dof, Estimate, TrialRecord, Vehicle};

/// Letters of forces and velocities in SNAME order.
const FORCES: [char; 6] = ['X', 'Y', 'Z', 'K', 'M', 'N'];
const VELOCITIES: [char; 6] = ['u', 'v', 'w', 'p', 'q', 'r'];

/// Units of the prime system.
struct Units {
    length_m: f64,
    /// ½ρ times the reference area, kg/m.
    half_rho_area: f64,
    speed_m_s: f64,
}

impl Units {
    /// L to the power of how many rotations a product holds, and that of a moment.
    fn length(&self, rotations: usize) -> f64 {
        self.length_m.powi(rotations as i32)
    }

    /// What a mass is divided by.
    fn mass(&self, i: Dof, j: Dof) -> f64 {
        let rotations = usize::from(i.is_rotation()) + usize::from(j.is_rotation());
        self.half_rho_area * self.length(1 + rotations)
    }

    /// What the coefficient of a product is divided by: `½ρA U² L^(moment)` over the product of
    /// U's and U/L's.
    fn product(&self, on: Dof, product: &Product) -> f64 {
        let rotations = product.factors().filter(|factor| factor.of.is_rotation()).count();
        let degree = product.factors().count() as i32 + i32::from(product.speed());
        let moment = usize::from(on.is_rotation());
        self.half_rho_area * self.speed_m_s.powi(2 - degree) * self.length(rotations + moment)
    }
}

/// The coefficients of a plant in the prime system; none without the vehicle's length.
pub(super) fn prime(
    fit: &PlantFit,
    records: &[&TrialRecord],
    vehicle: &Vehicle,
) -> Option<PrimeSystem> {
    let [length_m, ..] = vehicle.size_m?;
    let speed_m_s = mean_speed(records).filter(|speed| *speed > 0.0)?;
    let depth_m = vehicle.draught_m.unwrap_or(length_m);
    let density_kg_m3 = vehicle.water_density_kg_m3;
    let half_rho_area = 0.5 * density_kg_m3 * length_m * depth_m;
    let units = Units { length_m, half_rho_area, speed_m_s };
    let structure = fit.plant.structure();
    let mut coefficients = BTreeMap::new();
    for (k, term) in structure.terms().iter().enumerate() {
        let Some((symbol, by)) = named(structure, term, &units) else { continue };
        let (value, std) = (fit.plant.coefficients()[k], fit.covariance[(k, k)].sqrt());
        let found = coefficient(symbol, value * by, std * by.abs(), fit.samples);
        coefficients.insert(structure.name_of(term), found);
    }
    coefficients.extend(with_munk(fit, &units));
    Some(PrimeSystem { length_m, depth_m, density_kg_m3, speed_m_s, coefficients })
}

fn coefficient(symbol: String, value: f64, std: f64, samples: usize) -> PrimeCoefficient {
    let Estimate { low95, high95, .. } = Estimate::new(value, std, samples as f64);
    PrimeCoefficient { symbol, value, std, low95, high95 }
}

/// The symbol of a term, and what its coefficient is multiplied with; none of one that has no
/// place in the prime system.
fn named(structure: &Structure, term: &Basis, units: &Units) -> Option<(String, f64)> {
    match term {
        Basis::Mass(i, j) => {
            let symbol = format!("m{}{}'", i.index() + 1, j.index() + 1);
            Some((symbol, 1.0 / units.mass(*i, *j)))
        }
        // What brakes is negative where it stands beside the outer forces.
        Basis::Product(on, product) => {
            Some((symbol(*on, product), -1.0 / units.product(*on, product)))
        }
        Basis::Effect(k) => {
            let effect = structure.effects().get(*k)?;
            let is_lift =
                matches!(effect.force, EffectForce::Lift { .. } | EffectForce::Steering { .. });
            is_lift.then(|| (format!("{}'", effect.name), 1.0 / units.half_rho_area))
        }
        Basis::WeightExcess | Basis::Lever(_) | Basis::One(_) => None,
    }
}

/// `Y'_vvr` of `sway: vvr/U`: powers of U are one.
fn symbol(on: Dof, product: &Product) -> String {
    let letter = |factor: crate::plant::Factor| {
        let letter = VELOCITIES[factor.of.index()];
        if factor.modulus { format!("|{letter}|") } else { letter.to_string() }
    };
    let letters: String = product.factors().map(letter).collect();
    format!("{}'_{letters}", FORCES[on.index()])
}

/// N_v as tables have it whose equations have no Coriolis force of added mass in yaw: that of the
/// plant less `m22 − m11`, with the correlation of the three.
fn with_munk(fit: &PlantFit, units: &Units) -> Option<(String, PrimeCoefficient)> {
    let structure = fit.plant.structure();
    let place = |name: &str| structure.terms().iter().position(|x| x.to_string() == name);
    let (drift, name) =
        ["yaw: Uv", "yaw: uv"].into_iter().find_map(|name| Some((place(name)?, name)))?;
    let all = [drift, place("mass.sway")?, place("mass.surge")?];
    let weights = [1.0, 1.0, -1.0];
    let coefficients = fit.plant.coefficients();
    let sum: f64 = all.iter().zip(weights).map(|(k, w)| w * coefficients[*k]).sum();
    let mut variance = 0.0;
    for (i, wi) in all.iter().zip(weights) {
        for (j, wj) in all.iter().zip(weights) {
            variance += wi * wj * fit.covariance[(*i, *j)];
        }
    }
    let by = 1.0 / (units.half_rho_area * units.length(1));
    let std = variance.max(0.0).sqrt() * by;
    let found = coefficient("N'_v, with Munk's moment".to_owned(), -sum * by, std, fit.samples);
    Some((format!("{name}, with Munk's moment"), found))
}

/// Mean speed of the trials, m/s.
fn mean_speed(records: &[&TrialRecord]) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0_usize);
    for record in records {
        let [Some(surge), side @ ..] = &record.velocity else { continue };
        for &t in surge.time_s() {
            let across = side[..2].iter().flatten().map(|x| x.at(t).powi(2)).sum::<f64>();
            sum += (surge.at(t).powi(2) + across).sqrt();
            count += 1;
        }
    }
    (count > 0).then(|| sum / count as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_numbers_come_back_from_si() {
        // KVLCC2, 7 m: Y'_vvr = 0.379 by ½ρLd U², with v' = v/U and r' = rL/U.
        let (length_m, depth, speed_m_s) = (7.0, 0.46, 0.9);
        let units = Units { length_m, half_rho_area: 0.5 * 1000.0 * length_m * depth, speed_m_s };
        let of = |text: &str, si: f64| {
            let Ok(Basis::Product(on, product)) = text.parse() else { panic!("{text}") };
            (symbol(on, &product), -si / units.product(on, &product))
        };
        let area = 500.0 * 7.0 * 0.46;
        assert_eq!(of("sway: vvr/U", -0.379 * area * 7.0), ("Y'_vvr".to_owned(), 0.379));
        let (name, value) = of("yaw: rrr/U", 0.013 * area * 7.0 * 343.0);
        assert!(name == "N'_rrr" && (value + 0.013).abs() < 1e-12);
        // One of first degree depends on the speed: X_u u at 0.9 m/s.
        let (name, value) = of("surge: u", 20.0);
        assert!(name == "X'_u" && (value + 20.0 * 0.9 / (area * 0.81)).abs() < 1e-12);
        let cubic = of("yaw: vvv", 100.0).1;
        assert!((cubic + 100.0 * 0.9_f64.powi(3) / (area * 7.0 * 0.81)).abs() < 1e-12);
    }
}
