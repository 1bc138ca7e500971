//! Units of measure as logs write them.

use std::fmt;

use crate::Error;
use crate::lookup::nearest;

/// What a unit measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Dimension {
    /// Time, s.
    Time,
    /// Length, m.
    Length,
    /// Velocity, m/s.
    Velocity,
    /// Acceleration, m/s².
    Acceleration,
    /// Angle, rad.
    Angle,
    /// Angular velocity, rad/s; the speed of a propeller too.
    AngularVelocity,
    /// Angular acceleration, rad/s².
    AngularAcceleration,
    /// Force, N.
    Force,
    /// Moment, N m.
    Moment,
    /// Mass, kg.
    Mass,
    /// Pulse width of a servo or speed-controller command: **µs, not s**, the one exception to SI.
    PulseWidth,
    /// Voltage, V.
    Voltage,
    /// Current, A.
    Current,
    /// Power, W.
    Power,
    /// Pressure, Pa.
    Pressure,
    /// A ratio, such as a command from −1 to 1.
    Ratio,
}

impl fmt::Display for Dimension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Time => "time",
            Self::Length => "length",
            Self::Velocity => "velocity",
            Self::Acceleration => "acceleration",
            Self::Angle => "angle",
            Self::AngularVelocity => "angular velocity",
            Self::AngularAcceleration => "angular acceleration",
            Self::Force => "force",
            Self::Moment => "moment",
            Self::Mass => "mass",
            Self::PulseWidth => "pulse width",
            Self::Voltage => "voltage",
            Self::Current => "current",
            Self::Power => "power",
            Self::Pressure => "pressure",
            Self::Ratio => "ratio",
        })
    }
}

/// A unit of measure: its symbol as written, what it measures, and its size in SI.
///
/// # Example
/// ```
/// # use seaplant_log::{Dimension, Unit};
/// let knots = Unit::parse("kn")?;
/// assert_eq!(knots.dimension(), Dimension::Velocity);
/// assert!((knots.to_si(2.0) - 1.0289).abs() < 1e-4);
/// # Ok::<(), seaplant_log::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    symbol: String,
    dimension: Dimension,
    factor: f64,
}

impl Unit {
    /// Recognises a unit, lenient in spelling: `µs`, `us`; `m/s`, `m s-1`; `Kg f`, `kgf`.
    ///
    /// Case is ignored where no other unit differs by case alone (`kn` is a knot, `kN` a
    /// kilonewton, so `KN` is refused). A symbol of several meanings gets the one that logs mean
    /// most: `us` is a pulse width, `lb`, `kg` and `g` are masses; [`Unit::parse_as`] states
    /// another.
    ///
    /// # Errors
    /// [`Error::UnknownUnit`], with the nearest known one.
    pub fn parse(text: &str) -> Result<Self, Error> {
        Self::find(text).ok_or_else(|| unknown(text, None))
    }

    /// [`Unit::parse`] for text that need not be a unit.
    pub(crate) fn find(text: &str) -> Option<Self> {
        meanings(text).next().map(|meaning| meaning.written_as(text))
    }

    /// [`Unit::parse_as`] for text that need not be a unit.
    pub(crate) fn find_as(text: &str, expected: Dimension) -> Option<Self> {
        let meaning = meanings(text).find(|meaning| meaning.dimension == expected)?;
        Some(meaning.written_as(text))
    }

    /// Recognises a unit of a given dimension: `us` as a time, `lb` as a force.
    ///
    /// # Errors
    /// [`Error::UnknownUnit`], or [`Error::Dimension`] where the symbol measures something else.
    ///
    /// # Example
    /// ```
    /// # use seaplant_log::{Dimension, Unit};
    /// assert_eq!(Unit::parse_as("us", Dimension::Time)?.factor(), 1e-6);
    /// assert_eq!(Unit::parse_as("us", Dimension::PulseWidth)?.factor(), 1.0);
    /// # Ok::<(), seaplant_log::Error>(())
    /// ```
    pub fn parse_as(text: &str, expected: Dimension) -> Result<Self, Error> {
        if let Some(unit) = Self::find_as(text, expected) {
            return Ok(unit);
        }
        let Some(Unit { symbol, dimension, .. }) = Self::find(text) else {
            return Err(unknown(text, Some(expected)));
        };
        let accepted = symbols_of(expected).collect();
        Err(Error::Dimension { unit: symbol, found: dimension, expected, accepted })
    }

    /// The same symbol read as a unit of `expected`: see [`Unit::parse_as`].
    ///
    /// # Errors
    /// [`Error::Dimension`] where the symbol does not measure `expected`.
    pub fn resolve(&self, expected: Dimension) -> Result<Self, Error> {
        Self::parse_as(&self.symbol, expected)
    }

    /// Whether both symbols may mean the same: `kg` and `kgf` do as forces.
    pub(crate) fn agrees_with(&self, other: &Self) -> bool {
        meanings(&self.symbol).any(|meaning| {
            let same = Self::find_as(&other.symbol, meaning.dimension);
            same.is_some_and(|same| same.factor == meaning.factor)
        })
    }

    /// The symbol as the log wrote it.
    pub fn symbol(&self) -> &str {
        &self.symbol
    }

    /// What the unit measures.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// The size of the unit in the SI unit of its dimension (for a pulse width, in µs).
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Converts a value in this unit to SI (a pulse width, to µs).
    pub fn to_si(&self, value: f64) -> f64 {
        value * self.factor
    }

    /// The symbols of all known units, one spelling of each.
    pub fn known() -> impl Iterator<Item = &'static str> {
        let first = |k: usize| UNITS[..k].iter().all(|u| u.spellings[0] != UNITS[k].spellings[0]);
        (0..UNITS.len()).filter(move |&k| first(k)).map(|k| UNITS[k].spellings[0])
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.symbol)
    }
}

/// One meaning of a symbol; `spellings[0]` is the one that messages show.
struct Definition {
    dimension: Dimension,
    factor: f64,
    spellings: &'static [&'static str],
}

impl Definition {
    fn written_as(&self, text: &str) -> Unit {
        let symbol = text.trim().to_owned();
        Unit { symbol, dimension: self.dimension, factor: self.factor }
    }
}

const fn unit(dimension: Dimension, factor: f64, spellings: &'static [&'static str]) -> Definition {
    Definition { dimension, factor, spellings }
}

const POUND: f64 = 0.453_592_37;
const GRAVITY: f64 = 9.806_65;
const FOOT: f64 = 0.304_8;
const KNOT: f64 = 1852.0 / 3600.0;
const DEGREE: f64 = std::f64::consts::PI / 180.0;
const TURN: f64 = std::f64::consts::TAU;

/// Every meaning of every symbol; of two meanings of one symbol the first is the default.
/// Spellings are in the form that [`normalise`] gives.
#[rustfmt::skip]
static UNITS: &[Definition] = {
    use Dimension::*;
    &[
        unit(PulseWidth, 1.0, &["us", "usec", "microsecond", "microseconds"]),
        unit(Time, 1.0, &["s", "sec", "secs", "second", "seconds"]),
        unit(Time, 1e-3, &["ms", "msec", "millisecond", "milliseconds"]),
        unit(Time, 1e-6, &["us", "usec", "microsecond", "microseconds"]),
        unit(Time, 1e-9, &["ns", "nsec", "nanosecond", "nanoseconds"]),
        unit(Time, 60.0, &["min", "mins", "minute", "minutes"]),
        unit(Time, 3600.0, &["h", "hr", "hrs", "hour", "hours"]),
        unit(PulseWidth, 1e3, &["ms", "msec", "millisecond", "milliseconds"]),
        unit(Length, 1.0, &["m", "metre", "metres", "meter", "meters"]),
        unit(Length, 1e-2, &["cm", "centimetre", "centimetres", "centimeter", "centimeters"]),
        unit(Length, 1e-3, &["mm", "millimetre", "millimetres", "millimeter", "millimeters"]),
        unit(Length, 1e3, &["km", "kilometre", "kilometres", "kilometer", "kilometers"]),
        unit(Length, FOOT, &["ft", "foot", "feet"]),
        unit(Length, FOOT / 12.0, &["in", "inch", "inches"]),
        unit(Length, 6.0 * FOOT, &["fathom", "fathoms", "fth"]),
        unit(Length, 1852.0, &["nmi", "nautical mile", "nautical miles"]),
        unit(Velocity, 1.0, &["m/s", "m s-1", "m.s-1", "ms-1", "m/sec", "mps", "metres/second", "meters/second"]),
        unit(Velocity, 1e-2, &["cm/s", "cm s-1", "cm.s-1", "cm/sec"]),
        unit(Velocity, 1e-3, &["mm/s", "mm s-1", "mm.s-1", "mm/sec"]),
        unit(Velocity, 1.0 / 3.6, &["km/h", "km h-1", "kph", "kmh", "km/hr"]),
        unit(Velocity, KNOT, &["kn", "knot", "knots", "kt", "kts"]),
        unit(Velocity, FOOT, &["ft/s", "ft s-1", "fps", "ft/sec"]),
        unit(Acceleration, 1.0, &["m/s2", "m s-2", "m.s-2", "m/s/s", "ms-2", "m/sec2"]),
        unit(Angle, 1.0, &["rad", "rads", "radian", "radians"]),
        unit(Angle, 1e-3, &["mrad"]),
        unit(Angle, DEGREE, &["deg", "degs", "degree", "degrees", "°"]),
        unit(Angle, TURN, &["rev", "turn", "turns", "revolution", "revolutions"]),
        unit(AngularVelocity, 1.0, &["rad/s", "rad s-1", "rad.s-1", "rad/sec", "rads-1", "radians/s"]),
        unit(AngularVelocity, 1e-3, &["mrad/s", "mrad s-1"]),
        unit(AngularVelocity, DEGREE, &["deg/s", "deg s-1", "deg.s-1", "deg/sec", "dps", "°/s", "degrees/s", "deg/second"]),
        unit(AngularVelocity, TURN / 60.0, &["rpm", "rev/min", "r/min", "1/min", "min-1", "revs/min"]),
        unit(AngularVelocity, TURN, &["rev/s", "rps", "rev/sec", "revs/s"]),
        unit(AngularAcceleration, 1.0, &["rad/s2", "rad s-2", "rad.s-2", "rad/s/s"]),
        unit(AngularAcceleration, DEGREE, &["deg/s2", "deg s-2", "deg.s-2", "deg/s/s", "°/s2"]),
        unit(Force, 1.0, &["N", "newton", "newtons"]),
        unit(Force, 1e3, &["kN", "kilonewton", "kilonewtons"]),
        unit(Force, 1e-3, &["mN", "millinewton", "millinewtons"]),
        unit(Force, POUND * GRAVITY, &["lbf", "lb f", "lbsf", "pound-force"]),
        unit(Force, GRAVITY, &["kgf", "kg f", "kg-f", "kg force", "kp", "kilogram-force"]),
        unit(Force, 1e-3 * GRAVITY, &["gf", "g f", "gram-force"]),
        unit(Moment, 1.0, &["N m", "Nm", "N-m", "N.m", "newton metre", "newton metres", "newton meters"]),
        unit(Moment, 1e3, &["kN m", "kNm", "kN-m", "kN.m"]),
        unit(Moment, POUND * GRAVITY * FOOT, &["lbf ft", "ft lbf", "ft lb", "lb ft", "ft-lb", "lb-ft", "ft-lbf", "lbf-ft"]),
        unit(Moment, GRAVITY, &["kgf m", "kg f m", "kgfm", "kgf-m"]),
        unit(Mass, 1.0, &["kg", "kilogram", "kilograms"]),
        unit(Mass, 1e-3, &["g", "gram", "grams"]),
        unit(Mass, 1e3, &["t", "tonne", "tonnes"]),
        unit(Mass, POUND, &["lb", "lbs", "pound", "pounds"]),
        unit(Force, POUND * GRAVITY, &["lb", "lbs", "pound", "pounds"]),
        unit(Force, GRAVITY, &["kg"]),
        unit(Force, 1e-3 * GRAVITY, &["g"]),
        unit(Acceleration, GRAVITY, &["g"]),
    unit(Acceleration, 1e-3 * GRAVITY, &["mg", "milli-g"]),
        unit(Voltage, 1.0, &["V", "volt", "volts"]),
        unit(Voltage, 1e-3, &["mV", "millivolt", "millivolts"]),
        unit(Current, 1.0, &["A", "amp", "amps", "ampere", "amperes"]),
        unit(Current, 1e-3, &["mA", "milliamp", "milliamps"]),
        unit(Power, 1.0, &["W", "watt", "watts"]),
        unit(Power, 1e3, &["kW", "kilowatt", "kilowatts"]),
        unit(Pressure, 1.0, &["Pa", "pascal", "pascals"]),
        unit(Pressure, 1e2, &["mbar", "hPa", "millibar", "millibars"]),
        unit(Pressure, 1e3, &["kPa"]),
        unit(Pressure, 1e6, &["MPa"]),
        unit(Pressure, 1e4, &["dbar", "decibar", "decibars"]),
        unit(Pressure, 1e5, &["bar", "bars"]),
        unit(Pressure, POUND * GRAVITY / (FOOT / 12.0 * FOOT / 12.0), &["psi"]),
        unit(Ratio, 1.0, &["1", "-", "ratio", "none", "dimensionless", "unitless"]),
        unit(Ratio, 1e-2, &["%", "percent", "per cent"]),
    ]
};

/// Lower-case spellings that two units share, or that another field of work reads otherwise
/// (`nm`, a nautical mile or a nanometre): there case decides.
const CASE_DECIDES: &[&str] = &["kn", "nm", "mn", "mpa", "mv", "ma", "t"];

/// The meanings of `text`, the default first.
fn meanings(text: &str) -> impl Iterator<Item = &'static Definition> {
    let exact = normalise(text);
    let folded = exact.to_lowercase();
    let known = UNITS.iter().any(|u| u.spellings.contains(&exact.as_str()));
    let fold = !known && !CASE_DECIDES.contains(&folded.as_str());
    let is_written = move |spelling: &&str| {
        if fold { spelling.to_lowercase() == folded } else { **spelling == exact }
    };
    UNITS.iter().filter(move |unit| unit.spellings.iter().any(&is_written))
}

/// One spelling for one unit: `µ` as `u`, `·` and `*` as a space, `^`, `²` and `⁻¹` in ASCII.
fn normalise(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            'µ' | 'μ' => plain.push('u'),
            '·' | '⋅' | '*' | '×' | '\u{a0}' => plain.push(' '),
            '²' => plain.push('2'),
            '¹' => plain.push('1'),
            '⁻' | '−' | '–' => plain.push('-'),
            'º' | '˚' => plain.push('°'),
            '^' => {}
            c => plain.push(c),
        }
    }
    let words = plain.split_whitespace().collect::<Vec<_>>().join(" ");
    words.replace(" / ", "/").replace("/ ", "/").replace(" /", "/")
}

/// The symbols of one dimension, one spelling of each.
pub(crate) fn symbols_of(dimension: Dimension) -> impl Iterator<Item = &'static str> {
    let mut seen = Vec::new();
    UNITS.iter().filter(move |u| u.dimension == dimension).map(|u| u.spellings[0]).filter(
        move |symbol| {
            let new = !seen.contains(symbol);
            seen.push(symbol);
            new
        },
    )
}

fn unknown(text: &str, expected: Option<Dimension>) -> Error {
    let written = normalise(text);
    let units = UNITS.iter().filter(|unit| expected.is_none_or(|of| unit.dimension == of));
    let spellings = units.flat_map(|u| u.spellings.iter().map(|s| (*s, u.spellings[0])));
    let nearest = nearest(&written, spellings, 1).first().copied();
    Error::UnknownUnit { unit: text.trim().to_owned(), nearest, expected }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_spelling_is_found_and_every_factor_is_sound() {
        for definition in UNITS {
            assert!(definition.factor.is_finite() && definition.factor > 0.0);
            for spelling in definition.spellings {
                assert_eq!(normalise(spelling), *spelling, "spellings are in normal form");
                let unit = Unit::parse_as(spelling, definition.dimension).unwrap();
                assert_eq!(unit.factor(), definition.factor, "{spelling}");
            }
        }
    }

    #[test]
    fn no_spelling_has_two_sizes_in_one_dimension() {
        for (k, a) in UNITS.iter().enumerate() {
            for b in UNITS[k + 1..].iter().filter(|b| b.dimension == a.dimension) {
                assert!(a.spellings.iter().all(|s| !b.spellings.contains(s)), "{:?}", a.spellings);
            }
        }
    }

    #[test]
    fn units_that_differ_by_case_alone_are_listed_as_such() {
        let all = || UNITS.iter().flat_map(|u| u.spellings.iter());
        for a in all() {
            for b in all().filter(|b| *b != a && b.to_lowercase() == a.to_lowercase()) {
                assert!(CASE_DECIDES.contains(&a.to_lowercase().as_str()), "{a} and {b}");
            }
        }
    }

    #[test]
    fn spelling_is_lenient() {
        use Dimension::*;
        for (text, dimension, factor) in [
            ("µs", PulseWidth, 1.0),
            ("μs", PulseWidth, 1.0),
            ("microseconds", PulseWidth, 1.0),
            ("M/S", Velocity, 1.0),
            (" m / s ", Velocity, 1.0),
            ("m s-1", Velocity, 1.0),
            ("m·s⁻¹", Velocity, 1.0),
            ("m s^-1", Velocity, 1.0),
            ("kn", Velocity, 1852.0 / 3600.0),
            ("km/h", Velocity, 1.0 / 3.6),
            ("m/s²", Acceleration, 1.0),
            ("m/s^2", Acceleration, 1.0),
            ("°", Angle, std::f64::consts::PI / 180.0),
            ("Degrees", Angle, std::f64::consts::PI / 180.0),
            ("RPM", AngularVelocity, std::f64::consts::TAU / 60.0),
            ("rps", AngularVelocity, std::f64::consts::TAU),
            ("Kg f", Force, 9.806_65),
            ("kN", Force, 1e3),
            ("N·m", Moment, 1.0),
            ("N*m", Moment, 1.0),
            ("Nm", Moment, 1.0),
            ("lb", Mass, 0.453_592_37),
            ("dbar", Pressure, 1e4),
            ("%", Ratio, 0.01),
            ("-", Ratio, 1.0),
            ("v", Voltage, 1.0),
        ] {
            let unit = Unit::parse(text).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!((unit.dimension(), unit.factor()), (dimension, factor), "{text}");
            assert_eq!(unit.symbol(), text.trim());
        }
    }

    #[test]
    fn derived_factors_agree_with_published_ones() {
        // NIST SP 811, appendix B.8, to the digits printed there.
        for (text, dimension, factor, digits) in [
            ("lbf", Dimension::Force, 4.448_222, 1e-6),
            ("psi", Dimension::Pressure, 6.894_757e3, 1e-3),
            ("lbf ft", Dimension::Moment, 1.355_818, 1e-6),
            ("kn", Dimension::Velocity, 5.144_444e-1, 1e-7),
            ("rpm", Dimension::AngularVelocity, 1.047_198e-1, 1e-7),
        ] {
            let found = Unit::parse_as(text, dimension).unwrap().factor();
            assert!((found - factor).abs() < digits, "{text}: {found}");
        }
    }

    #[test]
    fn an_ambiguous_symbol_takes_the_dimension_wanted() {
        let factor = |text, dimension| Unit::parse_as(text, dimension).unwrap().factor();
        assert_eq!(factor("us", Dimension::Time), 1e-6);
        assert_eq!(factor("ms", Dimension::PulseWidth), 1e3);
        assert_eq!(factor("kg", Dimension::Force), 9.806_65);
        assert_eq!(factor("g", Dimension::Acceleration), 9.806_65);
        let pound = Unit::parse("lb").unwrap().resolve(Dimension::Force).unwrap();
        assert_eq!((pound.symbol(), pound.factor()), ("lb", 0.453_592_37 * 9.806_65));
    }

    #[test]
    fn case_decides_where_units_differ_by_it() {
        for text in ["KN", "nm", "NM", "MV", "mpa", "T"] {
            assert!(Unit::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn an_unknown_unit_names_the_nearest_or_all() {
        let message = |text| Unit::parse(text).unwrap_err().to_string();
        assert_eq!(message("knotz"), "unknown unit \"knotz\"; did you mean \"kn\"?");
        let all = message("☃");
        assert!(all.starts_with("unknown unit \"☃\"; write one of us, s, ms, ns, min, h, m, cm"));
        assert!(all.ends_with(", 1, %"), "{all}");
        let of_time = Unit::parse_as("furlong", Dimension::Time).unwrap_err().to_string();
        assert_eq!(of_time, "unknown unit \"furlong\"; write one of s, ms, us, ns, min, h");
    }

    #[test]
    fn a_unit_of_another_dimension_lists_those_that_would_do() {
        let error = Unit::parse_as("m/s", Dimension::Force).unwrap_err();
        assert_eq!(
            error.to_string(),
            "\"m/s\" is a unit of velocity where one of force is needed; write one of N, kN, mN, \
             lbf, kgf, gf, lb, kg, g"
        );
    }

    #[test]
    fn known_units_are_listed_once() {
        let known: Vec<&str> = Unit::known().collect();
        let distinct: std::collections::HashSet<_> = known.iter().collect();
        assert_eq!(known.len(), distinct.len());
        assert!(known.iter().all(|symbol| Unit::parse(symbol).is_ok()));
    }
}
