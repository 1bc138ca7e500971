//! The filter error method on one axis: maximum likelihood on the innovations of a Kalman filter.

mod doubts;
mod steady;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::plant_fit::{Lever, OneAxis};
use super::{Candidate, Decision, Estimate, Fit, Records};
use crate::{AxisRecord, Error, LumpedParameters};
use doubts::{
    fitted_to_pieces, fitted_to_some, hidden_drag, hurried_disturbance, lag_or_mass, struck_out,
    tilted_accelerometer,
};
pub use steady::SteadyTest;

/// The filter error method with its choices.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FilterError {
    /// What may be taken into the model where the logs ask for it.
    pub candidates: Vec<Candidate>,
    /// What is part of the model whatever the logs say.
    pub required: Vec<Candidate>,
}

impl Default for FilterError {
    fn default() -> Self {
        Self { candidates: Candidate::ALL.to_vec(), required: Vec::new() }
    }
}

impl FilterError {
    /// Fits the plant by maximum likelihood on the innovations of a Kalman filter.
    ///
    /// It is [`fit_plant`](super::fit_plant) of one axis: states are velocity, a Gauss–Markov
    /// disturbance and, where it was measured without velocity, position. Thrust follows its log
    /// after a lag of propeller speed and a delay, with reverse thrust scaled by κ; each trial may
    /// have a current. Each [`Candidate`] is admitted if the logs ask for it; a bias force is left
    /// out if they show that it is too small to matter.
    ///
    /// Steady records are fitted with the others if a test finds that they ask for the same drag
    /// and bias force; else they are not, and [`Fit::steady_test`] has both.
    ///
    /// # Errors
    /// As [`Records::dof`]; [`Error::TooShort`] if the records hold fewer rows than coefficients;
    /// [`Error::NotConverged`] if no optimum is reached.
    ///
    /// # Source
    /// [Jategaonkar2015, ch. 5]: filter error method; score test: \[Rao1948\].
    ///
    /// # Example
    /// ```
    /// use seaplant::estimate::FilterError;
    /// use seaplant::twin::{TwinSpec, make};
    /// use seaplant::{Dof, Trial, TrialSetup, VelocitySource};
    ///
    /// let spec = TwinSpec { dofs: [Dof::Surge].into(), duration_s: 240.0, ..TwinSpec::jason2() };
    /// let twin = make(&spec)?;
    /// let setup = TrialSetup { dofs: vec![Dof::Surge], ..TrialSetup::default() };
    /// let trial = Trial::new(setup, &twin.trials[0].recording, &twin.vehicle)?;
    /// let records = [trial.axis(Dof::Surge, VelocitySource::Measured)?];
    /// let fit = FilterError::default().fit(&records)?;
    /// assert!(fit.estimates().mass.covers(12_970.2));
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn fit<'a>(&self, records: impl Into<Records<'a>>) -> Result<Fit, Error> {
        self.fit_with(records.into(), None)
    }

    /// As [`FilterError::fit`], from a fit of the same records by this method with other terms, to compare both.
    ///
    /// The noise is that of the other fit, filter gains are fixed in each step, and steps end at about a standard deviation.
    ///
    /// # Errors
    /// As [`FilterError::fit`].
    pub fn fit_from<'a>(&self, records: impl Into<Records<'a>>, from: &Fit) -> Result<Fit, Error> {
        self.fit_with(records.into(), Some(from))
    }

    fn fit_with(&self, records: Records<'_>, from: Option<&Fit>) -> Result<Fit, Error> {
        let dof = records.dof()?;
        let some = some_of(records.fit);
        let axes = some.as_deref().unwrap_or(records.fit);
        let pieces = pieces_of(axes);
        let axes = pieces.as_deref().unwrap_or(axes);
        // Pieces do not begin and end with their trials.
        let of_trials = [Candidate::ThrustChangeWithin, Candidate::ThrustChangeBetween];
        let is_whole = pieces.is_none();
        let can_be = |candidate: &&Candidate| {
            let is_told = is_whole || !of_trials.contains(candidate);
            is_told
                && candidate.exists_in(axes)
                && !(candidate.is_term() && records.terms.is_some())
        };
        let required: Vec<Candidate> = self.required.iter().filter(can_be).copied().collect();
        let candidates = self.candidates.iter().filter(can_be);
        let candidates: Vec<Candidate> =
            candidates.filter(|own| !required.contains(own)).copied().collect();
        let asked = OneAxis {
            dof,
            axes,
            candidates: &candidates,
            required: &required,
            terms: records.terms,
            from: from.and_then(|from| from.start.as_ref()),
        };
        let of_axis = |error| match error {
            Error::Plant { .. } => Error::NotConverged { dof, iterations: MOST_ITERATIONS },
            other => other,
        };
        let scale = AxisRecord::scale_by_position(axes);
        let scale = scale.filter(|_| asked.may_have(Candidate::VelocityScale));
        let scaled: Vec<AxisRecord> = scale
            .iter()
            .flat_map(|(scale, _)| axes.iter().map(|axis| axis.with_velocity_scaled(*scale)))
            .collect();
        let axes = if scaled.is_empty() { axes } else { &scaled };
        // What a fit of the same trials found of the sensor holds for those that start from it.
        let known = asked.from.map(|from| from.lever_m).filter(|lever| *lever != [0.0; 2]);
        let levered: Vec<AxisRecord> = known
            .iter()
            .flat_map(|lever| axes.iter().map(|axis| axis.with_lever(*lever)))
            .collect();
        let axes = if levered.is_empty() { axes } else { &levered };
        let asked = OneAxis { axes, ..asked };
        let (mut fit, fitted) = asked.fit().map_err(of_axis)?;
        if let Some(Lever { value, std }) = fitted.lever {
            let freedom = fit.t_freedom;
            let own =
                |k: usize| (value[k] != 0.0).then(|| Estimate::new(value[k], std[k], freedom));
            fit.nuisances.lever_m = [own(0), own(1)];
        }
        let by = scale.map_or(1.0, |(scale, _)| scale);
        let steady: Vec<AxisRecord> =
            records.steady.iter().map(|axis| axis.with_velocity_scaled(by)).collect();
        let fit = match steady.is_empty() {
            true => fit,
            false => steady::joined(fit, &fitted, (axes, &steady))?,
        };
        let mut fit = scale.iter().fold(fit, |fit, scale| with_velocity_scale(fit, *scale));
        fit.caveats.extend(hurried_disturbance(&fit, axes));
        fit.caveats.extend(tilted_accelerometer(dof, axes));
        fit.caveats.extend(hidden_drag(&fit, axes));
        fit.caveats.extend(struck_out(dof, fitted.spikes, fit.samples));
        if !candidates.is_empty() {
            fit.caveats.extend(lag_or_mass(&fit, fitted.with_lags_exchanged(axes)));
        }
        if some.is_some() {
            fit.caveats.push(fitted_to_some(dof, MOST_TRIALS, records.fit.len()));
        }
        if pieces.is_some() {
            fit.caveats.push(fitted_to_pieces(dof, samples_of(axes), samples_of(records.fit)));
            fit.innovations.dedup_by(|next, first| next.trial == first.trial);
        }
        Ok(fit)
    }
}

/// Adds the uncertainty of velocities that were corrected by a scale of position over velocity:
/// `α ∝ s`, `β ∝ 1/s` and `bias ∝ s`.
fn with_velocity_scale(mut fit: Fit, (scale, std): (f64, f64)) -> Fit {
    let part = std / scale;
    let LumpedParameters { alpha, beta, bias, .. } = fit.lumped;
    let by = nalgebra::Vector4::new(alpha, -beta, 0.0, bias) * part;
    fit.covariance += by * by.transpose();
    // What the sensor reads over what is true.
    let reads = Estimate::new(1.0 / scale, part / scale, fit.t_freedom);
    fit.nuisances.velocity_scale = Some(reads);
    fit.structure.push(Decision {
        candidate: Candidate::VelocityScale,
        likelihood_ratio: ((scale - 1.0) / std).powi(2),
        needed: AxisRecord::SCALE_SHOWS.powi(2),
        size: None,
        admitted: true,
    });
    fit
}

/// The most steps of a descent, as its error states them.
const MOST_ITERATIONS: usize = 60;

/// Of more trials than this some are fitted: each may have a current of its own, and a step takes
/// time with the cube of their number.
pub(crate) const MOST_TRIALS: usize = 300;

/// Of more samples than this a part is fitted: a fit takes some fifty passes, and more samples hardly change it.
const MOST_FITTED: usize = 20_000;

/// How long the pieces of long records are, s: many time constants of a vehicle.
const PIECE_S: f64 = 120.0;

/// A piece with fewer samples says nothing.
const LEAST_OF_PIECE: usize = 30;

fn samples_of(axes: &[AxisRecord]) -> usize {
    axes.iter().map(|axis| axis.motion.series().len()).sum()
}

/// Evenly spread pieces of long records; `None` of short ones.
fn pieces_of(axes: &[AxisRecord]) -> Option<Vec<AxisRecord>> {
    let part = MOST_FITTED as f64 / samples_of(axes) as f64;
    let pieces = |axis: &AxisRecord| -> Vec<AxisRecord> {
        let motion = axis.motion.series();
        let (from_s, length_s) = (motion.first_s(), motion.last_s() - motion.first_s());
        let count = (part * length_s / PIECE_S).ceil().max(1.0);
        let piece = |k: usize| {
            let middle_s = from_s + (k as f64 + 0.5) * length_s / count;
            let half_s = 0.5 * part * length_s / count;
            axis.window([middle_s - half_s, middle_s + half_s])
        };
        let all = (0..count as usize).filter_map(piece);
        all.filter(|piece| piece.motion.series().len() >= LEAST_OF_PIECE).collect()
    };
    (part < 1.0).then(|| axes.iter().flat_map(pieces).collect())
}

/// Evenly spread ones of many trials; `None` of few.
fn some_of(axes: &[AxisRecord]) -> Option<Vec<AxisRecord>> {
    let place = |k: usize| k * axes.len() / MOST_TRIALS;
    (axes.len() > MOST_TRIALS).then(|| (0..MOST_TRIALS).map(|k| axes[place(k)].clone()).collect())
}
