//! Stability margins of one axis in the frequency domain.

use nalgebra::{Complex, Matrix3, SMatrix, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Stability margins of a loop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Margins {
    /// Phase margin, degrees: the smallest over all gain crossovers.
    pub phase_deg: f64,
    /// Gain margin.
    pub gain: f64,
    /// Delay margin, s.
    pub delay_s: f64,
    /// The frequency of the crossing, Hz.
    pub crossover_hz: f64,
}

/// One axis by itself with its controller, in discrete time.
///
/// `m ẍ + d ẋ + g x = f`, `T ḟ = u − f`; `u = −K_p x − K_d ẋ − K_i Σ x h` is measured, computed and
/// held once a period h, and acts after the delay.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Loop {
    pub(crate) mass: f64,
    pub(crate) damping: f64,
    pub(crate) righting: f64,
    pub(crate) kp: f64,
    pub(crate) kd: f64,
    pub(crate) ki: f64,
    pub(crate) lag_s: f64,
    /// Delay from command to force, s.
    pub(crate) delay_s: f64,
    /// h, s.
    pub(crate) period_s: f64,
}

/// Returns the phase of the first point, where an integrator or two begin near −180°, which
/// rounding may make +180°.
fn first_phase(at: Complex<f64>) -> f64 {
    let phase = at.arg();
    if phase > std::f64::consts::FRAC_PI_2 { phase - std::f64::consts::TAU } else { phase }
}

/// Number of frequencies per decade.
const IN_A_DECADE: usize = 200;

/// Lowest frequency at which margins are evaluated, as a fraction of the gains' natural frequency.
const LOWEST: f64 = 1e-3;

/// Exact discrete-time response of a loop.
struct Discrete {
    of: Loop,
    /// e^{Ah} − 1, computed without cancellation.
    moved: Matrix3<f64>,
    /// Response to a command in the period in which it begins to act, and in the next.
    by: [Vector3<f64>; 2],
    /// Number of complete periods before it acts.
    periods: f64,
}

impl Discrete {
    fn new(of: Loop) -> Self {
        let (a, b) = of.continuous();
        let periods = (of.delay_s / of.period_s + 1e-9).floor();
        let rest_s = (of.delay_s - periods * of.period_s).max(0.0);
        let rest = integral(&a, rest_s) * b;
        let first = integral(&a, of.period_s - rest_s);
        let second = rest + a * first * rest;
        Self { of, moved: a * integral(&a, of.period_s), by: [first * b, second], periods }
    }

    /// Evaluates L at an angular frequency, `z = e^{jωh}`.
    fn at(&self, omega: f64) -> Complex<f64> {
        let of = &self.of;
        let angle = omega * of.period_s;
        // z − 1 keeps its precision where ωh is small.
        let half = 0.5 * angle;
        let less = Complex::new(-2.0 * half.sin().powi(2), angle.sin());
        let late = Complex::from_polar(1.0, -angle);
        let input = self.by[0].map(Complex::from) + self.by[1].map(|x| late * x);
        let state = resolved(&self.moved, less, &input);
        let Some(state) = state else { return Complex::new(f64::INFINITY, 0.0) };
        let law = state.x * (of.kp + of.ki * of.period_s / less) + state.y * of.kd;
        law * Complex::from_polar(1.0, -angle * self.periods)
    }
}

/// Computes (w − D)⁻¹ b.
fn resolved(
    moved: &Matrix3<f64>,
    w: Complex<f64>,
    input: &Vector3<Complex<f64>>,
) -> Option<Vector3<Complex<f64>>> {
    let matrix = Matrix3::from_diagonal_element(w) - moved.map(Complex::from);
    matrix.lu().solve(input)
}

/// Computes `∫₀ᵗ e^{As} ds`.
fn integral(a: &Matrix3<f64>, t: f64) -> Matrix3<f64> {
    let mut both = SMatrix::<f64, 6, 6>::zeros();
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(&(a * t));
    both.fixed_view_mut::<3, 3>(0, 3).copy_from(&(Matrix3::identity() * t));
    both.exp().fixed_view::<3, 3>(0, 3).into_owned()
}

impl Loop {
    /// Returns A and b of displacement, velocity and force; without a lag the force is the command.
    fn continuous(&self) -> (Matrix3<f64>, Vector3<f64>) {
        let (m, lag) = (self.mass, self.lag_s);
        let mut a = Matrix3::zeros();
        a[(0, 1)] = 1.0;
        (a[(1, 0)], a[(1, 1)]) = (-self.righting / m, -self.damping / m);
        if lag > 0.0 {
            (a[(1, 2)], a[(2, 2)]) = (1.0 / m, -1.0 / lag);
            (a, Vector3::new(0.0, 0.0, 1.0 / lag))
        } else {
            (a, Vector3::new(0.0, 1.0 / m, 0.0))
        }
    }

    /// Returns the Nyquist frequency, rad/s.
    fn nyquist(&self) -> f64 {
        std::f64::consts::PI / self.period_s
    }

    /// Returns |L| and its phase in degrees at frequencies, which ascend to at most half of the
    /// sampling rate.
    ///
    /// Phase is continuous over frequency, and begins between −270° and 90°.
    pub(crate) fn bode(&self, frequency_hz: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let discrete = Discrete::new(*self);
        let mut before: Option<(Complex<f64>, f64)> = None;
        let at = |hz: &f64| {
            let now = discrete.at(std::f64::consts::TAU * hz);
            let phase = match before {
                Some((last, phase)) => phase + (now / last).arg(),
                None => first_phase(now),
            };
            before = Some((now, phase));
            (now.norm(), phase.to_degrees())
        };
        frequency_hz.iter().map(at).unzip()
    }

    /// Computes the margins over all frequencies up to half of the sampling rate.
    ///
    /// A loop whose gain is always below one has the maximum margin of 180°.
    pub(crate) fn margins(&self) -> Margins {
        let discrete = Discrete::new(*self);
        let last = self.nyquist();
        let lowest = LOWEST * (self.kp / self.mass).max(1e-12).sqrt().min(last);
        let steps = ((last / lowest).log10() * IN_A_DECADE as f64).ceil();
        let omega = |k: f64| lowest * (last / lowest).powf(k / steps);
        let mut found = Margins {
            phase_deg: 180.0,
            gain: f64::INFINITY,
            delay_s: f64::INFINITY,
            crossover_hz: 0.0,
        };
        let mut before = (lowest, discrete.at(lowest));
        let mut phase = first_phase(before.1);
        for k in 1..=steps as usize {
            let now = (omega(k as f64), discrete.at(omega(k as f64)));
            let turned = (now.1 / before.1).arg();
            found.pass(before, now, (phase, turned));
            (before, phase) = (now, phase + turned);
        }
        // There L is real.
        if before.1.re < 0.0 {
            found.rise(-before.1.re);
        }
        found.gain = found.gain.min(GREATEST_GAIN);
        found.delay_s = found.delay_s.min(GREATEST_GAIN);
        found
    }
}

impl Margins {
    /// Evaluates the interval between two frequencies; `phase` is that of the first, and the
    /// change.
    fn pass(
        &mut self,
        (from, before): (f64, Complex<f64>),
        (to, now): (f64, Complex<f64>),
        (phase, turned): (f64, f64),
    ) {
        let pi = std::f64::consts::PI;
        if (before.norm() - 1.0) * (now.norm() - 1.0) <= 0.0 {
            // Crossover as a fraction of the step: margins vary smoothly with gains.
            let (above, below) = (before.norm().ln(), now.norm().ln());
            let part = if above == below { 1.0 } else { above / (above - below) };
            let at = from * (to / from).powf(part);
            let margin = pi + phase + part * turned;
            if margin.to_degrees() < self.phase_deg {
                self.phase_deg = margin.to_degrees();
                self.crossover_hz = at / std::f64::consts::TAU;
                self.delay_s = margin / at;
            }
        }
        if (phase + pi) * (phase + turned + pi) <= 0.0 {
            let part = if turned == 0.0 { 1.0 } else { -(phase + pi) / turned };
            self.rise(before.norm().powf(1.0 - part) * now.norm().powf(part));
        }
    }

    /// Evaluates a gain at −180°.
    fn rise(&mut self, gain: f64) {
        if gain < 1.0 {
            self.gain = self.gain.min(1.0 / gain);
        }
    }
}

/// Greatest reported margin, which files can represent.
const GREATEST_GAIN: f64 = 1e6;

#[cfg(test)]
mod tests {
    use super::*;

    fn double_integrator(omega: f64, zeta: f64, period_s: f64) -> Loop {
        Loop {
            mass: 50.0,
            damping: 0.0,
            righting: 0.0,
            kp: 50.0 * omega * omega,
            kd: 100.0 * zeta * omega,
            ki: 0.0,
            lag_s: 0.0,
            delay_s: 0.0,
            period_s,
        }
    }

    #[test]
    fn margins_of_a_double_integrator_are_those_of_the_closed_form() {
        // L = (2 ζ ω s + ω²)/s²: |L| = 1 at x = ω √(2ζ² + √(4ζ⁴ + 1)), margin atan(2 ζ x/ω).
        let (omega, zeta) = (0.8, 1.0_f64);
        let found = double_integrator(omega, zeta, 1e-4).margins();
        let x = (2.0 * zeta * zeta + (4.0 * zeta.powi(4) + 1.0).sqrt()).sqrt();
        let expected = (2.0 * zeta * x).atan().to_degrees();
        assert!((found.phase_deg - expected).abs() < 0.02, "{found:?} against {expected}");
        assert!((found.crossover_hz * std::f64::consts::TAU / omega - x).abs() < 1e-3);
    }

    #[test]
    fn without_lag_the_gain_margin_is_where_the_sampled_loop_turns_unstable() {
        // z² − (2 − a − b) z + 1 − a + b with a = K_d h/m, b = K_p h²/(2 m), both times the gain k: a
        // root is −1 where 4 − 2 a k = 0.
        for period_s in [0.02, 0.1, 0.5] {
            let of = double_integrator(0.8, 1.0, period_s);
            let expected = 2.0 * of.mass / (of.kd * period_s);
            let found = of.margins().gain;
            assert!((found / expected - 1.0).abs() < 1e-9, "{period_s}: {found} {expected}");
        }
    }
}
