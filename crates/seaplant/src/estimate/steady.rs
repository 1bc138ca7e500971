//! Quadratic drag from runs at constant thrust and speed.

use std::ops::RangeInclusive;

use nalgebra::{Matrix2, Vector2};

use crate::caveat::spoken;

use super::{Estimate, t_quantile_975};
use crate::{
    AxisRecord, Caveat, CaveatCode, Dof, Error, Grid, Trial, UniformStretch, VelocitySource,
};

/// Criteria of steady motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteadyOptions {
    /// Length of the window, s.
    pub window_s: f64,
    /// Maximum trend of velocity in the window, m/s² or rad/s².
    pub slope: f64,
    /// Maximum standard deviation of thrust in the window, as a fraction of the trial's maximum.
    pub thrust_part: f64,
}

impl Default for SteadyOptions {
    fn default() -> Self {
        Self { window_s: 20.0, slope: 1.5e-3, thrust_part: 0.02 }
    }
}

/// Limits of the window, s: a shorter one has too few samples for a trend; a day is longer than any
/// record.
const WINDOW_S: RangeInclusive<f64> = 1.0..=86_400.0;

/// Upper limit of the trend, m/s² or rad/s².
const LARGEST_SLOPE: f64 = 1.0;

impl SteadyOptions {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`Error::Setting`] unless the window is from 1 s to a day, the slope above 0 and at most 1,
    /// and the fraction of thrust above 0 and at most 1.
    pub fn check(&self) -> Result<(), Error> {
        let Self { window_s, slope, thrust_part } = *self;
        if !WINDOW_S.contains(&window_s) {
            let expected = format!("from {} to {} s", WINDOW_S.start(), WINDOW_S.end());
            return Err(Error::setting("window_s", window_s, expected));
        }
        if !(slope > 0.0 && slope <= LARGEST_SLOPE) {
            let expected = format!("above 0 and at most {LARGEST_SLOPE} m/s² or rad/s²");
            return Err(Error::setting("slope", slope, expected));
        }
        if !(thrust_part > 0.0 && thrust_part <= 1.0) {
            let expected = "above 0 and at most 1, such as 0.02 for 2 % of the greatest thrust";
            return Err(Error::setting("thrust_part", thrust_part, expected));
        }
        Ok(())
    }
}

/// A segment at constant thrust and speed.
#[derive(Clone, Debug, PartialEq)]
pub struct SteadySegment {
    /// Trial.
    pub trial: String,
    /// Start, s.
    pub from_s: f64,
    /// End, s.
    pub to_s: f64,
    /// Mean force, N or N m.
    pub tau: f64,
    /// Mean velocity, m/s or rad/s.
    pub v: f64,
    /// Standard deviation of the mean velocity.
    pub v_std: f64,
    /// d_Q = τ / v|v|, valid without a bias force.
    pub d_quadratic: Estimate,
    /// e = mean |v_model − v| with `v_model = √(τ/d_Q)`.
    pub mean_abs_error: f64,
    /// Error of the joint fit, which includes a bias force.
    pub joint_error: Option<f64>,
}

/// Two steady segments at the same thrust in opposite directions.
#[derive(Clone, Debug, PartialEq)]
pub struct SteadyPair {
    /// Index of the segment with positive force.
    pub positive: usize,
    /// Index of the segment with negative force.
    pub negative: usize,
    /// b = τ (D₊ − D₋) / (D₊ + D₋), N or N m.
    pub bias_force: Estimate,
}

/// Drag and bias force common to all steady segments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointDrag {
    /// d_Q of `τ = d_Q v|v| + b`.
    pub d_quadratic: Estimate,
    /// b, N or N m.
    pub bias_force: Estimate,
}

/// Estimates from the steady segments of one degree of freedom.
#[derive(Clone, Debug, PartialEq)]
pub struct SteadyFit {
    /// Degree of freedom.
    pub dof: Dof,
    /// Each segment separately, as in the paper.
    pub segments: Vec<SteadySegment>,
    /// Mean of the segments' drags.
    pub mean_d_quadratic: f64,
    /// Joint estimate of all segments; `None` unless there are both directions or two thrusts.
    pub joint: Option<JointDrag>,
    /// Pairs of segments at the same thrust in opposite directions.
    pub pairs: Vec<SteadyPair>,
    /// Caveats.
    pub caveats: Vec<Caveat>,
}

/// Estimates drag from the steady segments of trials.
///
/// For each segment `d_Q = τ / v|v|`. For all together `τ = d_Q v|v| + b`, weighted by the
/// uncertainty of the segments' speeds. A pair of segments at the same thrust in opposite
/// directions gives `b/τ = (D₊ − D₋)/(D₊ + D₋)`; contradictory pairs are reported.
///
/// # Errors
/// [`Error::NoTrial`] without trials; [`Error::NotSteady`] if no trial has a steady segment. A
/// single trial without one is left out, with a caveat.
///
/// # Source
/// [Jason2, eq. (8) and table 6].
pub fn fit_steady(
    dof: Dof,
    trials: &[&Trial],
    options: &SteadyOptions,
) -> Result<SteadyFit, Error> {
    if trials.is_empty() {
        return Err(Error::NoTrial { dof });
    }
    let (mut segments, mut left_out) = all_segments(dof, trials, options)?;
    let mean_d_quadratic =
        segments.iter().map(|s| s.d_quadratic.value).sum::<f64>() / segments.len() as f64;
    let joint = joint_drag(&segments);
    if let Some(joint) = &joint {
        for segment in &mut segments {
            let model =
                terminal_speed(segment.tau - joint.bias_force.value, joint.d_quadratic.value);
            segment.joint_error = Some((model - segment.v).abs());
        }
    }
    let pairs = pairs(&segments);
    let mut caveats = caveats(dof, &segments, &pairs, joint.as_ref());
    caveats.append(&mut left_out);
    Ok(SteadyFit { dof, segments, mean_d_quadratic, joint, pairs, caveats })
}

/// Returns the steady segments of all trials, and a caveat for each trial without any.
///
/// # Errors
/// The error of the first trial without a steady segment, if no trial has one.
fn all_segments(
    dof: Dof,
    trials: &[&Trial],
    options: &SteadyOptions,
) -> Result<(Vec<SteadySegment>, Vec<Caveat>), Error> {
    let (mut segments, mut left_out) = (Vec::new(), Vec::new());
    let mut refused = None;
    for trial in trials {
        let found = trial
            .axis(dof, VelocitySource::Measured)
            .and_then(|axis| steady_segments(&axis, &trial.setup().segments_s, options));
        match found {
            Ok(found) => segments.extend(found),
            Err(error) => {
                let message =
                    format!("steady trial `{}` is left out of {dof}: {error}", trial.name());
                left_out.push(Caveat::warning(CaveatCode::TrialLeftOut, message));
                refused = refused.or(Some(error));
            }
        }
    }
    match refused.filter(|_| segments.is_empty()) {
        Some(error) => Err(error),
        None => Ok((segments, left_out)),
    }
}

/// Computes the speed at which drag balances a force: `sign(τ) √(|τ|/d)`.
pub fn terminal_speed(tau: f64, d_quadratic: f64) -> f64 {
    (tau.abs() / d_quadratic).sqrt().copysign(tau)
}

/// Returns the steady segments of one record: the given ones, or those detected.
///
/// # Errors
/// [`Error::NotSteady`] if none is detected, or none of the given ones has samples.
pub fn steady_segments(
    axis: &AxisRecord,
    given_s: &[[f64; 2]],
    options: &SteadyOptions,
) -> Result<Vec<SteadySegment>, Error> {
    let uniform = axis.uniform(0)?;
    let mut found = Vec::new();
    for stretch in &uniform.stretches {
        let spans = if given_s.is_empty() {
            find_spans(stretch, options)
        } else {
            given_s.iter().filter_map(|span| rows_of(stretch.grid, *span)).collect()
        };
        let measured = spans.into_iter().map(|rows| measure(axis, stretch, rows));
        // At rest on the bottom, thrust carries no information on drag.
        found.extend(measured.filter(|segment| segment.d_quadratic.value.is_finite()));
    }
    if found.is_empty() {
        let reason = if given_s.is_empty() {
            format!(
                "none of {} s where velocity drifts by less than {} {} and thrust keeps within {} % of its maximum",
                options.window_s,
                options.slope,
                axis.dof.units().acceleration,
                100.0 * options.thrust_part
            )
        } else {
            "the given segments lie outside of the log".to_owned()
        };
        return Err(Error::NotSteady { trial: axis.trial.clone(), reason });
    }
    Ok(found)
}

type Rows = std::ops::Range<usize>;

fn rows_of(grid: Grid, [from_s, to_s]: [f64; 2]) -> Option<Rows> {
    let row = |t: f64| ((t - grid.start_s) / grid.period_s).round().clamp(0.0, grid.len as f64);
    let (from, to) = (row(from_s) as usize, (row(to_s) as usize + 1).min(grid.len));
    (to > from + 2).then_some(from..to)
}

/// Returns the steady windows, joined where they overlap at the same thrust.
fn find_spans(stretch: &UniformStretch, options: &SteadyOptions) -> Vec<Rows> {
    let rows = (options.window_s / stretch.grid.period_s).round() as usize;
    let step = (1.0 / stretch.grid.period_s).round().max(1.0) as usize;
    let highest = stretch.tau.iter().fold(0.0_f64, |highest, tau| highest.max(tau.abs()));
    let mut spans: Vec<(Rows, f64)> = Vec::new();
    for from in (0..(stretch.v.len() + 1).saturating_sub(rows)).step_by(step) {
        let window = from..from + rows;
        let (tau, tau_std) = mean_and_std(&stretch.tau[window.clone()]);
        let slope = slope(&stretch.v[window.clone()], stretch.grid.period_s);
        let steady = slope.abs() < options.slope
            && tau_std < options.thrust_part * highest
            && tau.abs() > LEAST_THRUST_PART * highest;
        if !steady {
            continue;
        }
        match spans.last_mut() {
            Some((span, before))
                if window.start <= span.end
                    && (tau - *before).abs() < options.thrust_part * highest =>
            {
                span.end = window.end;
            }
            _ => spans.push((window, tau)),
        }
    }
    spans.into_iter().map(|(span, _)| span).collect()
}

/// Minimum thrust, as a fraction of the maximum, which excludes drifting.
const LEAST_THRUST_PART: f64 = 0.05;

fn mean_and_std(x: &[f64]) -> (f64, f64) {
    let n = x.len() as f64;
    let mean = x.iter().sum::<f64>() / n;
    let variance = x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
    (mean, variance.sqrt())
}

/// Computes the least squares slope of a uniform series.
fn slope(x: &[f64], period_s: f64) -> f64 {
    let middle = 0.5 * (x.len() as f64 - 1.0);
    let (mut top, mut bottom) = (0.0, 0.0);
    for (k, x) in x.iter().enumerate() {
        let offset = k as f64 - middle;
        top += offset * x;
        bottom += offset * offset;
    }
    top / (bottom * period_s)
}

/// Length of the parts of a segment, s, whose differences determine the uncertainty of its speed.
const PART_S: f64 = 5.0;

fn measure(axis: &AxisRecord, stretch: &UniformStretch, rows: Rows) -> SteadySegment {
    let (tau, v) = (&stretch.tau[rows.clone()], &stretch.v[rows.clone()]);
    let (mean_tau, _) = mean_and_std(tau);
    let (mean_v, _) = mean_and_std(v);
    let part = ((PART_S / stretch.grid.period_s).round() as usize).clamp(1, v.len().div_ceil(3));
    let parts: Vec<f64> = v.chunks_exact(part).map(|part| mean_and_std(part).0).collect();
    let freedom = parts.len() as f64 - 1.0;
    let v_std = mean_and_std(&parts).1 / freedom.max(1.0).sqrt();
    let drag = mean_tau / (mean_v * mean_v.abs());
    let drag_std = (2.0 * drag * v_std / mean_v).abs();
    let error = v
        .iter()
        .zip(tau)
        .map(|(v, &tau)| (terminal_speed(tau, drag.abs()).copysign(mean_v) - v).abs())
        .sum::<f64>()
        / v.len() as f64;
    SteadySegment {
        trial: axis.trial.clone(),
        from_s: stretch.grid.time(rows.start),
        to_s: stretch.grid.time(rows.end - 1),
        tau: mean_tau,
        v: mean_v,
        v_std,
        d_quadratic: Estimate::new(drag, drag_std, freedom),
        mean_abs_error: error,
        joint_error: None,
    }
}

/// Lower limit of the error of a force balance, as a fraction of the force.
const FORCE_FLOOR_PART: f64 = 0.005;

/// Solves weighted least squares of `τ = d v|v| + b`, with weights from the uncertainty of the
/// speeds.
fn joint_drag(segments: &[SteadySegment]) -> Option<JointDrag> {
    if segments.len() < 3 {
        return None;
    }
    let mut drag =
        segments.iter().map(|s| s.d_quadratic.value.abs()).sum::<f64>() / segments.len() as f64;
    let mut fit = None;
    // The weights depend on the drag; after the second round they are accurate to a few per cent.
    for _ in 0..3 {
        let found = weighted_line(segments, drag)?;
        drag = found.0[0];
        fit = Some(found);
    }
    let (theta, covariance) = fit?;
    let freedom = segments.len() as f64 - 2.0;
    let of = |j: usize| Estimate::new(theta[j], covariance[(j, j)].sqrt(), freedom);
    Some(JointDrag { d_quadratic: of(0), bias_force: of(1) })
}

fn weighted_line(segments: &[SteadySegment], drag: f64) -> Option<(Vector2<f64>, Matrix2<f64>)> {
    let (mut normal, mut rhs) = (Matrix2::zeros(), Vector2::zeros());
    let row = |s: &SteadySegment| {
        let std = (2.0 * drag * s.v * s.v_std).hypot(FORCE_FLOOR_PART * s.tau);
        // d is of order 1e3 and b/d of order 1: regress on v|v| and 1/1000.
        (Vector2::new(s.v * s.v.abs(), UNIT) / std, s.tau / std)
    };
    for (x, y) in segments.iter().map(row) {
        normal += x * x.transpose();
        rhs += x * y;
    }
    let scale = normal.trace();
    let inverse = (normal / scale).try_inverse().filter(|_| {
        // Both terms must be determined: one thrust in one direction carries no information on the
        // bias.
        let scaled = normal / scale;
        scaled.iter().all(|x| x.is_finite()) && {
            let eigen = scaled.symmetric_eigenvalues();
            eigen.min() > 1e-9 * eigen.max()
        }
    })? / scale;
    let theta = inverse * rhs;
    let chi2: f64 = segments.iter().map(row).map(|(x, y)| (y - x.dot(&theta)).powi(2)).sum();
    // A scatter greater than the uncertainty of the speeds widens the interval; a smaller one may
    // be chance and does not narrow it.
    let inflation = (chi2 / (segments.len() as f64 - 2.0)).max(1.0);
    let units = Matrix2::from_diagonal(&Vector2::new(1.0, UNIT));
    Some((units * theta, units * inverse * units * inflation))
}

/// Scale of the bias column.
const UNIT: f64 = 1e3;

/// Relative difference of thrusts that count as equal.
const SAME_THRUST: f64 = 0.05;

fn pairs(segments: &[SteadySegment]) -> Vec<SteadyPair> {
    let mut pairs = Vec::new();
    for (p, positive) in segments.iter().enumerate().filter(|(_, s)| s.tau > 0.0) {
        let partner = segments
            .iter()
            .enumerate()
            .filter(|(_, s)| s.tau < 0.0)
            .map(|(n, s)| (n, (s.tau + positive.tau).abs() / positive.tau))
            .filter(|(_, off)| *off < SAME_THRUST)
            .min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((n, _)) = partner {
            let bias_force = pair_bias(positive, &segments[n]);
            pairs.push(SteadyPair { positive: p, negative: n, bias_force });
        }
    }
    pairs
}

/// Computes b/τ = (D₊ − D₋)/(D₊ + D₋) with first-order standard deviation.
fn pair_bias(positive: &SteadySegment, negative: &SteadySegment) -> Estimate {
    let (dp, dn) = (positive.d_quadratic, negative.d_quadratic);
    let tau = 0.5 * (positive.tau - negative.tau);
    let sum = dp.value + dn.value;
    let value = tau * (dp.value - dn.value) / sum;
    let std = 2.0 * tau / (sum * sum) * (dn.value * dp.std).hypot(dp.value * dn.std);
    let spans = |s: &SteadySegment| ((s.to_s - s.from_s) / PART_S - 1.0).max(1.0);
    Estimate::new(value, std, spans(positive) + spans(negative))
}

fn caveats(
    dof: Dof,
    segments: &[SteadySegment],
    pairs: &[SteadyPair],
    joint: Option<&JointDrag>,
) -> Vec<Caveat> {
    let mut caveats = Vec::new();
    let one_sided = segments.iter().all(|s| s.tau > 0.0) || segments.iter().all(|s| s.tau < 0.0);
    if one_sided {
        let message = format!(
            "all steady {dof} runs go one way: a bias force (buoyancy, ballast) cannot be separated from drag; add a run the other way at the same thrust"
        );
        caveats.push(Caveat::warning(CaveatCode::BiasOneDirection, message));
    }
    let wrong_way = segments.iter().find(|s| s.tau * s.v <= 0.0);
    if let Some(segment) = wrong_way {
        let message = format!(
            "in steady run `{}` the vehicle moves against its thrust; check the signs of thrust and velocity (depth is positive down)",
            segment.trial
        );
        caveats.push(Caveat::severe(CaveatCode::WrongSign, message));
    }
    if let Some(message) = contradiction(segments, pairs) {
        caveats.push(Caveat::warning(CaveatCode::SteadyPairsContradict, message));
    }
    if let Some(joint) = joint
        && joint.bias_force.covers(0.0)
    {
        let message = format!(
            "the steady runs do not show a bias force: its interval, {} to {} {}, includes zero",
            spoken(joint.bias_force.low95),
            spoken(joint.bias_force.high95),
            dof.units().force
        );
        caveats.push(Caveat::note(CaveatCode::BiasOneDirection, message));
    }
    caveats
}

/// Differences of bias forces below this fraction of the greatest thrust are not a conflict: the
/// pull of a tether varies as much from run to run.
const SLIGHT_PART: f64 = 0.03;

/// Finds pairs whose bias forces differ by more than their intervals allow.
fn contradiction(segments: &[SteadySegment], pairs: &[SteadyPair]) -> Option<String> {
    let least = pairs.iter().min_by(|a, b| a.bias_force.value.total_cmp(&b.bias_force.value))?;
    let most = pairs.iter().max_by(|a, b| a.bias_force.value.total_cmp(&b.bias_force.value))?;
    let apart = most.bias_force.value - least.bias_force.value;
    let std = most.bias_force.std.hypot(least.bias_force.std);
    let limit = t_quantile_975(2.0 * pairs.len() as f64) * std;
    let thrust = |pair: &SteadyPair| segments[pair.positive].tau;
    let greatest = segments.iter().fold(0.0_f64, |greatest, s| greatest.max(s.tau.abs()));
    (apart > limit.max(SLIGHT_PART * greatest) && pairs.len() > 1).then(|| {
        format!(
            "the up/down pairs contradict each other: at {} of thrust they imply a bias force of {}, at {} for {}; no single ballast explains both, so look for thrust that differs up and down, or a change of trim between runs",
            spoken(thrust(least)),
            spoken(least.bias_force.value),
            spoken(thrust(most)),
            spoken(most.bias_force.value)
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segment(trial: &str, tau: f64, drag: f64) -> SteadySegment {
        let v = terminal_speed(tau, drag);
        SteadySegment {
            trial: trial.to_owned(),
            from_s: 0.0,
            to_s: 60.0,
            tau,
            v,
            v_std: 1e-4,
            d_quadratic: Estimate::new(drag, 5.0, 11.0),
            mean_abs_error: 0.0,
            joint_error: None,
        }
    }

    /// [Jason2, table 6]; thrust relative to the maximum.
    fn table_6() -> Vec<SteadySegment> {
        [
            ("down 30 %", 0.3, 6682.0),
            ("down 60 %", 0.6, 5276.4),
            ("down 80 %", 0.8, 6879.1),
            ("down 100 %", 1.0, 6502.1),
            ("up 30 %", -0.3, 3276.8),
            ("up 60 %", -0.6, 6025.6),
            ("up 100 %", -1.0, 4981.9),
        ]
        .map(|(trial, thrust, drag)| segment(trial, thrust, drag))
        .to_vec()
    }

    #[test]
    fn the_papers_steady_drags_have_the_papers_mean() {
        let drags = table_6();
        let mean = drags.iter().map(|s| s.d_quadratic.value).sum::<f64>() / 7.0;
        // The table is rounded to a tenth.
        assert!((mean - 5660.6).abs() < 0.05, "{mean}");
    }

    #[test]
    fn the_papers_pairs_contradict_each_other() {
        let segments = table_6();
        let pairs = pairs(&segments);
        let bias: Vec<f64> = pairs.iter().map(|pair| pair.bias_force.value).collect();
        for (found, expected) in bias.iter().zip([0.103, -0.040, 0.132]) {
            assert!((found - expected).abs() < 5e-4, "{bias:?}");
        }
        assert!(contradiction(&segments, &pairs).is_some());
    }

    #[test]
    fn opposite_directions_determine_drag_and_ballast() {
        let true_drag = 5500.0;
        let with_ballast = |tau: f64| {
            let v = terminal_speed(tau - 250.0, true_drag);
            SteadySegment { v, ..segment("run", tau, tau / (v * v.abs())) }
        };
        let segments: Vec<_> =
            [1000.0, 2000.0, 3000.0, -1000.0, -3000.0].into_iter().map(with_ballast).collect();
        let joint = joint_drag(&segments).expect("five runs");
        assert!((joint.d_quadratic.value - true_drag).abs() < 1e-6);
        assert!((joint.bias_force.value - 250.0).abs() < 1e-6);
    }

    /// Returns a heave trial under constant force with a drift of the sinking speed, m/s².
    fn run(name: &str, rate: f64) -> Trial {
        let time_s: Vec<f64> = (0..1000).map(|k| 0.1 * f64::from(k)).collect();
        let series = |of: &dyn Fn(f64) -> f64| {
            let values: Vec<f64> = time_s.iter().map(|t| of(*t)).collect();
            crate::Timed::new(name, time_s.clone(), values).expect("valid")
        };
        let recording = crate::Recording::from([
            (crate::Quantity::Wrench(Dof::Heave), series(&|_| 55.0)),
            (crate::Quantity::Velocity(Dof::Heave), series(&|t| 0.1 + rate * t)),
        ]);
        let setup = crate::TrialSetup {
            name: name.to_owned(),
            dofs: vec![Dof::Heave],
            ..Default::default()
        };
        Trial::new(setup, &recording, &crate::Vehicle::default()).expect("complete")
    }

    #[test]
    fn a_trial_without_a_plateau_is_left_out_and_named() {
        let (steady, drifting) = (run("plateau", 0.0), run("drift", 0.01));
        let options = SteadyOptions::default();
        let fit = fit_steady(Dof::Heave, &[&drifting, &steady], &options).expect("one is steady");
        assert!(fit.segments.iter().all(|segment| segment.trial == "plateau"));
        assert!((fit.mean_d_quadratic - 5500.0).abs() < 1e-6);
        let said = |c: &Caveat| c.code == CaveatCode::TrialLeftOut && c.message.contains("`drift`");
        assert!(fit.caveats.iter().any(said), "{:?}", fit.caveats);
        let refused = fit_steady(Dof::Heave, &[&drifting], &options);
        assert!(matches!(refused, Err(Error::NotSteady { .. })));
    }

    #[test]
    fn one_run_does_not_determine_the_bias() {
        assert!(joint_drag(&[segment("a", 100.0, 5000.0)]).is_none());
        let same = vec![segment("a", 100.0, 5000.0); 4];
        assert!(joint_drag(&same).is_none());
    }
}
