//! Sums of residuals for the covariance of an estimate.

use nalgebra::{DMatrix, DVector};

/// Sums of the residuals.
#[derive(Default)]
pub(crate) struct Residuals {
    /// Σ xᵀe of each batch, scaled columns.
    pub(crate) scores: Vec<DVector<f64>>,
    /// Sum of the residuals of each batch, weighted by the constant's column.
    pub(crate) sums: Vec<f64>,
    /// Σ e².
    pub(crate) square_sum: f64,
}

impl Residuals {
    /// Returns S = B/(B − p) Σ sᵦ sᵦᵀ.
    pub(crate) fn meat(&self) -> DMatrix<f64> {
        let (batches, terms) = (self.scores.len(), self.scores[0].len());
        let mut meat = DMatrix::zeros(terms, terms);
        for score in &self.scores {
            meat += score * score.transpose();
        }
        meat * (batches as f64 / self.freedom(terms))
    }

    /// Returns the number of batches less that of terms.
    pub(crate) fn freedom(&self, terms: usize) -> f64 {
        self.scores.len().saturating_sub(terms).max(1) as f64
    }

    /// Returns n σ² / (rows a batch · variance of batch means), never more than n.
    pub(crate) fn effective_samples(&self, samples: usize) -> f64 {
        let n = samples as f64;
        let long_run = self.sums.iter().map(|sum| sum * sum).sum::<f64>() / n;
        let variance = self.square_sum / n;
        if long_run > 0.0 { (n * variance / long_run).min(n) } else { n }
    }

    /// Returns the correlation of the sums of neighbouring batches.
    pub(super) fn correlation_of_neighbours(&self) -> f64 {
        let product: f64 = self.sums.windows(2).map(|pair| pair[0] * pair[1]).sum();
        let square: f64 = self.sums.iter().map(|sum| sum * sum).sum();
        if square > 0.0 { product / square } else { 0.0 }
    }

    /// Merges groups of neighbouring batches.
    pub(super) fn joined(&self, parts: usize) -> Self {
        Self {
            scores: self.scores.chunks(parts).map(|part| part.iter().sum()).collect(),
            sums: self.sums.chunks(parts).map(|part| part.iter().sum()).collect(),
            square_sum: self.square_sum,
        }
    }
}
