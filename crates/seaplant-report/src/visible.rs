//! Escapes untrusted names so that a terminal or a page displays them instead of interpreting them.

use std::borrow::Cow;
use std::io::{self, Write};

use serde::Serialize;
use serde_json::ser::{CharEscape, CompactFormatter, Formatter, Serializer};

/// Returns whether a display interprets a character instead of showing it: a control character
/// other than a line feed and a tab, a change of the direction of writing, or a separator of lines.
///
/// ```
/// use seaplant_report::is_obeyed;
/// assert!(is_obeyed('\u{1b}') && is_obeyed('\u{202e}') && !is_obeyed('µ') && !is_obeyed('\n'));
/// ```
pub fn is_obeyed(c: char) -> bool {
    let turns_direction = matches!(
        c,
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
    );
    let ends_line = matches!(c, '\u{2028}' | '\u{2029}');
    (c.is_control() && !matches!(c, '\n' | '\t')) || turns_direction || ends_line
}

/// Replaces every character that a display interprets by its number, as `\u{202e}`.
pub(crate) fn visible(text: &str) -> Cow<'_, str> {
    if !text.contains(is_obeyed) {
        return Cow::Borrowed(text);
    }
    let numbered = |c: char| if is_obeyed(c) { numbered(c) } else { c.to_string() };
    Cow::Owned(text.chars().map(numbered).collect())
}

/// Formats the number of a character, as `\u{202e}`.
pub(crate) fn numbered(c: char) -> String {
    c.escape_unicode().to_string()
}

/// Writes a value as JSON whose strings, once parsed, are [`visible`].
///
/// # Errors
/// Those of the value.
pub(crate) fn visible_json(value: &impl Serialize) -> serde_json::Result<String> {
    let mut json = Vec::new();
    value.serialize(&mut Serializer::with_formatter(&mut json, Visible))?;
    Ok(String::from_utf8(json).expect("JSON is UTF-8"))
}

struct Visible;

impl Formatter for Visible {
    fn write_string_fragment<W: ?Sized + Write>(
        &mut self,
        writer: &mut W,
        fragment: &str,
    ) -> io::Result<()> {
        // Within JSON the backslash of a number is doubled.
        let shown = match visible(fragment) {
            Cow::Borrowed(same) => Cow::Borrowed(same),
            Cow::Owned(changed) => Cow::Owned(changed.replace('\\', "\\\\")),
        };
        writer.write_all(shown.as_bytes())
    }

    fn write_char_escape<W: ?Sized + Write>(
        &mut self,
        writer: &mut W,
        escape: CharEscape,
    ) -> io::Result<()> {
        let obeyed = match escape {
            CharEscape::Backspace => '\u{8}',
            CharEscape::FormFeed => '\u{c}',
            CharEscape::CarriageReturn => '\r',
            CharEscape::AsciiControl(byte) => char::from(byte),
            shown => return CompactFormatter.write_char_escape(writer, shown),
        };
        write!(writer, "\\{}", numbered(obeyed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOSTILE: &str = "a\u{1b}[2J\r\u{7f}\u{9b}\u{202e}\u{2028}\\\"\n\tµ";

    #[test]
    fn control_characters_are_shown_by_their_number() {
        let shown = "a\\u{1b}[2J\\u{d}\\u{7f}\\u{9b}\\u{202e}\\u{2028}\\\"\n\tµ";
        assert_eq!(visible(HOSTILE), shown);
        assert_eq!(visible("surge\t1\nµ ±  日本"), "surge\t1\nµ ±  日本");
    }

    #[test]
    fn strings_of_json_are_visible_once_parsed() {
        let json = visible_json(&[HOSTILE]).expect("JSON");
        let [parsed] = serde_json::from_str::<[String; 1]>(&json).expect("JSON");
        assert_eq!(parsed, visible(HOSTILE));
    }
}
