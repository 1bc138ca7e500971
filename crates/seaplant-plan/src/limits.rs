//! Limits of a trial.

use nalgebra::{Vector3, Vector6};
use schemars::JsonSchema;
use seaplant::motion::State;
use serde::{Deserialize, Serialize};

use crate::Error;

/// Limits of a trial; every field has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// The fraction of its greatest thrust that a thruster may give.
    pub thrust_part: f64,
    /// The greatest change of a thruster's thrust, as a fraction of its greatest thrust per second.
    pub slew_per_s: f64,
    /// The greatest speed, m/s.
    pub speed_m_s: f64,
    /// The greatest rate of turn about any axis, rad/s.
    pub rate_rad_s: f64,
    /// The greatest angle of roll and of pitch, rad.
    pub tilt_rad: f64,
    /// Depth at which manoeuvres begin, m.
    pub start_depth_m: f64,
    /// The least and the greatest depth, m.
    pub depth_m: [f64; 2],
    /// The greatest distance north or south, and east or west, of the start, m.
    pub box_m: [f64; 2],
    /// The greatest straight distance from the start, m: the usable length of a tether.
    pub tether_m: Option<f64>,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            thrust_part: 0.6,
            slew_per_s: 2.0,
            speed_m_s: 1.0,
            rate_rad_s: 0.6,
            tilt_rad: 0.35,
            start_depth_m: 5.0,
            depth_m: [1.0, 10.0],
            box_m: [10.0, 10.0],
            tether_m: None,
        }
    }
}

/// The name of a limit and the fraction of it that is used: 1 is at the limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Use {
    pub(crate) part: f64,
    pub(crate) of: &'static str,
}

/// How far a vehicle goes on once it is no longer driven; zero for where it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Stop {
    /// Stopping distance over squared speed, s²/m.
    pub(crate) distance_s2: f64,
    /// Inverse natural frequency of roll and of pitch, s: without forces, an angle φ at the rate p
    /// swings to `√(φ² + (p/ω)²)`.
    pub(crate) swing_s: [f64; 2],
}

impl Use {
    /// Returns the greater of two.
    pub(crate) fn or(self, other: Self) -> Self {
        if other.part > self.part { other } else { self }
    }
}

impl Limits {
    /// Checks that the limits leave room for motion.
    ///
    /// # Errors
    /// [`Error::Limit`] for one that is not above zero, or a depth to begin at outside of the depths.
    pub fn check(&self) -> Result<(), Error> {
        let refuse = |name, found: f64, expected: &str| {
            Err(Error::Limit { name, found: found.to_string(), expected: expected.to_owned() })
        };
        if !(self.thrust_part > 0.0 && self.thrust_part <= 1.0) {
            return refuse("thrust_part", self.thrust_part, "above 0 and at most 1");
        }
        let positive = [
            ("slew_per_s", self.slew_per_s),
            ("speed_m_s", self.speed_m_s),
            ("rate_rad_s", self.rate_rad_s),
            ("tilt_rad", self.tilt_rad),
            ("box_m", self.box_m[0].min(self.box_m[1])),
            ("tether_m", self.tether_m.unwrap_or(1.0)),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return refuse(name, value, "above 0");
            }
        }
        let ([low, high], start) = (self.depth_m, self.start_depth_m);
        if !(low < start && start < high && high.is_finite() && low.is_finite()) {
            let expected = format!("between the least and the greatest depth, {low} and {high} m");
            return refuse("start_depth_m", start, &expected);
        }
        Ok(())
    }

    /// Returns the limit that is used most by a vehicle that stops so; positions are relative to the
    /// start.
    pub(crate) fn most_used(&self, state: &State, stop: &Stop) -> Use {
        self.uses(state, stop).into_iter().fold(Use { part: 0.0, of: "none" }, Use::or)
    }

    /// Returns the use of every limit, likewise.
    pub(crate) fn uses(&self, state: &State, stop: &Stop) -> [Use; 6] {
        let nu: Vector6<f64> = state.fixed_rows::<6>(6).into_owned();
        let v = Vector3::new(nu[0], nu[1], nu[2]);
        let (speed, rate) = (v.norm(), Vector3::new(nu[3], nu[4], nu[5]).amax());
        let swings = [0, 1].map(|k| state[3 + k].hypot(nu[3 + k] * stop.swing_s[k]));
        let stop = stop.distance_s2 * speed * speed;
        let [low, high] = self.depth_m;
        let depth = self.start_depth_m + state[2];
        let (up, down) = (self.start_depth_m - low, high - self.start_depth_m);
        let room = if state[2] < 0.0 { up } else { down };
        let [north, east] = [0, 1].map(|k| (state[k].abs() + stop) / self.box_m[k]);
        let away = Vector3::new(state[0], state[1], state[2]).norm();
        [
            Use { part: north.max(east), of: "box_m" },
            Use { part: ((depth - self.start_depth_m).abs() + stop) / room, of: "depth_m" },
            Use { part: speed / self.speed_m_s, of: "speed_m_s" },
            Use { part: rate / self.rate_rad_s, of: "rate_rad_s" },
            Use { part: swings[0].max(swings[1]) / self.tilt_rad, of: "tilt_rad" },
            Use {
                part: self.tether_m.map_or(0.0, |tether| (away + stop) / tether),
                of: "tether_m",
            },
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_limit_is_named() {
        let limits = Limits { box_m: [2.0, 20.0], ..Limits::default() };
        let mut state = State::zeros();
        (state[0], state[6]) = (1.5, 0.2);
        let most = limits.most_used(&state, &Stop::default());
        assert_eq!((most.part, most.of), (0.75, "box_m"));
        // 0.2 m/s needs 0.4 m to stop.
        let stop = Stop { distance_s2: 10.0, swing_s: [0.5; 2] };
        assert!((limits.most_used(&state, &stop).part - 0.95).abs() < 1e-12);
        // A roll of 0.16 rad at 0.24 rad/s and 2 rad/s goes on to 0.2 rad.
        (state[0], state[3], state[9]) = (0.0, 0.16, 0.24);
        let swing = limits.uses(&state, &stop)[4];
        assert!((swing.part - 0.2 / limits.tilt_rad).abs() < 1e-12 && swing.of == "tilt_rad");
    }

    #[test]
    fn limits_that_leave_no_room_are_refused_by_name() {
        let limits = Limits { start_depth_m: 0.5, ..Limits::default() };
        let error = limits.check().expect_err("above the least depth").to_string();
        assert!(error.contains("start_depth_m is 0.5"), "{error}");
        let limits = Limits { thrust_part: 0.0, ..Limits::default() };
        let error = limits.check().expect_err("no thrust").to_string();
        assert!(error.contains("thrust_part is 0"), "{error}");
    }
}
