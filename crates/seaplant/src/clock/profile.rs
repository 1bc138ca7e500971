//! The likelihood of an offset: one series explained by the other, shifted.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::lattice::Smooth;
use crate::Grid;

/// A model of one series by another: a response on a lattice, other regressors, and the driver.
///
/// `y(t) = g x(t + δ) + Σ c_j z_j(t) + e(t)`, with e an autoregression.
pub(super) struct Problem {
    pub(super) grid: Grid,
    /// The response at the instants of the grid, `NaN` in gaps.
    pub(super) y: Vec<f64>,
    /// The regressors other than the driver; absent where the response is.
    pub(super) z: Vec<Vec<f64>>,
    pub(super) x: Smooth,
}

/// Order of the autoregression of the residuals.
const ORDER: usize = 8;

/// A smaller fraction of a sum of squares is rounding.
const ROUNDING: f64 = 1e-12;

/// Least disagreement of two instruments, relative to the variance of the signal. Without it,
/// noise-free signals would be judged by their interpolation.
const AGREEMENT: f64 = 1e-8;

/// Least number of rows for each fitted number.
const ROWS_FOR_EACH: usize = 4;

/// Instants at which an offset can be evaluated, in stretches without gaps.
pub(super) struct Rows {
    runs: Vec<Range<usize>>,
}

/// An offset with its likelihood and coefficients.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Profile {
    pub(super) offset_s: f64,
    /// Log-likelihood above that of a response independent of the driver.
    pub(super) gain: f64,
    /// g.
    pub(super) slope: f64,
    /// The autoregression coefficients of the residuals.
    phi: Vec<f64>,
    /// Variance of the innovations.
    variance: f64,
}

impl Problem {
    /// Returns the instants at which all offsets within `margin_s` of one can be evaluated; `None`
    /// if there are too few.
    pub(super) fn rows(&self, offset_s: f64, margin_s: f64) -> Option<Rows> {
        let known = |k: usize| {
            let t = self.grid.time(k) + offset_s;
            !self.y[k].is_nan() && self.x.at(t, margin_s).is_some()
        };
        let rows = Rows::where_known(self.grid.len, known);
        let needed = ROWS_FOR_EACH * (ORDER + self.z.len() + 1);
        (rows.whitened() >= needed).then_some(rows)
    }

    /// Evaluates the likelihood of an offset; fits the autoregression of the residuals, too.
    pub(super) fn profile(&self, rows: &Rows, offset_s: f64) -> Option<Profile> {
        let (y, z) = (rows.pick(&self.y), self.other_regressors(rows));
        let x = self.driver(rows, offset_s);
        let with: Vec<&[f64]> = std::iter::once(&x).chain(&z).map(Vec::as_slice).collect();
        let without: Vec<&[f64]> = z.iter().map(Vec::as_slice).collect();
        let driven = regress(rows, &y, &with)?;
        let alone = regress(rows, &y, &without)?;
        let gain = 0.5 * rows.whitened() as f64 * (alone.variance / driven.variance).ln();
        let Regression { phi, variance, coefficients } = driven;
        Some(Profile { offset_s, gain, slope: coefficients[0], phi, variance })
    }

    /// Returns the log-likelihoods of several offsets up to a constant, with the autoregression of
    /// a neighbouring one.
    pub(super) fn scan(&self, rows: &Rows, near: &Profile, offsets_s: &[f64]) -> Vec<f64> {
        let picked = rows.pick(&self.y);
        let floor = AGREEMENT * dot(&picked, &picked);
        let y = rows.whiten(&picked, &near.phi);
        let z = self.other_regressors(rows).into_iter().map(|z| rows.whiten(&z, &near.phi));
        let z = Orthonormal::new(z.collect());
        let y = z.remove_from(y);
        let of = |&offset_s: &f64| {
            let x = z.remove_from(rows.whiten(&self.driver(rows, offset_s), &near.phi));
            let (xx, xy, yy) = (dot(&x, &x), dot(&x, &y), dot(&y, &y));
            let explained = if xx > 0.0 { xy * xy.max(0.0) / xx } else { 0.0 };
            -0.5 * y.len() as f64 * (yy - explained + floor).max(f64::MIN_POSITIVE).ln()
        };
        offsets_s.iter().map(of).collect()
    }

    /// Returns the standard error of an offset at the maximum of its likelihood.
    ///
    /// `√(V / I²)`: I is the curvature of the likelihood, to which noise of the driver does not
    /// contribute, and V the long-run variance of the scores `g ẋ e / σ²`, which remains valid
    /// where the innovations are still correlated. Never less than `1/√I`.
    pub(super) fn std_s(&self, rows: &Rows, top: &Profile, step_s: f64) -> Option<f64> {
        let at = [top.offset_s - step_s, top.offset_s, top.offset_s + step_s];
        let scores = self.scan(rows, top, &at);
        // Sums of squares are nearly quadratic where their logarithm, over a step of many standard
        // errors, is not.
        let half = 0.5 * rows.whitened() as f64;
        let left = |k: usize| ((scores[1] - scores[k]) / half).exp();
        let information = half * (left(0) - 2.0 + left(2)) / (step_s * step_s);
        if information.is_nan() || information <= 0.0 {
            return None;
        }
        let whiten = |x: &[f64]| rows.whiten(x, &top.phi);
        let [early, x, late] = at.map(|offset_s| whiten(&self.driver(rows, offset_s)));
        let rate = late.iter().zip(&early).map(|(late, early)| 0.5 * (late - early) / step_s);
        let rate: Vec<f64> = rate.collect();
        let z: Vec<Vec<f64>> = self.other_regressors(rows).iter().map(|z| whiten(z)).collect();
        let explained = Orthonormal::new(std::iter::once(x).chain(z).collect());
        let residual = explained.remove_from(whiten(&rows.pick(&self.y)));
        let rate = explained.remove_from(rate);
        let scores = residual.iter().zip(&rate).map(|(e, x)| top.slope * x * e / top.variance);
        let spread = long_run_variance(&scores.collect::<Vec<f64>>());
        Some((spread / (information * information)).max(1.0 / information).sqrt())
    }

    /// Returns the correlation of response and driver at an offset, after removal of the other
    /// regressors from both.
    pub(super) fn correlation(&self, rows: &Rows, offset_s: f64) -> f64 {
        let z = Orthonormal::new(self.other_regressors(rows));
        let (x, y) =
            (z.remove_from(self.driver(rows, offset_s)), z.remove_from(rows.pick(&self.y)));
        let size = (dot(&x, &x) * dot(&y, &y)).sqrt();
        if size > 0.0 { dot(&x, &y) / size } else { 0.0 }
    }

    /// Returns the part of the response that the other regressors do not explain; `NaN` in gaps.
    pub(super) fn unexplained(&self) -> Vec<f64> {
        let rows = Rows::known_in(&self.y);
        let left = Orthonormal::new(self.other_regressors(&rows)).remove_from(rows.pick(&self.y));
        rows.spread(left, self.y.len())
    }

    /// Returns the other regressors and a constant.
    fn other_regressors(&self, rows: &Rows) -> Vec<Vec<f64>> {
        let constant = vec![1.0; rows.count()];
        self.z.iter().map(|z| rows.pick(z)).chain([constant]).collect()
    }

    fn driver(&self, rows: &Rows, offset_s: f64) -> Vec<f64> {
        let at = |k| self.x.at(self.grid.time(k) + offset_s, 0.0).unwrap_or(f64::NAN);
        rows.instants().map(at).collect()
    }
}

impl Rows {
    /// Selects all known instants of a series that may have gaps.
    fn known_in(series: &[f64]) -> Self {
        Self::where_known(series.len(), |k| !series[k].is_nan())
    }

    /// Selects runs of known instants, each longer than the autoregression.
    fn where_known(instants: usize, known: impl Fn(usize) -> bool) -> Self {
        let mut runs: Vec<Range<usize>> = Vec::new();
        for k in (0..instants).filter(|&k| known(k)) {
            match runs.last_mut() {
                Some(run) if run.end == k => run.end = k + 1,
                _ => runs.push(k..k + 1),
            }
        }
        runs.retain(|run| run.len() > 2 * ORDER);
        Self { runs }
    }

    fn instants(&self) -> impl Iterator<Item = usize> + '_ {
        self.runs.iter().flat_map(Clone::clone)
    }

    fn count(&self) -> usize {
        self.runs.iter().map(Range::len).sum()
    }

    /// Returns the number of innovations: the first instants of each run serve as history only.
    fn whitened(&self) -> usize {
        self.count() - ORDER * self.runs.len()
    }

    fn pick(&self, series: &[f64]) -> Vec<f64> {
        self.instants().map(|k| series[k]).collect()
    }

    /// Places selected values at their instants, and `NaN` at all others.
    fn spread(&self, picked: Vec<f64>, instants: usize) -> Vec<f64> {
        let mut series = vec![f64::NAN; instants];
        self.instants().zip(picked).for_each(|(k, x)| series[k] = x);
        series
    }

    /// Returns the runs of selected values one by one.
    fn parts<'a>(&'a self, picked: &'a [f64]) -> impl Iterator<Item = &'a [f64]> {
        let mut rest = picked;
        self.runs.iter().map(move |run| {
            let (part, after) = rest.split_at(run.len());
            rest = after;
            part
        })
    }

    /// Returns `x_k − Σ φ_j x_{k−j}` of all but the first instants of each run.
    fn whiten(&self, picked: &[f64], phi: &[f64]) -> Vec<f64> {
        let mut out = Vec::with_capacity(self.whitened());
        for part in self.parts(picked) {
            out.extend(part.windows(ORDER + 1).map(|w| {
                let past = w[..ORDER].iter().rev();
                w[ORDER] - phi.iter().zip(past).map(|(phi, x)| phi * x).sum::<f64>()
            }));
        }
        out
    }
}

/// Whitens two series by the autoregression of the first; `None` if that cannot be estimated. Both
/// may have gaps.
pub(super) fn whitened(y: &[f64], x: &[f64]) -> Option<[Vec<f64>; 2]> {
    let rows = Rows::known_in(y);
    let phi = autoregression(&rows, &rows.pick(y))?;
    let whiten = |series: &[f64]| {
        let rows = Rows::known_in(series);
        let white = rows.whiten(&rows.pick(series), &phi);
        let runs = rows.runs.iter().map(|run| run.start + ORDER..run.end).collect();
        Rows { runs }.spread(white, series.len())
    };
    Some([whiten(y), whiten(x)])
}

struct Regression {
    coefficients: Vec<f64>,
    phi: Vec<f64>,
    variance: f64,
}

/// Fits least squares with autoregressive residuals by alternating between the autoregression and
/// the coefficients.
fn regress(rows: &Rows, y: &[f64], columns: &[&[f64]]) -> Option<Regression> {
    /// Each iteration gains less than a tenth of the one before.
    const TURNS: usize = 4;
    let mut coefficients = least_squares(y, columns)?;
    let mut phi = Vec::new();
    for _ in 0..TURNS {
        let residual = residual(y, columns, &coefficients);
        phi = autoregression(rows, &residual)?;
        let white: Vec<Vec<f64>> = columns.iter().map(|x| rows.whiten(x, &phi)).collect();
        let white: Vec<&[f64]> = white.iter().map(Vec::as_slice).collect();
        coefficients = least_squares(&rows.whiten(y, &phi), &white)?;
    }
    let left = rows.whiten(&residual(y, columns, &coefficients), &phi);
    let variance = (dot(&left, &left) + AGREEMENT * dot(y, y)) / left.len() as f64;
    (variance > 0.0).then_some(Regression { coefficients, phi, variance })
}

fn residual(y: &[f64], columns: &[&[f64]], coefficients: &[f64]) -> Vec<f64> {
    let mut left = y.to_vec();
    for (column, c) in columns.iter().zip(coefficients) {
        left.iter_mut().zip(*column).for_each(|(y, x)| *y -= c * x);
    }
    left
}

/// Estimates the coefficients φ of `e_k = Σ φ_j e_{k−j}` by least squares, which unlike those from
/// autocovariances are not biased towards zero.
fn autoregression(rows: &Rows, residual: &[f64]) -> Option<Vec<f64>> {
    let lagged = |lag: usize| -> Vec<f64> {
        let of_run = |run: &[f64]| run[ORDER - lag..run.len() - lag].to_vec();
        rows.parts(residual).flat_map(of_run).collect()
    };
    let past: Vec<Vec<f64>> = (1..=ORDER).map(lagged).collect();
    least_squares(&lagged(0), &past.iter().map(Vec::as_slice).collect::<Vec<_>>())
}

/// Solves least squares by normal equations of columns scaled to unit length.
fn least_squares(y: &[f64], columns: &[&[f64]]) -> Option<Vec<f64>> {
    /// Regularises nearly collinear columns.
    const RIDGE: f64 = 1e-10;
    let lengths: Vec<f64> =
        columns.iter().map(|x| dot(x, x).sqrt().max(f64::MIN_POSITIVE)).collect();
    let p = columns.len();
    let normal = DMatrix::from_fn(p, p, |j, k| {
        let ridge = if j == k { RIDGE } else { 0.0 };
        dot(columns[j], columns[k]) / (lengths[j] * lengths[k]) + ridge
    });
    let right = DVector::from_fn(p, |j, _| dot(columns[j], y) / lengths[j]);
    let solved = normal.cholesky()?.solve(&right);
    Some(solved.iter().zip(&lengths).map(|(c, length)| c / length).collect())
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// An orthonormal basis of columns.
struct Orthonormal(Vec<Vec<f64>>);

impl Orthonormal {
    fn new(columns: Vec<Vec<f64>>) -> Self {
        let mut found = Self(Vec::with_capacity(columns.len()));
        for column in columns {
            let whole = dot(&column, &column);
            let mut left = found.remove_from(column);
            let size = dot(&left, &left);
            if size > ROUNDING * whole {
                left.iter_mut().for_each(|x| *x /= size.sqrt());
                found.0.push(left);
            }
        }
        found
    }

    /// Returns the component of a series orthogonal to all columns.
    fn remove_from(&self, mut series: Vec<f64>) -> Vec<f64> {
        for column in &self.0 {
            let part = dot(column, &series);
            series.iter_mut().zip(column).for_each(|(x, c)| *x -= part * c);
        }
        series
    }
}

/// Returns `n γ₀ + 2 n Σ w_j γ_j` with linearly decreasing weights.
///
/// # Source
/// \[Newey1987\].
fn long_run_variance(scores: &[f64]) -> f64 {
    let lags = (scores.len() as f64).cbrt().ceil() as usize;
    let at = |lag: usize| dot(&scores[lag..], &scores[..scores.len() - lag]);
    let weighted = |lag: usize| 2.0 * (1.0 - lag as f64 / (lags + 1) as f64) * at(lag);
    (at(0) + (1..=lags).map(weighted).sum::<f64>()).max(0.0)
}
