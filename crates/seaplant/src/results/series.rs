//! What an identification holds beside its numbers: plants that can be driven, and the series behind
//! figures.

use super::Results;
use crate::signal::Spectrum;
use crate::{Comparison, Dof, Method, Model, Role};

/// The series behind a figure; too long for `results.json`.
#[derive(Clone, Debug, PartialEq)]
pub enum Series {
    /// Simulated and measured motion, by method and trial.
    Comparison(ComparisonFigure),
    /// Spectra of force and velocity of a fitted trial.
    Spectrum(SpectrumFigure),
    /// Motion of a steady trial.
    Steady(SteadyFigure),
}

/// Simulated and measured motion of one trial.
#[derive(Clone, Debug, PartialEq)]
pub struct ComparisonFigure {
    /// The plant of several axes that it is of, by its name in [`Results::coupled`]; absent of a
    /// plant of one axis.
    pub plant: Option<String>,
    /// Whose plant.
    pub method: Method,
    /// Whether the plant was fitted to the trial.
    pub role: Role,
    /// The motion.
    pub comparison: Comparison,
}

/// Spectra of one trial.
#[derive(Clone, Debug, PartialEq)]
pub struct SpectrumFigure {
    /// Which degree of freedom.
    pub dof: Dof,
    /// Which trial.
    pub trial: String,
    /// Amplitude of force, N or N m.
    pub force: Spectrum,
    /// Amplitude of velocity, m/s or rad/s.
    pub velocity: Spectrum,
}

/// Motion of one steady trial.
#[derive(Clone, Debug, PartialEq)]
pub struct SteadyFigure {
    /// Which degree of freedom.
    pub dof: Dof,
    /// Which trial.
    pub trial: String,
    /// Instants of velocity and force, s.
    pub time_s: Vec<f64>,
    /// Velocity, m/s or rad/s.
    pub velocity: Vec<f64>,
    /// Force, N or N m.
    pub force: Vec<f64>,
    /// Instants of position, s; empty if position was not measured.
    pub position_time_s: Vec<f64>,
    /// Position (depth, heading), m or rad.
    pub position: Vec<f64>,
}

/// A plant ready to be driven, and whose it is.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedModel {
    /// Which degree of freedom.
    pub dof: Dof,
    /// Whose.
    pub method: Method,
    /// The plant.
    pub model: Model,
}

/// What was found; [`Identification::series`] gives the series behind its figures.
#[derive(Clone, Debug, PartialEq)]
pub struct Identification {
    /// The numbers.
    pub results: Results,
    /// Every method's plants, in the order in which they were fitted.
    pub models: Vec<FittedModel>,
}
