//! The six degrees of freedom, by name.

use std::fmt;
use std::str::FromStr;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Error as _, SeqAccess, Unexpected, Visitor, value::SeqAccessDeserializer};
use serde::{Deserialize, Deserializer, Serialize};

use crate::Error;

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
    /// Of displacement.
    pub position: &'static str,
    /// Of velocity.
    pub velocity: &'static str,
    /// Of acceleration.
    pub acceleration: &'static str,
    /// Of force or moment.
    pub force: &'static str,
    /// Of mass or moment of inertia, added mass included.
    pub mass: &'static str,
    /// Of quadratic drag.
    pub quadratic_drag: &'static str,
    /// Of linear drag.
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

    /// Those in which a surface vehicle moves.
    pub const PLANAR: [Self; 3] = [Self::Surge, Self::Sway, Self::Yaw];

    /// Those in which a vehicle dives and climbs on a straight course.
    pub const VERTICAL: [Self; 3] = [Self::Surge, Self::Heave, Self::Pitch];

    /// The place of this degree of freedom in ν = [u v w p q r] and τ = [X Y Z K M N].
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Whether this is a rotation: its mass is an inertia, its force a moment.
    pub const fn is_rotation(self) -> bool {
        matches!(self, Self::Roll | Self::Pitch | Self::Yaw)
    }

    /// The name in lower case, as files and flags write it.
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

    /// The units of this degree of freedom's quantities.
    pub const fn units(self) -> Units {
        if self.is_rotation() { ROTARY } else { LINEAR }
    }
}

/// Sets of axes that have a name.
const SETS: [(&str, &[Dof]); 3] =
    [("six", &Dof::ALL), ("planar", &Dof::PLANAR), ("vertical", &Dof::VERTICAL)];

/// Reads axes, which a file states as a list, or by the name of a common set: `six`, `planar`
/// (surge, sway, yaw) or `vertical` (surge, heave, pitch).
///
/// # Errors
/// Of what is neither, and of a name that no axis has.
///
/// # Example
/// ```
/// use seaplant::{Dof, axes_by_name};
/// let axes = axes_by_name(serde_json::json!("planar"))?;
/// assert_eq!(axes, [Dof::Surge, Dof::Sway, Dof::Yaw]);
/// assert_eq!(axes_by_name(serde_json::json!(["heave"]))?, [Dof::Heave]);
/// # Ok::<(), serde_json::Error>(())
/// ```
pub fn axes_by_name<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Dof>, D::Error> {
    struct Axes;
    impl<'de> Visitor<'de> for Axes {
        type Value = Vec<Dof>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str(
                "a list such as [\"surge\", \"yaw\"], or \"six\", \"planar\" (surge, sway, yaw) or \"vertical\" (surge, heave, pitch)",
            )
        }

        fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<Vec<Dof>, E> {
            let named = SETS.iter().find(|(known, _)| *known == name);
            let named = named.map(|(_, axes)| axes.to_vec());
            named.ok_or_else(|| E::invalid_value(Unexpected::Str(name), &self))
        }

        fn visit_seq<A: SeqAccess<'de>>(self, listed: A) -> Result<Vec<Dof>, A::Error> {
            Vec::deserialize(SeqAccessDeserializer::new(listed))
        }
    }
    let axes = deserializer.deserialize_any(Axes)?;
    match axes.iter().enumerate().find(|(k, dof)| axes[..*k].contains(dof)) {
        Some((_, twice)) => Err(D::Error::custom(format!("{twice} stands twice among the axes"))),
        None => Ok(axes),
    }
}

/// The schema of what [`axes_by_name`] reads.
pub fn schema_of_axes(generator: &mut SchemaGenerator) -> Schema {
    let listed = generator.subschema_for::<Vec<Dof>>();
    json_schema!({ "anyOf": [{ "enum": SETS.map(|(name, _)| name) }, listed] })
}

impl fmt::Display for Dof {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Dof {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        Self::ALL
            .into_iter()
            .find(|dof| dof.name() == text)
            .ok_or_else(|| Error::UnknownDof { found: text.to_owned() })
    }
}
