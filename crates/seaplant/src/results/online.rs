//! Results of recursive methods, as data.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Coefficient, PlantScore};
use crate::estimate::online::OnlineHistory;
use crate::plant::Symmetry;
use crate::{Caveat, Dof, Method};

/// A plant of several axes, estimated recursively.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlantOnline {
    /// Its axes.
    pub axes: Vec<Dof>,
    /// The method of identification.
    pub method: Method,
    /// The axes that M may couple.
    pub symmetry: Symmetry,
    /// Its coefficients by name, as those of a coupled plant.
    pub parameters: BTreeMap<String, Coefficient>,
    /// Their values over time.
    pub history: OnlineHistory,
    /// Number of measured values.
    pub samples: usize,
    /// Its error on the fitted trials.
    pub fit: PlantScore,
    /// Its error on unseen trials.
    pub hold_out: Option<PlantScore>,
    /// Caveats.
    pub caveats: Vec<Caveat>,
}
