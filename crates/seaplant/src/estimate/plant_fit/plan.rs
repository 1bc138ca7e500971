//! Choice of the plant of several axes to fit.

use std::collections::BTreeMap;

use crate::plant::{Basis, EffectForce, HullModel, Signal, Structure, Symmetry};
use crate::{Dof, Error, Vehicle, VehicleEffect};

/// The plant of several axes to be fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantPlan {
    /// Axes of the plant.
    pub axes: Vec<Dof>,
    /// Symmetry of the hull, which determines the couplings in M.
    pub symmetry: Symmetry,
    /// Hull force model of a ship, in place of the usual damping. Without a search all its terms
    /// are fitted; with it, terms of second and higher order are added only where the trials
    /// support them.
    pub model: Option<HullModel>,
    /// Terms in addition to the usual ones of [`Structure::of`] or those of the model.
    pub terms: Vec<Basis>,
    /// Effects of the vehicle in addition to its usual ones, by name: `wind.sway`, `propeller.advance`.
    pub effects: Vec<String>,
    /// Known coefficients, by name, which are held at these values.
    pub hold: BTreeMap<String, f64>,
    /// True if cross damping and constant forces are added where the trials support them.
    pub search: bool,
}

impl PlantPlan {
    /// Builds the structure for a vehicle; `is_logged` returns true for signals that its trials
    /// contain.
    ///
    /// # Errors
    /// As [`Structure::of`], [`Structure::with`], [`Structure::with_effect`] and
    /// [`Structure::holding`]; [`Error::Plant`] for a requested effect that the vehicle does not
    /// have.
    pub fn structure(
        &self,
        vehicle: &Vehicle,
        is_logged: impl Fn(&Signal) -> bool,
    ) -> Result<Structure, Error> {
        let mut structure = self.of_hull(Structure::of(&self.axes, self.symmetry)?)?;
        let effects = vehicle.effects();
        self.check_names(&structure, &effects)?;
        for VehicleEffect { effect, is_usual, known } in effects {
            let is_requested = self.effects.contains(&effect.name);
            let acts = effect.axes().iter().any(|dof| self.axes.contains(dof));
            let is_known_input = effect.signals().iter().all(&is_logged);
            if effect.hull_lift().is_some_and(|(along, _)| !self.may_lift(along)) && !is_requested {
                continue;
            }
            if !acts || !(is_usual || is_requested || is_known_input) {
                continue;
            }
            let name = effect.name.clone();
            // A fit without the wind force may start far off where wind was logged.
            let is_logged_wind = is_known_input && matches!(effect.force, EffectForce::Wind { .. });
            let has_term =
                is_usual || is_requested || is_logged_wind || self.hold.contains_key(&name);
            structure = structure.with_effect(effect, has_term)?;
            if let Some((term, known)) = structure.term_named(&name).zip(known) {
                structure = structure.holding(term, known)?;
            }
        }
        for (name, value) in &self.hold {
            let term = structure.term_named(name).ok_or_else(|| {
                let known = structure.names().join(", ");
                let reason = format!(
                    "`{name}` cannot be held: the plant has no such coefficient; it has {known}"
                );
                Error::Plant { axes: structure.name(), reason }
            })?;
            structure = structure.holding(term, *value)?;
        }
        Ok(structure)
    }

    /// Returns whether the lift of the hull along an axis may be tried: models of ships have it, and it needs surge, the
    /// axis and the one that it turns.
    fn may_lift(&self, along: Dof) -> bool {
        let turn = if along == Dof::Heave { Dof::Pitch } else { Dof::Yaw };
        self.model.is_none() && [Dof::Surge, along, turn].iter().all(|dof| self.axes.contains(dof))
    }

    /// Returns the structure without effects: the usual terms or those of a model, and the
    /// requested ones.
    fn of_hull(&self, usual: Structure) -> Result<Structure, Error> {
        let with_own =
            |structure: Structure| self.terms.iter().try_fold(structure, |s, term| s.with(*term));
        let Some(model) = self.model else { return with_own(usual) };
        let (structure, mut tried) = model.shape(&usual)?;
        tried.retain(|term| !self.terms.contains(term));
        let structure = with_own(structure)?;
        match self.search {
            true => Ok(structure.trying(tried)),
            false => tried.iter().try_fold(structure, |s, term| s.with(*term)),
        }
    }

    fn check_names(&self, structure: &Structure, known: &[VehicleEffect]) -> Result<(), Error> {
        let names: Vec<&str> = known.iter().map(|known| known.effect.name.as_str()).collect();
        let Some(unknown) = self.effects.iter().find(|name| !names.contains(&name.as_str())) else {
            return Ok(());
        };
        let reason = format!(
            "the vehicle has no effect `{unknown}`; it has {}, and terms read as \"yaw: |v|r\"",
            names.join(", ")
        );
        Err(Error::Plant { axes: structure.name(), reason })
    }
}
