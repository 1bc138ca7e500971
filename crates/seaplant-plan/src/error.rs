//! Errors of planning.

use seaplant::Dof;

/// Why there is no plan.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The plant, its thrusters or its records cannot be.
    #[error(transparent)]
    Plant(#[from] seaplant::Error),
    /// A vehicle file says too little to guess a plant from.
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
    /// A limit that cannot be.
    #[error("limit {name} is {found}; expected {expected}")]
    Limit {
        /// Its key.
        name: &'static str,
        /// The given value.
        found: String,
        /// The accepted values.
        expected: String,
    },
    /// No manoeuvre is left.
    #[error("no manoeuvre is allowed: {reason}")]
    NoMotion {
        /// The limits in the way.
        reason: String,
    },
    /// A goal that cannot be read.
    #[error("goal `{text}`: {reason}")]
    Goal {
        /// As it was given.
        text: String,
        /// The reason, and the accepted form.
        reason: String,
    },
    /// A goal that no allowed manoeuvre serves.
    #[error("goal `{goal}`: no allowed manoeuvre excites it: {limit}")]
    NotExcited {
        /// The coefficient.
        goal: String,
        /// The limit that is in the way.
        limit: String,
    },
    /// A setting that cannot be.
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
    /// The template of the deck page cannot be filled in.
    #[error("page for the deck: {0}")]
    Page(#[from] minijinja::Error),
    /// Commands cannot be written as a table.
    #[error("table of commands: {0}")]
    Table(#[from] csv::Error),
}
