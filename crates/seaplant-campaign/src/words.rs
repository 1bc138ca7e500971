//! Interprets the words in a column's name.

use seaplant_log::{Channel, Dimension, Unit};

pub(crate) const HEADING: &[&str] = &["heading", "hdg", "yaw", "psi", "compass", "ψ"];
pub(crate) const ROLL: &[&str] = &["roll", "phi", "φ"];
pub(crate) const PITCH: &[&str] = &["pitch", "theta", "θ"];

/// Words of thrusters.
const THRUSTER: &[&str] = &[
    "thruster",
    "thrusters",
    "thr",
    "thrust",
    "motor",
    "motors",
    "mot",
    "prop",
    "propeller",
    "propellers",
    "esc",
    "servo",
    "pwm",
    "rpm",
    "rotor",
    "shaft",
    "engine",
    "throttle",
];
/// Words of commands, as opposed to measurements.
pub(crate) const COMMAND: &[&str] = &[
    "cmd",
    "command",
    "commanded",
    "desired",
    "des",
    "setpoint",
    "sp",
    "target",
    "reference",
    "ref",
    "goal",
];

/// Splits a name into words, in lower case: `psi_hat`, `GyroZ`, `DVLVelocity x` and `PWM1` have
/// two, two, three, and two (`pwm1` and `pwm`).
pub(crate) fn words(name: &str) -> Vec<String> {
    let mut found = split(name);
    let stems: Vec<String> = found.iter().filter_map(|word| stem(word)).collect();
    found.extend(stems);
    found
}

fn split(name: &str) -> Vec<String> {
    let mut found = Vec::new();
    for part in name.split(|c: char| !c.is_alphanumeric()).filter(|part| !part.is_empty()) {
        let letters: Vec<char> = part.chars().collect();
        let mut word = String::new();
        for (k, c) in letters.iter().enumerate() {
            let before = k.checked_sub(1).map(|k| letters[k]);
            let hump = before.is_some_and(|before| before.is_lowercase() && c.is_uppercase());
            let last_capital = before.is_some_and(char::is_uppercase)
                && c.is_uppercase()
                && letters.get(k + 1).is_some_and(|next| next.is_lowercase());
            if (hump || last_capital) && !word.is_empty() {
                found.push(std::mem::take(&mut word));
            }
            word.extend(c.to_lowercase());
        }
        found.push(word);
    }
    found
}

/// Returns `pwm1` without its number, if enough letters remain.
fn stem(word: &str) -> Option<String> {
    let stem = word.trim_end_matches(|c: char| c.is_ascii_digit());
    (stem.len() < word.len() && stem.chars().count() >= 2).then(|| stem.to_owned())
}

/// Returns whether a word numbers a thruster: `t1`, `m12`, `ch3`.
fn is_numbered(word: &str) -> bool {
    ["t", "m", "ch"].iter().any(|letter| {
        word.strip_prefix(letter).is_some_and(|number| {
            (1..=2).contains(&number.len()) && number.bytes().all(|b| b.is_ascii_digit())
        })
    })
}

/// Returns whether words refer to a thruster.
pub(crate) fn tells_of_thruster(words: &[String]) -> bool {
    is_named_thruster(words) || words.iter().any(|word| is_numbered(word))
}

/// Returns whether words name a thruster or a part of one; `t1` alone may be something else.
pub(crate) fn is_named_thruster(words: &[String]) -> bool {
    words.iter().any(|word| THRUSTER.contains(&word.as_str()))
}

/// Returns whether a unit counts revolutions, as those of propellers do and those of gyroscopes do
/// not.
pub(crate) fn counts_turns(unit: &Unit) -> bool {
    const TURN: f64 = std::f64::consts::TAU;
    let factor = unit.factor();
    unit.dimension() == Dimension::AngularVelocity
        && [TURN, TURN / 60.0].iter().any(|turn| (factor - turn).abs() < 1e-12)
}

/// Returns whether a channel is a command, which may rest, step and stop.
pub(crate) fn is_input(channel: &Channel, words: &[String]) -> bool {
    let by_unit = channel.unit.as_ref().is_some_and(|unit| {
        let set = [
            Dimension::PulseWidth,
            Dimension::Ratio,
            Dimension::Force,
            Dimension::Moment,
            Dimension::Current,
            Dimension::Power,
        ];
        set.contains(&unit.dimension()) || counts_turns(unit)
    });
    let set = |word: &String| COMMAND.contains(&word.as_str());
    by_unit || tells_of_thruster(words) || words.iter().any(set)
}

/// Returns a unit at the end of a name without brackets, as in `heading_deg` or `u_m_s`.
pub(crate) fn unit_by_name(name: &str) -> Option<&'static str> {
    const UNITS: &[(&[&str], &str)] = &[
        (&["rad", "s"], "rad/s"),
        (&["deg", "s"], "deg/s"),
        (&["m", "s"], "m/s"),
        (&["dps"], "deg/s"),
        (&["degps"], "deg/s"),
        (&["radps"], "rad/s"),
        (&["mps"], "m/s"),
        (&["knots"], "kn"),
        (&["kn"], "kn"),
        (&["kts"], "kn"),
        (&["rpm"], "rpm"),
        (&["rps"], "rev/s"),
        (&["us"], "us"),
        (&["deg"], "deg"),
        (&["rad"], "rad"),
        (&["m"], "m"),
        (&["newton"], "N"),
        (&["volt"], "V"),
        (&["volts"], "V"),
    ];
    let words = split(name);
    let ends = |unit: &[&str]| {
        words.len() > unit.len() && words[words.len() - unit.len()..].iter().eq(unit)
    };
    UNITS.iter().find(|(unit, _)| ends(unit)).map(|(_, symbol)| *symbol)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_taken_apart_at_marks_and_humps() {
        assert_eq!(words("psi_hat"), ["psi", "hat"]);
        assert_eq!(words("DVLVelocity x"), ["dvl", "velocity", "x"]);
        assert_eq!(words("GyroZ"), ["gyro", "z"]);
        assert_eq!(words("PWM1"), ["pwm1", "pwm"]);
        assert_eq!(words("T1"), ["t1"]);
        assert_eq!(words("☃ \"\n"), Vec::<String>::new());
    }

    #[test]
    fn a_name_may_end_in_its_unit() {
        let unit = |name| unit_by_name(name);
        assert_eq!(unit("heading_deg"), Some("deg"));
        assert_eq!(unit("u_m_s"), Some("m/s"));
        assert_eq!(unit("motor1 rpm"), Some("rpm"));
        assert_eq!(unit("m"), None);
    }
}
