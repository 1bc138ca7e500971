//! The inverse transform of a transform is the series.

use seaplant_fourier::RealTransform;

#[test]
fn a_series_of_any_length_comes_back_n_times_as_large() {
    for length in [1, 2, 3, 8, 15] {
        let series: Vec<f64> = (0..length).map(|k| (1.3 * k as f64).cos()).collect();
        let transform = RealTransform::new(length);
        let again = transform.inverse(transform.forward(series.clone()));
        let n = length as f64;
        assert!(again.iter().zip(&series).all(|(a, x)| (a / n - x).abs() < 1e-14), "{length}");
    }
}
