//! Measurements of a satellite receiver: geographic positions and velocities over ground.

use std::collections::btree_map::Entry;

use nalgebra::Vector3;

use super::attitude::{AttitudeRecord, unwrap};
use super::{Navigated, Recording, TRANSLATIONS};
use crate::quantity::World;
use crate::{Caveat, CaveatCode, Error, Quantity, Sensors, Timed};

/// Half the length of the WGS 84 ellipsoid's equatorial axis, m.
const EQUATOR_M: f64 = 6_378_137.0;
/// The square of its eccentricity.
const ECCENTRICITY_2: f64 = 6.694_379_990_14e-3;

/// Converts latitude and longitude to metres north and east of the first of them, where the log has
/// no such metres: `N = M Δφ`, `E = R cos φ Δλ` with the ellipsoid's radii of curvature there.
///
/// # Source
/// WGS 84.
pub(super) fn positions(recording: &mut Recording) -> Result<(), Error> {
    let (latitude, longitude) =
        (recording.remove(&Quantity::Latitude), recording.remove(&Quantity::Longitude));
    let (Some(latitude), Some(longitude)) = (latitude, longitude) else { return Ok(()) };
    if recording.contains_key(&Quantity::Position(World::North)) {
        return Ok(());
    }
    let longitude = unwrap(&longitude);
    let (first, origin) = (latitude.values()[0], longitude.at(latitude.first_s()));
    let across = 1.0 - ECCENTRICITY_2 * first.sin().powi(2);
    let prime = EQUATOR_M / across.sqrt();
    let meridian = prime * (1.0 - ECCENTRICITY_2) / across;
    let north = latitude.map(|x| meridian * (x - first));
    let east: Vec<f64> = latitude
        .time_s()
        .iter()
        .map(|&t| prime * first.cos() * (longitude.at(t) - origin))
        .collect();
    recording.insert(Quantity::Position(World::East), latitude.with_values("position.east", east)?);
    recording.insert(Quantity::Position(World::North), north);
    Ok(())
}

/// Converts velocity over ground, along the world's axes or by speed and course, to that of the
/// vehicle's origin along its own axes, where no instrument measured that.
pub(super) fn velocities(
    recording: &mut Recording,
    sensors: &Sensors,
    attitude: &AttitudeRecord,
    nav: &mut Navigated,
) -> Result<(), Error> {
    let mut world = |way| recording.remove(&Quantity::WorldVelocity(way));
    let [north, east, down] = [world(World::North), world(World::East), world(World::Down)];
    let by_course = from_course(recording)?;
    let Some([north, east]) = north.zip(east).map(<[Timed; 2]>::from).or(by_course) else {
        return Ok(());
    };
    if attitude.heading.is_none() {
        let message = "velocity over ground is logged without heading, so that it cannot be split into forward and sideways velocity; map attitude.heading";
        nav.caveats.push(Caveat::warning(CaveatCode::Navigation, message));
        return Ok(());
    }
    let lever = sensors.position.position_body;
    let mut reader = attitude.reader();
    let mut parts = [Vec::new(), Vec::new(), Vec::new()];
    for (&t, &north) in north.time_s().iter().zip(north.values()) {
        let down = down.as_ref().map_or(0.0, |down| down.at(t));
        let over_ground = reader.at(t).inverse() * Vector3::new(north, east.at(t), down);
        let turning = nav.rates.as_ref().map_or(Vector3::zeros(), |rates| {
            Vector3::from_iterator(rates.iter().map(|rate| rate.at(t))).cross(&lever)
        });
        let body = over_ground - turning;
        parts.iter_mut().zip(body.iter()).for_each(|(part, x)| part.push(*x));
    }
    let known = if down.is_some() { 3 } else { 2 };
    for (dof, values) in TRANSLATIONS.into_iter().zip(parts).take(known) {
        if let Entry::Vacant(place) = nav.measured.entry(dof) {
            place.insert(north.with_values("velocity over ground", values)?);
            nav.is_turned = true;
            if lever.norm() > 0.0 {
                nav.levers.insert(dof, lever);
            }
        }
    }
    Ok(())
}

/// Returns `[v cos χ, v sin χ]` of speed and course over ground.
fn from_course(recording: &mut Recording) -> Result<Option<[Timed; 2]>, Error> {
    let speed = recording.remove(&Quantity::GroundSpeed);
    let course = recording.remove(&Quantity::GroundCourse);
    let Some((speed, course)) = speed.zip(course) else { return Ok(None) };
    let course = unwrap(&course);
    let along = |part: fn(f64) -> f64| {
        let pairs = speed.time_s().iter().zip(speed.values());
        let values = pairs.map(|(&t, v)| v * part(course.at(t))).collect();
        speed.with_values("velocity over ground", values)
    };
    Ok(Some([along(f64::cos)?, along(f64::sin)?]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigation::navigate;
    use crate::quantity::{Attitude, Axis};
    use crate::{Dof, Sensor};

    fn series(f: impl Fn(f64) -> f64) -> Timed {
        let t: Vec<f64> = (0..100).map(|k| 0.1 * f64::from(k)).collect();
        let x = t.iter().map(|&t| f(t)).collect::<Vec<_>>();
        Timed::new("test", t, x).expect("valid")
    }

    #[test]
    fn a_minute_of_latitude_is_about_a_nautical_mile() {
        let minute = (1.0_f64 / 60.0).to_radians();
        let mut recording = Recording::from([
            (Quantity::Latitude, series(|t| 45_f64.to_radians() + minute * t / 9.9)),
            (Quantity::Longitude, series(|t| 0.1 + minute * t / 9.9)),
        ]);
        positions(&mut recording).expect("both");
        let last = |way| recording[&Quantity::Position(way)].values()[99];
        // WGS 84 at 45°: 1852.2 m to the minute north, 1314.2 m east.
        assert!((last(World::North) - 1852.2).abs() < 0.2, "{}", last(World::North));
        assert!((last(World::East) - 1314.2).abs() < 0.2, "{}", last(World::East));
    }

    #[test]
    fn a_drifting_ship_has_sway_by_course_and_heading() {
        // Heading east, course south-east: half of the speed squared is ahead, half to starboard.
        let recording = Recording::from([
            (Quantity::Attitude(Attitude::Heading), series(|_| 90_f64.to_radians())),
            (Quantity::GroundSpeed, series(|_| 2.0)),
            (Quantity::GroundCourse, series(|_| 135_f64.to_radians())),
            (Quantity::Rate(Axis::Z), series(|_| 0.1)),
        ]);
        let sensors = Sensors {
            position: Sensor { position_body: Vector3::new(5.0, 0.0, 0.0), ..Default::default() },
            ..Default::default()
        };
        let nav = navigate("drift", &recording, &sensors).expect("complete");
        let surge = nav.measured[&Dof::Surge].values()[50];
        let sway = nav.measured[&Dof::Sway].values()[50];
        let half = 2.0 / 2_f64.sqrt();
        // The antenna is 5 m ahead of the origin of a ship that turns at 0.1 rad/s.
        assert!(
            (surge - half).abs() < 1e-9 && (sway - (half - 0.5)).abs() < 1e-9,
            "{surge} {sway}"
        );
    }
}
