//! The vehicle: the positions and curves of its thrusters, and the positions of its instruments.

mod actuators;
mod velocity_sensor;

use nalgebra::{Rotation3, Unit, Vector3};

pub use actuators::{Fin, PropellerCurve, VehicleEffect, Windage};
pub use velocity_sensor::VelocitySensor;

use crate::plant::{Buoyancy, RigidBody};
use crate::{Dof, Error, ThrustCurve};

/// A thruster, in the body frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Thruster {
    /// Name in channels and messages.
    pub name: String,
    /// Point of application of thrust, m: x forward, y starboard, z down, from the vehicle's
    /// origin.
    pub position_body: Vector3<f64>,
    /// Unit vector of positive thrust.
    pub direction_body: Vector3<f64>,
    /// Thrust as a function of the input.
    pub curve: ThrustCurve,
    /// Uncertainty of the thrust coefficients.
    pub uncertainty: ThrustUncertainty,
    /// Unit vector of the axis of azimuth; `direction_body` is the direction at zero azimuth.
    pub azimuth_axis: Option<Vector3<f64>>,
    /// The open-water curve, if that determines its thrust.
    pub open_water: Option<PropellerCurve>,
}

/// Relative standard deviations of a thruster's coefficients by direction; zero if not stated. The
/// errors of thrusters of one degree of freedom are fully correlated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ThrustUncertainty {
    /// For positive thrust.
    pub forward: f64,
    /// For negative thrust.
    pub reverse: f64,
}

impl ThrustUncertainty {
    /// Returns the largest uncertainty of several thrusters, by direction.
    pub(crate) fn greatest(all: impl Iterator<Item = Self>) -> Self {
        all.fold(Self::default(), |all, one| Self {
            forward: all.forward.max(one.forward),
            reverse: all.reverse.max(one.reverse),
        })
    }
}

impl Thruster {
    /// Checks and creates a thruster; `direction` may have any length but zero.
    ///
    /// # Errors
    /// [`Error::Thruster`] if the direction is zero or a number is not finite.
    pub fn new(
        name: &str,
        position_m: [f64; 3],
        direction: [f64; 3],
        curve: ThrustCurve,
    ) -> Result<Self, Error> {
        let refuse = |reason| Error::Thruster { name: name.to_owned(), reason };
        let direction_body = Vector3::from(direction);
        if !position_m.iter().chain(&direction).all(|x| x.is_finite()) {
            return Err(refuse("its position or direction is not finite".to_owned()));
        }
        let length = direction_body.norm();
        if length == 0.0 {
            return Err(refuse("its direction is [0, 0, 0]; give the way it pushes".to_owned()));
        }
        Ok(Self {
            name: name.to_owned(),
            position_body: position_m.into(),
            direction_body: direction_body / length,
            curve,
            uncertainty: ThrustUncertainty::default(),
            azimuth_axis: None,
            open_water: None,
        })
    }

    /// Returns an azimuth thruster that rotates about an axis by `thruster.NAME.azimuth`.
    ///
    /// # Errors
    /// [`Error::Thruster`] if the axis is zero, not finite, or parallel to thrust.
    pub fn turned_about(self, axis: [f64; 3]) -> Result<Self, Error> {
        let length = Vector3::from(axis).norm();
        let is_axis = length > 0.0 && length.is_finite();
        let axis = Vector3::from(axis) / length;
        if is_axis && axis.cross(&self.direction_body).norm() > LEAST_TURN {
            return Ok(Self { azimuth_axis: Some(axis), ..self });
        }
        let reason = "its azimuth_axis must not be zero nor the way that it pushes; give what it turns about, such as [0, 0, 1]";
        Err(Error::Thruster { name: self.name, reason: reason.to_owned() })
    }

    /// Returns the thruster at a fixed azimuth, rad.
    pub fn at_azimuth(&self, azimuth: f64) -> Self {
        let Some(axis) = self.azimuth_axis else { return self.clone() };
        let turned = Rotation3::from_axis_angle(&Unit::new_normalize(axis), azimuth);
        Self { direction_body: turned * self.direction_body, ..self.clone() }
    }

    /// Returns the thruster with an uncertainty of its coefficients.
    ///
    /// # Errors
    /// [`Error::Thruster`] unless both parts are from 0 to below 1.
    pub fn with_uncertainty(self, uncertainty: ThrustUncertainty) -> Result<Self, Error> {
        let ThrustUncertainty { forward, reverse } = uncertainty;
        if [forward, reverse].iter().all(|part| (0.0..1.0).contains(part)) {
            return Ok(Self { uncertainty, ..self });
        }
        let reason = format!(
            "its thrust uncertainty is {forward} forward and {reverse} in reverse; give parts of thrust from 0 to below 1, such as 0.05 for 5 %"
        );
        Err(Error::Thruster { name: self.name, reason })
    }

    /// Returns the wrench for one newton of thrust: `[d; r × d]`, N and N m, shape (6,).
    pub fn unit_wrench(&self) -> [f64; 6] {
        let d = self.direction_body;
        let moment = self.position_body.cross(&d);
        [d.x, d.y, d.z, moment.x, moment.y, moment.z]
    }
}

/// Least sine of the angle between azimuth axis and thrust.
const LEAST_TURN: f64 = 1e-3;

/// Position, alignment and noise of an instrument.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sensor {
    /// Position, m, body frame.
    pub position_body: Vector3<f64>,
    /// Roll, pitch and yaw that rotate the vehicle's axes to the instrument's, rad.
    pub rotation_rad: [f64; 3],
    /// Standard deviation of one sample: m/s, m or rad.
    pub std: Option<f64>,
}

impl Sensor {
    /// Returns `R_bs`, which rotates a vector from the instrument's frame to the body's.
    pub fn to_body(&self) -> Rotation3<f64> {
        let [roll, pitch, yaw] = self.rotation_rad;
        Rotation3::from_euler_angles(roll, pitch, yaw)
    }
}

/// The instruments of a vehicle; an instrument without description is at the origin, aligned.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sensors {
    /// Doppler velocity log: std in m/s.
    pub dvl: Sensor,
    /// Depth sensor: std in m.
    pub depth: Sensor,
    /// Roll, pitch, heading: std in rad.
    pub attitude: Sensor,
    /// Positioning antenna, beacon or marker: std in m.
    pub position: Sensor,
    /// Accelerometer: std in m/s².
    pub imu: Sensor,
    /// True if each logged sample of the accelerometer is the mean since the one before, instead of
    /// an instantaneous value.
    pub imu_averages: bool,
}

/// A marine vehicle with known thrusters.
#[derive(Clone, Debug, PartialEq)]
pub struct Vehicle {
    /// Name of the vehicle.
    pub name: String,
    /// Mass in air, kg, without added mass.
    pub dry_mass_kg: Option<f64>,
    /// Length, width and height of the hull, m.
    pub size_m: Option<[f64; 3]>,
    /// Draught of the hull, m, which makes ship coefficients dimensionless.
    pub draught_m: Option<f64>,
    /// The rigid body, if known, for plants of several axes.
    pub rigid_body: Option<RigidBody>,
    /// Displacement and centre of buoyancy, if known.
    pub buoyancy: Option<Buoyancy>,
    /// Thrusters with known curves.
    pub thrusters: Vec<Thruster>,
    /// Thrusters whose coefficients are estimated, by plants of several axes: only the input of
    /// their curves is used.
    pub propellers: Vec<Thruster>,
    /// Rudders and fins.
    pub fins: Vec<Fin>,
    /// Areas exposed to wind; without them, forces per squared wind speed are estimated.
    pub windage: Option<Windage>,
    /// Density of the water, kg/m³.
    pub water_density_kg_m3: f64,
    /// All instruments.
    pub sensors: Sensors,
}

impl Default for Vehicle {
    fn default() -> Self {
        Self {
            name: String::new(),
            dry_mass_kg: None,
            size_m: None,
            draught_m: None,
            rigid_body: None,
            buoyancy: None,
            thrusters: Vec::new(),
            propellers: Vec::new(),
            fins: Vec::new(),
            windage: None,
            water_density_kg_m3: SEA_WATER_KG_M3,
            sensors: Sensors::default(),
        }
    }
}

/// Density of sea water, kg/m³.
pub const SEA_WATER_KG_M3: f64 = 1025.0;

impl Vehicle {
    /// Returns the projected area of the hull's bounding box in the direction of a translation, m².
    ///
    /// ```
    /// use seaplant::{Dof, Vehicle};
    /// let vehicle = Vehicle { size_m: Some([3.4, 2.2, 2.4]), ..Vehicle::default() };
    /// assert!((vehicle.frontal_area_m2(Dof::Heave).unwrap() - 3.4 * 2.2).abs() < 1e-12);
    /// assert_eq!(vehicle.frontal_area_m2(Dof::Yaw), None);
    /// ```
    pub fn frontal_area_m2(&self, dof: Dof) -> Option<f64> {
        let [length, width, height] = self.size_m?;
        match dof {
            Dof::Surge => Some(width * height),
            Dof::Sway => Some(length * height),
            Dof::Heave => Some(length * width),
            Dof::Roll | Dof::Pitch | Dof::Yaw => None,
        }
    }

    /// Returns whether the thruster acts on a degree of freedom at some azimuth.
    pub fn acts_on(thruster: &Thruster, dof: Dof) -> bool {
        // A lever arm below a micrometre is the rounding of a rotated position.
        let acts = |thruster: &Thruster| thruster.unit_wrench()[dof.index()].abs() > 1e-6;
        acts(thruster)
            || thruster.azimuth_axis.is_some()
                && [0.7, 2.3].into_iter().any(|azimuth| acts(&thruster.at_azimuth(azimuth)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{QuadraticThrust, ThrusterInput};

    fn curve() -> ThrustCurve {
        ThrustCurve::Quadratic { input: ThrusterInput::Speed, law: QuadraticThrust::default() }
    }

    #[test]
    fn a_thruster_to_port_pushing_forward_turns_the_bow_to_starboard() {
        let port = Thruster::new("port", [0.0, -0.5, 0.0], [2.0, 0.0, 0.0], curve()).expect("ok");
        assert_eq!(port.unit_wrench(), [1.0, 0.0, 0.0, 0.0, 0.0, 0.5]);
    }

    #[test]
    fn lift_of_the_hull_is_tried_along_axes_that_no_thruster_pushes() {
        let thruster = |name: &str, direction: [f64; 3]| {
            Thruster::new(name, [-0.8, 0.0, 0.0], direction, curve()).expect("ok")
        };
        let lifts = |vehicle: &Vehicle| -> Vec<(Dof, f64)> {
            vehicle.effects().iter().filter_map(|known| known.effect.hull_lift()).collect()
        };
        let ahead = thruster("ahead", [1.0, 0.0, 0.0]);
        let mut vehicle = Vehicle { thrusters: vec![ahead], ..Vehicle::default() };
        let parts = [1.0, 0.75, 0.5, 0.25, 0.0, -0.25, -0.5, -0.75, -1.0];
        let along = |dof: Dof| parts.map(|part| (dof, 0.8 * part));
        assert_eq!(lifts(&vehicle), [along(Dof::Sway), along(Dof::Heave)].concat());
        vehicle.thrusters.push(thruster("down", [0.1, 0.0, 1.0]));
        assert_eq!(lifts(&vehicle), along(Dof::Sway));
        vehicle.thrusters.push(thruster("across", [0.0, 1.0, 0.0]));
        assert_eq!(lifts(&vehicle), []);
    }

    #[test]
    fn a_sensor_rotated_by_45_degrees_measures_forward_motion_on_both_axes() {
        let dvl = Sensor { rotation_rad: [0.0, 0.0, 45_f64.to_radians()], ..Default::default() };
        let seen = dvl.to_body().inverse() * Vector3::x();
        assert!((seen - Vector3::new(0.5_f64.sqrt(), -(0.5_f64.sqrt()), 0.0)).norm() < 1e-12);
    }

    #[test]
    fn refuses_a_thruster_without_direction() {
        let refused = Thruster::new("port", [0.0; 3], [0.0; 3], curve());
        assert!(refused.expect_err("no direction").to_string().contains("thruster `port`"));
    }
}
