//! Share of the change of velocity that forces explain, by least squares without derivatives.

use nalgebra::{DMatrix, DVector};

use crate::Dof;

/// The data of one trial for all axes, at the same instants.
pub(super) struct View {
    /// Sampling period, s.
    pub(super) period_s: f64,
    /// True if all data are present at an instant.
    pub(super) is_whole: Vec<bool>,
    /// True if a heading turned surge and sway from velocity over ground.
    pub(super) is_turned: bool,
    /// Velocity in SNAME order, m/s and rad/s.
    pub(super) velocity: [Option<Vec<f64>>; 6],
    /// Force in SNAME order, N and N m; of axes with a force.
    pub(super) force: [Option<Vec<f64>>; 6],
    /// Forces per unit of unknown strength, in SNAME order.
    pub(super) effects: Vec<[Option<Vec<f64>>; 6]>,
    /// The separate forces that sum to `force`.
    pub(super) forces: Vec<Vec<f64>>,
    /// Roll and pitch, rad.
    pub(super) tilt: [Option<Vec<f64>>; 2],
}

/// Settings of the regression of an axis: the length of test functions and the delay of force, in
/// instants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Settings {
    length: usize,
    delay: usize,
}

/// The regression of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Explained {
    /// The unexplained share of the variance of the change of velocity, by cross-validation; within
    /// [`LEAST_UNEXPLAINED`] and 1.
    pub(super) unexplained: f64,
    /// The variance of the change of velocity over a test function, m² or rad² (up to a factor).
    pub(super) variation: f64,
    /// Velocity per force and time, 1/kg or 1/(kg m²); not negative.
    pub(super) alpha: f64,
    /// Number of test functions without overlap.
    pub(super) windows: usize,
}

/// Least unexplained share: that of sensor noise, below which models do not differ.
const LEAST_UNEXPLAINED: f64 = 0.003;

/// Candidate lengths of test functions, s: from small vehicles to ships.
const LENGTHS_S: [f64; 5] = [2.4, 5.0, 10.0, 20.0, 40.0];

/// Candidate delays of force, in instants of 0.2 s: those of propellers.
const DELAYS: [usize; 4] = [0, 1, 2, 4];

/// Settings explain as much as the best if they leave at most this factor of its unexplained share: then those of
/// most test functions are chosen, as long delays may explain a fast motion by the sign that is wrong.
const NEARLY_BEST: f64 = 1.2;

/// Test functions overlap by half, as they are zero at both ends.
const OVERLAP: usize = 2;

/// Number of folds of the cross-validation, each of pieces from all parts of a trial.
const FOLDS: usize = 4;
const PIECES: usize = 8;

/// Least number of test functions for each coefficient.
const LEAST_WINDOWS: usize = 2;

/// The terms of the equation of motion of one axis as `v̇ = Σ c x`.
///
/// For a vehicle the coefficients of `signed` are not negative: those of `τ`, `−v|v|`, `−v`, of forces of unknown
/// strength, and of products of other velocities, `u̇ = v r − w q` times ratios of masses [Fossen2021, § 3.3, 6.3].
/// The others may have any sign.
struct Terms {
    signed: Vec<Vec<f64>>,
    free: Vec<Vec<f64>>,
}

fn product(a: &[f64], b: &[f64], sign: f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| sign * a * b).collect()
}

/// Returns the products of velocities for a rigid body in water on an axis: sign and the two
/// velocities.
fn turning(dof: Dof) -> [(f64, Dof, Dof); 2] {
    use Dof::{Heave, Pitch, Roll, Surge, Sway, Yaw};
    match dof {
        Surge => [(1.0, Sway, Yaw), (-1.0, Heave, Pitch)],
        Sway => [(-1.0, Surge, Yaw), (1.0, Heave, Roll)],
        Heave => [(1.0, Surge, Pitch), (-1.0, Sway, Roll)],
        // Their signs depend on the vehicle.
        Roll => [(1.0, Pitch, Yaw), (1.0, Sway, Heave)],
        Pitch => [(1.0, Roll, Yaw), (1.0, Surge, Heave)],
        Yaw => [(1.0, Surge, Sway), (1.0, Surge, Yaw)],
    }
}

impl View {
    fn delayed(&self, force: &[f64], settings: Settings) -> Vec<f64> {
        let at = |k: usize| force[k.saturating_sub(settings.delay)];
        (0..force.len()).map(at).collect()
    }

    fn terms(&self, dof: Dof, settings: Settings) -> Option<Terms> {
        let v = self.velocity[dof.index()].as_ref()?;
        let of_effects = self.effects.iter().filter_map(|effect| effect[dof.index()].as_ref());
        let of_effects: Vec<Vec<f64>> =
            of_effects.map(|force| self.delayed(force, settings)).collect();
        let force = match &self.force[dof.index()] {
            Some(force) => self.delayed(force, settings),
            // Of a velocity that was turned into sway for surge, only sway tells.
            None if of_effects.is_empty() && !(self.is_turned && dof == Dof::Sway) => return None,
            None => vec![0.0; v.len()],
        };
        let mut signed =
            vec![force, v.iter().map(|v| -v * v.abs()).collect(), v.iter().map(|v| -v).collect()];
        signed.extend(of_effects);
        let mut free = Vec::new();
        for (sign, a, b) in turning(dof) {
            let [a, b] = [a, b].map(|dof| self.velocity[dof.index()].as_ref());
            let Some((a, b)) = a.zip(b) else { continue };
            let to = if dof.is_rotation() { &mut free } else { &mut signed };
            to.push(product(a, b, sign));
        }
        let tilt = match dof {
            Dof::Roll => self.tilt[0].as_ref(),
            Dof::Pitch => self.tilt[1].as_ref(),
            _ => None,
        };
        free.extend(tilt.map(|tilt| tilt.iter().map(|angle| angle.sin()).collect()));
        Some(Terms { signed, free })
    }

    /// Returns the terms of an axis, and every force and velocity, each of any sign: an upper bound
    /// that no mistake of sign or channel changes.
    fn all_terms(&self, dof: Dof, settings: Settings) -> Option<Terms> {
        let Terms { signed, free } = self.terms(dof, settings)?;
        let others = Dof::ALL.iter().filter(|other| **other != dof);
        let others = others.filter_map(|other| self.velocity[other.index()].clone());
        let forces = self.forces.iter().map(|force| self.delayed(force, settings));
        let all = signed.into_iter().skip(1).chain(free).chain(others).chain(forces);
        Some(Terms { signed: Vec::new(), free: all.collect() })
    }
}

/// Sums over test functions of products of `[x, y]` of one trial, by fold.
struct Sums {
    gram: Vec<DMatrix<f64>>,
    sum: Vec<DVector<f64>>,
    count: Vec<f64>,
}

impl Sums {
    fn new(columns: usize) -> Self {
        Self {
            gram: vec![DMatrix::zeros(columns, columns); FOLDS],
            sum: vec![DVector::zeros(columns); FOLDS],
            count: vec![0.0; FOLDS],
        }
    }

    /// Returns the sums of deviations from the trial's mean, by fold: each trial has its own bias.
    fn centred(self) -> Option<Vec<DMatrix<f64>>> {
        let count: f64 = self.count.iter().sum();
        if count == 0.0 {
            return None;
        }
        let sum = self.sum.iter().fold(DVector::zeros(self.sum[0].len()), |all, own| all + own);
        let mean = sum / count;
        let centre = |((gram, sum), n): ((DMatrix<f64>, DVector<f64>), f64)| {
            let cross = &sum * mean.transpose();
            gram - &cross - cross.transpose() + n * &mean * mean.transpose()
        };
        Some(self.gram.into_iter().zip(self.sum).zip(self.count).map(centre).collect())
    }
}

/// Sums one trial over test functions `φ = sin⁴`: `∫φ x dt` of the terms, and `∫φ v̇ dt = −∫φ̇ v
/// dt`.
fn sums(
    view: &View,
    dof: Dof,
    terms: &Terms,
    settings: Settings,
) -> Option<(Vec<DMatrix<f64>>, usize)> {
    let v = view.velocity[dof.index()].as_ref()?;
    let columns: Vec<&Vec<f64>> = terms.signed.iter().chain(&terms.free).collect();
    let p = columns.len();
    let (length, width) = (settings.length, settings.length as f64);
    let test = |k: usize| {
        let (sin, cos) = (std::f64::consts::PI * k as f64 / width).sin_cos();
        let slope = 4.0 * sin.powi(3) * cos * std::f64::consts::PI / (width * view.period_s);
        (sin.powi(4), slope)
    };
    let test: Vec<(f64, f64)> = (0..=length).map(test).collect();
    let is_whole = |first: &usize| view.is_whole[*first..=first + length].iter().all(|x| *x);
    let starts = (0..v.len().saturating_sub(length)).step_by((length / OVERLAP).max(1));
    let starts: Vec<usize> = starts.filter(is_whole).collect();
    let mut sums = Sums::new(p + 1);
    let mut row = DVector::zeros(p + 1);
    for (k, &first) in starts.iter().enumerate() {
        for (x, column) in row.iter_mut().zip(&columns) {
            let values = &column[first..=first + length];
            *x = values.iter().zip(&test).map(|(x, (phi, _))| phi * x).sum();
        }
        let values = &v[first..=first + length];
        row[p] = -values.iter().zip(&test).map(|(v, (_, slope))| slope * v).sum::<f64>();
        let fold = k * PIECES / starts.len() % FOLDS;
        sums.gram[fold].ger(1.0, &row, &row, 1.0);
        sums.sum[fold] += &row;
        sums.count[fold] += 1.0;
    }
    Some((sums.centred()?, starts.len()))
}

/// Iterations of coordinate descent, after which the residual of a dozen terms is constant.
const SWEEPS: usize = 400;

/// Solves least squares with the first `signed` coefficients not negative, by coordinate descent on
/// the normal equations; the last row and column are those of y.
fn solve(gram: &DMatrix<f64>, signed: usize) -> DVector<f64> {
    let p = gram.nrows() - 1;
    let mut x: DVector<f64> = DVector::zeros(p);
    for _ in 0..SWEEPS {
        let mut moved = 0.0_f64;
        for j in 0..p {
            let own = gram[(j, j)];
            if own <= 0.0 {
                continue;
            }
            let others: f64 = (0..p).filter(|k| *k != j).map(|k| gram[(j, k)] * x[k]).sum();
            let best = (gram[(j, p)] - others) / own;
            let best = if j < signed { best.max(0.0) } else { best };
            moved = moved.max((best - x[j]).abs() * own.sqrt());
            x[j] = best;
        }
        if moved < 1e-6 * gram[(p, p)].max(0.0).sqrt() {
            break;
        }
    }
    x
}

/// Returns `Σ (y − c x)²`.
fn misfit(gram: &DMatrix<f64>, c: &DVector<f64>) -> f64 {
    let p = c.len();
    let (xx, xy) = (gram.view((0, 0), (p, p)), gram.view((0, p), (p, 1)));
    let fitted = (c.transpose() * xx * c)[(0, 0)];
    gram[(p, p)] - 2.0 * c.dot(&xy.column(0)) + fitted
}

fn fit(
    views: &[&View],
    dof: Dof,
    settings: Settings,
    terms: impl Fn(&View) -> Option<Terms>,
) -> Option<Explained> {
    let mut folds: Option<(Vec<DMatrix<f64>>, usize)> = None;
    let mut windows = 0;
    for view in views {
        let Some(terms) = terms(view) else { continue };
        let Some((own, count)) = sums(view, dof, &terms, settings) else { continue };
        windows += count;
        let (all, signed) = folds.get_or_insert_with(|| {
            (own.iter().map(|x| DMatrix::zeros(x.nrows(), x.ncols())).collect(), terms.signed.len())
        });
        if all[0].nrows() != own[0].nrows() || *signed != terms.signed.len() {
            return None;
        }
        all.iter_mut().zip(own).for_each(|(all, own)| *all += own);
    }
    let (folds, signed) = folds?;
    let total = folds.iter().fold(DMatrix::zeros(folds[0].nrows(), folds[0].ncols()), |a, b| a + b);
    let p = total.nrows() - 1;
    let variation = total[(p, p)];
    if windows < LEAST_WINDOWS * OVERLAP * p.max(FOLDS) || variation <= 0.0 {
        return None;
    }
    let missed: f64 = folds.iter().map(|own| misfit(own, &solve(&(&total - own), signed))).sum();
    let unexplained = (missed / variation).clamp(LEAST_UNEXPLAINED, 1.0);
    let alpha = if signed > 0 { solve(&total, signed)[0] } else { 0.0 };
    let variation = variation / windows as f64;
    Some(Explained { unexplained, variation, alpha, windows: windows / OVERLAP })
}

/// Returns the settings for an axis, and what they leave unexplained for any signs and channels.
pub(super) fn choose_settings(views: &[&View], dof: Dof) -> Option<(Settings, Explained)> {
    let period_s = views.first()?.period_s;
    let settings = LENGTHS_S.iter().flat_map(|length_s| {
        let length = (length_s / period_s).round() as usize;
        DELAYS.map(|delay| Settings { length, delay })
    });
    let fit_with = |settings: Settings| {
        Some((settings, fit(views, dof, settings, |view| view.all_terms(dof, settings))?))
    };
    let all: Vec<(Settings, Explained)> = settings.filter_map(fit_with).collect();
    let least = all.iter().map(|(_, fit)| fit.unexplained).min_by(f64::total_cmp)?;
    let as_good = all.into_iter().filter(|(_, fit)| fit.unexplained <= NEARLY_BEST * least);
    as_good.min_by(|(_, a), (_, b)| {
        b.windows.cmp(&a.windows).then(a.unexplained.total_cmp(&b.unexplained))
    })
}

/// Returns the regression of an axis on the equation of motion with possible coefficients.
pub(super) fn explained(views: &[&View], dof: Dof, settings: Settings) -> Option<Explained> {
    fit(views, dof, settings, |view| view.terms(dof, settings))
}
