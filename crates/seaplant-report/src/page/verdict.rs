//! A verdict on the page: a card's, a section's.

use seaplant::results::{Trust, Verdict};
use serde::Serialize;

use crate::words;

#[derive(Serialize)]
pub(crate) struct VerdictView {
    trust: &'static str,
    trust_class: String,
    reason: String,
    /// The motion that unseen trials confirm; empty if none was tested.
    good_for: String,
    /// By how much numbers may be off; empty if none is named.
    may_be_off: String,
}

impl VerdictView {
    pub(crate) fn of(verdict: &Verdict) -> Self {
        Self {
            trust: verdict.trust.name(),
            trust_class: class(verdict.trust),
            reason: words::capitalised(&verdict.reason),
            good_for: words::good_for(verdict),
            may_be_off: words::may_be_off(verdict),
        }
    }
}

/// Returns the class of a level of trust in the style sheet.
pub(crate) fn class(trust: Trust) -> String {
    trust.name().replace(' ', "-")
}
