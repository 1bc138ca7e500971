//! What a type of message is, as its FMT record says.

use crate::readers::number::{Kind, text};

/// Marks and the number of the type.
pub(super) const HEADER: usize = 3;

/// The type that defines types.
pub(super) const FMT: u8 = 128;
pub(super) const FMT_LENGTH: usize = HEADER + 1 + 1 + 4 + 16 + 64;

/// A type of message.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Definition {
    pub(super) name: String,
    /// Bytes of a record, its header too.
    pub(super) length: usize,
    pub(super) fields: Vec<Field>,
    /// Why its fields cannot be told, if they cannot.
    pub(super) opaque: Option<&'static str>,
}

/// A field of a record.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) kind: Kind,
    /// What its letter says to divide it by.
    pub(super) divisor: f64,
    /// Where it starts, from the end of the header.
    pub(super) at: usize,
    /// In words that follow its name, of one that is no number.
    pub(super) why_no_channel: Option<&'static str>,
}

/// A letter's meaning: how the number is stored, and what it is divided by.
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
    /// The one that FMT has of itself.
    pub(super) fn of_definitions() -> Self {
        let letters = [b'B', b'B', b'n', b'N', b'Z'];
        let names = "Type,Length,Name,Format,Columns";
        Self::new("FMT".to_owned(), FMT_LENGTH, &letters, names)
    }

    /// Reads the body of a FMT record: the type's number, and what it is.
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
            // The names have 64 bytes, which not all fit in.
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

    /// The field of that name.
    pub(super) fn field(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|field| field.name == name)
    }
}
