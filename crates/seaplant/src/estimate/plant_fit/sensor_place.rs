//! A velocity sensor elsewhere than stated, or couplings in damping.
//!
//! Where no known force acts on sway, a point a distance ℓ ahead of the origin moves as the origin of another vehicle
//! does, with
//!
//! ```text
//! v' = v + ℓ r,   M = Tᵀ M' T,   D = Tᵀ D' T,   T = [1 ℓ; 0 1] of sway and yaw
//! ```
//!
//! so that a sensor there and couplings of linear damping explain the same trials. Of two such fits, whose centres of mass
//! are apart by ℓ as well, that of the smaller couplings in mass is taken: a wrong place of the sensor shifts the centres
//! of mass and of damping alike, damping that couples only its own. Likelihood does not decide between them: what it
//! prefers of them depends on drag that neither describes exactly. Of other fits the likelier one is taken.

use nalgebra::Matrix6;

use super::descent::Tolerance;
use super::{Fitted, Reported, Swing, search};
use crate::{Error, TrialRecord, VelocityReport};

/// The centre of mass is elsewhere by about as much as a sensor if the difference is less than this part of it.
const AS_FAR: f64 = 0.2;

/// A fit after the search for couplings, and the records that it is of.
pub(super) struct Placed {
    pub(super) fitted: Fitted,
    /// None where they are those before the search.
    pub(super) records: Vec<TrialRecord>,
    /// The fit with another place of the velocity sensor, if it explains the trials as well as `fitted` or better, or has
    /// the smaller couplings in mass.
    pub(super) other_place: Option<Fitted>,
}

impl From<Fitted> for Placed {
    fn from(fitted: Fitted) -> Self {
        Self { fitted, records: Vec::new(), other_place: None }
    }
}

impl Fitted {
    /// The same with the couplings in damping that the trials support, where the velocity sensor shows to be, and as
    /// prompt as it is: a delay that was found without couplings may have made up for them.
    pub(super) fn searched_with_report(self, records: &[&TrialRecord]) -> Result<Placed, Error> {
        let first = self.clone().searched_with_sensor_place(records)?;
        let Reported { how, std: [delay_std, _], .. } = self.reported;
        let has_couplings = first.fitted.optimum.cost != self.optimum.cost;
        if delay_std.is_none() || how.lag_s != 0.0 || !has_couplings {
            return Ok(first);
        }
        let placed: Vec<&TrialRecord> = first.records.iter().collect();
        let placed = if placed.is_empty() { records } else { &placed };
        // A fit that does not settle is none.
        let Some((prompt, _)) = first.fitted.without_delay(placed) else { return Ok(first) };
        // Windows differ in length by less than the delay.
        let by_sample = |it: &Self| it.optimum.cost / it.problem.samples() as f64;
        let best = by_sample(&first.fitted);
        if by_sample(&prompt) >= by_sample(&self) {
            return Ok(first);
        }
        let Some((begun, moved)) = self.without_delay(records) else { return Ok(first) };
        let second = begun.searched_with_sensor_place(&moved.iter().collect::<Vec<_>>());
        let Ok(second) = second else { return Ok(first) };
        let samples = self.problem.samples() as f64;
        let gain_of_delay = 2.0 * samples * (by_sample(&second.fitted) - best);
        if gain_of_delay > search::ADMITTED * first.fitted.colour_of_translations()? {
            return Ok(first);
        }
        let records = if second.records.is_empty() { moved } else { second.records };
        Ok(Placed { records, ..second })
    }

    /// The same with the couplings in damping that the trials support, and with or without a lever arm of the velocity
    /// sensor along an axis that no known force pushes, where couplings and lever arm stand for each other.
    fn searched_with_sensor_place(self, records: &[&TrialRecord]) -> Result<Placed, Error> {
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
        let by_centre = is_open || first.is_moved_with_its_centre(&second, &swings)?;
        let is_second = if by_centre { second_is_centred } else { gain > 0.0 };
        let (fitted, other, records) = match is_second {
            true => (second, first, moved),
            false => (first, second, Vec::new()),
        };
        // Of two that are as likely, that is told which has the sensor as stated; of others, the likelier one, and one
        // that has the centre of mass nearer to where it is expected.
        let is_rival = match is_open {
            true => !has_lever_along(&other),
            false => is_second != (gain > 0.0) || is_second != second_is_centred,
        };
        Ok(Placed { fitted, records, other_place: Some(other).filter(|_| is_rival) })
    }

    /// Returns true if the centre of mass is elsewhere than in another fit by about as much as the velocity sensor, in
    /// all directions in which that is elsewhere: the place of the sensor is then all that tells the plants apart.
    fn is_moved_with_its_centre(&self, other: &Self, swings: &[Swing]) -> Result<bool, Error> {
        let [own, others] = [self, other].map(Self::mass_and_body);
        let ((mass, body), (mass_of_other, _)) = (own?, others?);
        let along = |swing: &Swing| {
            let k = swing.along();
            let sensor_m = self.reported.how.lever_m[k] - other.reported.how.lever_m[k];
            let centre_m = swing.centre(&mass, &body) - swing.centre(&mass_of_other, &body);
            (sensor_m != 0.0).then(|| (centre_m - sensor_m).abs() < AS_FAR * sensor_m.abs())
        };
        Ok(swings.iter().filter_map(along).all(|is_as_far| is_as_far))
    }

    /// Computes the sum of squared distances of the centre of mass from that of the rigid body, or from the origin, m².
    fn coupling_of_mass(&self, swings: &[Swing]) -> Result<f64, Error> {
        let (mass, body) = self.mass_and_body()?;
        Ok(swings.iter().map(|swing| swing.centre(&mass, &body).powi(2)).sum())
    }

    /// Returns the mass matrices of the plant and of the rigid body, zero of one that is not known.
    fn mass_and_body(&self) -> Result<(Matrix6<f64>, Matrix6<f64>), Error> {
        let mass = self.problem.plant(&self.optimum.point.free)?.mass_matrix_of_six();
        Ok((mass, self.problem.rigid_body().unwrap_or_default()))
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
        self.reporting(reported, &back, records)
    }

    /// The same with a velocity sensor that is not late, and its records.
    fn without_delay(&self, records: &[&TrialRecord]) -> Option<(Self, Vec<TrialRecord>)> {
        let mut reported = self.reported;
        (reported.how.delay_s, reported.std[0]) = (0.0, None);
        let delay_s = -self.reported.how.delay_s;
        self.reporting(reported, &VelocityReport { delay_s, ..VelocityReport::default() }, records)
    }

    /// The same with another report of velocity, which takes records back by a part of the present one.
    fn reporting(
        &self,
        reported: Reported,
        back: &VelocityReport,
        records: &[&TrialRecord],
    ) -> Option<(Self, Vec<TrialRecord>)> {
        let records: Vec<TrialRecord> =
            records.iter().map(|record| record.with_translations_before(back)).collect();
        let problem = self.problem.of(&records.iter().collect::<Vec<_>>());
        let optimum = problem.descent(self.optimum.point.clone(), Tolerance::COARSE).ok()?;
        Some((Self { problem, optimum, reported, ..self.clone() }, records))
    }
}
