//! Present estimate and its uncertainty.

use nalgebra::{DMatrix, Vector6};

use super::factor::Factor;
use super::recursive::Recursive;
use super::{Engine, Online, OnlineEstimate};
use crate::Error;

impl Online {
    /// Returns the present estimate.
    ///
    /// # Errors
    /// [`Error::Plant`] if no estimate is available yet.
    pub fn estimate(&self) -> Result<OnlineEstimate, Error> {
        let p = self.projected.len();
        let information = self.recursive.information();
        let mut covariance = covariance(&self.recursive);
        let free: Vec<usize> = (0..p).filter(|k| self.recursive.held()[*k].is_none()).collect();
        let scaled = DMatrix::from_fn(free.len(), free.len(), |a, b| {
            let (i, j) = (free[a], free[b]);
            let (own, other) = (information[i * (p + 1)], information[j * (p + 1)]);
            if own > 0.0 && other > 0.0 {
                information[i * p + j] / (own * other).sqrt()
            } else {
                0.0
            }
        });
        let excitation = scaled.symmetric_eigenvalues().min().max(0.0);
        let inflation = (0..p).map(|k| match self.recursive.held()[k] {
            Some(_) => 1.0,
            None => covariance[(k, k)] * information[k * (p + 1)],
        });
        let inflation = inflation.collect();
        if let Engine::Ekf(Some(joint)) = &self.engine {
            for k in 0..p {
                let factor = (joint.variance(k) / covariance[(k, k)]).max(1.0).sqrt();
                covariance.row_mut(k).scale_mut(factor);
                covariance.column_mut(k).scale_mut(factor);
            }
        }
        Ok(OnlineEstimate {
            plant: self.plant()?,
            std: (0..p).map(|k| covariance[(k, k)].sqrt()).collect(),
            inflation,
            excitation,
            covariance,
            residual: residual(&self.recursive),
            independent_samples: self.recursive.independent_samples(),
            noticeable_change: self.changes.noticeable(),
            elapsed_s: self.elapsed_s,
        })
    }
}

/// Returns the root mean square residual of each axis.
fn residual(recursive: &Recursive) -> Vector6<f64> {
    let mut residual = Vector6::zeros();
    for row in recursive.rows() {
        residual[row.axis] = row.variance.sqrt();
    }
    residual
}

/// Returns the inverse of the information; zero for held coefficients.
pub(super) fn covariance(recursive: &Recursive) -> DMatrix<f64> {
    let (information, held) = (recursive.information(), recursive.held());
    let p = held.len();
    let mut factor = Factor::new(p);
    factor.set(&information, 1e-9);
    let mut covariance = DMatrix::zeros(p, p);
    for k in (0..p).filter(|k| held[*k].is_none()) {
        if information[k * (p + 1)] <= 0.0 {
            covariance[(k, k)] = f64::INFINITY;
            continue;
        }
        let mut unit = vec![0.0; p];
        unit[k] = 1.0;
        factor.solve(&mut unit);
        covariance.column_mut(k).copy_from_slice(&unit);
    }
    covariance
}
