//! Change of the plant that would reduce the errors of simulated trials.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Vector4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::intervals::{KNOWN_DRAG, KNOWN_MASS};
use super::linear::{ErrorRegression, Solution, Window, windows_of};
use super::score::Score;
use crate::{AxisRecord, Caveat, CaveatCode, Dof, Error, Estimate, Fit, Model};

/// Estimates the change of mass and drag that best reduces the errors on some records; `None` if
/// they do not determine it.
///
/// A lag or a rate limit of the propellers affects steps of thrust but not slower thrust, and may
/// pass for a change of the plant. Where a time shift of the thrust explains a tenth of the errors
/// that the change leaves, the change is estimated together with such a shift.
pub(super) fn change(
    model: &Model,
    axes: &[AxisRecord],
    windows: Vec<Window>,
) -> Result<Option<PlantChange>, Error> {
    let found = estimate_change(model, axes, windows, false)?;
    let is_claim =
        |change: &PlantChange| change.is_confirmed() && beyond(change.mass, change.drag) > 0.0;
    let Some(change) = found.filter(is_claim) else { return Ok(found) };
    let explains = |late: &PlantChange| {
        1.0 - late.explained < (1.0 - EXPLAINED) * (1.0 - change.explained)
            && beyond(late.mass, late.drag) < beyond(change.mass, change.drag)
    };
    // Windows of a long record take much memory: they are made again where they are needed again.
    let windows = windows_of(model, axes)?;
    Ok(estimate_change(model, axes, windows, true)?.filter(explains).or(Some(change)))
}

/// Solves least squares on the errors of the simulation, linear in the change. As the errors are
/// linear only in small changes, a large change is made in several steps, each with a new
/// simulation.
fn estimate_change(
    model: &Model,
    axes: &[AxisRecord],
    windows: Vec<Window>,
    has_delay: bool,
) -> Result<Option<PlantChange>, Error> {
    let mut refit = Refit { model: model.clone(), thrust: 1.0, drag: 1.0, has_delay, windows };
    let first = refit.square();
    for _ in 0..MOST_STEPS {
        let Some(solution) = refit.solution() else { return Ok(None) };
        let (a, d) = (solution.value[0], solution.value[1]);
        if a.abs() < SMALL_STEP && d.abs() < SMALL_STEP {
            return Ok(refit.change(&solution, first));
        }
        match refit.step(a, d, axes)? {
            Some(next) => refit = next,
            None => break,
        }
    }
    Ok(refit.solution().and_then(|solution| refit.change(&solution, first)))
}

/// Maximum number of steps.
const MOST_STEPS: usize = 8;
/// Relative change below which no new simulation is needed.
const SMALL_STEP: f64 = 0.1;
/// Maximum factor of thrust over mass, and of drag over mass, in one step, in either direction.
const LONGEST_STEP: f64 = 2.0;
/// Number of times a step that does not reduce the errors is halved.
const HALVINGS: usize = 4;

/// The model after some steps of the change.
struct Refit {
    model: Model,
    /// Thrust over mass and drag over mass, relative to the first model.
    thrust: f64,
    drag: f64,
    /// True if a time shift of the thrust is estimated as well.
    has_delay: bool,
    windows: Vec<Window>,
}

impl Refit {
    fn solution(&self) -> Option<Solution> {
        self.regression().solve()
    }

    fn regression(&self) -> ErrorRegression {
        ErrorRegression::of(&self.windows, |window| {
            let mut columns = plant_columns(window);
            columns.extend(self.has_delay.then(|| delay_column(window)));
            Some(columns)
        })
    }

    /// Returns the total change; `before` is the sum of squared errors of the first model.
    fn change(&self, solution: &Solution, before: f64) -> Option<PlantChange> {
        let change = PlantChange::of(solution, self.thrust, self.drag)?;
        let left = self.regression().cross_validated().unwrap_or(before);
        Some(PlantChange { explained: 1.0 - left / before.max(f64::MIN_POSITIVE), ..change })
    }

    fn square(&self) -> f64 {
        self.windows.iter().flat_map(|window| &window.error).map(|e| e * e).sum()
    }

    /// Returns the next model, with thrust over mass increased by the fraction a and drag over mass
    /// by the fraction d, or by as much of that as reduces the errors; `None` if nothing does.
    fn step(&self, a: f64, d: f64, axes: &[AxisRecord]) -> Result<Option<Self>, Error> {
        let bounded = |x: f64| (1.0 + x).clamp(1.0 / LONGEST_STEP, LONGEST_STEP) - 1.0;
        let (mut a, mut d) = (bounded(a), bounded(d));
        for _ in 0..HALVINGS {
            let mut model = self.model.clone();
            model.lumped.alpha *= 1.0 + a;
            model.lumped.beta *= 1.0 + d;
            model.lumped.mu *= 1.0 + d;
            let windows = windows_of(&model, axes)?;
            let (thrust, drag) = (self.thrust * (1.0 + a), self.drag * (1.0 + d));
            let next = Self { model, thrust, drag, windows, has_delay: self.has_delay };
            if next.windows.len() == self.windows.len() && next.square() < self.square() {
                return Ok(Some(next));
            }
            (a, d) = (0.5 * a, 0.5 * d);
        }
        Ok(None)
    }
}

/// Returns the accelerations due to relative changes of thrust over mass and of drag over mass.
pub(super) fn plant_columns(window: &Window) -> Vec<Vec<f64>> {
    vec![window.thrust.clone(), window.drag.clone()]
}

/// Returns the first-order acceleration due to thrust that is delayed by one second.
fn delay_column(window: &Window) -> Vec<f64> {
    let (thrust, time_s) = (&window.thrust, &window.time_s);
    let step_s = |k: usize| (time_s[k] - time_s[k - 1]).max(f64::MIN_POSITIVE);
    let of = |k: usize| if k == 0 { 0.0 } else { (thrust[k - 1] - thrust[k]) / step_s(k) };
    (0..thrust.len()).map(of).collect()
}

/// The change of a plant that trials support, relative to its values: least squares on the errors
/// of its simulation, linear in the change, in addition to an initial velocity, a constant force
/// and a current of each trial, and to a time shift of the thrust where that explains more.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlantChange {
    /// Change of the mass: 0.1 where a tenth more would fit better.
    pub mass: Part,
    /// Change of the drag at the speeds of the trials.
    pub drag: Part,
    /// Fraction of the squared errors that it explains in cross-validation between halves of the
    /// trials.
    pub explained: f64,
}

/// A relative change with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Part {
    /// Relative change.
    pub value: f64,
    /// Its standard deviation, from batches of the trials.
    pub std: f64,
    /// Lower end of its 95 % interval.
    pub low95: f64,
    /// Upper end of its 95 % interval.
    pub high95: f64,
}

impl Part {
    /// Formats as `+4.2 ± 1.5 %`, with two digits of the interval.
    pub(crate) fn spoken(self) -> String {
        let half = 50.0 * (self.high95 - self.low95);
        let decimals = (1.0 - half.log10().floor()).clamp(0.0, 3.0) as usize;
        format!("{:+.decimals$} ± {half:.decimals$} %", 100.0 * self.value)
    }

    /// Returns the end of the interval that is nearer to zero, relative to a limit: above 1 where
    /// the change significantly exceeds the limit.
    fn beyond(self, limit: f64) -> f64 {
        self.low95.max(-self.high95) / limit
    }
}

/// Returns by how much changes of mass and drag significantly exceed the accuracy that users
/// expect: above 1 where they do.
pub(crate) fn beyond(mass: Part, drag: Part) -> f64 {
    mass.beyond(MASS_PART).max(drag.beyond(DRAG_PART))
}

impl From<Estimate> for Part {
    fn from(Estimate { value, std, low95, high95 }: Estimate) -> Self {
        Self { value, std, low95, high95 }
    }
}

impl PlantChange {
    /// Returns true if trials outside the fit determine the plant and agree with it. It is then
    /// confirmed, even if their noise hides the quality of its prediction.
    pub(crate) fn vouches(&self) -> bool {
        confirms(self.mass, self.drag)
    }

    /// Returns true if the change explains errors in cross-validation: slow forces that resemble a
    /// change of the plant in one part of the trials do not in another.
    pub(crate) fn is_confirmed(&self) -> bool {
        self.explained > EXPLAINED
    }

    /// Returns true if trials ask for a mass or drag that is significantly further off than those of a usable
    /// plant may be.
    pub(crate) fn refutes(&self) -> bool {
        let off = self.mass.beyond(KNOWN_MASS).max(self.drag.beyond(KNOWN_DRAG));
        self.is_confirmed() && off > 1.0
    }

    /// Converts changes of thrust over mass and drag over mass, by the fractions a and d from
    /// `thrust` and `drag` times their first values, to mass, which becomes `1/(thrust (1 + a))`
    /// times its first value, and drag, which becomes `drag (1 + d)/(thrust (1 + a))` times.
    ///
    /// `None` for a physically impossible change, to a mass near zero or a negative drag. Then
    /// another force acts on the vehicle, such as the slow pull of a tether.
    pub(super) fn of(solution: &Solution, thrust: f64, drag: f64) -> Option<Self> {
        let (a, d) = (solution.value[0], solution.value[1]);
        let is_finite =
            solution.value.iter().chain(solution.covariance.iter()).all(|x| x.is_finite());
        if 1.0 + a < LEAST_MASS || !is_finite {
            return None;
        }
        let mass = 1.0 / (thrust * (1.0 + a));
        let drag_now = drag * (1.0 + d) * mass;
        if drag_now < 0.0 {
            return None;
        }
        let std = |of_a: f64, of_d: f64| {
            let of = DVector::from_fn(solution.value.len(), |j, _| {
                [of_a, of_d].get(j).map_or(0.0, |x| *x)
            });
            of.dot(&(&solution.covariance * &of)).max(0.0).sqrt()
        };
        let of = |value: f64, std| Estimate::new(value - 1.0, std, solution.freedom).into();
        Some(Self {
            mass: of(mass, std(-mass / (1.0 + a), 0.0)),
            drag: of(drag_now, std(-drag_now / (1.0 + a), drag * mass)),
            explained: 0.0,
        })
    }
}

/// The change of a plant that unseen trials support: a step of their likelihood from the plant, with
/// the estimated disturbances and a current for each trial.
///
/// Unlogged forces affect an open-loop simulation, but only widen these intervals.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LikelyChange {
    /// Relative change of mass; its interval is that of a difference.
    pub mass: Part,
    /// Relative change of drag at the usual speed.
    pub drag: Part,
    /// Whiteness of the filter's innovations on them: Box and Pierce's statistic over 40 lags,
    /// divided by 40; 1 if they are white.
    pub whiteness: f64,
    /// Mean square of the innovations, normalised by their predicted variance: 1 if noise and
    /// disturbances are as in the fitted trials.
    pub surprise: f64,
}

/// Normalised mean square of innovations above which unmodelled forces act in unseen trials.
const SURPRISED: f64 = 1.5;

impl LikelyChange {
    /// Returns whether unseen trials confirm mass and drag.
    pub(crate) fn vouches(&self) -> bool {
        confirms(self.mass, self.drag) && self.whiteness < NOT_WHITE && self.surprise < SURPRISED
    }

    /// Returns the significant change, relative to the tolerance of users, if it exceeds 1.
    pub(crate) fn beyond(&self) -> Option<f64> {
        Some(beyond(self.mass, self.drag)).filter(|parts| *parts > 1.0)
    }
}

/// Returns true if changes of mass and drag are significantly small.
pub(crate) fn confirms(mass: Part, drag: Part) -> bool {
    let within = |part: Part, limit: f64| part.low95 > -limit && part.high95 < limit;
    within(mass, VOUCHED_MASS) && within(drag, VOUCHED_DRAG)
}

/// Minimum explained fraction of the squared errors.
const EXPLAINED: f64 = 0.1;

/// Limits of the relative change of mass and of drag within which trials confirm a plant.
const VOUCHED_MASS: f64 = 0.15;
const VOUCHED_DRAG: f64 = 0.30;

/// Error of the mass above which it is not what users expect …
pub(super) const MASS_PART: f64 = 0.05;
/// … and error of the drag.
pub(super) const DRAG_PART: f64 = 0.10;

/// Widens the intervals of a fit by model error: adds the significant part of the change that
/// fitted and unseen trials support.
///
/// A change of α by the fraction a, and of β and μ by d, counts as one sample of the model error:
/// `Σ += g gᵀ`, g = (aα, dβ, dμ). Each fraction is taken at the end of its interval nearer to zero,
/// and is 0 where the interval includes 0, since what trials do not determine is no error of the
/// model.
pub(crate) fn widened(fit: Fit, changes: [Option<PlantChange>; 2]) -> Fit {
    let mut covariance = fit.covariance;
    for change in changes.into_iter().flatten().filter(PlantChange::is_confirmed) {
        let sure = |part: Part| part.low95.max(0.0) + part.high95.min(0.0);
        let (mass, drag) = (sure(change.mass), sure(change.drag));
        // Converts mass and drag back to factors of α, and of β and μ.
        let a = 1.0 / (1.0 + mass).max(LEAST_MASS) - 1.0;
        let d = (1.0 + drag) * (1.0 + a) - 1.0;
        let plant = fit.lumped;
        let off = Vector4::new(a * plant.alpha, d * plant.beta, d * plant.mu, 0.0);
        covariance += off * off.transpose();
    }
    Fit { covariance, ..fit }
}

/// Minimum ratio of the new mass to the old, below which the linear estimate is not valid.
const LEAST_MASS: f64 = 0.1;

/// Returns a caveat if trials support another plant; `which` is "held-out" or "fitted".
///
/// Based on least squares on the errors of the simulation, linear in the change, with separate
/// offsets for each trial.
///
/// Innovations that are not white show that the model lacks something: a smaller change then
/// suffices.
pub(crate) fn another_plant(
    dof: Dof,
    score: &Score,
    which: &str,
    whiteness: Option<f64>,
) -> Option<Caveat> {
    let change = score.change.filter(PlantChange::is_confirmed)?;
    let is_white = whiteness.is_none_or(|whiteness| whiteness < NOT_WHITE);
    let part = if is_white { 1.0 } else { NOT_WHITE_PART };
    (beyond(change.mass, change.drag) > part).then(|| {
        let message = format!(
            "the errors of the simulated {which} {dof} trials would be smaller with another plant: mass {}, drag {} (95 %); the model lacks something, or the trials differ in vehicle, trim or thrust",
            change.mass.spoken(),
            change.drag.spoken()
        );
        Caveat::warning(CaveatCode::AnotherPlantFits, message)
    })
}

/// Box–Pierce statistic over 40 lags, divided by 40, that a complete model rarely exceeds.
pub(crate) const NOT_WHITE: f64 = 1.8;
/// Fraction of the limits that suffices where innovations are not white.
const NOT_WHITE_PART: f64 = 0.4;

/// Number of parts of the record that are compared.
const PARTS: usize = 3;

/// Change of thrust over mass within a record that is acceptable …
const DRIFT_PART: f64 = 0.05;
/// … and change of drag over mass.
const DRAG_DRIFT_PART: f64 = 0.15;
/// Significance level of the test for changes.
const DRIFT_LEVEL: f64 = 1e-3;

/// Change of the plant between the thirds of the fitted record.
#[derive(Clone, Debug)]
pub(crate) struct Drift {
    pub(crate) thrust: Changes,
    pub(crate) drag: Changes,
}

impl Drift {
    /// Estimates thrust over mass in each third, together with a common change of drag; and drag
    /// over mass in each third, together with a common change of thrust. With both free in each
    /// third, nearly steady motion would determine neither.
    ///
    /// Uses thirds of all trials in sequence, or of each trial, whichever differ more: a battery
    /// may last for several trials, or be exchanged before each.
    pub(crate) fn of(windows: &[Window]) -> Option<Self> {
        let all =
            [false, true].map(|by_trial| Self::over(windows, &Thirds::new(windows, by_trial)));
        let least = |drift: &Self| drift.thrust.p_value.min(drift.drag.p_value);
        all.into_iter().flatten().min_by(|a, b| least(a).total_cmp(&least(b)))
    }

    fn over(windows: &[Window], thirds: &Thirds<'_>) -> Option<Self> {
        let changes = |is_thrust: bool| {
            let columns = |window: &Window| {
                let both = (&window.thrust, &window.drag);
                let (of, beside) = if is_thrust { both } else { (both.1, both.0) };
                let parts = (0..PARTS).map(|third| thirds.part(window, of, third));
                Some(parts.chain([beside.clone()]).collect())
            };
            Some(Changes::of(&ErrorRegression::of(windows, columns).solve()?))
        };
        Some(Self { thrust: changes(true)?, drag: changes(false)? })
    }

    /// Returns a caveat if the plant changes during the record.
    pub(crate) fn caveat(&self, dof: Dof) -> Option<Caveat> {
        let kinds = [
            ("thrust over mass", &self.thrust, DRIFT_PART),
            ("drag over mass", &self.drag, DRAG_DRIFT_PART),
        ];
        let (name, of, _) = kinds
            .into_iter()
            .find(|(_, change, limit)| change.p_value < DRIFT_LEVEL && change.range > *limit)?;
        let part = |(x, std): &(f64, f64)| format!("{:+.1} ± {:.1} %", 100.0 * x, 100.0 * std);
        let parts: Vec<String> = of.parts.iter().map(part).collect();
        let message = format!(
            "the {dof} plant changes during the record: in the first, second and last third of it, or of each trial, {name} differs from the fit by {}; the cause may be a battery that sags, another trim or payload, or something that the model lacks; fit the parts separately",
            parts.join(", ")
        );
        Some(Caveat::warning(CaveatCode::PlantDrifts, message))
    }
}

/// Division of the time of windows into three equal parts: of all trials together, or of each
/// trial.
struct Thirds<'a> {
    /// For each window: its start, s, and the total duration of its trial or of all, s.
    places: Vec<(&'a Window, f64, f64)>,
}

impl<'a> Thirds<'a> {
    fn new(windows: &'a [Window], by_trial: bool) -> Self {
        let mut spent_s: BTreeMap<&str, f64> = BTreeMap::new();
        let name = |window: &'a Window| if by_trial { window.trial.as_str() } else { "" };
        let mut starts_s = Vec::new();
        for window in windows {
            let spent_s = spent_s.entry(name(window)).or_default();
            starts_s.push(*spent_s);
            *spent_s += window.duration_s();
        }
        let places = windows.iter().zip(starts_s);
        let places = places.map(|(window, start_s)| (window, start_s, spent_s[name(window)]));
        Self { places: places.collect() }
    }

    /// Returns a column of a window, set to zero outside a third.
    fn part(&self, window: &Window, column: &[f64], third: usize) -> Vec<f64> {
        let own = self.places.iter().find(|(other, ..)| std::ptr::eq(*other, window));
        let (start_s, total_s) =
            own.map_or((0.0, 1.0), |(_, start_s, total_s)| (*start_s, *total_s));
        let is_in = |k: usize| {
            let at_s = start_s + window.time_s[k] - window.time_s[0];
            ((PARTS as f64 * at_s / total_s) as usize).min(PARTS - 1) == third
        };
        column.iter().enumerate().map(|(k, x)| if is_in(k) { *x } else { 0.0 }).collect()
    }
}

/// Changes of one quantity in each third.
#[derive(Clone, Debug)]
pub(crate) struct Changes {
    /// Relative change and its standard deviation.
    pub(crate) parts: Vec<(f64, f64)>,
    /// Difference of the greatest and the least.
    pub(crate) range: f64,
    /// Probability of such a difference by chance.
    pub(crate) p_value: f64,
}

impl Changes {
    /// Computes the changes from the first entries of a solution.
    fn of(solution: &Solution) -> Self {
        let value = solution.value.rows(0, PARTS);
        let covariance = solution.covariance.view((0, 0), (PARTS, PARTS));
        let parts: Vec<(f64, f64)> =
            (0..PARTS).map(|k| (value[k], covariance[(k, k)].max(0.0).sqrt())).collect();
        let contrast = DMatrix::from_fn(PARTS - 1, PARTS, |i, j| match j {
            0 => -1.0,
            j if j == i + 1 => 1.0,
            _ => 0.0,
        });
        let off = &contrast * value;
        let wald = (&contrast * covariance * contrast.transpose())
            .cholesky()
            .map_or(0.0, |cholesky| off.dot(&cholesky.solve(&off)));
        let numbers = (PARTS - 1) as f64;
        let chance = FisherSnedecor::new(numbers, solution.freedom);
        let p_value = chance.map_or(1.0, |chance| chance.sf(wald / numbers));
        let (low, high) = parts
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), (x, _)| (l.min(*x), h.max(*x)));
        Self { parts, range: high - low, p_value }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(value: f64, std: f64) -> Part {
        Estimate::new(value, std, 1e6).into()
    }

    fn score(mass: Part, drag: Part) -> Score {
        let change = PlantChange { mass, drag, explained: 0.5 };
        Score { change: Some(change), ..Score::default() }
    }

    #[test]
    fn warns_of_significant_and_relevant_changes_of_the_plant_only() {
        let of = |score: &Score, white| another_plant(Dof::Surge, score, "held-out", Some(white));
        let far = score(part(0.12, 0.02), part(0.0, 0.01));
        assert!(of(&far, 1.0).expect("raised").message.contains("mass +12.0 ± 3.9 %"));
        let by_chance = score(part(0.12, 0.05), part(-0.2, 0.08));
        assert_eq!(of(&by_chance, 1.0), None);
        let small = score(part(0.04, 0.004), part(0.0, 0.01));
        assert_eq!(of(&small, 1.0), None);
        assert!(of(&small, 2.5).is_some());
    }

    #[test]
    fn only_precise_agreement_confirms_a_plant() {
        let (mass, drag) = (|std| part(0.02, std), |std| part(-0.05, std));
        let change = |std| PlantChange { mass: mass(std), drag: drag(std), explained: 0.0 };
        assert!(change(0.03).vouches() && !change(0.2).vouches());
    }

    #[test]
    fn a_change_that_fails_cross_validation_is_ignored() {
        let far = score(part(0.12, 0.02), part(0.0, 0.01));
        let of = |explained| {
            let change = far.change.map(|change| PlantChange { explained, ..change });
            another_plant(Dof::Surge, &Score { change, ..far }, "held-out", Some(1.0))
        };
        assert!(of(0.3).is_some() && of(0.05).is_none());
    }
}
