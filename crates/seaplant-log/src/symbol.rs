//! Symbols of units and their definitions.

use crate::dimension::Dimension;

/// One meaning of a symbol; `spellings[0]` is used in messages.
pub(crate) struct Definition {
    pub(crate) dimension: Dimension,
    pub(crate) factor: f64,
    pub(crate) spellings: &'static [&'static str],
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

/// All meanings of all symbols; of two meanings of one symbol the first is the default. Spellings
/// are in the form that [`normalise`] returns.
#[rustfmt::skip]
pub(crate) static UNITS: &[Definition] = {
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

/// Lower-case spellings that two units share, or that other fields read differently (`nm`, a
/// nautical mile or a nanometre): their case is significant.
const CASE_DECIDES: &[&str] = &["kn", "nm", "mn", "mpa", "mv", "ma", "t"];

/// Returns the meanings of `text`, the default first.
pub(crate) fn meanings(text: &str) -> impl Iterator<Item = &'static Definition> {
    let exact = normalise(text);
    let folded = exact.to_lowercase();
    let known = UNITS.iter().any(|u| u.spellings.contains(&exact.as_str()));
    let fold = !known && !CASE_DECIDES.contains(&folded.as_str());
    let is_written = move |spelling: &&str| {
        if fold { spelling.to_lowercase() == folded } else { **spelling == exact }
    };
    UNITS.iter().filter(move |unit| unit.spellings.iter().any(&is_written))
}

/// Normalises spellings of a unit: `µ` to `u`, `·` and `*` to a space, `^`, `²` and `⁻¹` to ASCII.
pub(crate) fn normalise(text: &str) -> String {
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

/// Returns the symbols of one dimension, one spelling of each.
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

/// Returns the symbols of all units, one spelling of each.
pub(crate) fn known() -> impl Iterator<Item = &'static str> {
    let first = |k: usize| UNITS[..k].iter().all(|u| u.spellings[0] != UNITS[k].spellings[0]);
    (0..UNITS.len()).filter(move |&k| first(k)).map(|k| UNITS[k].spellings[0])
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
