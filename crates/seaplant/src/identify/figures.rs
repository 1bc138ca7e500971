//! Data series of the figures, computed on demand, as those of long logs are too large to keep.

use super::TrialsOf;
use super::plants::compare_fitted_plant;
use crate::diagnose::force_spectrum;
use crate::results::{
    ComparisonFigure, FittedModel, Identification, Series, SpectrumFigure, SteadyFigure,
};
use crate::signal::{Spectrum, amplitude_spectrum};
use crate::{Dof, Error, Role, Trial, VelocitySource, evaluate};

impl Identification {
    /// Returns the series of each figure in sequence; `trials` are those that were identified.
    ///
    /// The order is: simulated and measured motion by method and trial, where the simulation does
    /// not diverge; the same for plants of several axes, axis by axis; spectra of the fitted
    /// trials; motion of the steady trials.
    pub fn series<'a>(&'a self, trials: &'a [Trial]) -> impl Iterator<Item = Series> + 'a {
        let comparisons = self.models.iter().flat_map(|fitted| comparisons(fitted, trials));
        let of = |dof| TrialsOf::new(dof, trials);
        let fitted = Dof::ALL.into_iter().flat_map(move |dof| {
            of(dof).fit.into_iter().filter_map(move |trial| spectrum_figure(dof, trial).ok())
        });
        let steady = Dof::ALL.into_iter().flat_map(move |dof| {
            of(dof).steady.into_iter().filter_map(move |trial| steady_figure(dof, trial).ok())
        });
        comparisons.chain(self.of_several_axes(trials)).chain(fitted).chain(steady)
    }

    /// Returns the motion of plants of several axes.
    fn of_several_axes<'a>(&'a self, trials: &'a [Trial]) -> impl Iterator<Item = Series> + 'a {
        self.results.together().flat_map(move |(name, plant)| {
            let unsteady = trials.iter().filter(|trial| trial.role() != Role::Steady);
            unsteady.flat_map(move |trial| {
                let figure = |comparison| {
                    let (plant, method) = (Some(name.clone()), plant.method);
                    let figure = ComparisonFigure { plant, method, role: trial.role(), comparison };
                    Series::Comparison(figure)
                };
                // A trial that was left out of the fit has no figure.
                let comparisons = compare_fitted_plant(plant, trial).unwrap_or_default();
                comparisons.into_iter().map(figure).collect::<Vec<_>>()
            })
        })
    }
}

fn comparisons<'a>(
    FittedModel { dof, method, model }: &'a FittedModel,
    trials: &'a [Trial],
) -> impl Iterator<Item = Series> + 'a {
    let TrialsOf { fit, hold_out, .. } = TrialsOf::new(*dof, trials);
    fit.into_iter().chain(hold_out).filter_map(|trial| {
        let comparison = evaluate(*dof, model, trial).ok()?;
        let (method, role) = (*method, trial.role());
        Some(Series::Comparison(ComparisonFigure { plant: None, method, role, comparison }))
    })
}

fn spectrum_figure(dof: Dof, trial: &Trial) -> Result<Series, Error> {
    let ready = trial.axis(dof, VelocitySource::Measured)?.ready(0)?;
    let velocity = match ready.longest() {
        Some(longest) => amplitude_spectrum(&longest.velocity(longest.grid)?, ready.sample_hz),
        None => Spectrum::default(),
    };
    let (trial, force) = (trial.name().to_owned(), force_spectrum(&ready));
    Ok(Series::Spectrum(SpectrumFigure { dof, trial, force, velocity }))
}

fn steady_figure(dof: Dof, trial: &Trial) -> Result<Series, Error> {
    let axis = trial.axis(dof, VelocitySource::Measured)?;
    let velocity = axis.velocity()?;
    let (position_time_s, position) = axis
        .position
        .as_ref()
        .map_or_else(Default::default, |p| (p.time_s().to_vec(), p.values().to_vec()));
    Ok(Series::Steady(SteadyFigure {
        dof,
        trial: trial.name().to_owned(),
        force: velocity.time_s().iter().map(|&t| axis.force.held_at(t)).collect(),
        time_s: velocity.time_s().to_vec(),
        velocity: velocity.values().to_vec(),
        position_time_s,
        position,
    }))
}
