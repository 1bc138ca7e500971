//! Which plant of several axes to fit.

use std::collections::BTreeMap;

use crate::plant::{Basis, EffectForce, HullModel, Signal, Structure, Symmetry};
use crate::{Dof, Error, Vehicle, VehicleEffect};

/// A plant of several axes that is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct CoupledPlan {
    /// Its axes.
    pub axes: Vec<Dof>,
    /// Which of them M may couple.
    pub symmetry: Symmetry,
    /// Hull forces of a ship in place of the usual damping; all of them without a search, else
    /// those of second order and more that the trials ask for.
    pub model: Option<HullModel>,
    /// Terms beside the usual ones of [`Structure::of`], or of the model.
    pub terms: Vec<Basis>,
    /// Effects of the vehicle beside its usual ones, by name: `wind.sway`, `rudder.race`.
    pub effects: Vec<String>,
    /// Coefficients that are known, by name, and stay as they are.
    pub hold: BTreeMap<String, f64>,
    /// Whether damping of one axis by another, and constant forces, are added where the trials ask for it.
    pub search: bool,
}

impl CoupledPlan {
    /// The terms of the plant of a vehicle; `is_logged` says which signals its trials hold.
    ///
    /// # Errors
    /// As [`Structure::of`], [`Structure::with`], [`Structure::with_effect`] and
    /// [`Structure::holding`]; [`Error::Plant`] if an effect is asked for that the vehicle does
    /// not have.
    pub fn structure(
        &self,
        vehicle: &Vehicle,
        is_logged: impl Fn(&Signal) -> bool,
    ) -> Result<Structure, Error> {
        let mut structure = self.of_hull(Structure::of(&self.axes, self.symmetry)?)?;
        let effects = vehicle.effects();
        self.check_names(&structure, &effects)?;
        for VehicleEffect { effect, is_usual, known } in effects {
            let is_asked = self.effects.contains(&effect.name);
            let acts = effect.axes().iter().any(|dof| self.axes.contains(dof));
            let is_told = effect.signals().iter().all(&is_logged);
            if !acts || !(is_usual || is_asked || is_told) {
                continue;
            }
            let name = effect.name.clone();
            // Wind that is there pushes: without it the start of a fit may be far off.
            let blows = is_told && matches!(effect.force, EffectForce::Wind { .. });
            let has_term = is_usual || is_asked || blows || self.hold.contains_key(&name);
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

    /// The structure without effects: the usual terms, or those of a model, and those asked for.
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
        let Some(strange) = self.effects.iter().find(|name| !names.contains(&name.as_str())) else {
            return Ok(());
        };
        let reason = format!(
            "the vehicle has no effect `{strange}`; it has {}, and terms read as \"yaw: |v|r\"",
            names.join(", ")
        );
        Err(Error::Plant { axes: structure.name(), reason })
    }
}
