//! Disturbance, measurement noise and varying current, and the process noise of a step.

use std::f64::consts::TAU;

use nalgebra::DVector;

use super::navigation::InstrumentNoise;
use super::state::Observed;

/// Parameters other than those of plant, thrust and mean current.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::estimate::plant_fit) struct Noise {
    /// Standard deviation of the disturbance of each axis of the plant, N or N m.
    pub(in crate::estimate::plant_fit) disturbance: DVector<f64>,
    /// Its correlation time, s.
    pub(in crate::estimate::plant_fit) correlation_s: DVector<f64>,
    /// Standard deviation of a sample of velocity, m/s or rad/s.
    pub(in crate::estimate::plant_fit) velocity: DVector<f64>,
    /// Standard deviation of a sample of roll and of pitch, rad; `None` where attitude is no state.
    pub(in crate::estimate::plant_fit) attitude: Option<f64>,
    /// Noise of the sensors of position, depth, heading and acceleration.
    pub(in crate::estimate::plant_fit) instruments: InstrumentNoise,
    /// Variation of the current; `None` if it is constant.
    pub(in crate::estimate::plant_fit) drift: Option<Drift>,
    /// Force of waves; `None` in calm water.
    pub(in crate::estimate::plant_fit) swell: Option<Swell>,
    /// Jitter of thrust: standard deviation of the time at which a change of thrust acts, s; `None`
    /// if all act when the log and the actuator say.
    pub(in crate::estimate::plant_fit) jitter_s: Option<f64>,
}

/// One number of a [`Noise`]; fits change their logarithms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::estimate::plant_fit) enum NoiseNumber {
    /// Standard deviation of an axis's disturbance.
    Disturbance(usize),
    /// Its correlation time.
    Correlation(usize),
    /// Standard deviation of a sample of an axis's velocity.
    Velocity(usize),
    /// Standard deviation of a sample of roll and of pitch.
    Attitude,
    /// An entry of [`InstrumentNoise`].
    Instrument(usize),
    /// Standard deviation of the current's variation.
    Drift,
    /// Its correlation time.
    DriftCorrelation,
    /// Standard deviation of the force of waves on an axis.
    Swell(usize),
    /// Angular frequency of waves.
    SwellFrequency,
    /// Damping ratio of waves.
    SwellDamping,
    /// Jitter of thrust.
    Jitter,
}

impl NoiseNumber {
    /// Returns true for a standard deviation; others are times, a frequency or a ratio.
    pub(in crate::estimate::plant_fit) fn is_std(self) -> bool {
        !matches!(
            self,
            Self::Correlation(_)
                | Self::Instrument(InstrumentNoise::OFFSET_CORRELATION)
                | Self::DriftCorrelation
                | Self::SwellFrequency
                | Self::SwellDamping
        )
    }
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
#[derive(Clone, Debug, PartialEq)]
pub(in crate::estimate::plant_fit) struct Swell {
    /// Standard deviation on each axis, N or N m.
    pub(in crate::estimate::plant_fit) std: DVector<f64>,
    /// Angular frequency ω, rad/s.
    pub(in crate::estimate::plant_fit) frequency: f64,
    /// Damping ratio ζ.
    pub(in crate::estimate::plant_fit) damping: f64,
}

impl Swell {
    /// Limits of the angular frequency, rad/s: periods of 0.7 to 30 s.
    pub(in crate::estimate::plant_fit) const FREQUENCY: [f64; 2] = [TAU / 30.0, TAU / 0.7];

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

impl Noise {
    /// Returns the number of axes.
    pub(in crate::estimate::plant_fit) fn axes(&self) -> usize {
        self.disturbance.len()
    }

    /// Returns all numbers, in the order of their logarithms.
    pub(in crate::estimate::plant_fit) fn numbers(&self) -> Vec<NoiseNumber> {
        let axes = 0..self.axes();
        let mut all: Vec<NoiseNumber> = axes.clone().map(NoiseNumber::Disturbance).collect();
        all.extend(axes.clone().map(NoiseNumber::Correlation));
        all.extend(axes.clone().map(NoiseNumber::Velocity));
        all.extend(self.attitude.map(|_| NoiseNumber::Attitude));
        all.extend(self.instruments.needed().map(NoiseNumber::Instrument));
        if self.drift.is_some() {
            all.extend([NoiseNumber::Drift, NoiseNumber::DriftCorrelation]);
        }
        if self.swell.is_some() {
            all.extend(axes.map(NoiseNumber::Swell));
            all.extend([NoiseNumber::SwellFrequency, NoiseNumber::SwellDamping]);
        }
        all.extend(self.jitter_s.map(|_| NoiseNumber::Jitter));
        all
    }

    /// Returns the number of logarithms.
    pub(in crate::estimate::plant_fit) fn count(&self) -> usize {
        self.of_jitter() + usize::from(self.jitter_s.is_some())
    }

    /// Returns the index of a number's logarithm.
    pub(in crate::estimate::plant_fit) fn place(&self, number: NoiseNumber) -> usize {
        let n = self.axes();
        match number {
            NoiseNumber::Disturbance(axis) => axis,
            NoiseNumber::Correlation(axis) => n + axis,
            NoiseNumber::Velocity(axis) => 2 * n + axis,
            NoiseNumber::Attitude => 3 * n,
            NoiseNumber::Instrument(k) => self.first_of_instruments() + self.instruments.place(k),
            NoiseNumber::Drift => self.first_of_drift(),
            NoiseNumber::DriftCorrelation => self.first_of_drift() + 1,
            NoiseNumber::Swell(axis) => self.first_of_swell() + axis,
            NoiseNumber::SwellFrequency => self.first_of_swell() + n,
            NoiseNumber::SwellDamping => self.first_of_swell() + n + 1,
            NoiseNumber::Jitter => self.of_jitter(),
        }
    }

    fn first_of_instruments(&self) -> usize {
        3 * self.axes() + usize::from(self.attitude.is_some())
    }

    fn first_of_drift(&self) -> usize {
        self.first_of_instruments() + self.instruments.count()
    }

    fn first_of_swell(&self) -> usize {
        self.first_of_drift() + if self.drift.is_some() { 2 } else { 0 }
    }

    fn of_jitter(&self) -> usize {
        self.first_of_swell() + self.swell.as_ref().map_or(0, |_| self.axes() + 2)
    }

    /// Returns the logarithms of all numbers.
    pub(in crate::estimate::plant_fit) fn logarithms(&self) -> DVector<f64> {
        let mut own = self.clone();
        let of = |number| own.value_mut(number).map_or(0.0, |value| value.ln());
        DVector::from_vec(self.numbers().into_iter().map(of).collect())
    }

    /// Returns the noise with numbers from their logarithms.
    pub(in crate::estimate::plant_fit) fn with_logarithms(
        &self,
        logarithms: &DVector<f64>,
    ) -> Self {
        let mut new = self.clone();
        for (number, logarithm) in self.numbers().into_iter().zip(logarithms) {
            if let Some(value) = new.value_mut(number) {
                *value = logarithm.exp();
            }
        }
        new
    }

    /// Returns a number; `None` of what is not part of the noise.
    fn value_mut(&mut self, number: NoiseNumber) -> Option<&mut f64> {
        let (drift, swell) = (self.drift.as_mut(), self.swell.as_mut());
        match number {
            NoiseNumber::Disturbance(axis) => self.disturbance.get_mut(axis),
            NoiseNumber::Correlation(axis) => self.correlation_s.get_mut(axis),
            NoiseNumber::Velocity(axis) => self.velocity.get_mut(axis),
            NoiseNumber::Attitude => self.attitude.as_mut(),
            NoiseNumber::Instrument(k) => self.instruments.numbers.get_mut(k),
            NoiseNumber::Drift => drift.map(|drift| &mut drift.std_m_s),
            NoiseNumber::DriftCorrelation => drift.map(|drift| &mut drift.correlation_s),
            NoiseNumber::Swell(axis) => swell.and_then(|swell| swell.std.get_mut(axis)),
            NoiseNumber::SwellFrequency => swell.map(|swell| &mut swell.frequency),
            NoiseNumber::SwellDamping => swell.map(|swell| &mut swell.damping),
            NoiseNumber::Jitter => self.jitter_s.as_mut(),
        }
    }

    /// Returns the index of the logarithm of a measurement's noise.
    pub(super) fn place_of(&self, of: &Observed) -> usize {
        self.place(match *of {
            Observed::Velocity(place) => NoiseNumber::Velocity(place),
            Observed::Down(_) => NoiseNumber::Attitude,
            Observed::Navigation { number, .. } => NoiseNumber::Instrument(number),
        })
    }

    pub(super) fn of_water(&self) -> Drift {
        self.drift.unwrap_or(Drift::NONE)
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

    #[test]
    fn numbers_stand_where_their_place_says() {
        let active = std::array::from_fn(|k| k % 3 != 1);
        let noise = Noise {
            disturbance: DVector::repeat(2, 1.0),
            correlation_s: DVector::repeat(2, 2.0),
            velocity: DVector::repeat(2, 3.0),
            attitude: Some(4.0),
            instruments: InstrumentNoise { active, ..InstrumentNoise::NONE },
            drift: Some(Drift::FIRST),
            swell: Some(Swell { std: DVector::repeat(2, 5.0), frequency: 6.0, damping: 0.1 }),
            jitter_s: Some(0.02),
        };
        let numbers = noise.numbers();
        assert_eq!(numbers.len(), noise.count());
        for (k, number) in numbers.iter().enumerate() {
            assert_eq!(noise.place(*number), k, "{number:?}");
            let mut moved = noise.logarithms();
            moved[k] += 0.5;
            let changed = noise.with_logarithms(&moved).logarithms() - noise.logarithms();
            assert!((changed[k] - 0.5).abs() < 1e-12 && (changed.sum() - 0.5).abs() < 1e-12);
        }
    }

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
