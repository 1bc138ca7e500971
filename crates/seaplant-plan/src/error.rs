//! Errors of planning.

use seaplant::Dof;

/// Reason why there is no plan.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An invalid plant, thruster or record.
    #[error(transparent)]
    Plant(#[from] seaplant::Error),
    /// A vehicle file with too little information for a prior.
    #[error("vehicle `{name}`: {found}; {advice}")]
    Prior {
        /// The vehicle.
        name: String,
        /// The missing or impossible number.
        found: String,
        /// Advice.
        advice: String,
    },
    /// The greatest thrust of a thruster is not stated.
    #[error(
        "the curve of thruster `{name}` has no end, so that its greatest thrust is not known; give the input of full thrust in the curve's unit ({unit} from neutral), as --full-input 300"
    )]
    FullInput {
        /// The thruster.
        name: String,
        /// The unit of its input.
        unit: &'static str,
    },
    /// An invalid limit.
    #[error("limit {name} is {found}; expected {expected}")]
    Limit {
        /// Its key.
        name: &'static str,
        /// The given value.
        found: String,
        /// The accepted values.
        expected: String,
    },
    /// No manoeuvre is possible.
    #[error("no manoeuvre is allowed: {reason}")]
    NoMotion {
        /// The limits that prevent it.
        reason: String,
    },
    /// An unreadable goal.
    #[error("goal `{text}`: {reason}")]
    Goal {
        /// The goal as given.
        text: String,
        /// The reason, and the accepted form.
        reason: String,
    },
    /// A goal that no allowed manoeuvre excites.
    #[error("goal `{goal}`: no allowed manoeuvre excites it: {limit}")]
    NotExcited {
        /// The coefficient.
        goal: String,
        /// The limit that prevents it.
        limit: String,
    },
    /// A mission that cannot be simulated.
    #[error("mission: {reason}")]
    Mission {
        /// What was found, and the accepted form.
        reason: String,
    },
    /// A controller that cannot be designed.
    #[error("controller: {0}")]
    Controller(#[from] seaplant_control::Error),
    /// An invalid setting.
    #[error("{name} is {found}; expected {expected}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// The given value.
        found: String,
        /// The accepted values.
        expected: &'static str,
    },
    /// An axis that the plant lacks.
    #[error("the plant has no {dof}; it has {known}")]
    Axis {
        /// The axis.
        dof: Dof,
        /// Those that it has.
        known: String,
    },
    /// The convex program of the minutes was not solved.
    #[error("the minutes cannot be allocated: {reason}")]
    Allocation {
        /// The solver's reason.
        reason: String,
    },
    /// A plan that cannot be compared with a dive.
    #[error("plan of `{vehicle}`: {reason}")]
    Outcome {
        /// The vehicle of the plan.
        vehicle: String,
        /// The reason, and advice.
        reason: String,
    },
    /// The template of the deck page cannot be filled in.
    #[error("page for the deck: {0}")]
    Page(#[from] minijinja::Error),
    /// A table of commands or of a mission cannot be written or read.
    #[error("table: {0}")]
    Table(#[from] csv::Error),
}
