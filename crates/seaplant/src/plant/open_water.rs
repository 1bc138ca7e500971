//! A propeller with an open-water curve, and a rudder in its slipstream.

use nalgebra::{Vector3, Vector6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::effect::wrench_at;
use super::foil::Foil;

/// A propeller with a known open-water curve.
///
/// ```text
/// T = ρ n² D⁴ K_T(J),   J = u_P/(n D),   K_T = k₀ + k₁ J + k₂ J²
/// u_P = (1 − w) (1 + (1 − e^(−C₁|β_P|)) (C₂ − 1)) u,   sin β_P = −v_P/√(u² + v_P²)
/// ```
///
/// n in revolutions a second, v_P the sideways velocity at the propeller. J is limited to between 0
/// and the end of the curve, where K_T is zero; astern thrust is `ρ n|n| D⁴ k₀`.
///
/// # Source
/// [Yasukawa2015, eq. (15) to (18)].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OpenWater {
    /// Name in channels.
    pub propeller: String,
    /// Position, m.
    pub position_m: [f64; 3],
    /// Direction of positive thrust, a unit vector.
    pub direction: [f64; 3],
    /// Diameter D, m.
    pub diameter_m: f64,
    /// k₀, k₁, k₂.
    pub k_t: [f64; 3],
    /// Wake fraction w in straight motion.
    pub wake: f64,
    /// Variation of the wake with drift angle, if any.
    pub wake_by_drift: Option<WakeByDrift>,
    /// Density of the water ρ, kg/m³.
    pub density_kg_m3: f64,
}

/// Variation of the inflow at a propeller with drift angle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WakeByDrift {
    /// C₁, 1/rad.
    pub rate: f64,
    /// C₂: inflow at large drift angles over that in straight motion, for flow from starboard and
    /// from port.
    pub greatest: [f64; 2],
}

/// Inflow and its derivative by ν.
type Inflow = (f64, Vector6<f64>);

/// Below this speed the drift angle at a propeller is undefined, m/s.
const SLOW: f64 = 1e-6;

impl OpenWater {
    /// Returns u_P, m/s, and its derivative by ν.
    pub(super) fn inflow(&self, velocity: &Vector6<f64>) -> Inflow {
        let position = Vector3::from(self.position_m);
        let ahead_way = wrench_at(&position, &self.direction.into());
        let ahead = ahead_way.dot(velocity);
        let by = 1.0 - self.wake;
        let Some(drift) = self.wake_by_drift else { return (by * ahead, ahead_way * by) };
        let side_way = wrench_at(&position, &Vector3::y());
        let side = side_way.dot(velocity);
        let speed = ahead.hypot(side).max(SLOW);
        let sin = -side / speed;
        let sin_by = (ahead_way * (ahead * side) - side_way * (ahead * ahead)) / speed.powi(3);
        let greatest = drift.greatest[usize::from(sin > 0.0)] - 1.0;
        let left = (-drift.rate * sin.abs()).exp();
        let factor = by * (1.0 + (1.0 - left) * greatest);
        let factor_by = sin_by * (by * greatest * drift.rate * left * sin.signum());
        (factor * ahead, ahead_way * factor + factor_by * ahead)
    }

    /// Returns thrust before its deduction, N, at an inflow u_P, m/s, and a shaft speed, rad/s; and
    /// its derivative by the inflow, N/(m/s).
    ///
    /// # Example
    /// ```
    /// use seaplant::plant::OpenWater;
    /// let propeller = OpenWater {
    ///     propeller: "main".to_owned(),
    ///     position_m: [-3.4, 0.0, 0.0],
    ///     direction: [1.0, 0.0, 0.0],
    ///     diameter_m: 0.216,
    ///     k_t: [0.2931, -0.2753, -0.1385],
    ///     wake: 0.4,
    ///     wake_by_drift: None,
    ///     density_kg_m3: 1000.0,
    /// };
    /// let n = 12.0 * std::f64::consts::TAU;
    /// let (bollard, by_speed) = propeller.thrust(0.0, n);
    /// assert!((bollard - 1000.0 * 144.0 * 0.216_f64.powi(4) * 0.2931).abs() < 1e-9);
    /// assert!(by_speed < 0.0 && propeller.thrust(0.7, n).0 < bollard);
    /// ```
    pub fn thrust(&self, inflow: f64, shaft_rad_s: f64) -> (f64, f64) {
        let n = shaft_rad_s / std::f64::consts::TAU;
        let (d, [k0, k1, k2]) = (self.diameter_m, self.k_t);
        let scale = self.density_kg_m3 * n * n.abs() * d.powi(4);
        if n <= 0.0 {
            return (scale * k0, 0.0);
        }
        let j = inflow / (n * d);
        let inside = j.clamp(0.0, self.end());
        let slope = if j == inside { (k1 + 2.0 * k2 * j) / (n * d) } else { 0.0 };
        (scale * (k0 + inside * (k1 + inside * k2)), scale * slope)
    }

    /// Returns the advance ratio of zero thrust.
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

/// Influence of hull and propeller on the flow at a rudder, and of the rudder on the hull's force.
///
/// ```text
/// u_R = ε √(η (u_P + κ (u_∞ − u_P))² + (1 − η) u_P²)
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
    /// κ: acceleration of the slipstream at the rudder.
    pub race_factor: f64,
    /// η: the propeller's diameter over the rudder's span.
    pub diameter_to_span: f64,
    /// γ_R: flow-straightening coefficient, for flow from starboard and from port.
    pub straightening: [f64; 2],
    /// l_R: the x at which the sideways flow equals that at the rudder, m.
    pub flow_at_m: f64,
    /// t_R: steering resistance deduction fraction.
    pub steering_deduction: f64,
    /// a_H: rudder force increase factor of the hull.
    pub hull_increase: f64,
    /// x_H: point of application of the additional force, m.
    pub hull_at_m: f64,
}

impl RudderFlow {
    /// Returns the speed of the flow along the rudder, m/s, and its derivative by ν.
    fn along(&self, propeller: &OpenWater, (own, by): Inflow, shaft: f64) -> Inflow {
        let (thrust, slope) = propeller.thrust(own, shaft);
        if shaft <= 0.0 || thrust <= 0.0 {
            return (self.wake_ratio * own, by * self.wake_ratio);
        }
        let disc =
            8.0 / (std::f64::consts::PI * propeller.density_kg_m3 * propeller.diameter_m.powi(2));
        let far = (own * own + disc * thrust).sqrt();
        let far_by = (own + 0.5 * disc * slope) / far;
        let (k, eta) = (self.race_factor, self.diameter_to_span.min(1.0));
        let (race, race_by) = ((1.0 - k) * own + k * far, 1.0 - k + k * far_by);
        let speed = (eta * race * race + (1.0 - eta) * own * own).sqrt();
        let speed_by = (eta * race * race_by + (1.0 - eta) * own) / speed;
        (self.wake_ratio * speed, by * (self.wake_ratio * speed_by))
    }

    /// Returns the wrench of a rudder for a unit coefficient, `½ρA f_α`, N/(m/s)², as the direction
    /// and derivative by ν: `way · force`, `way · slopeᵀ`.
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
        let side_way = wrench_at(&flow_at, &side);
        let (u, u_by) = self.along(propeller, propeller.inflow(velocity), shaft);
        let across = side_way.dot(velocity);
        let is_from_port = (across < 0.0) == (side.y > 0.0);
        let gamma = self.straightening[usize::from(is_from_port)];
        let (v, v_by) = (gamma * across, side_way * gamma);
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
        let way = wrench_at(&own, &(side * cos - chord * ((1.0 - self.steering_deduction) * sin)))
            + wrench_at(&hull_at, &(side * (self.hull_increase * cos)));
        (way, attack * speed * speed, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Surface;

    fn propeller() -> OpenWater {
        OpenWater {
            propeller: "propeller".to_owned(),
            position_m: [-3.36, 0.0, 0.0],
            direction: [1.0, 0.0, 0.0],
            diameter_m: 0.216,
            k_t: [0.2931, -0.2753, -0.1385],
            wake: 0.4,
            wake_by_drift: None,
            density_kg_m3: 1000.0,
        }
    }

    #[test]
    fn thrust_is_zero_at_the_end_of_its_curve() {
        let propeller = propeller();
        let n = 5.0 * std::f64::consts::TAU;
        // K_T(0.7677) = 0 by the quadratic formula, at u_P = J n D.
        let at = 0.767_7 * 5.0 * 0.216;
        assert!(propeller.thrust(at, n).0.abs() < 1e-2);
        assert!(propeller.thrust(3.0 * at, n).0.abs() < 1e-9);
        assert!(propeller.thrust(1.0, -n).0 < 0.0 && propeller.thrust(1.0, 0.0).0 == 0.0);
    }

    #[test]
    fn wake_changes_with_drift_as_published() {
        let wake_by_drift = Some(WakeByDrift { rate: 2.0, greatest: [1.1, 1.6] });
        let propeller = OpenWater { wake_by_drift, ..propeller() };
        let at = |v: f64| propeller.inflow(&Vector6::new(1.0, v, 0.0, 0.0, 0.0, 0.0)).0;
        let factor = |sin: f64, greatest: f64| 1.0 + (1.0 - (-2.0 * sin).exp()) * (greatest - 1.0);
        let sin = 0.3 / 1.09_f64.sqrt();
        assert!((at(0.0) - 0.6).abs() < 1e-12);
        assert!((at(-0.3) - 0.6 * factor(sin, 1.6)).abs() < 1e-12);
        assert!((at(0.3) - 0.6 * factor(sin, 1.1)).abs() < 1e-12);
    }

    #[test]
    fn a_rudder_in_a_slipstream_agrees_with_the_published_formulas() {
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
