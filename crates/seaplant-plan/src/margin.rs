//! The controller whose stability margin a trial is to make certain.

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use schemars::JsonSchema;
use seaplant::Dof;
use seaplant::plant::Plant;
use seaplant_control::{Actuators, Design, Law, Tuning, design, margins};
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::mission::slopes;

/// A controller, designed for the believed plant, on each axis of a goal `margin.AXIS`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ControllerGoal {
    /// The law.
    pub law: Law,
    /// Natural frequency of the closed loop, Hz.
    pub bandwidth_hz: f64,
    /// Its damping ratio.
    pub damping: f64,
    /// Sample rate, Hz.
    pub sample_hz: f64,
}

impl Default for ControllerGoal {
    fn default() -> Self {
        Self { law: Law::default(), bandwidth_hz: 0.1, damping: 1.0, sample_hz: 10.0 }
    }
}

impl ControllerGoal {
    fn design(&self, dof: Dof) -> Design {
        let tuning = Tuning::new(self.bandwidth_hz, self.damping);
        Design {
            law: self.law,
            tuning: BTreeMap::from([(dof, tuning)]),
            sample_hz: self.sample_hz,
            ..Design::default()
        }
    }

    /// Checks that a plant can have the controller on an axis.
    ///
    /// # Errors
    /// As [`design`], with the bandwidth that would do.
    pub(crate) fn check(
        &self,
        plant: &Plant,
        actuators: &Actuators,
        dof: Dof,
    ) -> Result<(), Error> {
        design(plant, &[], actuators, &self.design(dof))?;
        Ok(())
    }

    /// Returns the phase margin of an axis, degrees, and its derivatives by the coefficients of the
    /// vehicle, shape (p, 1), with gains for the believed plant.
    ///
    /// # Errors
    /// As [`margins`].
    pub(crate) fn weights(
        &self,
        plant: &Plant,
        actuators: &Actuators,
        dof: Dof,
    ) -> Result<(f64, DMatrix<f64>), Error> {
        let asked = self.design(dof);
        let phase = |truth: &Plant| {
            let found = margins(plant, truth, actuators, &asked)?;
            Ok::<_, Error>(vec![found.get(&dof).map_or(0.0, |own| own.phase_deg)])
        };
        let own = phase(plant)?[0];
        let slopes = slopes(plant, phase)?;
        Ok((own, DMatrix::from_fn(slopes.len(), 1, |k, _| slopes[k][0])))
    }
}
