//! The twin's thrusters and instruments: the true ones, and those of the analyst.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::{Disturbance, NoiseLevel, TwinSpec};
use crate::{
    Dof, Error, QuadraticThrust, Sensor, Sensors, ThrustCurve, Thruster, ThrusterInput, Vehicle,
};

/// The degrees of freedom that thrusters drive.
pub(super) const DRIVEN: [Dof; 4] = [Dof::Surge, Dof::Sway, Dof::Heave, Dof::Yaw];

/// Arm of the lateral thrusters in yaw, m.
pub(super) const YAW_ARM_M: f64 = 1.1;

/// Name, position (m) and direction of each thruster. The fore-aft pair is abreast, so that equal
/// thrusts have no moment.
type Mount = (&'static str, [f64; 3], [f64; 3]);
const THRUSTERS: [Mount; 6] = [
    ("fore-aft port", [-1.0, -0.6, 0.0], [1.0, 0.0, 0.0]),
    ("fore-aft starboard", [-1.0, 0.6, 0.0], [1.0, 0.0, 0.0]),
    ("lateral fore", [YAW_ARM_M, 0.0, 0.0], [0.0, 1.0, 0.0]),
    ("lateral aft", [-YAW_ARM_M, 0.0, 0.0], [0.0, 1.0, 0.0]),
    ("vertical port", [0.0, -0.5, 0.0], [0.0, 0.0, 1.0]),
    ("vertical starboard", [0.0, 0.5, 0.0], [0.0, 0.0, 1.0]),
];

const DVL_POSITION_M: [f64; 3] = [0.5, 0.0, 0.8];
const DVL_YAW_DEG: f64 = 45.0;
const DEPTH_POSITION_M: [f64; 3] = [-0.3, 0.0, -0.4];

/// Resolution of the depth sensor, m [Jason2, table 3].
pub(super) const DEPTH_QUANTUM_M: f64 = 0.07;

/// Standard deviation of roll and pitch, rad [Jason2, table 3].
const TILT_STD_RAD: f64 = 0.1 * TAU / 360.0;

/// Standard deviations of one sample of each instrument.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InstrumentNoise {
    /// Each axis of the DVL, m/s.
    pub(super) dvl: f64,
    /// Heading, rad.
    pub(super) heading: f64,
    /// Roll and pitch, rad.
    pub(super) tilt: f64,
    /// Depth before rounding, m.
    pub(super) depth: f64,
    /// Angular velocity, rad/s, if there is a gyroscope.
    pub(super) gyro: Option<f64>,
}

impl InstrumentNoise {
    pub(super) fn from_level(level: NoiseLevel) -> Self {
        let (dvl, heading_deg, depth) = match level {
            NoiseLevel::Low => (0.3e-3, 0.03_f64, 0.0),
            NoiseLevel::Middle => (3e-3, 0.1, 0.02),
            NoiseLevel::High => (10e-3, 0.3, 0.07),
        };
        Self { dvl, heading: heading_deg.to_radians(), tilt: TILT_STD_RAD, depth, gyro: None }
    }

    /// Returns those of roll, pitch and heading, rad.
    pub(super) fn of_angles(&self) -> [f64; 3] {
        [self.tilt, self.tilt, self.heading]
    }
}

impl TwinSpec {
    /// Returns the true vehicle.
    pub(super) fn true_vehicle(&self) -> Result<Vehicle, Error> {
        self.vehicle(self.thrusters.law(), 0.0)
    }

    /// Returns the vehicle of the analyst.
    ///
    /// Under `thrcoef`, reverse thrust has the forward coefficient; under `lever`, the DVL is
    /// further aft and up by `strength.lever_m` each, so that the lever arm is wrong for surge,
    /// sway and heave.
    pub(super) fn believed_vehicle(&self) -> Result<Vehicle, Error> {
        let mut law = self.thrusters.law();
        if self.has(Disturbance::Thrcoef) {
            law.reverse = law.forward;
        }
        self.vehicle(law, self.strength_of(Disturbance::Lever, self.strength.lever_m))
    }

    fn vehicle(&self, law: QuadraticThrust, dvl_off_m: f64) -> Result<Vehicle, Error> {
        let curve = ThrustCurve::Quadratic { input: ThrusterInput::Speed, law };
        let mount = |(name, position_m, direction): Mount| {
            Thruster::new(name, position_m, direction, curve.clone())
        };
        let noise = InstrumentNoise::from_level(self.noise);
        // Rounding to a quantum is uniform noise of that width.
        let depth_std = noise.depth.hypot(DEPTH_QUANTUM_M / 12_f64.sqrt());
        let sensor = |position_m: [f64; 3], std| Sensor {
            position_body: position_m.into(),
            rotation_rad: [0.0; 3],
            std: Some(std),
        };
        let mut dvl = sensor(DVL_POSITION_M, noise.dvl);
        dvl.position_body -= Vector3::new(dvl_off_m, 0.0, dvl_off_m);
        dvl.rotation_rad[2] = DVL_YAW_DEG.to_radians();
        Ok(Vehicle {
            name: self.name.clone(),
            dry_mass_kg: Some(self.dry_mass_kg),
            size_m: self.size_m,
            rigid_body: None,
            buoyancy: None,
            thrusters: THRUSTERS.into_iter().map(mount).collect::<Result<_, _>>()?,
            sensors: Sensors {
                dvl,
                depth: sensor(DEPTH_POSITION_M, depth_std),
                attitude: sensor([0.0; 3], noise.heading),
                position: Sensor::default(),
                imu: match &self.accelerometer {
                    Some(imu) => sensor(imu.position_m, imu.noise),
                    None => Sensor::default(),
                },
                imu_averages: false,
            },
            ..Vehicle::default()
        })
    }

    pub(super) fn has(&self, disturbance: Disturbance) -> bool {
        self.disturbances.contains(&disturbance)
    }

    /// Returns a disturbance's strength, or zero if it is disabled.
    pub(super) fn strength_of(&self, disturbance: Disturbance, strength: f64) -> f64 {
        if self.has(disturbance) { strength } else { 0.0 }
    }

    /// Returns the lever arm of a force at the thrusters' position: 1, or in yaw the arm, m.
    pub(super) fn arm(dof: Dof) -> f64 {
        if dof.is_rotation() { YAW_ARM_M } else { 1.0 }
    }

    /// Returns the greatest force of a pair with its propellers in reverse, N or N m.
    pub(super) fn reverse_limit(&self, dof: Dof) -> f64 {
        -2.0 * self.thrusters.law().force(-self.thrusters.max_speed()) * Self::arm(dof)
    }
}

/// Returns the indices of the two thrusters that drive a degree of freedom.
pub(super) fn pair(dof: Dof) -> [usize; 2] {
    match dof {
        Dof::Surge => [0, 1],
        Dof::Heave => [4, 5],
        // The lateral pair turns the vehicle by opposite thrusts; validation refuses roll and
        // pitch.
        Dof::Sway | Dof::Yaw | Dof::Roll | Dof::Pitch => [2, 3],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pair_drives_its_own_degree_of_freedom_alone() {
        let vehicle = TwinSpec::jason2().true_vehicle().expect("valid");
        for dof in DRIVEN {
            let wrenches = pair(dof).map(|at| vehicle.thrusters[at].unit_wrench());
            let weights = wrenches.map(|wrench| wrench[dof.index()]);
            for other in Dof::ALL.into_iter().filter(|other| *other != dof) {
                let leak: f64 =
                    wrenches.iter().zip(weights).map(|(x, w)| w * x[other.index()]).sum();
                assert!(leak.abs() < 1e-12, "{dof} leaks {leak} into {other}");
            }
        }
    }

    #[test]
    fn the_analysts_lever_arm_is_wrong_in_all_translations() {
        let mut spec = TwinSpec::jason2();
        spec.disturbances = Disturbance::parse_list("lever,thrcoef").expect("both are known");
        let believed = spec.believed_vehicle().expect("valid");
        let truth = spec.true_vehicle().expect("valid");
        let lacks = truth.sensors.dvl.position_body - believed.sensors.dvl.position_body;
        assert!((lacks - Vector3::new(0.8, 0.0, 0.8)).norm() < 1e-12);
        let reverse = |vehicle: &Vehicle| vehicle.thrusters[0].curve.force(-100.0, None);
        assert!((reverse(&truth) + 328.0).abs() < 1e-9);
        assert!((reverse(&believed) + 402.0).abs() < 1e-9);
    }
}
