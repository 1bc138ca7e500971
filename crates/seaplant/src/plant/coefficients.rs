//! A plant: a structure with its coefficients.

use nalgebra::{DMatrix, Matrix6, Vector3, Vector6};

use super::{Basis, Product, Structure};
use crate::{Dof, Error};

/// A structure with a coefficient for each of its terms.
///
/// ```
/// use seaplant::Dof;
/// use seaplant::plant::{Plant, Structure, Symmetry};
/// let surge = Structure::of(&[Dof::Surge], Symmetry::None)?;
/// // Mass, linear drag, quadratic drag.
/// let plant = Plant::new(surge, vec![100.0, 5.0, 20.0])?;
/// assert_eq!(plant.mass_matrix()[(0, 0)], 100.0);
/// # Ok::<(), seaplant::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    structure: Structure,
    coefficients: Vec<f64>,
}

impl Plant {
    /// Creates a plant from coefficients in the order of the structure's terms.
    ///
    /// # Errors
    /// [`Error::Plant`] if there is not one for each term, if one is not finite, or if M is
    /// not positive definite.
    pub fn new(structure: Structure, coefficients: Vec<f64>) -> Result<Self, Error> {
        let refuse = |reason: String| Error::Plant { axes: structure.name(), reason };
        if coefficients.len() != structure.terms().len() {
            return Err(refuse(format!(
                "{} coefficients for {} terms; give one for each",
                coefficients.len(),
                structure.terms().len()
            )));
        }
        if let Some(at) = coefficients.iter().position(|x| !x.is_finite()) {
            let name = structure.name_of(&structure.terms()[at]);
            return Err(refuse(format!("{name} is not finite")));
        }
        let plant = Self { structure, coefficients };
        if plant.mass_matrix().cholesky().is_none() {
            let axes = plant.structure.name();
            let reason = "its mass matrix is not positive definite".to_owned();
            return Err(Error::Plant { axes, reason });
        }
        Ok(plant)
    }

    /// Removes effects without a coefficient.
    pub(crate) fn pruned(&self) -> Result<Self, Error> {
        Self::new(self.structure.pruned(), self.coefficients.clone())
    }

    /// Returns its structure.
    pub fn structure(&self) -> &Structure {
        &self.structure
    }

    /// Returns its axes.
    pub fn axes(&self) -> &[Dof] {
        self.structure.axes()
    }

    /// Returns the coefficients of all terms, shape (p,).
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Returns the coefficient of a term; `None` if the structure lacks it.
    pub fn coefficient(&self, term: &Basis) -> Option<f64> {
        Some(self.coefficients[self.structure.index_of(term)?])
    }

    fn with_terms(&self) -> impl Iterator<Item = (&Basis, f64)> {
        self.structure.terms().iter().zip(self.coefficients.iter().copied())
    }

    /// Returns M of the plant's axes, shape (n, n).
    pub fn mass_matrix(&self) -> DMatrix<f64> {
        self.on_axes(&self.mass_matrix_of_six())
    }

    /// Returns M of all six axes, zero where the plant has none; shape (6, 6).
    pub fn mass_matrix_of_six(&self) -> Matrix6<f64> {
        let mut mass = Matrix6::zeros();
        for (term, value) in self.with_terms() {
            if let Basis::Mass(i, j) = term {
                mass[(i.index(), j.index())] = value;
                mass[(j.index(), i.index())] = value;
            }
        }
        mass
    }

    /// Returns D_l, the matrix that multiplies ν, shape (n, n).
    pub fn linear_damping(&self) -> DMatrix<f64> {
        self.damping(|on, of| Product::linear(of) == on)
    }

    /// Returns the matrix that multiplies |ν|ν of each axis, shape (n, n).
    pub fn quadratic_damping(&self) -> DMatrix<f64> {
        self.damping(|on, of| Product::quadratic(of) == on)
    }

    fn damping(&self, is_of: impl Fn(Product, Dof) -> bool) -> DMatrix<f64> {
        let mut damping = Matrix6::zeros();
        for (term, value) in self.with_terms() {
            let Basis::Product(on, product) = term else { continue };
            if let Some(of) = Dof::ALL.into_iter().find(|of| is_of(*product, *of)) {
                damping[(on.index(), of.index())] = value;
            }
        }
        self.on_axes(&damping)
    }

    fn on_axes(&self, all: &Matrix6<f64>) -> DMatrix<f64> {
        let axes = self.axes();
        DMatrix::from_fn(axes.len(), axes.len(), |i, j| all[(axes[i].index(), axes[j].index())])
    }

    /// Returns Σ of all terms without acceleration, which together with M ν̇_r form the left side
    /// of the equation of motion, N and N m, shape (6,); the signals of effects are zero.
    pub fn resistance(&self, velocity: &Vector6<f64>, down_body: &Vector3<f64>) -> Vector6<f64> {
        self.resistance_with(velocity, down_body, &[])
    }

    /// Returns [`Self::resistance`] with the values of the structure's [`Structure::signals`].
    pub fn resistance_with(
        &self,
        velocity: &Vector6<f64>,
        down_body: &Vector3<f64>,
        signals: &[f64],
    ) -> Vector6<f64> {
        let acceleration = Vector6::zeros();
        let at = super::Instant { acceleration, velocity: *velocity, down_body: *down_body };
        let force = |(term, value): (&Basis, f64)| {
            let race = match term {
                Basis::Effect(k) => self.race(*k),
                _ => 0.0,
            };
            value * self.structure.regressor_in_race(term, &at, signals, race)
        };
        self.with_terms().map(force).sum()
    }

    /// Returns the coefficient of the slipstream at a fin over that of its lift; 0 for other effects.
    fn race(&self, effect: usize) -> f64 {
        let coefficient = |k| self.coefficient(&Basis::Effect(k)).unwrap_or(0.0);
        self.structure.race(effect, coefficient)
    }

    /// Returns the power that damping dissipates relative to the water, W: `Σ ν_r · products`.
    ///
    /// It is never negative for a dissipative plant.
    pub fn damping_power(&self, velocity: &Vector6<f64>) -> f64 {
        let power = |(term, value): (&Basis, f64)| match term {
            Basis::Product(on, product) => value * product.value(velocity) * velocity[on.index()],
            _ => 0.0,
        };
        self.with_terms().map(power).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Symmetry;

    fn with_mass(rows: [[f64; 6]; 6]) -> Result<Plant, Error> {
        let structure = Structure::of(&Dof::ALL, Symmetry::PortStarboard).expect("six axes");
        let value = |term: &Basis| match term {
            Basis::Mass(i, j) => rows[i.index()][j.index()],
            _ => 0.0,
        };
        let coefficients = structure.terms().iter().map(value).collect();
        Plant::new(structure, coefficients)
    }

    /// M of MSS's otter.m with a payload of 25 kg: a published vehicle with coupled axes.
    const OTTER: [[f64; 6]; 6] = [
        [85.2815, 0.0, 0.0, 0.0, -11.0, 0.0],
        [0.0, 162.5, 0.0, 11.0, 0.0, 11.0],
        [0.0, 0.0, 135.0, 0.0, -11.0, 0.0],
        [0.0, 11.0, 0.0, 14.6547, 0.0, 2.2],
        [-11.0, 0.0, -11.0, 0.0, 30.25, 0.0],
        [0.0, 11.0, 0.0, 2.2, 0.0, 40.4937],
    ];

    #[test]
    fn a_published_mass_matrix_is_one_of_port_starboard_symmetry() {
        let plant = with_mass(OTTER).expect("positive definite");
        let expected = DMatrix::from_fn(6, 6, |i, j| OTTER[i][j]);
        assert_eq!(plant.mass_matrix(), expected);
        // Munk's moment turns a body that sideslips across its path: (m22 − m11) u v.
        let (u, v) = (1.5, 0.2);
        let velocity = Vector6::new(u, v, 0.0, 0.0, 0.0, 0.0);
        let moment = plant.resistance(&velocity, &Vector3::z())[5];
        assert!((moment - (162.5 - 85.2815) * u * v).abs() < 1e-9, "{moment}");
    }

    #[test]
    fn refuses_a_physically_impossible_mass() {
        let mut rows = OTTER;
        rows[1][3] = 60.0;
        let error = with_mass(rows).expect_err("m24² > m22 m44");
        assert!(error.to_string().contains("not positive definite"), "{error}");
    }

    #[test]
    fn distinguishes_published_dissipative_and_active_damping() {
        // CyberShip II, linear: 4 Y_v N_r < (Y_r + N_v)².
        let structure = Structure::of(&[Dof::Sway, Dof::Yaw], Symmetry::PortStarboard);
        let structure = ["sway: r", "yaw: v"]
            .iter()
            .fold(structure, |structure, term| structure?.with(term.parse()?));
        let structure = structure.expect("two axes");
        // M22, M26, M66, v, |v|v, r, |r|r, sway r, yaw v.
        let mass = [33.8, 1.0948, 2.76];
        let damping = [0.88965, 0.0, 1.9, 0.0, 7.25, -0.0313];
        let plant = Plant::new(structure, mass.into_iter().chain(damping).collect()).expect("ok");
        let power = |v: f64, r: f64| plant.damping_power(&Vector6::new(0.0, v, 0.0, 0.0, 0.0, r));
        assert!(power(0.5, 0.0) > 0.0 && power(0.0, 0.5) > 0.0);
        assert!(power(0.5, -0.1) < 0.0);
    }
}
