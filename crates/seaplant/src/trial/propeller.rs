//! Plausibility of thrust by a propeller's curve at the logged speed.

use std::f64::consts::PI;

use crate::ThrusterInput;
use crate::caveat::spoken;
use crate::navigation::Recording;
use crate::{Caveat, CaveatCode, Quantity, Thruster, Vehicle};

/// Upper bound of the thrust coefficient at rest, also of ducted propellers [Oosterveld1970].
const GREATEST_K_T: f64 = 1.0;

/// Upper bound of the speed of blade tips, m/s, above fully developed cavitation.
const FASTEST_TIP_M_S: f64 = 60.0;

/// Returns caveats on thrust at propeller speeds that would need impossibly fast blades: speed or
/// curve then has a wrong unit.
///
/// Thrust at rest is `T = K_T ρ n² D⁴`, so that the least diameter is `D = (T / (K_T ρ n²))^¼`,
/// with tips at a speed of `π n D`.
pub(super) fn impossible(recording: &Recording, vehicle: &Vehicle) -> Vec<Caveat> {
    let mut caveats = Vec::new();
    for thruster in vehicle.thrusters.iter().filter(|thruster| thruster.open_water.is_none()) {
        let quantity =
            Quantity::Thruster { name: thruster.name.clone(), input: ThrusterInput::Speed };
        let Some(speed) = recording.get(&quantity) else { continue };
        let fastest = speed.values().iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()));
        caveats.extend(fastest.and_then(|speed| too_fast(thruster, speed, vehicle)));
    }
    caveats
}

fn too_fast(thruster: &Thruster, speed_rad_s: f64, vehicle: &Vehicle) -> Option<Caveat> {
    let (thrust, diameter_m) = needed(thruster, speed_rad_s, vehicle.water_density_kg_m3);
    let tip_m_s = 0.5 * speed_rad_s.abs() * diameter_m;
    (tip_m_s > FASTEST_TIP_M_S).then(|| {
        let message = format!(
            "the curve of thruster `{}` gives {} N at {} rad/s, the greatest logged speed: a propeller would need a diameter of at least {} m for that, and its blade tips would move at {} m/s, which none in water do; check the unit of speed and the scale of the curve",
            thruster.name,
            spoken(thrust),
            spoken(speed_rad_s),
            spoken(diameter_m),
            spoken(tip_m_s)
        );
        Caveat::severe(CaveatCode::SuspiciousUnit, message)
    })
}

/// Returns thrust at a speed, N, and the least diameter for it, m.
fn needed(thruster: &Thruster, speed_rad_s: f64, density: f64) -> (f64, f64) {
    let thrust = thruster.curve.force(speed_rad_s, None);
    let turns_s = speed_rad_s / (2.0 * PI);
    (thrust, (thrust.abs() / (GREATEST_K_T * density * turns_s * turns_s)).powf(0.25))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{QuadraticThrust, ThrustCurve};

    /// Thrust coefficient in N/(rad/s)², largest speed in rad/s, and the true diameter, m.
    const KNOWN: [(f64, f64, f64); 2] = [
        // Jason 2, 1650 rpm [Jason2, fig. 2]; no diameter is published.
        (0.0402, 172.8, f64::INFINITY),
        // The T200 at 16 V: 51 N at about 3600 rpm, 76 mm [T200].
        (51.0 / (377.0 * 377.0), 377.0, 0.076),
    ];

    fn doubts(forward: f64, speed: f64) -> Option<Caveat> {
        let law = QuadraticThrust { forward, reverse: forward, ..Default::default() };
        let curve = ThrustCurve::Quadratic { input: ThrusterInput::Speed, law };
        let thruster = Thruster::new("T1", [0.0; 3], [1.0, 0.0, 0.0], curve).expect("valid");
        too_fast(&thruster, speed, &Vehicle::default())
    }

    #[test]
    fn the_least_diameter_is_below_the_true_one() {
        for (forward, speed, diameter_m) in KNOWN {
            let thrust = forward * speed * speed;
            let turns_s = speed / (2.0 * PI);
            let least = (thrust / (1025.0 * turns_s * turns_s)).powf(0.25);
            assert!(least < diameter_m, "{least}");
            assert_eq!(doubts(forward, speed), None);
            assert_eq!(doubts(forward, -speed), None);
        }
    }

    #[test]
    fn rejects_rpm_as_rad_s_and_a_curve_times_a_thousand() {
        for (forward, speed, _) in KNOWN {
            for (factor, unit) in [(1.0, 60.0 / (2.0 * PI)), (1e4, 1.0)] {
                let doubt = doubts(factor * forward, unit * speed).expect("it is impossible");
                assert!(doubt.message.contains("blade tips would move at"), "{}", doubt.message);
            }
        }
    }

    #[test]
    fn accepts_a_thruster_at_rest() {
        assert_eq!(doubts(0.04, 0.0), None);
    }
}
