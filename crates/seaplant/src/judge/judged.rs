//! A fit with its scores.

use super::score::Scored;
use crate::{AxisRecord, Fit};

/// A fit with its scores and predictions.
pub(crate) struct Judged {
    pub(crate) fit: Fit,
    pub(crate) axes: Vec<AxisRecord>,
    pub(crate) own: Scored,
    pub(crate) hold_out: Option<Scored>,
    pub(crate) left_out: Option<Scored>,
    pub(crate) impossible: Option<String>,
}

impl Judged {
    /// Returns the score on trials outside the fit.
    pub(crate) fn tested(&self) -> Option<&Scored> {
        self.hold_out.as_ref().or(self.left_out.as_ref())
    }

    pub(crate) fn own(&self) -> &Scored {
        &self.own
    }
}
