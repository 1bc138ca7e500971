//! How far a plant may be trusted, and why.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::good_for::GoodFor;
use super::off::MayBeOff;
use super::score::{Score, TrialScore};
use super::working::drag_at;
use crate::caveat::spoken;
use crate::{Caveat, CaveatCode, Estimate, Fit, ScoredMotion, Term};

/// How far a plant may be trusted.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Trust {
    /// A reason not to use it was found.
    DoNotUse,
    /// Nothing vouches for it.
    Doubtful,
    /// It predicts, and there are warnings to read.
    UsableWithCare,
    /// It predicts, and nothing speaks against it.
    Usable,
}

impl Trust {
    /// As the report writes it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::DoNotUse => "do not use",
            Self::Doubtful => "doubtful",
            Self::UsableWithCare => "usable with care",
            Self::Usable => "usable",
        }
    }
}

/// What to make of a plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Verdict {
    /// How far it may be trusted.
    pub trust: Trust,
    /// Why, in one sentence without its first capital and full stop.
    pub reason: String,
    /// The caveats that decided it, the worst first.
    pub codes: Vec<CaveatCode>,
    /// The motion that unseen trials confirm; absent where no trial was held out or left out in turn.
    #[serde(default)]
    pub good_for: Option<GoodFor>,
    /// By how much numbers may be off: all of a doubtful plant, else those that are known less well than a
    /// user takes them for.
    #[serde(default)]
    pub may_be_off: Vec<MayBeOff>,
}

impl Verdict {
    /// Makes a verdict that says nothing yet of motion and numbers.
    pub fn new(trust: Trust, reason: impl Into<String>, codes: Vec<CaveatCode>) -> Self {
        Self { trust, reason: reason.into(), codes, good_for: None, may_be_off: Vec::new() }
    }

    /// Writes by how much numbers may be off, in a sentence; `None` if none is named.
    pub fn spoken_off(&self) -> Option<String> {
        let all: Vec<String> = self.may_be_off.iter().map(MayBeOff::spoken).collect();
        (!all.is_empty()).then(|| format!("may be off: {}", all.join("; ")))
    }
}

impl Default for Verdict {
    /// Of results that were written before plants were judged.
    fn default() -> Self {
        let reason = "it was not judged when these results were written".to_owned();
        Self::new(Trust::Doubtful, reason, Vec::new())
    }
}

/// A model that predicts vouches for its plant if its error is below this part of the error of a
/// model that never moves.
pub(crate) const PREDICTS: f64 = 0.5;
/// A mass interval whose ends are further apart than this factor says nothing of mass.
pub(crate) const WIDEST_MASS: f64 = 2.0;
/// Drag at working speed that is known no better than ± this part is not known.
pub(crate) const WIDEST_DRAG: f64 = 0.5;
/// A user takes a usable mass for right within this part …
pub(crate) const KNOWN_MASS: f64 = 0.10;
/// … and a drag within this.
pub(crate) const KNOWN_DRAG: f64 = 0.20;

/// What makes intervals narrower.
pub(crate) const MORE: &str = "drive longer, faster, and at more than one frequency";

/// Intervals that are too wide for what a user takes a usable plant for; `speed` is the usual one.
pub(crate) fn intervals(fit: &Fit, speed: f64) -> Vec<Caveat> {
    let estimates = fit.estimates();
    let (mass, drag) = (estimates.mass, drag_at(fit, speed));
    let units = fit.dof.units();
    let name = if fit.dof.is_rotation() { "inertia" } else { "mass" };
    let mut caveats = Vec::new();
    let range = |e: Estimate| format!("{} to {}", spoken(e.low95), spoken(e.high95));
    let part = |e: Estimate| 0.5 * (e.high95 - e.low95) / e.value.abs();
    let mut push = |code, what: String, advice: &str| {
        caveats.push(Caveat::warning(code, format!("{what}: {advice}")));
    };
    if mass.low95 <= 0.0 || mass.high95 > WIDEST_MASS * mass.low95 {
        let what =
            format!("the {} {name} is anything from {} {}", fit.dof, range(mass), units.mass);
        push(CaveatCode::NotDetermined, what, MORE);
    } else if part(mass) > KNOWN_MASS {
        let what = format!("the {} {name} is known to ± {:.0} % only", fit.dof, 100.0 * part(mass));
        push(CaveatCode::WideInterval, what, MORE);
    }
    let at = format!("drag in {} at {} {}", fit.dof, spoken(speed), units.velocity);
    if part(drag) >= WIDEST_DRAG || part(drag).is_nan() {
        let what = format!("{at} is anything from {} {}", range(drag), units.force);
        push(CaveatCode::NotDetermined, what, MORE);
    } else if part(drag) > KNOWN_DRAG {
        let what = format!("{at} is known to ± {:.0} % only", 100.0 * part(drag));
        push(CaveatCode::WideInterval, what, MORE);
    } else if let Some(quadratic) = estimates.d_quadratic.filter(|d| part(*d) > KNOWN_DRAG)
        && fit.terms.has(Term::Linear)
    {
        let what = format!(
            "{at} is known to ± {:.0} %, but quadratic drag by itself to ± {:.0} % only, because linear drag can replace it",
            100.0 * part(drag),
            100.0 * part(quadratic)
        );
        push(
            CaveatCode::WideInterval,
            what,
            "do not use the model at other speeds; drive at more of them",
        );
    }
    caveats
}

/// A path that is followed through a trial to this R² vouches for a plant.
const FOLLOWED: f64 = 0.95;

/// Whether unseen trials know the plant and find it right, though the noise of their velocity may
/// hide that: they ask for no other, or the simulation follows the measured path of each.
pub(crate) fn vouched(score: &Score) -> bool {
    let follows = |trial: &TrialScore| trial.position_r_squared.is_some_and(|r| r > FOLLOWED);
    let follows_all = !score.trials.is_empty() && score.trials.iter().all(follows);
    follows_all || score.change.is_some_and(|change| change.vouches())
}

/// A plant that predicts explains this part of the variance of acceleration; the rest may be
/// vibration.
const EXPLAINED: f64 = 0.5;

/// Whether a plant explains most of the acceleration of trials where nothing else was measured.
pub(crate) fn explains(quantity: ScoredMotion, r_squared: Option<f64>) -> bool {
    quantity == ScoredMotion::Acceleration && r_squared.is_some_and(|r2| r2 > EXPLAINED)
}

/// Its error without what a current or a tether adds to every model's.
pub(crate) fn free_error(score: &Score) -> f64 {
    let errors = [score.mean_abs_error, score.offset_free_error];
    errors.into_iter().flatten().fold(f64::INFINITY, f64::min)
}
