//! Whether two instruments tell of the same motion.

use nalgebra::{Matrix2, Vector2};

use super::AxisRecord;
use crate::navigation::Motion;
use crate::{Caveat, CaveatCode, Timed};

/// How far position moves for each metre that velocity says: 1 if both are right.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scale {
    value: f64,
    std: f64,
}

/// Displacements are compared over spans of this length, s: long beside a sample of depth,
/// short beside the drift of an integrated velocity.
const SPAN_S: f64 = 10.0;

/// Spans that tell a scale.
const LEAST_SPANS: usize = 6;

/// Position and velocity whose scales differ by more are not of one motion, or one of them
/// has the wrong unit or sign.
const WRONG_SCALE: f64 = 0.1;

impl AxisRecord {
    /// Position, where it was measured beside velocity and both tell of the same motion.
    pub(crate) fn believable_position(&self) -> Option<Timed> {
        let is_right = |scale: Scale| (scale.value - 1.0).abs() < WRONG_SCALE;
        self.position_scale().filter(|scale| is_right(*scale)).and(self.position.clone())
    }

    /// The doubt that two instruments raise which contradict each other.
    pub(crate) fn contradiction(&self) -> Option<Caveat> {
        let scale = self.position_scale()?;
        let off = (scale.value - 1.0).abs();
        (off > WRONG_SCALE && off > 3.0 * scale.std).then(|| {
            let message = format!(
                "trial `{}`: the measured {} position moves {:.2} ± {:.2} times as far as the measured velocity says; check unit, sign and mounting of both instruments, for only the velocity is fitted",
                self.trial, self.dof, scale.value, scale.std
            );
            Caveat::warning(CaveatCode::InstrumentsDisagree, message)
        })
    }

    /// Least squares of `Δp = s ∫v dt + o Δt` over spans; `None` unless both were measured
    /// and the vehicle moved.
    fn position_scale(&self) -> Option<Scale> {
        let (Motion::Velocity(velocity), Some(position)) = (&self.motion, &self.position) else {
            return None;
        };
        let rows = displacements(velocity, position);
        let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for (way, span_s, moved) in &rows {
            let row = Vector2::new(*way, *span_s);
            normal += row * row.transpose();
            right += row * *moved;
        }
        let inverse = normal.try_inverse().filter(|_| rows.len() >= LEAST_SPANS)?;
        let found = inverse * right;
        let square = |(way, span_s, moved): &(f64, f64, f64)| {
            (moved - found[0] * way - found[1] * span_s).powi(2)
        };
        let variance = rows.iter().map(square).sum::<f64>() / (rows.len() - 2) as f64;
        let std = (variance * inverse[(0, 0)]).sqrt();
        // A vehicle that hardly moves tells nothing.
        (std < WRONG_SCALE).then_some(Scale { value: found[0], std })
    }
}

/// For each span: the way that velocity says, its length in s, and how far position moved.
fn displacements(velocity: &Timed, position: &Timed) -> Vec<(f64, f64, f64)> {
    let (t, v) = (velocity.time_s(), velocity.values());
    let mut way = vec![0.0; t.len()];
    for k in 1..t.len() {
        way[k] = way[k - 1] + 0.5 * (v[k] + v[k - 1]) * (t[k] - t[k - 1]);
    }
    let Ok(way) = velocity.with_values("way", way) else { return Vec::new() };
    let longest_gap_s = SPAN_S.min(5.0 * velocity.period_s());
    let gaps = velocity.gaps(longest_gap_s);
    let mut rows = Vec::new();
    let mut from: Option<(f64, f64)> = None;
    let inside = position.time_s().iter().zip(position.values());
    for (&t, &p) in inside.filter(|(t, _)| (velocity.first_s()..=velocity.last_s()).contains(*t)) {
        let Some((from_s, from_p)) = from else {
            from = Some((t, p));
            continue;
        };
        if t - from_s < SPAN_S {
            continue;
        }
        let is_whole = !gaps.iter().any(|gap| gap.from_s < t && gap.to_s > from_s);
        if is_whole {
            rows.push((way.at(t) - way.at(from_s), t - from_s, p - from_p));
        }
        from = Some((t, p));
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dof;

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
