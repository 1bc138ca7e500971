//! When the plant changed.

use super::colour::White;
use super::factor::Factor;
use super::recursive::Row;

/// A change of the plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// When it began, as far as blocks tell, s of the samples.
    pub since_s: f64,
    /// When it was noticed, s of the samples.
    pub noticed_s: f64,
    /// The sum that crossed the threshold.
    pub statistic: f64,
}

/// Blocks of this length, s, are each tested for another plant.
const BLOCK_S: f64 = 15.0;

/// So many blocks tell what is usual.
const LEARNT: usize = 8;

/// What a block must exceed the usual by to count, in standard deviations.
const SLACK: f64 = 1.0;

/// The standard deviation of the logarithm is taken as no smaller than this.
const LEAST_SPREAD: f64 = 0.5;

/// What is usual is remembered over so many blocks.
const BLOCKS: f64 = 40.0;

/// Added to the information of a block, as a part of its diagonal.
const RIDGE: f64 = 1e-3;

/// A change is said to be seen if so many blocks, two minutes, add up to the threshold.
const SEEN_IN: f64 = 8.0;

/// A cumulative sum over blocks.
///
/// Each block has the score statistic `g = sᵀ J⁻¹ s` of another plant, s = Σ φ e/σ² and
/// J = Σ φ φᵀ/σ², of residuals and regressors that pass the filter that makes residuals white:
/// slow forces that nobody logs hide no change that is faster. What colour is left makes g large
/// by itself, so that ln g is measured against its own mean and spread; what exceeds them by more
/// than the slack is added up.
///
/// # Source
/// [Basseville1993, ch. 2]: cumulative sums.
pub(super) struct Changes {
    threshold: f64,
    score: Vec<f64>,
    solved: Vec<f64>,
    information: Vec<f64>,
    factor: Factor,
    white: [White; 6],
    is_mass: Vec<bool>,
    block_s: f64,
    from_s: f64,
    learnt: usize,
    mean: f64,
    square: f64,
    /// Mean over blocks of `θᵀ J θ` of the masses.
    power: f64,
    sum: f64,
    since_s: f64,
}

impl Changes {
    /// A detector for coefficients of which some are masses.
    pub(super) fn new(is_mass: Vec<bool>, threshold: f64) -> Self {
        let count = is_mass.len();
        Self {
            threshold,
            score: vec![0.0; count],
            solved: vec![0.0; count],
            information: vec![0.0; count * count],
            factor: Factor::of(count),
            white: std::array::from_fn(|_| White::of(count)),
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

    /// Residuals begin anew after a gap.
    pub(super) fn restart(&mut self) {
        self.white.iter_mut().for_each(White::restart);
    }

    /// Adds what a sample of so many seconds says.
    pub(super) fn add(&mut self, row: &Row<'_>, h: f64) {
        let p = self.score.len();
        let Some(white) = self.white[row.axis].take(row.residual, row.regressors, h) else {
            return;
        };
        let weight = 1.0 / white.variance.max(f64::MIN_POSITIVE);
        for (a, (&i, phi)) in row.terms.iter().zip(white.regressors).enumerate() {
            self.score[i] += weight * phi * white.residual;
            // The lower half is all that is read.
            let information = &mut self.information[i * p..(i + 1) * p];
            for (&j, other) in row.terms[..=a].iter().zip(white.regressors) {
                information[j] += weight * phi * other;
            }
        }
    }

    /// Ends a sample; tells of a change when a block ends that says so. `theta` are the
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

    /// `θᵀ J θ` of the masses alone.
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

    /// By what part every mass must change at once to be noticed within two minutes; `None`
    /// before it is known what is usual.
    ///
    /// A change by the part f adds `f² θᵀ J θ` to g.
    pub(super) fn noticeable(&self) -> Option<f64> {
        let needed = (SLACK + self.threshold / SEEN_IN) * self.spread();
        let part = (self.mean.exp() * needed.exp_m1() / self.power).sqrt();
        (self.learnt >= LEARNT && part.is_finite()).then_some(part)
    }
}
