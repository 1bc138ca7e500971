//! The verdict on a plant: its level of trust, with reasons.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::good_for::GoodFor;
use super::off::MayBeOff;
use super::score::Score;
use crate::{Caveat, CaveatCode, Severity};

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
