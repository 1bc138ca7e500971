//! Converts gains to ArduSub parameters with the same meaning.

use seaplant::Dof;

use crate::Gains;

/// Parameters of position and velocity loop by axis, with the divisor of metres.
///
/// ArduSub's outputs are fractions of full thrust, so that conversion needs a force limit.
struct Same {
    dof: Dof,
    position: &'static str,
    rate: &'static str,
    /// Unit of ArduSub's velocity loop per m/s or rad/s.
    scale: f64,
}

/// Cascades of a proportional outer loop and an inner loop on its rate: PD with
/// `K_p = K_outer K_inner` and `K_d = K_inner`.
const SAME: [Same; 3] = [
    Same { dof: Dof::Roll, position: "ATC_ANG_RLL_P", rate: "ATC_RAT_RLL_P", scale: 1.0 },
    Same { dof: Dof::Pitch, position: "ATC_ANG_PIT_P", rate: "ATC_RAT_PIT_P", scale: 1.0 },
    Same { dof: Dof::Yaw, position: "ATC_ANG_YAW_P", rate: "ATC_RAT_YAW_P", scale: 1.0 },
];

/// Returns the parameter file's lines, and the gains without an equivalent parameter.
///
/// For roll, pitch and yaw the outer loop is K_p/K_d in 1/s, and the rate loop K_d over the
/// greatest moment: both are equivalent. Heave's velocity loop is in throttle relative to hover,
/// surge's and sway's act through lean angles of a copter: they are not. Feed-forward, integral and
/// model have no parameters.
///
/// # Source
/// ArduPilot, `AC_AttitudeControl`: angle P gives a rate, rate PID gives a part of full torque.
pub fn ardusub(gains: &Gains) -> (String, Vec<String>) {
    let (mut text, mut notes, mut others) = (String::new(), Vec::new(), Vec::new());
    for (dof, axis) in &gains.axes {
        let Some(same) = SAME.iter().find(|same| same.dof == *dof) else {
            others.push(dof.name());
            continue;
        };
        text += &format!("{},{:.4}\n", same.position, axis.kp / axis.kd);
        match axis.limit {
            Some(limit) => {
                text += &format!("{},{:.5}\n", same.rate, same.scale * axis.kd / limit);
            }
            None => notes.push(format!(
                "{dof}: {} is a fraction of the full moment per rad/s; state the greatest moment with --limit to compute it",
                same.rate
            )),
        }
        if axis.ki > 0.0 {
            notes.push(format!(
                "{dof}: the integral acts on the angle here and on the rate in ArduSub; it is left out"
            ));
        }
    }
    if !others.is_empty() {
        notes.push(format!(
            "{}: ArduSub's position and velocity gains (PSC_…) count in throttle and lean, not in newtons; set them by trial",
            others.join(", ")
        ));
    }
    if gains.law.is_model_based() {
        notes.push("ArduSub has no model of the plant: only feedback is written".to_owned());
    }
    (text, notes)
}
