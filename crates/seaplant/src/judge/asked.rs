//! Whether trials ask for another plant than the one they are simulated with.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Vector4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::linear::{Asked, Lacking, Window, windows_of};
use super::score::Score;
use crate::{AxisRecord, Caveat, CaveatCode, Dof, Error, Estimate, Fit, Model};

/// The change of the plant that some records ask for; `None` if they cannot tell.
///
/// Where thrust that acts later or earlier explains a tenth of the errors that such a change
/// leaves, the change beside that: steps of thrust show a lag or a limited rate of propellers that
/// slower thrust does not.
pub(super) fn change(
    model: &Model,
    axes: &[AxisRecord],
    windows: Vec<Window>,
) -> Result<Option<PlantChange>, Error> {
    let found = change_beside(model, axes, windows.clone(), false)?;
    let is_claim =
        |change: &PlantChange| change.is_confirmed() && beyond(change.mass, change.drag) > 0.0;
    let Some(change) = found.filter(is_claim) else { return Ok(found) };
    let explains = |late: &PlantChange| {
        1.0 - late.explained < (1.0 - EXPLAINED) * (1.0 - change.explained)
            && beyond(late.mass, late.drag) < beyond(change.mass, change.drag)
    };
    Ok(change_beside(model, axes, windows, true)?.filter(explains).or(Some(change)))
}

/// Least squares on the errors of the simulation, linear in the change. A large change is made in
/// steps, each simulated anew, for the errors are linear in small changes only.
fn change_beside(
    model: &Model,
    axes: &[AxisRecord],
    windows: Vec<Window>,
    has_lateness: bool,
) -> Result<Option<PlantChange>, Error> {
    let mut stand = Stand { model: model.clone(), thrust: 1.0, drag: 1.0, has_lateness, windows };
    let first = stand.square();
    for _ in 0..MOST_STEPS {
        let Some(asked) = stand.asked() else { return Ok(None) };
        let (a, d) = (asked.value[0], asked.value[1]);
        if a.abs() < SMALL_STEP && d.abs() < SMALL_STEP {
            return Ok(stand.change(&asked, first));
        }
        match stand.after(a, d, axes)? {
            Some(next) => stand = next,
            None => break,
        }
    }
    Ok(stand.asked().and_then(|asked| stand.change(&asked, first)))
}

/// Steps towards the plant that trials ask for.
const MOST_STEPS: usize = 8;
/// A change of so small a part needs no new simulation.
const SMALL_STEP: f64 = 0.1;
/// A step multiplies thrust over mass, and drag over mass, by no more than this, and divides by no
/// more.
const LONGEST_STEP: f64 = 2.0;
/// A step that does not reduce the errors is halved this often.
const HALVINGS: usize = 4;

/// A model on the way to the one that trials ask for.
struct Stand {
    model: Model,
    /// Thrust over mass, and drag over mass, in parts of the first model's.
    thrust: f64,
    drag: f64,
    /// Whether thrust may act later, too.
    has_lateness: bool,
    windows: Vec<Window>,
}

impl Stand {
    fn asked(&self) -> Option<Asked> {
        self.lacking().solve()
    }

    fn lacking(&self) -> Lacking {
        Lacking::of(&self.windows, |window| {
            let mut columns = plant_columns(window);
            columns.extend(self.has_lateness.then(|| lateness(window)));
            Some(columns)
        })
    }

    /// What is asked for in all; `before` is the square of the errors of the first model.
    fn change(&self, asked: &Asked, before: f64) -> Option<PlantChange> {
        let change = PlantChange::of(asked, self.thrust, self.drag)?;
        let left = self.lacking().left_unseen().unwrap_or(before);
        Some(PlantChange { explained: 1.0 - left / before.max(f64::MIN_POSITIVE), ..change })
    }

    fn square(&self) -> f64 {
        self.windows.iter().flat_map(|window| &window.error).map(|e| e * e).sum()
    }

    /// With thrust over mass greater by the part a, drag over mass by the part d, or by as much of
    /// that as reduces the errors; `None` if nothing does.
    fn after(&self, a: f64, d: f64, axes: &[AxisRecord]) -> Result<Option<Self>, Error> {
        let bounded = |x: f64| (1.0 + x).clamp(1.0 / LONGEST_STEP, LONGEST_STEP) - 1.0;
        let (mut a, mut d) = (bounded(a), bounded(d));
        for _ in 0..HALVINGS {
            let mut model = self.model.clone();
            model.lumped.alpha *= 1.0 + a;
            model.lumped.beta *= 1.0 + d;
            model.lumped.mu *= 1.0 + d;
            let windows = windows_of(&model, axes)?;
            let (thrust, drag) = (self.thrust * (1.0 + a), self.drag * (1.0 + d));
            let next = Self { model, thrust, drag, windows, has_lateness: self.has_lateness };
            if next.windows.len() == self.windows.len() && next.square() < self.square() {
                return Ok(Some(next));
            }
            (a, d) = (0.5 * a, 0.5 * d);
        }
        Ok(None)
    }
}

/// What a change of thrust over mass and one of drag over mass would do.
pub(super) fn plant_columns(window: &Window) -> Vec<Vec<f64>> {
    vec![window.thrust.clone(), window.drag.clone()]
}

/// What thrust that acts a second later would do, to first order.
fn lateness(window: &Window) -> Vec<f64> {
    let (thrust, time_s) = (&window.thrust, &window.time_s);
    let step_s = |k: usize| (time_s[k] - time_s[k - 1]).max(f64::MIN_POSITIVE);
    let of = |k: usize| if k == 0 { 0.0 } else { (thrust[k - 1] - thrust[k]) / step_s(k) };
    (0..thrust.len()).map(of).collect()
}

/// The change of a plant that trials ask for, in parts of it: least squares on the errors of its
/// simulation, linear in the change, beside an initial velocity, a constant force and a current of
/// each trial's own, and thrust that acts later where that explains more.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlantChange {
    /// Of the mass: 0.1 where a tenth more would fit better.
    pub mass: Part,
    /// Of the drag at the speeds of the trials.
    pub drag: Part,
    /// The part of the errors, squared, that it explains in halves of the trials that it was not
    /// found in.
    pub explained: f64,
}

/// A part of something, and how sure that is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Part {
    /// The part.
    pub value: f64,
    /// Its standard deviation, from what batches of the trials say.
    pub std: f64,
    /// Lower end of its 95 % interval.
    pub low95: f64,
    /// Upper end of its 95 % interval.
    pub high95: f64,
}

impl Part {
    /// `+4.2 ± 1.5 %`: two digits of the interval.
    pub(crate) fn spoken(self) -> String {
        let half = 50.0 * (self.high95 - self.low95);
        let decimals = (1.0 - half.log10().floor()).clamp(0.0, 3.0) as usize;
        format!("{:+.decimals$} ± {half:.decimals$} %", 100.0 * self.value)
    }

    /// How far a change goes for sure, in parts of a limit: the nearer end of its interval, above 1
    /// where it is beyond.
    fn beyond(self, limit: f64) -> f64 {
        self.low95.max(-self.high95) / limit
    }
}

/// How far changes of mass and drag go for sure beyond what a user takes them for: above 1 where
/// they do.
pub(crate) fn beyond(mass: Part, drag: Part) -> f64 {
    mass.beyond(MASS_PART).max(drag.beyond(DRAG_PART))
}

impl From<Estimate> for Part {
    fn from(Estimate { value, std, low95, high95 }: Estimate) -> Self {
        Self { value, std, low95, high95 }
    }
}

impl PlantChange {
    /// Whether trials that a plant has not seen know it, and find it right: then it is, however
    /// much their noise hides of its prediction.
    pub(crate) fn vouches(&self) -> bool {
        confirms(self.mass, self.drag)
    }

    /// Whether it explains errors that it was not found in: slow forces that happen to look like a
    /// change of the plant in one part do not in another.
    pub(crate) fn is_confirmed(&self) -> bool {
        self.explained > EXPLAINED
    }

    /// Of thrust over mass and drag over mass, of which trials ask for the parts a and d more than
    /// `thrust` and `drag` times what they were: mass is `1/(thrust (1 + a))` times what it was,
    /// drag `drag (1 + d)/(thrust (1 + a))` times.
    ///
    /// `None` of a change that is none of a plant: to a mass near zero or a drag below it. Then
    /// something else moves the vehicle, as a tether does that pulls slowly.
    pub(super) fn of(asked: &Asked, thrust: f64, drag: f64) -> Option<Self> {
        let (a, d) = (asked.value[0], asked.value[1]);
        let is_finite = asked.value.iter().chain(asked.covariance.iter()).all(|x| x.is_finite());
        if 1.0 + a < LEAST_MASS || !is_finite {
            return None;
        }
        let mass = 1.0 / (thrust * (1.0 + a));
        let drag_now = drag * (1.0 + d) * mass;
        if drag_now < 0.0 {
            return None;
        }
        let std = |of_a: f64, of_d: f64| {
            let of =
                DVector::from_fn(asked.value.len(), |j, _| [of_a, of_d].get(j).map_or(0.0, |x| *x));
            of.dot(&(&asked.covariance * &of)).max(0.0).sqrt()
        };
        let of = |value: f64, std| Estimate::new(value - 1.0, std, asked.freedom).into();
        Some(Self {
            mass: of(mass, std(-mass / (1.0 + a), 0.0)),
            drag: of(drag_now, std(-drag_now / (1.0 + a), drag * mass)),
            explained: 0.0,
        })
    }
}

/// Whether changes of mass and drag are known to be small.
pub(crate) fn confirms(mass: Part, drag: Part) -> bool {
    let within = |part: Part, limit: f64| part.low95 > -limit && part.high95 < limit;
    within(mass, VOUCHED_MASS) && within(drag, VOUCHED_DRAG)
}

/// A change that explains less than this part of the errors is not worth a word.
const EXPLAINED: f64 = 0.1;

/// Trials that know the mass within this part, and drag within the other, vouch for a plant.
const VOUCHED_MASS: f64 = 0.15;
const VOUCHED_DRAG: f64 = 0.30;

/// A mass that is off by more than this is not what a user takes it for …
pub(super) const MASS_PART: f64 = 0.05;
/// … and a drag by more than this.
pub(super) const DRAG_PART: f64 = 0.10;

/// The fit with intervals that hold what its model lacks: beside chance, the change that fitted
/// and unseen trials ask for, as far as that is not chance itself.
///
/// A change of α by the part a, and of β and μ by d, is taken as one draw of what the model lacks:
/// `Σ += g gᵀ`, g = (aα, dβ, dμ), with each part at the nearer end of its interval: 0 where that
/// includes 0, for what trials cannot tell is no fault of the model.
pub(crate) fn widened(fit: Fit, changes: [Option<PlantChange>; 2]) -> Fit {
    let mut covariance = fit.covariance;
    for change in changes.into_iter().flatten().filter(PlantChange::is_confirmed) {
        let sure = |part: Part| part.low95.max(0.0) + part.high95.min(0.0);
        let (mass, drag) = (sure(change.mass), sure(change.drag));
        // Back from mass and drag to what multiplies α, and β and μ.
        let a = 1.0 / (1.0 + mass).max(LEAST_MASS) - 1.0;
        let d = (1.0 + drag) * (1.0 + a) - 1.0;
        let plant = fit.lumped;
        let off = Vector4::new(a * plant.alpha, d * plant.beta, d * plant.mu, 0.0);
        covariance += off * off.transpose();
    }
    Fit { covariance, ..fit }
}

/// A change to less than this part of the mass is beyond what a linear look can tell.
const LEAST_MASS: f64 = 0.1;

/// That trials ask for another plant; `which` are "held-out" or "fitted".
///
/// Least squares on the errors of the simulation, linear in the change, with offsets
/// of its own for each trial.
///
/// Innovations that are not white say that the model lacks something: then less is enough.
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

/// Box–Pierce over 40 lags, divided by 40, is rarely above this where the model has all that moves
/// the vehicle.
pub(crate) const NOT_WHITE: f64 = 1.8;
/// Of the limits, this part is enough where innovations are not white.
const NOT_WHITE_PART: f64 = 0.4;

/// Parts of the record that are compared.
const PARTS: usize = 3;

/// Thrust that changes by less than this through a record does no harm …
const DRIFT_PART: f64 = 0.05;
/// … and drag, by less than this.
const DRAG_DRIFT_PART: f64 = 0.15;
/// Chance makes as large a change this often.
const DRIFT_LEVEL: f64 = 1e-3;

/// How the plant changes from the first third of the fitted record to the last.
#[derive(Clone, Debug)]
pub(crate) struct Drift {
    pub(crate) thrust: Changes,
    pub(crate) drag: Changes,
}

impl Drift {
    /// Least squares of the simulation errors on what each third's own thrust over mass would do
    /// beside another drag of all, and each third's own drag beside another thrust of all: with
    /// both free in each third, motion that is nearly steady tells neither.
    ///
    /// Thirds of all trials one after the other, or of each by itself, whichever differ more: a
    /// battery may last for several trials, or be a new one in each.
    pub(crate) fn of(windows: &[Window]) -> Option<Self> {
        let all = [false, true].map(|by_trial| Self::over(windows, &Thirds::of(windows, by_trial)));
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
            Some(Changes::of(&Lacking::of(windows, columns).solve()?))
        };
        Some(Self { thrust: changes(true)?, drag: changes(false)? })
    }

    /// That the plant is not one through the record.
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

/// The time of windows, one after the other, in three equal parts: of all, or of each trial's.
struct Thirds<'a> {
    /// When each begins, s, of how long its trial or all take together, s.
    places: Vec<(&'a Window, f64, f64)>,
}

impl<'a> Thirds<'a> {
    fn of(windows: &'a [Window], by_trial: bool) -> Self {
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

    /// A column of a window, zero outside a third.
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

/// One number, third by third.
#[derive(Clone, Debug)]
pub(crate) struct Changes {
    /// Its change and the standard deviation of that.
    pub(crate) parts: Vec<(f64, f64)>,
    /// The greatest less the least.
    pub(crate) range: f64,
    /// How often chance makes as large changes.
    pub(crate) p_value: f64,
}

impl Changes {
    /// Of what is asked for in the first places.
    fn of(asked: &Asked) -> Self {
        let value = asked.value.rows(0, PARTS);
        let covariance = asked.covariance.view((0, 0), (PARTS, PARTS));
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
        let chance = FisherSnedecor::new(numbers, asked.freedom);
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
    fn another_plant_is_asked_for_beyond_chance_and_beyond_what_users_mind() {
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
    fn precise_agreement_vouches_and_a_rough_one_does_not() {
        let (mass, drag) = (|std| part(0.02, std), |std| part(-0.05, std));
        let change = |std| PlantChange { mass: mass(std), drag: drag(std), explained: 0.0 };
        assert!(change(0.03).vouches() && !change(0.2).vouches());
    }

    #[test]
    fn a_change_that_explains_nothing_elsewhere_is_no_reason_to_doubt() {
        let far = score(part(0.12, 0.02), part(0.0, 0.01));
        let of = |explained| {
            let change = far.change.map(|change| PlantChange { explained, ..change });
            another_plant(Dof::Surge, &Score { change, ..far.clone() }, "held-out", Some(1.0))
        };
        assert!(of(0.3).is_some() && of(0.05).is_none());
    }
}
