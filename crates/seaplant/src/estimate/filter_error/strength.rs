//! What uncertain thrust curves do to the covariance of a fit.

use nalgebra::{DMatrix, DVector};

use super::parameters::Unknown;
use super::problem::Problem;
use crate::estimate::descend::scaled_inverse;
use crate::{AxisRecord, ThrustUncertainty};

/// The covariance of all numbers if thrust, each way, is what its curve says only within
/// the uncertainty of the curve; `None` if curves are sure.
///
/// Both strengths join the information as unknowns that are believed to be 1 ± their
/// standard deviation. The logs tell how strong one is beside the other, and nothing of
/// what both have in common.
pub(super) fn covariance_with_thrust(
    problem: &Problem<'_>,
    theta: &DVector<f64>,
    axes: &[AxisRecord],
) -> Option<DMatrix<f64>> {
    let ThrustUncertainty { forward, reverse } = axes.first()?.thrust_uncertainty();
    let beliefs = [(Unknown::LogForwardRatio, forward), (Unknown::LogReverseRatio, reverse)];
    let beliefs = beliefs.into_iter().filter(|(_, std)| *std > 0.0);
    let mut wider = problem.clone();
    let mut own = DVector::from_fn(theta.len(), |j, _| theta[j]);
    let mut believed = DVector::zeros(problem.len());
    for (unknown, std) in beliefs {
        let place = match wider.index(unknown, 0) {
            Some(fitted) => fitted,
            None => {
                wider = wider.with_shared(unknown);
                own = own.push(0.0);
                believed = believed.push(0.0);
                wider.len() - 1
            }
        };
        believed[place] = 1.0 / (std * std);
    }
    if believed.iter().all(|precision| *precision == 0.0) {
        return None;
    }
    let (_, _, information) = wider.evaluate(&own);
    let all = scaled_inverse(&(information + DMatrix::from_diagonal(&believed)))?;
    Some(all.view((0, 0), (problem.len(), problem.len())).into_owned())
}
