//! Models and the series of figures, which are not part of `results.json`.

use super::Results;
use crate::signal::Spectrum;
use crate::{Comparison, Dof, Method, Model, Role};

/// The series of a figure, too long for `results.json`.
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
    /// Name of a plant of several axes in [`Results::plants`]; absent for an axis alone.
    pub plant: Option<String>,
    /// The method of the plant.
    pub method: Method,
    /// The role of the trial for the plant.
    pub role: Role,
    /// The motion.
    pub comparison: Comparison,
}

/// Spectra of one trial.
#[derive(Clone, Debug, PartialEq)]
pub struct SpectrumFigure {
    /// The degree of freedom.
    pub dof: Dof,
    /// Name of the trial.
    pub trial: String,
    /// Amplitude of force, N or N m.
    pub force: Spectrum,
    /// Amplitude of velocity, m/s or rad/s.
    pub velocity: Spectrum,
}

/// Motion of one steady trial.
#[derive(Clone, Debug, PartialEq)]
pub struct SteadyFigure {
    /// The degree of freedom.
    pub dof: Dof,
    /// Name of the trial.
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

/// A fitted model with its method.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedModel {
    /// The degree of freedom.
    pub dof: Dof,
    /// The method.
    pub method: Method,
    /// The model.
    pub model: Model,
}

/// The outcome of an identification; [`Identification::series`] computes the series of its figures.
#[derive(Clone, Debug, PartialEq)]
pub struct Identification {
    /// The results.
    pub results: Results,
    /// The models of every method, in the order of fitting.
    pub models: Vec<FittedModel>,
}
