//! Margins of one axis in the frequency domain.

use nalgebra::Complex;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How far a loop is from instability.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Margins {
    /// Phase margin, degrees: the least over all crossings of one.
    pub phase_deg: f64,
    /// By what the gain may rise.
    pub gain: f64,
    /// How much later thrust may act, s.
    pub delay_s: f64,
    /// The frequency of the crossing, Hz.
    pub crossover_hz: f64,
}

/// One axis by itself, with its controller: `L(s) = (K_d s + K_p + K_i/s) e^{−δ s} / ((1 + T s)
/// (m s² + d s + g))`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Loop {
    pub(crate) mass: f64,
    pub(crate) damping: f64,
    pub(crate) righting: f64,
    pub(crate) kp: f64,
    pub(crate) kd: f64,
    pub(crate) ki: f64,
    pub(crate) lag_s: f64,
    /// Delay, half a period of holding included, s.
    pub(crate) late_s: f64,
}

/// An integrator or two begin near −180°, which rounding may make +180°.
fn first_phase(at: Complex<f64>) -> f64 {
    let phase = at.arg();
    if phase > std::f64::consts::FRAC_PI_2 { phase - std::f64::consts::TAU } else { phase }
}

/// Frequencies in a decade.
const IN_A_DECADE: usize = 200;

impl Loop {
    fn at(&self, omega: f64) -> Complex<f64> {
        let s = Complex::new(0.0, omega);
        let controller = s * self.kd + self.kp + Complex::new(self.ki, 0.0) / s;
        let plant = s * s * self.mass + s * self.damping + self.righting;
        let late = Complex::from_polar(1.0, -self.late_s * omega);
        controller * late / (plant * (s * self.lag_s + 1.0))
    }

    /// |L| and its phase in degrees at frequencies, which ascend.
    ///
    /// Phase goes on from one frequency to the next, and begins between −270° and 90°.
    pub(crate) fn bode(&self, frequency_hz: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut before: Option<(Complex<f64>, f64)> = None;
        let at = |hz: &f64| {
            let now = self.at(std::f64::consts::TAU * hz);
            let phase = match before {
                Some((last, phase)) => phase + (now / last).arg(),
                None => first_phase(now),
            };
            before = Some((now, phase));
            (now.norm(), phase.to_degrees())
        };
        frequency_hz.iter().map(at).unzip()
    }

    /// Margins over frequencies around those of the gains.
    ///
    /// A loop whose gain is below one throughout has all the margin that there is: 180°.
    pub(crate) fn margins(&self) -> Margins {
        let natural = (self.kp / self.mass).max(1e-12).sqrt();
        let decades = 6;
        let count = decades * IN_A_DECADE;
        let omega =
            |k: usize| natural * 10_f64.powf(k as f64 / IN_A_DECADE as f64 - decades as f64 / 2.0);
        let mut found = Margins {
            phase_deg: 180.0,
            gain: f64::INFINITY,
            delay_s: f64::INFINITY,
            crossover_hz: 0.0,
        };
        let mut before = self.at(omega(0));
        let mut phase = first_phase(before);
        for k in 1..count {
            let now = self.at(omega(k));
            let turned = (now / before).arg();
            let next = phase + turned;
            if (before.norm() - 1.0) * (now.norm() - 1.0) <= 0.0 {
                // Where it crosses, as a part of the step: margins move smoothly with gains.
                let (above, below) = (before.norm().ln(), now.norm().ln());
                let part = if above == below { 1.0 } else { above / (above - below) };
                let at = omega(k - 1) * (omega(k) / omega(k - 1)).powf(part);
                let margin = std::f64::consts::PI + phase + part * turned;
                if margin.to_degrees() < found.phase_deg {
                    found.phase_deg = margin.to_degrees();
                    found.crossover_hz = at / std::f64::consts::TAU;
                    found.delay_s = margin / at;
                }
            }
            let pi = std::f64::consts::PI;
            if (phase + pi) * (next + pi) <= 0.0 {
                let part = if turned == 0.0 { 1.0 } else { -(phase + pi) / turned };
                let gain = before.norm().powf(1.0 - part) * now.norm().powf(part);
                if gain < 1.0 {
                    found.gain = found.gain.min(1.0 / gain);
                }
            }
            (before, phase) = (now, next);
        }
        found.gain = found.gain.min(GREATEST_GAIN);
        found.delay_s = found.delay_s.min(GREATEST_GAIN);
        found
    }
}

/// Margins beyond this are this, so that files can hold them.
const GREATEST_GAIN: f64 = 1e6;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn margins_of_a_double_integrator_are_those_of_the_closed_form() {
        // L = (2 ζ ω s + ω²)/s²: |L| = 1 at x = ω √(2ζ² + √(4ζ⁴ + 1)), margin atan(2 ζ x/ω).
        let (omega, zeta) = (0.8, 1.0_f64);
        let double = Loop {
            mass: 50.0,
            damping: 0.0,
            righting: 0.0,
            kp: 50.0 * omega * omega,
            kd: 100.0 * zeta * omega,
            ki: 0.0,
            lag_s: 0.0,
            late_s: 0.0,
        };
        let found = double.margins();
        let x = (2.0 * zeta * zeta + (4.0 * zeta.powi(4) + 1.0).sqrt()).sqrt();
        let expected = (2.0 * zeta * x).atan().to_degrees();
        assert!((found.phase_deg - expected).abs() < 0.01, "{found:?} against {expected}");
        assert!((found.crossover_hz * std::f64::consts::TAU / omega - x).abs() < 1e-4);
        assert_eq!(found.gain, GREATEST_GAIN);
    }
}
