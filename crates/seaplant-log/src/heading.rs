//! The name and unit in a column's header.

use crate::Unit;

/// A column's header, taken apart.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Heading {
    /// The header's text, outer blanks gone.
    pub(crate) column: String,
    /// The text without the unit.
    pub(crate) name: String,
    pub(crate) unit: Option<Unit>,
    /// Whether the header's cell was empty.
    pub(crate) nameless: bool,
}

impl Heading {
    /// Takes `u_velo [m/s]` apart. Brackets that hold no unit stay part of the name.
    pub(crate) fn parse(text: &str) -> Self {
        let column = text.trim().to_owned();
        let split = bracketed(&column).and_then(|(name, inside)| {
            // "thruster (1)" counts thrusters; "command [1]" is a ratio.
            let counts = inside == "1" && column.ends_with(')');
            let unit = if counts { None } else { Unit::parse(inside).ok() }?;
            Some((name.to_owned(), unit))
        });
        match split {
            Some((name, unit)) => Self { column, name, unit: Some(unit), nameless: false },
            None => Self { name: column.clone(), nameless: column.is_empty(), column, unit: None },
        }
    }
}

/// The text before a last pair of brackets, and that within.
fn bracketed(text: &str) -> Option<(&str, &str)> {
    let open = match text.chars().last()? {
        ']' => '[',
        ')' => '(',
        '}' => '{',
        _ => return None,
    };
    let at = text.rfind(open)?;
    let name = text[..at].trim();
    (!name.is_empty()).then_some((name, text[at + 1..text.len() - 1].trim()))
}

/// A unit that stands in a row of its own below the names, bracketed or not.
pub(crate) fn lone_unit(text: &str) -> Option<Unit> {
    let text = text.trim();
    let bare = text.strip_prefix(['[', '(']).and_then(|t| t.strip_suffix([']', ')']));
    Unit::parse(bare.unwrap_or(text)).ok()
}
