//! Fourier transforms of real series of one length.
//!
//! `realfft` and the library beneath it are generic, and are compiled with each crate that uses them,
//! for a tenth of the time that the core takes. Here they are compiled once.

use std::sync::{Arc, OnceLock};

pub use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

/// Transforms of series of n numbers.
///
/// ```
/// use seaplant_fourier::RealTransform;
/// let transform = RealTransform::new(4);
/// let spectrum = transform.forward(vec![1.0, 2.0, 3.0]);
/// assert_eq!(spectrum[0].re, 6.0);
/// let again: Vec<f64> = transform.inverse(spectrum).iter().map(|x| x / 4.0).collect();
/// assert_eq!(again, [1.0, 2.0, 3.0, 0.0]);
/// ```
pub struct RealTransform {
    forward: Arc<dyn RealToComplex<f64>>,
    /// Planned when it is used first: of a long series, a plan takes as much memory as the series.
    inverse: OnceLock<Arc<dyn ComplexToReal<f64>>>,
}

impl RealTransform {
    /// Plans the transforms of series of `length` numbers.
    pub fn new(length: usize) -> Self {
        let forward = RealFftPlanner::new().plan_fft_forward(length);
        Self { forward, inverse: OnceLock::new() }
    }

    /// Returns n.
    pub fn length(&self) -> usize {
        self.forward.len()
    }

    /// Computes `Σ x_k exp(−2πi jk/n)` for j from 0 to n/2; what is missing of n numbers is zero, and what
    /// is beyond is left out.
    pub fn forward(&self, mut values: Vec<f64>) -> Vec<Complex<f64>> {
        values.resize(self.forward.len(), 0.0);
        let mut spectrum = self.forward.make_output_vec();
        self.forward.process(&mut values, &mut spectrum).expect("lengths are the plan's own");
        spectrum
    }

    /// Computes n times the series of a spectrum as [`Self::forward`] returns it.
    pub fn inverse(&self, mut spectrum: Vec<Complex<f64>>) -> Vec<f64> {
        let plan = || RealFftPlanner::new().plan_fft_inverse(self.length());
        let inverse = self.inverse.get_or_init(plan);
        spectrum.resize(inverse.complex_len(), Complex::default());
        // The first bin, and the last of an even length, are real but for rounding, since the series are.
        if let Some(first) = spectrum.first_mut() {
            first.im = 0.0;
        }
        if let Some(last) = spectrum.last_mut().filter(|_| self.length().is_multiple_of(2)) {
            last.im = 0.0;
        }
        let mut values = inverse.make_output_vec();
        inverse.process(&mut spectrum, &mut values).expect("both ends are real");
        values
    }
}
