//! Plants for export from results.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};

use super::driven::disturbances_of;
use super::{Actuation, Judgement, Origin, PlantModel};
use crate::plant::{
    Basis, Effect, Factor, Plant, Product, Structure, Symmetry, ThrusterNumber, hull_way,
};
use crate::results::{
    CurveResult, Parameter, PlantResult, Results, RigidBodyResult, is_of_thruster, plant_of_result,
};
use crate::thrust::FoundThrust;
use crate::{Dof, Error, Estimate, Method, ThrustCurve, Thruster, Vehicle, spoken};

/// Terms with their coefficients and covariance.
struct Part {
    terms: Vec<(Basis, f64)>,
    covariance: DMatrix<f64>,
    intervals: BTreeMap<String, [f64; 2]>,
    /// The effects to which terms refer by index.
    effects: Vec<Effect>,
}

impl PlantModel {
    /// Creates the plant of results: their plants of several axes, and each other axis that was
    /// identified alone.
    ///
    /// For a single axis, d_Q, d_L and m become the terms of that axis; b is a constant force, in
    /// heave weight minus buoyancy. The Coriolis forces of M belong to the equation of motion for
    /// one identified axis as for six: motion along one axis does not excite them.
    ///
    /// `source` names the results; `method` selects among plants of single axes.
    ///
    /// # Errors
    /// [`Error::NoPlant`] if there is none; [`Error::Plant`] if an M is not positive definite;
    /// [`Error::ThrustTable`], [`Error::Thruster`] or [`Error::RigidBody`] if the vehicle of the
    /// results is physically impossible.
    pub fn of_results(
        results: &Results,
        source: &str,
        method: Option<Method>,
    ) -> Result<Self, Error> {
        let chosen = chosen(results, method)?;
        let mut parts = Vec::new();
        let mut notes = Vec::new();
        let mut actuation = BTreeMap::new();
        let mut disturbances = BTreeMap::new();
        for plant in &chosen {
            parts.push(part_of(plant)?);
            note_omissions(&plant.name(), plant, &mut notes);
            disturbances.extend(disturbances_of(plant));
            let of_all = actuation_of(plant);
            actuation.extend(plant.axes.iter().map(|dof| (*dof, of_all.clone())));
        }
        let (plant, covariance, intervals) = join(parts)?;
        if chosen.iter().all(|plant| plant.is_alone()) && plant.axes().len() > 1 {
            notes.push(ALONE.to_owned());
        }
        let rigid_body = results.rigid_body.as_ref().map(RigidBodyResult::body).transpose()?;
        let mut thrusters = thrusters(results, &mut notes)?;
        let scale = chosen.iter().find_map(|plant| plant.nuisances.get("thrust_scale"));
        if let Some(scale) = scale {
            notes.push(format!(
                "thrusters: their curves are those of the vehicle file times {:.4}, as known forces show; a wrench that is logged or commanded is to be scaled alike",
                scale.value
            ));
        }
        let scale = scale.map_or(1.0, |scale| scale.value);
        for own in &mut thrusters {
            let of =
                |plant: &&&PlantResult| plant.axes.iter().any(|dof| Vehicle::acts_on(own, *dof));
            let all: Vec<FoundThrust> =
                chosen.iter().filter(of).map(|plant| found_of(plant, &own.name, scale)).collect();
            own.curve = found(own, &all, scale, &mut notes)?;
        }
        Ok(Self {
            name: results.vehicle.clone(),
            plant,
            covariance: Some(covariance),
            intervals,
            rigid_body,
            dry_mass_kg: results.dry_mass_kg,
            size_m: results.size_m,
            buoyancy: results.buoyancy.as_ref().map(|b| b.buoyancy()).transpose()?,
            thrusters,
            max_rpm: None,
            actuation,
            driven: results.driven(),
            disturbances,
            origin: Origin {
                source: source.to_owned(),
                command: Some(results.provenance.command.clone()),
                version: Some(results.version.clone()),
                settings: results.provenance.settings.clone(),
                ..Origin::default()
            },
            judgements: Judgement::of_results(results, method)?,
            notes,
        })
    }
}

impl Judgement {
    /// Returns the verdicts on the plants of [`PlantModel::of_results`]: those of several axes, and
    /// each other axis that was identified alone.
    ///
    /// # Errors
    /// [`Error::NoPlant`] if `method` has no plant of an axis.
    pub fn of_results(results: &Results, method: Option<Method>) -> Result<Vec<Self>, Error> {
        let of = |plant: &PlantResult| Self {
            axes: plant.axes.clone(),
            method: plant.method.to_string(),
            verdict: plant.verdict.clone(),
            caveats: plant.caveats.clone(),
        };
        Ok(chosen(results, method)?.into_iter().map(of).collect())
    }
}

/// Returns the plants of several axes, and those of each other axis that was identified alone.
///
/// # Errors
/// [`Error::NoPlant`] if `method` has no plant of an axis alone.
fn chosen(results: &Results, method: Option<Method>) -> Result<Vec<&PlantResult>, Error> {
    let mut all: Vec<&PlantResult> = results.together().map(|(_, plant)| plant).collect();
    let together: BTreeSet<Dof> = all.iter().flat_map(|plant| plant.axes.clone()).collect();
    for (dof, ..) in results.alone().filter(|(dof, ..)| !together.contains(dof)) {
        all.push(results.plant_of(dof, method)?);
    }
    Ok(all)
}

const ALONE: &str = "every axis was identified by itself: no coupling in mass or damping is known; \
                     Coriolis forces follow from the masses, and the trials neither determined nor tested them";

fn thrusters(results: &Results, notes: &mut Vec<String>) -> Result<Vec<Thruster>, Error> {
    let mut thrusters = Vec::new();
    for known in &results.thrusters {
        match &known.law {
            Some(law) => thrusters.push(Thruster::new(
                &known.name,
                known.position_m,
                known.direction,
                CurveResult::curve(law)?,
            )?),
            None => notes.push(format!(
                "thruster {}: the results describe its curve in text only; identify again to export it",
                known.name
            )),
        }
    }
    Ok(thrusters)
}

/// What the trials of a plant have shown of a thruster beside its curve.
fn found_of(plant: &PlantResult, thruster: &str, scale: f64) -> FoundThrust {
    let number = |name: &str, otherwise: f64| {
        plant.nuisances.get(name).map_or(otherwise, |found| found.value)
    };
    // Gains are fractions of the thrust of the vehicle file.
    let gain = plant.thruster_gains().get(thruster).copied();
    let gains = gain.map_or([1.0; 2], |gain| [gain.forward, gain.reverse]);
    let beyond = plant.own_numbers(ThrusterNumber::DeadBand).get(thruster).map_or(0.0, |x| x.value);
    FoundThrust {
        gains: gains.map(|gain| scale + gain - 1.0),
        beyond_square: number("thrust_exponent", 2.0) - 2.0,
        dead_band: (number("dead_band", 0.0) + beyond).max(0.0),
        full_speed: number("full_speed", 1.0),
    }
}

/// Returns the curve that trials have shown a thruster to follow, by all plants of axes that it acts on. Where these
/// differ in more than gains, only gains are applied. A slightly negative gain counts as zero.
///
/// # Errors
/// [`Error::Thruster`] for a thruster of reversed direction; [`Error::ThrustTable`] for an
/// impossible table.
fn found(
    own: &Thruster,
    by_plant: &[FoundThrust],
    scale: f64,
    notes: &mut Vec<String>,
) -> Result<ThrustCurve, Error> {
    let name = &own.name;
    let as_stated =
        FoundThrust { gains: [scale; 2], beyond_square: 0.0, dead_band: 0.0, full_speed: 1.0 };
    let first = by_plant.first().unwrap_or(&as_stated);
    let with_gains = by_plant.iter().find(|one| one.gains != [scale; 2]);
    let gains = with_gains.map_or([scale; 2], |one| one.gains);
    let least = gains[0].min(gains[1]);
    if least < LEAST_GAIN {
        let reason = format!(
            "gives {least:.2} of the thrust of its curve, so that it pushes the other way; reverse its direction in the vehicle file, or negate its channel, and identify again"
        );
        return Err(Error::Thruster { name: name.clone(), reason });
    }
    let mut found = FoundThrust { gains: gains.map(|gain| gain.max(0.0)), ..*first };
    if by_plant.iter().any(|one| one.shape() != first.shape()) {
        notes.push(format!(
            "thruster {name}: the plants of its axes found different exponents or dead bands of thrust, which its curve leaves out; identify its axes together"
        ));
        (found.beyond_square, found.dead_band) = (0.0, 0.0);
    }
    let mut said = Vec::new();
    if with_gains.is_some() {
        said.push(format!("times {:.4} ahead and {:.4} in reverse", gains[0], gains[1]));
    }
    if found.beyond_square != 0.0 {
        said.push(format!("with exponent {:.3}", 2.0 + found.beyond_square));
    }
    if found.dead_band > 0.0 {
        let (percent, full) = (100.0 * found.dead_band, spoken(found.full_speed));
        said.push(format!("with a dead band of {percent:.2} % of {full}, its full speed"));
    }
    if !said.is_empty() {
        notes.push(format!(
            "thruster {name}: its curve is that of the vehicle file {}, as the trials show",
            said.join(", ")
        ));
    }
    own.curve.found(&found)
}

/// A gain below this means reversed thrust; between it and zero, a thruster without thrust.
const LEAST_GAIN: f64 = -0.2;

/// Returns the plant of results without gains and other numbers of thrusters, which are part of their curves and lags.
fn without_thrusters(result: &PlantResult) -> Result<Plant, Error> {
    let whole = plant_of_result(result)?;
    let structure = whole.structure().without(|term| is_of_thruster(whole.structure(), term));
    let terms = structure.terms().iter();
    let coefficients = terms.filter_map(|term| whole.coefficient(term)).collect();
    Plant::new(structure, coefficients)?.pruned()
}

fn part_of(result: &PlantResult) -> Result<Part, Error> {
    let plant = without_thrusters(result)?;
    let names = plant.structure().names();
    let index = |name: &String| result.correlation.names.iter().position(|known| known == name);
    let indices: Vec<Option<usize>> = names.iter().map(index).collect();
    let std = |k: usize| result.parameters[&names[k]].std;
    let covariance = DMatrix::from_fn(names.len(), names.len(), |i, j| {
        let known = indices[i]
            .zip(indices[j])
            .and_then(|(a, b)| result.correlation.value.get(a).and_then(|row| row.get(b)).copied());
        let correlation = if i == j { 1.0 } else { known.unwrap_or(0.0) };
        correlation * std(i) * std(j)
    });
    let (terms, by_found) = lift_as_damping(plant.structure());
    let values = &by_found * DVector::from_column_slice(plant.coefficients());
    let covariance = &by_found * covariance * by_found.transpose();
    let interval = |k: usize| {
        let name = plant.structure().name_of(&terms[k]);
        let is_as_found = by_found.row(k).iter().filter(|x| **x != 0.0).count() == 1;
        let found = result.parameters.get(&name).filter(|_| is_as_found);
        let derived = || Estimate::new(values[k], covariance[(k, k)].sqrt(), f64::INFINITY);
        let [low, high] = match found {
            Some(x) => [x.low95, x.high95],
            None => [derived().low95, derived().high95],
        };
        (name, [low, high])
    };
    Ok(Part {
        intervals: (0..terms.len()).map(interval).collect(),
        terms: terms.into_iter().zip(values.iter().copied()).collect(),
        covariance,
        effects: plant.structure().effects().to_vec(),
    })
}

/// Returns terms with the lift of the hull as damping, which it is, since formats have no place for effects; and how
/// their coefficients follow from those of the structure's terms.
fn lift_as_damping(structure: &Structure) -> (Vec<Basis>, DMatrix<f64>) {
    let place = |term: &Basis| structure.lift_of_hull(term);
    let products = |lift: (Dof, f64)| damping_of_lift(lift, structure.axes());
    let found = structure.terms();
    let mut terms: Vec<Basis> =
        found.iter().filter(|term| place(term).is_none()).copied().collect();
    for (product, _) in found.iter().filter_map(place).flat_map(products) {
        if !terms.contains(&product) {
            terms.push(product);
        }
    }
    let by = |term: &Basis, found: &Basis| match place(found) {
        Some(lift) => products(lift).find(|(own, _)| own == term).map_or(0.0, |(_, x)| x),
        None => f64::from(u8::from(term == found)),
    };
    let by_found = DMatrix::from_fn(terms.len(), found.len(), |i, j| by(&terms[i], &found[j]));
    (terms, by_found)
}

/// Returns the terms of damping on some axes that lift at a place is, and their coefficients per unit of its own: those
/// of `|u| w wᵀ`, w being its wrench per newton.
fn damping_of_lift((along, at_m): (Dof, f64), axes: &[Dof]) -> impl Iterator<Item = (Basis, f64)> {
    const SPEED: Factor = Factor { of: Dof::Surge, modulus: true };
    let way = hull_way(along, at_m);
    let axes = if axes.contains(&Dof::Surge) { axes } else { &[] };
    let pairs = axes.iter().flat_map(|&on| axes.iter().map(move |&of| (on, of)));
    let all = pairs.map(move |(on, of)| (on, of, way[on.index()] * way[of.index()]));
    all.filter(|(.., by)| *by != 0.0).filter_map(|(on, of, by)| {
        let product = Product::new(&[SPEED, Factor { of, modulus: false }])?;
        Some((Basis::Product(on, product), by))
    })
}

type Joined = (Plant, DMatrix<f64>, BTreeMap<String, [f64; 2]>);

/// Joins parts, whose axes do not overlap, to one plant.
fn join(parts: Vec<Part>) -> Result<Joined, Error> {
    let mut terms: Vec<(Basis, f64)> = Vec::new();
    let (mut intervals, mut effects) = (BTreeMap::new(), Vec::new());
    let count = parts.iter().map(|part| part.terms.len()).sum();
    let mut covariance = DMatrix::zeros(count, count);
    for part in parts {
        let from = terms.len();
        let n = part.terms.len();
        covariance.view_mut((from, from), (n, n)).copy_from(&part.covariance);
        let before = effects.len();
        let own = |(term, value): (Basis, f64)| match term {
            Basis::Effect(k) => (Basis::Effect(before + k), value),
            other => (other, value),
        };
        terms.extend(part.terms.into_iter().map(own));
        intervals.extend(part.intervals);
        effects.extend(part.effects);
    }
    Ok((plant_of_terms(&terms, &effects)?.pruned()?, covariance, intervals))
}

/// Creates a plant of these terms only; those of effects refer to `effects` by index.
pub(super) fn plant_of_terms(terms: &[(Basis, f64)], effects: &[Effect]) -> Result<Plant, Error> {
    let masses = terms.iter().filter_map(|(basis, _)| match basis {
        Basis::Mass(i, j) if i == j => Some(*i),
        _ => None,
    });
    let axes: Vec<Dof> = masses.collect();
    if axes.is_empty() {
        return Err(Error::NoPlant { found: "no plant of any axis".to_owned() });
    }
    let nothing = Structure::of(&axes, Symmetry::None)?.without(|_| true);
    let nothing = effects
        .iter()
        .try_fold(nothing, |structure, effect| structure.with_effect(effect.clone(), false))?;
    let structure =
        terms.iter().try_fold(nothing, |structure, (basis, _)| structure.with(*basis))?;
    Plant::new(structure, terms.iter().map(|(_, value)| *value).collect())
}

fn actuation_of(plant: &PlantResult) -> Actuation {
    let fitted = |name: &str| plant.nuisances.get(name).cloned();
    let mean = mean_over_lag(plant);
    let lag = fitted("lag").map(|lag| {
        let Parameter { value, std, low95, high95, unit } = lag;
        Parameter::new(Estimate { value, std, low95, high95 }.times(mean), &unit)
    });
    let (of_all, std) = lag.as_ref().map_or((0.0, 0.0), |lag| (lag.value, lag.std));
    let own = plant.own_numbers(ThrusterNumber::Lag).into_iter().map(|(thruster, beyond)| {
        let value = (of_all + mean * beyond.value).max(0.0);
        let own = Estimate::new(value, std.hypot(mean * beyond.std), f64::INFINITY);
        (thruster, Parameter::new(own, "s"))
    });
    Actuation {
        lag,
        lag_of: own.collect(),
        force_lag: fitted("force_lag"),
        // A negative delay is an error of the log; an exported plant must be causal.
        delay: fitted("delay").filter(|delay| delay.value > 0.0),
        reverse_ratio: fitted("reverse_ratio"),
        voltage_exponent: fitted("voltage_exponent"),
        mean_voltage: fitted("mean_voltage"),
        thrust_scale: fitted("thrust_scale"),
        steering_delay: fitted("steering_delay"),
        steering_rate: fitted("steering_rate"),
    }
}

/// Ratios of lags; an exported plant has the mean of both lags.
const LAG_RATIOS: [&str; 2] = ["lag_ratio", "falling_lag_ratio"];

/// Returns the mean of a propeller's lags over that of one that speeds up towards full ahead.
fn mean_over_lag(plant: &PlantResult) -> f64 {
    let mean = |name| plant.nuisances.get(name).map_or(1.0, |ratio| 0.5 * (1.0 + ratio.value));
    LAG_RATIOS.into_iter().map(mean).product()
}

/// Nuisances of thrust that no export format supports.
const LEFT_OUT: [&str; 9] = [
    "inflow",
    "inflow_ahead",
    "lag_ratio",
    "falling_lag_ratio",
    "slew",
    "thrust_change_within",
    "thrust_change_between",
    "thrust_change_loaded",
    "turning",
];

fn note_omissions(of: &str, result: &PlantResult, notes: &mut Vec<String>) {
    let PlantResult { nuisances, .. } = result;
    let fitted = LEFT_OUT.iter().filter(|name| nuisances.contains_key(**name));
    let names: Vec<&str> = fitted.copied().collect();
    if !names.is_empty() {
        notes.push(format!(
            "{of}: the fit also found {}, which the exported plant leaves out",
            names.join(", ").replace('_', " ")
        ));
    }
    if LAG_RATIOS.iter().any(|name| names.contains(name)) {
        notes.push(format!("{of}: its lag is the mean of those that the fit found"));
    }
    if let Some((exponent, volts)) =
        nuisances.get("voltage_exponent").zip(nuisances.get("mean_voltage"))
    {
        notes.push(format!(
            "{of}: thrust is in proportion to the power {} of supply voltage: simulations with a supply voltage follow it, and exports but JSON have the thrust at {} V, or at the voltage that a curve states",
            spoken(exponent.value),
            spoken(volts.value)
        ));
    }
    let currents = nuisances.keys().filter(|name| name.starts_with("current: ")).count();
    if currents > 0 {
        notes.push(format!(
            "{of}: currents of {currents} trials were fitted; they belong to those trials and are left out"
        ));
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Vector3, Vector6};
    use serde_json::json;

    use super::*;
    use crate::plant::EffectForce;
    use crate::results::ThrusterResult;

    fn x(value: f64, std: f64) -> serde_json::Value {
        let (low95, high95) = (value - 2.0 * std, value + 2.0 * std);
        json!({ "value": value, "std": std, "low95": low95, "high95": high95, "unit": "SI",
                "on": ["sway"], "told_by": "data" })
    }

    /// Results with a boat of sway and yaw, and with heave and yaw alone.
    fn results() -> Results {
        let unit = json!([[1.0, 0.5, 0.0], [0.5, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        let empty = json!({ "value": [], "std": [] });
        let boat = json!({
            "axes": ["sway", "yaw"], "method": "filter-error", "symmetry": "port-starboard",
            "parameters": {
                "mass.sway": x(180.0, 2.0), "mass.sway-yaw": x(12.0, 1.0), "mass.yaw": x(40.0, 0.5)
            },
            "by_axis": {},
            "mass_matrix": empty, "linear_damping": empty, "quadratic_damping": empty,
            "correlation": { "names": ["mass.yaw", "mass.sway", "mass.sway-yaw"], "value": unit },
            "nuisances": {}, "samples": 10, "log_likelihood": 0.0,
            "fit": { "by_axis": {}, "by_trial": {} },
            "verdict": { "trust": "do-not-use", "reason": "it drives itself", "codes": ["wrong-sign"] },
            "caveats": [{ "code": "wrong-sign", "severity": "severe", "message": "it drives itself" }]
        });
        let of_axis = |dof: &str, bias: &str| {
            let [mass, drag] = [format!("mass.{dof}"), format!("{dof}: |v|v")];
            let drag = drag.replace("|v|v", if dof == "heave" { "|w|w" } else { "|r|r" });
            let names = [mass.as_str(), drag.as_str(), bias];
            json!({
                "axes": [dof], "method": "output-error", "symmetry": "none",
                "parameters": { names[0]: x(90.0, 1.0), names[1]: x(50.0, 1.0), names[2]: x(-3.0, 1.0) },
                "by_axis": {},
                "mass_matrix": empty, "linear_damping": empty, "quadratic_damping": empty,
                "correlation": { "names": names, "value": [[1.0, 0.2, -0.3], [0.2, 1.0, -0.1], [-0.3, -0.1, 1.0]] },
                "nuisances": { "lag": x(0.3, 1.0), "inflow": x(0.1, 1.0) }, "samples": 9,
                "alone": {
                    "terms": ["force", "quadratic", "bias"], "stable": true,
                    "stability": { "kind": "stable" },
                    "lumped": { "alpha": 0.01, "beta": -0.5, "mu": 0.0, "bias": 0.0 },
                    "lumped_std": { "alpha": 0.0, "beta": 0.0, "mu": 0.0, "bias": 0.0 },
                    "regression": { "effective_samples": 9.0, "condition": 1.0, "variance_inflation": {},
                                    "residual_rms": 0.0, "filters": { "velocity": null, "every_term": null } }
                },
                "fit": { "by_axis": {}, "by_trial": {} }, "hold_out": null, "caveats": []
            })
        };
        let (heave, yaw) = (of_axis("heave", "weight-minus-buoyancy"), of_axis("yaw", "yaw: 1"));
        let all = json!({
            "schema": crate::results::SCHEMA, "version": "0.1.0", "vehicle": "boat", "dry_mass_kg": null,
            "provenance": { "command": "seaplant identify", "inputs": [], "seed": null, "settings": {} },
            "plants": { "heave": heave, "yaw": yaw, "sway-yaw": boat },
            "methods": {}, "subsets": {}, "steady": {}, "thrusters": [], "bollard_pull": null,
            "sensors": [], "trials": [], "truth": null, "failures": [], "caveats": []
        });
        serde_json::from_value(all).expect("results")
    }

    #[test]
    fn an_exported_lag_is_the_mean_of_those_that_the_fit_found() {
        let mut results = results();
        let heave = results.plants.get_mut("heave").expect("a plant");
        for (name, ratio) in [("lag_ratio", 2.0), ("falling_lag_ratio", 3.0)] {
            let ratio = serde_json::from_value(x(ratio, 0.1)).expect("a parameter");
            heave.nuisances.insert(name.to_owned(), ratio);
        }
        let model = PlantModel::of_results(&results, "results.json", None).expect("a plant");
        let lag = model.actuation[&Dof::Heave].lag.as_ref().expect("a lag");
        assert!((lag.value - 0.3 * 1.5 * 2.0).abs() < 1e-12, "{lag:?}");
        assert!((lag.std - 3.0).abs() < 1e-12, "{lag:?}");
        let is_told = |note: &String| note.contains("its lag is the mean of those");
        assert!(model.notes.iter().any(is_told), "{:?}", model.notes);
    }

    #[test]
    fn plants_of_several_axes_and_of_others_alone_are_one_plant() {
        let model = PlantModel::of_results(&results(), "results.json", None).expect("a plant");
        // Yaw is in the plant of both: that of yaw alone is ignored.
        assert_eq!(model.plant.axes(), [Dof::Sway, Dof::Heave, Dof::Yaw]);
        assert_eq!(model.plant.mass_matrix()[(0, 2)], 12.0);
        // b = 3 N on the left is an upward force.
        assert_eq!(model.weight_excess(), -3.0);
        assert_eq!(model.actuation[&Dof::Heave].lag.as_ref().map(|lag| lag.value), Some(0.3));
        assert!(model.notes.iter().any(|note| note.contains("inflow")), "{:?}", model.notes);
        assert_eq!(model.reasons_against(), ["sway-yaw: it drives itself"]);
    }

    /// Results with a thruster of such a gain in both directions, and less in reverse.
    fn with_gains(gain: f64, reverse: f64) -> Results {
        let mut results = results();
        let law =
            json!({ "kind": "quadratic", "input": "speed", "forward": 0.04, "reverse": 0.03 });
        let thruster = json!({ "name": "port", "position_m": [0.0, -0.5, 0.0],
            "direction": [0.0, 1.0, 0.0], "input": "speed", "curve": "a law", "law": law });
        results.thrusters.push(serde_json::from_value(thruster).expect("a thruster"));
        let plant = results.plants.get_mut("sway-yaw").expect("the boat");
        for (what, in_reverse, value) in
            [("excess-thrust", false, gain - 1.0), ("excess-reverse-thrust", true, reverse - gain)]
        {
            let name = format!("port.{what}");
            let pusher = json!({ "name": "port", "position_m": [0.0, -0.5, 0.0],
                "direction": [0.0, 1.0, 0.0] });
            let force = json!({ "kind": "gain", "thruster": pusher, "reverse": in_reverse });
            let effect = json!({ "name": name, "force": force });
            plant.effects.push(serde_json::from_value(effect).expect("an effect"));
            let found = serde_json::from_value(x(value, 0.02)).expect("a coefficient");
            plant.parameters.insert(name.clone(), found);
            plant.correlation.names.push(name);
        }
        let n = plant.correlation.names.len();
        let unit = |i: usize, j: usize| f64::from(u8::from(i == j));
        plant.correlation.value = (0..n).map(|i| (0..n).map(|j| unit(i, j)).collect()).collect();
        plant.correlation.value[3][4] = -0.5;
        plant.correlation.value[4][3] = -0.5;
        results
    }

    #[test]
    fn exported_curves_include_the_gains_of_thrusters() {
        let results = with_gains(0.9, 0.7);
        let gain = results.plants["sway-yaw"].thruster_gains()["port"];
        assert!((gain.forward - 0.9).abs() < 1e-12 && (gain.reverse - 0.7).abs() < 1e-12);
        // σ² of a sum of two of 0.02 with a correlation of −½ is that of either.
        assert!((gain.std[0] - 0.02).abs() < 1e-12 && (gain.std[1] - 0.02).abs() < 1e-12);
        let model = PlantModel::of_results(&results, "results.json", None).expect("a plant");
        assert!(model.plant.structure().effects().is_empty());
        let force = |input: f64| model.thrusters[0].curve.force(input, None);
        assert!((force(10.0) - 0.9 * 4.0).abs() < 1e-12, "{}", force(10.0));
        assert!((force(-10.0) + 0.7 * 3.0).abs() < 1e-12, "{}", force(-10.0));
        assert!(model.notes.iter().any(|note| note.contains("times 0.9000 ahead")));
        assert_eq!(model.covariance.expect("known").nrows(), model.plant.coefficients().len());
    }

    #[test]
    fn lift_of_the_hull_is_exported_as_damping() {
        let mut results = results();
        let boat = results.plants.get_mut("sway-yaw").expect("the boat");
        boat.axes.insert(0, Dof::Surge);
        let name = "hull.lift-astern";
        let effect = json!({ "name": name, "force": { "kind": "hull-lift", "along": "sway", "at_m": -0.5 } });
        boat.effects.push(serde_json::from_value(effect).expect("an effect"));
        for (name, value, std) in [("mass.surge", 90.0, 1.0), (name, 8.0, 0.4)] {
            let found = serde_json::from_value(x(value, std)).expect("a coefficient");
            boat.parameters.insert(name.to_owned(), found);
        }
        let model = PlantModel::of_results(&results, "results.json", None).expect("a plant");
        let structure = model.plant.structure();
        assert!(structure.effects().is_empty() && !model.intervals.contains_key(name));
        let expected =
            [("sway: |u|v", 8.0), ("sway: |u|r", -4.0), ("yaw: |u|v", -4.0), ("yaw: |u|r", 2.0)];
        for (name, value) in expected {
            let term = structure.term_named(name).expect("a term of damping");
            let found = model.plant.coefficient(&term).expect("its coefficient");
            assert!((found - value).abs() < 1e-12, "{name}: {found}");
            let [low, high] = model.intervals[name];
            let width = 2.0 * 1.96 * 0.05 * value.abs();
            assert!((high - low - width).abs() < 1e-3 * width, "{name}: {low} to {high}");
        }
        let covariance = model.covariance.expect("known");
        assert_eq!(covariance.nrows(), model.plant.coefficients().len());
    }

    #[test]
    fn lift_of_the_hull_along_another_axis_than_sway_and_heave_is_refused() {
        let force = EffectForce::HullLift { along: Dof::Yaw, at_m: 0.7 };
        let lift = Effect { name: "hull.lift".to_owned(), force };
        let masses = Dof::ALL.map(|dof| (Basis::Mass(dof, dof), 1.0));
        let refused = plant_of_terms(&masses, &[lift]).expect_err("no such lift").to_string();
        assert!(refused.contains("along yaw; state sway or heave"), "{refused}");
    }

    #[test]
    fn damping_of_lift_is_the_force_of_lift_in_both_planes() {
        let velocity = Vector6::new(-1.3, 0.4, -0.2, 0.1, 0.3, -0.5);
        let masses = Dof::ALL.map(|dof| (Basis::Mass(dof, dof), 1.0));
        let resistance = |terms: &[(Basis, f64)]| {
            let plant = plant_of_terms(&[&masses[..], terms].concat(), &[]).expect("a plant");
            plant.resistance(&velocity, &Vector3::z())
        };
        for along in [Dof::Sway, Dof::Heave] {
            let force = EffectForce::HullLift { along, at_m: 0.7 };
            let lift = Effect { name: "lift".to_owned(), force };
            let wrench = lift.wrench(&velocity, &[], 0.0);
            let terms: Vec<(Basis, f64)> = damping_of_lift((along, 0.7), &Dof::ALL).collect();
            // Masses alone have Coriolis forces.
            let damping = resistance(&terms) - resistance(&[]);
            assert!((damping + wrench).amax() < 1e-12, "{along}: {damping}, not {wrench}");
            assert!(wrench.amax() > 0.05, "{wrench}");
        }
    }

    #[test]
    fn a_scale_that_known_forces_show_is_that_of_every_thruster() {
        let mut results = with_gains(0.9, 0.7);
        // One that acts on no axis of the plant.
        let idle = ThrusterResult {
            name: "idle".to_owned(),
            position_m: [0.0; 3],
            direction: [1.0, 0.0, 0.0],
            ..results.thrusters[0].clone()
        };
        results.thrusters.push(idle);
        let scale = serde_json::from_value(x(1.2, 0.01)).expect("a number");
        let boat = results.plants.get_mut("sway-yaw").expect("the boat");
        boat.nuisances.insert("thrust_scale".to_owned(), scale);
        let model = PlantModel::of_results(&results, "results.json", None).expect("a plant");
        let force = |k: usize| model.thrusters[k].curve.force(10.0, None);
        assert!((force(0) - (1.2 + 0.9 - 1.0) * 4.0).abs() < 1e-12, "{}", force(0));
        assert!((force(1) - 1.2 * 4.0).abs() < 1e-12, "{}", force(1));
    }

    /// The same with an exponent and a dead band of all thrusters, and a lag and a dead band of its own.
    fn with_shape() -> Results {
        let mut results = with_gains(0.9, 0.7);
        let plant = results.plants.get_mut("sway-yaw").expect("the boat");
        for (name, value) in
            [("thrust_exponent", 1.8), ("full_speed", 50.0), ("dead_band", 0.06), ("lag", 0.2)]
        {
            let found = serde_json::from_value(x(value, 0.03)).expect("a number");
            plant.nuisances.insert(name.to_owned(), found);
        }
        for (number, value) in [("lag", -0.05), ("dead-band", 0.02)] {
            let pusher = json!({ "name": "port", "position_m": [0.0, -0.5, 0.0],
                "direction": [0.0, 1.0, 0.0] });
            let force = json!({ "kind": "own", "thruster": pusher, "number": number });
            let name = format!("port.excess-{number}");
            let effect = json!({ "name": name, "force": force });
            plant.effects.push(serde_json::from_value(effect).expect("an effect"));
            let found = serde_json::from_value(x(value, 0.04)).expect("a coefficient");
            plant.parameters.insert(name, found);
        }
        results
    }

    #[test]
    fn exported_thrusters_have_the_exponent_the_dead_band_and_the_lag_that_were_found() {
        let model = PlantModel::of_results(&with_shape(), "results.json", None).expect("a plant");
        assert!(model.plant.structure().effects().is_empty());
        let n = (20.0 - 0.08 * 50.0) / 0.92;
        for (way, gain, k) in [(1.0, 0.9, 0.04), (-1.0, 0.7, 0.03)] {
            let expected = way * gain * k * n * n * (n / 50.0_f64).powf(-0.2);
            let force = model.thrusters[0].curve.force(way * 20.0, None);
            assert!((force - expected).abs() < 1e-9, "{force}, {expected}");
            assert_eq!(model.thrusters[0].curve.force(way * 3.9, None).abs(), 0.0);
        }
        let sway = &model.actuation[&Dof::Sway];
        assert!((sway.lag_s("port") - 0.15).abs() < 1e-12 && sway.lag_s("starboard") == 0.2);
        assert!((sway.lag_of["port"].std - 0.05).abs() < 1e-12);
        let note = "exponent 1.800, with a dead band of 8.00 % of 50";
        assert!(model.notes.iter().any(|said| said.contains(note)), "{:?}", model.notes);
    }

    #[test]
    fn a_dead_band_that_is_no_part_of_full_speed_is_refused() {
        for (name, value) in [("dead_band", 1.0), ("full_speed", 0.0), ("thrust_exponent", 9.0)] {
            let mut results = with_shape();
            let boat = results.plants.get_mut("sway-yaw").expect("the boat");
            boat.nuisances.get_mut(name).expect("there").value = value;
            let refused = PlantModel::of_results(&results, "results.json", None);
            assert!(refused.is_err(), "{name}");
        }
    }

    #[test]
    fn a_curve_leaves_out_exponents_on_which_the_plants_of_its_axes_differ() {
        let mut results = with_shape();
        results.thrusters[0].direction = [0.0, 0.8, 0.6];
        let model = PlantModel::of_results(&results, "results.json", None).expect("a plant");
        let force = model.thrusters[0].curve.force(20.0, None);
        assert!((force - 0.9 * 0.04 * 400.0).abs() < 1e-9, "{force}");
        assert!(model.notes.iter().any(|said| said.contains("different exponents")));
    }

    #[test]
    fn a_thruster_of_reversed_direction_is_refused() {
        let refused = PlantModel::of_results(&with_gains(-1.0, -1.0), "results.json", None);
        let message = refused.expect_err("turned round").to_string();
        assert!(message.contains("port") && message.contains("identify again"), "{message}");
        let still = PlantModel::of_results(&with_gains(-0.01, 0.02), "results.json", None);
        assert_eq!(still.expect("a plant").thrusters[0].curve.force(10.0, None), 0.0);
    }

    #[test]
    fn covariance_follows_the_names_and_the_signs() {
        let model = PlantModel::of_results(&results(), "results.json", None).expect("a plant");
        let index = |name: &str| {
            let terms = model.plant.structure().terms();
            terms.iter().position(|term| term.to_string() == name).expect(name)
        };
        let covariance = model.covariance.as_ref().expect("known");
        let covariance_of = |a: &str, b: &str| covariance[(index(a), index(b))];
        assert_eq!(covariance_of("mass.yaw", "mass.sway"), 0.5 * 0.5 * 2.0);
        assert_eq!(covariance_of("mass.sway", "mass.sway-yaw"), 0.0);
        assert_eq!(covariance_of("mass.heave", "weight-minus-buoyancy"), -0.3);
        assert_eq!(covariance_of("mass.heave", "mass.sway"), 0.0);
        assert_eq!(model.interval(index("weight-minus-buoyancy")), Some([-5.0, -1.0]));
    }
}
