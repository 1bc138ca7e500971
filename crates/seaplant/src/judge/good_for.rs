//! The motion for which unseen trials confirm a plant, and the trials that contradict it.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::null::NullModel;
use super::score::{LEAST_R2, PREDICTS, Score, explains};
use crate::axes::listed;
use crate::caveat::spoken;
use crate::signal::slope_around;
use crate::{Caveat, CaveatCode, Dof, ScoredMotion, Timed};

/// The motion for which unseen trials confirm a plant: that of the trials which it predicts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GoodFor {
    /// Description in words.
    pub words: String,
    /// Motion of each axis in the trials that confirm it.
    pub motion: BTreeMap<Dof, ConfirmedMotion>,
    /// Drift angles under way in the trials that confirm sway, deg; absent for plants without surge
    /// and sway.
    pub drift_deg: Option<[f64; 2]>,
    /// Trials that the plant predicts worse than a model without a plant: it is not valid for their
    /// kind of motion.
    pub not_as_in: Vec<WorseTrial>,
}

/// Motion of an axis in the trials that confirm a plant there; each range includes 95 % of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ConfirmedMotion {
    /// Minimum and maximum speed, m/s or rad/s; absent where speed was not measured.
    pub speed: Option<[f64; 2]>,
    /// Minimum and maximum acceleration, m/s² or rad/s².
    pub acceleration: Option<[f64; 2]>,
    /// The trials.
    pub trials: Vec<String>,
}

/// An axis of a trial that is predicted worse than by a model without a plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WorseTrial {
    /// Trial.
    pub trial: String,
    /// Axis.
    pub axis: Dof,
    /// Mean |model − measured|; absent if the simulation diverges.
    pub mean_abs_error: Option<f64>,
    /// R²; absent if nothing moved or the simulation diverges.
    pub r_squared: Option<f64>,
    /// The model without a plant that is as good or better.
    pub than: NullModel,
    /// Error of a model that never moves.
    pub null_error: f64,
    /// True if unlogged forces, or a current of the trial, explain it.
    pub is_explained: bool,
}

/// One axis of an unseen trial with its prediction.
pub(crate) struct Tested<'a> {
    pub(crate) trial: &'a str,
    pub(crate) axis: Dof,
    /// Error of the simulation; absent if it diverges.
    pub(crate) error: Option<f64>,
    /// Error of the simulation after removal of an offset fitted to the trial.
    pub(crate) free_error: Option<f64>,
    pub(crate) null_error: f64,
    /// `null_error` over all trials.
    pub(crate) usual_null_error: f64,
    pub(crate) r_squared: Option<f64>,
    /// True if unlogged forces explain an error.
    pub(crate) is_explained: bool,
    /// True if the trials, allowing for such forces, support the same plant.
    pub(crate) is_vouched: bool,
    pub(crate) speed: Option<Timed>,
    pub(crate) acceleration: Option<Vec<f64>>,
}

/// Minimum mean speed of a trial that tests an axis, relative to that over all trials.
const LEAST_TESTING_MOTION: f64 = 0.3;

/// Factor of the motion of an almost motionless vehicle above which the plant's motion refutes it …
const HELD: f64 = 10.0;
/// … if the error is at least this fraction of the typical motion of the trials.
const MATERIAL: f64 = 0.05;

/// Half the length of the interval over which the slope of speed gives acceleration, s: long enough
/// to suppress noise.
const SLOPE_HALF_S: f64 = 0.5;

impl<'a> Tested<'a> {
    /// Creates an axis of a trial with its score; `pooled` is that over all unseen trials, and whether these vouch for
    /// the plant.
    pub(crate) fn new(trial: &'a str, axis: Dof, own: &Score, pooled: (&Score, bool)) -> Self {
        Self {
            trial,
            axis,
            error: own.mean_abs_error,
            free_error: own.offset_free_error,
            null_error: own.null_error,
            usual_null_error: pooled.0.null_error,
            r_squared: own.r_squared,
            is_explained: own.is_of_disturbance(),
            is_vouched: pooled.1,
            speed: None,
            acceleration: None,
        }
    }

    fn tests(&self) -> bool {
        self.null_error >= LEAST_TESTING_MOTION * self.usual_null_error
    }

    /// Returns the smaller of the errors with and without offset.
    fn least_error(&self) -> Option<f64> {
        Some(self.error?.min(self.free_error.unwrap_or(f64::INFINITY)))
    }

    /// Returns the model without a plant that predicts the trial at least as well.
    fn worse_than(&self) -> Option<NullModel> {
        let is_far = self.least_error().is_none_or(|error| error > PREDICTS * self.null_error);
        // An almost motionless, held vehicle also refutes a plant that moves.
        let least = (HELD * self.null_error).max(MATERIAL * self.usual_null_error);
        let is_material = self.least_error().is_none_or(|error| error >= least);
        match self.least_error() {
            _ if !self.tests() && !is_material => None,
            None => Some(NullModel::NeverMoves),
            Some(error) if error >= self.null_error => Some(NullModel::NeverMoves),
            _ => {
                let is_below = self.r_squared.is_some_and(|r2| r2 < 0.0);
                let is_far = is_far || self.free_error.is_none();
                (is_below && is_far).then_some(NullModel::KeepsMeanSpeed)
            }
        }
    }

    /// Returns the quantity of the error.
    fn quantity(&self) -> ScoredMotion {
        match self.acceleration {
            Some(_) => ScoredMotion::Acceleration,
            None => ScoredMotion::Velocity,
        }
    }

    fn confirms(&self) -> bool {
        let is_near = self.least_error().is_some_and(|error| error <= PREDICTS * self.null_error)
            || explains(self.quantity(), self.r_squared);
        let is_explained =
            self.free_error.is_some() || self.r_squared.is_none_or(|r2| r2 >= LEAST_R2);
        self.tests() && self.worse_than().is_none() && (is_near && is_explained || self.is_vouched)
    }

    fn as_worse_trial(&self) -> Option<WorseTrial> {
        let than = self.worse_than()?;
        Some(WorseTrial {
            trial: self.trial.to_owned(),
            axis: self.axis,
            mean_abs_error: self.error,
            r_squared: self.r_squared.filter(|_| self.error.is_some()),
            than,
            null_error: self.null_error,
            // Trials with almost no motion do not show what the others support.
            is_explained: self.is_explained || self.is_vouched && self.tests(),
        })
    }
}

impl GoodFor {
    /// Collects the motion of the trials that a plant predicts; `drift_deg` are the drift angles of
    /// each trial.
    pub(crate) fn new(tested: &[Tested<'_>], drift_deg: &BTreeMap<&str, [f64; 2]>) -> Self {
        let mut motion: BTreeMap<Dof, ConfirmedMotion> = BTreeMap::new();
        let mut drift: Option<[f64; 2]> = None;
        for one in tested.iter().filter(|one| one.confirms()) {
            let own = motion.entry(one.axis).or_default();
            if !own.trials.iter().any(|known| known == one.trial) {
                own.trials.push(one.trial.to_owned());
            }
            own.speed = joined(own.speed, one.speed.as_ref().and_then(|v| range(v.values())));
            own.acceleration = joined(own.acceleration, acceleration(one));
            if one.axis == Dof::Sway {
                drift = joined(drift, drift_deg.get(one.trial).copied());
            }
        }
        let not_as_in = tested.iter().filter_map(Tested::as_worse_trial).collect();
        let mut found = Self { words: String::new(), motion, drift_deg: drift, not_as_in };
        found.words = found.describe();
        found
    }

    /// Returns the part of one axis.
    pub(crate) fn of_axis(&self, dof: Dof) -> Self {
        let own = |(axis, motion): (&Dof, &ConfirmedMotion)| {
            (*axis == dof).then(|| (*axis, motion.clone()))
        };
        let mut found = Self {
            motion: self.motion.iter().filter_map(own).collect(),
            drift_deg: self.drift_deg.filter(|_| dof == Dof::Sway),
            not_as_in: self.not_as_in.iter().filter(|worse| worse.axis == dof).cloned().collect(),
            ..Self::default()
        };
        found.words = found.describe();
        found
    }

    /// Returns true if no trial confirms anything.
    pub(crate) fn is_nothing(&self) -> bool {
        self.motion.is_empty()
    }

    /// Lists the trials that are predicted worse, each once with its axes: "`berthing` (sway,
    /// yaw)".
    pub(crate) fn exceptions(&self) -> Option<String> {
        let mut by_trial: BTreeMap<&str, Vec<Dof>> = BTreeMap::new();
        for worse in &self.not_as_in {
            by_trial.entry(&worse.trial).or_default().push(worse.axis);
        }
        let of = |(trial, axes): (&str, Vec<Dof>)| format!("`{trial}` ({})", listed(&axes));
        let all: Vec<String> = by_trial.into_iter().map(of).collect();
        (!all.is_empty()).then(|| all.join(", "))
    }

    fn describe(&self) -> String {
        let of = |(dof, motion): (&Dof, &ConfirmedMotion)| {
            let units = dof.units();
            let span =
                |[low, high]: [f64; 2], unit| format!("{} to {} {unit}", short(low), short(high));
            let parts = [
                motion.speed.map(|speed| format!("at {}", span(speed, units.velocity))),
                motion.acceleration.map(|a| format!("with {}", span(a, units.acceleration))),
            ];
            let parts: Vec<String> = parts.into_iter().flatten().collect();
            format!("{dof} {}", parts.join(" "))
        };
        let mut words: Vec<String> = self.motion.iter().map(of).collect();
        if let Some([low, high]) = self.drift_deg {
            words.push(format!("drift angles of {low:.0} to {high:.0}°"));
        }
        if words.is_empty() {
            words.push("no motion that an unseen trial confirms".to_owned());
        }
        if let Some(exceptions) = self.exceptions() {
            words.push(format!("not motion as in {exceptions}"));
        }
        words.join("; ")
    }

    /// Returns a caveat for each trial that is predicted worse where all trials together hide it:
    /// `hides` returns true for axes that they show to be predicted.
    pub(crate) fn caveats(&self, hides: impl Fn(Dof) -> bool) -> Vec<Caveat> {
        let hidden = self.not_as_in.iter().filter(|worse| !worse.is_explained && hides(worse.axis));
        hidden.map(WorseTrial::caveat).collect()
    }
}

impl WorseTrial {
    fn caveat(&self) -> Caveat {
        let than = match (self.than, self.r_squared) {
            (NullModel::KeepsMeanSpeed, Some(r2)) => {
                format!("a model that keeps its mean speed (R² {r2:.1})")
            }
            _ => format!("a model that never moves ({})", spoken(self.null_error)),
        };
        let error = match self.mean_abs_error {
            Some(error) => format!("{} {}", spoken(error), self.axis.units().velocity),
            None => "unbounded".to_owned(),
        };
        let message = format!(
            "on held-out trial `{}` the error of {} is {error}, no better than {than}, although it is over all held-out trials; do not use the plant for that kind of motion",
            self.trial, self.axis
        );
        Caveat::warning(CaveatCode::NoBetterThanNull, message)
    }
}

fn acceleration(one: &Tested<'_>) -> Option<[f64; 2]> {
    if let Some(measured) = &one.acceleration {
        return range(measured);
    }
    let slopes = slope_around(one.speed.as_ref()?, SLOPE_HALF_S).ok()?;
    range(slopes.values())
}

/// Returns the range that includes 95 % of some values, without outliers.
pub(crate) fn range(values: &[f64]) -> Option<[f64; 2]> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let at = |part: f64| sorted[(part * last as f64).round() as usize];
    Some([at(0.025), at(0.975)])
}

fn joined(one: Option<[f64; 2]>, other: Option<[f64; 2]>) -> Option<[f64; 2]> {
    match (one, other) {
        (Some([a, b]), Some([c, d])) => Some([a.min(c), b.max(d)]),
        (one, other) => one.or(other),
    }
}

/// Formats a bound to two digits.
fn short(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let decimals = (1 - x.abs().log10().floor() as i32).clamp(0, 3) as usize;
    let written = format!("{x:.decimals$}");
    // A value rounded to zero has no sign.
    if written.trim_start_matches(['-', '0', '.']).is_empty() { "0".to_owned() } else { written }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tested(trial: &str, error: f64, null_error: f64, r2: f64) -> Tested<'_> {
        let time: Vec<f64> = (0..400).map(|k| 0.1 * f64::from(k)).collect();
        let speed: Vec<f64> = time.iter().map(|t| 0.5 * (0.3 * t).sin()).collect();
        Tested {
            trial,
            axis: Dof::Yaw,
            error: Some(error),
            free_error: None,
            null_error,
            usual_null_error: 0.1,
            r_squared: Some(r2),
            is_explained: false,
            is_vouched: false,
            speed: Timed::new("yaw", time, speed).ok(),
            acceleration: None,
        }
    }

    fn good_for(tested: &[Tested<'_>]) -> GoodFor {
        GoodFor::new(tested, &BTreeMap::new())
    }

    #[test]
    fn confirms_the_motion_of_predicted_trials() {
        let found = good_for(&[tested("zigzag", 0.01, 0.1, 0.95)]);
        let motion = &found.motion[&Dof::Yaw];
        let [low, high] = motion.speed.expect("measured");
        assert!(low < -0.48 && high > 0.48, "{low} {high}");
        let [low, high] = motion.acceleration.expect("a slope");
        assert!((low + 0.15).abs() < 0.01 && (high - 0.15).abs() < 0.01, "{low} {high}");
        assert_eq!(found.words, "yaw at -0.50 to 0.50 rad/s with -0.15 to 0.15 rad/s²");
        assert_eq!(found.caveats(|_| true), []);
    }

    #[test]
    fn names_a_trial_worse_than_without_a_plant_and_does_not_confirm_its_motion() {
        let of = |error, r2| {
            let both = [tested("zigzag", 0.01, 0.1, 0.95), tested("berthing", error, 0.08, r2)];
            good_for(&both)
        };
        let found = of(0.05, -2.7);
        assert_eq!(found.motion[&Dof::Yaw].trials, ["zigzag"]);
        assert!(found.words.ends_with("not motion as in `berthing` (yaw)"), "{}", found.words);
        let message = &found.caveats(|_| true)[0].message;
        assert!(message.contains("mean speed (R² -2.7)"), "{message}");
        assert_eq!(found.caveats(|_| false), [], "all trials together show it");
        let message = &of(0.09, -0.4).caveats(|_| true)[0].message;
        assert!(message.contains("`berthing`") && message.contains("never moves"), "{message}");
    }

    #[test]
    fn a_trial_with_almost_no_motion_is_ignored() {
        let found = good_for(&[tested("idle", 0.02, 0.01, -2.0)]);
        assert!(found.is_nothing() && found.not_as_in.is_empty());
        assert_eq!(found.words, "no motion that an unseen trial confirms");
    }

    #[test]
    fn a_trial_with_unlogged_forces_is_excepted_without_a_warning() {
        let disturbed = Tested { is_explained: true, ..tested("tether", 0.09, 0.08, -0.4) };
        let found = good_for(&[disturbed]);
        assert!(found.is_nothing() && found.not_as_in[0].is_explained);
        assert_eq!(found.caveats(|_| true), []);
    }

    #[test]
    fn a_constant_current_does_not_refute_a_plant() {
        let current = Tested { free_error: Some(0.01), ..tested("current", 0.09, 0.08, -0.4) };
        assert_eq!(good_for(&[current]).motion[&Dof::Yaw].trials, ["current"]);
    }

    #[test]
    fn a_range_excludes_outliers() {
        let mut values: Vec<f64> = (0..=100).map(f64::from).collect();
        values[50] = 1e6;
        let [low, high] = range(&values).expect("values");
        assert!(low < 4.0 && high < 100.5, "{low} {high}");
        assert_eq!(range(&[]), None);
        assert_eq!(
            (short(-0.0001), short(12.3), short(0.123)),
            ("0".into(), "12".into(), "0.12".into())
        );
    }
}
