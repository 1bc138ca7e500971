//! Standard manoeuvres of a ship from its plant, with intervals by the uncertainty of its
//! coefficients.

use nalgebra::Vector6;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::draws::band;
use super::{Draws, Drive, PlantModel};
use crate::motion::{Inputs, simulate};
use crate::plant::Plant;
use crate::{Error, Timed, parallel};

/// A standard manoeuvre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Manoeuvre {
    /// The rudder is turned to an angle and held.
    TurningCircle {
        /// Rudder angle, rad.
        angle: f64,
    },
    /// The rudder is reversed each time the heading has changed by an angle.
    Zigzag {
        /// Rudder angle, rad.
        angle: f64,
        /// Change of heading, rad.
        heading: f64,
    },
    /// Thrust is stopped or reversed until the ship stops.
    Stop,
}

/// A number from a manoeuvre.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ManoeuvreNumber {
    /// Its name: `advance`, `first overshoot`.
    pub name: String,
    /// The value for the estimated plant.
    pub value: f64,
    /// Its 95 % interval, if the uncertainty of the coefficients is known.
    pub interval95: Option<[f64; 2]>,
    /// Its unit.
    pub unit: String,
}

/// The conditions of a manoeuvre.
#[derive(Clone, Debug, PartialEq)]
pub struct Approach {
    /// Name of the rudder.
    pub rudder: String,
    /// Its rate, rad/s.
    pub rudder_rate: f64,
    /// Thrusters and forces during the manoeuvre; propellers already run at these inputs when it
    /// begins.
    pub drive: Drive,
    /// Initial forward speed, m/s.
    pub speed: f64,
    /// Largest duration of the simulation, s.
    pub longest_s: f64,
}

/// Least rudder rate required by SOLAS, rad/s: 65° in 28 s.
pub const SOLAS_RUDDER_RATE: f64 = 65.0 / 28.0 * std::f64::consts::PI / 180.0;

impl Default for Approach {
    fn default() -> Self {
        Self {
            rudder: String::new(),
            rudder_rate: SOLAS_RUDDER_RATE,
            drive: Drive::default(),
            speed: 0.0,
            longest_s: 0.0,
        }
    }
}

/// Time step of a manoeuvre, s.
const STEP_S: f64 = 0.1;

/// Number of executes of a zigzag.
const EXECUTES: usize = 5;

/// Speed below which a ship has stopped, m/s.
const STANDING: f64 = 0.01;

/// The path of a ship: time, north, east, heading, forward speed.
struct Path {
    time_s: Vec<f64>,
    north: Vec<f64>,
    east: Vec<f64>,
    heading: Vec<f64>,
    surge: Vec<f64>,
}

impl PlantModel {
    /// Computes the numbers of a manoeuvre: advance, transfer and tactical diameter of a turning
    /// circle, overshoots of a zigzag, distance and time to stop; lengths in m, angles in rad.
    ///
    /// Initially the ship heads north at `approach.speed`, its rudder amidships. A zigzag turns the
    /// rudder first to `angle`, and then against the turn, for either sign of the rudder's effect.
    ///
    /// # Errors
    /// As [`simulate`]; [`Error::Fin`] if the plant has no such rudder, or its rate is not
    /// positive; [`Error::Plant`] if the ship does not turn or stop within the time limit.
    pub fn manoeuvre(
        &self,
        manoeuvre: Manoeuvre,
        approach: &Approach,
        draws: Draws,
    ) -> Result<Vec<ManoeuvreNumber>, Error> {
        if !(approach.rudder_rate > 0.0 && approach.rudder_rate.is_finite()) {
            let (what, name) = ("rudder", approach.rudder.clone());
            let reason = format!("turns at {} rad/s; give a rate above zero", approach.rudder_rate);
            return Err(Error::Fin { what, name, reason });
        }
        let own = self.numbers(&self.plant, manoeuvre, approach)?;
        let plants = self.draws(draws)?;
        let runs =
            parallel::map(&plants, |plant: &Plant| self.numbers(plant, manoeuvre, approach).ok());
        let runs: Vec<_> = runs.into_iter().flatten().collect();
        let number = |(k, (name, value, unit)): (usize, (String, f64, &'static str))| {
            let all: Vec<f64> =
                runs.iter().filter_map(|run| run.get(k)).map(|(_, value, _)| *value).collect();
            let interval95 = (!all.is_empty()).then(|| band(all));
            ManoeuvreNumber { name, value, interval95, unit: unit.to_owned() }
        };
        Ok(own.into_iter().enumerate().map(number).collect())
    }

    fn numbers(
        &self,
        plant: &Plant,
        manoeuvre: Manoeuvre,
        approach: &Approach,
    ) -> Result<Vec<(String, f64, &'static str)>, Error> {
        match manoeuvre {
            Manoeuvre::TurningCircle { angle } => {
                let path = self.path(plant, approach, &[(0.0, angle)])?;
                let right = std::f64::consts::FRAC_PI_2;
                let (quarter, half) =
                    (self.index_of_turn(&path, right)?, self.index_of_turn(&path, 2.0 * right)?);
                Ok(vec![
                    ("advance".to_owned(), path.north[quarter], "m"),
                    ("transfer".to_owned(), path.east[quarter].abs(), "m"),
                    ("tactical diameter".to_owned(), path.east[half].abs(), "m"),
                    ("time to turn 90°".to_owned(), path.time_s[quarter], "s"),
                ])
            }
            Manoeuvre::Zigzag { angle, heading } => self.zigzag(plant, approach, angle, heading),
            Manoeuvre::Stop => {
                let path = self.path(plant, approach, &[])?;
                let stands = path.surge.iter().position(|u| *u < STANDING);
                let stands = stands.ok_or_else(|| self.too_long("stop", approach))?;
                Ok(vec![
                    ("way to stop".to_owned(), path.north[stands].hypot(path.east[stands]), "m"),
                    ("time to stop".to_owned(), path.time_s[stands], "s"),
                ])
            }
        }
    }

    /// Simulates a zigzag; each execute follows from the motion after those before it.
    fn zigzag(
        &self,
        plant: &Plant,
        approach: &Approach,
        angle: f64,
        heading: f64,
    ) -> Result<Vec<(String, f64, &'static str)>, Error> {
        let rudder_sign = self.rudder_sign(plant, approach, angle, heading)?;
        let mut orders = vec![(0.0, angle)];
        let mut numbers = Vec::new();
        for execute in 1..=EXECUTES {
            let path = self.path(plant, approach, &orders)?;
            let (since, order) = orders[orders.len() - 1];
            let side = rudder_sign * order.signum();
            let is_there =
                |k: &usize| path.time_s[*k] > since && side * path.heading[*k] >= heading;
            let Some(at) = (0..path.time_s.len()).find(is_there) else {
                return Err(self.too_long("reach the heading of its zigzag", approach));
            };
            if execute == 1 {
                numbers.push(("time to the second execute".to_owned(), path.time_s[at], "s"));
            }
            orders.push((path.time_s[at], -order));
            let after = self.path(plant, approach, &orders)?;
            // The greatest heading before the ship swings back.
            let back = (at..after.time_s.len())
                .find(|k| *k > at && side * after.heading[*k] < side * after.heading[*k - 1])
                .ok_or_else(|| self.too_long("swing back in its zigzag", approach))?;
            let over = side * after.heading[back - 1] - heading;
            numbers.push((format!("overshoot {execute}"), over, "rad"));
        }
        Ok(numbers)
    }

    /// Returns 1 if a positive rudder angle turns the ship to starboard, −1 if to port: by the
    /// difference between an angle and its opposite, which is independent of wind.
    fn rudder_sign(
        &self,
        plant: &Plant,
        approach: &Approach,
        angle: f64,
        heading: f64,
    ) -> Result<f64, Error> {
        let [one, other] = [
            self.path(plant, approach, &[(0.0, angle)])?,
            self.path(plant, approach, &[(0.0, -angle)])?,
        ];
        let apart = |k: &usize| one.heading[*k] - other.heading[*k];
        let found = (0..one.heading.len()).find(|k| apart(k).abs() >= heading);
        let found = found.ok_or_else(|| self.too_long("answer its rudder", approach))?;
        Ok(apart(&found).signum() * angle.signum())
    }

    /// Returns the index of the first instant at which the ship has turned by an angle.
    fn index_of_turn(&self, path: &Path, by: f64) -> Result<usize, Error> {
        let found = path.heading.iter().position(|heading| heading.abs() >= by);
        found.ok_or_else(|| {
            let seconds = path.time_s.last().copied().unwrap_or(0.0);
            let reason = format!(
                "it does not turn by {:.0}° in {seconds:.0} s; give more time, more rudder or more speed",
                by.to_degrees()
            );
            Error::Plant { axes: self.plant.structure().name(), reason }
        })
    }

    fn too_long(&self, what: &str, approach: &Approach) -> Error {
        let reason = format!(
            "it does not {what} in {:.0} s; give more time, or change the manoeuvre",
            approach.longest_s
        );
        Error::Plant { axes: self.plant.structure().name(), reason }
    }

    /// Simulates the path under orders `(time, angle)` of the rudder.
    fn path(
        &self,
        plant: &Plant,
        approach: &Approach,
        orders: &[(f64, f64)],
    ) -> Result<Path, Error> {
        let mut drive = Drive { already_turning: true, ..approach.drive.clone() };
        if !orders.is_empty() {
            let turned = rudder_angle(orders, approach.rudder_rate)?;
            drive.angles.insert(approach.rudder.clone(), turned);
        }
        let rows = (approach.longest_s / STEP_S).ceil().max(1.0) as usize;
        let time_s: Vec<f64> = (0..=rows).map(|k| STEP_S * k as f64).collect();
        let inputs = Inputs {
            force: self.forces(&drive, approach.longest_s)?,
            signals: self.signals(&drive)?,
            wind: drive.wind.clone(),
            ..Inputs::default()
        };
        let start = Vector6::new(approach.speed, 0.0, 0.0, 0.0, 0.0, 0.0);
        let moved = simulate(plant, &inputs, &start, &time_s)?;
        let heading = crate::navigation::unwrap(&Timed::new(
            "heading",
            time_s.clone(),
            moved.attitude.iter().map(|angles| angles[2]).collect::<Vec<_>>(),
        )?);
        let (north, east) = moved.position.iter().map(|at| (at.x, at.y)).unzip();
        let surge = moved.velocity.iter().map(|v| v[0]).collect();
        Ok(Path { time_s, north, east, heading: heading.values().to_vec(), surge })
    }
}

/// Returns the rudder angle for a series of orders, at a rate, rad/s.
fn rudder_angle(orders: &[(f64, f64)], rate: f64) -> Result<Timed, Error> {
    let (mut times, mut values) = (Vec::new(), Vec::new());
    let mut angle = 0.0_f64;
    for (k, &(from, goal)) in orders.iter().enumerate() {
        if times.last().is_none_or(|last| from > *last) {
            times.push(from);
            values.push(angle);
        }
        let needed = (goal - angle).abs() / rate;
        let next = orders.get(k + 1).map_or(f64::INFINITY, |(next, _)| *next);
        let lasts = needed.min(next - from);
        angle += (goal - angle).signum() * rate * lasts;
        if lasts > 0.0 {
            times.push(from + lasts);
            values.push(angle);
        }
    }
    Timed::new("rudder", times, values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exchange::PlantFile;

    fn ship() -> PlantModel {
        ship_with_axis(-1.0)
    }

    /// Returns a ship whose rudder rotates about z times a sign.
    fn ship_with_axis(z: f64) -> PlantModel {
        let foil = serde_json::json!({
            "kind": "rudder", "name": "rudder", "position_m": [-1.5, 0.0, 0.0],
            "axis": [0.0, 0.0, z], "stall_rad": null
        });
        let x = |value: f64| serde_json::json!({ "value": value, "std": 0.02 * value.abs() });
        let file: PlantFile = serde_json::from_value(serde_json::json!({
            "schema": "seaplant/plant/1", "name": "ship", "source": "worked by hand",
            "axes": ["surge", "sway", "yaw"],
            "effects": [{ "name": "rudder.lift", "force": { "kind": "lift", "foil": foil } }],
            "coefficients": {
                "mass.surge": x(260.0), "mass.sway": x(420.0), "mass.yaw": x(180.0),
                "surge: u": x(8.0), "surge: |u|u": x(10.0), "sway: v": x(150.0),
                "yaw: r": x(200.0), "rudder.lift": x(60.0)
            }
        }))
        .expect("a table");
        file.model().expect("possible")
    }

    fn approach() -> Approach {
        let mut drive = Drive::default();
        let thrust = Timed::new("thrust", vec![0.0], vec![18.0]).expect("valid");
        drive.wrench.insert(crate::Dof::Surge, thrust);
        let rudder = "rudder".to_owned();
        Approach { rudder, drive, speed: 1.0, longest_s: 400.0, ..Approach::default() }
    }

    #[test]
    fn a_circle_to_port_mirrors_that_to_starboard() {
        let ship = ship();
        let draws = Draws { count: 20, seed: 1 };
        let numbers = |angle: f64| {
            let circle = Manoeuvre::TurningCircle { angle };
            ship.manoeuvre(circle, &approach(), draws).expect("it turns")
        };
        let (starboard, port) = (numbers(0.6), numbers(-0.6));
        for (a, b) in starboard.iter().zip(&port) {
            assert!((a.value - b.value).abs() < 1e-6 * a.value, "{a:?} {b:?}");
            let [low, high] = a.interval95.expect("drawn");
            assert!(low < a.value && a.value < high, "{a:?}");
        }
        let value_of = |name: &str| starboard.iter().find(|x| x.name == name).expect(name).value;
        assert!(value_of("transfer") < value_of("tactical diameter"));
    }

    #[test]
    fn a_zigzag_swings_over_and_a_ship_without_thrust_stops() {
        let ship = ship();
        let none = Draws { count: 0, seed: 1 };
        let (angle, heading) = (10_f64.to_radians(), 10_f64.to_radians());
        let zigzag = ship.manoeuvre(Manoeuvre::Zigzag { angle, heading }, &approach(), none);
        let zigzag = zigzag.expect("it swings");
        assert_eq!(zigzag.len(), 1 + EXECUTES);
        assert!(zigzag.iter().all(|x| x.value > 0.0), "{zigzag:?}");
        let idle = Approach { drive: Drive::default(), ..approach() };
        let stop = ship.manoeuvre(Manoeuvre::Stop, &idle, none).expect("it stops");
        // m u̇ = −d u − d_Q u²: x = m/d_Q ln((d + d_Q u₀)/(d + d_Q u₁)).
        let expected = 260.0 / 10.0 * ((8.0 + 10.0) / (8.0 + 10.0 * STANDING)).ln();
        assert!((stop[0].value - expected).abs() < 0.01 * expected, "{stop:?}");
    }

    #[test]
    fn a_zigzag_is_the_same_with_a_rudder_of_opposite_sign() {
        let none = Draws { count: 0, seed: 1 };
        let zigzag = |ship: &PlantModel, angle: f64| {
            let manoeuvre = Manoeuvre::Zigzag { angle, heading: 0.2 };
            ship.manoeuvre(manoeuvre, &approach(), none).expect("it swings")
        };
        let usual = zigzag(&ship(), 0.2);
        for other in [zigzag(&ship_with_axis(1.0), 0.2), zigzag(&ship_with_axis(1.0), -0.2)] {
            for (a, b) in usual.iter().zip(&other) {
                assert!((a.value - b.value).abs() < 1e-9, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn a_faster_rudder_overshoots_less_and_none_is_refused() {
        let none = Draws { count: 0, seed: 1 };
        let manoeuvre = Manoeuvre::Zigzag { angle: 0.2, heading: 0.2 };
        let overshoot = |rudder_rate: f64| {
            let approach = Approach { rudder_rate, ..approach() };
            Ok::<f64, Error>(ship().manoeuvre(manoeuvre, &approach, none)?[1].value)
        };
        let rates = [SOLAS_RUDDER_RATE, 0.3].map(|rate| overshoot(rate).expect("it swings"));
        assert!(rates[1] < rates[0], "{rates:?}");
        // 2 s to 0.1 rad, and from 3 s on 4 s to the other side.
        let turned = rudder_angle(&[(0.0, 0.1), (3.0, -0.1)], 0.05).expect("orders");
        let angles = [1.0, 2.5, 5.0, 9.0].map(|t| turned.at(t));
        for (found, expected) in angles.into_iter().zip([0.05, 0.1, 0.0, -0.1]) {
            assert!((found - expected).abs() < 1e-12, "{angles:?}");
        }
        assert!(overshoot(0.0).expect_err("it stands").to_string().contains("above zero"));
    }

    #[test]
    fn refuses_an_unknown_rudder() {
        let other = Approach { rudder: "helm".to_owned(), ..approach() };
        let circle = Manoeuvre::TurningCircle { angle: 0.3 };
        let error = ship().manoeuvre(circle, &other, Draws::default()).expect_err("no helm");
        assert!(error.to_string().contains("no such rudder or fin; it has rudder"), "{error}");
    }
}
