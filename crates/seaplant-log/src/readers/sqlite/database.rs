//! Reads the intact tables of an SQLite database.
//!
//! Implements the file format, version 3, itself: SQLite refuses a truncated database, whose pages
//! up to the end are a usable log.

use std::io::{self, Read, Seek, SeekFrom};

use crate::content::Seekable;

/// A database file.
pub(super) struct Database {
    file: Seekable,
    page_size: usize,
    /// Usable bytes of a page.
    usable: usize,
    /// Number of pages by the header, and in the file, whose last page may be truncated.
    claimed: u64,
    pages: u64,
    length: u64,
    /// Pages already read; each belongs to one tree node.
    seen: Vec<bool>,
    pub(super) found: Found,
}

/// Damage found.
#[derive(Debug, Default)]
pub(super) struct Found {
    /// Pages with invalid content.
    pub(super) damaged: Vec<u64>,
    /// First page beyond the end of the file, if one was needed.
    pub(super) missing: Option<u64>,
}

/// A value in a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Value<'a> {
    Null,
    Integer(i64),
    Bytes(&'a [u8]),
}

impl<'a> Value<'a> {
    pub(super) fn integer(self) -> Option<i64> {
        if let Self::Integer(integer) = self { Some(integer) } else { None }
    }

    pub(super) fn bytes(self) -> Option<&'a [u8]> {
        if let Self::Bytes(bytes) = self { Some(bytes) } else { None }
    }

    pub(super) fn text(self) -> Option<String> {
        self.bytes().map(|bytes| String::from_utf8_lossy(bytes).into_owned())
    }
}

/// Consumes rows: the values, and their page. Returns whether the row is valid.
pub(super) type Take<'a> = dyn FnMut(&[Value<'_>], u64) -> bool + 'a;

/// Page types of tables.
const LEAF: u8 = 13;
const INTERIOR: u8 = 5;
/// Length of the header before the first page.
const HEADER: usize = 100;

impl Database {
    /// Opens a database by its header; `None` if that is invalid.
    ///
    /// # Errors
    /// Those of reading.
    pub(super) fn open(mut file: Seekable) -> io::Result<Option<Self>> {
        let length = file.seek(SeekFrom::End(0))?;
        let mut header = [0; HEADER];
        file.seek(SeekFrom::Start(0))?;
        if length < HEADER as u64 {
            return Ok(None);
        }
        file.read_exact(&mut header)?;
        let page_size = match u16::from_be_bytes([header[16], header[17]]) {
            1 => 65_536,
            size => usize::from(size),
        };
        let usable = page_size.saturating_sub(header[20].into());
        // 0 if no text was ever written; 2 and 3 are UTF-16.
        let utf8 = header[59] < 2 && header[56..59] == [0; 3];
        if !page_size.is_power_of_two() || usable < 480 || !utf8 {
            return Ok(None);
        }
        let claimed = u32::from_be_bytes([header[28], header[29], header[30], header[31]]).into();
        let pages = length.div_ceil(page_size as u64);
        let seen = vec![false; pages as usize];
        let found = Found::default();
        Ok(Some(Self { file, page_size, usable, claimed, pages, length, seen, found }))
    }

    /// Returns the position of a page in bytes.
    pub(super) fn byte_of(&self, page: u64) -> u64 {
        page.saturating_sub(1).saturating_mul(self.page_size as u64)
    }

    /// Returns the size of the file in bytes.
    pub(super) fn length(&self) -> u64 {
        self.length
    }

    pub(super) fn page_size(&self) -> u64 {
        self.page_size as u64
    }

    /// Passes the rows of the table whose root is `root` to `take`, in order.
    ///
    /// # Errors
    /// Those of reading.
    pub(super) fn rows(&mut self, root: u64, take: &mut Take<'_>) -> io::Result<()> {
        let mut stack = vec![(root, 1)];
        let (mut page, mut overflow) = (Vec::new(), Vec::new());
        while let Some((number, above)) = stack.pop() {
            if !self.page(number, above, &mut page)? {
                continue;
            }
            let start = if number == 1 { HEADER } else { 0 };
            let sound = match page[start] {
                LEAF => self.leaf(&page, number, &mut overflow, take)?,
                INTERIOR => children(&page, start)
                    .map(|below| stack.extend(below.into_iter().map(|page| (page, number))))
                    .is_some(),
                _ => false,
            };
            if !sound {
                self.found.damaged.push(number);
            }
        }
        Ok(())
    }

    /// Returns the leaves of the table whose root is `root`, in order; `None` where pages that lead
    /// to them are damaged or missing. Leaves are not read.
    ///
    /// # Errors
    /// Those of reading.
    pub(super) fn leaves(&mut self, root: u64) -> io::Result<Option<Vec<u64>>> {
        let (mut level, mut page) = (vec![root], Vec::new());
        // All leaves of a table have the same depth.
        loop {
            let mut below = Vec::new();
            for &number in &level {
                if !self.page(number, number, &mut page)? {
                    return Ok(None);
                }
                let start = if number == 1 { HEADER } else { 0 };
                if page[start] == LEAF {
                    self.seen[number as usize - 1] = false;
                    return Ok((number == level[0]).then_some(level));
                }
                let children = (page[start] == INTERIOR).then(|| children(&page, start));
                let Some(children) = children.flatten() else { return Ok(None) };
                below.extend(children.into_iter().rev());
            }
            level = below;
        }
    }

    /// Passes the rows of one leaf to `take` and records damage.
    ///
    /// # Errors
    /// Those of reading.
    pub(super) fn leaf_rows(&mut self, number: u64, take: &mut Take<'_>) -> io::Result<()> {
        let (mut page, mut overflow) = (Vec::new(), Vec::new());
        if self.page(number, number, &mut page)? {
            let is_leaf = page[if number == 1 { HEADER } else { 0 }] == LEAF;
            if !(is_leaf && self.leaf(&page, number, &mut overflow, take)?) {
                self.found.damaged.push(number);
            }
        }
        Ok(())
    }

    /// Passes the rows of unreferenced leaves to `take`: after damage, these are what is left of a
    /// table.
    ///
    /// # Errors
    /// Those of reading.
    pub(super) fn orphans(&mut self, take: &mut Take<'_>) -> io::Result<()> {
        let (mut page, mut overflow) = (Vec::new(), Vec::new());
        for number in 2..=self.pages {
            let seen = self.seen[number as usize - 1];
            if !seen && self.page(number, number, &mut page)? && page[0] == LEAF {
                self.leaf(&page, number, &mut overflow, take)?;
            }
        }
        Ok(())
    }

    /// Reads a page that page `above` refers to, unless it is beyond the end of the file or was
    /// already read.
    fn page(&mut self, number: u64, above: u64, page: &mut Vec<u8>) -> io::Result<bool> {
        let whole = self.length / self.page_size as u64;
        if (whole + 1..=self.claimed).contains(&number) {
            let missing = self.found.missing.get_or_insert(number);
            *missing = number.min(*missing);
            return Ok(false);
        }
        let inside = (1..=whole).contains(&number);
        if !inside || std::mem::replace(&mut self.seen[number as usize - 1], true) {
            self.found.damaged.push(above);
            return Ok(false);
        }
        page.resize(self.page_size, 0);
        self.file.seek(SeekFrom::Start(self.byte_of(number)))?;
        self.file.read_exact(page)?;
        Ok(true)
    }

    /// Passes the rows of a leaf to `take`; returns whether all are valid.
    fn leaf(
        &mut self,
        page: &[u8],
        number: u64,
        overflow: &mut Vec<u8>,
        take: &mut Take<'_>,
    ) -> io::Result<bool> {
        let start = if number == 1 { HEADER } else { 0 };
        let Some(cells) = cells(page, start, 8) else { return Ok(false) };
        let (mut sound, mut local) = (true, 0);
        for at in cells {
            let Some(cell) = self.cell(page, at) else {
                sound = false;
                continue;
            };
            // Cells do not overlap.
            local += cell.payload.len();
            if local > page.len() {
                return Ok(false);
            }
            let payload = match cell.next {
                None => cell.payload,
                Some(next) => {
                    overflow.clear();
                    overflow.extend_from_slice(cell.payload);
                    // Damage is recorded there.
                    if !self.chain(next, number, cell.size, overflow)? {
                        continue;
                    }
                    &*overflow
                }
            };
            sound &= record(payload, cell.row).is_some_and(|values| take(&values, number));
        }
        Ok(sound)
    }

    /// Appends the overflow of a row in `leaf`, which starts at page `next`; returns whether it is
    /// complete.
    fn chain(
        &mut self,
        mut next: u64,
        leaf: u64,
        size: usize,
        payload: &mut Vec<u8>,
    ) -> io::Result<bool> {
        let mut page = Vec::new();
        while payload.len() < size {
            if !self.page(next, leaf, &mut page)? {
                return Ok(false);
            }
            next = u64::from(u32::from_be_bytes([page[0], page[1], page[2], page[3]]));
            let more = (size - payload.len()).min(self.usable - 4);
            payload.extend_from_slice(&page[4..4 + more]);
        }
        Ok(true)
    }

    /// Parses the cell at `at` of a leaf.
    fn cell<'a>(&self, page: &'a [u8], at: usize) -> Option<Cell<'a>> {
        let mut bytes = page.get(at..self.usable)?;
        let size = usize::try_from(varint(&mut bytes)?).ok()?;
        let row = varint(&mut bytes)? as i64;
        if size as u64 > self.length {
            return None;
        }
        // Length of the part of a row in its own page: "Cell Payload Overflow Pages" of the file
        // format.
        let most = self.usable - 35;
        if size <= most {
            return Some(Cell { row, size, payload: bytes.get(..size)?, next: None });
        }
        let least = (self.usable - 12) * 32 / 255 - 23;
        let even = least + (size - least) % (self.usable - 4);
        let local = if even <= most { even } else { least };
        let next = bytes.get(local..local + 4)?;
        let next = u64::from(u32::from_be_bytes(next.try_into().ok()?));
        Some(Cell { row, size, payload: &bytes[..local], next: Some(next) })
    }
}

/// A row in a leaf.
struct Cell<'a> {
    row: i64,
    size: usize,
    /// The part stored in the leaf.
    payload: &'a [u8],
    /// Page of the next part.
    next: Option<u64>,
}

/// Iterates over the positions of the cells of a page with a header of `header` bytes.
fn cells(page: &[u8], start: usize, header: usize) -> Option<impl Iterator<Item = usize> + '_> {
    let count = u16::from_be_bytes([page[start + 3], page[start + 4]]);
    let pointers = page.get(start + header..)?.get(..2 * usize::from(count))?;
    Some(pointers.chunks_exact(2).map(|two| usize::from(u16::from_be_bytes([two[0], two[1]]))))
}

/// Returns the pages below an interior page, the last first.
fn children(page: &[u8], start: usize) -> Option<Vec<u64>> {
    let number = |at: usize| {
        let four: [u8; 4] = page.get(at..at + 4)?.try_into().ok()?;
        Some(u64::from(u32::from_be_bytes(four)))
    };
    let left: Option<Vec<u64>> = cells(page, start, 12)?.map(number).collect();
    let mut all = left?;
    all.push(number(start + 8)?);
    all.reverse();
    Some(all)
}

/// Decodes a number of one to nine bytes with seven bits each, eight in the ninth.
fn varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut number = 0;
    for k in 0..9 {
        let (first, rest) = bytes.split_first()?;
        *bytes = rest;
        if k == 8 {
            return Some(number << 8 | u64::from(*first));
        }
        number = number << 7 | u64::from(first & 0x7f);
        if first & 0x80 == 0 {
            break;
        }
    }
    Some(number)
}

/// Decodes the values of a row. The first absent value is replaced by the row's number, because
/// SQLite stores an integer primary key so.
fn record(payload: &[u8], row: i64) -> Option<Vec<Value<'_>>> {
    let mut kinds = payload;
    let header = usize::try_from(varint(&mut kinds)?).ok()?;
    let mut content = payload.get(header..)?;
    let mut kinds = payload.get(payload.len() - kinds.len()..header)?;
    let mut values = Vec::with_capacity(kinds.len());
    while !kinds.is_empty() {
        let kind = varint(&mut kinds)?;
        let size = match kind {
            0 | 8 | 9 => 0,
            1..=4 => kind as usize,
            5 => 6,
            6 | 7 => 8,
            10 | 11 => return None,
            _ => usize::try_from((kind - 12) / 2).ok()?,
        };
        let (bytes, rest) = content.split_at_checked(size)?;
        content = rest;
        values.push(match kind {
            0 if values.is_empty() => Value::Integer(row),
            0 | 7 => Value::Null,
            8 | 9 => Value::Integer(kind as i64 - 8),
            1..=6 => Value::Integer(signed(bytes)),
            _ => Value::Bytes(bytes),
        });
    }
    Some(values)
}

/// Decodes a big-endian integer of up to eight bytes.
fn signed(bytes: &[u8]) -> i64 {
    let first = bytes.first().map_or(0, |&first| i64::from(first as i8));
    bytes.iter().skip(1).fold(first, |number, &byte| number << 8 | i64::from(byte))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_are_as_the_file_format_says() {
        for (bytes, number) in [
            (&[0x7f][..], 0x7f),
            (&[0x81, 0x00], 0x80),
            (&[0x82, 0x2c], 300),
            (&[0xff; 9], u64::MAX),
        ] {
            assert_eq!(varint(&mut &bytes[..]), Some(number));
        }
        assert_eq!(varint(&mut &[0x81][..]), None);
        assert_eq!((signed(&[0xff, 0xfe]), signed(&[1, 0, 0]), signed(&[])), (-2, 65_536, 0));
    }

    #[test]
    fn a_row_is_its_kinds_and_then_its_content() {
        // Absent, 8 bits, the constant one, a text of two bytes, a blob of one.
        let payload = [6, 0, 1, 9, 17, 14, 0xff, b'h', b'i', 7];
        let values = record(&payload, 12).unwrap();
        let expected = [
            Value::Integer(12),
            Value::Integer(-1),
            Value::Integer(1),
            Value::Bytes(b"hi"),
            Value::Bytes(&[7]),
        ];
        assert_eq!(values, expected);
        assert_eq!(record(&payload[..9], 12), None);
    }
}
