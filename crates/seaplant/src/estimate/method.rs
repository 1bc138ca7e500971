//! The estimation methods.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::online;
use crate::Error;

/// Estimation method.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Method of Smallwood and Whitcomb: velocity filtered, thrust not.
    Paper,
    /// Least squares on the equation of motion, with equally filtered terms.
    EquationError,
    /// Least squares between simulated and measured motion.
    OutputError,
    /// Maximum likelihood on the innovations of a Kalman filter, with a model of thrust, current
    /// and sensors.
    FilterError,
    /// Equation error with each row weighted by its inverse standard deviation.
    WeightedLeastSquares,
    /// Observer with adaptive coefficients, sample by sample.
    Adaptive,
    /// Recursive least squares, sample by sample.
    Recursive,
    /// Extended Kalman filter with the coefficients in its state, sample by sample.
    Ekf,
}

impl Method {
    /// All methods, the recommended one first.
    pub const ALL: [Self; 8] = [
        Self::FilterError,
        Self::OutputError,
        Self::EquationError,
        Self::Paper,
        Self::WeightedLeastSquares,
        Self::Adaptive,
        Self::Recursive,
        Self::Ekf,
    ];

    /// Methods used by default, the recommended one first; the others serve for comparison.
    pub const DEFAULT: [Self; 4] =
        [Self::FilterError, Self::OutputError, Self::EquationError, Self::Paper];

    /// The recommended method.
    pub const RECOMMENDED: Self = Self::FilterError;

    /// Returns the name used in files and flags.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::EquationError => "equation-error",
            Self::OutputError => "output-error",
            Self::FilterError => "filter-error",
            Self::WeightedLeastSquares => "weighted-least-squares",
            Self::Adaptive => "adaptive",
            Self::Recursive => "recursive",
            Self::Ekf => "ekf",
        }
    }

    /// Returns the scheme of methods that work sample by sample.
    pub const fn scheme(self) -> Option<online::Scheme> {
        match self {
            Self::Adaptive => Some(online::Scheme::Adaptive),
            Self::Recursive => Some(online::Scheme::Recursive),
            Self::Ekf => Some(online::Scheme::Ekf),
            _ => None,
        }
    }

    /// Returns true for methods that use force as logged, so that they do not detect a lag. Does
    /// not include the paper's method, whose other errors come first.
    pub(crate) const fn takes_force_as_logged(self) -> bool {
        matches!(
            self,
            Self::EquationError
                | Self::WeightedLeastSquares
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
