//! Units of measure in logs.

use std::fmt;

use crate::Error;
use crate::dimension::Dimension;
use crate::spelling::nearest;
use crate::symbol::{self, Definition, UNITS, meanings, normalise, symbols_of};

/// A unit of measure: its symbol as written, its quantity, and its size in SI.
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
    /// Recognises a unit in various spellings: `µs`, `us`; `m/s`, `m s-1`; `Kg f`, `kgf`.
    ///
    /// Case is ignored where no other unit differs by case alone (`kn` is a knot, `kN` a
    /// kilonewton, so `KN` is refused). A symbol of several meanings gets the most common one in
    /// logs: `us` is a pulse width, `lb`, `kg` and `g` are masses; [`Unit::parse_as`] selects
    /// another.
    ///
    /// # Errors
    /// [`Error::UnknownUnit`], with the nearest known one.
    pub fn parse(text: &str) -> Result<Self, Error> {
        Self::find(text).ok_or_else(|| unknown(text, None))
    }

    /// Does the same as [`Unit::parse`] for text that may not be a unit.
    pub(crate) fn find(text: &str) -> Option<Self> {
        meanings(text).next().map(|meaning| Self::written(text, meaning))
    }

    /// Does the same as [`Unit::parse_as`] for text that may not be a unit.
    pub(crate) fn find_as(text: &str, expected: Dimension) -> Option<Self> {
        let meaning = meanings(text).find(|meaning| meaning.dimension == expected)?;
        Some(Self::written(text, meaning))
    }

    fn written(text: &str, meaning: &Definition) -> Self {
        let symbol = text.trim().to_owned();
        Self { symbol, dimension: meaning.dimension, factor: meaning.factor }
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

    /// Interprets the same symbol as a unit of `expected`: see [`Unit::parse_as`].
    ///
    /// # Errors
    /// [`Error::Dimension`] where the symbol does not measure `expected`.
    pub fn resolve(&self, expected: Dimension) -> Result<Self, Error> {
        Self::parse_as(&self.symbol, expected)
    }

    /// Returns whether both symbols may mean the same: `kg` and `kgf` do as forces.
    pub(crate) fn agrees_with(&self, other: &Self) -> bool {
        meanings(&self.symbol).any(|meaning| {
            let same = Self::find_as(&other.symbol, meaning.dimension);
            same.is_some_and(|same| same.factor == meaning.factor)
        })
    }

    /// Returns the symbol as the log wrote it.
    pub fn symbol(&self) -> &str {
        &self.symbol
    }

    /// Returns the quantity that the unit measures.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// Returns the size of the unit in the SI unit of its dimension (for a pulse width, in µs).
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Converts a value in this unit to SI (a pulse width, to µs).
    pub fn to_si(&self, value: f64) -> f64 {
        value * self.factor
    }

    /// Returns the symbols of all known units, one spelling of each.
    pub fn known() -> impl Iterator<Item = &'static str> {
        symbol::known()
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.symbol)
    }
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
