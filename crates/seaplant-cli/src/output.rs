//! Prints to the terminal; content of files never acts as control sequences.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::{IsTerminal, Write as _};

use anstyle::{AnsiColor, Style};
use anyhow::{Context, Result};
use seaplant_report::is_obeyed;
use serde::Serialize;
use serde_json::json;
use terminal_size::{Width, terminal_size};

use crate::wrap::wrapped;

/// Verbosity and format of a command's output.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// As JSON.
    pub json: bool,
    /// Nothing but errors and the requested result.
    pub quiet: bool,
    /// Progress of fits as lines of JSON on standard error.
    pub progress: bool,
}

/// Bold red.
pub const SEVERE: Style = AnsiColor::Red.on_default().bold();
/// Bold yellow.
pub const WARNING: Style = AnsiColor::Yellow.on_default().bold();
/// Bold.
pub const STRONG: Style = Style::new().bold();
/// Faint.
pub const FAINT: Style = Style::new().dimmed();

impl Output {
    /// Prints a message for users that programs do not need.
    pub fn say(self, text: &str) -> Result<()> {
        if self.json || self.quiet {
            return Ok(());
        }
        print(&fitted(text, std::io::stdout()))
    }

    /// Prints the result: as JSON if requested, else as text.
    pub fn give(self, value: &impl Serialize, words: impl FnOnce() -> String) -> Result<()> {
        if self.json {
            return print_json(&serde_json::to_string_pretty(value)?);
        }
        if self.quiet { Ok(()) } else { print(&fitted(&words(), std::io::stdout())) }
    }

    /// Prints an error.
    pub fn error(self, error: &anyhow::Error) {
        // If printing fails there is nothing else to do.
        if self.json {
            let message = json!({ "error": reasons(error) });
            let _ = writeln!(anstream::stderr(), "{}", shown_json(&format!("{message:#}")));
        } else {
            let reasons = reasons(error);
            let said = format!("{SEVERE}error:{SEVERE:#} {}", shown(&reasons));
            let _ = writeln!(anstream::stderr(), "{}", fitted(&said, std::io::stderr()));
        }
    }
}

/// Wraps text to the width of its terminal; text for a file or a program is unchanged.
fn fitted(words: &str, to: impl IsTerminal) -> Cow<'_, str> {
    match terminal_size().filter(|_| to.is_terminal()) {
        Some((Width(width), _)) if width > 0 => wrapped(words, usize::from(width)),
        _ => Cow::Borrowed(words),
    }
}

/// Formats an error with its causes, except those that its own message contains.
fn reasons(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if text.is_empty() {
            text = cause;
        } else if !text.contains(&cause) {
            text += &format!(": {cause}");
        }
    }
    text
}

/// Prints to standard output; a closed pipe, as from `head`, is no error.
pub fn print(text: &str) -> Result<()> {
    print_raw(&shown(text))
}

/// Prints JSON like [`print()`].
pub fn print_json(text: &str) -> Result<()> {
    print_raw(&shown_json(text))
}

fn print_raw(text: &str) -> Result<()> {
    match writeln!(anstream::stdout(), "{}", text.trim_end_matches('\n')) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(error).context("cannot print")
        }
        _ => Ok(()),
    }
}

/// Escapes a text for a terminal: names of columns, files and trials are untrusted, and characters
/// that would move the cursor, colour the screen or change the direction of writing are shown by
/// their code. Our own styles remain.
pub fn shown(text: &str) -> Cow<'_, str> {
    escaped(text, |escape, c| _ = write!(escape, "{}", c.escape_unicode()), own_style)
}

/// Escapes JSON likewise; its value is unchanged.
fn shown_json(text: &str) -> Cow<'_, str> {
    // Control characters are in the basic plane.
    escaped(text, |escape, c| _ = write!(escape, "\\u{:04x}", u32::from(c)), |_| 0)
}

fn escaped(
    text: &str,
    escape: impl Fn(&mut String, char),
    own: impl Fn(&str) -> usize,
) -> Cow<'_, str> {
    if !text.contains(is_obeyed) {
        return Cow::Borrowed(text);
    }
    let mut safe = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let styled = if is_obeyed(c) { own(rest) } else { 0 };
        let length = styled.max(c.len_utf8());
        if styled > 0 || !is_obeyed(c) {
            safe.push_str(&rest[..length]);
        } else {
            escape(&mut safe, c);
        }
        rest = &rest[length..];
    }
    Cow::Owned(safe)
}

/// Returns the length of the style at the start of a text, if it is one of ours.
fn own_style(text: &str) -> usize {
    let styles = [SEVERE, WARNING, STRONG, FAINT];
    let written = styles.iter().flat_map(|style| [format!("{style}"), format!("{style:#}")]);
    written.filter(|style| text.starts_with(style)).map(|style| style.len()).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terminal_control_characters_are_shown_by_their_number() {
        assert_eq!(
            shown("a\u{1b}[2Jb\rc\u{9b}d\u{202e}e"),
            "a\\u{1b}[2Jb\\u{d}c\\u{9b}d\\u{202e}e"
        );
        assert_eq!(shown("surge\t1\nµ ±  日本"), "surge\t1\nµ ±  日本");
        let ours = format!("{SEVERE}severe:{SEVERE:#} {WARNING}x{WARNING:#} {FAINT}y{FAINT:#}");
        assert_eq!(shown(&ours), ours);
        // A foreign style, and a truncated one.
        assert_eq!(shown("\u{1b}[8mhidden\u{1b}"), "\\u{1b}[8mhidden\\u{1b}");
    }

    #[test]
    fn json_stays_the_same_value() {
        let value = json!({ "name": "a\u{9b}\u{202e}\u{1b}b" });
        let text = serde_json::to_string(&value).expect("JSON");
        let safe = shown_json(&text);
        assert!(!safe.contains(is_obeyed), "{safe:?}");
        assert_eq!(serde_json::from_str::<serde_json::Value>(&safe).expect("JSON"), value);
    }
}
