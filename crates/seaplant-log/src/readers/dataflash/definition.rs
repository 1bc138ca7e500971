//! Definitions of message types from FMT records.

use crate::readers::number::{Kind, text};

/// Length of the marks and the type number.
pub(super) const HEADER: usize = 3;

/// Type number of definitions.
pub(super) const FMT: u8 = 128;
pub(super) const FMT_LENGTH: usize = HEADER + 1 + 1 + 4 + 16 + 64;

/// A type of message.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Definition {
    pub(super) name: String,
    /// Length of a record with its header, bytes.
    pub(super) length: usize,
    pub(super) fields: Vec<Field>,
    /// Reason why its fields are unknown, if they are.
    pub(super) opaque: Option<&'static str>,
}

/// A field of a record.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) kind: Kind,
    /// Divisor that its letter implies.
    pub(super) divisor: f64,
    /// Position from the end of the header.
    pub(super) at: usize,
    /// Reason why the field is no channel, in words that follow its name.
    pub(super) why_no_channel: Option<&'static str>,
}

/// Returns how a number with this letter is stored, and its divisor.
fn of_letter(letter: u8) -> Option<(Kind, f64)> {
    Some(match letter {
        b'b' => (Kind::I8, 1.0),
        b'B' | b'M' => (Kind::U8, 1.0),
        b'h' => (Kind::I16, 1.0),
        b'H' => (Kind::U16, 1.0),
        b'i' => (Kind::I32, 1.0),
        b'I' => (Kind::U32, 1.0),
        b'q' => (Kind::I64, 1.0),
        b'Q' => (Kind::U64, 1.0),
        b'g' => (Kind::F16, 1.0),
        b'f' => (Kind::F32, 1.0),
        b'd' => (Kind::F64, 1.0),
        b'c' => (Kind::I16, 100.0),
        b'C' => (Kind::U16, 100.0),
        b'e' => (Kind::I32, 100.0),
        b'E' => (Kind::U32, 100.0),
        b'L' => (Kind::I32, 1e7),
        b'n' => (Kind::Text(4), 1.0),
        b'N' => (Kind::Text(16), 1.0),
        b'Z' => (Kind::Text(64), 1.0),
        b'a' => (Kind::Text(64), 1.0),
        _ => return None,
    })
}

impl Definition {
    /// Returns the definition of FMT records themselves.
    pub(super) fn of_definitions() -> Self {
        let letters = [b'B', b'B', b'n', b'N', b'Z'];
        let names = "Type,Length,Name,Format,Columns";
        Self::new("FMT".to_owned(), FMT_LENGTH, &letters, names)
    }

    /// Reads the body of an FMT record: the type number and its definition.
    pub(super) fn read(body: &[u8]) -> Option<(u8, Self)> {
        let (&[number, length], rest) = body.split_first_chunk()?;
        let (name, rest) = rest.split_at_checked(4)?;
        let (letters, names) = rest.split_at_checked(16)?;
        let end = letters.iter().position(|byte| *byte == 0).unwrap_or(letters.len());
        if usize::from(length) < HEADER {
            return None;
        }
        let of = Self::new(text(name), length.into(), &letters[..end], &text(names));
        Some((number, of))
    }

    fn new(name: String, length: usize, letters: &[u8], names: &str) -> Self {
        let mut at = 0;
        let mut fields = Vec::with_capacity(letters.len());
        let mut opaque = None;
        let mut names = names.split(',').map(str::trim);
        for letter in letters {
            let Some((kind, divisor)) = of_letter(*letter) else {
                opaque = Some("has fields of an unknown type");
                break;
            };
            // The names field has 64 bytes, too few for all names of some types.
            let name = names.next().unwrap_or_default().to_owned();
            let why_no_channel = match letter {
                b'a' => Some("is a list of numbers of one moment"),
                _ => matches!(kind, Kind::Text(_)).then_some("holds text"),
            };
            fields.push(Field { name, kind, divisor, at, why_no_channel });
            at += kind.size();
        }
        if opaque.is_none() && HEADER + at != length {
            opaque = Some("is of a type whose fields contradict its length");
        }
        Self { name, length, fields, opaque }
    }

    /// Returns the field of that name.
    pub(super) fn field(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|field| field.name == name)
    }
}
