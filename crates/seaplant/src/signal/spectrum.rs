use std::f64::consts::PI;

use seaplant_fourier::RealTransform;

/// Amplitudes of a series by frequency.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spectrum {
    /// Frequencies from 0 to half the sampling rate, Hz.
    pub frequency_hz: Vec<f64>,
    /// Amplitude of the sinusoid at each frequency, in units of the signal.
    pub amplitude: Vec<f64>,
}

impl Spectrum {
    /// Returns the frequency above zero with the greatest amplitude, Hz; `None` for a constant.
    pub fn dominant_hz(&self) -> Option<f64> {
        self.frequency_hz
            .iter()
            .zip(&self.amplitude)
            .skip(1)
            .max_by(|a, b| a.1.total_cmp(b.1))
            .filter(|(_, amplitude)| **amplitude > 0.0)
            .map(|(frequency, _)| *frequency)
    }
}

/// Computes the amplitude spectrum of a uniform series, its mean removed, under a Hann window.
///
/// A sinusoid `A sin ωt` gives a peak of height A, two bins wide. The series is padded with zeros
/// to twice its length, so that a peak between bins loses little height; a long one to slightly
/// more, where a transform of exactly twice the length could take several times the memory.
///
/// ```
/// let x: Vec<f64> = (0..600).map(|k| 3.0 * (0.785 * 0.1 * k as f64).sin()).collect();
/// let spectrum = seaplant::signal::amplitude_spectrum(&x, 10.0);
/// assert!((spectrum.dominant_hz().unwrap() - 0.125).abs() < 0.01);
/// ```
pub fn amplitude_spectrum(x: &[f64], sample_hz: f64) -> Spectrum {
    let n = x.len();
    if n < 4 {
        return Spectrum::default();
    }
    let mean = x.iter().sum::<f64>() / n as f64;
    let padded = padded_length(n);
    let weight = |k: usize| 0.5 - 0.5 * (2.0 * PI * (k as f64 + 0.5) / n as f64).cos();
    let weight_sum: f64 = (0..n).map(weight).sum();
    let mut windowed = Vec::with_capacity(padded);
    windowed.extend(x.iter().enumerate().map(|(k, x)| weight(k) * (x - mean)));
    let transform = RealTransform::new(padded).forward(windowed);
    let hz = |k: usize| k as f64 * sample_hz / padded as f64;
    Spectrum {
        frequency_hz: (0..transform.len()).map(hz).collect(),
        amplitude: transform.iter().map(|c| 2.0 * c.norm() / weight_sum).collect(),
    }
}

/// Length from which on the memory of the transform matters: two hours at 10 Hz.
const LONG: usize = 72_000;

/// Returns twice the length; for a long series the next even number without a factor above 5, since
/// other factors are transformed by convolutions, which need several times the memory.
fn padded_length(n: usize) -> usize {
    let is_smooth = |k: &usize| {
        let mut rest = *k;
        for factor in [2, 3, 5] {
            while rest.is_multiple_of(factor) {
                rest /= factor;
            }
        }
        rest == 1
    };
    if n < LONG {
        return 2 * n;
    }
    // Doubling keeps it even; a power of two ends the search at the latest.
    2 * (n..=n.next_power_of_two()).find(is_smooth).unwrap_or(n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_peaks_at_its_amplitude() {
        let x: Vec<f64> = (0..4800).map(|k| 7.0 + 1800.0 * (0.0785 * k as f64).sin()).collect();
        let spectrum = amplitude_spectrum(&x, 10.0);
        let peak = spectrum.amplitude.iter().copied().fold(0.0, f64::max);
        assert!((peak / 1800.0 - 1.0).abs() < 0.01, "{peak}");
    }

    #[test]
    fn a_long_series_is_padded_to_a_length_of_small_factors() {
        assert_eq!(padded_length(4801), 9602);
        assert_eq!(padded_length(864_001), 2 * 874_800);
        let tone = |n: usize| (0..n).map(|k| 3.0 * (0.0785 * k as f64).sin()).collect::<Vec<_>>();
        for n in [72_000, 72_001, 75_013] {
            let spectrum = amplitude_spectrum(&tone(n), 10.0);
            let off_hz = spectrum.dominant_hz().expect("a peak") - 0.785 / (2.0 * PI);
            // Half a bin at twice the length.
            assert!(off_hz.abs() < 2.5 / n as f64, "{n}: {off_hz}");
            assert!((spectrum.frequency_hz.last().expect("bins") - 5.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_constant_has_no_dominant_frequency() {
        assert_eq!(amplitude_spectrum(&[5.0; 64], 10.0).dominant_hz(), None);
    }
}
