//! The verdict on a plant: its level of trust, with reasons.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::good_for::GoodFor;
use super::off::MayBeOff;
use super::score::Score;
use super::working::drag_at;
use crate::caveat::spoken;
use crate::{Caveat, CaveatCode, Estimate, Fit, Severity, Term};

/// Level of trust in a plant.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Trust {
    /// There is a reason not to use it.
    DoNotUse,
    /// Nothing confirms it.
    Doubtful,
    /// It predicts, and there are warnings to read.
    UsableWithCare,
    /// It predicts, without warnings.
    Usable,
}

impl Trust {
    /// Returns the name used in the report.
    pub const fn name(self) -> &'static str {
        match self {
            Self::DoNotUse => "do not use",
            Self::Doubtful => "doubtful",
            Self::UsableWithCare => "usable with care",
            Self::Usable => "usable",
        }
    }
}

/// Verdict on a plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Verdict {
    /// Level of trust.
    pub trust: Trust,
    /// Reason, in one sentence without initial capital and full stop.
    pub reason: String,
    /// The caveats that determine it, the most severe first.
    pub codes: Vec<CaveatCode>,
    /// Motion that unseen trials confirm; absent where no trial was held out or used in
    /// cross-validation.
    #[serde(default)]
    pub good_for: Option<GoodFor>,
    /// Possible errors of numbers: all of a doubtful plant, else those above the limit of a usable
    /// one.
    #[serde(default)]
    pub may_be_off: Vec<MayBeOff>,
}

impl Verdict {
    /// Creates a verdict without statements on motion and numbers.
    pub fn new(trust: Trust, reason: impl Into<String>, codes: Vec<CaveatCode>) -> Self {
        Self { trust, reason: reason.into(), codes, good_for: None, may_be_off: Vec::new() }
    }

    /// Formats the motion that unseen trials confirm; `None` of a plant that is not to be used.
    ///
    /// A doubtful plant predicts that motion, which does not make it good for anything.
    pub fn spoken_good_for(&self) -> Option<String> {
        let words = &self.good_for.as_ref()?.words;
        match self.trust {
            Trust::DoNotUse => None,
            Trust::Doubtful => Some(format!("predicts held-out trials of {words}")),
            Trust::UsableWithCare | Trust::Usable => Some(format!("good for {words}")),
        }
    }

    /// Formats the possible errors of numbers as a sentence, those of the same size and cause together; `None` if there
    /// are none.
    pub fn spoken_off(&self) -> Option<String> {
        let mut all: Vec<(String, Vec<&str>)> = Vec::new();
        for off in &self.may_be_off {
            let (name, how_much) = (off.number.as_str(), off.how_much());
            match all.iter_mut().find(|(own, _)| *own == how_much) {
                Some((_, names)) => names.push(name),
                None => all.push((how_much, vec![name])),
            }
        }
        let spoken =
            |(how_much, names): (String, Vec<&str>)| format!("{} {how_much}", names.join(", "));
        let all: Vec<String> = all.into_iter().map(spoken).collect();
        (!all.is_empty()).then(|| format!("may be off: {}", all.join("; ")))
    }
}

impl Default for Verdict {
    /// Default for results written before verdicts existed.
    fn default() -> Self {
        let reason = "it was not judged when these results were written".to_owned();
        Self::new(Trust::Doubtful, reason, Vec::new())
    }
}

/// Judges plants by their caveats.
#[derive(Clone, Copy)]
pub(crate) struct Judge<'a>(pub(crate) &'a [Caveat]);

impl<'a> Judge<'a> {
    fn with(self, severity: Severity) -> impl Iterator<Item = &'a Caveat> {
        self.0.iter().filter(move |caveat| caveat.severity == severity)
    }

    /// Returns the warnings.
    pub(crate) fn warnings(self) -> impl Iterator<Item = &'a Caveat> {
        self.with(Severity::Warning)
    }

    /// Returns a verdict with the codes of all caveats but notes.
    pub(crate) fn verdict(self, trust: Trust, reason: impl Into<String>) -> Verdict {
        let codes = self.with(Severity::Severe).chain(self.warnings()).map(|caveat| caveat.code);
        Verdict::new(trust, reason, codes.collect())
    }

    /// Returns the verdict on a plant that has a severe caveat.
    pub(crate) fn severe(self) -> Option<Verdict> {
        let first = self.with(Severity::Severe).next()?;
        let more = match self.with(Severity::Severe).count() - 1 {
            0 => String::new(),
            more => format!(" and {more} more below"),
        };
        let reason = format!("severe caveat: {}{more}", first.code.words());
        Some(self.verdict(Trust::DoNotUse, reason))
    }

    /// Returns the verdict on a plant that unseen trials confirm: with care where there are warnings, or where a
    /// plant without them is no more than that.
    pub(crate) fn confirmed(self, best: Trust, predicts: &str) -> Verdict {
        match self.warnings().count() {
            0 if best == Trust::Usable => self.verdict(best, format!("no warning, {predicts}")),
            0 => self.verdict(best, predicts),
            1 => self.verdict(Trust::UsableWithCare, format!("1 warning, {predicts}")),
            n => self.verdict(Trust::UsableWithCare, format!("{n} warnings, {predicts}")),
        }
    }
}

/// Returns the statement of a caveat, without its advice.
pub(crate) fn statement(message: &str) -> String {
    message.split(": ").next().unwrap_or_default().to_owned()
}

/// Ratio of the ends of a mass interval above which mass is undetermined.
pub(crate) const WIDEST_MASS: f64 = 2.0;
/// Relative half-width of the interval above which drag at working speed is undetermined.
pub(crate) const WIDEST_DRAG: f64 = 0.5;
/// Relative error of the mass that is acceptable for a usable plant …
pub(crate) const KNOWN_MASS: f64 = 0.10;
/// … and relative error of the drag.
pub(crate) const KNOWN_DRAG: f64 = 0.20;

/// Advice for narrower intervals.
pub(crate) const MORE: &str = "drive longer, faster, and at more than one frequency";

/// Returns caveats for intervals that are too wide for a usable plant; `speed` is the typical
/// speed.
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

/// Minimum R² of the simulated path that confirms a plant.
const FOLLOWED: f64 = 0.95;

/// Returns true if unseen trials determine the plant and agree with it, even if velocity noise or forces that
/// are not logged hide the quality of its prediction: they support no change, or the simulation follows the
/// measured path of each.
pub(crate) fn vouched<'a>(score: &Score, trials: impl Iterator<Item = &'a Score>) -> bool {
    let follows = |trial: &Score| trial.position_r_squared.is_some_and(|r| r > FOLLOWED);
    let mut trials = trials.peekable();
    let follows_all = trials.peek().is_some() && trials.all(follows);
    follows_all || score.is_vouched() || score.change.is_some_and(|change| change.vouches())
}
