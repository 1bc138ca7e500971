//! Unsteady trials and steady runs in one fit, and whether they ask for one plant.

use nalgebra::Matrix4;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::estimate::plant_fit::{FittedAxis, OneAxis};
use crate::estimate::{Fit, PhysicalEstimates};
use crate::terms::Term;
use crate::{AxisRecord, Error};

/// Whether steady runs ask for the drag and bias force that unsteady trials ask for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteadyTest {
    /// Wald's statistic `δᵀ (Σ_u + Σ_s)⁻¹ δ` of the difference δ between both plants: to second order,
    /// twice what the log-likelihood gains if they may differ.
    pub likelihood_ratio: f64,
    /// How many numbers may then differ: terms but the mass.
    pub numbers: usize,
    /// How often chance alone would make as large a gain.
    pub p_value: f64,
    /// Whether they agree, and steady runs are part of the fit.
    pub agrees: bool,
    /// The plant of unsteady trials, if the two may differ.
    pub unsteady: PhysicalEstimates,
    /// The plant of steady runs, of the same mass.
    pub steady: PhysicalEstimates,
}

/// They agree unless chance alone would part them as far once in a hundred campaigns.
const LEAST_P: f64 = 0.01;

/// Fits all trials, steady ones among them, if these ask for the same plant as the others.
///
/// # Errors
/// As [`OneAxis::fit`].
pub(super) fn joined(
    fit: Fit,
    fitted: &FittedAxis,
    (unsteady, steady): (&[AxisRecord], &[AxisRecord]),
) -> Result<Fit, Error> {
    let Ok((lumped, covariance)) = fitted.steady_plant(steady) else { return Ok(fit) };
    let own = PhysicalEstimates::of(&lumped, &covariance, fit.terms, fit.t_freedom);
    let of_steady = lumped.physical_covariance(&covariance);
    let of_fit = fit.lumped.physical_covariance(&(fit.covariance - fit.thrust_covariance));
    let moved = [
        (Term::Quadratic, lumped.to_physical().d_quadratic - fit.physical().d_quadratic),
        (Term::Linear, lumped.to_physical().d_linear - fit.physical().d_linear),
        (Term::Bias, lumped.to_physical().bias_force - fit.physical().bias_force),
    ];
    let moved: Vec<(usize, f64)> = moved
        .into_iter()
        .filter(|(term, _)| fit.terms.has(*term))
        .map(|(term, x)| (term as usize, x))
        .collect();
    let Some((statistic, p_value)) = wald(&moved, &(of_steady + of_fit)) else { return Ok(fit) };
    let agrees = p_value >= LEAST_P;
    let test = SteadyTest {
        likelihood_ratio: statistic,
        numbers: moved.len(),
        p_value,
        agrees,
        unsteady: fit.estimates(),
        steady: own,
    };
    if !agrees {
        return Ok(Fit { steady_test: Some(test), ..fit });
    }
    let admitted = fit.structure.iter().filter(|decision| decision.admitted);
    let required: Vec<_> = admitted.map(|decision| decision.candidate).collect();
    let all = [unsteady, steady].concat();
    let asked = OneAxis {
        dof: fit.dof,
        axes: &all,
        candidates: &[],
        required: &required,
        terms: Some(fit.terms),
        from: fit.start.as_ref(),
    };
    Ok(match asked.fit() {
        Ok((together, _)) => Fit { steady_test: Some(test), structure: fit.structure, ..together },
        Err(_) => Fit { steady_test: Some(SteadyTest { agrees: false, ..test }), ..fit },
    })
}

/// Returns Wald's statistic of numbers, by place, and how often chance makes as much.
fn wald(moved: &[(usize, f64)], covariance: &Matrix4<f64>) -> Option<(f64, f64)> {
    let places: Vec<usize> = moved.iter().map(|(place, _)| *place).collect();
    let own = covariance.select_rows(&places).select_columns(&places);
    let delta = nalgebra::DVector::from_iterator(moved.len(), moved.iter().map(|(_, x)| *x));
    let statistic = delta.dot(&own.clone().cholesky()?.solve(&delta));
    Some((statistic, ChiSquared::new(moved.len() as f64).ok()?.sf(statistic)))
}
