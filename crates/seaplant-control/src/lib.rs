//! Controllers on identified plants.
//!
//! ```text
//! PD, PID      τ = −K_p e − K_d ė − K_i ∫e dt
//! exact        τ = M̂ (ν̇_d − k_d ė − k_p e) + n̂(ν, η)
//! non-exact    τ = M̂ ν̇_d + n̂(ν_d, η) − K_d ė − K_p e
//! Slotine–Li   τ = M̂ ν̇_s + Ĉ(ν) ν_s + D̂(ν) ν_s + ĝ(η) − K s − K_e e,   s = ė + Λ e
//! ```
//!
//! each with the plant as it was identified or adapting to the vehicle, on one to six axes.
//! [`design()`] computes gains from bandwidth and damping, or from LQR weights, checks them against
//! lag, delay and sampling, and returns margins over the uncertainty of the coefficients;
//! [`Controller`] runs them.
//!
//! ```
//! use seaplant::Dof;
//! use seaplant_control::{Actuators, Design, Law, Tuning, design};
//! use seaplant::plant::{Plant, Structure, Symmetry};
//! let plant = Plant::new(Structure::of(&[Dof::Surge], Symmetry::None)?, vec![100.0, 5.0, 20.0])?;
//! let actuators = Actuators { lag_s: [0.3; 6], ..Actuators::default() };
//! let asked = Design { law: Law::Pd, tuning: [(Dof::Surge, Tuning::new(0.1, 1.0))].into(), ..Design::default() };
//! let gains = design(&plant, &[], &actuators, &asked)?;
//! assert!(gains.axes[&Dof::Surge].margins.phase_deg > 45.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod ardusub;
mod c;
mod controller;
mod design;
mod error;
mod limits;
mod linear;
mod margins;
mod of_model;
mod response;
mod track;

pub use ardusub::ardusub;
pub use c::c_header;
pub use controller::{Adaptation, Controller, Reference, State};
pub use design::{
    Actuators, AxisGains, Design, GAINS_SCHEMA, Gains, LqrWeights, Tuning, design, gains_of_toml,
    margins,
};
pub use error::Error;
pub use margins::Margins;
pub use of_model::{check_usable, doubts_of_model};
pub use response::{Curve, Response, responses};
pub use track::{Path, Sea, Tracked, track};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A control law.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// Proportional and derivative.
    Pd,
    /// The same with an integral.
    Pid,
    /// Model-based, linearising exactly: the plant's forces at the measured velocity.
    Exact,
    /// Model-based, linearising only at the desired velocity.
    #[default]
    NonExact,
    /// Model-based, of Slotine and Li.
    SlotineLi,
}

impl Law {
    /// All laws.
    pub const ALL: [Self; 5] = [Self::Pd, Self::Pid, Self::Exact, Self::NonExact, Self::SlotineLi];

    /// Returns the name in files and flags.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pd => "pd",
            Self::Pid => "pid",
            Self::Exact => "exact",
            Self::NonExact => "non-exact",
            Self::SlotineLi => "slotine-li",
        }
    }

    /// Returns whether the law contains a model of the plant.
    pub const fn is_model_based(self) -> bool {
        matches!(self, Self::Exact | Self::NonExact | Self::SlotineLi)
    }
}

impl std::str::FromStr for Law {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|law| law.name() == text).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            Error::UnknownLaw { found: text.to_owned(), known }
        })
    }
}
