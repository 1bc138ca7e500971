//! Consistency of a measured rate of turn with heading.

use super::Recording;
use super::turns::{Turns, integral};
use crate::quantity::{Attitude, Axis};
use crate::signal::{rms, sample_noise};
use crate::{Caveat, CaveatCode, Dof, Quantity, Timed};

/// A fault of a rate or an angle.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// The rate is constant, though the angle is not.
    RateIsDead,
    /// The angle is constant, though the rate is not.
    AngleIsDead,
    /// The angle is this multiple of the integral of the rate.
    RateContradicts { scale: f64 },
    /// The angle moves in other ways than the rate says: one that was fused breaks the kinematics.
    AngleContradicts,
}

/// Removes impossible rates, and a stuck heading, with a caveat for each.
pub(super) fn remove_dead(trial: &str, recording: &mut Recording) -> Vec<Caveat> {
    let mut caveats = Vec::new();
    for (rate, angle) in PAIRS {
        let Some(fault) = fault(recording, &rate, &angle) else { continue };
        let (wrong, why) = match fault {
            Fault::RateIsDead => (&rate, format!("{rate} never changes, though {angle} does")),
            Fault::AngleIsDead => (&angle, format!("{angle} never changes, though {rate} does")),
            Fault::RateContradicts { scale } => {
                (&rate, format!("{angle} moves {scale:.2} times as far as {rate} says"))
            }
            Fault::AngleContradicts => {
                (&angle, format!("{angle} does not move as {rate} says, at any scale"))
            }
        };
        let other = if *wrong == rate { &angle } else { &rate };
        let message = format!(
            "trial `{trial}`: {why}; {wrong} is left out and {other} used alone: check the channel, its unit and its sign"
        );
        caveats.push(Caveat::warning(CaveatCode::InstrumentsDisagree, message));
        recording.remove(wrong);
    }
    caveats
}

/// Rates and their integrals for a nearly level vehicle.
const PAIRS: [(Quantity, Quantity); 4] = [
    (Quantity::Rate(Axis::X), Quantity::Attitude(Attitude::Roll)),
    (Quantity::Rate(Axis::Y), Quantity::Attitude(Attitude::Pitch)),
    (Quantity::Rate(Axis::Z), Quantity::Attitude(Attitude::Heading)),
    (Quantity::Velocity(Dof::Yaw), Quantity::Attitude(Attitude::Heading)),
];

/// Fewer samples do not show that a channel is dead.
const LEAST_SAMPLES: usize = 20;

/// Length of the spans over which turning is compared, s, and least number of them.
const SPAN_S: f64 = 5.0;
const LEAST_SPANS: usize = 6;

/// Least turning that allows a comparison, rad: a degree.
const LEAST_TURN: f64 = 0.02;

/// Least turning, in standard deviations of noise.
const CLEAR: f64 = 5.0;

/// Largest error of scale, and least explained fraction of the angle's variance, of a rate and an
/// angle of one motion; tilt and noise of a working gyro stay far below.
const WRONG_SCALE: f64 = 0.5;
const LEAST_EXPLAINED: f64 = 0.5;

fn fault(recording: &Recording, rate: &Quantity, angle: &Quantity) -> Option<Fault> {
    let known = |what| recording.get(what).filter(|series| series.len() >= LEAST_SAMPLES);
    let (series, angle) = (known(rate)?, known(angle)?);
    let spans = Spans::new(series, &Turns::count(angle, None));
    let [of_rate, of_angle] = [is_constant(series), is_constant(angle)];
    match (of_rate, of_angle) {
        (true, true) => None,
        (true, false) => spans.angle_moves().then_some(Fault::RateIsDead),
        (false, true) => spans.rate_moves().then_some(Fault::AngleIsDead),
        // Roll and pitch rates mix with the others once the vehicle tilts.
        (false, false) if !matches!(rate, Quantity::Rate(Axis::X | Axis::Y)) => {
            let found = spans.contradiction()?;
            Some(match found {
                // Positions, and velocities over ground, need the heading.
                Fault::AngleContradicts if needs_heading(recording) => {
                    Fault::RateContradicts { scale: spans.scale() }
                }
                found => found,
            })
        }
        (false, false) => None,
    }
}

/// Whether a recording has motion in world axes, which is nothing without heading.
fn needs_heading(recording: &Recording) -> bool {
    let is_of_world = |quantity: &Quantity| {
        matches!(quantity, Quantity::Position(_) | Quantity::WorldVelocity(_))
    };
    recording.keys().any(is_of_world)
}

fn is_constant(series: &Timed) -> bool {
    series.values().iter().all(|x| *x == series.values()[0])
}

/// Changes of an angle and of the integral of its rate over spans, relative to their means.
struct Spans {
    rate: Vec<f64>,
    angle: Vec<f64>,
    rate_noise: f64,
    angle_noise: f64,
}

impl Spans {
    fn new(rate: &Timed, turns: &Turns) -> Self {
        let (t, x) = (turns.heading.time_s(), turns.heading.values());
        let (mut by_rate, mut by_angle) = (Vec::new(), Vec::new());
        let mut from = 0;
        for k in 0..t.len() {
            let next = turns.cuts.partition_point(|cut| cut.to_s <= t[from]);
            let is_cut = turns.cuts.get(next).is_some_and(|cut| cut.to_s <= t[k]);
            let is_long = t[k] - t[from] > 2.0 * SPAN_S;
            if is_cut || is_long || t[from] < rate.first_s() || t[k] > rate.last_s() {
                from = k;
            } else if t[k] - t[from] >= SPAN_S {
                let span_s = t[k] - t[from];
                by_rate.push(integral(rate, t[from], t[k]) / span_s);
                by_angle.push((x[k] - x[from]) / span_s);
                from = k;
            }
        }
        // Rates over spans, times the median length of a span.
        let about_mean = |rates: Vec<f64>| {
            let mean = rates.iter().sum::<f64>() / rates.len() as f64;
            rates.into_iter().map(|x| SPAN_S * (x - mean)).collect()
        };
        let noise = |series: &Timed| sample_noise([series]).unwrap_or(0.0);
        Self {
            rate: about_mean(by_rate),
            angle: about_mean(by_angle),
            rate_noise: noise(rate) * (rate.period_s() * SPAN_S).sqrt(),
            angle_noise: noise(&turns.heading) * 2_f64.sqrt(),
        }
    }

    fn is_clear(&self, moved: &[f64], noise: f64) -> bool {
        moved.len() >= LEAST_SPANS && rms(moved) > LEAST_TURN.max(CLEAR * noise)
    }

    fn angle_moves(&self) -> bool {
        self.is_clear(&self.angle, self.angle_noise)
    }

    fn rate_moves(&self) -> bool {
        self.is_clear(&self.rate, self.rate_noise)
    }

    /// Returns the scale of `Δangle = s ∫rate dt`, and the part of the angle's motion that it explains.
    fn regressed(&self) -> (f64, f64) {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let of_rate = dot(&self.rate, &self.rate).max(f64::MIN_POSITIVE);
        let both = dot(&self.rate, &self.angle);
        (both / of_rate, both * both / of_rate / dot(&self.angle, &self.angle))
    }

    fn scale(&self) -> f64 {
        self.regressed().0
    }

    /// Which of the two is wrong, if they are not of one motion: a rate in another unit or of another sign
    /// follows the angle; where it does not follow, the gyroscope measures, and an attitude is computed.
    fn contradiction(&self) -> Option<Fault> {
        if !self.is_clear(&self.angle, self.angle_noise.hypot(self.rate_noise)) {
            return None;
        }
        let (scale, explained) = self.regressed();
        if explained < LEAST_EXPLAINED {
            // A rate that is still, but for its noise, measures nothing.
            let rate_moves = self.is_clear(&self.rate, self.rate_noise);
            return Some(match rate_moves {
                true => Fault::AngleContradicts,
                false => Fault::RateContradicts { scale },
            });
        }
        ((scale - 1.0).abs() > WRONG_SCALE).then_some(Fault::RateContradicts { scale })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(of: impl Fn(f64) -> f64) -> Timed {
        let time_s: Vec<f64> = (0..3000).map(|k| 0.1 * f64::from(k)).collect();
        let values = time_s.iter().map(|t| of(*t)).collect::<Vec<_>>();
        Timed::new("test", time_s, values).expect("valid")
    }

    const RATE: Quantity = Quantity::Rate(Axis::Z);
    const HEADING: Quantity = Quantity::Attitude(Attitude::Heading);

    fn heading(t: f64) -> f64 {
        (3.0 + 2.0 * (0.2 * t).sin()).rem_euclid(std::f64::consts::TAU)
    }

    fn left(rate: impl Fn(f64) -> f64, heading: impl Fn(f64) -> f64) -> (Vec<Quantity>, String) {
        let mut recording = Recording::from([(RATE, series(rate)), (HEADING, series(heading))]);
        let caveats = remove_dead("a", &mut recording);
        let message = caveats.first().map(|caveat| caveat.message.clone());
        (recording.into_keys().collect(), message.unwrap_or_default())
    }

    #[test]
    fn a_working_gyro_keeps_its_noise_and_bias() {
        let noise = |t: f64| 0.05 * (7919.0 * t).sin();
        let (left, message) = left(|t| 0.4 * (0.2 * t).cos() + 0.02 + noise(t), heading);
        assert_eq!((left.len(), message.as_str()), (2, ""));
    }

    #[test]
    fn a_rate_that_is_dead_reversed_or_in_degrees_is_replaced_by_heading() {
        for (scale, said) in [(0.0, "never changes"), (-1.0, "-1.00 times"), (57.3, "0.02 times")] {
            let (left, message) = left(|t| scale * 0.4 * (0.2 * t).cos(), heading);
            assert_eq!(left, [HEADING], "{scale}");
            assert!(message.contains(said), "{message}");
        }
    }

    #[test]
    fn a_heading_that_breaks_the_kinematics_gives_way_to_the_gyro() {
        let (left, message) = left(|t| 0.3 * (0.37 * t).cos(), heading);
        assert_eq!(left, [RATE], "{message}");
        assert!(message.contains("at any scale"), "{message}");
    }

    #[test]
    fn a_heading_that_positions_need_stays() {
        let mut recording = Recording::from([
            (RATE, series(|t| 0.3 * (0.37 * t).cos())),
            (HEADING, series(heading)),
            (Quantity::Position(crate::quantity::World::North), series(f64::sin)),
        ]);
        let caveats = remove_dead("test", &mut recording);
        assert!(!caveats.is_empty() && recording.contains_key(&HEADING));
    }

    #[test]
    fn a_stuck_compass_is_replaced_by_the_gyro_and_a_vehicle_at_rest_keeps_both() {
        assert_eq!(left(|t| 0.4 * (0.2 * t).cos(), |_| 1.0).0, [RATE]);
        assert_eq!(left(|_| 0.0, |_| 1.0).0.len(), 2);
        assert_eq!(
            left(|t| 0.001 * (7919.0 * t).sin(), |t| 1.0 + 0.002 * (13.0 * t).sin()).0.len(),
            2
        );
    }
}
