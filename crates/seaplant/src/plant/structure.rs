//! Which terms a plant has, on which axes.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Basis, Product};
use crate::{Dof, Error};

/// Which axes a vehicle's shape lets M couple.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Symmetry {
    /// Port is like starboard: surge, heave and pitch couple, and sway, roll and yaw.
    #[default]
    PortStarboard,
    /// Every axis may couple with every other.
    None,
    /// No axis couples by mass.
    Diagonal,
}

impl Symmetry {
    /// Whether M may couple two axes.
    pub fn couples(self, i: Dof, j: Dof) -> bool {
        let is_lengthwise = |dof| matches!(dof, Dof::Surge | Dof::Heave | Dof::Pitch);
        match self {
            _ if i == j => true,
            Self::PortStarboard => is_lengthwise(i) == is_lengthwise(j),
            Self::None => true,
            Self::Diagonal => false,
        }
    }

    /// As campaign files write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::PortStarboard => "port-starboard",
            Self::None => "none",
            Self::Diagonal => "diagonal",
        }
    }
}

impl fmt::Display for Symmetry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// The terms of a plant: the equation of motion without its numbers.
///
/// ```text
/// M ν̇_r + C(M, ν_r) ν_r + Σ products + g(η) = τ
/// ```
///
/// M is symmetric and couples what [`Symmetry`] allows; C follows from M and has no
/// parameters of its own.
///
/// ```
/// use seaplant::Dof;
/// use seaplant::plant::{Structure, Symmetry};
/// let planar = Structure::of(&[Dof::Surge, Dof::Sway, Dof::Yaw], Symmetry::PortStarboard)?;
/// let names: Vec<String> = planar.terms().iter().map(ToString::to_string).collect();
/// assert_eq!(names[..4], ["mass.surge", "mass.sway", "mass.sway-yaw", "mass.yaw"]);
/// assert_eq!(names[4..6], ["surge: u", "surge: |u|u"]);
/// assert_eq!(names.len(), 10);
/// # Ok::<(), seaplant::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Structure {
    axes: Vec<Dof>,
    symmetry: Symmetry,
    terms: Vec<Basis>,
}

impl Structure {
    /// Mass as symmetry allows, linear and quadratic damping of each axis by itself, weight
    /// minus buoyancy where heave is one of the axes, and a righting lever where roll or
    /// pitch is.
    ///
    /// # Errors
    /// [`Error::Plant`] without axes, or with one twice.
    pub fn of(axes: &[Dof], symmetry: Symmetry) -> Result<Self, Error> {
        let mut sorted = axes.to_vec();
        sorted.sort();
        let refuse =
            |reason: &str| Error::Plant { axes: name_of_axes(axes), reason: reason.to_owned() };
        if sorted.is_empty() {
            return Err(refuse("has no axes; name them, as [\"surge\", \"sway\", \"yaw\"]"));
        }
        if sorted.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err(refuse("has an axis twice; name each once"));
        }
        let mut terms = Vec::new();
        for (k, &i) in sorted.iter().enumerate() {
            let coupled = sorted[k..].iter().filter(|j| symmetry.couples(i, **j));
            terms.extend(coupled.map(|&j| Basis::Mass(i, j)));
        }
        for &on in &sorted {
            terms.push(Basis::Product(on, Product::linear(on)));
            terms.push(Basis::Product(on, Product::quadratic(on)));
        }
        if sorted.contains(&Dof::Heave) {
            terms.push(Basis::WeightExcess);
        }
        if sorted.contains(&Dof::Roll) || sorted.contains(&Dof::Pitch) {
            terms.push(Basis::Lever(2));
        }
        Ok(Self { axes: sorted, symmetry, terms })
    }

    /// The same with one term more.
    ///
    /// # Errors
    /// [`Error::Plant`] if the term is there already, or reads or acts on an axis that the
    /// plant does not have.
    pub fn with(mut self, term: Basis) -> Result<Self, Error> {
        let refuse = |reason: String| Error::Plant { axes: name_of_axes(&self.axes), reason };
        if self.terms.contains(&term) {
            return Err(refuse(format!("it has the term \"{term}\" already; leave it out")));
        }
        let reads: Vec<Dof> = match term {
            Basis::Product(_, product) => product.factors().map(|factor| factor.of).collect(),
            _ => Vec::new(),
        };
        let acts = match term {
            Basis::Product(..) | Basis::One(_) | Basis::Mass(..) => term.axes(),
            Basis::WeightExcess | Basis::Lever(_) => Vec::new(),
        };
        let strange = acts.into_iter().chain(reads).find(|dof| !self.axes.contains(dof));
        if let Some(dof) = strange {
            return Err(refuse(format!(
                "the term \"{term}\" needs {dof}, which is none of its axes; add it to axes, or drop the term"
            )));
        }
        self.terms.push(term);
        Ok(self)
    }

    /// The same without some terms.
    pub fn without(&self, drop: impl Fn(&Basis) -> bool) -> Self {
        let terms = self.terms.iter().copied().filter(|term| !drop(term)).collect();
        Self { terms, ..self.clone() }
    }

    /// The axes, in SNAME order.
    pub fn axes(&self) -> &[Dof] {
        &self.axes
    }

    /// Which axes M may couple.
    pub fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    /// The terms; a plant has a coefficient for each.
    pub fn terms(&self) -> &[Basis] {
        &self.terms
    }

    /// The place of a term among [`Self::terms`].
    pub fn index_of(&self, term: &Basis) -> Option<usize> {
        self.terms.iter().position(|known| known == term)
    }

    /// `surge-sway-yaw`.
    pub fn name(&self) -> String {
        name_of_axes(&self.axes)
    }
}

fn name_of_axes(axes: &[Dof]) -> String {
    let names: Vec<&str> = axes.iter().map(|dof| dof.name()).collect();
    names.join("-")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn port_starboard_symmetry_leaves_twelve_masses_of_twenty_one() {
        let masses = |symmetry| {
            let six = Structure::of(&Dof::ALL, symmetry).expect("six axes");
            six.terms().iter().filter(|term| matches!(term, Basis::Mass(..))).count()
        };
        assert_eq!(
            [Symmetry::PortStarboard, Symmetry::None, Symmetry::Diagonal].map(masses),
            [12, 21, 6]
        );
    }

    #[test]
    fn refuses_a_term_of_an_axis_that_is_not_there() {
        let planar = Structure::of(&[Dof::Surge, Dof::Sway], Symmetry::None).expect("two axes");
        let error = planar.with("sway: |r|r".parse().expect("a term")).expect_err("no yaw");
        assert!(error.to_string().contains("needs yaw"), "{error}");
    }

    #[test]
    fn refuses_an_axis_twice() {
        let error = Structure::of(&[Dof::Yaw, Dof::Yaw], Symmetry::None).expect_err("twice");
        assert!(error.to_string().contains("twice"), "{error}");
    }
}
