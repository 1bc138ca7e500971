//! Predicted intervals: of goals and coefficients, by the information of manoeuvres and of earlier trials.

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use schemars::JsonSchema;
use seaplant::estimate::PRECISION;
use seaplant::parallel;
use seaplant::plant::Plant;
use seaplant_control::Actuators;
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::allocate::{Power, Program, Target, inverse};
use crate::battery::HOUR_S;
use crate::goal::{Goal, HALF_95, Width};
use crate::manoeuvre::Manoeuvre;
use crate::prior::Prior;
use crate::request::Request;
use crate::scale::{Combination, Scale};
use crate::wave::seed_of;
use crate::weigh::{Bench, Candidate};

/// The predicted interval of a number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Forecast {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The prior value.
    pub value: f64,
    /// Half of its 95 % interval before the trial; none without earlier trials.
    pub before: Option<f64>,
    /// Half of its 95 % interval after the trial, from this trial and earlier ones: the root of the mean
    /// square over vehicles that the prior allows.
    pub after: f64,
    /// The same of a vehicle that is as believed.
    pub as_believed: f64,
    /// Half intervals between which nine of ten of these vehicles are; none if too few of them can drive the plan. A
    /// relative goal is one of each vehicle's own value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range90: Option<[f64; 2]>,
    /// Half of the widest interval that meets the goal; none for a coefficient without a goal.
    pub goal: Option<f64>,
}

impl Forecast {
    /// Returns true if the predicted interval meets the goal.
    pub fn is_met(&self) -> bool {
        self.goal.is_none_or(|goal| self.after <= goal * (1.0 + ROUNDED))
    }
}

/// Relative tolerance of a goal: minutes are rounded to halves.
const ROUNDED: f64 = 0.02;

/// Half 95 % intervals against minutes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Chart {
    /// Minutes.
    pub minutes: Vec<f64>,
    /// Half 95 % intervals of each goal, relative to its value.
    pub parts: BTreeMap<String, Vec<f64>>,
}

/// Number of plants for which intervals are predicted to tell their range …
const RANGE_PLANTS: usize = 16;
/// … of which so many have to drive the plan.
const LEAST_PLANTS: usize = 12;
/// Half of a 90 % interval in standard deviations that 16 numbers tell: Student, 15 degrees of freedom.
const OF_90: f64 = 1.753;
/// Standard deviation of the logarithm of an interval of one known vehicle from dive to dive, with some margin: 90 % of
/// those of `bench/plan/run.sh` are between 0.92 and 1.06 of the promise, which is one of 0.043.
const VARIES: f64 = 0.05;
/// Search range of the time that goals need, minutes.
pub(crate) const TIMES_MIN: [f64; 2] = [2.0, 600.0];

/// Plants that the vehicle may have, and the covariance of each after the trial.
pub(crate) struct Afterwards {
    plants: Vec<Plant>,
    covariances: Vec<DMatrix<f64>>,
}

/// Goals, and the information on them before the trial.
pub(crate) struct Forecaster<'a> {
    prior: &'a Prior,
    request: &'a Request,
    plants: &'a [Plant],
    scale: Scale<'a>,
    pub(crate) goals: Vec<Goal>,
    /// The goals of the believed plant.
    believed: Vec<Combination>,
    targets: Vec<Target>,
    names: Vec<String>,
    /// Prior information: of a fit's actuator, and of earlier trials.
    before: DMatrix<f64>,
}

impl<'a> Forecaster<'a> {
    pub(crate) fn new(
        prior: &'a Prior,
        bench: &Bench<'a>,
        request: &'a Request,
    ) -> Result<Self, Error> {
        let first = bench.before();
        let terms = bench.plants[0].structure().terms().len();
        let scale = Scale {
            plants: bench.plants,
            rig: bench.rig,
            request,
            actuators: Actuators::of_model(&prior.model),
            // A weight replaces what is believed of thrust by what is measured.
            thrust_part: if bench.has_scale { 0.0 } else { prior.thrust_part },
            has_scale: bench.has_scale,
            more: first.names.len() - terms,
        };
        let goals = if request.goals.is_empty() { scale.usual() } else { request.goals.clone() };
        let found = goals.iter().map(|goal| scale.target(goal)).collect::<Result<Vec<_>, _>>()?;
        let (believed, targets) = found.into_iter().unzip();
        let mut before = first.matrix;
        if let Some(known) = &prior.known {
            let value = |name: &str| {
                let own = bench.plants[0].structure();
                let place = own.index_of(&own.term_named(name)?)?;
                Some(bench.plants[0].coefficients()[place])
            };
            before += information_today(known, &first.names, value);
        }
        let (plants, names) = (bench.plants, first.names);
        Ok(Self { prior, request, plants, scale, goals, believed, targets, names, before })
    }

    pub(crate) fn program(&self, used: &[Candidate], seconds: f64) -> Program {
        Program {
            rates: used.iter().map(|candidate| candidate.rates.clone()).collect(),
            before: self.before.clone(),
            targets: self.targets.clone(),
            criterion: self.request.criterion,
            seconds,
            power: self.power(used, seconds),
        }
    }

    /// Returns the numbers of some plant that no manoeuvre of a program says anything of.
    pub(crate) fn unexcited(&self, program: &Program) -> Vec<&str> {
        let is_excited = |d: usize, k: usize| {
            program.before[(k, k)] > 0.0 || program.rates.iter().any(|of| of[d][(k, k)] > 0.0)
        };
        let is_always = |k: usize| (0..self.plants.len()).all(|d| is_excited(d, k));
        let names = self.names.iter().enumerate();
        names.filter(|(k, _)| !is_always(*k)).map(|(_, name)| name.as_str()).collect()
    }

    /// Returns the power that the battery allows for so long; none without a battery, or where the
    /// goals decide how long.
    fn power(&self, used: &[Candidate], seconds: f64) -> Option<Power> {
        let battery = self.request.minutes.and(self.request.battery)?;
        let watts = used.iter().map(|candidate| candidate.watts.unwrap_or(0.0)).collect();
        Some(Power { watts, most: battery.energy_wh * HOUR_S / seconds })
    }

    /// Returns the time at which all goals are met with these shares.
    pub(crate) fn seconds_needed(&self, used: &[Candidate], shares: &[f64]) -> Option<f64> {
        let meets = |minutes: f64| {
            let ratios = self.program(used, 60.0 * minutes).ratios(shares);
            ratios.is_some_and(|ratios| ratios.iter().all(|ratio| *ratio <= 1.0))
        };
        let [mut low, mut high] = TIMES_MIN;
        if !meets(high) {
            return None;
        }
        if meets(low) {
            return Some(60.0 * low);
        }
        for _ in 0..40 {
            let middle = (low * high).sqrt();
            if meets(middle) { high = middle } else { low = middle }
        }
        Some(60.0 * high)
    }

    /// Computes the covariance of plants drawn from the prior after manoeuvres with their minutes; plants that cannot
    /// be driven, or of which the manoeuvres do not tell all numbers, are left out.
    pub(crate) fn afterwards(
        &self,
        bench: &Bench,
        driven: &[(&Manoeuvre, f64)],
    ) -> Result<Afterwards, Error> {
        let plants = self.prior.draws(RANGE_PLANTS, seed_of(self.request.seed, "range"))?;
        let covariance = |k: usize| {
            let mut matrix = self.before.clone();
            for (manoeuvre, minutes) in driven {
                let (_, rate) = bench.rate(manoeuvre, &plants[k], k as u64).ok()?;
                matrix += rate * (60.0 * minutes);
            }
            inverse(&matrix)
        };
        let found = parallel::of_each(plants.len(), covariance);
        let kept = plants.iter().zip(found).filter_map(|(plant, of)| Some((plant.clone(), of?)));
        let (plants, covariances) = kept.unzip();
        Ok(Afterwards { plants, covariances })
    }

    /// Returns the half intervals of a number between which nine of ten plants are, relative ones as
    /// parts of `believed`; none for too few plants.
    fn range90(
        &self,
        afterwards: &Afterwards,
        name: &str,
        believed: Option<f64>,
    ) -> Option<[f64; 2]> {
        let of = |(plant, covariance): (&Plant, &DMatrix<f64>)| {
            let own = self.scale.combination(plant, name).ok()?;
            let variance = own.weights.dot(&(covariance * &own.weights));
            let half = HALF_95 * (variance + own.irreducible(self.scale.thrust_part)).sqrt();
            Some(half * believed.map_or(1.0, |value| (value / own.value).abs()))
        };
        let all = afterwards.plants.iter().zip(&afterwards.covariances);
        let logs: Vec<f64> = all.map(|one| Some(of(one)?.ln())).collect::<Option<_>>()?;
        if logs.len() < LEAST_PLANTS {
            return None;
        }
        let n = logs.len() as f64;
        let mean = logs.iter().sum::<f64>() / n;
        let variance = logs.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let off = OF_90 * (variance * (1.0 + n.recip()) + VARIES.powi(2)).sqrt();
        Some([(mean - off).exp(), (mean + off).exp()])
    }

    /// Returns the covariance of a plant that the vehicle may have; `None` if the information is singular.
    fn covariance(&self, program: &Program, shares: &[f64], plant: usize) -> Option<DMatrix<f64>> {
        let mut matrix = self.before.clone();
        for (share, rates) in shares.iter().zip(&program.rates) {
            matrix += &rates[plant] * (share * program.seconds);
        }
        inverse(&matrix)
    }

    /// Predicts the intervals of the goals; `None` if the information is singular.
    pub(crate) fn forecasts(&self, program: &Program, shares: &[f64]) -> Option<Vec<Forecast>> {
        let ratios = program.ratios(shares)?;
        let as_believed = self.covariance(program, shares, 0)?;
        let of = |(k, goal): (usize, &Goal)| {
            let (own, target) = (&self.believed[k], &self.targets[k]);
            let irreducible = own.irreducible(self.scale.thrust_part);
            let with = |variance: f64| HALF_95 * (variance + irreducible).sqrt();
            let before = self.variance_today(&own.weights);
            Forecast {
                name: goal.name.clone(),
                unit: own.unit.clone(),
                value: own.value,
                before: before.map(|variance| HALF_95 * variance.sqrt()),
                after: with(ratios[k] * target.std * target.std),
                as_believed: with(own.weights.dot(&(&as_believed * &own.weights))),
                range90: None,
                goal: Some(with(target.std * target.std)),
            }
        };
        Some(self.goals.iter().enumerate().map(of).collect())
    }

    /// Adds the range of each goal over plants that the vehicle may have.
    pub(crate) fn add_ranges(&self, forecasts: &mut [Forecast], afterwards: &Afterwards) {
        for (forecast, goal) in forecasts.iter_mut().zip(&self.goals) {
            let believed = match goal.width {
                Width::Part(_) => Some(forecast.value),
                Width::Amount(_) => None,
            };
            forecast.range90 = self.range90(afterwards, &goal.name, believed);
        }
    }

    /// Returns the variance of a combination from earlier trials.
    fn variance_today(&self, weights: &DMatrix<f64>) -> Option<f64> {
        let (names, covariance) = self.prior.known.as_ref()?;
        let rows: Vec<usize> =
            (0..self.names.len()).filter(|k| weights.row(*k).amax() > 0.0).collect();
        let place = |k: &usize| names.iter().position(|own| *own == self.names[*k]);
        let places: Vec<usize> = rows.iter().map(place).collect::<Option<_>>()?;
        let own = covariance.select_rows(&places).select_columns(&places);
        let weights = weights.select_rows(&rows);
        Some(weights.dot(&(own * &weights)).max(0.0))
    }

    /// Predicts the intervals of all coefficients: the root of their mean variance over the plants that
    /// the vehicle may have; `None` if the information is singular.
    pub(crate) fn coefficients(
        &self,
        program: &Program,
        shares: &[f64],
        afterwards: &Afterwards,
    ) -> Option<Vec<Forecast>> {
        let believed = &self.plants[0];
        let covariance = |plant: usize| self.covariance(program, shares, plant);
        let covariances: Vec<DMatrix<f64>> =
            (0..self.plants.len()).map(covariance).collect::<Option<_>>()?;
        let of = |name: &String| {
            let own = self.scale.combination(believed, name).ok()?;
            let variance = |all: &DMatrix<f64>| own.weights.dot(&(all * &own.weights));
            let mean = covariances.iter().map(variance).sum::<f64>() / covariances.len() as f64;
            let as_believed = variance(&covariances[0]);
            let irreducible = own.irreducible(self.scale.thrust_part);
            let with = |variance: f64| HALF_95 * (variance + irreducible).sqrt();
            Some(Forecast {
                name: name.clone(),
                before: self.variance_today(&own.weights).map(|today| HALF_95 * today.sqrt()),
                after: with(mean),
                as_believed: with(as_believed),
                range90: self.range90(afterwards, name, None),
                unit: own.unit,
                value: own.value,
                goal: None,
            })
        };
        believed.structure().names().iter().map(of).collect()
    }

    /// Predicts the intervals of the goals for up to twice the minutes.
    pub(crate) fn chart(&self, used: &[Candidate], shares: &[f64], total: f64) -> Chart {
        let minutes: Vec<f64> = (1..=20).map(|k| 0.1 * total * f64::from(k)).collect();
        let mut parts: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for at in &minutes {
            let found = self.forecasts(&self.program(used, 60.0 * at), shares).unwrap_or_default();
            for forecast in found.into_iter().filter(|forecast| forecast.value != 0.0) {
                let part = forecast.after / forecast.value.abs();
                parts.entry(forecast.name).or_default().push(part);
            }
        }
        Chart { minutes, parts }
    }
}

/// Returns the information of earlier trials on some numbers: the inverse of their marginal
/// covariance, without the variance floor of fits. Numbers that the earlier trials lack remain
/// unknown.
fn information_today(
    (known, covariance): &(Vec<String>, DMatrix<f64>),
    names: &[String],
    value: impl Fn(&str) -> Option<f64>,
) -> DMatrix<f64> {
    let place = |name: &String| known.iter().position(|own| own == name);
    let is_uncertain = |k: &usize| covariance[(*k, *k)] > 0.0;
    let shared: Vec<(usize, usize)> = names
        .iter()
        .enumerate()
        .filter_map(|(k, name)| Some((k, place(name).filter(is_uncertain)?)))
        .collect();
    let mut marginal =
        DMatrix::from_fn(shared.len(), shared.len(), |i, j| covariance[(shared[i].1, shared[j].1)]);
    for (i, (k, _)) in shared.iter().enumerate() {
        let floor = (PRECISION * value(&names[*k]).unwrap_or(0.0)).powi(2);
        if floor < marginal[(i, i)] {
            marginal[(i, i)] -= floor;
        }
    }
    let mut information = DMatrix::zeros(names.len(), names.len());
    if let Some(own) = inverse(&marginal) {
        for (i, (row, _)) in shared.iter().enumerate() {
            for (j, (column, _)) in shared.iter().enumerate() {
                information[(*row, *column)] = own[(i, j)];
            }
        }
    }
    information
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn information_of_earlier_trials_is_that_of_the_marginal_covariance() {
        let names = |all: &[&str]| all.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let covariance =
            DMatrix::from_row_slice(3, 3, &[4.0, 1.0, 1.9, 1.0, 2.0, 0.0, 1.9, 0.0, 1.0]);
        let known = (names(&["mass.surge", "surge: u", "mass.sway"]), covariance);
        let found = information_today(&known, &names(&["surge: u", "lag", "mass.surge"]), |_| None);
        // The inverse of [[2, 1], [1, 4]], independent of sway.
        let expected =
            DMatrix::from_row_slice(3, 3, &[4.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 2.0]) / 7.0;
        assert!((found - expected).amax() < 1e-12);
    }
}
