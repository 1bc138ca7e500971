//! Axes that no known force pushes, and what turning does along them.

use nalgebra::Matrix6;

use crate::plant::{Basis, Structure};
use crate::{Dof, TrialRecord};

/// Returns true if a logged force, or a rudder, fin or propeller of unknown strength, acts on an axis.
pub(crate) fn is_pushed(structure: &Structure, records: &[&TrialRecord], dof: Dof) -> bool {
    let mut effects = structure.terms().iter().filter(|term| structure.pushes(term));
    effects.any(|term| structure.axes_of(term).contains(&dof))
        || records.iter().any(|record| record.is_driven(dof))
}

/// A translation that a sensor measures and no known force pushes, and a rate of turn that moves a point along it.
///
/// The velocity of a point at r is `(ω × r)_i = ± ω_j r_k`, where i, j and k are three directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Swing {
    /// The translation.
    pub(crate) of: Dof,
    /// The rate of turn.
    pub(crate) by: Dof,
}

impl Swing {
    /// Returns all swings of a plant in its trials.
    pub(crate) fn all(structure: &Structure, records: &[&TrialRecord]) -> Vec<Self> {
        let axes = structure.axes();
        let is_measured = |dof: Dof| records.iter().all(|record| record.is_measured(dof));
        let is_free = |dof: &&Dof| {
            // A rudder of unknown strength is as strong as the plant wants it.
            let is_driven = records.iter().any(|record| record.is_driven(**dof));
            !dof.is_rotation() && is_measured(**dof) && !is_driven
        };
        let all = axes.iter().filter(is_free).flat_map(|&of| {
            let turns =
                axes.iter().filter(move |by| by.is_rotation() && direction(**by) != direction(of));
            turns.map(move |&by| Self { of, by })
        });
        all.collect()
    }

    /// Returns the direction k of the distance.
    pub(crate) fn along(self) -> usize {
        3 - direction(self.of) - direction(self.by)
    }

    /// Computes where the centre of mass is beside that of a rigid body, along the distance, m:
    /// `± (m_ij − b_ij) / m_ii`.
    pub(crate) fn centre(self, mass: &Matrix6<f64>, body: &Matrix6<f64>) -> f64 {
        let (i, j) = (self.of.index(), self.by.index());
        self.sign() * (mass[(i, j)] - body[(i, j)]) / mass[(i, i)]
    }

    /// Computes the inertia of the same motion if the centre of mass were this far back:
    /// `m_jj ∓ 2 x m_ij + x² m_ii`, kg m².
    pub(crate) fn inertia_with_centre_back(self, mass: &Matrix6<f64>, metres: f64) -> f64 {
        let (i, j) = (self.of.index(), self.by.index());
        let x = self.sign() * metres;
        mass[(j, j)] - 2.0 * x * mass[(i, j)] + x * x * mass[(i, i)]
    }

    /// Returns the sign of `(ω × r)_i` for ω_j and r_k above zero.
    fn sign(self) -> f64 {
        if (direction(self.by) + 1) % 3 == self.along() { 1.0 } else { -1.0 }
    }

    /// Returns true if a term of a plant is damping of the one by the other, or lift of the hull that is.
    pub(crate) fn is_damped_by(self, structure: &Structure, term: &Basis) -> bool {
        let Basis::Product(on, product) = term else {
            return structure.lift_of_hull(term).is_some()
                && [self.of, self.by].iter().all(|dof| structure.axes_of(term).contains(dof));
        };
        let pairs = [(self.of, self.by), (self.by, self.of)];
        product.factors().any(|factor| pairs.contains(&(*on, factor.of)))
    }
}

/// Returns the direction of an axis: 0 ahead, 1 to starboard, 2 down.
fn direction(dof: Dof) -> usize {
    dof.index() % 3
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::RigidBody;

    /// The mass matrix of a rigid body whose centre is known has it in six couplings.
    #[test]
    fn centre_of_mass_is_that_of_a_rigid_body() {
        let centre = [0.3, -0.2, 0.1];
        let body =
            RigidBody::new(20.0, centre, [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]]);
        let mass = body.expect("a body").mass_matrix();
        for (of, by) in [
            (Dof::Surge, Dof::Pitch),
            (Dof::Surge, Dof::Yaw),
            (Dof::Sway, Dof::Roll),
            (Dof::Sway, Dof::Yaw),
            (Dof::Heave, Dof::Roll),
            (Dof::Heave, Dof::Pitch),
        ] {
            let swing = Swing { of, by };
            let found = swing.centre(&mass, &Matrix6::zeros());
            assert!((found - centre[swing.along()]).abs() < 1e-12, "{of} by {by}: {found}");
            assert_eq!(swing.centre(&mass, &mass), 0.0);
        }
    }
}
