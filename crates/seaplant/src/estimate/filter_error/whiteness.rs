//! Whether errors of prediction follow each other at random.

use super::kalman::Innovation;
use super::schedule::Instrument;
use super::search::Fitted;
use crate::signal::{amplitude_spectrum, autocorrelation};

/// As many samples as memory is looked for.
const LAGS: usize = 40;

/// The statistic of white noise is 1 ± 0.22, and of a filter whose model is right up to 2:
/// above this, something is left to find.
const WHITE: f64 = 1.5;

/// So many errors of an instrument in a trial are enough to judge by.
const ENOUGH: usize = 1 << 16;

/// How far errors of prediction are from white noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Whiteness {
    /// Box and Pierce's `n Σ r²` over 40 lags, divided by 40; the mean of all trials.
    pub(crate) statistic: f64,
    /// Where they have most of their power, Hz; of the longest trial.
    pub(crate) dominant_hz: Option<f64>,
}

impl Whiteness {
    pub(crate) fn of(fitted: &Fitted<'_>) -> Self {
        let (mut sum, mut weight) = (0.0, 0.0);
        let mut longest: (usize, Option<f64>) = (0, None);
        for (k, record) in fitted.problem.records.iter().enumerate() {
            let all = fitted.problem.innovations(&fitted.optimum.theta, k);
            for instrument in Instrument::ALL {
                let Some(period_s) = record.period_s(instrument) else { continue };
                let errors = of_instrument(&all, instrument);
                let n = errors.len();
                sum += n as f64 * statistic(&errors);
                weight += n as f64;
                if n > longest.0 {
                    let spectrum = amplitude_spectrum(&errors, 1.0 / period_s);
                    longest = (n, spectrum.dominant_hz());
                }
            }
        }
        let statistic = if weight > 0.0 { sum / weight } else { 1.0 };
        Self { statistic, dominant_hz: longest.1 }
    }

    /// Whether nothing but chance shows.
    pub(crate) fn is_white(&self) -> bool {
        self.statistic < WHITE
    }
}

/// The normalised errors of one instrument.
fn of_instrument(all: &[Innovation], instrument: Instrument) -> Vec<f64> {
    let own = all.iter().filter(|innovation| innovation.instrument == instrument);
    own.take(ENOUGH).map(Innovation::normalised).collect()
}

/// Box and Pierce's statistic over as many lags as there are, per lag.
fn statistic(errors: &[f64]) -> f64 {
    let lags = LAGS.min(errors.len() / 4);
    if lags == 0 {
        return 1.0;
    }
    let r = autocorrelation(errors, 1..=lags);
    errors.len() as f64 * r.iter().map(|r| r * r).sum::<f64>() / lags as f64
}
