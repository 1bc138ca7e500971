//! Axes in files and flags: one by its name, several as a list or by the name of a set.

use std::fmt;
use std::str::FromStr;

use schemars::{Schema, SchemaGenerator, json_schema};
use serde::de::{Error as _, SeqAccess, Unexpected, Visitor, value::SeqAccessDeserializer};
use serde::{Deserialize, Deserializer};

use crate::{Dof, Error};

/// Named sets of axes.
const SETS: [(&str, &[Dof]); 3] =
    [("six", &Dof::ALL), ("planar", &Dof::PLANAR), ("vertical", &Dof::VERTICAL)];

/// Lists axes in a sentence: `surge, sway and yaw`.
pub(crate) fn listed(axes: &[Dof]) -> String {
    let Some((last, first)) = axes.split_last() else { return String::new() };
    let first: Vec<&str> = first.iter().map(|dof| dof.name()).collect();
    if first.is_empty() { last.to_string() } else { format!("{} and {last}", first.join(", ")) }
}

/// Deserialises axes from a list of names or from the name of a set: `six`, `planar` (surge, sway,
/// yaw) or `vertical` (surge, heave, pitch).
///
/// # Errors
/// An error of the format for a value that is neither, and for an unknown name.
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

/// Returns the schema of the values that [`axes_by_name`] reads.
pub fn schema_of_axes(generator: &mut SchemaGenerator) -> Schema {
    let listed = generator.subschema_for::<Vec<Dof>>();
    json_schema!({ "anyOf": [{ "enum": SETS.map(|(name, _)| name) }, listed] })
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
