//! Restriction of the coefficients to physically possible ones: M ≻ 0, or M ⪰ M_RB, and damping
//! that dissipates power.

use nalgebra::{Matrix6, Vector6};

use crate::Dof;
use crate::plant::{Basis, Structure};

/// Lower limit of the eigenvalues of M, scaled to a unit diagonal.
const LEAST_PART: f64 = 0.02;

/// Lower limit of the scale of a diagonal entry of M, as a fraction of its greatest entry.
const LEAST_SCALE: f64 = 1e-9;

/// Number of halvings of cross damping until damping dissipates power.
const HALVINGS: usize = 20;

/// Set of the physically possible coefficients of a structure.
///
/// ```
/// use seaplant::Dof;
/// use seaplant::estimate::online::Possible;
/// use seaplant::plant::{Structure, Symmetry};
/// let surge = Structure::of(&[Dof::Surge], Symmetry::None)?;
/// let mut theta = [100.0, -5.0, 20.0];
/// Possible::of(&surge, None).project(&mut theta);
/// assert_eq!(theta, [100.0, 0.0, 20.0]);
/// # Ok::<(), seaplant::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Possible {
    terms: Vec<Basis>,
    rigid_body: Matrix6<f64>,
    /// Lower limit of each diagonal entry of M, kg or kg m².
    least: Vector6<f64>,
    /// Groups of linear damping and of damping by the modulus of each axis: term, row and column of
    /// each.
    damping: Vec<Vec<(usize, usize, usize)>>,
    /// Terms of effects whose coefficients cannot be negative.
    positive: Vec<usize>,
    /// Values of held coefficients.
    held: Vec<Option<f64>>,
}

impl Possible {
    /// Creates the set for a structure; M ⪰ M_RB where that is given, else M ≻ 0.
    pub fn of(structure: &Structure, rigid_body: Option<Matrix6<f64>>) -> Self {
        let terms = structure.terms().to_vec();
        let mut damping = vec![Vec::new(); 7];
        for (k, term) in terms.iter().enumerate() {
            let Basis::Product(on, product) = term else { continue };
            if product.speed() != 0 {
                continue;
            }
            let factors: [Option<_>; 3] = {
                let mut all = product.factors();
                [all.next(), all.next(), all.next()]
            };
            let (group, of) = match factors {
                [Some(of), None, None] if !of.modulus => (6, of.of),
                [Some(by), Some(of), None] if by.modulus && !of.modulus => (by.of.index(), of.of),
                _ => continue,
            };
            damping[group].push((k, on.index(), of.index()));
        }
        damping.retain(|group| !group.is_empty());
        let is_positive = |term: &Basis| match term {
            Basis::Effect(number) => structure.effects()[*number].is_positive(),
            _ => false,
        };
        Self {
            positive: (0..terms.len()).filter(|k| is_positive(&terms[*k])).collect(),
            held: terms.iter().map(|term| structure.held(term)).collect(),
            rigid_body: rigid_body.unwrap_or_else(Matrix6::zeros),
            least: Vector6::zeros(),
            terms,
            damping,
        }
    }

    /// Returns true if a coefficient is held.
    pub(super) fn is_held(&self, k: usize) -> bool {
        self.held[k].is_some()
    }

    /// Sets the lower limit of an axis's mass to a fraction of its known mass.
    pub(super) fn set_least(&mut self, dof: Dof, mass: f64) {
        self.least[dof.index()] = mass;
    }

    /// Returns M of the coefficients, with ones on the diagonal for axes outside the plant.
    pub(super) fn mass(&self, theta: &[f64]) -> Matrix6<f64> {
        let mut mass = Matrix6::zeros();
        let mut is_own = [false; 6];
        for (term, value) in self.terms.iter().zip(theta) {
            if let Basis::Mass(i, j) = term {
                mass[(i.index(), j.index())] = *value;
                mass[(j.index(), i.index())] = *value;
                is_own[i.index()] = true;
            }
        }
        for i in (0..6).filter(|i| !is_own[*i]) {
            mass[(i, i)] = 1.0;
        }
        mass
    }

    /// Returns the free coefficients that cannot be negative: damping of an axis by itself, lift of
    /// fins and strength of propellers.
    pub(super) fn not_negative(&self) -> impl Iterator<Item = usize> + '_ {
        let damping = self.damping.iter().flatten().filter(|(_, i, j)| i == j).map(|(k, ..)| *k);
        damping.chain(self.positive.iter().copied()).filter(|k| !self.is_held(*k))
    }

    /// Projects impossible coefficients, shape (p,), to possible ones nearby.
    ///
    /// Raises the eigenvalues of M, limits damping of an axis by itself to zero, and halves cross
    /// damping until every motion loses power. Held coefficients do not change; if M with them is
    /// not positive definite, the couplings of their axes are set to zero.
    pub fn project(&self, theta: &mut [f64]) {
        self.hold(theta);
        if self.make_mass_definite(theta) {
            self.hold(theta);
            if self.mass(theta).cholesky().is_none() {
                self.uncouple(theta);
            }
        }
        for &k in &self.positive {
            theta[k] = theta[k].max(0.0);
        }
        for group in &self.damping {
            for &(k, i, j) in group {
                if i == j {
                    theta[k] = theta[k].max(0.0);
                }
            }
            reduce_cross_damping(group, theta);
        }
        self.hold(theta);
    }

    fn hold(&self, theta: &mut [f64]) {
        for (theta, held) in theta.iter_mut().zip(&self.held) {
            *theta = held.unwrap_or(*theta);
        }
    }

    /// Sets the couplings of axes with held mass to zero.
    fn uncouple(&self, theta: &mut [f64]) {
        let is_held = |dof: Dof| {
            let own = self.terms.iter().position(|term| *term == Basis::Mass(dof, dof));
            own.is_some_and(|k| self.is_held(k))
        };
        for (term, value) in self.terms.iter().zip(theta) {
            if matches!(term, Basis::Mass(i, j) if i != j && (is_held(*i) || is_held(*j))) {
                *value = 0.0;
            }
        }
    }

    /// Makes M positive definite; returns false if it already was.
    fn make_mass_definite(&self, theta: &mut [f64]) -> bool {
        let mass = self.mass(theta);
        let excess = mass - self.rigid_body;
        // A small entry that is not yet determined may have any value.
        let least = (LEAST_SCALE * mass.amax()).max(f64::MIN_POSITIVE);
        let scale =
            Vector6::from_fn(|i, _| mass[(i, i)].max(self.least[i]).max(least)).map(f64::sqrt);
        let floor = Matrix6::from_diagonal(&Vector6::from_fn(|i, _| {
            if self.rigid_body[(i, i)] > 0.0 { 0.0 } else { LEAST_PART * scale[i] * scale[i] }
        }));
        let above = excess - floor;
        if above.cholesky().is_some() && (0..6).all(|i| mass[(i, i)] >= self.least[i]) {
            return false;
        }
        let scaled = Matrix6::from_fn(|i, j| above[(i, j)] / (scale[i] * scale[j]));
        let eigen = scaled.symmetric_eigen();
        let values = eigen.eigenvalues.map(|value| value.max(0.0));
        let lifted =
            eigen.eigenvectors * Matrix6::from_diagonal(&values) * eigen.eigenvectors.transpose();
        for (term, value) in self.terms.iter().zip(theta) {
            if let Basis::Mass(i, j) = term {
                let (i, j) = (i.index(), j.index());
                *value =
                    lifted[(i, j)] * scale[i] * scale[j] + floor[(i, j)] + self.rigid_body[(i, j)];
                if i == j {
                    *value = value.max(self.least[i]);
                }
            }
        }
        true
    }
}

/// Reduces cross damping within a group until the group dissipates power for every motion.
fn reduce_cross_damping(group: &[(usize, usize, usize)], theta: &mut [f64]) {
    if group.iter().all(|(_, i, j)| i == j) {
        return;
    }
    for _ in 0..HALVINGS {
        if takes_power(group, theta) {
            return;
        }
        for &(k, i, j) in group {
            if i != j {
                theta[k] *= 0.5;
            }
        }
    }
    for &(k, i, j) in group {
        if i != j {
            theta[k] = 0.0;
        }
    }
}

fn takes_power(group: &[(usize, usize, usize)], theta: &[f64]) -> bool {
    let mut part = Matrix6::<f64>::zeros();
    for &(k, i, j) in group {
        part[(i, j)] += 0.5 * theta[k];
        part[(j, i)] += 0.5 * theta[k];
    }
    let scale = Vector6::from_fn(|i, _| if part[(i, i)] > 0.0 { part[(i, i)].sqrt() } else { 1.0 });
    let scaled = Matrix6::from_fn(|i, j| part[(i, j)] / (scale[i] * scale[j]));
    (scaled + Matrix6::identity() * 1e-9).cholesky().is_some()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Plant, Symmetry};

    fn sway_yaw() -> Structure {
        let structure = Structure::of(&[Dof::Sway, Dof::Yaw], Symmetry::PortStarboard);
        let more = ["sway: r", "yaw: v"];
        more.iter().fold(structure, |s, term| s?.with(term.parse()?)).expect("two axes")
    }

    #[test]
    fn projection_makes_mass_definite_and_damping_dissipative() {
        let structure = sway_yaw();
        let possible = Possible::of(&structure, None);
        // M22, M26, M66, v, |v|v, r, |r|r, sway: r, yaw: v.
        let mut theta = [100.0, 90.0, 20.0, 1.0, -5.0, 1.0, 3.0, 9.0, 2.0];
        possible.project(&mut theta);
        let plant = Plant::new(structure, theta.to_vec()).expect("M is positive definite");
        assert_eq!(theta[4], 0.0);
        for k in 0..100 {
            let (v, r) = (f64::from(k) * 0.063).sin_cos();
            let power = plant.damping_power(&Vector6::new(0.0, v, 0.0, 0.0, 0.0, r));
            assert!(power > -1e-6, "{power} at {v}, {r}");
        }
    }

    #[test]
    fn possible_coefficients_do_not_change() {
        let possible = Possible::of(&sway_yaw(), None);
        let theta = [100.0, 10.0, 20.0, 10.0, 5.0, 8.0, 3.0, 2.0, -1.0];
        let mut projected = theta;
        possible.project(&mut projected);
        assert_eq!(projected, theta);
    }

    #[test]
    fn mass_is_at_least_that_of_the_rigid_body() {
        let structure = Structure::of(&[Dof::Surge], Symmetry::None).expect("surge");
        let possible = Possible::of(&structure, Some(Matrix6::identity() * 13.5));
        let mut theta = [12.0, 1.0, 1.0];
        possible.project(&mut theta);
        assert!((theta[0] - 13.5).abs() < 1e-9, "{theta:?}");
    }
}
