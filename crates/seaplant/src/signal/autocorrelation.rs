/// Computes the autocorrelation of a uniform series at given lags, its mean removed.
///
/// `r_k = Σ (x_t − x̄)(x_{t+k} − x̄) / Σ (x_t − x̄)²`, the biased estimate, whose magnitude is at
/// most 1; lags are in samples. For white noise, r_k beyond lag 0 is within ±1.96/√n in 95 % of
/// cases. For a constant it is defined as 0.
///
/// # Source
/// G. E. P. Box and G. M. Jenkins, *Time Series Analysis*, §2.1.
///
/// ```
/// let x: Vec<f64> = (0..600).map(|k| (0.1 * k as f64).sin()).collect();
/// let r = seaplant::signal::autocorrelation(&x, [0, 31, 63]);
/// assert_eq!(r[0], 1.0);
/// assert!(r[1] < -0.9 && r[2] > 0.85); // half a period, a whole one
/// ```
pub fn autocorrelation(x: &[f64], lags: impl IntoIterator<Item = usize>) -> Vec<f64> {
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    let sum: f64 = x.iter().map(|x| (x - mean).powi(2)).sum();
    let at = |lag: usize| {
        let late = x.get(lag..).unwrap_or_default();
        let products = x.iter().zip(late).map(|(early, late)| (early - mean) * (late - mean));
        if sum > 0.0 { products.sum::<f64>() / sum } else { 0.0 }
    };
    lags.into_iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alternating_series_by_hand() {
        // x - mean = 1, -1, 1, -1; products at lag 1: -3 of 4, at lag 2: 2 of 4.
        assert_eq!(autocorrelation(&[3.0, 1.0, 3.0, 1.0], [0, 1, 2, 9]), [1.0, -0.75, 0.5, 0.0]);
    }

    #[test]
    fn a_constant_and_an_empty_series_have_zero_autocorrelation() {
        assert_eq!(autocorrelation(&[2.0; 5], [0, 1]), [0.0, 0.0]);
        assert_eq!(autocorrelation(&[], [0]), [0.0]);
    }
}
