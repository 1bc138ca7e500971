//! Wraps lines to the width of the terminal, between words.

use std::borrow::Cow;

use anstream::adapter::strip_str;
use unicode_width::UnicodeWidthStr;

/// Additional indent of continuation lines.
const HANGING: usize = 2;

/// Breaks lines wider than `width` columns between words; a wider word is not broken.
pub(crate) fn wrapped(text: &str, width: usize) -> Cow<'_, str> {
    if text.lines().all(|line| columns(line) <= width) {
        return Cow::Borrowed(text);
    }
    let lines = text.split('\n').map(|line| broken(line.trim_end(), width));
    Cow::Owned(lines.collect::<Vec<String>>().join("\n"))
}

/// Returns the width of a text in columns, styles excluded.
fn columns(text: &str) -> usize {
    strip_str(text.trim_end()).to_string().width()
}

fn broken(line: &str, width: usize) -> String {
    if columns(line) <= width {
        return line.to_owned();
    }
    let own = line.len() - line.trim_start_matches(' ').len();
    let indent = if own + HANGING > width / 2 { 0 } else { own + HANGING };
    let mut text = String::new();
    let mut used = 0;
    for word in words(line) {
        let (blanks, bare) = word.split_at(word.len() - word.trim_start_matches(' ').len());
        let (gap, wide) = (blanks.len(), columns(bare));
        if used > own && used + gap + wide > width {
            text.push('\n');
            text.push_str(&" ".repeat(indent));
            used = indent;
        } else {
            text.push_str(blanks);
            used += gap;
        }
        text.push_str(bare);
        used += wide;
    }
    text
}

/// Splits a line into words, each with the blanks before it.
fn words(line: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut start = 0;
    let mut in_word = false;
    for (at, c) in line.char_indices() {
        if c == ' ' && in_word {
            found.push(&line[start..at]);
            start = at;
        }
        in_word = c != ' ';
    }
    found.push(&line[start..]);
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::WARNING;

    #[test]
    fn lines_break_between_words_and_hang() {
        let text = "  warning: thrust in surge seems reversed\nshort";
        let expected = "  warning: thrust\n    in surge seems\n    reversed\nshort";
        assert_eq!(wrapped(text, 18), expected);
        assert_eq!(wrapped(text, 80), text);
    }

    #[test]
    fn styles_have_no_width_and_long_words_are_not_broken() {
        let text = format!("{WARNING}note:{WARNING:#} abc");
        assert_eq!(wrapped(&text, 9), text);
        assert_eq!(wrapped("a /a/very/long/path b", 8), "a\n  /a/very/long/path\n  b");
        assert_eq!(wrapped("12 970 ± 250 kg", 8), "12 970 ±\n  250 kg");
    }
}
