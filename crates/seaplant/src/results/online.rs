//! What methods that work sample by sample tell beside their plant, as data.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Coefficient, CoupledScore};
use crate::estimate::online::OnlineHistory;
use crate::plant::Symmetry;
use crate::{Caveat, Dof, Method};

/// A plant of several axes, found sample by sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CoupledOnline {
    /// Its axes.
    pub axes: Vec<Dof>,
    /// How it was found.
    pub method: Method,
    /// Which axes M may couple.
    pub symmetry: Symmetry,
    /// Its coefficients by name, as those of a coupled plant.
    pub parameters: BTreeMap<String, Coefficient>,
    /// How they went there.
    pub history: OnlineHistory,
    /// Numbers measured.
    pub samples: usize,
    /// Its error on the trials that it was fitted to.
    pub fit: CoupledScore,
    /// Its error on trials that it had not seen.
    pub hold_out: Option<CoupledScore>,
    /// Doubts.
    pub caveats: Vec<Caveat>,
}
