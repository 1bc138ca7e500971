//! The terms of the plant model that are fitted.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{Error, LumpedParameters};

/// One term of `v̇ = α τ + β v|v| + μ v + bias`.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Term {
    /// α τ.
    Force,
    /// β v|v|.
    Quadratic,
    /// μ v.
    Linear,
    /// The constant.
    Bias,
}

impl Term {
    /// All four, in the order of `[α, β, μ, bias]`.
    pub const ALL: [Self; 4] = [Self::Force, Self::Quadratic, Self::Linear, Self::Bias];

    /// Returns the name in files and flags.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Force => "force",
            Self::Quadratic => "quadratic",
            Self::Linear => "linear",
            Self::Bias => "bias",
        }
    }
}

/// The fitted terms; the coefficients of the others are fixed at zero.
///
/// By default force, quadratic drag and bias: in the paper a bias did better in every
/// degree of freedom and linear drag did not help [Jason2, §4].
///
/// ```
/// use seaplant::{Term, Terms};
/// let terms: Terms = "force,quadratic".parse()?;
/// assert!(terms.has(Term::Quadratic) && !terms.has(Term::Bias));
/// # Ok::<(), seaplant::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terms {
    fitted: [bool; 4],
}

impl Default for Terms {
    fn default() -> Self {
        Self { fitted: [true, true, false, true] }
    }
}

impl Terms {
    /// Checks a choice of terms.
    ///
    /// # Errors
    /// [`Error::Terms`] unless force and at least one drag are among them.
    pub fn new(terms: &[Term]) -> Result<Self, Error> {
        let fitted = Term::ALL.map(|term| terms.contains(&term));
        if fitted[0] && (fitted[1] || fitted[2]) {
            Ok(Self { fitted })
        } else {
            let names: Vec<_> = terms.iter().map(|term| term.name()).collect();
            Err(Error::Terms { found: names.join(", ") })
        }
    }

    /// Returns every choice of terms that makes a plant model.
    pub fn subsets() -> Vec<Self> {
        let choice = |bits: usize| -> Vec<Term> {
            Term::ALL
                .into_iter()
                .enumerate()
                .filter(|(j, _)| bits >> j & 1 == 1)
                .map(|x| x.1)
                .collect()
        };
        (0..16).filter_map(|bits| Self::new(&choice(bits)).ok()).collect()
    }

    /// Returns whether a term is fitted.
    pub fn has(self, term: Term) -> bool {
        self.fitted[term as usize]
    }

    /// Returns the fitted terms, in order.
    pub fn fitted(self) -> Vec<Term> {
        Term::ALL.into_iter().filter(|&term| self.has(term)).collect()
    }

    /// Returns the number of fitted terms.
    pub fn count(self) -> usize {
        self.fitted.iter().filter(|fitted| **fitted).count()
    }

    /// Builds parameters from the coefficients of the fitted terms, in order.
    pub(crate) fn unpack(self, coefficients: &[f64]) -> LumpedParameters {
        let mut all = [0.0; 4];
        for (term, value) in self.fitted().into_iter().zip(coefficients) {
            all[term as usize] = *value;
        }
        let [alpha, beta, mu, bias] = all;
        LumpedParameters { alpha, beta, mu, bias }
    }
}

impl fmt::Display for Terms {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<_> = self.fitted().iter().map(|term| term.name()).collect();
        f.write_str(&names.join(", "))
    }
}

impl FromStr for Terms {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let find = |name: &str| {
            Term::ALL
                .into_iter()
                .find(|term| term.name() == name.trim())
                .ok_or_else(|| Error::UnknownTerm { found: name.trim().to_owned() })
        };
        Self::new(&text.split(',').map(find).collect::<Result<Vec<_>, _>>()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_six_plant_models() {
        let all: Vec<String> = Terms::subsets().iter().map(Terms::to_string).collect();
        assert_eq!(all.len(), 6, "{all:?}");
        assert!(all.contains(&"force, quadratic, linear, bias".to_owned()));
    }

    #[test]
    fn refuses_a_model_without_drag() {
        let message = "force,bias".parse::<Terms>().expect_err("no drag").to_string();
        assert!(message.contains("[force, bias]"), "{message}");
    }
}
