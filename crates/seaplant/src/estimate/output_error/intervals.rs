//! Covariance of an optimum from the contributions of batches of samples.

use nalgebra::{DMatrix, Matrix4, Vector4};

use super::fit::Solution;
use super::minimise::{Evaluated, Reduced, StartElimination};
use super::sensitivity::Sums;
use super::stretch::Stretch;
use crate::regression::EXCITATION_FLOOR;
use crate::terms::Term;
use crate::{Dof, Error, Terms};

/// Number of batches of a record: few enough that only neighbours are correlated, and enough to
/// estimate a variance.
const BATCHES: usize = 30;

/// Returns the duration of a batch, s.
pub(super) fn batch_s(stretches: &[Stretch]) -> f64 {
    stretches.iter().map(Stretch::duration_s).sum::<f64>() / BATCHES as f64
}

/// Information on the fitted terms, with columns of the Jacobian scaled to unit length; one on the
/// diagonal for other terms.
pub(super) struct ScaledInformation {
    fitted: Vec<Term>,
    /// Zero for terms that are not fitted.
    scale: Vector4<f64>,
    information: Matrix4<f64>,
    inverse: Matrix4<f64>,
    pub(super) condition: f64,
}

impl ScaledInformation {
    pub(super) fn of(dof: Dof, reduced: &Reduced, terms: Terms) -> Result<Self, Error> {
        let fitted = terms.fitted();
        let needed = fitted.len();
        let mut scale = Vector4::zeros();
        fitted.iter().for_each(|&term| scale[term as usize] = reduced.scale[term as usize]);
        let mut information = reduced.information.component_mul(&(scale * scale.transpose()));
        let of_terms = DMatrix::from_fn(needed, needed, |i, j| {
            information[(fitted[i] as usize, fitted[j] as usize)]
        });
        if !of_terms.iter().all(|x| x.is_finite()) {
            return Err(Error::TooLarge { dof });
        }
        let eigen = of_terms.symmetric_eigenvalues();
        // Eigenvalues of JᵀJ are the squares of J's singular values.
        let floor = EXCITATION_FLOOR.powi(2) * eigen.max();
        let rank = eigen.iter().filter(|value| **value > floor).count();
        let not_exciting = Error::NotExciting { dof, rank, needed };
        if rank < needed {
            return Err(not_exciting);
        }
        let others = Term::ALL.into_iter().filter(|term| !terms.has(*term));
        others.for_each(|term| information[(term as usize, term as usize)] = 1.0);
        let inverse = information.cholesky().ok_or(not_exciting)?.inverse();
        let condition = (eigen.max() / eigen.min()).sqrt();
        Ok(Self { fitted, scale, information, inverse, condition })
    }

    /// Computes the influence of each batch on the optimum, by section.
    ///
    /// The optimum is drawn towards each batch, so that its influence is computed with the
    /// information of the others: `(A − A_b)⁻¹ s_b` is the change if it is left out.
    pub(super) fn influences(&self, reduced: &Reduced, at: &Evaluated) -> Influences {
        let of = |(batches, own): (&Vec<Sums>, &StartElimination)| {
            batches.iter().map(|sums| self.influence(own, sums)).collect()
        };
        let stretches = at.batches.iter().zip(&reduced.own).map(of).collect();
        Influences { terms: self.fitted.len(), stretches }
    }

    fn influence(&self, own: &StartElimination, sums: &Sums) -> Vector4<f64> {
        let score = own.reduce(sums).component_mul(&self.scale);
        let scales = self.scale * self.scale.transpose();
        let batch = own.reduced_information(sums).component_mul(&scales);
        match (self.information - batch).cholesky() {
            Some(others) => others.solve(&score),
            // Without this batch some term is not determined.
            None => self.inverse * score,
        }
    }

    /// Converts a covariance of the scaled terms to one of `[α, β, μ, bias]`.
    pub(super) fn unscaled(&self, covariance: &Matrix4<f64>) -> Matrix4<f64> {
        covariance.component_mul(&(self.scale * self.scale.transpose()))
    }

    /// Computes VIF_j = (JᵀJ)⁻¹_jj times the squared norm of column j, after removal of its
    /// projection on the bias.
    pub(super) fn inflation(&self) -> Vec<(Term, f64)> {
        let bias = Term::Bias as usize;
        let of = |&term: &Term| {
            let j = term as usize;
            // Without a bias this row is zero.
            let along = self.information[(j, bias)].powi(2) / self.information[(bias, bias)];
            (term, (self.inverse[(j, j)] * (self.information[(j, j)] - along)).max(1.0))
        };
        self.fitted.iter().filter(|term| **term != Term::Bias).map(of).collect()
    }
}

/// Returns the greatest autocorrelation of any term's influences between neighbouring batches.
pub(super) fn autocorrelation(solution: &Solution) -> Result<f64, Error> {
    let at = &solution.optimum.at;
    let reduced = Reduced::of(&at.totals, 0.0);
    let information = ScaledInformation::of(solution.dof, &reduced, solution.terms)?;
    Ok(information.influences(&reduced, at).autocorrelation().max())
}

/// Influence of each batch on the terms, by section.
pub(super) struct Influences {
    /// Number of fitted terms; the influence on others is zero.
    terms: usize,
    stretches: Vec<Vec<Vector4<f64>>>,
}

/// Upper limit of the autocorrelation of influences: above it, a variance cannot be estimated.
const MOST_AUTOCORRELATION: f64 = 0.9;

/// Lower limit of the degrees of freedom: Student's t with fewer has no useful variance.
pub(super) const LEAST_FREEDOM: f64 = 3.0;

impl Influences {
    fn batches(&self) -> usize {
        self.stretches.iter().map(Vec::len).sum()
    }

    /// Estimates the autocorrelation of each term's influences between neighbouring batches.
    ///
    /// A fit of p terms removes p components from the residuals, which reduces the autocorrelation
    /// if they are slow: by `(p + (p + 3) r) / n` for powers of time; `(1 + 4 r) / n`, for a mean
    /// alone, is the best known case.
    fn autocorrelation(&self) -> Vector4<f64> {
        let (mut product, mut square) = (Vector4::zeros(), Vector4::zeros());
        for batches in &self.stretches {
            batches.windows(2).for_each(|pair| product += pair[0].component_mul(&pair[1]));
            batches.iter().for_each(|own| square += own.component_mul(own));
        }
        let (n, p) = (self.batches() as f64, self.terms as f64);
        let corrected = |product: f64, square: f64| {
            if square == 0.0 {
                return 0.0;
            }
            let r: f64 = product / square;
            (r + (p + (p + 3.0) * r) / n).clamp(0.0, MOST_AUTOCORRELATION)
        };
        product.zip_map(&square, corrected)
    }

    /// Computes the covariance of the sum of influences, and the degrees of freedom of its t
    /// quantiles.
    ///
    /// Degrees of freedom are those of the term with the greatest autocorrelation, so that
    /// intervals of other terms are conservative. The influences of each term are modelled as
    /// `ψ_b = r ψ_(b−1) + w_b`; the covariance of w is multiplied by the variance gain of a sum
    /// with such an autocorrelation.
    pub(super) fn covariance(&self) -> (Matrix4<f64>, f64) {
        let autocorrelation = self.autocorrelation();
        let n = self.batches() as f64;
        let (mut covariance, mut gain) = (Matrix4::zeros(), Vector4::zeros());
        for batches in &self.stretches {
            let mut before: Option<&Vector4<f64>> = None;
            for own in batches {
                let new = match before {
                    Some(before) => own - autocorrelation.component_mul(before),
                    None => own.component_mul(&autocorrelation.map(|r| (1.0 - r * r).sqrt())),
                };
                covariance += new * new.transpose();
                before = Some(own);
            }
            gain += autocorrelation.map(|r| variance_of_sum(batches.len(), r) / n);
        }
        let gain = Matrix4::from_diagonal(&gain.map(f64::sqrt));
        let r = autocorrelation.max();
        let freedom = n * (1.0 - r) / (1.0 + r) - self.terms as f64;
        (gain * covariance * gain, freedom.max(LEAST_FREEDOM))
    }
}

/// Computes the variance of the sum of n numbers from a first-order autoregression with coefficient
/// r and innovations of variance one.
fn variance_of_sum(n: usize, r: f64) -> f64 {
    let pairs: f64 = (1..n).map(|k| 2.0 * (n - k) as f64 * r.powi(k as i32)).sum();
    (n as f64 + pairs) / (1.0 - r * r)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    #[test]
    fn variance_of_a_sum_follows_the_geometric_series() {
        // Three numbers of variance 1/(1 − ¼): 3 + 2 (2 · ½ + ¼) times that.
        assert!((variance_of_sum(3, 0.5) - 5.5 / 0.75).abs() < 1e-12);
        assert_eq!(variance_of_sum(7, 0.0), 7.0);
    }

    fn autoregressive(
        r: f64,
        stretches: usize,
        each: usize,
        random: &mut ChaCha8Rng,
    ) -> Influences {
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let mut stretch = || {
            let mut x = normal();
            let mut next = || {
                let now = x;
                x = r * x + (1.0 - r * r).sqrt() * normal();
                Vector4::new(now, 0.0, 0.0, 0.0)
            };
            (0..each).map(|_| next()).collect()
        };
        Influences { terms: 1, stretches: (0..stretches).map(|_| stretch()).collect() }
    }

    #[test]
    fn covariance_is_that_of_sums_of_correlated_batches() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for (stretches, each) in [(1, 2000), (40, 50)] {
            for r in [0.0, 0.6] {
                let influences = autoregressive(r, stretches, each, &mut random);
                let expected = stretches as f64 * (1.0 - r * r) * variance_of_sum(each, r);
                let (covariance, freedom) = influences.covariance();
                // An autocorrelation from 2000 pairs has an error of 1/50, its series three times
                // as much.
                let ratio = covariance[(0, 0)] / expected;
                assert!((0.75..1.35).contains(&ratio), "{stretches} {r}: {ratio}");
                let independent = 2000.0 * (1.0 - r) / (1.0 + r);
                assert!((0.7..1.2).contains(&(freedom / independent)), "{r}: {freedom}");
            }
        }
    }
}
