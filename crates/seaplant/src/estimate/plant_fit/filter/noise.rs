//! Disturbance, measurement noise and varying current, and the process noise of a step.

use std::f64::consts::TAU;

use nalgebra::{DVector, SVector};

use super::navigation::InstrumentNoise;
use super::state::Observed;
use crate::motion::Decay;

/// Noise parameters other than the plant's coefficients, by axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::estimate::plant_fit) struct Noise<const N: usize, const M: usize> {
    /// Standard deviation of the disturbance, N or N m.
    pub(in crate::estimate::plant_fit) disturbance: SVector<f64, N>,
    /// Its correlation time, s.
    pub(in crate::estimate::plant_fit) correlation_s: SVector<f64, N>,
    /// Standard deviation of a sample of velocity, m/s or rad/s.
    pub(in crate::estimate::plant_fit) velocity: SVector<f64, N>,
    /// Standard deviation of a sample of roll and of pitch, rad, where attitude is a state (M > N).
    pub(in crate::estimate::plant_fit) attitude: f64,
    /// Noise of the sensors of position, depth, heading and acceleration.
    pub(in crate::estimate::plant_fit) instruments: InstrumentNoise,
    /// Variation of the current; `None` if it is constant.
    pub(in crate::estimate::plant_fit) drift: Option<Drift>,
    /// Force of waves; `None` in calm water.
    pub(in crate::estimate::plant_fit) swell: Option<Swell<N>>,
}

/// Variation of the current during a trial: a Gauss–Markov velocity north and another east.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::estimate::plant_fit) struct Drift {
    /// Standard deviation of each, m/s.
    pub(in crate::estimate::plant_fit) std_m_s: f64,
    /// Their correlation time, s.
    pub(in crate::estimate::plant_fit) correlation_s: f64,
}

impl Drift {
    /// No variation.
    pub(super) const NONE: Self = Self { std_m_s: 0.0, correlation_s: f64::INFINITY };

    /// A variation too small to affect other estimates, for a test of whether a larger one is
    /// likelier.
    pub(in crate::estimate::plant_fit) const TRIED: Self =
        Self { std_m_s: 1e-3, correlation_s: 60.0 };

    /// Initial value for a fit.
    pub(in crate::estimate::plant_fit) const FIRST: Self =
        Self { std_m_s: 0.02, correlation_s: 60.0 };

    pub(super) fn fade(&self, h: f64) -> f64 {
        (-h / self.correlation_s).exp()
    }

    /// Returns the variance that a step adds to each component.
    pub(super) fn process(&self, h: f64) -> f64 {
        self.std_m_s.powi(2) * (1.0 - self.fade(h).powi(2))
    }
}

/// Force of waves on each axis in a narrow band of frequencies: a stochastic cycle,
///
/// ```text
/// [s; s*] ← ρ [cos ωh  −sin ωh; sin ωh  cos ωh] [s; s*] + w,   ρ = exp(−ζωh),
/// ```
///
/// over a step of h seconds, where s is the force and both states have its variance.
///
/// # Source
/// [Harvey1989, ch. 2.3].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::estimate::plant_fit) struct Swell<const N: usize> {
    /// Standard deviation on each axis, N or N m.
    pub(in crate::estimate::plant_fit) std: SVector<f64, N>,
    /// Angular frequency ω, rad/s.
    pub(in crate::estimate::plant_fit) frequency: f64,
    /// Damping ratio ζ.
    pub(in crate::estimate::plant_fit) damping: f64,
}

impl<const N: usize> Swell<N> {
    /// Limits of the angular frequency, rad/s: periods of 2 to 30 s.
    pub(in crate::estimate::plant_fit) const FREQUENCY: [f64; 2] = [TAU / 30.0, TAU / 2.0];

    /// Limits of the damping ratio. Waves of one sea have a narrow band; a force of a wide one is a
    /// disturbance like any other.
    pub(in crate::estimate::plant_fit) const DAMPING: [f64; 2] = [1e-3, 0.4];

    /// Initial damping ratio.
    pub(in crate::estimate::plant_fit) const FIRST_DAMPING: f64 = 0.1;

    /// Returns true if the band is narrower than its limit.
    pub(in crate::estimate::plant_fit) fn is_narrow(&self) -> bool {
        self.damping < 0.99 * Self::DAMPING[1]
    }

    /// Returns ρ.
    fn fade(&self, h: f64) -> f64 {
        (-self.damping * self.frequency * h).exp()
    }

    /// Returns `[ρ cos ωh, ρ sin ωh]`.
    pub(super) fn turn(&self, h: f64) -> [f64; 2] {
        let (sin, cos) = (self.frequency * h).sin_cos();
        [cos, sin].map(|x| self.fade(h) * x)
    }

    /// Returns the derivatives of [`Self::turn`] by ln ω and by ln ζ.
    pub(super) fn turn_changes(&self, h: f64) -> [[f64; 2]; 2] {
        let [cos, sin] = self.turn(h);
        let (angle, decay) = (self.frequency * h, self.damping * self.frequency * h);
        [[-angle * sin - decay * cos, angle * cos - decay * sin], [-decay * cos, -decay * sin]]
    }

    /// Returns the variance that a step adds to each state of an axis.
    pub(super) fn process(&self, axis: usize, h: f64) -> f64 {
        self.std[axis].powi(2) * (1.0 - self.fade(h).powi(2))
    }

    /// Returns the derivative of [`Self::process`] by ln ω, which is that by ln ζ.
    pub(super) fn process_change(&self, axis: usize, h: f64) -> f64 {
        2.0 * (self.std[axis] * self.fade(h)).powi(2) * self.damping * self.frequency * h
    }
}

impl<const N: usize> Noise<N, N> {
    /// Extends the noise to a filter with attitude states; `attitude` is the noise of roll and
    /// pitch, rad.
    pub(in crate::estimate::plant_fit) fn with_attitude(self, attitude: f64) -> Noise<6, 9> {
        // The value at an unused index has no effect but must be finite.
        let placed = |of: SVector<f64, N>| SVector::from_fn(|i, _| *of.get(i).unwrap_or(&1.0));
        Noise {
            disturbance: placed(self.disturbance),
            correlation_s: placed(self.correlation_s),
            velocity: placed(self.velocity),
            attitude,
            instruments: self.instruments,
            drift: self.drift,
            swell: self.swell.map(|swell| Swell {
                std: placed(swell.std),
                frequency: swell.frequency,
                damping: swell.damping,
            }),
        }
    }
}

impl<const N: usize, const M: usize> Noise<N, M> {
    /// Index of the logarithm of the attitude noise, if attitude is a state.
    pub(in crate::estimate::plant_fit) const ATTITUDE: usize = 3 * N;

    /// Index of the first logarithm of the sensor noise.
    pub(in crate::estimate::plant_fit) const INSTRUMENTS: usize =
        Self::ATTITUDE + if M > N { 1 } else { 0 };

    /// Returns the index of the logarithm of the current's standard deviation; that of its
    /// correlation time follows.
    pub(in crate::estimate::plant_fit) fn first_of_drift(&self) -> usize {
        Self::INSTRUMENTS + self.instruments.count()
    }

    /// Returns the index of the logarithm of the first axis's swell; frequency and damping follow
    /// those of all axes.
    pub(in crate::estimate::plant_fit) fn first_of_swell(&self) -> usize {
        self.first_of_drift() + if self.drift.is_some() { 2 } else { 0 }
    }

    /// Returns the number of parameters.
    pub(in crate::estimate::plant_fit) fn count(&self) -> usize {
        self.first_of_swell() + if self.swell.is_some() { N + 2 } else { 0 }
    }

    /// Returns true if a parameter is a standard deviation; others are times, a frequency or a ratio.
    pub(in crate::estimate::plant_fit) fn is_std(&self, k: usize) -> bool {
        if let Some(of_swell) = k.checked_sub(self.first_of_swell()) {
            return of_swell < N;
        }
        if let Some(of_drift) = k.checked_sub(self.first_of_drift()) {
            return of_drift == 0;
        }
        match k.checked_sub(Self::INSTRUMENTS) {
            Some(place) => {
                self.instruments.needed().nth(place) != Some(InstrumentNoise::OFFSET_CORRELATION)
            }
            None => !(N..2 * N).contains(&k),
        }
    }

    /// Returns the logarithms of the parameters: 3 N of the axes, one of attitude if it is a state,
    /// those of the active sensors, two of the current if it varies, and N + 2 of swell.
    pub(in crate::estimate::plant_fit) fn logarithms(&self) -> DVector<f64> {
        let parts = [self.disturbance, self.correlation_s, self.velocity];
        let of_axes = parts.into_iter().flat_map(|part| part.map(f64::ln).data.0[0]);
        let of_attitude = (M > N).then(|| self.attitude.ln());
        let of_instruments = self.instruments.needed().map(|k| self.instruments.numbers[k].ln());
        let of_water =
            self.drift.iter().flat_map(|drift| [drift.std_m_s.ln(), drift.correlation_s.ln()]);
        let of_swell = self.swell.iter().flat_map(|swell| {
            let shape = [swell.frequency.ln(), swell.damping.ln()];
            swell.std.map(f64::ln).data.0[0].into_iter().chain(shape)
        });
        let all = of_axes.chain(of_attitude).chain(of_instruments).chain(of_water).chain(of_swell);
        DVector::from_vec(all.collect())
    }

    /// Returns the noise with parameters from their logarithms.
    pub(in crate::estimate::plant_fit) fn with_logarithms(
        &self,
        logarithms: &DVector<f64>,
    ) -> Self {
        let part = |k: usize| SVector::from_fn(|i, _| logarithms[k * N + i].exp());
        let first = self.first_of_drift();
        let drift = self.drift.map(|_| Drift {
            std_m_s: logarithms[first].exp(),
            correlation_s: logarithms[first + 1].exp(),
        });
        let first = self.first_of_swell();
        let swell = self.swell.map(|_| Swell {
            std: SVector::from_fn(|i, _| logarithms[first + i].exp()),
            frequency: logarithms[first + N].exp(),
            damping: logarithms[first + N + 1].exp(),
        });
        let attitude = if M > N { logarithms[Self::ATTITUDE].exp() } else { 0.0 };
        let mut instruments = self.instruments;
        for (place, k) in self.instruments.needed().enumerate() {
            instruments.numbers[k] = logarithms[Self::INSTRUMENTS + place].exp();
        }
        let [disturbance, correlation_s, velocity] = [0, 1, 2].map(part);
        Self { disturbance, correlation_s, velocity, attitude, instruments, drift, swell }
    }

    /// Returns the index of the logarithm of a measurement's noise.
    pub(super) fn place_of(&self, of: &Observed) -> usize {
        match of {
            Observed::Velocity(place) => 2 * N + place,
            Observed::Down(_) => Self::ATTITUDE,
            Observed::Navigation { number, .. } => {
                Self::INSTRUMENTS + self.instruments.place(*number)
            }
        }
    }

    pub(super) fn of_water(&self) -> Drift {
        self.drift.unwrap_or(Drift::NONE)
    }

    pub(super) fn decay(&self) -> Decay<N> {
        Decay { rate: self.correlation_s.map(|t| 1.0 / t) }
    }
}

/// Process noise over a step of a Gauss–Markov force, driven by white noise: variance of the
/// force's integral, variance of the force, and their covariance.
pub(super) struct Impulse {
    pub(super) variance: f64,
    pub(super) with_force: f64,
    pub(super) of_force: f64,
}

impl Impulse {
    /// Computes the process noise over `h` seconds of a force of standard deviation σ and
    /// correlation time T, with x = h/T: `σ²T² (2x − 3 + 4e⁻ˣ − e⁻²ˣ)`, `σ²T (1 − e⁻ˣ)²`,
    /// `σ² (1 − e⁻²ˣ)`.
    pub(super) fn over(h: f64, sigma: f64, t: f64) -> Self {
        let (x, power) = (h / t, sigma * sigma);
        Self {
            variance: power * t * t * integrated(x),
            with_force: power * t * (-x).exp_m1().powi(2),
            of_force: -power * (-2.0 * x).exp_m1(),
        }
    }

    /// Returns twice the process noise: its derivative by ln σ.
    pub(super) fn doubled(self) -> Self {
        let Self { variance, with_force, of_force } = self;
        Self { variance: 2.0 * variance, with_force: 2.0 * with_force, of_force: 2.0 * of_force }
    }

    /// Computes the derivative of [`Self::over`] by ln T.
    pub(super) fn by_correlation(h: f64, sigma: f64, t: f64) -> Self {
        let (x, power) = (h / t, sigma * sigma);
        let gone = -(-x).exp_m1();
        Self {
            variance: 2.0 * power * t * t * (integrated(x) - x * gone * gone),
            with_force: power * t * gone * (gone - 2.0 * x * (-x).exp()),
            of_force: -2.0 * power * x * (-2.0 * x).exp(),
        }
    }
}

/// Computes `2x − 3 + 4e⁻ˣ − e⁻²ˣ`; for small x by its series, `Σ (−1)ⁿ (4 − 2ⁿ) xⁿ/n!` from n = 3,
/// to avoid cancellation.
pub(super) fn integrated(x: f64) -> f64 {
    if x > 0.5 {
        return 2.0 * x - 3.0 + 4.0 * (-x).exp() - (-2.0 * x).exp();
    }
    let (mut power, mut two) = (-x * x / 2.0, 4.0);
    let term = |n: u32| {
        power *= -x / f64::from(n);
        two *= 2.0;
        (two - 4.0) * power
    };
    (3..=TERMS).map(term).sum()
}

/// Terms of the series after which the remainder is below rounding.
pub(super) const TERMS: u32 = 20;

/// Computes `d ln g/d ln T` of `g = ∫₀ʰ e^(−s/T) ds`, with x = h/T: the relative change with
/// correlation time of a disturbance's impulse over a step.
pub(super) fn impulse_by_correlation(x: f64) -> f64 {
    if x < 1e-6 { 0.5 * x } else { 1.0 - x / x.exp_m1() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The process noise must be positive definite for correlation times both longer and shorter
    /// than the step.
    #[test]
    fn process_noise_is_positive_definite_with_exact_derivatives() {
        let (h, sigma) = (0.05, 3.0);
        for t in [0.005, 0.02, 0.1, 0.2, 1.0, 30.0, 1e4] {
            let of = Impulse::over(h, sigma, t);
            let left = of.variance * of.of_force - of.with_force.powi(2);
            assert!(left > 0.1 * of.variance * of.of_force, "{t} s: {left}");
            let step = 1e-5_f64;
            let (up, down) =
                (Impulse::over(h, sigma, t * step.exp()), Impulse::over(h, sigma, t / step.exp()));
            let slope = Impulse::by_correlation(h, sigma, t);
            let check = |up: f64, down: f64, found: f64, of: f64| {
                let expected = (up - down) / (2.0 * step);
                assert!((found - expected).abs() < 1e-6 * of, "{t} s: {found} and {expected}");
            };
            check(up.variance, down.variance, slope.variance, of.variance);
            check(up.with_force, down.with_force, slope.with_force, of.with_force);
            check(up.of_force, down.of_force, slope.of_force, of.of_force);
        }
    }

    /// For a correlation time much longer than the step the force is a random walk: `q h³/3`,
    /// `q h²/2`, `q h`.
    #[test]
    fn slow_force_has_the_process_noise_of_a_random_walk() {
        let (h, sigma, t) = (0.02, 2.0, 1e5);
        let (of, q) = (Impulse::over(h, sigma, t), 2.0 * sigma * sigma / t);
        assert!((of.variance / (q * h.powi(3) / 3.0) - 1.0).abs() < 1e-6);
        assert!((of.with_force / (q * h * h / 2.0) - 1.0).abs() < 1e-6);
        assert!((of.of_force / (q * h) - 1.0).abs() < 1e-6);
    }
}
