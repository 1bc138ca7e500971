//! Parses one cell of a table.

use jiff::civil;
use jiff::tz::TimeZone;

/// Content of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Cell {
    Number(f64),
    /// `1.588` or `1,588`, unless commas separate cells.
    Ambiguous(Ambiguous),
    Missing,
    Text,
}

/// A number whose only separator precedes three digits: a decimal sign or a thousands separator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ambiguous {
    pub(crate) sign: Sign,
    /// The number if `sign` is the decimal sign.
    pub(crate) decimal: f64,
    /// The number if `sign` separates thousands.
    pub(crate) thousands: f64,
}

/// A separator within a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sign {
    Point,
    Comma,
}

impl Sign {
    pub(crate) fn character(self) -> char {
        if self == Self::Point { '.' } else { ',' }
    }

    pub(crate) fn other(self) -> Self {
        if self == Self::Point { Self::Comma } else { Self::Point }
    }
}

/// Number format of a file, decided by the first number that is unambiguous.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Decimal {
    /// Decimal sign; `None` until a number has shown it.
    pub(crate) sign: Option<Sign>,
    /// True once a number has shown that the other sign separates thousands.
    pub(crate) groups: bool,
    /// True if commas separate cells, so that the decimal sign is a point from the start.
    fixed: bool,
}

impl Decimal {
    /// Creates a format that accepts only decimal points.
    pub(crate) const fn point() -> Self {
        Self { sign: Some(Sign::Point), groups: false, fixed: true }
    }

    /// Creates the initial format of a file whose cells `delimiter` separates.
    pub(crate) fn for_delimiter(delimiter: u8) -> Self {
        if delimiter == b',' {
            Self::point()
        } else {
            Self { sign: None, groups: false, fixed: false }
        }
    }

    /// Returns whether the decimal sign is a point whatever the cells hold.
    pub(crate) fn is_fixed(self) -> bool {
        self.fixed
    }

    /// Reads a cell.
    pub(crate) fn read(&mut self, cell: &[u8]) -> Cell {
        let cell = cell.trim_ascii();
        if cell.is_empty() {
            return Cell::Missing;
        }
        let Ok(text) = std::str::from_utf8(cell) else {
            // The en dash of Windows-1252.
            let Some(digits) = cell.strip_prefix(b"\x96") else { return Cell::Text };
            return self.read_negative(digits);
        };
        match text.parse::<f64>() {
            Ok(number) if !number.is_finite() => Cell::Missing,
            Ok(number) if self.fixed || !text.contains('.') => Cell::Number(number),
            Ok(number) => match single_group(text, Sign::Point) {
                Some(thousands) => {
                    Cell::Ambiguous(Ambiguous { sign: Sign::Point, decimal: number, thousands })
                }
                None => self.decided(Sign::Point, number),
            },
            Err(_) => self.read_spelled(text),
        }
    }

    /// Reads numbers in spellings that Rust does not parse.
    fn read_spelled(&mut self, text: &str) -> Cell {
        if is_absent(text) {
            return Cell::Missing;
        }
        if unquoted(text) != text {
            return self.read(unquoted(text).as_bytes());
        }
        if let Some(inside) = text.strip_prefix('(').and_then(|text| text.strip_suffix(')')) {
            return self.read_negative(inside.as_bytes());
        }
        if text.contains(is_minus) {
            return self.read(text.replace(is_minus, "-").as_bytes());
        }
        self.read_separated(text)
    }

    /// Reads the unsigned digits of a negative number.
    fn read_negative(&mut self, digits: &[u8]) -> Cell {
        if !digits
            .trim_ascii_start()
            .first()
            .is_some_and(|first| matches!(first, b'0'..=b'9' | b'.' | b','))
        {
            return Cell::Text;
        }
        match self.read(digits) {
            Cell::Number(number) => Cell::Number(-number),
            Cell::Ambiguous(Ambiguous { sign, decimal, thousands }) => {
                Cell::Ambiguous(Ambiguous { sign, decimal: -decimal, thousands: -thousands })
            }
            Cell::Missing | Cell::Text => Cell::Text,
        }
    }

    /// Reads `1,5`, `1,588`, `12.345.678` and `1.234,5`.
    fn read_separated(&mut self, text: &str) -> Cell {
        for decimal in [Sign::Comma, Sign::Point] {
            if let Some(number) = grouped(text, decimal) {
                let cell = self.decided(decimal, number);
                self.groups |= cell != Cell::Text;
                return cell;
            }
        }
        let Some(decimal) = comma_number(text) else { return Cell::Text };
        match single_group(text, Sign::Comma) {
            Some(_) if self.fixed => Cell::Text,
            Some(thousands) => Cell::Ambiguous(Ambiguous { sign: Sign::Comma, decimal, thousands }),
            None => self.decided(Sign::Comma, decimal),
        }
    }

    /// Returns a number that shows the decimal sign, or text if an earlier number showed the other
    /// sign.
    fn decided(&mut self, sign: Sign, number: f64) -> Cell {
        if *self.sign.get_or_insert(sign) == sign { Cell::Number(number) } else { Cell::Text }
    }
}

/// Returns whether a character is a minus sign in word processors, spreadsheets or plots: hyphens,
/// the en dash, the typographic minus, the full-width hyphen.
fn is_minus(c: char) -> bool {
    matches!(
        c,
        '\u{2010}' | '\u{2011}' | '\u{2012}' | '\u{2013}' | '\u{2212}' | '\u{fe63}' | '\u{ff0d}'
    )
}

/// Strips quotation marks, which the CSV reader keeps after a blank. Strips all pairs at once,
/// because a damaged file may hold nothing else.
fn unquoted(text: &str) -> &str {
    let before = text.len() - text.trim_start_matches('"').len();
    let after = text.len() - text.trim_end_matches('"').len();
    let pairs = before.min(after).min(text.len() / 2);
    &text[pairs..text.len() - pairs]
}

/// Parses `1,5`, `-,5e-3`: one comma, digits after it, no point.
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

/// Returns the number if one `sign` separates thousands from units: 1588 for `1.588`, `None` for
/// `0.588`.
fn single_group(text: &str, sign: Sign) -> Option<f64> {
    let (whole, groups) = groups_of(text, sign)?;
    (groups == 1).then_some(whole)
}

/// Parses a number whose groups of three digits are unambiguous: `12.345.678`, or `1.234,5` where
/// `decimal` is a comma.
fn grouped(text: &str, decimal: Sign) -> Option<f64> {
    let (whole, fraction) = match text.split_once(decimal.character()) {
        Some((whole, fraction)) => (whole, Some(fraction)),
        None => (text, None),
    };
    let (size, groups) = groups_of(whole, decimal.other())?;
    match fraction {
        None => (groups > 1).then_some(size),
        Some(fraction) if fraction.starts_with(|c: char| c.is_ascii_digit()) => {
            let digits = whole.replace(decimal.other().character(), "");
            format!("{digits}.{fraction}").parse().ok().filter(|number: &f64| number.is_finite())
        }
        Some(_) => None,
    }
}

/// Parses an integer with `sign` between thousands, and counts the signs: one to three digits
/// without leading zero, then groups of three.
fn groups_of(text: &str, sign: Sign) -> Option<(f64, usize)> {
    let size = text.strip_prefix(['-', '+']).unwrap_or(text);
    let mut groups = size.split(sign.character());
    let mut number = digits(groups.next()?).filter(|_| !size.starts_with('0'))?;
    let mut count = 0;
    for group in groups {
        number = 1000.0 * number + digits(group).filter(|_| group.len() == 3)?;
        count += 1;
    }
    (count > 0).then_some((if text.starts_with('-') { -number } else { number }, count))
}

/// Parses an integer of one to three digits.
fn digits(text: &str) -> Option<f64> {
    let is_group = (1..=3).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit());
    is_group.then(|| text.bytes().fold(0.0, |number, b| 10.0 * number + f64::from(b - b'0')))
}

/// Returns whether the text is one that programs write for "no value".
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

/// Decodes a cell in UTF-8 or Windows-1252.
pub(crate) fn decode(cell: &[u8]) -> String {
    let text = match std::str::from_utf8(cell) {
        Ok(text) => text.into(),
        Err(_) => encoding_rs::WINDOWS_1252.decode_without_bom_handling(cell).0,
    };
    unquoted(text.trim()).trim().to_owned()
}

/// Decodes a cell and shortens it for a message.
pub(crate) fn excerpt(cell: &[u8]) -> String {
    /// Characters enough to recognise a cell.
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
        let mut decimal = Decimal::for_delimiter(b';');
        assert_eq!(decimal.read(b"7"), Cell::Number(7.0));
        assert_eq!(decimal.read(b"-1,5e1"), Cell::Number(-15.0));
        assert_eq!(decimal.read("\u{2212}1,5".as_bytes()), Cell::Number(-1.5));
        assert_eq!(decimal.sign, Some(Sign::Comma));
        assert_eq!(decimal.read(b"1.5"), Cell::Text);

        let mut decimal = Decimal::for_delimiter(b';');
        assert_eq!(decimal.read(b"1.5"), Cell::Number(1.5));
        assert_eq!(decimal.read(b"1,5"), Cell::Text);
    }

    #[test]
    fn three_digits_behind_one_sign_leave_it_open() {
        for (text, sign) in [("1.588", Sign::Point), ("-12,345", Sign::Comma)] {
            let mut decimal = Decimal::for_delimiter(b';');
            let Cell::Ambiguous(found) = decimal.read(text.as_bytes()) else { panic!("{text}") };
            assert_eq!((found.sign, decimal.sign), (sign, None));
            assert_eq!((found.decimal * 1000.0).round(), found.thousands);
        }
        // Thousands have no leading zero, four digits or power of ten.
        for text in ["0.588", "1234.588", "1.588e3", "1.5880"] {
            let mut decimal = Decimal::for_delimiter(b';');
            assert_eq!(decimal.read(text.as_bytes()), Cell::Number(text.parse().unwrap()));
            assert_eq!(decimal.sign, Some(Sign::Point), "{text}");
        }
    }

    #[test]
    fn groups_of_thousands_show_the_decimal_sign() {
        for (text, number, sign) in [
            ("12.345.678", 12_345_678.0, Sign::Comma),
            ("-1.234,5", -1234.5, Sign::Comma),
            ("12,345,678", 12_345_678.0, Sign::Point),
            ("1,234.5e1", 12_345.0, Sign::Point),
        ] {
            let mut decimal = Decimal::for_delimiter(b';');
            assert_eq!(decimal.read(text.as_bytes()), Cell::Number(number), "{text}");
            assert_eq!((decimal.sign, decimal.groups), (Some(sign), true), "{text}");
        }
        for text in ["12.34.567", "1.234,", "01.234.567", "1.234.5678", "1.2.3", ".123.456"] {
            assert_eq!(Decimal::for_delimiter(b';').read(text.as_bytes()), Cell::Text, "{text}");
        }
    }

    #[test]
    fn negative_numbers_may_have_any_minus_or_parentheses() {
        for text in ["\u{2013}1.5", "\u{2012}1.5", "\u{2010}1.5", "\u{ff0d}1.5", "(1.5)", "( 1.5 )"]
        {
            assert_eq!(Decimal::point().read(text.as_bytes()), Cell::Number(-1.5), "{text}");
        }
        assert_eq!(Decimal::for_delimiter(b';').read(b"(1,5)"), Cell::Number(-1.5));
        // The en dash of Windows-1252, first as a minus, then between numbers.
        assert_eq!(Decimal::point().read(b"\x961.5"), Cell::Number(-1.5));
        for text in ["(-1.5)", "()", "(a)", "(1.5", "1\u{2013}5", "((1))"] {
            assert_eq!(Decimal::point().read(text.as_bytes()), Cell::Text, "{text}");
        }
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
        let read = |cell: &[u8]| Decimal::point().read(cell);
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
