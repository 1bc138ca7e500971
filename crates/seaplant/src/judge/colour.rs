//! Test of the innovations for whiteness.

use crate::estimate::Innovations;

/// Maximum lag.
pub(crate) const LAGS: usize = 40;

/// Computes the Box–Pierce statistic divided by its expectation, `n Σ r_k² / K` over lags 1 … K ≤
/// 40, averaged over trials: 1 for white innovations; `None` without any.
///
/// # Source
/// G. E. P. Box, D. A. Pierce, "Distribution of residual autocorrelations in
/// autoregressive-integrated moving average time series models", *JASA* 65, 1970.
///
/// ```
/// # use seaplant::estimate::Innovations;
/// let of = |r: f64| Innovations { trial: "a".into(), samples: 1000, autocorrelation: vec![1.0, r, -r] };
/// // 1000 · 2 · 0.1² / 2
/// assert!((seaplant::box_pierce(&[of(0.1)]).unwrap() - 10.0).abs() < 1e-12);
/// ```
pub fn box_pierce(innovations: &[Innovations]) -> Option<f64> {
    let of = |one: &Innovations| {
        let lags = lags(one);
        let square: f64 = lags.iter().map(|r| r * r).sum();
        (!lags.is_empty()).then(|| one.samples as f64 * square / lags.len() as f64)
    };
    let all: Vec<f64> = innovations.iter().filter_map(of).collect();
    (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
}

fn lags(one: &Innovations) -> &[f64] {
    let last = one.autocorrelation.len().min(LAGS + 1);
    one.autocorrelation.get(1..last).unwrap_or_default()
}
