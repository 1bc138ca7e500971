//! The magnitude of a signal and of its noise.

use std::borrow::Borrow;

use crate::Timed;

/// Returns the root mean square; zero for no values.
pub(crate) fn rms(values: impl IntoIterator<Item = impl Borrow<f64>>) -> f64 {
    let square = |x: f64| x * x;
    let (sum, count) = values
        .into_iter()
        .fold((0.0, 0_usize), |(sum, count), x| (sum + square(*x.borrow()), count + 1));
    (sum / count.max(1) as f64).sqrt()
}

/// Estimates the standard deviation of one sample's noise from third differences, to which the
/// motion of a vehicle contributes little. `None` if no series has four samples.
///
/// White noise of variance σ² has third differences of variance 20 σ².
pub(crate) fn sample_noise<'a>(series: impl IntoIterator<Item = &'a Timed>) -> Option<f64> {
    let mut runs = series.into_iter().flat_map(|series| series.values().windows(4)).peekable();
    runs.peek()?;
    Some(rms(runs.map(|y| y[3] - 3.0 * y[2] + 3.0 * y[1] - y[0])) / 20_f64.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(values: &[f64]) -> Timed {
        let time_s = (0..values.len()).map(|k| k as f64).collect::<Vec<_>>();
        Timed::new("test", time_s, values.to_vec()).expect("valid")
    }

    #[test]
    fn smooth_motion_has_no_noise() {
        let parabola: Vec<f64> = (0..50).map(|k| 0.1 * f64::from(k * k)).collect();
        assert!(sample_noise([&series(&parabola)]).expect("enough") < 1e-12);
    }

    #[test]
    fn an_impulse_has_third_differences_of_1_3_3_1() {
        let mut values = [0.0; 9];
        values[4] = 2.0;
        let found = sample_noise([&series(&values)]).expect("enough");
        assert!((found - (4.0 * 20.0_f64 / 6.0 / 20.0).sqrt()).abs() < 1e-12, "{found}");
    }

    #[test]
    fn too_few_samples_give_no_noise() {
        assert_eq!(sample_noise([&series(&[1.0, 2.0, 3.0])]), None);
        assert_eq!(rms([0.0; 0]), 0.0);
        assert!((rms([3.0, 4.0]) - 12.5_f64.sqrt()).abs() < 1e-15);
    }
}
