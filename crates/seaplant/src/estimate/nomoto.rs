//! Nomoto's steering models: yaw rate from rudder angle alone, by output error.

use nalgebra::{DMatrix, DVector, Vector2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Estimate;
use crate::{Error, Grid, Timed};

/// Form of the steering model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NomotoOrder {
    /// Second order, `T₁T₂ r̈ + (T₁ + T₂) ṙ + r = K (δ + T₃ δ̇)`, if true; else first order,
    /// `T ṙ + r = K δ`.
    pub is_second: bool,
    /// True if the model includes `α r³`, for ships without course stability.
    pub is_cubic: bool,
    /// Law of the rudder force.
    pub law: RudderLaw,
}

/// Lateral force of a rudder as a function of its angle δ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RudderLaw {
    /// Proportional to δ.
    #[default]
    Proportional,
    /// Proportional to `½ sin 2δ`: the lateral component, by cos δ, of a normal force that is
    /// proportional to sin δ; 22 % less than δ at 35 degrees.
    Sine,
}

impl RudderLaw {
    fn of(self, angle: f64) -> f64 {
        match self {
            Self::Proportional => angle,
            Self::Sine => 0.5 * (2.0 * angle).sin(),
        }
    }

    /// Returns the angle of a given force.
    fn angle(self, force: f64) -> f64 {
        match self {
            Self::Proportional => force,
            Self::Sine => 0.5 * (2.0 * force).clamp(-1.0, 1.0).asin(),
        }
    }
}

/// Rudder angle and yaw rate of a trial.
#[derive(Clone, Copy, Debug)]
pub struct SteeringTrial<'a> {
    /// δ, rad.
    pub angle: &'a Timed,
    /// r, rad/s.
    pub rate: &'a Timed,
    /// Time window, s.
    pub window_s: (f64, f64),
}

/// A steering model fitted to trials.
#[derive(Clone, Debug, PartialEq)]
pub struct NomotoFit {
    /// Form of the model.
    pub order: NomotoOrder,
    /// K, 1/s; negative together with T for a ship without course stability.
    pub gain: Estimate,
    /// T, or T₁ + T₂ − T₃ for the second order, s.
    pub time: Estimate,
    /// T₁ + T₂, T₁ T₂ and T₃ for the second order, s, s² and s.
    pub second: Option<[Estimate; 3]>,
    /// α, s²/rad²: coefficient of r³ where that of r is 1.
    pub cubic: Option<Estimate>,
    /// Rudder angle of a straight course, rad.
    pub neutral: Estimate,
    /// 1 − Σ(model − measured)²/Σ(measured − mean)² of the yaw rate, simulated in open loop from
    /// its fitted start.
    pub r2: f64,
    /// True if the ship is course stable.
    pub is_stable: bool,
    theta: DVector<f64>,
}

/// Number of coefficients of `r̈ = −a₁ ṙ − a₀ r − a₃ r³ + b₀ δ + b₁ δ̇ + β`, or for the first order
/// of `ṙ = −a₀ r − a₃ r³ + b₀ δ + β`.
const NAMES: usize = 6;

/// Limits of the sampling period, s.
const PERIOD_S: std::ops::RangeInclusive<f64> = 0.05..=1.0;

/// Yaw rate above which a simulation has diverged, rad/s.
const DIVERGED: f64 = 1e2;

/// Maximum number of steps of the search, and the relative gain below which it ends.
const MOST_STEPS: usize = 60;
const LEAST_GAIN: f64 = 1e-9;

/// A trial resampled to a uniform grid.
struct Sampled {
    step_s: f64,
    /// Rudder input after the law of its force.
    angle: Vec<f64>,
    rate: Vec<f64>,
}

impl Sampled {
    fn of(trial: &SteeringTrial<'_>, law: RudderLaw) -> Self {
        let (from, to) = trial.window_s;
        let step_s = trial.rate.period_s().clamp(*PERIOD_S.start(), *PERIOD_S.end());
        let from = from.max(trial.angle.first_s()).max(trial.rate.first_s());
        let to = to.min(trial.angle.last_s()).min(trial.rate.last_s());
        let grid = Grid::spanning(from, to, step_s);
        let angle = trial.angle.interpolate(grid).into_iter().map(|angle| law.of(angle)).collect();
        Self { step_s, angle, rate: trial.rate.interpolate(grid) }
    }

    /// Returns the first `count` samples.
    fn first(&self, count: usize) -> Self {
        let of = |values: &[f64]| values.iter().take(count).copied().collect();
        Self { step_s: self.step_s, angle: of(&self.angle), rate: of(&self.rate) }
    }
}

/// The model with the indices of its free coefficients.
struct Steering {
    order: NomotoOrder,
    free: Vec<usize>,
}

impl Steering {
    fn new(order: NomotoOrder) -> Self {
        // In the order a1, a0, a3, b0, b1, beta.
        let is_free = |k: &usize| match k {
            0 | 4 => order.is_second,
            2 => order.is_cubic,
            _ => true,
        };
        Self { order, free: (0..NAMES).filter(is_free).collect() }
    }

    fn full(&self, theta: &DVector<f64>) -> [f64; NAMES] {
        let mut all = [0.0; NAMES];
        for (x, k) in theta.iter().zip(&self.free) {
            all[*k] = *x;
        }
        all
    }

    /// Computes ẋ and its derivatives by x and by the coefficients; x is r and, for the second
    /// order, `ṙ + a₁ r − b₁ δ`.
    fn slope(&self, x: Vector2<f64>, angle: f64, theta: &[f64; NAMES]) -> Slopes {
        let [a1, a0, a3, b0, b1, beta] = *theta;
        let r = x[0];
        let low = -a0 * r - a3 * r.powi(3) + b0 * angle + beta;
        let by_r = -a0 - 3.0 * a3 * r * r;
        let by = [0.0, -r, -r.powi(3), angle, 0.0, 1.0];
        let mut by_theta = [Vector2::zeros(); NAMES];
        if self.order.is_second {
            for (column, by) in by_theta.iter_mut().zip(by) {
                column[1] = by;
            }
            by_theta[0][0] = -r;
            by_theta[4][0] = angle;
            let rate = Vector2::new(-a1 * r + x[1] + b1 * angle, low);
            let by_x = [Vector2::new(-a1, by_r), Vector2::new(1.0, 0.0)];
            return Slopes { rate, by_x, by_theta };
        }
        for (column, by) in by_theta.iter_mut().zip(by) {
            column[0] = by;
        }
        let by_x = [Vector2::new(by_r, 0.0), Vector2::zeros()];
        Slopes { rate: Vector2::new(low, 0.0), by_x, by_theta }
    }

    fn states(&self) -> usize {
        if self.order.is_second { 2 } else { 1 }
    }

    /// Simulates r at every instant, with its derivatives by the free coefficients and the start;
    /// `None` if it diverges.
    fn run(
        &self,
        theta: &[f64; NAMES],
        start: Vector2<f64>,
        trial: &Sampled,
    ) -> Option<(Vec<f64>, DMatrix<f64>)> {
        let (p, n) = (self.free.len(), self.states());
        let mut columns = vec![Vector2::zeros(); p + n];
        for k in 0..n {
            columns[p + k][k] = 1.0;
        }
        let mut state = start;
        let mut found = Vec::with_capacity(trial.rate.len());
        let mut slopes = DMatrix::zeros(trial.rate.len(), p + n);
        for k in 0..trial.rate.len() {
            found.push(state[0]);
            columns.iter().enumerate().for_each(|(j, column)| slopes[(k, j)] = column[0]);
            let Some(next) = trial.angle.get(k + 1) else { break };
            self.step(theta, &mut state, &mut columns, [trial.angle[k], *next], trial.step_s);
            if state[0].is_nan() || state[0].abs() >= DIVERGED {
                return None;
            }
        }
        Some((found, slopes))
    }

    /// Advances state and derivatives by one Runge–Kutta step, with a rudder angle linear in time.
    fn step(
        &self,
        theta: &[f64; NAMES],
        state: &mut Vector2<f64>,
        columns: &mut [Vector2<f64>],
        angle: [f64; 2],
        h: f64,
    ) {
        const PARTS: [f64; 4] = [0.0, 0.5, 0.5, 1.0];
        const WEIGHTS: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];
        let (first, starts) = (*state, columns.to_vec());
        let (mut before, mut slopes_before) =
            (Vector2::zeros(), vec![Vector2::zeros(); starts.len()]);
        for (part, weight) in PARTS.into_iter().zip(WEIGHTS) {
            let now = angle[0] + part * (angle[1] - angle[0]);
            let slopes = self.slope(first + before * (part * h), now, theta);
            for (j, column) in columns.iter_mut().enumerate() {
                let at = starts[j] + slopes_before[j] * (part * h);
                let own = self.free.get(j).map_or(Vector2::zeros(), |k| slopes.by_theta[*k]);
                let slope = slopes.by_x[0] * at[0] + slopes.by_x[1] * at[1] + own;
                slopes_before[j] = slope;
                *column += slope * (weight * h);
            }
            before = slopes.rate;
            *state += slopes.rate * (weight * h);
        }
    }

    /// Estimates the coefficients by least squares on integrals of the model, without
    /// differentiation.
    fn start(&self, trials: &[Sampled]) -> DVector<f64> {
        let (p, n) = (self.free.len(), self.states());
        let all = p + n * trials.len();
        let (mut normal, mut right) = (DMatrix::zeros(all, all), DVector::zeros(all));
        for (trial, sampled) in trials.iter().enumerate() {
            let mut sums = [0.0; NAMES];
            let mut twice = [0.0; NAMES];
            for k in 0..sampled.rate.len() {
                let (r, angle, h) = (sampled.rate[k], sampled.angle[k], sampled.step_s);
                let t = h * k as f64;
                let once = [-r, -r, -r.powi(3), angle, angle, 1.0];
                let mut row = DVector::zeros(all);
                for (j, name) in self.free.iter().enumerate() {
                    let is_once = !self.order.is_second || [0, 4].contains(name);
                    row[j] = if is_once { sums[*name] } else { twice[*name] };
                }
                row[p + n * trial] = 1.0;
                if n == 2 {
                    row[p + n * trial + 1] = t;
                }
                normal += &row * row.transpose();
                right += &row * r;
                for ((twice, sum), once) in twice.iter_mut().zip(&mut sums).zip(once) {
                    *twice += h * *sum + 0.5 * h * h * once;
                    *sum += h * once;
                }
            }
        }
        let scale = normal.diagonal().map(|x: f64| if x > 0.0 { 1.0 / x.sqrt() } else { 1.0 });
        let scaled = DMatrix::from_fn(all, all, |i, j| normal[(i, j)] * scale[i] * scale[j]);
        let eigen = scaled.symmetric_eigen();
        let target = right.component_mul(&scale);
        let mut found = DVector::zeros(all);
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *value > 1e-10 * eigen.eigenvalues.max() {
                found += vector * (vector.dot(&target) / value);
            }
        }
        found.component_mul(&scale)
    }

    /// Computes the residual of all trials and its derivatives; `None` if the simulation diverges.
    fn residual(&self, x: &DVector<f64>, trials: &[Sampled]) -> Option<Residual> {
        let (p, n) = (self.free.len(), self.states());
        let theta = self.full(&x.rows(0, p).into_owned());
        let samples = trials.iter().map(|trial| trial.rate.len()).sum();
        let (mut residual, mut slopes) =
            (DVector::zeros(samples), DMatrix::zeros(samples, x.len()));
        let mut from = 0;
        for (k, trial) in trials.iter().enumerate() {
            let at = p + n * k;
            let start = Vector2::new(x[at], if n == 2 { x[at + 1] } else { 0.0 });
            let (model, own) = self.run(&theta, start, trial)?;
            for (i, model) in model.iter().enumerate() {
                residual[from + i] = trial.rate[i] - model;
                for j in 0..p {
                    slopes[(from + i, j)] = own[(i, j)];
                }
                for j in 0..n {
                    slopes[(from + i, at + j)] = own[(i, p + j)];
                }
            }
            from += trial.rate.len();
        }
        Some((residual, slopes))
    }

    /// Computes the residual of one trial from a given start, and its derivatives by the start.
    fn residual_from(
        &self,
        theta: &[f64; NAMES],
        start: &DVector<f64>,
        trial: &Sampled,
    ) -> Option<Residual> {
        let (p, n) = (self.free.len(), self.states());
        let left = if n == 2 { start[1] } else { 0.0 };
        let (model, slopes) = self.run(theta, Vector2::new(start[0], left), trial)?;
        let residual = trial.rate.iter().zip(&model).map(|(rate, model)| rate - model);
        let residual = DVector::from_iterator(model.len(), residual);
        Some((residual, slopes.columns(p, n).into_owned()))
    }

    /// Computes the residual of a trial from the start that fits it best. The start is fitted on
    /// parts of increasing length, since an unstable ship amplifies small errors.
    fn least_residual(&self, theta: &[f64; NAMES], trial: &Sampled) -> Option<DVector<f64>> {
        let first = *trial.rate.first()?;
        // The initial ṙ is unknown; the first guess assumes a steady turn.
        let left = theta[0] * first - theta[4] * trial.angle[0];
        let mut start = DVector::from_column_slice(&[first, left][..self.states()]);
        for part in START_PARTS {
            let count = ((part * trial.rate.len() as f64) as usize).max(START_SAMPLES);
            let part = trial.first(count);
            let residual = |start: &DVector<f64>| self.residual_from(theta, start, &part);
            if let Some((found, ..)) = minimise(start.clone(), residual) {
                start = found;
            }
        }
        self.residual_from(theta, &start, trial).map(|(residual, _)| residual)
    }
}

/// Residual and its derivatives.
type Residual = (DVector<f64>, DMatrix<f64>);

/// Fractions of a trial on which its start is fitted in sequence, and their minimum number of
/// samples.
const START_PARTS: [f64; 4] = [0.125, 0.25, 0.5, 1.0];
const START_SAMPLES: usize = 10;

/// ẋ with its derivatives.
struct Slopes {
    rate: Vector2<f64>,
    by_x: [Vector2<f64>; 2],
    by_theta: [Vector2<f64>; NAMES],
}

/// Fits Nomoto's model to trials by output error of the yaw rate, simulated from a start that is
/// fitted as well.
///
/// Intervals account for the autocorrelation of the residual.
///
/// # Errors
/// [`Error::Plant`] if the rudder hardly moves or the model diverges from every start;
/// [`Error::TooShort`] if there are fewer than fifty samples.
///
/// # Source
/// \[Nomoto1957\]; the cubic term is Norrbin's, [Fossen2021, ch. 7].
///
/// # Example
/// ```
/// use seaplant::estimate::{NomotoOrder, RudderLaw, SteeringTrial, fit_nomoto};
/// use seaplant::Timed;
/// // K = 0.2 1/s, T = 5 s, the rudder put over every 12 s.
/// let (mut r, mut angles, mut rates) = (0.0, Vec::new(), Vec::new());
/// let times: Vec<f64> = (0..1200).map(|k| 0.1 * f64::from(k)).collect();
/// for t in &times {
///     let angle = if (t / 12.0) as usize % 2 == 0 { 0.3 } else { -0.3 };
///     (angles.push(angle), rates.push(r));
///     r += (0.2 * angle - r) * (1.0 - (-0.1_f64 / 5.0).exp());
/// }
/// let angle = Timed::new("rudder", times.clone(), angles)?;
/// let rate = Timed::new("r", times, rates)?;
/// let trial = SteeringTrial { angle: &angle, rate: &rate, window_s: (0.0, 119.0) };
/// let law = RudderLaw::Proportional;
/// let fit = fit_nomoto(&[trial], NomotoOrder { is_second: false, is_cubic: false, law })?;
/// assert!((fit.gain.value - 0.2).abs() < 0.005 && (fit.time.value - 5.0).abs() < 0.15);
/// # Ok::<(), seaplant::Error>(())
/// ```
pub fn fit_nomoto(trials: &[SteeringTrial<'_>], order: NomotoOrder) -> Result<NomotoFit, Error> {
    let sampled: Vec<Sampled> = trials.iter().map(|trial| Sampled::of(trial, order.law)).collect();
    let samples = sampled.iter().map(|trial| trial.rate.len()).sum::<usize>();
    if samples < LEAST_SAMPLES {
        let name = "the steering of the trials".to_owned();
        return Err(Error::TooShort { name, found: samples, needed: LEAST_SAMPLES });
    }
    let refuse = |reason: &str| Error::Plant { axes: "yaw".to_owned(), reason: reason.to_owned() };
    let spread = |of: &dyn Fn(&Sampled) -> &Vec<f64>| {
        let all: Vec<f64> = sampled.iter().flat_map(|trial| of(trial).clone()).collect();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        (all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / all.len() as f64).sqrt()
    };
    if spread(&|trial| &trial.angle) < LEAST_ANGLE || spread(&|trial| &trial.rate) == 0.0 {
        return Err(refuse(
            "the rudder hardly moves, so that its gain is not determined; deflect it to both sides, as in a zigzag",
        ));
    }
    let steering = Steering::new(order);
    let start = steering.start(&sampled);
    let found = minimise(start, |x| steering.residual(x, &sampled));
    let (x, residual, slopes) = found.ok_or_else(|| {
        refuse("the simulated steering model diverges, because the ship does not keep a straight course: fit the model with r³, or shorter trials")
    })?;
    Ok(results(&steering, &x, &residual, &slopes, &sampled))
}

/// Minimum number of samples for five coefficients.
const LEAST_SAMPLES: usize = 50;
/// Minimum standard deviation of the rudder angle, rad, for an estimate of the gain.
const LEAST_ANGLE: f64 = 5e-3;

/// Minimises by damped Gauss–Newton steps.
fn minimise(
    start: DVector<f64>,
    residual_at: impl Fn(&DVector<f64>) -> Option<Residual>,
) -> Option<(DVector<f64>, DVector<f64>, DMatrix<f64>)> {
    let mut x = start;
    let mut now = residual_at(&x);
    // A start from which the simulation diverges is moved towards zero.
    for _ in 0..20 {
        if now.is_some() {
            break;
        }
        x *= 0.7;
        now = residual_at(&x);
    }
    let (mut residual, mut slopes) = now?;
    let mut damping = 1e-4;
    for _ in 0..MOST_STEPS {
        let cost = residual.norm_squared();
        let normal = slopes.transpose() * &slopes;
        let right = slopes.transpose() * &residual;
        let mut gain = 0.0;
        while damping < 1e10 {
            let mut damped = normal.clone();
            for k in 0..x.len() {
                damped[(k, k)] += damping * normal[(k, k)].max(f64::MIN_POSITIVE);
            }
            let step = damped.cholesky().map(|factor| factor.solve(&right));
            let moved = step.map(|step| &x + step);
            let there = moved.and_then(|moved| Some((residual_at(&moved)?, moved)));
            if let Some(((new_residual, new_slopes), moved)) = there
                && new_residual.norm_squared() < cost
            {
                gain = (cost - new_residual.norm_squared()) / cost;
                (x, residual, slopes) = (moved, new_residual, new_slopes);
                damping = (damping / 8.0).max(1e-9);
                break;
            }
            damping *= 8.0;
        }
        if gain < LEAST_GAIN {
            break;
        }
    }
    Some((x, residual, slopes))
}

/// Computes K, T and their intervals.
fn results(
    steering: &Steering,
    x: &DVector<f64>,
    residual: &DVector<f64>,
    slopes: &DMatrix<f64>,
    trials: &[Sampled],
) -> NomotoFit {
    let p = steering.free.len();
    let theta = x.rows(0, p).into_owned();
    let samples = residual.len() as f64;
    let variance = residual.norm_squared() / (samples - x.len() as f64).max(1.0);
    let normal = slopes.transpose() * slopes;
    let inverse = normal.clone().pseudo_inverse(1e-14 * normal.amax()).unwrap_or(normal);
    let covariance = inverse.view((0, 0), (p, p)) * (variance * correlation_time(residual));
    let estimate = |of: &dyn Fn(&[f64; NAMES]) -> f64| {
        let value = of(&steering.full(&theta));
        let gradient = DVector::from_fn(p, |k, _| {
            let step = 1e-6 * theta[k].abs().max(1e-9);
            let at = |by: f64| {
                let mut moved = theta.clone();
                moved[k] += by;
                of(&steering.full(&moved))
            };
            (at(step) - at(-step)) / (2.0 * step)
        });
        let std = (gradient.transpose() * &covariance * &gradient)[(0, 0)].max(0.0).sqrt();
        Estimate::new(value, std, samples)
    };
    let is_second = steering.order.is_second;
    let of_time = |x: &[f64; NAMES]| {
        if is_second { x[0] / x[1] - x[4] / x[3] } else { 1.0 / x[1] }
    };
    let all = steering.full(&theta);
    let mean: f64 = trials.iter().flat_map(|trial| &trial.rate).sum::<f64>() / samples;
    let spread: f64 = trials.iter().flat_map(|trial| &trial.rate).map(|r| (r - mean).powi(2)).sum();
    NomotoFit {
        order: steering.order,
        gain: estimate(&|x| x[3] / x[1]),
        time: estimate(&of_time),
        second: is_second.then(|| {
            [estimate(&|x| x[0] / x[1]), estimate(&|x| 1.0 / x[1]), estimate(&|x| x[4] / x[3])]
        }),
        cubic: steering.order.is_cubic.then(|| estimate(&|x| x[2] / x[1])),
        neutral: estimate(&|x| steering.order.law.angle(-x[5] / x[3])),
        r2: 1.0 - residual.norm_squared() / spread,
        is_stable: all[1] > 0.0 && (!is_second || all[0] > 0.0),
        theta,
    }
}

/// Computes the factor by which autocorrelation increases a variance: `1 + 2 Σ ρ_k` up to where ρ
/// first becomes negative.
fn correlation_time(residual: &DVector<f64>) -> f64 {
    let power = residual.norm_squared();
    let mut sum = 1.0;
    for lag in 1..residual.len() / 4 {
        let product: f64 = residual.iter().zip(residual.iter().skip(lag)).map(|(a, b)| a * b).sum();
        if product <= 0.0 {
            break;
        }
        sum += 2.0 * product / power;
    }
    sum
}

impl NomotoFit {
    /// Computes R² of the yaw rate of another trial, simulated from the start that fits it best, as
    /// for the fitted trials; `None` if the model diverges.
    pub fn score(&self, trial: &SteeringTrial<'_>) -> Option<f64> {
        let steering = Steering::new(self.order);
        let sampled = Sampled::of(trial, self.order.law);
        let residual = steering.least_residual(&steering.full(&self.theta), &sampled)?;
        let mean = sampled.rate.iter().sum::<f64>() / sampled.rate.len() as f64;
        let spread: f64 = sampled.rate.iter().map(|rate| (rate - mean).powi(2)).sum();
        Some(1.0 - residual.norm_squared() / spread).filter(|r2| r2.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    use super::*;

    fn order(is_second: bool, is_cubic: bool) -> NomotoOrder {
        NomotoOrder { is_second, is_cubic, law: RudderLaw::Proportional }
    }

    /// Returns a zigzag of a model with known coefficients, with seeded noise of 0.05 °/s on r.
    fn zigzag(order: NomotoOrder, theta: [f64; NAMES], phase: f64) -> [Timed; 2] {
        let steering = Steering::new(order);
        let times: Vec<f64> = (0..1200).map(|k| 0.25 * f64::from(k)).collect();
        let angle =
            |t: &f64| 0.35 * ((0.11 * t + phase).sin() + 0.7 * (0.041 * t).sin()).clamp(-1.0, 1.0);
        let angle: Vec<f64> = times.iter().map(angle).collect();
        let force = angle.iter().map(|angle| order.law.of(*angle)).collect();
        let sampled = Sampled { step_s: 0.25, angle: force, rate: vec![0.0; 1200] };
        let (rate, _) = steering.run(&theta, Vector2::zeros(), &sampled).expect("bounded");
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let noise = Normal::new(0.0, 0.05_f64.to_radians()).expect("positive");
        let rate: Vec<f64> = rate.iter().map(|r| r + noise.sample(&mut random)).collect();
        let series = |values| Timed::new("test", times.clone(), values).expect("valid");
        [series(angle), series(rate)]
    }

    fn check(order: NomotoOrder, theta: [f64; NAMES]) -> NomotoFit {
        let logs = [zigzag(order, theta, 0.0), zigzag(order, theta, 1.0)];
        let trial = |[angle, rate]: &'_ [Timed; 2]| (angle.clone(), rate.clone());
        let logs = logs.each_ref().map(trial);
        let trials = logs.each_ref().map(|(angle, rate)| SteeringTrial {
            angle,
            rate,
            window_s: (0.0, 299.0),
        });
        let fit = fit_nomoto(&trials[..1], order).expect("a fit");
        let held = fit.score(&trials[1]).expect("bounded");
        assert!(fit.r2 > 0.98 && held > 0.97, "{} {held}", fit.r2);
        fit
    }

    #[test]
    fn recovers_gain_and_time_of_the_first_order() {
        // K = 0.15 1/s, T = 8 s, neutral angle 0.01 rad.
        let (k, t) = (0.15, 8.0);
        let theta = [0.0, 1.0 / t, 0.0, k / t, 0.0, -0.01 * k / t];
        let fit = check(order(false, false), theta);
        assert!((fit.gain.value - k).abs() < 3.0 * fit.gain.std + 1e-4, "{:?}", fit.gain);
        assert!((fit.time.value - t).abs() < 3.0 * fit.time.std + 1e-2, "{:?}", fit.time);
        assert!((fit.neutral.value - 0.01).abs() < 2e-3 && fit.is_stable);
    }

    #[test]
    fn recovers_the_times_of_the_second_order() {
        // T1 = 20 s, T2 = 3 s, T3 = 5 s, K = 0.2 1/s.
        let (k, t1, t2, t3) = (0.2, 20.0, 3.0, 5.0);
        let both = t1 * t2;
        let theta = [(t1 + t2) / both, 1.0 / both, 0.0, k / both, k * t3 / both, 0.0];
        let fit = check(order(true, false), theta);
        let [sum, product, zero] = fit.second.expect("second");
        for (found, expected) in [(fit.gain, k), (sum, t1 + t2), (product, both), (zero, t3)] {
            assert!((found.value - expected).abs() < 3.0 * found.std, "{found:?}, {expected}");
            assert!(found.std < 0.1 * expected, "{found:?}, {expected}");
        }
    }

    #[test]
    fn a_course_unstable_ship_has_a_negative_time() {
        // ṙ = 0.02 r − 300 r³ + 0.01 δ: without rudder it turns at 0.5 °/s.
        let theta = [0.0, -0.02, 300.0, 0.01, 0.0, 0.0];
        let fit = check(order(false, true), theta);
        assert!(!fit.is_stable && fit.time.value < 0.0 && fit.gain.value < 0.0, "{fit:?}");
        let alpha = fit.cubic.expect("cubic").value;
        assert!((alpha / (300.0 / -0.02) - 1.0).abs() < 0.1, "{alpha}");
    }

    #[test]
    fn an_unstable_ship_is_scored_from_the_best_start() {
        // r̈ = −0.5 ṙ + 0.014 r − 11 r³ − 0.0053 δ − 0.034 δ̇: an error of the start doubles every
        // 20 s.
        let order = NomotoOrder { law: RudderLaw::Sine, ..order(true, true) };
        let theta = [0.5, -0.014, 11.0, -0.0053, -0.034, 0.0];
        let fit = check(order, theta);
        assert!(!fit.is_stable, "{fit:?}");
        let proportional = NomotoOrder { law: RudderLaw::Proportional, ..order };
        let [angle, rate] = zigzag(order, theta, 0.0);
        let trial = SteeringTrial { angle: &angle, rate: &rate, window_s: (0.0, 299.0) };
        let other = fit_nomoto(&[trial], proportional).expect("a fit");
        assert!(other.r2 < fit.r2, "{} {}", other.r2, fit.r2);
    }

    #[test]
    fn refuses_a_rudder_that_stays_amidships() {
        let times: Vec<f64> = (0..100).map(|k| 0.5 * f64::from(k)).collect();
        let still = Timed::new("rudder", times.clone(), vec![0.0; 100]).expect("valid");
        let rate =
            Timed::new("r", times.clone(), times.iter().map(|t| t.sin()).collect::<Vec<_>>());
        let rate = rate.expect("valid");
        let trial = SteeringTrial { angle: &still, rate: &rate, window_s: (0.0, 50.0) };
        let error = fit_nomoto(&[trial], order(false, false)).expect_err("no rudder");
        assert!(error.to_string().contains("hardly moves"), "{error}");
    }
}
