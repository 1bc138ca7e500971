//! What one cell of a table holds.

use jiff::civil;
use jiff::tz::TimeZone;

/// What a cell holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Cell {
    Number(f64),
    Missing,
    Text,
}

/// How a file writes the decimal sign; the first number with one decides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Decimal {
    Point,
    Comma,
    Undecided,
}

impl Decimal {
    /// What may be expected of a file whose cells `delimiter` parts.
    pub(crate) fn of(delimiter: u8) -> Self {
        if delimiter == b',' { Self::Point } else { Self::Undecided }
    }

    /// Reads a cell.
    pub(crate) fn read(&mut self, cell: &[u8]) -> Cell {
        let cell = cell.trim_ascii();
        if cell.is_empty() {
            return Cell::Missing;
        }
        let Ok(text) = std::str::from_utf8(cell) else { return Cell::Text };
        match text.parse::<f64>() {
            Ok(number) if !number.is_finite() => Cell::Missing,
            Ok(number) if *self == Self::Point => Cell::Number(number),
            Ok(number) if !text.contains('.') => Cell::Number(number),
            Ok(number) if *self == Self::Undecided => {
                *self = Self::Point;
                Cell::Number(number)
            }
            // 1.234 among decimal commas may be a thousand: not for us to say.
            Ok(_) => Cell::Text,
            Err(_) if is_absent(text) => Cell::Missing,
            Err(_) if unquoted(text) != text => self.read(unquoted(text).as_bytes()),
            Err(_) if text.contains(MINUS) => self.read(text.replace(MINUS, "-").as_bytes()),
            Err(_) if *self == Self::Point => Cell::Text,
            Err(_) => match comma_number(text) {
                Some(number) => {
                    *self = Self::Comma;
                    Cell::Number(number)
                }
                None => Cell::Text,
            },
        }
    }
}

/// The minus of typography, which word processors, spreadsheets and plotting programs write.
const MINUS: char = '\u{2212}';

/// The text within quotation marks, which the CSV reader leaves alone behind a blank; within all of
/// them at once, for a damaged file may hold nothing else.
fn unquoted(text: &str) -> &str {
    let before = text.len() - text.trim_start_matches('"').len();
    let after = text.len() - text.trim_end_matches('"').len();
    let pairs = before.min(after).min(text.len() / 2);
    &text[pairs..text.len() - pairs]
}

/// `1,5`, `-,5e-3`: one comma, digits after it, no point.
fn comma_number(text: &str) -> Option<f64> {
    let (whole, rest) = text.split_once(',')?;
    if text.contains('.') || !rest.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let digits = whole.strip_prefix(['-', '+']).unwrap_or(whole);
    if !digits.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    format!("{whole}.{rest}").parse().ok().filter(|number: &f64| number.is_finite())
}

/// Whether the text is one that programs write for "no value".
fn is_absent(text: &str) -> bool {
    #[rustfmt::skip]
    const ABSENT: &[&str] = &[
        "na", "n/a", "n.a.", "null", "nil", "none", "missing", "-", "--", "---", "?", "*",
        "nan(ind)", "-nan(ind)", "1.#qnan", "-1.#ind", "1.#inf", "-1.#inf", "#n/a", "#na",
        "#value!", "#div/0!", "#ref!", "#num!", "#null!",
    ];
    text.len() <= 9 && ABSENT.iter().any(|absent| absent.eq_ignore_ascii_case(text))
}

/// Reads an ISO 8601 date-time as seconds since the Unix epoch, or a time of day as seconds since
/// midnight.
///
/// A date-time without an offset is taken as UTC. `2020/07/31` is read like `2020-07-31`.
pub(crate) fn stamp(cell: &[u8]) -> Option<f64> {
    let text = unquoted(std::str::from_utf8(cell).ok()?.trim());
    if !text.starts_with(|c: char| c.is_ascii_digit()) || !text.contains(['-', ':', '/']) {
        return None;
    }
    let slashed = text.as_bytes().get(4) == Some(&b'/') && text.as_bytes().get(7) == Some(&b'/');
    let dashed = if slashed { text.replacen('/', "-", 2) } else { String::new() };
    let text = if slashed { &dashed } else { text };
    if text.as_bytes().get(4) != Some(&b'-') {
        // 10:21 may be minutes and seconds.
        if text.matches(':').count() != 2 {
            return None;
        }
        let time: civil::Time = text.parse().ok()?;
        let whole = f64::from(time.hour()) * 3600.0 + f64::from(time.minute()) * 60.0;
        return Some(whole + f64::from(time.second()) + f64::from(time.subsec_nanosecond()) * 1e-9);
    }
    let instant = text.parse::<jiff::Timestamp>().ok().or_else(|| {
        let local: civil::DateTime = text.parse().ok()?;
        Some(local.to_zoned(TimeZone::UTC).ok()?.timestamp())
    })?;
    Some(instant.as_second() as f64 + f64::from(instant.subsec_nanosecond()) * 1e-9)
}

/// The text of a cell, whichever of UTF-8 and Windows-1252 it is written in.
pub(crate) fn decode(cell: &[u8]) -> String {
    let text = match std::str::from_utf8(cell) {
        Ok(text) => text.into(),
        Err(_) => encoding_rs::WINDOWS_1252.decode_without_bom_handling(cell).0,
    };
    unquoted(text.trim()).trim().to_owned()
}

/// The text of a cell for a message: short, decoded.
pub(crate) fn excerpt(cell: &[u8]) -> String {
    /// Enough to recognise a cell by.
    const CHARACTERS: usize = 40;
    let text = decode(&cell[..cell.len().min(4 * CHARACTERS)]);
    let mut short: String = text.chars().take(CHARACTERS).collect();
    if short.len() < text.len() || cell.len() > 4 * CHARACTERS {
        short.push('…');
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_decimal_sign_decides() {
        let mut decimal = Decimal::Undecided;
        assert_eq!(decimal.read(b"7"), Cell::Number(7.0));
        assert_eq!(decimal.read(b"-1,5e1"), Cell::Number(-15.0));
        assert_eq!(decimal.read("\u{2212}1,5".as_bytes()), Cell::Number(-1.5));
        assert_eq!(decimal, Decimal::Comma);
        assert_eq!(decimal.read(b"1.5"), Cell::Text);

        let mut decimal = Decimal::Undecided;
        assert_eq!(decimal.read(b"1.5"), Cell::Number(1.5));
        assert_eq!(decimal.read(b"1,5"), Cell::Text);
    }

    #[test]
    fn only_one_comma_between_digits_is_a_decimal_sign() {
        for text in ["1,", ",", "1,2,3", "1,2.3", "a,5", "1,x", "1, 5", "--1,5"] {
            assert_eq!(comma_number(text), None, "{text}");
        }
        assert_eq!(comma_number("-,5"), Some(-0.5));
        assert_eq!(comma_number("1,9e999"), None);
    }

    #[test]
    fn a_cell_is_a_number_or_missing_or_text() {
        let read = |cell: &[u8]| Decimal::Point.read(cell);
        assert_eq!(read(b" +1.5e3 "), Cell::Number(1500.0));
        assert_eq!(read(b" \"1.5\" "), Cell::Number(1.5));
        assert_eq!(read("\u{2212}1.5e\u{2212}3".as_bytes()), Cell::Number(-1.5e-3));
        assert_eq!(read("\u{2212}".as_bytes()), Cell::Missing);
        assert_eq!(read("5 \u{2212} 3".as_bytes()), Cell::Text);
        assert_eq!(read(b" \"\"\"1.5\"\"\""), Cell::Number(1.5));
        assert_eq!(read(b"\"1.5"), Cell::Text);
        assert_eq!(read("\"".repeat(10_000_001).as_bytes()), Cell::Text);
        assert_eq!(read("\"".repeat(10_000_000).as_bytes()), Cell::Missing);
        assert_eq!(read(b"1e999"), Cell::Missing);
        assert_eq!(read(b"\"\""), Cell::Missing);
        assert_eq!(read(b"12 m"), Cell::Text);
        assert_eq!(read(b"\xff"), Cell::Text);
    }

    #[test]
    fn stamps_are_iso_8601_and_nothing_else() {
        assert_eq!(stamp(b"1970-01-01T00:01:00+00:01"), Some(0.0));
        assert_eq!(stamp(b"1970-01-02"), Some(86_400.0));
        assert_eq!(stamp(b"1969-12-31T23:59:59.5Z"), Some(-0.5));
        assert_eq!(stamp(b"01:00:01.25"), Some(3601.25));
        for text in ["10:21", "31/07/2020", "07-31-2020", "2020-13-01", "20200731", "1-2", "x"] {
            assert_eq!(stamp(text.as_bytes()), None, "{text}");
        }
    }
}
