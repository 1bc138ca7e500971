//! Proposed trials.

use seaplant::Dof;

use super::activity::{Score, Window};

/// A proposed trial.
pub(super) struct ProposedTrial {
    pub(super) name: String,
    pub(super) logs: Vec<String>,
    /// Index of its session in the mapping.
    pub(super) session: usize,
    pub(super) window: Window,
    /// Its apparent axis, unless it moves several together.
    pub(super) dof: Dof,
    /// Axes that it moves together, if it does.
    pub(super) together: Vec<Dof>,
    pub(super) scores: Vec<Score>,
    /// True if thrust varies while it works.
    pub(super) varies: bool,
    pub(super) hold_out: bool,
}

impl ProposedTrial {
    /// Returns its axis; `None` if it moves several together.
    pub(super) fn alone(&self) -> Option<Dof> {
        self.together.is_empty().then_some(self.dof)
    }
}
