use std::f64::consts::PI;

use realfft::RealFftPlanner;

/// The amplitude of a series at each frequency.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spectrum {
    /// Frequencies from 0 to half the sampling rate, Hz.
    pub frequency_hz: Vec<f64>,
    /// Amplitude of the sinusoid at each, in units of the signal.
    pub amplitude: Vec<f64>,
}

impl Spectrum {
    /// The frequency above zero with the greatest amplitude, Hz; `None` if all is still.
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

/// The amplitude spectrum of a uniform series, its mean removed, under a Hann window.
///
/// A sinusoid `A sin ωt` shows as a peak of height A, two bins wide. The series is
/// padded with zeros to twice its length, so that a peak between bins loses little.
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
    let fft = RealFftPlanner::new().plan_fft_forward(2 * n);
    let mut windowed = fft.make_input_vec();
    let mut weight_sum = 0.0;
    for (k, (w, x)) in windowed.iter_mut().zip(x).enumerate() {
        let weight = 0.5 - 0.5 * (2.0 * PI * (k as f64 + 0.5) / n as f64).cos();
        weight_sum += weight;
        *w = weight * (x - mean);
    }
    let mut transform = fft.make_output_vec();
    if fft.process(&mut windowed, &mut transform).is_err() {
        // Only wrong lengths can fail, and both come from the plan itself.
        return Spectrum::default();
    }
    Spectrum {
        frequency_hz: (0..=n).map(|k| k as f64 * sample_hz / (2 * n) as f64).collect(),
        amplitude: transform.iter().map(|c| 2.0 * c.norm() / weight_sum).collect(),
    }
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
    fn a_constant_has_no_dominant_frequency() {
        assert_eq!(amplitude_spectrum(&[5.0; 64], 10.0).dominant_hz(), None);
    }
}
