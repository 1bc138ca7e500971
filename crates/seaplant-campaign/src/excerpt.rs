//! Shows the line of a TOML file that an error refers to, with a mark under the key.

use std::ops::Range;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::Error;
use crate::bounded::text_of;

impl Error {
    /// Returns the error of an invalid value, with the line of the file that holds it.
    pub(crate) fn value(path: &Path, key: impl Into<String>, reason: impl Into<String>) -> Self {
        let (key, reason) = (key.into(), reason.into());
        let excerpt = excerpt(path, &key);
        Self::Value { path: path.to_owned(), key, reason, excerpt }
    }
}

/// Returns the line that holds `key`, as an error shows it; empty if it cannot be found.
///
/// A key is the path in an error: ``trial `dive 1`, from_s``, `channels."depth".unit`.
fn excerpt(path: &Path, key: &str) -> String {
    let text = text_of(path);
    find(&text, key).map(|span| marked(&text, span)).unwrap_or_default()
}

/// A step of a path.
#[derive(Debug, PartialEq)]
enum Step<'a> {
    /// Into a table.
    Key(&'a str),
    /// To the element of a list with this name.
    Named(&'a str),
}

fn steps(key: &str) -> Vec<Step<'_>> {
    let mut steps = Vec::new();
    let mut rest = key;
    loop {
        rest = rest.trim_start_matches(['.', ',', ' ']);
        let Some(first) = rest.chars().next() else { return steps };
        let quoted = |quote| rest[1..].split_once(quote);
        let (step, after) = match first {
            '`' => quoted('`').map_or((Step::Named(&rest[1..]), ""), |(n, r)| (Step::Named(n), r)),
            '"' => quoted('"').map_or((Step::Key(&rest[1..]), ""), |(k, r)| (Step::Key(k), r)),
            _ => {
                let end = rest.find(['.', ',', ' ']).unwrap_or(rest.len());
                (Step::Key(&rest[..end]), &rest[end..])
            }
        };
        steps.push(step);
        rest = after;
    }
}

/// Returns the bytes of the key, or of its nearest ancestor in the file.
fn find(text: &str, key: &str) -> Option<Range<usize>> {
    let document = DeTable::parse(text).ok()?;
    let mut place = None;
    let mut table = Some(document.get_ref());
    let mut value: Option<&Spanned<DeValue<'_>>> = None;
    for step in steps(key) {
        // Into a list by number; of the only element without one.
        let list = value.and_then(|value| value.get_ref().as_array());
        if let (Some(list), Step::Key(name)) = (list, &step) {
            let number = name.parse::<usize>().ok();
            let Some(element) = list.get(number.unwrap_or(1).saturating_sub(1)) else { break };
            (table, value) = (element.get_ref().as_table(), Some(element));
            place = Some(element.span());
            if number.is_some() {
                continue;
            }
        }
        let next = match step {
            Step::Key(key) => table.and_then(|table| table.get_key_value(key)),
            Step::Named(name) => {
                let element = value.and_then(|value| element(value.get_ref(), name));
                element.and_then(|element| {
                    (table, value) = (element.get_ref().as_table(), Some(element));
                    table?.get_key_value("name")
                })
            }
        };
        let Some((found, inner)) = next else { break };
        place = Some(if matches!(step, Step::Named(_)) { inner.span() } else { found.span() });
        if matches!(step, Step::Key(_)) {
            (table, value) = (inner.get_ref().as_table(), Some(inner));
        }
    }
    place.or_else(|| literally(text, key))
}

fn element<'a, 'i>(list: &'a DeValue<'i>, name: &str) -> Option<&'a Spanned<DeValue<'i>>> {
    let is_named = |element: &&Spanned<DeValue<'_>>| {
        let own = element.get_ref().as_table().and_then(|table| table.get("name"));
        own.and_then(|own| own.get_ref().as_str()) == Some(name)
    };
    // The last, because an error about a duplicate name is about the second.
    list.as_array()?.iter().rfind(is_named)
}

/// Returns the position of text in quotation marks, if the file contains it.
fn literally(text: &str, key: &str) -> Option<Range<usize>> {
    let start = key.find('"')?;
    let end = start + 1 + key[start + 1..].find('"')? + 1;
    let found = text.find(&key[start..end])?;
    Some(found..found + end - start)
}

/// Returns the first number of a TOML text that is NaN or infinite, as written, and its line with a
/// mark; `None` for a text that is not TOML.
pub(crate) fn not_finite(text: &str) -> Option<(String, String)> {
    let document = DeTable::parse(text).ok()?;
    let span = document.get_ref().values().find_map(not_finite_in)?;
    Some((text.get(span.clone())?.to_owned(), marked(text, span)))
}

fn not_finite_in(value: &Spanned<DeValue<'_>>) -> Option<Range<usize>> {
    match value.get_ref() {
        DeValue::Float(number) => {
            let parsed = number.as_str().parse::<f64>();
            parsed.is_ok_and(|number| !number.is_finite()).then(|| value.span())
        }
        DeValue::Array(elements) => elements.iter().find_map(not_finite_in),
        DeValue::Table(table) => table.values().find_map(not_finite_in),
        _ => None,
    }
}

fn marked(text: &str, span: Range<usize>) -> String {
    let before = text.get(..span.start).unwrap_or_default();
    let number = 1 + before.matches('\n').count();
    let start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let line = text[start..].lines().next().unwrap_or_default();
    let column = before[start..].chars().count();
    let within = text.get(span).and_then(|place| place.lines().next()).unwrap_or_default();
    let (gutter, mark) = (number.to_string().len(), "^".repeat(within.chars().count().max(1)));
    format!("\n{:gutter$} |\n{number} | {line}\n{:gutter$} | {:column$}{mark}", "", "", "")
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "vehicle = \"v.toml\"\n\n[[trial]]\nname = \"a\"\nfrom_s = 9\n\n[[trial]]\nname = \"b\"\nlog = [\"ä.csv\"]\nfrom_s = 3\n\n[channels]\n\"depth\" = { column = \"Z\", unit = \"furlong\" }\n";

    fn shown(key: &str) -> String {
        find(TEXT, key).map(|span| marked(TEXT, span)).unwrap_or_default()
    }

    #[test]
    fn the_line_of_a_key_is_shown_with_a_mark_under_it() {
        assert_eq!(shown("vehicle"), "\n  |\n1 | vehicle = \"v.toml\"\n  | ^^^^^^^");
        let of_trial = shown("trial `b`, from_s");
        assert_eq!(of_trial, "\n   |\n10 | from_s = 3\n   | ^^^^^^");
        let unit = shown("channels.\"depth\".unit");
        assert!(unit.ends_with(&format!("\n   | {:26}^^^^", "")), "{unit}");
    }

    #[test]
    fn a_missing_key_shows_the_enclosing_one() {
        let trial = shown("trial `b`, to_s");
        assert!(trial.contains("8 | name = \"b\"\n  |        ^^^"), "{trial}");
        assert_eq!(shown("paper.order"), "");
    }

    #[test]
    fn quoted_text_is_found_literally() {
        let path = shown("path \"ä.csv\"");
        assert!(path.ends_with("9 | log = [\"ä.csv\"]\n  |        ^^^^^^^"), "{path}");
    }

    #[test]
    fn a_file_that_is_no_toml_brings_nothing() {
        assert_eq!(find("= = =", "vehicle"), None);
    }
}
