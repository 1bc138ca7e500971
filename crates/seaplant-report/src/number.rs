//! Formats numbers for readers.

use seaplant::results::Parameter;

/// Separator of groups of three digits: narrow and non-breaking.
const THIN_SPACE: char = '\u{202f}';

/// Replacement of an absent number.
pub const ABSENT: &str = "–";

/// Range of magnitudes outside of which a number is written with a power of ten.
const PLAIN: std::ops::Range<f64> = 1e-4..1e9;

/// Significant digits of a number with unknown uncertainty.
const DIGITS_ALONE: i32 = 4;

/// Number of decimals; if negative, number of digits before the point that are rounded off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Decimals(i32);

impl Decimals {
    /// Returns the decimals for two significant digits of the standard deviation.
    pub(crate) fn of_std(value: f64, std: f64) -> Self {
        if std.is_finite() && std > 0.0 {
            Self::significant(std, 2)
        } else {
            Self::significant(value, DIGITS_ALONE)
        }
    }

    /// Returns the decimals for this many significant digits.
    pub(crate) fn significant(value: f64, digits: i32) -> Self {
        if !value.is_finite() || value == 0.0 {
            return Self(0);
        }
        let exponent = |x: f64| x.abs().log10().floor() as i32;
        let decimals = digits - 1 - exponent(value);
        // 0.0996 to two digits is 0.10: rounding may carry into the next power.
        let carried = round(value, decimals);
        Self(digits - 1 - exponent(if carried == 0.0 { value } else { carried }))
    }

    /// Formats a number with these decimals.
    pub(crate) fn write(self, value: f64) -> String {
        if !value.is_finite() {
            return ABSENT.to_owned();
        }
        // Formatting rounds decimals exactly, but keeps all digits before the point.
        let rounded = if self.0 < 0 { round(value, self.0) } else { value };
        let text = format!("{:.*}", self.0.clamp(0, 17) as usize, rounded.abs());
        let zero = text.bytes().all(|b| b == b'0' || b == b'.');
        let sign = if value < 0.0 && !zero { "−" } else { "" };
        let (whole, fraction) = text.split_once('.').unwrap_or((&text, ""));
        let point = if fraction.is_empty() { "" } else { "." };
        format!("{sign}{}{point}{fraction}", grouped(whole))
    }
}

/// Rounds to this many decimals; unchanged where the power of ten overflows.
fn round(value: f64, decimals: i32) -> f64 {
    let power = 10_f64.powi(decimals);
    let rounded = (value * power).round() / power;
    if rounded.is_finite() { rounded } else { value }
}

fn grouped(digits: &str) -> String {
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (k, digit) in digits.chars().enumerate() {
        // Four digits need no separator.
        if k > 0 && digits.len() > 4 && (digits.len() - k).is_multiple_of(3) {
            text.push(THIN_SPACE);
        }
        text.push(digit);
    }
    text
}

/// Formats a number by itself, with this many significant digits.
pub fn significant(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return ABSENT.to_owned();
    }
    if value != 0.0 && !PLAIN.contains(&value.abs()) {
        return with_power_of_ten(value, digits);
    }
    Decimals::significant(value, digits).write(value)
}

/// Formats a number with this many decimals, whatever its size.
pub fn decimals(value: f64, decimals: u8) -> String {
    Decimals(i32::from(decimals)).write(value)
}

/// Replaces the hyphens of negative numbers in running text by minus signs; text in backticks, and
/// values of TOML after `=`, are for copying and unchanged.
pub fn with_minus(text: &str) -> String {
    let mut written = String::with_capacity(text.len());
    let mut is_code = false;
    let mut before = [' ', ' '];
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        is_code ^= c == '`';
        let starts = matches!(before[1], ' ' | '(' | '[' | '±' | '/' | '~') && before[0] != '=';
        let is_sign = c == '-' && starts && chars.peek().is_some_and(char::is_ascii_digit);
        written.push(if is_sign && !is_code { '−' } else { c });
        before = [before[1], c];
    }
    written
}

/// Formats a number that a user chose, without trailing zeros.
pub(crate) fn chosen(value: f64) -> String {
    let text = significant(value, DIGITS_ALONE);
    if !text.contains('.') || text.contains('×') {
        return text;
    }
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Formats an integer.
pub(crate) fn count(n: impl Into<u128>) -> String {
    grouped(&n.into().to_string())
}

/// Formats a number that may be missing.
pub fn or_absent(value: Option<f64>, digits: i32) -> String {
    value.map_or_else(|| ABSENT.to_owned(), |value| significant(value, digits))
}

fn with_power_of_ten(value: f64, digits: i32) -> String {
    let text = format!("{:.*e}", (digits - 1).max(0) as usize, value);
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let raised: String = exponent.chars().map(superscript).collect();
    format!("{} × 10{raised}", mantissa.replace('-', "−"))
}

fn superscript(c: char) -> char {
    match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' | '4'..='9' => char::from_u32('⁰' as u32 + c as u32 - '0' as u32).unwrap_or(c),
        other => other,
    }
}

/// Formats half intervals with two digits and their unit: in per cent of a value, or in its unit for a value of zero.
pub fn half_width<const N: usize>(
    halves: [f64; N],
    value: f64,
    unit: &str,
    between: &str,
) -> String {
    let (scale, unit) = if value == 0.0 { (1.0, unit) } else { (100.0 / value.abs(), "%") };
    let numbers = halves.map(|half| significant(scale * half, 2)).join(between);
    if unit.is_empty() { numbers } else { format!("{numbers} {unit}") }
}

/// Formats a percentage with two significant digits and its sign.
pub fn signed_percent(part: f64) -> String {
    let percent = 100.0 * part;
    let digits = if percent.abs() < 1.0 { 1 } else { 2 };
    let text = significant(percent, digits);
    let plus = if percent > 0.0 { "+" } else { "" };
    format!("{plus}{text} %")
}

/// The parts of `12 970 ± 250`.
pub struct Rounded {
    /// The estimate.
    pub value: String,
    /// Its standard deviation.
    pub std: String,
    /// Lower end of its 95 % interval.
    pub low95: String,
    /// Upper end of its 95 % interval.
    pub high95: String,
}

impl Rounded {
    /// Rounds all four by two significant digits of the standard deviation.
    pub fn of(parameter: &Parameter) -> Self {
        let Parameter { value, std, low95, high95, .. } = *parameter;
        let decimals = Decimals::of_std(value, std);
        // A value that is small beside its deviation has the decimals of the deviation.
        let sizes = if std > 0.0 { [std, std.max(value.abs())] } else { [value.abs(); 2] };
        let extreme = sizes.iter().any(|x| *x != 0.0 && !PLAIN.contains(x));
        let write = |x: f64| if extreme { significant(x, DIGITS_ALONE) } else { decimals.write(x) };
        Self {
            value: write(value),
            std: if extreme { significant(std, 2) } else { decimals.write(std) },
            low95: write(low95),
            high95: write(high95),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rounded(value: f64, std: f64) -> String {
        let unit = String::new();
        let all = Rounded::of(&Parameter {
            value,
            std,
            low95: value - 2.0 * std,
            high95: value + 2.0 * std,
            unit,
        });
        format!("{} ± {} [{}, {}]", all.value, all.std, all.low95, all.high95)
            .replace(THIN_SPACE, " ")
    }

    #[test]
    fn the_deviation_decides_the_decimals() {
        assert_eq!(rounded(12970.2, 253.0), "12 970 ± 250 [12 460, 13 480]");
        assert_eq!(rounded(0.27812, 0.0341), "0.278 ± 0.034 [0.210, 0.346]");
        assert_eq!(rounded(-255.5, 9.96), "−256 ± 10 [−275, −236]");
        assert_eq!(rounded(2230.9, 0.0), "2231 ± 0 [2231, 2231]");
        assert_eq!(rounded(-8.087e-5, 0.00032), "−0.00008 ± 0.00032 [−0.00072, 0.00056]");
    }

    #[test]
    fn rounding_may_carry() {
        assert_eq!(significant(0.0996, 2), "0.10");
        assert_eq!(significant(9.96, 2), "10");
        assert_eq!(significant(-0.00004, 1), "−4 × 10⁻⁵");
        assert_eq!(significant(7.71e-5, 3), "7.71 × 10⁻⁵");
        assert_eq!(significant(123_456.0, 3).replace(THIN_SPACE, " "), "123 000");
    }

    #[test]
    fn writes_no_negative_zero_and_no_nan() {
        assert_eq!(Decimals(2).write(-0.001), "0.00");
        assert_eq!(Decimals(2).write(f64::NAN), ABSENT);
        assert_eq!(significant(0.0, 3), "0");
        assert_eq!(count(4800_u64), "4800");
        assert_eq!([0.003, 45.0, -0.5, 100.0].map(chosen), ["0.003", "45", "−0.5", "100"]);
        assert_eq!(count(123_456_u64).replace(THIN_SPACE, " "), "123 456");
        assert_eq!(rounded(f64::INFINITY, f64::NAN), "– ± – [–, –]");
    }

    #[test]
    fn one_minus_sign_is_written_in_running_text() {
        let said = "R² is -0.2 (-3 to -1) in run-7 of 2023-11-14; write `x = -1` or offset_s = -2";
        let expected =
            "R² is −0.2 (−3 to −1) in run-7 of 2023-11-14; write `x = -1` or offset_s = -2";
        assert_eq!(with_minus(said), expected);
        assert_eq!(decimals(-0.9967, 3), "−0.997");
        assert_eq!(decimals(-0.0001, 3), "0.000");
    }

    #[test]
    fn percentages_carry_their_sign() {
        assert_eq!(signed_percent(0.982), "+98 %");
        assert_eq!(signed_percent(-0.004), "−0.4 %");
        assert_eq!(signed_percent(0.0), "0 %");
    }
}
