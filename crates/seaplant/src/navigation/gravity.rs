//! Detection of gravity in an accelerometer's readings, with its unit and direction.

use super::attitude::AttitudeRecord;
use crate::{Caveat, CaveatCode, Dof, Error, Timed};

/// The gravity to be removed from an accelerometer's readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Gravity {
    /// The readings include it, as measured.
    Measured,
    /// It was removed before logging.
    Removed,
}

/// Standard gravity, m/s²; local deviations are part of the offset.
const G: f64 = 9.80665;

/// A mean along gravity within this fraction of g is gravity …
const NEAR: f64 = 0.15;
/// … and one below this, m/s², excludes it.
const NO_GRAVITY: f64 = 0.5;

/// Least gravity along an axis due to tilt that allows its detection, m/s² rms.
const TILTED: f64 = 0.3;

impl Gravity {
    /// Returns g, m/s².
    pub(super) fn g(self) -> f64 {
        match self {
            Self::Measured => G,
            Self::Removed => 0.0,
        }
    }

    /// Detects gravity by the mean along the world's down, otherwise by the regression of readings
    /// on tilt.
    ///
    /// # Errors
    /// [`Error::Accelerometer`] if the readings are not specific force; [`Error::MissingChannel`]
    /// if gravity must be separated from acceleration without attitude.
    pub(super) fn detect(
        dof: Dof,
        trial: &str,
        force: &Timed,
        down: Option<&Timed>,
        attitude: &AttitudeRecord,
        caveats: &mut Vec<Caveat>,
    ) -> Result<Self, Error> {
        let along_down = down.map(mean);
        let found = match along_down {
            Some(mean) => from_mean(trial, mean)?,
            None => Self::Measured,
        };
        let slope = slope_on_tilt(dof, force, attitude);
        let found = match (along_down, slope) {
            (_, Some(slope)) if slope > 0.5 => return Err(refuse(trial, reversed(dof, slope))),
            (None, Some(slope)) if slope > -0.5 => Self::Removed,
            _ => found,
        };
        if found == Self::Removed {
            caveats.push(note(trial, "gravity was taken out of the acceleration before it was logged: it is not added again, and the attitude errors of that correction remain"));
            return Ok(found);
        }
        if !knows(dof, attitude) {
            let angle = if dof == Dof::Sway { "attitude.roll" } else { "attitude.pitch" };
            return Err(Error::MissingChannel {
                trial: trial.to_owned(),
                what: angle.to_owned(),
                advice: format!(
                    "without it gravity cannot be separated from acceleration in {dof}; map it, or log acceleration without gravity"
                ),
            });
        }
        if along_down.is_none() && slope.is_none() {
            caveats.push(note(trial, "acceleration.z is not mapped and the vehicle stays level, so that nothing shows whether gravity is part of the readings; it is taken to be"));
        }
        Ok(found)
    }
}

fn note(trial: &str, what: &str) -> Caveat {
    Caveat::note(CaveatCode::Navigation, format!("trial `{trial}`: {what}"))
}

fn refuse(trial: &str, reason: String) -> Error {
    Error::Accelerometer { trial: trial.to_owned(), reason }
}

fn mean(series: &Timed) -> f64 {
    series.values().iter().sum::<f64>() / series.len() as f64
}

/// Returns whether the angle that tilts gravity into a translation was measured.
fn knows(dof: Dof, attitude: &AttitudeRecord) -> bool {
    let [roll, pitch, _] = attitude.parts();
    match dof {
        Dof::Surge => pitch.is_some(),
        Dof::Sway => roll.is_some(),
        _ => pitch.is_some() || roll.is_some(),
    }
}

/// Detects gravity by the mean specific force along the world's down, m/s².
fn from_mean(trial: &str, mean: f64) -> Result<Gravity, Error> {
    let is = |x: f64| (mean.abs() / x - 1.0).abs() < NEAR;
    let reads = format!("at rest the accelerometer reads {mean:.2} m/s² along the world's down");
    if is(G) && mean < 0.0 {
        Ok(Gravity::Measured)
    } else if is(G) {
        Err(refuse(
            trial,
            format!(
                "{reads}, and one whose z points down reads -9.8: its axes are forward-left-up (set [sensor.imu] rotation_deg = [180, 0, 0]), or all of its signs are reversed (give its columns the scale -1)"
            ),
        ))
    } else if is(1.0) {
        Err(refuse(trial, format!("{reads}: it is logged in g; give its columns the unit [g]")))
    } else if is(1000.0) {
        Err(refuse(
            trial,
            format!("{reads}: it is logged in thousandths of g; give its columns the unit [mg]"),
        ))
    } else if mean.abs() < NO_GRAVITY {
        Ok(Gravity::Removed)
    } else {
        Err(refuse(
            trial,
            format!(
                "{reads}, where it is -9.8 with gravity and 0 without: check the unit of acceleration, its axes and [sensor.imu] rotation_deg"
            ),
        ))
    }
}

fn reversed(dof: Dof, slope: f64) -> String {
    let axis = if dof == Dof::Surge { "x" } else { "y" };
    format!(
        "along {dof} the accelerometer responds to tilt with {slope:+.1} times gravity instead of -1: the sign of acceleration.{axis} is reversed, or that of the attitude"
    )
}

/// Returns the slope of specific force on `g (Rᵀ e₃)` along an axis, −1 for an accelerometer;
/// `None` if the vehicle tilts too little.
fn slope_on_tilt(dof: Dof, force: &Timed, attitude: &AttitudeRecord) -> Option<f64> {
    let row = match dof {
        Dof::Surge => 0,
        Dof::Sway => 1,
        _ => return None,
    };
    let mut tilt = attitude.reader();
    let at = |t: f64| (tilt.at(t).inverse() * nalgebra::Vector3::z())[row] * G;
    let pulled: Vec<f64> = force.time_s().iter().copied().map(at).collect();
    let n = pulled.len() as f64;
    let (mean_x, mean_y) = (pulled.iter().sum::<f64>() / n, mean(force));
    let (mut xx, mut xy) = (0.0, 0.0);
    for (x, y) in pulled.iter().zip(force.values()) {
        xx += (x - mean_x).powi(2);
        xy += (x - mean_x) * (y - mean_y);
    }
    ((xx / n).sqrt() > TILTED).then(|| xy / xx)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gravity_is_detected_by_the_mean() {
        assert_eq!(from_mean("t", -9.7), Ok(Gravity::Measured));
        assert_eq!(from_mean("t", 0.1), Ok(Gravity::Removed));
        for (mean, says) in
            [(9.8, "[180, 0, 0]"), (-1.0, "[g]"), (-1002.0, "[mg]"), (-5.0, "check the unit")]
        {
            let message = from_mean("t", mean).expect_err("wrong").to_string();
            assert!(message.contains(says) && message.contains("`t`"), "{message}");
        }
    }
}
