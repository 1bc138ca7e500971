//! Filters, derivatives, resampling and spectra of uniform series.

mod autocorrelation;
mod derivative;
mod frozen;
mod low_pass;
mod outliers;
mod resample;
mod size;
mod spectrum;
mod spikes;

pub use autocorrelation::autocorrelation;
pub(crate) use derivative::{check_differentiable, slope_around, slope_of_line, slope_of_parabola};
pub use derivative::{differentiate, differentiate_timed};
pub(crate) use frozen::frozen;
pub use low_pass::LowPass;
pub use outliers::{Hampel, Masked};
pub use resample::{Stretch, Stretches, resample, uniform_stretches};
pub(crate) use size::{rms, sample_noise};
pub use spectrum::{Spectrum, amplitude_spectrum};
pub(crate) use spikes::spikes;
