//! Fins and rudders, in the flow along the hull and behind a propeller.

use nalgebra::{Vector3, Vector6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::effect::{SLOW, wrench_at};
use crate::Surface;

/// A control surface, for the computation of its force.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Foil {
    /// The type of surface.
    pub kind: Surface,
    /// Name in channels.
    pub name: String,
    /// Point of application of its force, m, body frame.
    pub position_m: [f64; 3],
    /// The axis of rotation, a unit vector.
    pub axis: [f64; 3],
    /// Its stall angle, rad, beyond which lift is constant.
    pub stall_rad: Option<f64>,
}

/// The propeller ahead of a fin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PropellerAhead {
    /// Name in channels.
    pub propeller: String,
    /// True if the input is a speed or command n, so that T is n².
    pub squared: bool,
}

impl PropellerAhead {
    /// Returns T by the input of the propeller; none astern.
    pub(super) fn thrust(&self, drive: f64) -> f64 {
        let drive = drive.max(0.0);
        if self.squared { drive * drive } else { drive }
    }
}

/// The flow at a foil at an instant.
pub(super) struct Flow {
    /// `[n; r × n]` of its normal n.
    pub(super) normal: Vector6<f64>,
    /// `[V; r × V]` of its velocity V perpendicular to its axis.
    across: Vector6<f64>,
    /// |V|.
    speed: f64,
    /// V·n.
    along_normal: f64,
    /// sin δ.
    pub(super) sin: f64,
}

impl Foil {
    /// Returns its chord and its normal at zero angle, unit vectors.
    pub(super) fn directions(&self) -> (Vector3<f64>, Vector3<f64>) {
        let axis = Vector3::from(self.axis);
        let chord = Vector3::x() - axis * axis.x;
        let chord = chord.try_normalize(1e-6).unwrap_or_else(Vector3::x);
        (chord, axis.cross(&chord))
    }

    pub(super) fn at(&self, velocity: &Vector6<f64>, angle: f64) -> Flow {
        let (r, axis) = (Vector3::from(self.position_m), Vector3::from(self.axis));
        let (chord, side) = self.directions();
        let (sin, cos) = angle.sin_cos();
        let normal = side * cos - chord * sin;
        let own = velocity.fixed_rows::<3>(0) + velocity.fixed_rows::<3>(3).cross(&r);
        let own = Vector3::new(own.x, own.y, own.z);
        let across = own - axis * own.dot(&axis);
        Flow {
            normal: wrench_at(&r, &normal),
            across: wrench_at(&r, &across),
            speed: across.norm(),
            along_normal: own.dot(&normal),
            sin,
        }
    }
}

impl Flow {
    /// Returns `−|V| (V·n)`, with the normal component limited to that at the stall angle, and its
    /// derivative by ν.
    pub(super) fn lift(&self, stall_rad: Option<f64>) -> (f64, Vector6<f64>) {
        let most = stall_rad.map_or(f64::INFINITY, |stall| stall.sin() * self.speed);
        if self.along_normal.abs() > most {
            let part = most.copysign(self.along_normal) / self.speed.max(f64::MIN_POSITIVE);
            return (-part * self.speed * self.speed, self.across * (-2.0 * part));
        }
        let by_speed = self.along_normal / self.speed.max(SLOW);
        let slope = -(self.across * by_speed + self.normal * self.speed);
        (-self.speed * self.along_normal, slope)
    }
}

/// Below this speed along its chord, m/s, the flow at a fin does not depend on the race.
const LEAST_FLOW: f64 = 1e-3;

impl Foil {
    /// Returns the forces along the normal of a fin in a race of thrust T, each per unit of its coefficient, and their
    /// derivatives by ν: of lift k, and of the slipstream s, with s/k = `ratio`.
    ///
    /// ```text
    /// F = −k √(u_R² + v²) (v cos δ − u_R sin δ),   u_R |u_R| = u |u| + (s/k) T
    /// ```
    ///
    /// u and v are the velocities of the fin along its chord and across. F = k ∂F/∂k + s ∂F/∂s, since twice both
    /// coefficients are twice the force: the forces per unit are these derivatives.
    pub(super) fn in_race(
        &self,
        velocity: &Vector6<f64>,
        angle: f64,
        (thrust, ratio): (f64, f64),
    ) -> [(f64, Vector6<f64>); 2] {
        let r = Vector3::from(self.position_m);
        let (chord, side) = self.directions();
        let (chord, side) = (wrench_at(&r, &chord), wrench_at(&r, &side));
        let (x, y) = (chord.dot(velocity), side.dot(velocity));
        let (sin, cos) = angle.sin_cos();
        let squared = x * x.abs() + ratio * thrust;
        let u = squared.abs().sqrt().max(LEAST_FLOW).copysign(squared);
        let (u_by_ratio, u_by_x) = (0.5 * thrust / u.abs(), x.abs() / u.abs());
        let speed = u.hypot(y);
        let across = y * cos - u * sin;
        let most = self.stall_rad.map_or(f64::INFINITY, |stall| stall.sin() * speed);
        let (force, by_x, by_y, by_ratio, by_ratio_x, by_ratio_y);
        if across.abs() > most {
            let part = most.copysign(across) / speed;
            (force, by_x, by_y) =
                (-part * speed * speed, -2.0 * part * u * u_by_x, -2.0 * part * y);
            (by_ratio, by_ratio_x, by_ratio_y) = (-2.0 * part * u * u_by_ratio, 0.0, 0.0);
        } else {
            let by_u = u * across / speed - sin * speed;
            (force, by_x) = (-speed * across, -u_by_x * by_u);
            by_y = -(y * across / speed + speed * cos);
            by_ratio = -u_by_ratio * by_u;
            let (speed_by_x, speed_by_y) = (u * u_by_x / speed, y / speed);
            let by_u_x = (u_by_x * across - u * sin * u_by_x - u * across * speed_by_x / speed)
                / speed
                - sin * speed_by_x;
            let by_u_y = (u * cos - u * across * speed_by_y / speed) / speed - sin * speed_by_y;
            let u_by_ratio_x = -u_by_ratio * u_by_x / u;
            by_ratio_x = -(u_by_ratio_x * by_u + u_by_ratio * by_u_x);
            by_ratio_y = -u_by_ratio * by_u_y;
        }
        let slope = |by_x: f64, by_y: f64| chord * by_x + side * by_y;
        let of_lift = slope(by_x - ratio * by_ratio_x, by_y - ratio * by_ratio_y);
        [(force - ratio * by_ratio, of_lift), (by_ratio, slope(by_ratio_x, by_ratio_y))]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rudder(stall_rad: Option<f64>) -> Foil {
        let (position_m, axis) = ([-1.2, 0.1, 0.0], [0.0, 0.0, -1.0]);
        Foil { kind: Surface::Rudder, name: "rudder".into(), position_m, axis, stall_rad }
    }

    /// The force of a fin with both coefficients, computed from its flow.
    fn force(
        stall_rad: Option<f64>,
        [k, s]: [f64; 2],
        velocity: &Vector6<f64>,
        thrust: f64,
    ) -> f64 {
        let (u, v) = (velocity[0] - 0.1 * velocity[5], -(velocity[1] - 1.2 * velocity[5]));
        let angle: f64 = 0.3;
        let race = u * u.abs() + s / k * thrust;
        let race = race.abs().sqrt().copysign(race);
        let speed = race.hypot(v);
        let across = v * angle.cos() - race * angle.sin();
        let most = stall_rad.map_or(1.0, f64::sin) * speed;
        -k * speed * across.clamp(-most, most)
    }

    #[test]
    fn forces_per_unit_are_the_derivatives_by_both_coefficients() {
        for stall_rad in [None, Some(0.2)] {
            for (ahead, thrust) in [(0.9, 30.0), (0.9, 0.0), (-0.4, 30.0), (-0.4, 0.5)] {
                let (velocity, [k, s]) =
                    (Vector6::new(ahead, 0.2, 0.0, 0.0, 0.0, -0.15), [40.0, 0.8]);
                let race = (thrust, s / k);
                let [lift, slipstream] = rudder(stall_rad).in_race(&velocity, 0.3, race);
                let at = |k, s| force(stall_rad, [k, s], &velocity, thrust);
                let by_k = (at(k + 1e-3, s) - at(k - 1e-3, s)) / 2e-3;
                let by_s = (at(k, s + 1e-5) - at(k, s - 1e-5)) / 2e-5;
                assert!((lift.0 - by_k).abs() < 1e-6, "{} {by_k}", lift.0);
                assert!((slipstream.0 - by_s).abs() < 1e-4, "{} {by_s}", slipstream.0);
                assert!((k * lift.0 + s * slipstream.0 - at(k, s)).abs() < 1e-9);
                for j in 0..6 {
                    let by = |step: f64, which: usize| {
                        let mut moved = velocity;
                        moved[j] += step;
                        rudder(stall_rad).in_race(&moved, 0.3, race)[which].0
                    };
                    for (which, own) in [lift, slipstream].iter().enumerate() {
                        let found = (by(1e-6, which) - by(-1e-6, which)) / 2e-6;
                        assert!((found - own.1[j]).abs() < 1e-4, "{found} {} by {j}", own.1[j]);
                    }
                }
            }
        }
    }
}
