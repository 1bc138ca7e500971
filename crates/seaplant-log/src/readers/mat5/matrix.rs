//! Reads one variable: numbers, or a struct of others.

use crate::readers::workspace::{
    CELLS, COMPLEX, DEEP, DEEPEST, EMPTY, FUNCTION, OBJECT, SPARSE, STRUCTS, TEXT, Workspace,
};

/// Element types.
pub(super) const MATRIX: u32 = 14;
pub(super) const COMPRESSED: u32 = 15;

/// Byte order of numbers.
#[derive(Clone, Copy)]
pub(super) enum ByteOrder {
    Little,
    Big,
}

impl ByteOrder {
    /// Decodes the type of an element and its length in bytes.
    pub(super) fn tag(self, tag: [u8; 8]) -> (u32, u32) {
        let [a, b, c, d, e, f, g, h] = tag;
        (self.u32([a, b, c, d]), self.u32([e, f, g, h]))
    }

    fn u32(self, bytes: [u8; 4]) -> u32 {
        match self {
            Self::Little => u32::from_le_bytes(bytes),
            Self::Big => u32::from_be_bytes(bytes),
        }
    }
}

/// Returns the variable in a compressed element; `None` if it is damaged.
pub(super) fn compressed(bytes: &[u8], order: ByteOrder, workspace: &mut Workspace) -> Option<()> {
    match (Elements { bytes, order }).next()? {
        (MATRIX, bytes) => variable(bytes, order, workspace),
        _ => None,
    }
}

/// Returns a variable; `None` if it is damaged.
pub(super) fn variable(bytes: &[u8], order: ByteOrder, workspace: &mut Workspace) -> Option<()> {
    matrix(Elements { bytes, order }, None, 0, workspace)
}

/// Elements within another, from front to back.
struct Elements<'a> {
    bytes: &'a [u8],
    order: ByteOrder,
}

impl<'a> Elements<'a> {
    /// Returns the type and bytes of the next element.
    fn next(&mut self) -> Option<(u32, &'a [u8])> {
        let (tag, body) = self.bytes.split_first_chunk::<8>()?;
        let (kind, length) = self.order.tag(*tag);
        if let length @ 1.. = kind >> 16 {
            // Up to four bytes are stored in the tag itself.
            self.bytes = body;
            return Some((kind & 0xffff, tag[4..].get(..length as usize)?));
        }
        let length = length as usize;
        let element = body.get(..length)?;
        self.bytes = body.get(length.next_multiple_of(8)..).unwrap_or_default();
        Some((kind, element))
    }

    /// Reads the next element as numbers.
    fn numbers(&mut self) -> Option<Vec<f64>> {
        let (kind, bytes) = self.next()?;
        numbers(kind, bytes, self.order)
    }

    /// Reads the next element as text.
    fn text(&mut self) -> Option<String> {
        let (_, bytes) = self.next()?;
        Some(String::from_utf8_lossy(bytes).into_owned())
    }
}

/// Decodes numbers by their storage type, whatever their MATLAB class.
fn numbers(kind: u32, bytes: &[u8], order: ByteOrder) -> Option<Vec<f64>> {
    fn all<const N: usize>(
        bytes: &[u8],
        order: ByteOrder,
        number: impl Fn([u8; N]) -> f64,
    ) -> Option<Vec<f64>> {
        let (all, []) = bytes.as_chunks::<N>() else { return None };
        let number = |bytes: &[u8; N]| {
            let mut bytes = *bytes;
            if matches!(order, ByteOrder::Big) {
                bytes.reverse();
            }
            number(bytes)
        };
        Some(all.iter().map(number).collect())
    }
    match kind {
        1 => all(bytes, order, |b| f64::from(i8::from_le_bytes(b))),
        2 => all(bytes, order, |b| f64::from(u8::from_le_bytes(b))),
        3 => all(bytes, order, |b| f64::from(i16::from_le_bytes(b))),
        4 => all(bytes, order, |b| f64::from(u16::from_le_bytes(b))),
        5 => all(bytes, order, |b| f64::from(i32::from_le_bytes(b))),
        6 => all(bytes, order, |b| f64::from(u32::from_le_bytes(b))),
        7 => all(bytes, order, |b| f64::from(f32::from_le_bytes(b))),
        9 => all(bytes, order, f64::from_le_bytes),
        12 => all(bytes, order, |b| i64::from_le_bytes(b) as f64),
        13 => all(bytes, order, |b| u64::from_le_bytes(b) as f64),
        _ => None,
    }
}

/// Reads a variable, or the field `named` of one.
fn matrix(
    mut elements: Elements<'_>,
    named: Option<String>,
    depth: usize,
    workspace: &mut Workspace,
) -> Option<()> {
    const OPAQUE: u32 = 17;
    const COMPLEX_FLAG: u32 = 0x0800;
    let (_, flags) = elements.next()?;
    let flags = elements.order.u32(*flags.first_chunk()?);
    let class = flags & 0xff;
    if class == OPAQUE {
        let name = elements.text()?;
        workspace.leave_out(named.unwrap_or(name), OBJECT);
        return Some(());
    }
    let dimensions: Vec<usize> = elements.numbers()?.into_iter().map(|n| n as usize).collect();
    let count = dimensions.iter().try_fold(1, |product: usize, &n| product.checked_mul(n))?;
    let name = elements.text()?;
    let name = named.unwrap_or(name);
    if name.is_empty() {
        // Internals of objects; they are left out by their names.
        return Some(());
    }
    let why = match class {
        1 => CELLS,
        2 if count == 1 => return fields(elements, &name, depth, workspace),
        2 => STRUCTS,
        3 => OBJECT,
        4 => TEXT,
        5 => SPARSE,
        6..=15 if flags & COMPLEX_FLAG != 0 => COMPLEX,
        6..=15 => {
            let values = elements.numbers()?;
            if values.len() != count {
                return None;
            }
            workspace.add(name, None, &dimensions, values);
            return Some(());
        }
        16 => FUNCTION,
        _ => return None,
    };
    workspace.leave_out(name, why);
    Some(())
}

/// Reads the fields of a struct.
fn fields(
    mut elements: Elements<'_>,
    name: &str,
    depth: usize,
    workspace: &mut Workspace,
) -> Option<()> {
    let length = elements.numbers()?.first().copied()? as usize;
    let (_, names) = elements.next()?;
    if length == 0 {
        return names.is_empty().then_some(());
    }
    for field in names.chunks_exact(length) {
        let field = field.split(|&byte| byte == 0).next().unwrap_or_default();
        let full = format!("{name}.{}", String::from_utf8_lossy(field));
        let (kind, bytes) = elements.next()?;
        match bytes {
            _ if kind != MATRIX => return None,
            [] => workspace.leave_out(full, EMPTY),
            _ if depth == DEEPEST => workspace.leave_out(full, DEEP),
            _ => {
                let elements = Elements { bytes, order: elements.order };
                matrix(elements, Some(full), depth + 1, workspace)?;
            }
        }
    }
    Some(())
}
