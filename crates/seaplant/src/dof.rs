//! The six degrees of freedom, by name.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A degree of freedom of a marine vehicle, in SNAME order.
///
/// Body frame: x forward, y starboard, z down. Surge, sway and heave are
/// translations along x, y and z; roll, pitch and yaw rotations about them.
///
/// ```
/// use seaplant::Dof;
/// assert_eq!("heave".parse::<Dof>()?, Dof::Heave);
/// assert_eq!(Dof::Yaw.units().mass, "kg m²");
/// # Ok::<(), seaplant::Error>(())
/// ```
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Dof {
    /// Along x, forward.
    Surge,
    /// Along y, to starboard.
    Sway,
    /// Along z, down.
    Heave,
    /// About x, starboard side down.
    Roll,
    /// About y, bow up.
    Pitch,
    /// About z, bow to starboard.
    Yaw,
}

/// The units in which the quantities of one degree of freedom are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Units {
    /// Unit of displacement.
    pub position: &'static str,
    /// Unit of velocity.
    pub velocity: &'static str,
    /// Unit of acceleration.
    pub acceleration: &'static str,
    /// Unit of force or moment.
    pub force: &'static str,
    /// Unit of mass or moment of inertia, added mass included.
    pub mass: &'static str,
    /// Unit of quadratic drag.
    pub quadratic_drag: &'static str,
    /// Unit of linear drag.
    pub linear_drag: &'static str,
}

const LINEAR: Units = Units {
    position: "m",
    velocity: "m/s",
    acceleration: "m/s²",
    force: "N",
    mass: "kg",
    quadratic_drag: "N/(m/s)²",
    linear_drag: "N/(m/s)",
};

const ROTARY: Units = Units {
    position: "rad",
    velocity: "rad/s",
    acceleration: "rad/s²",
    force: "N m",
    mass: "kg m²",
    quadratic_drag: "N m/(rad/s)²",
    linear_drag: "N m/(rad/s)",
};

impl Dof {
    /// All six, in SNAME order.
    pub const ALL: [Self; 6] =
        [Self::Surge, Self::Sway, Self::Heave, Self::Roll, Self::Pitch, Self::Yaw];

    /// The axes of a surface vessel.
    pub const PLANAR: [Self; 3] = [Self::Surge, Self::Sway, Self::Yaw];

    /// The axes of motion in the vertical plane.
    pub const VERTICAL: [Self; 3] = [Self::Surge, Self::Heave, Self::Pitch];

    /// Returns the index of this degree of freedom in ν = [u v w p q r] and τ = [X Y Z K M N].
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Returns whether this is a rotation: its mass is an inertia, its force a moment.
    pub const fn is_rotation(self) -> bool {
        matches!(self, Self::Roll | Self::Pitch | Self::Yaw)
    }

    /// Returns the name in lower case, as in files and flags.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Surge => "surge",
            Self::Sway => "sway",
            Self::Heave => "heave",
            Self::Roll => "roll",
            Self::Pitch => "pitch",
            Self::Yaw => "yaw",
        }
    }

    /// Returns the units of this degree of freedom's quantities.
    pub const fn units(self) -> Units {
        if self.is_rotation() { ROTARY } else { LINEAR }
    }
}

impl fmt::Display for Dof {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}
