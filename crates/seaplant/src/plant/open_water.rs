//! A propeller by its open-water curve, and a rudder in its race.

use nalgebra::{Vector3, Vector6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::effect::{Foil, at_place};

/// A propeller whose open-water curve is known.
///
/// ```text
/// T = ρ n² D⁴ K_T(J),   J = u (1 − w) / (n D),   K_T = k₀ + k₁ J + k₂ J²
/// ```
///
/// n in revolutions a second. J stays between 0 and the end of the curve, where K_T is zero;
/// astern thrust is `ρ n|n| D⁴ k₀`.
///
/// # Source
/// [Yasukawa2015, eq. (15) to (18)].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OpenWater {
    /// What channels call it.
    pub propeller: String,
    /// Diameter D, m.
    pub diameter_m: f64,
    /// k₀, k₁, k₂.
    pub k_t: [f64; 3],
    /// Wake fraction w.
    pub wake: f64,
    /// Density of the water ρ, kg/m³.
    pub density_kg_m3: f64,
}

impl OpenWater {
    /// Thrust before its deduction, N, at a speed ahead, m/s, and a speed of the shaft, rad/s;
    /// and its slope by the speed ahead, N/(m/s).
    ///
    /// # Example
    /// ```
    /// use seaplant::plant::OpenWater;
    /// let propeller = OpenWater {
    ///     propeller: "main".to_owned(),
    ///     diameter_m: 0.216,
    ///     k_t: [0.2931, -0.2753, -0.1385],
    ///     wake: 0.4,
    ///     density_kg_m3: 1000.0,
    /// };
    /// let n = 12.0 * std::f64::consts::TAU;
    /// let (bollard, by_speed) = propeller.thrust(0.0, n);
    /// assert!((bollard - 1000.0 * 144.0 * 0.216_f64.powi(4) * 0.2931).abs() < 1e-9);
    /// assert!(by_speed < 0.0 && propeller.thrust(1.2, n).0 < bollard);
    /// ```
    pub fn thrust(&self, ahead: f64, shaft_rad_s: f64) -> (f64, f64) {
        let n = shaft_rad_s / std::f64::consts::TAU;
        let (d, [k0, k1, k2]) = (self.diameter_m, self.k_t);
        let scale = self.density_kg_m3 * n * n.abs() * d.powi(4);
        if n <= 0.0 {
            return (scale * k0, 0.0);
        }
        let by_speed = (1.0 - self.wake) / (n * d);
        let j = ahead * by_speed;
        let inside = j.clamp(0.0, self.end());
        let slope = if j == inside { (k1 + 2.0 * k2 * j) * by_speed } else { 0.0 };
        (scale * (k0 + inside * (k1 + inside * k2)), scale * slope)
    }

    /// The advance ratio at which thrust ends.
    fn end(&self) -> f64 {
        let [k0, k1, k2] = self.k_t;
        if k2 == 0.0 {
            return if k1 < 0.0 { -k0 / k1 } else { f64::INFINITY };
        }
        let root = (k1 * k1 - 4.0 * k2 * k0).max(0.0).sqrt();
        let ends = [(-k1 - root) / (2.0 * k2), (-k1 + root) / (2.0 * k2)];
        ends.into_iter().filter(|j| *j > 0.0).fold(f64::INFINITY, f64::min)
    }
}

/// How hull and propeller change the flow at a rudder, and what the hull adds to its force.
///
/// ```text
/// u_R = ε √(η (u_P + κ (u_∞ − u_P))² + (1 − η) u_P²),   u_P = (1 − w) u
/// u_∞² = u_P² + 8 T/(π ρ D²),   v_R = −γ (v + l_R r)
/// F_N = U_R (u_R sin δ − v_R cos δ),   U_R² = u_R² + v_R²
/// X = −(1 − t_R) F_N sin δ,   Y = −(1 + a_H) F_N cos δ,   N = −(x_R + a_H x_H) F_N cos δ
/// ```
///
/// # Source
/// [Yasukawa2015, eq. (19) to (25)].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RudderFlow {
    /// ε: the wake at the rudder over that at the propeller, `(1 − w_R)/(1 − w_P)`.
    pub wake_ratio: f64,
    /// κ: how far the race has been sped up where the rudder is.
    pub race_factor: f64,
    /// η: the propeller's diameter over the rudder's span.
    pub diameter_to_span: f64,
    /// γ_R: how much of the hull's sideways flow reaches the rudder, where that comes from port
    /// and where from starboard of it.
    pub straightening: [f64; 2],
    /// l_R: at which x the sideways flow is that of the hull, m.
    pub flow_at_m: f64,
    /// t_R: the part of the rudder's drag that the hull takes back.
    pub steering_deduction: f64,
    /// a_H: what the hull adds to the rudder's side force, as a part of it.
    pub hull_increase: f64,
    /// x_H: where it adds that, m.
    pub hull_at_m: f64,
}

impl RudderFlow {
    /// The speed of the flow along the rudder, m/s, and its slope by the speed ahead.
    fn along(&self, propeller: &OpenWater, ahead: f64, shaft: f64) -> (f64, f64) {
        let by = 1.0 - propeller.wake;
        let own = by * ahead;
        let (thrust, slope) = propeller.thrust(ahead, shaft);
        if shaft <= 0.0 || thrust <= 0.0 {
            return (self.wake_ratio * own, self.wake_ratio * by);
        }
        let disc =
            8.0 / (std::f64::consts::PI * propeller.density_kg_m3 * propeller.diameter_m.powi(2));
        let far = (own * own + disc * thrust).sqrt();
        let far_by = (own * by + 0.5 * disc * slope) / far;
        let (k, eta) = (self.race_factor, self.diameter_to_span.min(1.0));
        let (race, race_by) = ((1.0 - k) * own + k * far, (1.0 - k) * by + k * far_by);
        let speed = (eta * race * race + (1.0 - eta) * own * own).sqrt();
        let speed_by = (eta * race * race_by + (1.0 - eta) * own * by) / speed;
        (self.wake_ratio * speed, self.wake_ratio * speed_by)
    }

    /// The force and moment of a rudder with a coefficient of one, `½ρA f_α`, N/(m/s)², and the
    /// direction and slope by ν of it: `way · force`, `way · slopeᵀ`.
    pub(super) fn force(
        &self,
        foil: &Foil,
        propeller: &OpenWater,
        velocity: &Vector6<f64>,
        [angle, shaft]: [f64; 2],
    ) -> (Vector6<f64>, f64, Vector6<f64>) {
        let (chord, side) = foil.directions();
        let (sin, cos) = angle.sin_cos();
        let own = Vector3::from(foil.position_m);
        let flow_at = Vector3::new(self.flow_at_m, own.y, own.z);
        let ahead_way = at_place(&own, &chord);
        let side_way = at_place(&flow_at, &side);
        let (u, by_ahead) = self.along(propeller, ahead_way.dot(velocity), shaft);
        let across = side_way.dot(velocity);
        let gamma = self.straightening[usize::from(across > 0.0)];
        let v = gamma * across;
        let (u_by, v_by) = (ahead_way * by_ahead, side_way * gamma);
        let speed = u.hypot(v).max(f64::MIN_POSITIVE);
        let most = foil.stall_rad.map_or(1.0, f64::sin);
        let attack = ((u * sin - v * cos) / speed).clamp(-most, most);
        let speed_by = (u_by * u + v_by * v) / speed;
        let slope = if attack.abs() < most || foil.stall_rad.is_none() {
            (u_by * sin - v_by * cos) * speed + speed_by * (attack * speed)
        } else {
            speed_by * (2.0 * attack * speed)
        };
        let hull_at = Vector3::new(self.hull_at_m, own.y, own.z);
        let way = at_place(&own, &(side * cos - chord * ((1.0 - self.steering_deduction) * sin)))
            + at_place(&hull_at, &(side * (self.hull_increase * cos)));
        (way, attack * speed * speed, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::Surface;

    pub(crate) fn propeller() -> OpenWater {
        OpenWater {
            propeller: "propeller".to_owned(),
            diameter_m: 0.216,
            k_t: [0.2931, -0.2753, -0.1385],
            wake: 0.4,
            density_kg_m3: 1000.0,
        }
    }

    #[test]
    fn thrust_ends_where_its_curve_does() {
        let propeller = propeller();
        let n = 5.0 * std::f64::consts::TAU;
        // K_T(0.7677) = 0 by the quadratic formula, at u = J n D / (1 − w).
        let at = 0.767_7 * 5.0 * 0.216 / 0.6;
        assert!(propeller.thrust(at, n).0.abs() < 1e-2);
        assert!(propeller.thrust(3.0 * at, n).0.abs() < 1e-9);
        assert!(propeller.thrust(1.0, -n).0 < 0.0 && propeller.thrust(1.0, 0.0).0 == 0.0);
    }

    #[test]
    fn a_rudder_in_a_race_pushes_as_the_published_formulas_say() {
        // Worked by hand: u 1.1, v −0.1, r 0.1, n 10 /s, δ 20°.
        let flow = RudderFlow {
            wake_ratio: 1.09,
            race_factor: 0.5,
            diameter_to_span: 0.626,
            straightening: [0.395, 0.640],
            flow_at_m: -4.97,
            steering_deduction: 0.387,
            hull_increase: 0.312,
            hull_at_m: -3.248,
        };
        let foil = Foil {
            kind: Surface::Rudder,
            name: "rudder".to_owned(),
            position_m: [-3.5, 0.0, 0.0],
            axis: [0.0, 0.0, -1.0],
            stall_rad: None,
        };
        let velocity = Vector6::new(1.1, -0.1, 0.0, 0.0, 0.0, 0.1);
        let angle = 20_f64.to_radians();
        let signals = [angle, 10.0 * std::f64::consts::TAU];
        let (way, force, _) = flow.force(&foil, &propeller(), &velocity, signals);
        let u_p: f64 = 0.6 * 1.1;
        let j = u_p / (10.0 * 0.216);
        let k_t = 0.2931 - 0.2753 * j - 0.1385 * j * j;
        let sped = (1.0 + 8.0 * k_t / (std::f64::consts::PI * j * j)).sqrt() - 1.0;
        let u_r = 1.09 * u_p * (0.626 * (1.0 + 0.5 * sped).powi(2) + 0.374).sqrt();
        let v_r: f64 = 0.640 * (0.1 + 4.97 * 0.1);
        let normal = (u_r * u_r + v_r * v_r) * (angle - v_r.atan2(u_r)).sin();
        assert!((force - normal).abs() < 1e-9, "{force} {normal}");
        let expected = [
            -(1.0 - 0.387) * angle.sin(),
            -1.312 * angle.cos(),
            (3.5 + 0.312 * 3.248) * angle.cos(),
        ];
        for (k, expected) in [0, 1, 5].into_iter().zip(expected) {
            assert!((way[k] - expected).abs() < 1e-12, "{way}");
        }
    }
}
