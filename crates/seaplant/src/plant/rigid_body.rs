//! The rigid-body mass matrix, known from measurements in air.

use nalgebra::{Matrix3, Matrix6, Vector3};

use crate::Error;

/// Mass, centre of gravity and inertia of a vehicle in air.
///
/// ```
/// use seaplant::plant::RigidBody;
/// let body = RigidBody::new(13.5, [0.0, 0.0, 0.02], [[0.26, 0.0, 0.0], [0.0, 0.23, 0.0], [0.0, 0.0, 0.37]])?;
/// // Inertia is about the centre of gravity; M_RB is about the vehicle's origin.
/// assert!((body.mass_matrix()[(3, 3)] - (0.26 + 13.5 * 0.02 * 0.02)).abs() < 1e-12);
/// # Ok::<(), seaplant::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidBody {
    mass_kg: f64,
    centre_of_gravity_body: Vector3<f64>,
    inertia: Matrix3<f64>,
}

/// Largest relative asymmetry of an inertia matrix.
const SYMMETRY_PART: f64 = 1e-6;

impl RigidBody {
    /// Checks and creates a rigid body from its mass, kg; its centre of gravity from the vehicle's
    /// origin, m; its inertia about the centre of gravity, kg m².
    ///
    /// # Errors
    /// [`Error::RigidBody`] unless the mass is positive, the inertia symmetric and positive
    /// definite, and no principal moment greater than the sum of the others.
    pub fn new(
        mass_kg: f64,
        centre_of_gravity_m: [f64; 3],
        inertia_kg_m2: [[f64; 3]; 3],
    ) -> Result<Self, Error> {
        let refuse = |reason: String| Error::RigidBody { reason };
        let all = inertia_kg_m2.as_flattened().iter().chain(&centre_of_gravity_m);
        if !all.chain([&mass_kg]).all(|x| x.is_finite()) {
            return Err(refuse("has a number that is not finite".to_owned()));
        }
        if mass_kg <= 0.0 {
            return Err(refuse(format!("has a mass of {mass_kg} kg; give one above zero")));
        }
        let inertia = Matrix3::from_fn(|i, j| inertia_kg_m2[i][j]);
        let scale = inertia.amax();
        if (inertia - inertia.transpose()).amax() > SYMMETRY_PART * scale {
            return Err(refuse(
                "has an inertia that is not symmetric; write each product of inertia in both places"
                    .to_owned(),
            ));
        }
        let mut principal: Vec<f64> = inertia.symmetric_eigenvalues().iter().copied().collect();
        principal.sort_by(f64::total_cmp);
        if principal[0] <= 0.0 {
            return Err(refuse(format!(
                "has a principal moment of inertia of {:.3e} kg m²; no body has one of zero or less",
                principal[0]
            )));
        }
        if principal[2] > (principal[0] + principal[1]) * (1.0 + SYMMETRY_PART) {
            return Err(refuse(format!(
                "has principal moments of inertia {:.4}, {:.4} and {:.4} kg m²; no body has one greater than the sum of the others",
                principal[0], principal[1], principal[2]
            )));
        }
        Ok(Self { mass_kg, centre_of_gravity_body: centre_of_gravity_m.into(), inertia })
    }

    /// Returns `M_RB = [m 1, −m S(r_G); m S(r_G), I_O]` about the vehicle's origin.
    ///
    /// # Source
    /// [Fossen2021, ch. 3].
    pub fn mass_matrix(&self) -> Matrix6<f64> {
        let lever = self.centre_of_gravity_body.cross_matrix();
        let m = self.mass_kg;
        let mut mass = Matrix6::zeros();
        mass.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() * m));
        mass.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-m * lever));
        mass.fixed_view_mut::<3, 3>(3, 0).copy_from(&(m * lever));
        mass.fixed_view_mut::<3, 3>(3, 3).copy_from(&(self.inertia - m * lever * lever));
        mass
    }

    /// Returns mass in air, kg.
    pub fn mass_kg(&self) -> f64 {
        self.mass_kg
    }

    /// Returns inertia about the centre of gravity, kg m², shape (3, 3).
    pub fn inertia(&self) -> Matrix3<f64> {
        self.inertia
    }

    /// Returns the centre of gravity, from the vehicle's origin, m.
    pub fn centre_of_gravity_body(&self) -> Vector3<f64> {
        self.centre_of_gravity_body
    }
}

/// Displacement of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Buoyancy {
    /// The mass of displaced water, kg.
    pub displaced_kg: f64,
    /// The centre of buoyancy, from the vehicle's origin, m.
    pub centre_body: Vector3<f64>,
}

/// Standard gravity, m/s².
pub const GRAVITY: f64 = 9.80665;

impl Buoyancy {
    /// Checks and creates a buoyancy.
    ///
    /// # Errors
    /// [`Error::RigidBody`] unless the displaced mass is positive and all is finite.
    pub fn new(displaced_kg: f64, centre_m: [f64; 3]) -> Result<Self, Error> {
        if !(displaced_kg > 0.0 && displaced_kg.is_finite()) {
            let reason = format!("displaces {displaced_kg} kg of water; give a mass above zero");
            return Err(Error::RigidBody { reason });
        }
        if !centre_m.iter().all(|x| x.is_finite()) {
            let reason = "has a centre of buoyancy that is not finite".to_owned();
            return Err(Error::RigidBody { reason });
        }
        Ok(Self { displaced_kg, centre_body: centre_m.into() })
    }

    /// Returns `W − B`, N, and `W r_G − B r_B`, N m.
    pub fn restoring(&self, body: &RigidBody) -> (f64, Vector3<f64>) {
        let (weight, buoyancy) = (GRAVITY * body.mass_kg, GRAVITY * self.displaced_kg);
        let lever = weight * body.centre_of_gravity_body - buoyancy * self.centre_body;
        (weight - buoyancy, lever)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inertia(x: f64, y: f64, z: f64) -> [[f64; 3]; 3] {
        [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]
    }

    #[test]
    fn a_low_centre_of_gravity_couples_surge_with_pitch() {
        let body = RigidBody::new(13.5, [0.0, 0.0, 0.05], inertia(0.26, 0.23, 0.37)).expect("ok");
        let mass = body.mass_matrix();
        assert!((mass[(0, 4)] - 0.675).abs() < 1e-12 && (mass[(1, 3)] + 0.675).abs() < 1e-12);
        assert!((mass[(3, 3)] - 0.29375).abs() < 1e-12);
    }

    #[test]
    fn refuses_impossible_bodies() {
        let refused = |inertia| RigidBody::new(1.0, [0.0; 3], inertia).expect_err("no").to_string();
        assert!(refused(inertia(1.0, 1.0, 3.0)).contains("sum of the others"));
        assert!(refused(inertia(1.0, 1.0, -1.0)).contains("zero or less"));
        let skew = [[1.0, 0.2, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert!(refused(skew).contains("not symmetric"));
    }
}
