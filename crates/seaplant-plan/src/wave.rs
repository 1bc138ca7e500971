//! Time courses of a manoeuvre's forces.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A force in time, N or N m, or thrust of opposing thrusters, N.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Wave {
    /// `Σ a sin(ω t + φ)`: rows of amplitude, rad/s, rad.
    Sines {
        /// One row per sine.
        sines: Vec<[f64; 3]>,
    },
    /// Values from instants on, repeated: rows of s since the start of each period, value.
    Steps {
        /// The rows; times increase from 0.
        steps: Vec<[f64; 2]>,
        /// Length of a period, s.
        period_s: f64,
    },
    /// The sum of others.
    Sum {
        /// The summands.
        waves: Vec<Wave>,
    },
}

impl Wave {
    /// Returns the value at a time since the start of the manoeuvre, s.
    ///
    /// ```
    /// use seaplant_plan::Wave;
    /// let wave = Wave::Steps { steps: vec![[0.0, 2.0], [1.0, -2.0]], period_s: 2.0 };
    /// assert_eq!((wave.at(0.5), wave.at(1.5), wave.at(2.5)), (2.0, -2.0, 2.0));
    /// ```
    pub fn at(&self, t_s: f64) -> f64 {
        match self {
            Self::Sines { sines } => {
                sines.iter().map(|[a, rate, phase]| a * (rate * t_s + phase).sin()).sum()
            }
            Self::Steps { steps, period_s } => {
                let t = t_s.rem_euclid(*period_s);
                let after = steps.partition_point(|[from, _]| *from <= t);
                steps[after.saturating_sub(1)][1]
            }
            Self::Sum { waves } => waves.iter().map(|wave| wave.at(t_s)).sum(),
        }
    }

    /// Scales the values by a factor.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        match self {
            Self::Sines { sines } => Self::Sines {
                sines: sines.iter().map(|[a, rate, phase]| [factor * a, *rate, *phase]).collect(),
            },
            Self::Steps { steps, period_s } => Self::Steps {
                steps: steps.iter().map(|[t, value]| [*t, factor * value]).collect(),
                period_s: *period_s,
            },
            Self::Sum { waves } => {
                Self::Sum { waves: waves.iter().map(|wave| wave.scaled(factor)).collect() }
            }
        }
    }

    /// Stretches the time by a factor.
    pub(crate) fn stretched(&self, factor: f64) -> Self {
        match self {
            Self::Sines { sines } => Self::Sines {
                sines: sines.iter().map(|[a, rate, phase]| [*a, rate / factor, *phase]).collect(),
            },
            Self::Steps { steps, period_s } => Self::Steps {
                steps: steps.iter().map(|[t, x]| [t * factor, *x]).collect(),
                period_s: period_s * factor,
            },
            Self::Sum { waves } => {
                Self::Sum { waves: waves.iter().map(|wave| wave.stretched(factor)).collect() }
            }
        }
    }

    /// Creates a sum of harmonics of equal amplitude and greatest value `most`, with phases of a
    /// low crest factor.
    ///
    /// Starts from Schroeder's phases; then each phase in turn takes the best of some random ones.
    ///
    /// # Source
    /// \[Schroeder1970\].
    pub(crate) fn multisine(most: f64, period_s: f64, harmonics: &[u32], seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let n = harmonics.len() as f64;
        let schroeder = |k: usize| -std::f64::consts::PI * (k * k) as f64 / n;
        let mut phases: Vec<f64> = (0..harmonics.len()).map(schroeder).collect();
        let mut peak = peak(harmonics, &phases);
        for _ in 0..ROUNDS {
            for k in 0..phases.len() {
                let before = phases[k];
                phases[k] = random.random_range(0.0..std::f64::consts::TAU);
                let there = self::peak(harmonics, &phases);
                if there < peak { peak = there } else { phases[k] = before }
            }
        }
        let rate = std::f64::consts::TAU / period_s;
        let row = |(h, phase): (&u32, &f64)| [most / peak, rate * f64::from(*h), *phase];
        Self::Sines { sines: harmonics.iter().zip(&phases).map(row).collect() }
    }

    /// Creates harmonics of equal amplitude with Schroeder's phases, which sweep through their
    /// frequencies.
    pub(crate) fn sweep(most: f64, period_s: f64, count: u32) -> Self {
        let n = f64::from(count);
        let rate = std::f64::consts::TAU / period_s;
        let harmonics: Vec<u32> = (1..=count).collect();
        let phase = |k: u32| -std::f64::consts::PI * f64::from(k * k) / n;
        let phases: Vec<f64> = (0..count).map(phase).collect();
        let amplitude = most / peak(&harmonics, &phases);
        let row = |(h, phase): (&u32, &f64)| [amplitude, rate * f64::from(*h), *phase];
        Self::Sines { sines: harmonics.iter().zip(&phases).map(row).collect() }
    }

    /// Creates levels as a pilot holds them on a joystick: of random lengths, both ways and zero,
    /// with zero mean.
    pub(crate) fn joystick(most: f64, hold_s: [f64; 2], seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let (mut steps, mut t) = (Vec::new(), 0.0);
        for _ in 0..JOYSTICK_PAIRS {
            let level = most * LEVELS[random.random_range(0..LEVELS.len())];
            let length = random.random_range(hold_s[0]..hold_s[1]);
            for value in [level, -level] {
                steps.push([t, value]);
                t += length;
            }
            if random.random_bool(REST) {
                steps.push([t, 0.0]);
                t += hold_s[0];
            }
        }
        Self::Steps { steps, period_s: t }
    }
}

/// Number of rounds of the phase search.
const ROUNDS: usize = 30;
/// Number of points of a period at which the peak is evaluated.
const POINTS: usize = 128;
/// Number of pairs of joystick levels in a period.
const JOYSTICK_PAIRS: usize = 6;
/// Levels, as fractions of the greatest.
const LEVELS: [f64; 4] = [0.35, 0.55, 0.8, 1.0];
/// Fraction of pairs that are followed by a pause.
const REST: f64 = 0.3;

/// Returns the greatest value of a sum of unit harmonics.
fn peak(harmonics: &[u32], phases: &[f64]) -> f64 {
    let at = |k: usize| {
        let turn = std::f64::consts::TAU * k as f64 / POINTS as f64;
        let all = harmonics.iter().zip(phases);
        all.map(|(h, phase)| (f64::from(*h) * turn + phase).sin()).sum::<f64>().abs()
    };
    (0..POINTS).map(at).fold(0.0, f64::max)
}

/// Derives a separate seed for every random quantity.
pub(crate) fn seed_of(seed: u64, name: &str) -> u64 {
    // FNV-1a: the same on every machine, and different for names that differ by a letter.
    let start = 0xcbf2_9ce4_8422_2325_u64 ^ seed;
    name.bytes().fold(start, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_keep_the_peak_of_a_multisine_low() {
        let harmonics = [1, 2, 3, 4, 5, 7];
        let wave = Wave::multisine(10.0, 20.0, &harmonics, 1);
        let values: Vec<f64> = (0..2000).map(|k| wave.at(0.01 * f64::from(k))).collect();
        let peak = values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let rms = (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt();
        // Between two points of the search the peak is a little higher.
        assert!(peak < 10.2 && peak > 9.5, "{peak}");
        // Phases of zero give √(2 · 6) = 3.5 times the rms and more.
        assert!(peak / rms < 2.0, "{}", peak / rms);
    }

    #[test]
    fn a_joystick_has_zero_mean() {
        let wave = Wave::joystick(5.0, [2.0, 6.0], 3);
        let Wave::Steps { period_s, .. } = &wave else { panic!("steps") };
        let n = (period_s / 0.01) as usize;
        let mean: f64 = (0..n).map(|k| wave.at(0.01 * k as f64)).sum::<f64>() / n as f64;
        assert!(mean.abs() < 0.02, "{mean}");
    }
}
