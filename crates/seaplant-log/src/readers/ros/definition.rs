//! Message definitions of ROS 1 and ROS 2, as bags contain them: the fields of a type, then those
//! of the types that it contains, each under a line `MSG: package/Type`.

use std::collections::HashMap;

/// ROS version of a definition; the versions interpret some words differently.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Dialect {
    Ros1,
    Ros2,
}

/// A primitive number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Number {
    Bool,
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
}

impl Number {
    /// Returns the size in bytes, and the alignment in CDR.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::Bool | Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }
}

/// Type of a field or of its elements.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Kind {
    Number(Number),
    /// Seconds and nanoseconds, each signed or not.
    Time {
        signed: [bool; 2],
    },
    Text,
    WideText,
    Message(String),
}

/// Multiplicity of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Many {
    One,
    Array(u64),
    List,
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Field {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    pub(crate) many: Many,
}

/// Types by their names, `package/Type`.
#[derive(Debug, Clone, Default)]
pub(crate) struct Definitions {
    types: HashMap<String, Vec<Field>>,
}

impl Definitions {
    /// Parses the definition of `name` and of the types that it contains; `None` where a line is
    /// invalid.
    pub(crate) fn parse(name: &str, text: &str, dialect: Dialect) -> Option<Self> {
        let mut definitions = Self::default();
        let mut name = plain(name);
        let mut fields = Vec::new();
        for line in text.lines().map(str::trim) {
            if let Some(next) = line.strip_prefix("MSG:") {
                definitions.add(std::mem::replace(&mut name, plain(next)), &mut fields);
            } else if !is_rule(line) {
                let package = name.split('/').next().unwrap_or_default();
                fields.extend(field(line, package, dialect)?);
            }
        }
        definitions.add(name, &mut fields);
        Some(definitions)
    }

    fn add(&mut self, name: String, fields: &mut Vec<Field>) {
        self.types.entry(name).or_insert_with(|| std::mem::take(fields));
        fields.clear();
    }

    /// Returns the fields of a type.
    pub(crate) fn fields(&self, name: &str) -> Option<&[Field]> {
        self.types.get(name).map(Vec::as_slice)
    }
}

/// Type whose stamp is the time of a message.
pub(crate) const HEADER: &str = "std_msgs/Header";

/// Shortens `package/msg/Type` to `package/Type`.
pub(crate) fn plain(name: &str) -> String {
    let mut parts = name.trim().split('/');
    match (parts.next(), parts.next_back()) {
        (Some(package), Some(name)) => format!("{package}/{name}"),
        _ => name.trim().to_owned(),
    }
}

/// Returns whether a line separates two definitions.
fn is_rule(line: &str) -> bool {
    line.len() >= 3 && line.bytes().all(|b| b == b'=')
}

/// Parses the field in a line: `Some(None)` for a comment or a constant, `None` for an invalid
/// line.
fn field(line: &str, package: &str, dialect: Dialect) -> Option<Option<Field>> {
    if line.is_empty() || line.starts_with('#') {
        return Some(None);
    }
    let (kind, rest) = line.split_once(char::is_whitespace)?;
    let rest = rest.trim_start();
    let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len());
    let (name, rest) = rest.split_at(end);
    if name.is_empty() {
        return None;
    }
    if rest.trim_start().starts_with('=') {
        return Some(None);
    }
    let (element, many) = match kind.strip_suffix(']').and_then(|kind| kind.rsplit_once('[')) {
        None => (kind, Many::One),
        Some((element, "")) => (element, Many::List),
        Some((element, size)) if size.starts_with("<=") => (element, Many::List),
        Some((element, size)) => (element, Many::Array(size.trim().parse().ok()?)),
    };
    // A bound on the length of a string does not matter.
    let element = element.split("<=").next().unwrap_or(element);
    let kind = kind_of(element, package, dialect)?;
    Some(Some(Field { name: name.to_owned(), kind, many }))
}

fn kind_of(element: &str, package: &str, dialect: Dialect) -> Option<Kind> {
    let ros1 = dialect == Dialect::Ros1;
    let number = match element {
        "bool" | "boolean" => Number::Bool,
        "byte" if ros1 => Number::I8,
        "uint8" | "char" | "byte" | "octet" => Number::U8,
        "int8" => Number::I8,
        "uint16" => Number::U16,
        "int16" => Number::I16,
        "uint32" => Number::U32,
        "int32" => Number::I32,
        "uint64" => Number::U64,
        "int64" => Number::I64,
        "float32" | "float" => Number::F32,
        "float64" | "double" => Number::F64,
        "string" => return Some(Kind::Text),
        "wstring" => return Some(Kind::WideText),
        "time" => return Some(Kind::Time { signed: [!ros1, false] }),
        "duration" => return Some(Kind::Time { signed: [true, ros1] }),
        "" => return None,
        "Header" if ros1 => return Some(Kind::Message(HEADER.to_owned())),
        name if name.contains('/') => return Some(message(plain(name))),
        name => return Some(Kind::Message(format!("{package}/{name}"))),
    };
    Some(Kind::Number(number))
}

fn message(name: String) -> Kind {
    match name.as_str() {
        "builtin_interfaces/Time" | "builtin_interfaces/Duration" => {
            Kind::Time { signed: [true, false] }
        }
        _ => Kind::Message(name),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_constants_comments_and_nested_types_are_distinguished() {
        let text = "# a thing\nuint8 KIND=3 # three\nstring TAG= a # b\nstd_msgs/Header header\n\
                    float64[3]   a # three\nThing[<=4] things\nstring<=8[] names\nint32 n 5\n\
                    ================\nMSG: my_msgs/msg/Thing\nbyte b\ntime t\n";
        let definitions = Definitions::parse("my_msgs/msg/Main", text, Dialect::Ros2).unwrap();
        let fields = definitions.fields("my_msgs/Main").unwrap();
        let field = |name: &str, kind, many| Field { name: name.to_owned(), kind, many };
        let of = |name: &str| Kind::Message(name.to_owned());
        assert_eq!(
            fields,
            [
                field("header", of(HEADER), Many::One),
                field("a", Kind::Number(Number::F64), Many::Array(3)),
                field("things", of("my_msgs/Thing"), Many::List),
                field("names", Kind::Text, Many::List),
                field("n", Kind::Number(Number::I32), Many::One),
            ]
        );
        let thing = definitions.fields("my_msgs/Thing").unwrap();
        assert_eq!(
            thing,
            [
                field("b", Kind::Number(Number::U8), Many::One),
                field("t", Kind::Time { signed: [true, false] }, Many::One),
            ]
        );
    }

    #[test]
    fn ros_1_reads_some_words_differently() {
        let text = "Header header\nbyte b\nduration d\n===\nMSG: std_msgs/Header\nuint32 seq\n";
        let definitions = Definitions::parse("a/B", text, Dialect::Ros1).unwrap();
        let kinds: Vec<&Kind> =
            definitions.fields("a/B").unwrap().iter().map(|f| &f.kind).collect();
        assert_eq!(
            kinds,
            [
                &Kind::Message(HEADER.to_owned()),
                &Kind::Number(Number::I8),
                &Kind::Time { signed: [true, true] }
            ]
        );
    }

    #[test]
    fn an_invalid_definition_is_refused() {
        for text in ["float64", "float64[x] a", "float64 = 3", "<xml/>"] {
            assert!(Definitions::parse("a/B", text, Dialect::Ros2).is_none(), "{text}");
        }
    }
}
