//! A velocity sensor elsewhere than stated, or couplings in damping.
//!
//! Where no force acts on sway, a point a distance ℓ ahead of the origin moves as the origin of another vehicle
//! does, with
//!
//! ```text
//! v' = v + ℓ r,   M = Tᵀ M' T,   D = Tᵀ D' T,   T = [1 ℓ; 0 1] of sway and yaw
//! ```
//!
//! so that a sensor there and couplings of linear damping explain the same trials. Of two such fits that of the
//! smaller couplings in mass is taken: a wrong place of the sensor shifts the centres of mass and of damping alike,
//! damping that couples only its own.

use nalgebra::Matrix6;

use super::descent::Tolerance;
use super::report::Reported;
use super::{Fitted, search};
use crate::plant::{Basis, Structure};
use crate::{Dof, Error, TrialRecord, VelocityReport};

/// A fit after the search for couplings, and the records that it is of.
pub(super) struct Placed {
    pub(super) fitted: Fitted,
    /// None where they are those before the search.
    pub(super) records: Vec<TrialRecord>,
    /// The fit with the velocity sensor as stated, if it explains the trials as well as `fitted`.
    pub(super) as_stated: Option<Fitted>,
}

impl From<Fitted> for Placed {
    fn from(fitted: Fitted) -> Self {
        Self { fitted, records: Vec::new(), as_stated: None }
    }
}

impl Fitted {
    /// The same with the couplings in damping that the trials support, and with or without a lever arm of the velocity
    /// sensor along an axis that nothing pushes, where couplings and lever arm stand for each other.
    pub(super) fn searched_with_sensor_place(
        self,
        records: &[&TrialRecord],
    ) -> Result<Placed, Error> {
        let first = self.clone().searched(records)?;
        let swings = self.swings(records);
        let before = &self.problem.structure;
        let couples = |fitted: &Self| {
            swings.iter().any(|swing| swing.couples(&fitted.problem.structure, before))
        };
        let has_lever = swings.iter().any(|swing| self.reported.how.lever_m[swing.along()] != 0.0);
        if self.problem.is_free || !has_lever && !couples(&first) {
            return Ok(Placed::from(first));
        }
        let begun = match has_lever {
            true => self.without_lever(records),
            false => self.with_lever(records),
        };
        // A fit that does not settle is none.
        let Some((begun, moved)) = begun else { return Ok(Placed::from(first)) };
        let Ok(second) = begun.searched(&moved.iter().collect::<Vec<_>>()) else {
            return Ok(Placed::from(first));
        };
        if has_lever && !couples(&second) {
            return Ok(Placed::from(first));
        }
        let gain = 2.0 * (first.optimum.cost - second.optimum.cost);
        let colour = first.colour_of_translations()?.min(second.colour_of_translations()?);
        let is_open = gain.abs() <= search::ADMITTED * colour;
        let is_second = match is_open {
            true => second.coupling_of_mass(&swings)? < first.coupling_of_mass(&swings)?,
            false => gain > 0.0,
        };
        let (fitted, other, records) = match is_second {
            true => (second, first, moved),
            false => (first, second, Vec::new()),
        };
        let is_as_stated = other.reported.how.lever_m == [0.0; 3];
        Ok(Placed { fitted, records, as_stated: Some(other).filter(|_| is_open && is_as_stated) })
    }

    /// Translations that a sensor measures and nothing pushes, each with a rate of turn of the plant.
    fn swings(&self, records: &[&TrialRecord]) -> Vec<Swing> {
        let structure = &self.problem.structure;
        let axes = structure.axes();
        let is_effect = |term: &&Basis| matches!(term, Basis::Effect(_));
        let effects: Vec<Dof> = structure
            .terms()
            .iter()
            .filter(is_effect)
            .flat_map(|term| structure.axes_of(term))
            .collect();
        let is_free = |dof: &&Dof| {
            self.problem.may_be_late(**dof)
                && !effects.contains(dof)
                && !records.iter().any(|record| record.is_driven(**dof))
        };
        let turns = || axes.iter().filter(|dof| dof.is_rotation());
        let moves = axes.iter().filter(is_free);
        let all = moves.flat_map(|of| turns().map(|by| Swing { of: *of, by: *by }));
        // Rolling moves nothing ahead, and so on.
        all.filter(|swing| swing.by.index() != swing.of.index() + 3).collect()
    }

    /// Computes the sum of `((m_ij − b_ij) / m_ii)²` over translations i and rates j, m², with the rigid body B if it is
    /// known.
    fn coupling_of_mass(&self, swings: &[Swing]) -> Result<f64, Error> {
        let mass = self.problem.plant(&self.optimum.point.free)?.mass_matrix_of_six();
        let body = self.problem.rigid_body().unwrap_or_else(Matrix6::zeros);
        let of = |swing: &Swing| {
            let (i, j) = (swing.of.index(), swing.by.index());
            ((mass[(i, j)] - body[(i, j)]) / mass[(i, i)]).powi(2)
        };
        Ok(swings.iter().map(of).sum())
    }

    /// The same with the velocity sensor where it is stated to be, and its records.
    fn without_lever(&self, records: &[&TrialRecord]) -> Option<(Self, Vec<TrialRecord>)> {
        let back = VelocityReport {
            lever_m: self.reported.how.lever_m.map(|metres| -metres),
            ..VelocityReport::default()
        };
        let how = VelocityReport { lever_m: [0.0; 3], ..self.reported.how };
        let records: Vec<TrialRecord> =
            records.iter().map(|record| record.with_translations_before(&back)).collect();
        let problem = self.problem.of(&records.iter().collect::<Vec<_>>());
        let optimum = problem.descent(self.optimum.point.clone(), Tolerance::COARSE).ok()?;
        let reported = Reported { how, lever_std: [None; 3], ..self.reported };
        Some((Self { problem, optimum, reported, ..self.clone() }, records))
    }
}

/// Motion along an axis that a rate of turn makes at a distance.
struct Swing {
    of: Dof,
    by: Dof,
}

impl Swing {
    /// The direction of the distance: neither that of the motion nor that of the axis of turning.
    fn along(&self) -> usize {
        3 - self.of.index() - (self.by.index() - 3)
    }

    /// Returns true if damping of a structure couples the two axes, by terms that another does not have.
    fn couples(&self, structure: &Structure, beyond: &Structure) -> bool {
        let pairs = [(self.of, self.by), (self.by, self.of)];
        let is_between = |term: &&Basis| {
            let Basis::Product(on, product) = term else { return false };
            product.factors().any(|factor| pairs.contains(&(*on, factor.of)))
        };
        let mut all = structure.terms().iter().filter(is_between);
        all.any(|term| beyond.index_of(term).is_none())
    }
}
