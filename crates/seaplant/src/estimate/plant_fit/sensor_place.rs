//! A velocity sensor elsewhere than stated, or couplings in damping.
//!
//! Where no known force acts on sway, a point a distance ℓ ahead of the origin moves as the origin of another vehicle
//! does, with
//!
//! ```text
//! v' = v + ℓ r,   M = Tᵀ M' T,   D = Tᵀ D' T,   T = [1 ℓ; 0 1] of sway and yaw
//! ```
//!
//! so that a sensor there and couplings of linear damping explain the same trials. Of two such fits that of the
//! smaller couplings in mass is taken: a wrong place of the sensor shifts the centres of mass and of damping alike,
//! damping that couples only its own.

use super::descent::Tolerance;
use super::{Fitted, Swing, search};
use crate::{Error, TrialRecord, VelocityReport};

/// A fit after the search for couplings, and the records that it is of.
pub(super) struct Placed {
    pub(super) fitted: Fitted,
    /// None where they are those before the search.
    pub(super) records: Vec<TrialRecord>,
    /// The fit with the velocity sensor as stated, if it explains the trials as well as `fitted`, or has the smaller
    /// couplings in mass.
    pub(super) as_stated: Option<Fitted>,
}

impl From<Fitted> for Placed {
    fn from(fitted: Fitted) -> Self {
        Self { fitted, records: Vec::new(), as_stated: None }
    }
}

impl Fitted {
    /// The same with the couplings in damping that the trials support, and with or without a lever arm of the velocity
    /// sensor along an axis that no known force pushes, where couplings and lever arm stand for each other.
    pub(super) fn searched_with_sensor_place(
        self,
        records: &[&TrialRecord],
    ) -> Result<Placed, Error> {
        let first = self.clone().searched(records)?;
        let before = &self.problem.structure;
        let swings = Swing::all(before, records);
        let couples = |fitted: &Self| {
            let structure = &fitted.problem.structure;
            let mut added = structure.terms().iter().filter(|term| before.index_of(term).is_none());
            added.any(|term| swings.iter().any(|swing| swing.is_damped_by(structure, term)))
        };
        let has_lever_along = |fitted: &Self| {
            swings.iter().any(|swing| fitted.reported.how.lever_m[swing.along()] != 0.0)
        };
        let has_lever = has_lever_along(&self);
        if self.problem.is_free || !has_lever && !couples(&first) {
            return Ok(Placed::from(first));
        }
        let begun = match has_lever {
            true => self.without_lever(&swings, records),
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
        let second_is_centred =
            second.coupling_of_mass(&swings)? < first.coupling_of_mass(&swings)?;
        let is_second = if is_open { second_is_centred } else { gain > 0.0 };
        let (fitted, other, records) = match is_second {
            true => (second, first, moved),
            false => (first, second, Vec::new()),
        };
        // The likelier place of a sensor is in doubt that takes the centre of mass with it.
        let is_rival = is_open || is_second != second_is_centred;
        let as_stated = Some(other).filter(|other| is_rival && !has_lever_along(other));
        Ok(Placed { fitted, records, as_stated })
    }

    /// Computes the sum of squared distances of the centre of mass from that of the rigid body, or from the origin, m².
    fn coupling_of_mass(&self, swings: &[Swing]) -> Result<f64, Error> {
        let mass = self.problem.plant(&self.optimum.point.free)?.mass_matrix_of_six();
        let body = self.problem.rigid_body().unwrap_or_default();
        Ok(swings.iter().map(|swing| swing.centre(&mass, &body).powi(2)).sum())
    }

    /// The same with the velocity sensor where it is stated to be along some swings, and its records.
    fn without_lever(
        &self,
        swings: &[Swing],
        records: &[&TrialRecord],
    ) -> Option<(Self, Vec<TrialRecord>)> {
        let mut reported = self.reported;
        let mut back = VelocityReport::default();
        for along in swings.iter().map(|swing| swing.along()) {
            back.lever_m[along] = -self.reported.how.lever_m[along];
            (reported.how.lever_m[along], reported.lever_std[along]) = (0.0, None);
        }
        let records: Vec<TrialRecord> =
            records.iter().map(|record| record.with_translations_before(&back)).collect();
        let problem = self.problem.of(&records.iter().collect::<Vec<_>>());
        let optimum = problem.descent(self.optimum.point.clone(), Tolerance::COARSE).ok()?;
        Some((Self { problem, optimum, reported, ..self.clone() }, records))
    }
}
