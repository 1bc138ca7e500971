//! The methods by name.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::online;
use crate::Error;

/// How a plant was found.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// As Smallwood and Whitcomb did: velocity filtered, thrust not.
    Paper,
    /// Least squares on the equation of motion, every term filtered alike.
    EquationError,
    /// Least squares between simulated and measured motion.
    OutputError,
    /// Maximum likelihood on the innovations of a Kalman filter, with what stands between
    /// thrust and water.
    FilterError,
    /// Equation error with each equation weighted by how sure it is.
    WeightedLeastSquares,
    /// Equation error with noise in the regressors, too.
    TotalLeastSquares,
    /// Instrumental variables from the simulated plant.
    Sriv,
    /// An observer whose coefficients adapt, sample by sample.
    Adaptive,
    /// Least squares, sample by sample.
    Recursive,
    /// A Kalman filter with the coefficients in its state, sample by sample.
    Ekf,
}

impl Method {
    /// All methods, the recommended one first.
    pub const ALL: [Self; 10] = [
        Self::FilterError,
        Self::OutputError,
        Self::EquationError,
        Self::Paper,
        Self::WeightedLeastSquares,
        Self::TotalLeastSquares,
        Self::Sriv,
        Self::Adaptive,
        Self::Recursive,
        Self::Ekf,
    ];

    /// The methods that are used where nothing else is said, the recommended one first; the
    /// others are there to compare with.
    pub const DEFAULT: [Self; 4] =
        [Self::FilterError, Self::OutputError, Self::EquationError, Self::Paper];

    /// The method to believe where nothing else is said.
    pub const RECOMMENDED: Self = Self::FilterError;

    /// As files and flags write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::EquationError => "equation-error",
            Self::OutputError => "output-error",
            Self::FilterError => "filter-error",
            Self::WeightedLeastSquares => "weighted-least-squares",
            Self::TotalLeastSquares => "total-least-squares",
            Self::Sriv => "sriv",
            Self::Adaptive => "adaptive",
            Self::Recursive => "recursive",
            Self::Ekf => "ekf",
        }
    }

    /// How it works sample by sample, if it does.
    pub const fn scheme(self) -> Option<online::Scheme> {
        match self {
            Self::Adaptive => Some(online::Scheme::Adaptive),
            Self::Recursive => Some(online::Scheme::Recursive),
            Self::Ekf => Some(online::Scheme::Ekf),
            _ => None,
        }
    }

    /// Whether it takes force as it was logged, so that a lag goes unseen by
    /// the method itself. The paper's has faults that are told before that one.
    pub(crate) const fn takes_force_as_logged(self) -> bool {
        matches!(
            self,
            Self::EquationError
                | Self::WeightedLeastSquares
                | Self::TotalLeastSquares
                | Self::Sriv
                | Self::OutputError
                | Self::Adaptive
                | Self::Recursive
                | Self::Ekf
        )
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Method {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|method| method.name() == text).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            Error::UnknownMethod { found: text.to_owned(), known }
        })
    }
}
