//! Consistency of two instruments that measure the same motion.

use nalgebra::{DMatrix, DVector, Matrix2, Matrix4, Vector2, Vector4};

use super::AxisRecord;
use crate::navigation::Motion;
use crate::signal::sample_noise;
use crate::statistics::robust_covariance;
use crate::{Caveat, CaveatCode, Dof, Gap, Timed};

/// Ratio of displacement by position to that by velocity: 1 if both are correct.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scale {
    value: f64,
    std: f64,
    /// Possible bias of the value by noise of velocity.
    attenuation: f64,
}

/// Interval over which displacements are compared, s: long in comparison to a sample of depth,
/// short in comparison to the drift of an integrated velocity.
const SPAN_S: f64 = 10.0;

/// Longest interval between positions for a comparison, s.
const LONGEST_SPAN_S: f64 = 60.0;

/// Least number of intervals for an estimate of the scale.
const LEAST_SPANS: usize = 6;

/// Difference of scales above which position and velocity are inconsistent, or one of them has the
/// wrong unit or sign.
const WRONG_SCALE: f64 = 0.1;

/// Negligible difference of scales: half of it is a usual tolerance of instruments.
const HARMLESS_SCALE: f64 = 0.015;

/// Significance of a difference, in standard errors: one of a thousand trials exceeds it by chance.
const SIGMAS: f64 = 3.5;

/// Prior standard deviation of the delay between the instruments, s …
const LATE_S: f64 = 0.3;
/// … and of the difference of averaging: a window of a second changes a displacement by 1/24 s² of
/// acceleration.
const AVERAGED_S2: f64 = 0.05;

/// Step of the differences of displacement for velocity and acceleration, s.
const DIFFERENCE_S: f64 = 1.0;

impl AxisRecord {
    /// Returns position, if it was measured in addition to velocity and agrees with it.
    pub(crate) fn believable_position(&self) -> Option<Timed> {
        let is_right = |scale: Scale| (scale.value - 1.0).abs() < WRONG_SCALE;
        let known = self.position_scale([0.0; 2]).filter(|scale| scale.std < WRONG_SCALE);
        known.filter(|scale| is_right(*scale)).and(self.position.clone())
    }

    /// Standard errors by which [`Self::scale_by_position`] differs from 1 at least.
    pub(crate) const SCALE_SHOWS: f64 = SIGMAS;

    /// Returns how many times as far as measured velocity says the position of some trials moves,
    /// with its standard deviation; `None` if it may be 1, or if position is not believable.
    ///
    /// Least squares of `p = s ∫v dt + δ v + c₀ + c₁ t + c₂ t² + c₃ t³` over each stretch without gaps, with s and
    /// δ common to all: the polynomial stands for the drift of what is integrated. The standard deviation
    /// allows for residuals that are correlated over 30 s.
    pub(crate) fn scale_by_position(axes: &[Self]) -> Option<(f64, f64)> {
        let mut all = Vec::new();
        for axis in axes {
            let (Motion::Velocity(velocity), Some(position)) =
                (&axis.motion, axis.believable_position())
            else {
                return None;
            };
            all.extend(levels(velocity, &position, &axis.cuts));
        }
        let rows = || all.iter().flatten();
        let n = rows().count() as f64;
        let normal: Matrix2<f64> = rows().map(|row| row.x * row.x.transpose()).sum();
        let right: Vector2<f64> = rows().map(|row| row.x * row.moved).sum();
        let theta = normal.cholesky()?.solve(&right);
        let error = |row: &Level| row.moved - theta.dot(&row.x);
        let variance = rows().map(|row| error(row).powi(2)).sum::<f64>() / (n - 2.0).max(1.0);
        let score = |block: &[&Level]| {
            let sum: Vector2<f64> = block.iter().map(|row| row.x * error(row)).sum();
            DVector::from_column_slice((sum / variance).as_slice())
        };
        let blocks = |stretch: &Vec<Level>| -> Vec<DVector<f64>> {
            let rows: Vec<&Level> = stretch.iter().collect();
            rows.chunk_by(|a, b| a.block == b.block).map(score).collect()
        };
        let scores: Vec<DVector<f64>> = all.iter().flat_map(blocks).collect();
        let normal = DMatrix::from_column_slice(2, 2, (normal / variance).as_slice());
        let covariance = robust_covariance(&normal, &scores)?;
        let (value, std) = (theta[0], covariance[(0, 0)].sqrt());
        ((value - 1.0).abs() > SIGMAS * std).then_some((value, std))
    }

    /// Returns the record with measured velocity that many times as great.
    pub(crate) fn with_velocity_scaled(&self, scale: f64) -> Self {
        let motion = match &self.motion {
            Motion::Velocity(velocity) => Motion::Velocity(velocity.map(|v| scale * v)),
            other => other.clone(),
        };
        Self { motion, ..self.clone() }
    }

    /// Returns a caveat if two instruments contradict each other.
    pub(crate) fn contradiction(&self) -> Option<Caveat> {
        let plain = self.position_scale([0.0; 2])?;
        let off = |scale: Scale| (scale.value - 1.0).abs();
        let says = |scale: Scale, digits: usize| {
            format!(
                "trial `{}`: the measured {} position moves {:.digits$} ± {:.digits$} times as far as the measured velocity says",
                self.trial, self.dof, scale.value, scale.std
            )
        };
        let warning = |message| Some(Caveat::warning(CaveatCode::InstrumentsDisagree, message));
        if plain.std < WRONG_SCALE && off(plain) > WRONG_SCALE.max(3.0 * plain.std) {
            let message = format!(
                "{}; check unit, sign and mounting of both instruments: only the velocity is fitted",
                says(plain, 2)
            );
            return warning(message);
        }
        let fine = self.position_scale([LATE_S, AVERAGED_S2])?;
        let limit = HARMLESS_SCALE.max(SIGMAS * fine.std) + fine.attenuation;
        if off(fine) <= limit {
            return None;
        }
        warning(format!(
            "{}; the log does not show which of the two is wrong ({}), and mass and drag are off by as much as velocity is, or twice that: calibrate both",
            says(fine, 3),
            self.suspects()
        ))
    }

    /// Returns the likely causes of a difference of some per cent.
    fn suspects(&self) -> &'static str {
        match self.dof {
            Dof::Heave => {
                "the scale or the speed of sound of the DVL, the density for depth, or tilt, if roll and pitch are not logged"
            }
            Dof::Roll | Dof::Pitch | Dof::Yaw => "the scale of the gyro, or the compass",
            Dof::Surge | Dof::Sway => "the scale of either",
        }
    }

    /// Estimates the scale by least squares of `Δp = s ∫v dt + o Δt − δ Δv + κ Δv̇` over intervals,
    /// δ being a delay of position and κ a difference of averaging, each with a prior about zero;
    /// `None` unless both were measured and the vehicle moved.
    ///
    /// The standard error allows for residuals correlated over one interval.
    ///
    /// # Source
    /// [Newey1987].
    fn position_scale(&self, deviations: [f64; 2]) -> Option<Scale> {
        let (Motion::Velocity(velocity), Some(position)) = (&self.motion, &self.position) else {
            return None;
        };
        let rows = displacements(velocity, position, &self.cuts);
        if rows.len() < LEAST_SPANS {
            return None;
        }
        // The first fit estimates the noise, which scales the priors.
        let first = Line::fit(&rows, deviations, 1e-12)?;
        let fit = Line::fit(&rows, deviations, first.variance)?;
        let noise = rows.len() as f64 * displacement_noise(velocity).powi(2);
        let (value, std) = (fit.theta[0], fit.std(&rows));
        let attenuation = noise * fit.inverse[(0, 0)];
        (std.is_finite() && value.is_finite()).then_some(Scale { value, std, attenuation })
    }
}

/// A position, with the regressors of [`AxisRecord::scale_by_position`] but the polynomial, of which all are
/// free.
struct Level {
    x: Vector2<f64>,
    moved: f64,
    /// Number of its block of residuals.
    block: usize,
}

/// Length of the blocks of residuals, s.
const BLOCK_S: f64 = 30.0;
/// Coefficients of the polynomial of each stretch.
const POLYNOMIAL: usize = 4;

/// Returns the positions of each stretch of velocity without gaps.
fn levels(velocity: &Timed, position: &Timed, cuts: &[Gap]) -> Vec<Vec<Level>> {
    let mut gaps = velocity.gaps(SPAN_S.min(5.0 * velocity.period_s()));
    gaps.extend_from_slice(cuts);
    gaps.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
    let ends = gaps.iter().map(|gap| gap.from_s).chain([f64::INFINITY]);
    let starts = std::iter::once(f64::NEG_INFINITY).chain(gaps.iter().map(|gap| gap.to_s));
    let stretch = |(from_s, to_s)| {
        let (own, seen) = (velocity.window(from_s, to_s)?, position.window(from_s, to_s)?);
        let seen = seen.window(own.first_s(), own.last_s())?;
        levels_between(&own, &seen)
    };
    starts.zip(ends).filter_map(stretch).collect()
}

fn levels_between(velocity: &Timed, position: &Timed) -> Option<Vec<Level>> {
    if position.len() <= 2 * POLYNOMIAL {
        return None;
    }
    let way = velocity.with_values("way", integral(velocity)).ok()?;
    let (t, n) = (position.time_s(), position.len());
    let at = |series: &Timed| -> Vec<f64> { t.iter().map(|t| series.at(*t)).collect() };
    let columns = [at(&way), at(velocity), position.values().to_vec()];
    let mut columns = DMatrix::from_fn(n, 3, |row, column| columns[column][row]);
    let (first, length) = (t[0], (t[n - 1] - t[0]).max(f64::MIN_POSITIVE));
    let powers = DMatrix::from_fn(n, POLYNOMIAL, |row, power| {
        (2.0 * (t[row] - first) / length - 1.0).powi(power as i32)
    });
    let q = powers.qr().q();
    columns -= &q * (q.transpose() * &columns);
    let level = |row: usize| Level {
        x: Vector2::new(columns[(row, 0)], columns[(row, 1)]),
        moved: columns[(row, 2)],
        block: ((t[row] - first) / BLOCK_S) as usize,
    };
    Some((0..n).map(level).collect())
}

/// Returns the integral of a series up to each sample, by trapezoids.
fn integral(series: &Timed) -> Vec<f64> {
    let (t, v) = (series.time_s(), series.values());
    let mut sum = vec![0.0; t.len()];
    for k in 1..t.len() {
        sum[k] = sum[k - 1] + 0.5 * (v[k] + v[k - 1]) * (t[k] - t[k - 1]);
    }
    sum
}

/// One interval: regressors and the change of position.
struct Row {
    x: Vector4<f64>,
    moved: f64,
}

/// A regression over intervals.
struct Line {
    theta: Vector4<f64>,
    inverse: Matrix4<f64>,
    /// The residual variance.
    variance: f64,
    /// Prior precisions, times that variance.
    prior: Vector4<f64>,
}

impl Line {
    /// Solves `(XᵀX + σ² P) θ = Xᵀ y`; a standard deviation of zero fixes its coefficient at zero.
    fn fit(rows: &[Row], deviations: [f64; 2], variance: f64) -> Option<Self> {
        let precision = |deviation: f64| match deviation > 0.0 {
            true => variance / deviation.powi(2),
            false => 0.0,
        };
        let prior = Vector4::new(0.0, 0.0, precision(deviations[0]), precision(deviations[1]));
        let is_free = [true, true, deviations[0] > 0.0, deviations[1] > 0.0];
        let free = Vector4::from(is_free.map(|free| if free { 1.0 } else { 0.0 }));
        let (mut normal, mut right) = (Matrix4::from_diagonal(&prior), Vector4::zeros());
        for row in rows {
            let x = row.x.component_mul(&free);
            normal += x * x.transpose();
            right += x * row.moved;
        }
        for (k, free) in is_free.into_iter().enumerate() {
            normal[(k, k)] += if free { 0.0 } else { 1.0 };
        }
        let scale = normal.diagonal().map(|x| 1.0 / x.sqrt().max(f64::MIN_POSITIVE));
        let scale = Matrix4::from_diagonal(&scale);
        let inverse = scale * (scale * normal * scale).try_inverse()? * scale;
        let theta = inverse * right;
        let square = |row: &Row| (row.moved - theta.dot(&row.x)).powi(2);
        let fitted = is_free.into_iter().filter(|free| *free).count();
        let freedom = rows.len().saturating_sub(fitted);
        let variance = rows.iter().map(square).sum::<f64>() / freedom.max(1) as f64;
        Some(Self { theta, inverse, variance, prior })
    }

    /// Returns the standard error of the scale: the larger of those for white residuals and for
    /// residuals correlated over one interval.
    fn std(&self, rows: &[Row]) -> f64 {
        let score = |row: &Row| row.x * (row.moved - self.theta.dot(&row.x));
        let scores: Vec<Vector4<f64>> = rows.iter().map(score).collect();
        let own: Matrix4<f64> = scores.iter().map(|s| s * s.transpose()).sum();
        let next: Matrix4<f64> = scores.windows(2).map(|s| s[0] * s[1].transpose()).sum();
        let prior = Matrix4::from_diagonal(&(self.prior * self.variance));
        let few = rows.len() as f64 / (rows.len() as f64 - 4.0).max(1.0);
        let meat = (own + 0.5 * (next + next.transpose())) * few + prior;
        let remembering = (self.inverse * meat * self.inverse)[(0, 0)];
        remembering.max(self.variance * self.inverse[(0, 0)]).sqrt()
    }
}

/// Returns the noise of displacement over an interval.
fn displacement_noise(velocity: &Timed) -> f64 {
    let noise = sample_noise([velocity]).unwrap_or(0.0);
    noise * (velocity.period_s() * SPAN_S).sqrt()
}

/// Returns the regression row of each interval.
fn displacements(velocity: &Timed, position: &Timed, cuts: &[Gap]) -> Vec<Row> {
    let Ok(displacement) = velocity.with_values("way", integral(velocity)) else {
        return Vec::new();
    };
    let longest_gap_s = SPAN_S.min(5.0 * velocity.period_s());
    let mut gaps = velocity.gaps(longest_gap_s);
    gaps.extend_from_slice(cuts);
    gaps.sort_by(|a, b| a.to_s.total_cmp(&b.to_s));
    let is_whole = |from_s: f64, to_s: f64| {
        let next = gaps.partition_point(|gap| gap.to_s <= from_s);
        gaps.get(next).is_none_or(|gap| gap.from_s >= to_s)
    };
    let h = DIFFERENCE_S;
    let at = |t: f64| {
        let [before, now, after] = [t - h, t, t + h].map(|t| displacement.at(t));
        (now, (after - before) / (2.0 * h), (after - 2.0 * now + before) / (h * h))
    };
    let mut rows = Vec::new();
    let mut from: Option<(f64, f64)> = None;
    let inside = velocity.first_s() + h..=velocity.last_s() - h;
    let samples = position.time_s().iter().zip(position.values());
    for (&t, &p) in samples.filter(|(t, _)| inside.contains(*t)) {
        let Some((from_s, from_p)) = from else {
            from = Some((t, p));
            continue;
        };
        if t - from_s < SPAN_S {
            continue;
        }
        if t - from_s < LONGEST_SPAN_S && is_whole(from_s - h, t + h) {
            let ((w0, v0, a0), (w1, v1, a1)) = (at(from_s), at(t));
            let x = Vector4::new(w1 - w0, t - from_s, v0 - v1, a1 - a0);
            rows.push(Row { x, moved: p - from_p });
        }
        from = Some((t, p));
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two simultaneous motions, by 10 Hz velocity and by 0.6 Hz position; position moves `scale`
    /// times as far, is delayed by `late_s`, and both have noise.
    fn noisy(scale: f64, late_s: f64, seed: i32) -> AxisRecord {
        let noise = |k: usize, size: f64| {
            size * (f64::from(seed + 1) * 7919.0 * (k as f64 + 0.3)).sin() * 2_f64.sqrt()
        };
        let time_s: Vec<f64> = (0..3000).map(|k| 0.1 * f64::from(k)).collect();
        let v = |t: f64| 0.3 * (0.11 * t).sin() + 0.2 * (0.5 * t).cos();
        let p = |t: f64| -0.3 / 0.11 * (0.11 * t).cos() + 0.2 / 0.5 * (0.5 * t).sin();
        let velocity = time_s.iter().enumerate().map(|(k, t)| v(*t) + noise(k, 0.01)).collect();
        let slow: Vec<f64> = time_s.iter().step_by(17).copied().collect();
        let position = slow.iter().enumerate();
        let position =
            position.map(|(k, t)| scale * p(t - late_s) + noise(k, 0.02)).collect::<Vec<_>>();
        let series = |t: &[f64], x: Vec<f64>| Timed::new("test", t.to_vec(), x).expect("valid");
        AxisRecord {
            dof: Dof::Heave,
            trial: "a".to_owned(),
            force: series(&time_s, vec![0.0; 3000]),
            thrusters: Vec::new(),
            motion: Motion::Velocity(series(&time_s, velocity)),
            lever_rates: None,
            turning: None,
            position: Some(series(&slow, position)),
            acceleration: None,
            cuts: Vec::new(),
        }
    }

    #[test]
    fn detects_a_scale_error_of_three_per_cent_in_noise_and_delay() {
        for seed in 0..20 {
            for late_s in [0.0, 0.4] {
                assert_eq!(noisy(1.0, late_s, seed).contradiction(), None, "{seed} {late_s}");
                for scale in [0.97, 1.03] {
                    let caveat = noisy(scale, late_s, seed).contradiction().expect("it shows");
                    assert!(
                        caveat.message.contains("the log does not show which"),
                        "{}",
                        caveat.message
                    );
                }
            }
            assert!(noisy(0.97, 0.0, seed).believable_position().is_some());
        }
    }

    fn record(scale: f64) -> AxisRecord {
        let time_s: Vec<f64> = (0..3000).map(|k| 0.1 * f64::from(k)).collect();
        let v: Vec<f64> = time_s.iter().map(|t| 0.2 * (0.1 * t).sin() + 0.01).collect();
        let velocity = Timed::new("velocity", time_s.clone(), v).expect("valid");
        let slow: Vec<f64> = time_s.iter().step_by(17).copied().collect();
        let p: Vec<f64> = slow.iter().map(|t| scale * 2.0 * (1.0 - (0.1 * t).cos())).collect();
        AxisRecord {
            dof: Dof::Heave,
            trial: "a".to_owned(),
            force: Timed::new("force", time_s, vec![0.0; 3000]).expect("valid"),
            thrusters: Vec::new(),
            motion: Motion::Velocity(velocity),
            lever_rates: None,
            turning: None,
            position: Some(Timed::new("depth", slow, p).expect("valid")),
            acceleration: None,
            cuts: Vec::new(),
        }
    }

    #[test]
    fn tolerates_an_offset_of_velocity_but_not_a_wrong_unit() {
        assert!(record(1.0).believable_position().is_some());
        assert!(record(1.0).contradiction().is_none());
        for wrong in [0.3048, -1.0, 57.3] {
            assert!(record(wrong).believable_position().is_none(), "{wrong}");
            let caveat = record(wrong).contradiction().expect("they contradict");
            assert!(caveat.message.contains(&format!("{wrong:.2} ±")), "{}", caveat.message);
        }
    }
}
