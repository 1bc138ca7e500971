//! Whether two instruments tell of the same motion.

use nalgebra::{Matrix4, Vector4};

use super::AxisRecord;
use crate::navigation::Motion;
use crate::signal::sample_noise;
use crate::{Caveat, CaveatCode, Dof, Gap, Timed};

/// How far position moves for each metre that velocity says: 1 if both are right.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scale {
    value: f64,
    std: f64,
    /// What noise of velocity may take from the value.
    attenuation: f64,
}

/// Displacements are compared over spans of this length, s: long beside a sample of depth,
/// short beside the drift of an integrated velocity.
const SPAN_S: f64 = 10.0;

/// A position that is logged so rarely says nothing of a scale, s.
const LONGEST_SPAN_S: f64 = 60.0;

/// Spans that tell a scale.
const LEAST_SPANS: usize = 6;

/// Position and velocity whose scales differ by more are not of one motion, or one of them
/// has the wrong unit or sign.
const WRONG_SCALE: f64 = 0.1;

/// Scales that differ by less do no harm: instruments are sold with half of it.
const HARMLESS_SCALE: f64 = 0.015;

/// Standard errors by which scales must differ: by chance in one of a thousand trials.
const SIGMAS: f64 = 3.5;

/// One instrument may be late beside the other by about so much, s …
const LATE_S: f64 = 0.3;
/// … and average over about a second, which changes a displacement by 1/24 s² of acceleration.
const AVERAGED_S2: f64 = 0.05;

/// Velocity and acceleration for these are differences of the way over so long, s.
const DIFFERENCE_S: f64 = 1.0;

impl AxisRecord {
    /// Position, where it was measured beside velocity and both tell of the same motion.
    pub(crate) fn believable_position(&self) -> Option<Timed> {
        let is_right = |scale: Scale| (scale.value - 1.0).abs() < WRONG_SCALE;
        let known = self.position_scale([0.0; 2]).filter(|scale| scale.std < WRONG_SCALE);
        known.filter(|scale| is_right(*scale)).and(self.position.clone())
    }

    /// The doubt that two instruments raise which contradict each other.
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

    /// What may be wrong where two instruments differ by some per cent.
    fn suspects(&self) -> &'static str {
        match self.dof {
            Dof::Heave => {
                "the scale or the speed of sound of the DVL, the density for depth, or tilt, if roll and pitch are not logged"
            }
            Dof::Roll | Dof::Pitch | Dof::Yaw => "the scale of the gyro, or the compass",
            Dof::Surge | Dof::Sway => "the scale of either",
        }
    }

    /// Least squares of `Δp = s ∫v dt + o Δt − δ Δv + κ Δv̇` over spans, where position may be late
    /// by δ and smoothed by κ beside velocity, each known to be zero but for a deviation; `None`
    /// unless both were measured and the vehicle moved.
    ///
    /// The standard error allows for residuals that remember one span.
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
        // The priors weigh as much as the noise allows, which the first fit tells.
        let first = Line::fit(&rows, deviations, 1e-12)?;
        let fit = Line::fit(&rows, deviations, first.variance)?;
        let noise = rows.len() as f64 * way_noise(velocity).powi(2);
        let (value, std) = (fit.theta[0], fit.std(&rows));
        let attenuation = noise * fit.inverse[(0, 0)];
        (std.is_finite() && value.is_finite()).then_some(Scale { value, std, attenuation })
    }
}

/// One span: what explains how far position moved, and how far it did.
struct Row {
    x: Vector4<f64>,
    moved: f64,
}

/// A regression over spans.
struct Line {
    theta: Vector4<f64>,
    inverse: Matrix4<f64>,
    /// The variance of what it leaves.
    variance: f64,
    /// Prior precisions, times that variance.
    prior: Vector4<f64>,
}

impl Line {
    /// `(XᵀX + σ² P) θ = Xᵀ y`; a deviation of zero holds its number at zero.
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

    /// The standard error of the scale: the larger of white residuals', and of those that
    /// remember one span.
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

/// The noise of the way over a span.
fn way_noise(velocity: &Timed) -> f64 {
    let noise = sample_noise([velocity]).unwrap_or(0.0);
    noise * (velocity.period_s() * SPAN_S).sqrt()
}

/// What each span says.
fn displacements(velocity: &Timed, position: &Timed, cuts: &[Gap]) -> Vec<Row> {
    let (t, v) = (velocity.time_s(), velocity.values());
    let mut way = vec![0.0; t.len()];
    for k in 1..t.len() {
        way[k] = way[k - 1] + 0.5 * (v[k] + v[k - 1]) * (t[k] - t[k - 1]);
    }
    let Ok(way) = velocity.with_values("way", way) else { return Vec::new() };
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
        let [before, now, after] = [t - h, t, t + h].map(|t| way.at(t));
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

    /// Two motions at once, by 10 Hz velocity and by 0.6 Hz position; position moves `scale`
    /// times as far, is `late_s` behind, and both have noise.
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
    fn three_per_cent_of_scale_show_and_noise_or_lateness_do_not() {
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
    fn an_offset_of_velocity_is_forgiven_and_a_wrong_unit_is_not() {
        assert!(record(1.0).believable_position().is_some());
        assert!(record(1.0).contradiction().is_none());
        for wrong in [0.3048, -1.0, 57.3] {
            assert!(record(wrong).believable_position().is_none(), "{wrong}");
            let caveat = record(wrong).contradiction().expect("they contradict");
            assert!(caveat.message.contains(&format!("{wrong:.2} ±")), "{}", caveat.message);
        }
    }
}
