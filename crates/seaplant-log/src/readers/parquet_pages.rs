//! Checks the headers of a Parquet file's pages before the library reads them, which would
//! otherwise trust claims of lists of billions or pages of gigabytes.

use parquet::file::metadata::{ColumnChunkMetaData, ParquetMetaData};
use parquet::file::reader::ChunkReader;

use crate::unpack::limit;

/// Returns the number of leading row groups whose headers are plausible. `size` is that of the
/// file.
pub(crate) fn sound_groups(
    chunks: &impl ChunkReader,
    metadata: &ParquetMetaData,
    size: u64,
) -> usize {
    let mut left = limit(size);
    let mut is_sound = |column: &ColumnChunkMetaData| check(chunks, column, size, &mut left);
    let groups = metadata.row_groups().iter();
    groups.take_while(|group| group.columns().iter().all(|c| is_sound(c).is_some())).count()
}

/// Checks the pages of a column; `None` if a header is implausible, or all pages together unpack to
/// more than `left`.
fn check(
    chunks: &impl ChunkReader,
    column: &ColumnChunkMetaData,
    size: u64,
    left: &mut u64,
) -> Option<()> {
    let first = column.dictionary_page_offset().unwrap_or_else(|| column.data_page_offset());
    let mut at = u64::try_from(first).ok()?;
    let end = at.checked_add(u64::try_from(column.compressed_size()).ok()?)?;
    if end > size {
        return None;
    }
    while at < end {
        let header = header(chunks, at, end)?;
        *left = left.checked_sub(header.unpacked)?;
        at = at.checked_add(header.length)?.checked_add(header.packed)?;
    }
    Some(())
}

/// Relevant content of a page header.
#[derive(Debug, PartialEq)]
struct Header {
    /// Length of the header itself, bytes.
    length: u64,
    /// Length of the packed page after it, bytes.
    packed: u64,
    /// Length of the unpacked page, bytes.
    unpacked: u64,
}

/// Reads the header at `at`. Most headers are short; those with long statistics are read again.
fn header(chunks: &impl ChunkReader, at: u64, end: u64) -> Option<Header> {
    [256, 1 << 20].iter().find_map(|&most: &u64| {
        let bytes = chunks.get_bytes(at, usize::try_from(most.min(end - at)).ok()?).ok()?;
        Compact { bytes: &bytes }.page_header()
    })
}

/// A decoder of Thrift's compact protocol, as far as page headers need it.
///
/// # Source
/// Apache Thrift, `doc/specs/thrift-compact-protocol.md`; Apache Parquet format, `parquet.thrift`,
/// `PageHeader`.
struct Compact<'a> {
    bytes: &'a [u8],
}

impl Compact<'_> {
    fn page_header(mut self) -> Option<Header> {
        const UNPACKED: i64 = 2;
        const PACKED: i64 = 3;
        let all = self.bytes.len();
        let (mut packed, mut unpacked) = (None, None);
        let mut id = 0;
        while let Some(kind) = self.field(&mut id)? {
            match (id, kind) {
                (UNPACKED, Kind::INTEGER) => unpacked = u64::try_from(self.integer()?).ok(),
                (PACKED, Kind::INTEGER) => packed = u64::try_from(self.integer()?).ok(),
                _ => self.skip(kind, 0)?,
            }
        }
        let length = (all - self.bytes.len()) as u64;
        Some(Header { length, packed: packed?, unpacked: unpacked? })
    }

    /// Reads the type of the next field of a struct and stores its number in `id`; `Some(None)` at
    /// the end of the struct.
    fn field(&mut self, id: &mut i64) -> Option<Option<u8>> {
        let byte = self.byte()?;
        if byte == 0 {
            return Some(None);
        }
        *id = match i64::from(byte >> 4) {
            0 => self.integer()?,
            step => id.checked_add(step)?,
        };
        Some(Some(byte & 0x0f))
    }

    /// Skips a value. Lists are not supported, because no header has any.
    fn skip(&mut self, kind: u8, depth: u8) -> Option<()> {
        /// Nesting limit: a header holds a header of a kind of page, which holds statistics.
        const DEEP: u8 = 8;
        match kind {
            Kind::TRUE | Kind::FALSE => {}
            Kind::BYTE => drop(self.byte()?),
            Kind::SHORT | Kind::INTEGER | Kind::LONG => drop(self.varint()?),
            Kind::DOUBLE => self.pass(8)?,
            Kind::BINARY => {
                let length = self.varint()?;
                self.pass(usize::try_from(length).ok()?)?;
            }
            Kind::STRUCT if depth < DEEP => {
                let mut id = 0;
                while let Some(kind) = self.field(&mut id)? {
                    self.skip(kind, depth + 1)?;
                }
            }
            _ => return None,
        }
        Some(())
    }

    fn byte(&mut self) -> Option<u8> {
        let (&byte, rest) = self.bytes.split_first()?;
        self.bytes = rest;
        Some(byte)
    }

    fn pass(&mut self, bytes: usize) -> Option<()> {
        self.bytes = self.bytes.get(bytes..)?;
        Some(())
    }

    /// Reads seven bits per byte; the last byte has the eighth bit clear.
    fn varint(&mut self) -> Option<u64> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(number);
            }
        }
        None
    }

    /// Reads a zigzag integer: odd codes are negative.
    fn integer(&mut self) -> Option<i64> {
        let number = self.varint()?;
        Some((number >> 1) as i64 ^ -((number & 1) as i64))
    }
}

/// Field types.
struct Kind;

impl Kind {
    const TRUE: u8 = 1;
    const FALSE: u8 = 2;
    const BYTE: u8 = 3;
    const SHORT: u8 = 4;
    const INTEGER: u8 = 5;
    const LONG: u8 = 6;
    const DOUBLE: u8 = 7;
    const BINARY: u8 = 8;
    const STRUCT: u8 = 12;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(bytes: &[u8]) -> Option<Header> {
        Compact { bytes }.page_header()
    }

    #[test]
    fn a_header_tells_its_sizes() {
        // Type 0; unpacked 300 and packed 20, doubled by zigzag; a struct of one field.
        let bytes = [0x15, 0x00, 0x15, 0xd8, 0x04, 0x15, 0x28, 0x2c, 0x15, 0x02, 0x00, 0x00, 0xff];
        assert_eq!(header(&bytes), Some(Header { length: 12, packed: 20, unpacked: 300 }));
        for cut in 0..12 {
            assert_eq!(header(&bytes[..cut]), None, "{cut}");
        }
    }

    #[test]
    fn negative_sizes_and_lists_are_not_believed() {
        assert_eq!(header(&[0x15, 0x00, 0x15, 0x01, 0x15, 0x28, 0x00]), None);
        assert_eq!(header(&[0x25, 0x02, 0x15, 0x02, 0x19, 0xf7, 0xff, 0xff, 0x7f, 0x00]), None);
    }
}
