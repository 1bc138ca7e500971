//! What is printed: nothing that files hold reaches the terminal but as text.

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

/// How much a command says, and in what form.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// As JSON.
    pub json: bool,
    /// Nothing but errors and what was asked for.
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
    /// Says something that a person may want to know and a program does not.
    pub fn say(self, text: &str) -> Result<()> {
        if self.json || self.quiet {
            return Ok(());
        }
        print(&fitted(text, std::io::stdout()))
    }

    /// Gives the result: as JSON if that was asked for, else in words.
    pub fn give(self, value: &impl Serialize, words: impl FnOnce() -> String) -> Result<()> {
        if self.json {
            return print_json(&serde_json::to_string_pretty(value)?);
        }
        if self.quiet { Ok(()) } else { print(&fitted(&words(), std::io::stdout())) }
    }

    /// Says why nothing could be done.
    pub fn error(self, error: &anyhow::Error) {
        // An error that cannot be printed cannot be helped either.
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

/// Words as wide as the terminal that they go to; as they are where they go to a file or a program.
fn fitted(words: &str, to: impl IsTerminal) -> Cow<'_, str> {
    match terminal_size().filter(|_| to.is_terminal()) {
        Some((Width(width), _)) if width > 0 => wrapped(words, usize::from(width)),
        _ => Cow::Borrowed(words),
    }
}

/// An error with its causes, but not those that its own words hold already.
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

/// Prints to standard output; a reader that has gone away, such as `head`, is no error.
pub fn print(text: &str) -> Result<()> {
    print_raw(&shown(text))
}

/// [`print()`], of JSON.
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

/// A text as a terminal may have it: names of columns, files and trials come from whoever made
/// them, and what would move the cursor, colour the screen or turn the direction of writing is
/// shown by its number. Our own styles stay.
pub fn shown(text: &str) -> Cow<'_, str> {
    escaped(text, |escape, c| _ = write!(escape, "{}", c.escape_unicode()), own_style)
}

/// The same of JSON, which stays JSON of the same value.
fn shown_json(text: &str) -> Cow<'_, str> {
    // What commands has its place in the first plane.
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

/// The length of the style at the start of a text, if it is one of ours.
fn own_style(text: &str) -> usize {
    let styles = [SEVERE, WARNING, STRONG, FAINT];
    let written = styles.iter().flat_map(|style| [format!("{style}"), format!("{style:#}")]);
    written.filter(|style| text.starts_with(style)).map(|style| style.len()).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_shown_by_its_number() {
        assert_eq!(
            shown("a\u{1b}[2Jb\rc\u{9b}d\u{202e}e"),
            "a\\u{1b}[2Jb\\u{d}c\\u{9b}d\\u{202e}e"
        );
        assert_eq!(shown("surge\t1\nµ ±  日本"), "surge\t1\nµ ±  日本");
        let ours = format!("{SEVERE}severe:{SEVERE:#} {WARNING}x{WARNING:#} {FAINT}y{FAINT:#}");
        assert_eq!(shown(&ours), ours);
        // Another style than ours, and one that is cut off.
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
