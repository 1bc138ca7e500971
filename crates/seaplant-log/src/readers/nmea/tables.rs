//! The fields of sentences.

/// A field that makes a channel.
pub(super) struct Field {
    pub(super) name: &'static str,
    /// Unit; empty where the sentence does not state it, or it is not a unit of channels.
    pub(super) unit: &'static str,
    /// Index after the address.
    pub(super) at: usize,
    read: Read,
    status: Status,
}

/// Validity of a field by another field.
enum Status {
    Always,
    If(&'static [(usize, &'static str)]),
    Unless(usize, &'static str),
}

/// Encoding of a field.
enum Read {
    Number,
    /// This many make one of the unit.
    Parts(f64),
    /// Degrees and minutes in one, `ddmm.mmm`; this letter in the next field makes it negative.
    Minutes(&'static str),
    /// This letter in the next field makes it negative.
    Signed(&'static str),
    /// A speed whose unit is the letter in another field, converted to m/s.
    Speed(usize),
}

const fn field(at: usize, name: &'static str, unit: &'static str) -> Field {
    Field { name, unit, at, read: Read::Number, status: Status::Always }
}

impl Field {
    const fn parts(self, of_unit: f64) -> Self {
        Self { read: Read::Parts(of_unit), ..self }
    }

    const fn minutes(self, negative: &'static str) -> Self {
        Self { read: Read::Minutes(negative), ..self }
    }

    const fn signed(self, negative: &'static str) -> Self {
        Self { read: Read::Signed(negative), ..self }
    }

    const fn unless(self, at: usize, says: &'static str) -> Self {
        Self { status: Status::Unless(at, says), ..self }
    }

    const fn only_if(self, say: &'static [(usize, &'static str)]) -> Self {
        Self { status: Status::If(say), ..self }
    }

    const fn speed(self, unit_at: usize) -> Self {
        Self { read: Read::Speed(unit_at), ..self }
    }

    /// Reads the value from the fields of a sentence; `NaN` if there is none.
    pub(super) fn value(&self, fields: &[&str]) -> f64 {
        let text = |at: usize| fields.get(at).map_or("", |text| text.trim());
        let is_valid = match self.status {
            Status::Always => true,
            Status::If(all) => all.iter().all(|(at, says)| text(*at) == *says),
            Status::Unless(at, says) => text(at) != says,
        };
        if !is_valid {
            return f64::NAN;
        }
        let value = number(text(self.at));
        let sign = |negative: &str| if text(self.at + 1) == negative { -1.0 } else { 1.0 };
        match self.read {
            Read::Number => value,
            Read::Parts(of_unit) => value / of_unit,
            Read::Signed(negative) => sign(negative) * value,
            Read::Minutes(negative) => sign(negative) * degrees(text(self.at)),
            Read::Speed(at) => value * metres_a_second(text(at)),
        }
    }
}

/// Converts the letters of units of speed; `NaN` for others.
fn metres_a_second(letter: &str) -> f64 {
    match letter {
        "M" => 1.0,
        "N" => 1852.0 / 3600.0,
        "K" => 1.0 / 3.6,
        "S" => 1609.344 / 3600.0,
        _ => f64::NAN,
    }
}

/// Parses `dddmm.mmm` as text: subtracting numbers would lose digits.
fn degrees(text: &str) -> f64 {
    let point = text.find('.').unwrap_or(text.len());
    let parts = point.checked_sub(2).and_then(|at| text.split_at_checked(at));
    let (degrees, minutes) = parts.unwrap_or_default();
    number(degrees) + number(minutes) / 60.0
}

/// Parses a number in plain digits; `NaN` if it is none.
pub(super) fn number(text: &str) -> f64 {
    let plain = text.bytes().all(|b| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+'));
    text.parse().ok().filter(|_| plain).unwrap_or(f64::NAN)
}

/// Fields of the sentences that any talker may send: IEC 61162-1.
#[rustfmt::skip]
const STANDARD: &[(&str, &[Field])] = &[
    ("DBK", &[field(2, "depth", "m").only_if(&[(3, "M")])]),
    ("DBS", &[field(2, "depth", "m").only_if(&[(3, "M")])]),
    ("DBT", &[field(2, "depth", "m").only_if(&[(3, "M")])]),
    ("DPT", &[field(0, "depth", "m"), field(1, "offset", "m")]),
    ("GGA", &[
        field(1, "latitude", "deg").minutes("S").unless(5, "0"),
        field(3, "longitude", "deg").minutes("W").unless(5, "0"),
        field(8, "altitude", "m").unless(5, "0"),
        field(5, "quality", ""),
        field(6, "satellites", ""),
        field(7, "hdop", ""),
    ]),
    ("GLL", &[
        field(0, "latitude", "deg").minutes("S").unless(5, "V"),
        field(2, "longitude", "deg").minutes("W").unless(5, "V"),
    ]),
    ("HDG", &[
        field(0, "heading_magnetic", "deg"),
        field(1, "deviation", "deg").signed("W"),
        field(3, "variation", "deg").signed("W"),
    ]),
    ("HDM", &[field(0, "heading_magnetic", "deg")]),
    ("HDT", &[field(0, "heading", "deg")]),
    // T is the true wind relative to the bow, which is no direction over ground.
    ("MWV", &[
        field(0, "relative_wind_angle", "deg").only_if(&[(1, "R"), (4, "A")]),
        field(2, "relative_wind_speed", "m/s").speed(3).only_if(&[(1, "R"), (4, "A")]),
        field(0, "theoretical_wind_angle", "deg").only_if(&[(1, "T"), (4, "A")]),
        field(2, "theoretical_wind_speed", "m/s").speed(3).only_if(&[(1, "T"), (4, "A")]),
    ]),
    ("RMC", &[
        field(2, "latitude", "deg").minutes("S").unless(1, "V"),
        field(4, "longitude", "deg").minutes("W").unless(1, "V"),
        field(6, "speed", "kn").unless(1, "V"),
        field(7, "course", "deg").unless(1, "V"),
        field(9, "variation", "deg").signed("W").unless(1, "V"),
    ]),
    // Degrees per minute, for which channels have no unit.
    ("ROT", &[field(0, "rate_of_turn", "deg/s").parts(60.0).unless(1, "V")]),
    // Shafts: 0 is a single or centreline shaft, odd numbers are to starboard, even ones to port.
    ("RPM", &[
        field(2, "propeller", "rpm").only_if(&[(0, "S"), (1, "0"), (4, "A")]),
        field(2, "propeller_1", "rpm").only_if(&[(0, "S"), (1, "1"), (4, "A")]),
        field(2, "propeller_2", "rpm").only_if(&[(0, "S"), (1, "2"), (4, "A")]),
    ]),
    // Positive angles turn the bow to starboard; a single rudder uses the field of the starboard
    // one.
    ("RSA", &[
        field(0, "rudder", "deg").only_if(&[(1, "A")]),
        field(2, "port_rudder", "deg").only_if(&[(3, "A")]),
    ]),
    ("THS", &[field(0, "heading", "deg").unless(1, "V")]),
    ("VBW", &[
        field(0, "water_speed_forward", "kn").unless(2, "V"),
        field(1, "water_speed_starboard", "kn").unless(2, "V"),
        field(3, "ground_speed_forward", "kn").unless(5, "V"),
        field(4, "ground_speed_starboard", "kn").unless(5, "V"),
        field(6, "stern_water_speed_starboard", "kn").unless(7, "V"),
        field(8, "stern_ground_speed_starboard", "kn").unless(9, "V"),
    ]),
    ("VHW", &[
        field(0, "heading", "deg").only_if(&[(1, "T")]),
        field(2, "heading_magnetic", "deg").only_if(&[(3, "M")]),
        field(4, "water_speed", "kn").only_if(&[(5, "N")]),
    ]),
    ("VLW", &[
        field(0, "water_distance", "nmi").only_if(&[(1, "N")]),
        field(2, "water_trip", "nmi").only_if(&[(3, "N")]),
        field(4, "ground_distance", "nmi").only_if(&[(5, "N")]),
        field(6, "ground_trip", "nmi").only_if(&[(7, "N")]),
    ]),
    ("VTG", &[
        field(0, "course", "deg").only_if(&[(1, "T")]),
        field(2, "course_magnetic", "deg").only_if(&[(3, "M")]),
        field(4, "speed", "kn").only_if(&[(5, "N")]),
    ]),
    ("ZDA", &[]),
];

/// Fields of proprietary sentences: Teledyne, Ashtech and its many followers, Exail (iXblue,
/// iXSea), Kongsberg. Signs are the makers'.
#[rustfmt::skip]
const PROPRIETARY: &[(&str, &[Field])] = &[
    ("PASHR", &[
        field(1, "heading", "deg").only_if(&[(2, "T")]),
        field(3, "roll", "deg").only_if(&[(2, "T")]),
        field(4, "pitch", "deg").only_if(&[(2, "T")]),
        field(5, "heave", "m").only_if(&[(2, "T")]),
        field(6, "roll_std", "deg").only_if(&[(2, "T")]),
        field(7, "pitch_std", "deg").only_if(&[(2, "T")]),
        field(8, "heading_std", "deg").only_if(&[(2, "T")]),
    ]),
    ("PRDID", &[field(0, "pitch", "deg"), field(1, "roll", "deg"), field(2, "heading", "deg")]),
    ("PIXSE,ATITUD", &[field(1, "roll", "deg"), field(2, "pitch", "deg")]),
    ("PIXSE,DEPIN_", &[field(1, "depth", "m")]),
    ("PIXSE,HEAVE_", &[field(1, "surge", "m"), field(2, "sway", "m"), field(3, "heave", "m")]),
    ("PIXSE,POSITI", &[
        field(1, "latitude", "deg"), field(2, "longitude", "deg"), field(3, "altitude", "m"),
    ]),
    ("PIXSE,SPEED_", &[
        field(1, "speed_east", "m/s"), field(2, "speed_north", "m/s"), field(3, "speed_up", "m/s"),
    ]),
    ("PIXSE,STDHRP", &[
        field(1, "heading_std", "deg"), field(2, "roll_std", "deg"), field(3, "pitch_std", "deg"),
    ]),
    // Letters for signs: M and P, bow up and down; T and B, port up and down.
    ("PHTRO", &[field(0, "pitch", "deg").signed("P"), field(2, "roll", "deg").signed("B")]),
    ("PHLIN", &[field(0, "surge", "m"), field(1, "sway", "m"), field(2, "heave", "m")]),
    ("PHSPD", &[
        field(0, "surge_speed", "m/s"), field(1, "sway_speed", "m/s"), field(2, "heave_speed", "m/s"),
    ]),
    ("PSXN,23", &[
        field(1, "roll", "deg"), field(2, "pitch", "deg"), field(3, "heading", "deg"),
        field(4, "heave", "m"),
    ]),
];

/// Fields of a Paroscientific sensor, in the unit that it was set to.
const PAROSCIENTIFIC: &[Field] = &[field(0, "pressure", ""), field(1, "temperature", "")];

/// A kind of sentence: the name of its channels, its kind regardless of talker, its fields.
pub(super) struct Kind {
    pub(super) name: String,
    pub(super) formatter: String,
    /// `None` for unknown kinds.
    pub(super) fields: Option<&'static [Field]>,
}

/// Splits a sentence into the part that identifies its kind and the fields after the address.
pub(super) fn split(body: &str) -> (&str, Vec<&str>) {
    let (address, rest) = body.split_once(',').unwrap_or((body, ""));
    let mut fields: Vec<&str> = rest.split(',').collect();
    if body.as_bytes().first().is_some_and(u8::is_ascii_digit) {
        // Two digits name the sensor; the number follows without a separator.
        let (sensor, first) = body.split_at_checked(2).unwrap_or((body, ""));
        fields = first.split(',').collect();
        return (sensor, fields);
    }
    let key = match (address, fields.first()) {
        ("PIXSE" | "PSXN", Some(second)) => &body[..address.len() + 1 + second.len()],
        // Some makers send other content under the same address, distinguished by a word.
        ("PASHR", Some(second)) if !second.is_empty() && !number(second).is_finite() => {
            &body[..address.len() + 1 + second.len()]
        }
        _ => address,
    };
    (key, fields)
}

/// Returns the description of a kind of sentence by its identifying part.
pub(super) fn kind(key: &str) -> Kind {
    let named = |name: String, formatter: &str, fields| Kind {
        name,
        formatter: formatter.to_owned(),
        fields,
    };
    if key.bytes().all(|b| b.is_ascii_digit()) {
        return named(format!("PAROSCIENTIFIC-{key}"), "", Some(PAROSCIENTIFIC));
    }
    let find = |table: &'static [(&str, &'static [Field])], key: &str| {
        table.iter().find(|(known, _)| *known == key).map(|(_, fields)| *fields)
    };
    let proprietary = find(PROPRIETARY, key);
    match (proprietary, key.len()) {
        (None, 5) if !key.starts_with('P') => {
            let (talker, formatter) = key.split_at(2);
            named(format!("{talker}-{formatter}"), formatter, find(STANDARD, formatter))
        }
        (found, _) => named(key.replace(',', "-"), key, found),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the values of a sentence as the manuals print them.
    fn values(body: &str) -> Vec<(String, f64)> {
        let (key, fields) = split(body);
        let kind = kind(key);
        let table = kind.fields.unwrap_or_default().iter();
        let value = |f: &Field| (format!("{}.{}", kind.name, f.name), f.value(&fields));
        table.map(value).filter(|(_, value)| value.is_finite()).collect()
    }

    fn named(of: &[(&str, f64)]) -> Vec<(String, f64)> {
        of.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect()
    }

    #[test]
    fn letters_give_signs() {
        assert_eq!(
            values("HCHDG,98.3,0.5,W,12.6,E"),
            named(&[
                ("HC-HDG.heading_magnetic", 98.3),
                ("HC-HDG.deviation", -0.5),
                ("HC-HDG.variation", 12.6)
            ])
        );
        assert_eq!(
            values("PHTRO,1.25,P,0.50,T"),
            named(&[("PHTRO.pitch", -1.25), ("PHTRO.roll", 0.5)])
        );
        assert_eq!(
            values("GPGLL,4930.0,S,12315.0,W,225444,A"),
            named(&[("GP-GLL.latitude", -49.5), ("GP-GLL.longitude", -123.25)])
        );
    }

    #[test]
    fn fields_marked_invalid_are_missing() {
        assert_eq!(values("GPROT,35.6,V"), []);
        assert_eq!(values("GPROT,-36.0,A"), named(&[("GP-ROT.rate_of_turn", -0.6)]));
        assert_eq!(values("HETHS,77.5,V"), []);
        assert_eq!(
            values("VDVBW,1.5,-0.2,V,1.4,-0.1,A"),
            named(&[("VD-VBW.ground_speed_forward", 1.4), ("VD-VBW.ground_speed_starboard", -0.1)])
        );
    }

    #[test]
    fn rudders_shafts_and_wind_are_known() {
        assert_eq!(values("AGRSA,-10.5,A,,"), named(&[("AG-RSA.rudder", -10.5)]));
        assert_eq!(values("AGRSA,1.0,V,2.0,A"), named(&[("AG-RSA.port_rudder", 2.0)]));
        assert_eq!(values("ERRPM,S,2,-90.5,100.0,A"), named(&[("ER-RPM.propeller_2", -90.5)]));
        assert_eq!(values("ERRPM,E,1,2400,100.0,A"), []);
        let relative =
            named(&[("WI-MWV.relative_wind_angle", 214.8), ("WI-MWV.relative_wind_speed", 10.0)]);
        assert_eq!(values("WIMWV,214.8,R,36.0,K,A"), relative);
        let knots = values("WIMWV,214.8,T,10.0,N,A");
        assert!(knots[1].0.contains("theoretical") && (knots[1].1 - 5.144).abs() < 1e-3);
        assert_eq!(values("WIMWV,214.8,R,36.0,K,V"), []);
    }

    #[test]
    fn the_old_layout_of_a_sentence_is_not_taken_for_the_new() {
        assert_eq!(values("GPVTG,054.7,034.4,005.5,010.2"), []);
        assert_eq!(values("GPVTG,054.7,T,,M,005.5,N,010.2,K").len(), 2);
    }

    #[test]
    fn makers_own_sentences_are_known() {
        assert_eq!(
            values("PRDID,-1.31,+0.40,181.25"),
            named(&[("PRDID.pitch", -1.31), ("PRDID.roll", 0.4), ("PRDID.heading", 181.25)])
        );
        assert_eq!(
            values("PIXSE,ATITUD,-0.729,-15.705"),
            named(&[("PIXSE-ATITUD.roll", -0.729), ("PIXSE-ATITUD.pitch", -15.705)])
        );
        assert_eq!(values("PASHR,ATT,1.0,2.0"), []);
        assert_eq!(values("0114.7234"), named(&[("PAROSCIENTIFIC-01.pressure", 14.7234)]));
    }
}
