//! Parses the time of receipt that a recorder writes before a sentence.

use super::line;
use crate::cell::stamp;

/// Notation of times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// ISO 8601, or date and time as two words.
    DateTime,
    /// `HH:MM:SS.sss`.
    TimeOfDay,
    /// A count since 1970 of `second` units per second.
    Epoch { second: f64 },
    /// A count of seconds from an arbitrary start.
    Seconds,
}

/// Reads the times before sentences.
#[derive(Debug)]
pub(super) struct Prefix {
    shape: Shape,
    /// Previous time of day, and the number of midnights passed.
    before_s: f64,
    midnights: f64,
}

const DAY_S: f64 = 86_400.0;

impl Prefix {
    /// Detects the notation of the times before most of some lines with sentences, if there are
    /// any.
    pub(super) fn detect<'a>(lines: impl Iterator<Item = &'a [u8]>) -> Option<Self> {
        let shape = |line: &'a [u8]| {
            let sentence = line::sentences(line).next()?;
            Some(find(&line[..sentence.prefix]).map(|(shape, _)| shape))
        };
        let shapes: Vec<Option<Shape>> = lines.filter_map(shape).collect();
        let timed = shapes.iter().flatten().count();
        let shape = *shapes.iter().flatten().next()?;
        (2 * timed > shapes.len()).then_some(Self { shape, before_s: 0.0, midnights: 0.0 })
    }

    /// Parses the time of receipt, s; `None` unless its notation is that of most lines.
    pub(super) fn time(&mut self, prefix: &[u8]) -> Option<f64> {
        let (shape, time) = find(prefix)?;
        if shape != self.shape {
            return None;
        }
        match shape {
            Shape::DateTime | Shape::Seconds => Some(time),
            Shape::Epoch { second } => Some(time / second),
            Shape::TimeOfDay => {
                if self.before_s - time > 0.5 * DAY_S {
                    self.midnights += 1.0;
                }
                self.before_s = time;
                Some(time + self.midnights * DAY_S)
            }
        }
    }

    /// Returns whether times count from 1970.
    pub(super) fn is_since_1970(&self) -> bool {
        matches!(self.shape, Shape::DateTime | Shape::Epoch { .. })
    }

    /// Returns whether times count from midnight.
    pub(super) fn is_of_day(&self) -> bool {
        matches!(self.shape, Shape::TimeOfDay)
    }

    /// Describes the clock of the times.
    pub(super) fn clock(&self) -> &'static str {
        match self.shape {
            Shape::DateTime => {
                "those of receipt before the sentences, taken as UTC where no offset is stated: \
                 seconds since the Unix epoch"
            }
            Shape::Epoch { .. } => {
                "those of receipt before the sentences: seconds since the Unix epoch"
            }
            Shape::TimeOfDay => "those of receipt before the sentences: seconds since midnight",
            Shape::Seconds => "those of receipt before the sentences, taken as seconds",
        }
    }
}

/// Finds the time in the text before a sentence.
fn find(prefix: &[u8]) -> Option<(Shape, f64)> {
    /// A recorder may also write a port's name, but only this many words before the time.
    const WORDS: usize = 4;
    /// Length of 2020-07-31.
    const DATE: usize = 10;
    let prefix = with_points(prefix);
    let words: Vec<&[u8]> =
        prefix.split(is_margin).filter(|word| !word.is_empty()).take(WORDS).collect();
    let date_time = |k: usize| {
        let word = words[k];
        let is_date = word.len() >= DATE && matches!(word[4], b'-' | b'/');
        match word.len() {
            _ if !is_date => None,
            DATE => stamp(&[word, b"T", words.get(k + 1)?].concat()),
            _ => stamp(word),
        }
    };
    if let Some(time) = (0..words.len()).find_map(date_time) {
        return Some((Shape::DateTime, time));
    }
    let time_of_day = |word: &&[u8]| stamp(word).filter(|_| word.contains(&b':'));
    if let Some(time) = words.iter().find_map(time_of_day) {
        return Some((Shape::TimeOfDay, time));
    }
    words.iter().find_map(|word| count(word))
}

/// Returns whether a byte separates times from other text; the tag block of NMEA 0183 has
/// backslashes.
fn is_margin(byte: &u8) -> bool {
    matches!(byte, b' ' | b'\t' | b',' | b';' | b'|' | b'"' | b'\'' | b'\\' | b'*' | b'=' | b'>')
        || matches!(byte, b'[' | b']' | b'(' | b')' | b'<')
}

/// Parses a count of seconds, or of fractions of a second since 1970, which its magnitude
/// determines.
fn count(word: &[u8]) -> Option<(Shape, f64)> {
    let word = word.strip_prefix(b"c:").unwrap_or(word);
    let digits = word.iter().all(|b| b.is_ascii_digit() || *b == b'.');
    let number: f64 = std::str::from_utf8(word).ok()?.parse().ok().filter(|_| digits)?;
    let shape = match number {
        1e8..1e11 => Shape::Epoch { second: 1.0 },
        1e11..1e14 => Shape::Epoch { second: 1e3 },
        1e14..1e17 => Shape::Epoch { second: 1e6 },
        1e17..1e20 => Shape::Epoch { second: 1e9 },
        _ => Shape::Seconds,
    };
    Some((shape, number))
}

/// Rewrites `12:00:01,250`, as some programs write it, as `12:00:01.250`.
fn with_points(prefix: &[u8]) -> Vec<u8> {
    let mut bytes = prefix.to_vec();
    for at in 3..bytes.len() {
        let digits = |from: usize, to: usize| {
            bytes.get(from..to).is_some_and(|part| part.iter().all(u8::is_ascii_digit))
        };
        let is_decimal = bytes[at] == b','
            && bytes[at - 3] == b':'
            && digits(at - 2, at)
            && digits(at + 1, at + 4)
            && !digits(at + 4, at + 5);
        if is_decimal {
            bytes[at] = b'.';
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_receipt_have_many_shapes() {
        let instant = 1_693_609_004.5;
        for prefix in [
            "2023-09-01T22:56:44.500Z ",
            "[2023-09-01 22:56:44.5] COM3: ",
            "2023/09/01,22:56:44,500,",
            "2023-09-02T00:56:44.5+02:00\t",
            "port 4; 2023-09-01 22:56:44.500000 | DEBUG | recv:49 - ",
        ] {
            assert_eq!(find(prefix.as_bytes()), Some((Shape::DateTime, instant)), "{prefix}");
        }
        for (prefix, second) in [
            ("1693609004.5,", 1.0),
            ("1693609004500 ", 1e3),
            ("\\c:1693609004500,s:gps*5A\\", 1e3),
            ("1693609004500000;", 1e6),
        ] {
            let found = find(prefix.as_bytes());
            assert_eq!(found, Some((Shape::Epoch { second }, instant * second)), "{prefix}");
        }
        assert_eq!(find(b"(12:00:01.25) "), Some((Shape::TimeOfDay, 43_201.25)));
        assert_eq!(find(b"12:00:01,250: "), None);
        assert_eq!(find(b"17.25\t"), Some((Shape::Seconds, 17.25)));
        assert_eq!(find(b"COM3: "), None);
    }

    #[test]
    fn a_day_ends_at_midnight() {
        let lines = ["23:59:59.5,$HEHDT,1.0,T*2B", "00:00:00.5,$HEHDT,1.0,T*2B"].map(str::as_bytes);
        let mut prefix = Prefix::detect(lines.into_iter()).unwrap();
        assert_eq!(prefix.time(b"23:59:59.5,"), Some(86_399.5));
        assert_eq!(prefix.time(b"00:00:00.5,"), Some(86_400.5));
        assert_eq!(prefix.time(b"17.0,"), None);
    }
}
