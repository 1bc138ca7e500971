//! The fields of a topic, and its records.

use std::collections::HashMap;
use std::rc::Rc;

use crate::assemble::{Assembly, Group};
use crate::column::Column;
use crate::quaternion;
use crate::readers::number::Kind;
use crate::unit::Unit;

/// Definition of a topic: `name:type field;type[3] field;…`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Definition {
    pub(super) name: String,
    fields: Vec<Declared>,
}

#[derive(Clone, Debug, PartialEq)]
struct Declared {
    kind: String,
    count: usize,
    array: bool,
    name: String,
}

/// Maximum number of numbers in a record of a sensor.
const MOST_FIELDS: usize = 2048;
/// Maximum nesting depth of topics.
const DEEPEST: usize = 8;
/// Maximum number of elements of a record: numbers, texts, and nested topics, which may be empty.
const MOST_ELEMENTS: usize = 4 * MOST_FIELDS;
/// Maximum length of the name of a topic or a field in bytes: those of uORB are identifiers.
const LONGEST_NAME: usize = 255;

impl Definition {
    /// Parses an `F` message.
    pub(super) fn read(body: &[u8]) -> Option<Self> {
        let (name, rest) = std::str::from_utf8(body).ok()?.split_once(':')?;
        let fields = rest.split(';').map(str::trim).filter(|field| !field.is_empty());
        let fields = fields.map(Declared::read).collect::<Option<Vec<_>>>()?;
        let is_name = (1..=LONGEST_NAME).contains(&name.len());
        is_name.then(|| Self { name: name.to_owned(), fields })
    }
}

impl Declared {
    fn read(text: &str) -> Option<Self> {
        let (kind, name) = text.split_once(' ')?;
        let (kind, count) = match kind.split_once('[') {
            Some((kind, count)) => (kind, Some(count.strip_suffix(']')?.parse().ok()?)),
            None => (kind, None),
        };
        let (kind, name) = (kind.to_owned(), name.trim().to_owned());
        if name.len() > LONGEST_NAME {
            return None;
        }
        Some(Self { kind, count: count.unwrap_or(1), array: count.is_some(), name })
    }
}

/// A number in a record.
#[derive(Clone, Debug, PartialEq)]
struct Field {
    name: String,
    at: usize,
    kind: Kind,
}

/// Positions of fields in a record.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Layout {
    fields: Vec<Field>,
    time: Option<usize>,
    texts: Vec<String>,
    /// Number of elements visited.
    elements: usize,
    /// Length of a record in bytes, and its minimum length: padding at its end may be omitted.
    size: usize,
    least: usize,
}

impl Layout {
    /// Builds the layout of a topic; `None` for a definition that refers to an undefined one or is
    /// no record's.
    pub(super) fn new(name: &str, known: &HashMap<String, Definition>) -> Option<Self> {
        let mut layout = Self::default();
        layout.add(name, "", known, 0)?;
        layout.time?;
        Some(layout)
    }

    fn add(
        &mut self,
        topic: &str,
        prefix: &str,
        known: &HashMap<String, Definition>,
        depth: usize,
    ) -> Option<()> {
        let definition = known.get(topic).filter(|_| depth < DEEPEST)?;
        for declared in &definition.fields {
            self.count_element()?;
            let Declared { kind, count, array, name } = declared;
            let is_padding = name.starts_with("_padding");
            let number = number(kind);
            if kind == "char" || is_padding {
                let size = number.map_or(1, Kind::size).checked_mul(*count)?;
                if kind == "char" && !is_padding {
                    self.texts.push(format!("{prefix}{name}"));
                }
                self.grow(size, is_padding)?;
                continue;
            }
            for k in 0..*count {
                self.count_element()?;
                let name = match array {
                    true => format!("{prefix}{name}[{k}]"),
                    false => format!("{prefix}{name}"),
                };
                let Some(kind) = number else {
                    self.add(kind, &format!("{name}."), known, depth + 1)?;
                    continue;
                };
                if name == "timestamp" && matches!(kind, Kind::U64 | Kind::U32) {
                    self.time = Some(self.fields.len());
                }
                self.fields.push(Field { name, at: self.size, kind });
                self.grow(kind.size(), false)?;
                if self.fields.len() > MOST_FIELDS {
                    return None;
                }
            }
        }
        Some(())
    }

    fn count_element(&mut self) -> Option<()> {
        self.elements += 1;
        (self.elements <= MOST_ELEMENTS).then_some(())
    }

    fn grow(&mut self, by: usize, is_padding: bool) -> Option<()> {
        self.size = self.size.checked_add(by).filter(|size| *size <= 0xffff)?;
        self.least = if is_padding { self.least } else { self.size };
        Some(())
    }

    /// Returns the number of numbers in a record.
    pub(super) fn fields(&self) -> usize {
        self.fields.len()
    }

    /// Returns whether a record may have this length.
    pub(super) fn fits(&self, bytes: usize) -> bool {
        (self.least..=self.size).contains(&bytes)
    }
}

fn number(kind: &str) -> Option<Kind> {
    Some(match kind {
        "int8_t" => Kind::I8,
        "uint8_t" | "bool" => Kind::U8,
        "int16_t" => Kind::I16,
        "uint16_t" => Kind::U16,
        "int32_t" => Kind::I32,
        "uint32_t" => Kind::U32,
        "int64_t" => Kind::I64,
        "uint64_t" => Kind::U64,
        "float" => Kind::F32,
        "double" => Kind::F64,
        _ => return None,
    })
}

/// An instance of a topic and its records.
pub(super) struct Topic {
    pub(super) name: String,
    pub(super) instance: u8,
    pub(super) layout: Rc<Layout>,
    time_s: Vec<f64>,
    /// Values of each number of a record.
    values: Vec<Vec<f64>>,
}

impl Topic {
    pub(super) fn new(name: String, instance: u8, layout: Rc<Layout>) -> Self {
        let values = vec![Vec::new(); layout.fields.len()];
        Self { name, instance, layout, time_s: Vec::new(), values }
    }

    /// Stores a record and returns its time, s.
    pub(super) fn push(&mut self, record: &[u8]) -> f64 {
        for (field, values) in self.layout.fields.iter().zip(&mut self.values) {
            values.push(field.kind.value(record.get(field.at..).unwrap_or_default()));
        }
        let time = self.layout.time.and_then(|time| self.values[time].last()).copied();
        let time_s = time.unwrap_or(f64::NAN) / 1e6;
        self.time_s.push(time_s);
        time_s
    }

    /// Returns whether there are records.
    pub(super) fn has_records(&self) -> bool {
        !self.time_s.is_empty()
    }

    /// Returns the last value of a field.
    pub(super) fn last(&self, name: &str) -> Option<f64> {
        let field = self.layout.fields.iter().position(|field| field.name == name)?;
        self.values[field].last().copied()
    }

    /// Makes channels of the records; `apart` is true if the topic has other instances.
    pub(super) fn into_group(mut self, apart: bool, assembly: &mut Assembly) {
        if self.time_s.is_empty() {
            return;
        }
        let name = match apart {
            true => format!("{}[{}]", self.name, self.instance),
            false => self.name.clone(),
        };
        for text in &self.layout.texts {
            assembly.leave_out(format!("{name}.{text}"), "is text");
        }
        let angles = self.angles(&name);
        let mut columns = Vec::new();
        for (k, field) in self.layout.fields.iter().enumerate() {
            if Some(k) != self.layout.time {
                let values = std::mem::take(&mut self.values[k]);
                columns.push(Column::new(format!("{name}.{}", field.name), None, values));
            }
        }
        columns.extend(angles);
        assembly.group(Group { name, time_s: self.time_s, columns, of: None });
    }

    /// Computes roll, pitch and yaw of a quaternion `q` of w, x, y and z.
    fn angles(&self, name: &str) -> Vec<Column> {
        let place = |k: usize| {
            let wanted = format!("q[{k}]");
            self.layout.fields.iter().position(|field| field.name == wanted)
        };
        let [Some(w), Some(x), Some(y), Some(z)] = [0, 1, 2, 3].map(place) else {
            return Vec::new();
        };
        let has = |wanted: &str| self.layout.fields.iter().any(|field| field.name == wanted);
        if place(4).is_some() || ["roll", "pitch", "yaw"].into_iter().any(has) {
            return Vec::new();
        }
        let mut angles: [Vec<f64>; 3] = Default::default();
        for row in 0..self.time_s.len() {
            let [w, x, y, z] = [w, x, y, z].map(|k| self.values[k][row]);
            for (angle, of) in angles.iter_mut().zip(quaternion::angles([x, y, z, w])) {
                angle.push(of);
            }
        }
        let named = ["roll", "pitch", "yaw"].into_iter().zip(angles);
        let unit = || Unit::find("rad");
        named.map(|(angle, of)| Column::new(format!("{name}.{angle}"), unit(), of)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(texts: &[&str]) -> HashMap<String, Definition> {
        let read = |text: &&str| Definition::read(text.as_bytes()).expect("a definition");
        texts.iter().map(read).map(|definition| (definition.name.clone(), definition)).collect()
    }

    #[test]
    fn fields_stand_one_after_another_and_padding_at_the_end_may_be_missing() {
        let known = known(&[
            "inner:float a;char[2] b;",
            "outer:uint64_t timestamp;inner[2] parts;uint8_t[3] c;uint8_t[4] _padding0;",
        ]);
        let layout = Layout::new("outer", &known).expect("a layout");
        let places: Vec<(&str, usize)> =
            layout.fields.iter().map(|field| (field.name.as_str(), field.at)).collect();
        assert_eq!(places[..3], [("timestamp", 0), ("parts[0].a", 8), ("parts[1].a", 14)]);
        assert_eq!(places[3..], [("c[0]", 20), ("c[1]", 21), ("c[2]", 22)]);
        assert!(layout.fits(23) && layout.fits(27) && !layout.fits(22) && !layout.fits(28));
    }

    #[test]
    fn topics_that_hold_themselves_or_too_much_are_none() {
        assert!(Layout::new("a", &known(&["a:uint64_t timestamp;a again;"])).is_none());
        assert!(Layout::new("a", &known(&["a:uint64_t timestamp;float[9000] x;"])).is_none());
        assert!(Layout::new("a", &known(&["a:float x;"])).is_none());
        let empty = known(&["e:", "a:uint64_t timestamp;e[4000000000] x;"]);
        assert!(Layout::new("a", &empty).is_none());
        let long = format!("a:uint64_t timestamp;float {};", "x".repeat(256));
        assert_eq!(Definition::read(long.as_bytes()), None);
        assert!(Layout::new("a", &known(&["a:uint64_t timestamp;b x;"])).is_none());
    }
}
