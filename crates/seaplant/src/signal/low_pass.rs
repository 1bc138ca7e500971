use std::f64::consts::PI;

use filtfilt::{FilterPadding, SosFilter, sosfiltfilt};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Error;

/// A Butterworth low-pass filter.
///
/// ```
/// use seaplant::signal::LowPass;
/// let paper = LowPass { cutoff_hz: 0.125, order: 2 };
/// assert!((paper.zero_phase_gain(0.125) - 0.5).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LowPass {
    /// Where a single pass halves power, Hz.
    pub cutoff_hz: f64,
    /// The order of a single pass, 1 to 8.
    pub order: usize,
}

/// Beyond this order the sections of a low cutoff lose the digits that we promise.
const HIGHEST_ORDER: usize = 8;

impl LowPass {
    /// Smooths a series with the filter run forward, then backward.
    ///
    /// Phase cancels and gain squares: at `cutoff_hz` the amplitude is ½.
    /// The edges are extended by odd reflection and the filter starts in its
    /// steady state there, as `scipy.signal.sosfiltfilt` does by default.
    ///
    /// `x` has shape (n,) and any unit; the result has the same.
    ///
    /// # Errors
    /// [`Error::Cutoff`] unless 0 < `cutoff_hz` < `sample_hz` / 2 and the order
    /// is 1 to 8. [`Error::TooShort`] if n ≤ 3 (`order` + 1), the edge extension.
    ///
    /// # Source
    /// [Jason2, §3]: velocity, 2nd order, 1/8 Hz.
    ///
    /// # Example
    /// ```
    /// # use seaplant::signal::LowPass;
    /// let y = LowPass { cutoff_hz: 0.125, order: 2 }.zero_phase(&[2.0; 64], 10.0)?;
    /// assert!(y.iter().all(|y| (y - 2.0).abs() < 1e-9));
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn zero_phase(&self, x: &[f64], sample_hz: f64) -> Result<Vec<f64>, Error> {
        let sections = self.sections(sample_hz)?;
        let needed = 3 * (self.order + 1) + 1;
        if x.len() < needed {
            return Err(Error::TooShort {
                name: format!("a series to smooth at order {}", self.order),
                found: x.len(),
                needed,
            });
        }
        // Every cause of failure was excluded above; the message is kept all the same.
        sosfiltfilt(&sections, x, FilterPadding::Odd)
            .map_err(|cause| Error::Filter { cause: cause.to_string() })
    }

    /// The gain of [`LowPass::zero_phase`] at a frequency: `1 / (1 + (f/f_c)^(2 order))`.
    ///
    /// That is the analogue prototype, squared; the digital filter is within
    /// 1 % of it up to a tenth of the sampling rate.
    pub fn zero_phase_gain(&self, frequency_hz: f64) -> f64 {
        1.0 / (1.0 + (frequency_hz / self.cutoff_hz).powi(2 * self.order as i32))
    }

    /// The filter as second-order sections, by the bilinear transform with its
    /// frequency warped back to `cutoff_hz`.
    ///
    /// With K = tan(π f_c / f_s), the pole pair of angle θ gives
    /// `K²(1 + 2z⁻¹ + z⁻²) / ((1 + 2K cos θ + K²) + 2(K² − 1)z⁻¹ + (1 − 2K cos θ + K²)z⁻²)`.
    fn sections(&self, sample_hz: f64) -> Result<Vec<SosFilter<f64>>, Error> {
        let Self { cutoff_hz, order } = *self;
        let valid = cutoff_hz > 0.0 && cutoff_hz < 0.5 * sample_hz && sample_hz.is_finite();
        if !valid || !(1..=HIGHEST_ORDER).contains(&order) {
            return Err(Error::Cutoff { cutoff_hz, sample_hz, order, highest: HIGHEST_ORDER });
        }
        let k = (PI * cutoff_hz / sample_hz).tan();
        let mut sections = Vec::with_capacity(order.div_ceil(2));
        if order % 2 == 1 {
            let a0 = 1.0 + k;
            sections.push(SosFilter::new([k / a0, k / a0, 0.0], [1.0, (k - 1.0) / a0, 0.0]));
        }
        for pair in 0..order / 2 {
            // From the negative real axis; a real pole, if any, lies on it.
            let theta = PI * (2 * pair + 1 + order % 2) as f64 / (2 * order) as f64;
            let damping = 2.0 * k * theta.cos();
            let a0 = 1.0 + damping + k * k;
            let b = k * k / a0;
            let a = [1.0, 2.0 * (k * k - 1.0) / a0, (1.0 - damping + k * k) / a0];
            sections.push(SosFilter::new([b, 2.0 * b, b], a));
        }
        Ok(sections)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn refuses_a_cutoff_beyond_half_the_sampling_rate() {
        let refused = LowPass { cutoff_hz: 1.5, order: 2 }.zero_phase(&[0.0; 99], 2.0);
        assert!(matches!(refused, Err(Error::Cutoff { .. })));
    }

    #[test]
    fn refuses_a_series_shorter_than_its_edges() {
        let filter = LowPass { cutoff_hz: 0.1, order: 2 };
        assert!(matches!(
            filter.zero_phase(&[0.0; 9], 1.0),
            Err(Error::TooShort { needed: 10, .. })
        ));
        assert!(filter.zero_phase(&[0.0; 10], 1.0).is_ok());
    }

    #[test]
    fn halves_a_sine_at_the_cutoff() {
        let filter = LowPass { cutoff_hz: 0.125, order: 2 };
        let x: Vec<f64> = (0..4000).map(|k| (2.0 * PI * 0.125 * 0.1 * k as f64).sin()).collect();
        let y = filter.zero_phase(&x, 10.0).expect("long enough");
        // Whole periods in the middle, far from the edges.
        let ratio = |k: usize| y[k] / x[k];
        assert!((ratio(2020) - 0.5).abs() < 1e-3, "{}", ratio(2020));
    }

    proptest! {
        #[test]
        fn commutes_with_reversal_of_time(x in prop::collection::vec(-1.0..1.0_f64, 400)) {
            let filter = LowPass { cutoff_hz: 1.0, order: 2 };
            let forward = filter.zero_phase(&x, 10.0).expect("long enough");
            let turned: Vec<f64> = x.iter().rev().copied().collect();
            let backward = filter.zero_phase(&turned, 10.0).expect("long enough");
            // Forward-backward starts differ at the edges; 100 samples are 60 time constants.
            for k in 100..300 {
                prop_assert!((forward[k] - backward[399 - k]).abs() < 1e-9);
            }
        }
    }
}
