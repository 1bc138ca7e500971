//! A trial to propose.

use seaplant::Dof;

use super::activity::{Score, Window};

/// A trial to propose.
pub(super) struct ProposedTrial {
    pub(super) name: String,
    pub(super) logs: Vec<String>,
    /// Which of the mapping's sessions it is of.
    pub(super) session: usize,
    pub(super) window: Window,
    /// The axis that it looks made for, unless it moves several together.
    pub(super) dof: Dof,
    /// The axes that it moves together, if it does.
    pub(super) together: Vec<Dof>,
    pub(super) scores: Vec<Score>,
    /// Whether thrust changes while it works.
    pub(super) varies: bool,
    pub(super) hold_out: bool,
}

impl ProposedTrial {
    /// The axis that it is made for; `None` if it moves several together.
    pub(super) fn alone(&self) -> Option<Dof> {
        self.together.is_empty().then_some(self.dof)
    }
}
