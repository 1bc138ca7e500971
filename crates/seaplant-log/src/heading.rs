//! The name and unit in a column's header.

use crate::Unit;

/// A parsed column header.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Heading {
    /// Header text, trimmed.
    pub(crate) column: String,
    /// Text without the unit.
    pub(crate) name: String,
    pub(crate) unit: Option<Unit>,
    /// True if the header cell was empty.
    pub(crate) nameless: bool,
    /// True if the type of the column is an instant, whatever its name.
    pub(crate) instant: bool,
}

impl Heading {
    /// Splits `u_velo [m/s]` into name and unit. Brackets that hold no unit stay part of the name.
    pub(crate) fn parse(text: &str) -> Self {
        // A header may be broken into lines; a name in a message or a table may not.
        let column = text.trim().replace("\r\n", " ").replace(['\r', '\n', '\t'], " ");
        let split = bracketed(&column).and_then(|(name, inside)| {
            // "thruster (1)" counts thrusters; "command (1)" and "command [1]" are ratios.
            let counts = inside == "1" && column.ends_with(')') && !is_of_ratio(name);
            let unit = if counts { None } else { Unit::find(inside) }?;
            Some((name.to_owned(), unit))
        });
        let (name, unit) = match split {
            Some((name, unit)) => (name, Some(unit)),
            None => (column.clone(), None),
        };
        Self { nameless: column.is_empty(), instant: false, column, name, unit }
    }
}

/// Returns whether the last word of a name names a ratio, so that `(1)` after it is its unit.
fn is_of_ratio(name: &str) -> bool {
    const RATIOS: &[&str] =
        &["command", "cmd", "throttle", "duty", "ratio", "setpoint", "level", "effort", "input"];
    let last = name.rsplit(|c: char| !c.is_alphanumeric()).next().unwrap_or_default();
    RATIOS.contains(&last.to_lowercase().as_str())
}

/// Splits the text before a last pair of brackets from the text within.
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

/// Parses a unit in a row of its own below the names, bracketed or not.
pub(crate) fn lone_unit(text: &str) -> Option<Unit> {
    let text = text.trim();
    let bare = text.strip_prefix(['[', '(']).and_then(|t| t.strip_suffix([']', ')']));
    Unit::find(bare.unwrap_or(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_what_the_last_brackets_hold() {
        let parts = |text: &str| {
            let Heading { name, unit, .. } = Heading::parse(text);
            (name, unit.map(|unit| unit.symbol().to_owned()))
        };
        let some = |name: &str, unit: &str| (name.to_owned(), Some(unit.to_owned()));
        assert_eq!(parts(" u_velo [m/s] "), some("u_velo", "m/s"));
        assert_eq!(parts("rate(deg/s)"), some("rate", "deg/s"));
        assert_eq!(parts("port command (1)"), some("port command", "1"));
        assert_eq!(parts("force {N}"), some("force", "N"));
        assert_eq!(parts("force\r\nport\n[N]"), some("force port", "N"));
        assert_eq!(parts("force (port) [N]"), some("force (port)", "N"));
        for text in ["depth, m", "u (raw)", "[m]", "u [m/s", "u m/s]", "thruster (1)", ""] {
            assert_eq!(parts(text), (text.to_owned(), None));
        }
    }
}
