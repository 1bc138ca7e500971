//! Signals of rudders, fins, propellers and wind.

use std::collections::BTreeMap;

use super::force::thrust_of;
use crate::navigation::{Navigated, Recording};
use crate::plant::Signal;
use crate::quantity::{WindFrame, WindPart};
use crate::{Error, Quantity, Timed, Vehicle};

/// Returns the signals of a vehicle's effects in a recording.
///
/// # Errors
/// As [`Timed::new`].
pub(super) fn signals(
    recording: &Recording,
    vehicle: &Vehicle,
    navigated: &Navigated,
    velocity: &[Option<Timed>; 6],
) -> Result<BTreeMap<Signal, Timed>, Error> {
    let mut found = BTreeMap::new();
    for fin in &vehicle.fins {
        let (kind, name) = (fin.kind, fin.name.clone());
        let quantity = Quantity::SurfaceAngle { kind, name: name.clone() };
        if let Some(angle) = recording.get(&quantity) {
            found.insert(Signal::Angle { kind, name }, angle.clone());
        }
        let ahead = fin.slipstream.as_ref();
        if let Some((name, thrust)) =
            ahead.and_then(|name| Some((name, thrust_of(recording, vehicle, name)?)))
        {
            found.insert(Signal::Drive(name.clone()), thrust);
        }
    }
    for thruster in &vehicle.propellers {
        let (name, input) = (thruster.name.clone(), thruster.curve.input());
        let quantity = Quantity::Thruster { name: name.clone(), input };
        if let Some(drive) = recording.get(&quantity) {
            found.insert(Signal::Drive(name), drive.clone());
        }
    }
    if let Some([forward, starboard]) = air(recording, navigated, velocity)? {
        found.insert(Signal::AirForward, forward);
        found.insert(Signal::AirStarboard, starboard);
    }
    Ok(found)
}

/// Returns the velocity of the air over ground along body x and y; `None` without the channels.
///
/// The true wind needs heading; the relative wind needs the vehicle's own velocity.
fn air(
    recording: &Recording,
    navigated: &Navigated,
    velocity: &[Option<Timed>; 6],
) -> Result<Option<[Timed; 2]>, Error> {
    let wind = |frame, part| recording.get(&Quantity::Wind(frame, part));
    let speed_and_direction =
        |frame| wind(frame, WindPart::Speed).zip(wind(frame, WindPart::Direction));
    let body: Box<dyn Fn(f64, f64, f64) -> [f64; 2]>;
    let (speed, direction);
    if let (Some(relative), [Some(surge), Some(sway), ..]) =
        (speed_and_direction(WindFrame::Relative), velocity)
    {
        (speed, direction) = relative;
        body = Box::new(|t, x, y| [x + surge.at(t), y + sway.at(t)]);
    } else if let (Some(over_ground), Some(heading)) =
        (speed_and_direction(WindFrame::True), &navigated.heading)
    {
        (speed, direction) = over_ground;
        body = Box::new(|t, north, east| {
            let (sin, cos) = heading.at(t).sin_cos();
            [north * cos + east * sin, east * cos - north * sin]
        });
    } else {
        return Ok(None);
    }
    let at = |(&t, &speed): (&f64, &f64)| {
        // Wind blows away from the direction that it comes from.
        let (sin, cos) = direction.held_at(t).sin_cos();
        body(t, -speed * cos, -speed * sin)
    };
    let both: Vec<[f64; 2]> = speed.time_s().iter().zip(speed.values()).map(at).collect();
    let part = |k: usize| speed.with_values("wind", both.iter().map(|air| air[k]).collect());
    Ok(Some([part(0)?, part(1)?]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigation::navigate;
    use crate::quantity::Attitude;
    use crate::{Dof, Sensors};

    fn constant(value: f64) -> Timed {
        let time_s: Vec<f64> = (0..20).map(|k| 0.1 * f64::from(k)).collect();
        Timed::new("test", time_s, vec![value; 20]).expect("valid")
    }

    #[test]
    fn relative_and_true_wind_give_the_same_velocity_of_air() {
        // Heading east at 3 m/s, wind of 4 m/s from the north: relative wind from port ahead.
        let felt = (4.0_f64.hypot(3.0), (-4.0_f64).atan2(3.0));
        let common = [
            (Quantity::Attitude(Attitude::Heading), constant(90_f64.to_radians())),
            (Quantity::Velocity(Dof::Surge), constant(3.0)),
            (Quantity::Velocity(Dof::Sway), constant(0.0)),
        ];
        let air_of = |frame, (speed, direction): (f64, f64)| {
            let mut recording = Recording::from(common.clone());
            recording.insert(Quantity::Wind(frame, WindPart::Speed), constant(speed));
            recording.insert(Quantity::Wind(frame, WindPart::Direction), constant(direction));
            let navigated = navigate("t", &recording, &Sensors::default()).expect("complete");
            let velocity = Dof::ALL.map(|dof| navigated.measured.get(&dof).cloned());
            let [x, y] = air(&recording, &navigated, &velocity).expect("valid").expect("told");
            [x.values()[5], y.values()[5]]
        };
        let [x, y] = air_of(WindFrame::True, (4.0, 0.0));
        // Southward is to starboard of a vehicle that heads east.
        assert!(x.abs() < 1e-12 && (y - 4.0).abs() < 1e-12, "{x} {y}");
        let [x, y] = air_of(WindFrame::Relative, felt);
        assert!(x.abs() < 1e-12 && (y - 4.0).abs() < 1e-12, "{x} {y}");
    }
}
