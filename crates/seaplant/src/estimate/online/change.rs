//! Detection of changes of the plant.

use super::colour::Whitening;
use super::factor::Factor;
use super::recursive::Row;

/// A detected change of the plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Estimated start of the change, to the resolution of a block, s of the samples' time.
    pub since_s: f64,
    /// Time of detection, s of the samples' time.
    pub noticed_s: f64,
    /// Value of the cumulative sum that exceeded the threshold.
    pub statistic: f64,
}

/// Length of a block, s; each is tested for a different plant.
const BLOCK_S: f64 = 15.0;

/// Number of blocks from which the normal statistics are learnt.
const LEARNT: usize = 8;

/// Slack of the cumulative sum, in standard deviations.
const SLACK: f64 = 1.0;

/// Lower limit of the standard deviation of the logarithm.
const LEAST_SPREAD: f64 = 0.5;

/// Memory of the normal statistics, blocks.
const BLOCKS: f64 = 40.0;

/// Fraction of its diagonal that is added to the information of a block.
const RIDGE: f64 = 1e-3;

/// A change counts as detectable if this many blocks, two minutes, reach the threshold.
const SEEN_IN: f64 = 8.0;

/// Change detection by a cumulative sum over blocks.
///
/// For each block it computes the score statistic `g = sᵀ J⁻¹ s` of a different plant, with s = Σ φ
/// e/σ² and J = Σ φ φᵀ/σ². Residuals and regressors pass a whitening filter first, so that slow
/// unlogged forces do not hide faster changes. Remaining autocorrelation enlarges g, so that ln g
/// is compared with its own mean and standard deviation; the excess over the slack is accumulated.
///
/// # Source
/// [Basseville1993, ch. 2]: cumulative sums.
pub(super) struct Changes {
    threshold: f64,
    score: Vec<f64>,
    solved: Vec<f64>,
    information: Vec<f64>,
    factor: Factor,
    whitening: [Whitening; 6],
    is_mass: Vec<bool>,
    block_s: f64,
    from_s: f64,
    learnt: usize,
    mean: f64,
    square: f64,
    /// Mean over blocks of `θᵀ J θ` over the masses.
    power: f64,
    sum: f64,
    since_s: f64,
}

impl Changes {
    /// Creates a detector; `is_mass` marks the coefficients that are masses.
    pub(super) fn new(is_mass: Vec<bool>, threshold: f64) -> Self {
        let count = is_mass.len();
        Self {
            threshold,
            score: vec![0.0; count],
            solved: vec![0.0; count],
            information: vec![0.0; count * count],
            factor: Factor::new(count),
            whitening: std::array::from_fn(|_| Whitening::new(count)),
            is_mass,
            block_s: 0.0,
            from_s: 0.0,
            learnt: 0,
            mean: 0.0,
            square: 0.0,
            power: 0.0,
            sum: 0.0,
            since_s: 0.0,
        }
    }

    /// Restarts the whitening after a gap.
    pub(super) fn restart(&mut self) {
        self.whitening.iter_mut().for_each(Whitening::restart);
    }

    /// Adds one axis of a sample that lasts `h` seconds.
    pub(super) fn add(&mut self, row: &Row<'_>, h: f64) {
        let p = self.score.len();
        let Some(white) = self.whitening[row.axis].take(row.residual, row.regressors, h) else {
            return;
        };
        let weight = 1.0 / white.variance.max(f64::MIN_POSITIVE);
        for (a, (&i, phi)) in row.terms.iter().zip(white.regressors).enumerate() {
            self.score[i] += weight * phi * white.residual;
            // Only the lower triangle is used.
            let information = &mut self.information[i * p..(i + 1) * p];
            for (&j, other) in row.terms[..=a].iter().zip(white.regressors) {
                information[j] += weight * phi * other;
            }
        }
    }

    /// Ends a sample; returns a change if a block ends with one detected. `theta` are the
    /// coefficients, shape (p,).
    pub(super) fn end(&mut self, until_s: f64, h: f64, theta: &[f64]) -> Option<Change> {
        if self.block_s == 0.0 {
            self.from_s = until_s - h;
        }
        self.block_s += h;
        if self.block_s < BLOCK_S {
            return None;
        }
        self.factor.set(&self.information, RIDGE);
        self.solved.copy_from_slice(&self.score);
        self.factor.solve(&mut self.solved);
        let g: f64 = self.solved.iter().zip(&self.score).map(|(x, s)| x * s).sum();
        let power = self.mass_power(theta);
        self.score.fill(0.0);
        self.information.fill(0.0);
        self.block_s = 0.0;
        let found = self.judge(g.max(f64::MIN_POSITIVE).ln(), power, until_s);
        if found.is_some() {
            (self.learnt, self.sum) = (0, 0.0);
        }
        found
    }

    /// Computes `θᵀ J θ` over the masses.
    fn mass_power(&self, theta: &[f64]) -> f64 {
        let p = theta.len();
        let masses = || (0..p).filter(|k| self.is_mass[*k]);
        let of = |i: usize, j: usize| {
            let twice = if i == j { 1.0 } else { 2.0 };
            twice * theta[i] * self.information[i * p + j] * theta[j]
        };
        masses().map(|i| masses().take_while(|j| *j <= i).map(|j| of(i, j)).sum::<f64>()).sum()
    }

    fn spread(&self) -> f64 {
        (self.square - self.mean * self.mean).max(0.0).sqrt().max(LEAST_SPREAD)
    }

    fn judge(&mut self, z: f64, power: f64, until_s: f64) -> Option<Change> {
        let beyond = (z - self.mean) / self.spread();
        let is_usual = self.learnt < LEARNT || beyond < 2.0 + SLACK;
        if self.learnt >= LEARNT {
            let sum = (self.sum + beyond - SLACK).max(0.0);
            if self.sum == 0.0 {
                self.since_s = self.from_s;
            }
            self.sum = sum;
            if sum > self.threshold {
                let (since_s, statistic) = (self.since_s, sum);
                return Some(Change { since_s, noticed_s: until_s, statistic });
            }
        }
        if is_usual {
            self.learnt += 1;
            let part = 1.0 / (self.learnt as f64).min(BLOCKS);
            self.mean += part * (z - self.mean);
            self.square += part * (z * z - self.square);
            self.power += part * (power - self.power);
        }
        None
    }

    /// Returns the relative change of all masses that would be detected within two minutes; `None`
    /// until the normal statistics are known.
    ///
    /// A relative change f adds `f² θᵀ J θ` to g.
    pub(super) fn noticeable(&self) -> Option<f64> {
        let needed = (SLACK + self.threshold / SEEN_IN) * self.spread();
        let part = (self.mean.exp() * needed.exp_m1() / self.power).sqrt();
        (self.learnt >= LEARNT && part.is_finite()).then_some(part)
    }
}
