//! Published hull forces of ships, as terms of one structure.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Basis, Structure};
use crate::{Dof, Error};

/// A published set of hull forces for surge, sway and yaw.
///
/// It replaces linear and quadratic damping of sway and yaw, and linear drag in surge. C(M) stays
/// explicit: Munk's moment is that of M, so that N_v here is that of the set plus `m22 − m11`.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum HullModel {
    /// Polynomials in v/U and rL/U times U², third order in sway and yaw.
    ///
    /// # Source
    /// [Yasukawa2015, eq. (9)].
    Mmg,
    /// Third-order Taylor terms about straight motion: uv, ur, vvv, vvr, vrr, rrr.
    ///
    /// # Source
    /// \[Abkowitz1964\], with linear terms that grow with speed.
    Abkowitz,
    /// Second-order moduli: uv, ur, |v|v, |v|r, |r|v, |r|r.
    ///
    /// # Source
    /// \[Norrbin1971\].
    Modulus,
}

impl HullModel {
    /// All sets.
    pub const ALL: [Self; 3] = [Self::Mmg, Self::Abkowitz, Self::Modulus];

    /// Returns the name in campaign files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mmg => "mmg",
            Self::Abkowitz => "abkowitz",
            Self::Modulus => "modulus",
        }
    }

    /// Returns the initial terms of sway and of yaw.
    const fn usual(self) -> [&'static str; 2] {
        match self {
            Self::Mmg => ["Uv", "Ur"],
            Self::Abkowitz | Self::Modulus => ["uv", "ur"],
        }
    }

    /// Returns the candidate terms of sway and of yaw.
    const fn cross_candidates(self) -> [&'static str; 4] {
        match self {
            Self::Mmg => ["vvv/U", "vvr/U", "vrr/U", "rrr/U"],
            Self::Abkowitz => ["vvv", "vvr", "vrr", "rrr"],
            Self::Modulus => ["|v|v", "|v|r", "|r|v", "|r|r"],
        }
    }

    /// Returns the candidate terms of surge.
    const fn surge_candidates(self) -> &'static [&'static str] {
        match self {
            Self::Mmg => &["vv", "vr", "rr", "vvvv/UU"],
            Self::Abkowitz => &["vv", "vr", "rr", "uuu"],
            Self::Modulus => &["vv", "vr", "rr"],
        }
    }

    /// Returns the structure with the set's initial terms instead of damping in sway and yaw and
    /// linear drag in surge, and the candidate terms.
    ///
    /// # Errors
    /// [`Error::Plant`] unless surge, sway and yaw are among its axes.
    ///
    /// # Example
    /// ```
    /// use seaplant::Dof;
    /// use seaplant::plant::{HullModel, Structure, Symmetry};
    /// let axes = [Dof::Surge, Dof::Sway, Dof::Yaw];
    /// let usual = Structure::of(&axes, Symmetry::PortStarboard)?;
    /// let (ship, tried) = HullModel::Mmg.shape(&usual)?;
    /// assert_eq!(ship.names()[4..], ["surge: |u|u", "sway: Uv", "sway: Ur", "yaw: Uv", "yaw: Ur"]);
    /// assert_eq!(tried.len(), 12);
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn shape(self, usual: &Structure) -> Result<(Structure, Vec<Basis>), Error> {
        let planar = [Dof::Surge, Dof::Sway, Dof::Yaw];
        if let Some(lacks) = planar.iter().find(|dof| !usual.axes().contains(dof)) {
            let reason = format!(
                "model = \"{self}\" needs surge, sway and yaw, and the plant has no {lacks}; add it to axes, or leave model out"
            );
            return Err(Error::Plant { axes: usual.name(), reason });
        }
        let replaced = ["surge: u", "sway: v", "sway: |v|v", "yaw: r", "yaw: |r|r"];
        let mut structure = usual.without(|term| replaced.contains(&term.to_string().as_str()));
        let term = |on: Dof, product: &str| format!("{on}: {product}").parse::<Basis>();
        let mut tried = Vec::new();
        for product in self.surge_candidates() {
            tried.push(term(Dof::Surge, product)?);
        }
        for on in [Dof::Sway, Dof::Yaw] {
            for product in self.usual() {
                structure = structure.with(term(on, product)?)?;
            }
            for product in self.cross_candidates() {
                tried.push(term(on, product)?);
            }
        }
        Ok((structure, tried))
    }
}

impl fmt::Display for HullModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Symmetry;

    #[test]
    fn a_model_of_ships_needs_surge_sway_and_yaw() {
        let pair = Structure::of(&[Dof::Sway, Dof::Yaw], Symmetry::PortStarboard).expect("axes");
        let error = HullModel::Mmg.shape(&pair).expect_err("no surge").to_string();
        assert!(error.contains("surge") && error.contains("mmg"), "{error}");
    }

    #[test]
    fn every_set_makes_a_structure_of_all_its_terms() {
        let axes = [Dof::Surge, Dof::Sway, Dof::Yaw];
        let usual = Structure::of(&axes, Symmetry::PortStarboard).expect("axes");
        for model in HullModel::ALL {
            let (structure, tried) = model.shape(&usual).expect("planar");
            let whole = tried.iter().try_fold(structure, |all, term| all.with(*term));
            assert!(whole.expect("each once").terms().len() >= 20, "{model}");
        }
    }
}
