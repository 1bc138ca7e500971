//! Decodes a message's bytes along its layout.

use std::ops::Range;

use super::definition::{Dialect, Number};
use super::layout::{Layout, List, MOST_ELEMENTS, Step};
use crate::quaternion::angles;

/// Serialisation of messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Encoding {
    /// Fields in sequence, little endian.
    Ros1,
    /// OMG's Common Data Representation: a header with the byte order, numbers aligned to their
    /// size.
    Cdr,
}

impl Encoding {
    pub(crate) fn dialect(self) -> Dialect {
        match self {
            Self::Ros1 => Dialect::Ros1,
            Self::Cdr => Dialect::Ros2,
        }
    }
}

/// Knowledge of a list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Known {
    /// It was empty so far.
    Nothing,
    /// Its elements have columns, from this one on.
    Columns { start: usize, count: usize },
    /// It makes no columns.
    LeftOut(&'static str),
}

/// Numbers of one message.
#[derive(Debug)]
pub(crate) struct Row {
    /// Values, one for each column.
    pub(crate) values: Vec<f64>,
    /// Time in its header, s and ns.
    pub(crate) stamp: Option<[i64; 2]>,
    pub(crate) lists: Vec<Known>,
    /// Lists of the known length, whose columns have values.
    pub(crate) filled: Vec<usize>,
    /// Lists of another length than the known one, with that length.
    pub(crate) news: Vec<(usize, u64)>,
    /// Position in the message of the names of elements.
    pub(crate) names: Option<(usize, usize)>,
    /// Bytes per character of a wide text, on which writers of ROS 2 disagree.
    wide: usize,
}

impl Row {
    pub(crate) fn new(layout: &Layout) -> Self {
        Self {
            values: vec![f64::NAN; layout.leaves.len()],
            stamp: None,
            lists: vec![Known::Nothing; layout.lists.len()],
            filled: Vec::new(),
            news: Vec::new(),
            names: None,
            wide: 2,
        }
    }

    /// Reads a message; `None` if its bytes contradict the layout.
    pub(crate) fn read(&mut self, layout: &Layout, encoding: Encoding, bytes: &[u8]) -> Option<()> {
        if self.walk(layout, encoding, bytes).is_none() {
            if !layout.steps.contains(&Step::WideText) {
                return None;
            }
            self.wide = 6 - self.wide;
            self.walk(layout, encoding, bytes)?;
        }
        for quaternion in &layout.quaternions {
            let numbers = [0, 1, 2, 3].map(|k| self.values[quaternion.from + k]);
            self.values[quaternion.to..quaternion.to + 3].copy_from_slice(&angles(numbers));
        }
        Some(())
    }

    fn walk(&mut self, layout: &Layout, encoding: Encoding, bytes: &[u8]) -> Option<()> {
        self.filled.clear();
        self.news.clear();
        (self.stamp, self.names) = (None, None);
        let mut cursor = Cursor::new(encoding, bytes)?;
        self.steps(layout, &layout.steps, Some(0), &mut cursor)?;
        cursor.is_done().then_some(())
    }

    /// Executes steps; without a base column, they only skip bytes.
    fn steps(
        &mut self,
        layout: &Layout,
        mut steps: &[Step],
        base: Option<usize>,
        cursor: &mut Cursor<'_>,
    ) -> Option<()> {
        while let Some((step, rest)) = steps.split_first() {
            steps = rest;
            match *step {
                Step::Number { number, column } => {
                    self.set(base, column, cursor.number(number)?);
                }
                Step::Numbers { number, count, column } => {
                    for k in 0..count {
                        self.set(base, column + k, cursor.number(number)?);
                    }
                }
                Step::Time { signed, column } => {
                    let [s, ns] = cursor.time(signed)?;
                    self.set(base, column, s as f64 + 1e-9 * ns as f64);
                }
                Step::Stamp { signed } => self.stamp = Some(cursor.time(signed)?),
                Step::Skip { size, count } => cursor.skip(size, count)?,
                Step::SkipList { size } => {
                    let count = cursor.count()?;
                    cursor.skip(size, count)?;
                }
                Step::Text => cursor.text()?,
                Step::WideText => cursor.wide_text(self.wide)?,
                Step::Repeat { count, steps: within } => {
                    let (within, after) = rest.split_at(within);
                    let count = count.map_or_else(|| cursor.count(), Some)?;
                    // For elements without bytes, the length of a list is meaningless.
                    let times = if within.is_empty() { 0 } else { count };
                    for _ in 0..times {
                        self.steps(layout, within, None, cursor)?;
                    }
                    steps = after;
                }
                Step::List { list, steps: within } => {
                    let (within, after) = rest.split_at(within);
                    self.list(layout, list, within, base, cursor)?;
                    steps = after;
                }
                Step::Names => {
                    let from = cursor.at;
                    for _ in 0..cursor.count()? {
                        cursor.text()?;
                    }
                    self.names = Some((from, cursor.at));
                }
            }
        }
        Some(())
    }

    fn list(
        &mut self,
        layout: &Layout,
        index: usize,
        within: &[Step],
        base: Option<usize>,
        cursor: &mut Cursor<'_>,
    ) -> Option<()> {
        let List { leaves, size, .. } = &layout.lists[index];
        let count = cursor.count()?;
        let start = match (base, self.lists[index]) {
            (Some(_), Known::Columns { start, count: known }) if known as u64 == count => {
                self.filled.push(index);
                Some(start)
            }
            (Some(_), Known::Columns { .. } | Known::Nothing) if count > 0 => {
                self.news.push((index, count));
                None
            }
            _ => None,
        };
        match (start, size) {
            (Some(start), _) => (0..count as usize).try_for_each(|k| {
                self.steps(layout, within, Some(start + k * leaves.len()), cursor)
            }),
            (None, Some(size)) => cursor.skip(*size, count),
            (None, None) => (0..count).try_for_each(|_| self.steps(layout, within, None, cursor)),
        }
    }

    #[inline]
    fn set(&mut self, base: Option<usize>, column: usize, value: f64) {
        if let Some(value_here) = base.and_then(|base| self.values.get_mut(base + column)) {
            *value_here = value;
        }
    }

    /// Returns the columns of a list.
    pub(crate) fn columns(&self, layout: &Layout, list: usize) -> Range<usize> {
        match self.lists[list] {
            Known::Columns { start, count } => {
                start..start + count * layout.lists[list].leaves.len()
            }
            _ => 0..0,
        }
    }

    /// Records the actual lengths of lists; returns whether the message must be read again.
    pub(crate) fn learn(&mut self, layout: &Layout) -> bool {
        let mut again = false;
        for (index, count) in std::mem::take(&mut self.news) {
            let known = &mut self.lists[index];
            *known = match known {
                _ if count > MOST_ELEMENTS => Known::LeftOut(super::layout::TOO_LONG),
                Known::Nothing => {
                    let (start, count) = (self.values.len(), count as usize);
                    let columns = count * layout.lists[index].leaves.len();
                    self.values.resize(start + columns, f64::NAN);
                    again = true;
                    Known::Columns { start, count }
                }
                _ => Known::LeftOut(super::layout::VARYING),
            };
        }
        again
    }
}

/// Returns the texts of a list, from its count on; invalid UTF-8 is replaced.
pub(crate) fn texts(encoding: Encoding, bytes: &[u8], from: usize) -> Option<Vec<String>> {
    let mut cursor = Cursor::new(encoding, bytes)?;
    cursor.at = from;
    let mut texts = Vec::new();
    for _ in 0..cursor.count()? {
        let count = cursor.count()? as usize;
        let text = cursor.bytes.get(cursor.at..cursor.at + count)?;
        cursor.at += count;
        let text = text.strip_suffix(b"\0").unwrap_or(text);
        texts.push(String::from_utf8_lossy(text).into_owned());
    }
    Some(texts)
}

/// A position in a message.
struct Cursor<'a> {
    /// Bytes after the header, from which CDR counts alignment.
    bytes: &'a [u8],
    at: usize,
    big_endian: bool,
    /// Maximum alignment of numbers.
    align: usize,
    /// Number of bytes that may follow the last field.
    padding: usize,
}

impl<'a> Cursor<'a> {
    fn new(encoding: Encoding, bytes: &'a [u8]) -> Option<Self> {
        if encoding == Encoding::Ros1 {
            return Some(Self { bytes, at: 0, big_endian: false, align: 1, padding: 0 });
        }
        let (header, bytes) = bytes.split_at_checked(4)?;
        // The second version of CDR aligns numbers to four bytes at most.
        let (big_endian, align) = match header[..2] {
            [0, 0] => (true, 8),
            [0, 1] => (false, 8),
            [0, 6] => (true, 4),
            [0, 7] => (false, 4),
            _ => return None,
        };
        Some(Self { bytes, at: 0, big_endian, align, padding: 3 })
    }

    fn is_done(&self) -> bool {
        self.bytes.len() - self.at <= self.padding
    }

    #[inline]
    fn seek(&mut self, size: usize) {
        let multiple = size.min(self.align);
        self.at = self.at.next_multiple_of(multiple);
    }

    #[inline]
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.seek(N);
        let bytes: [u8; N] = self.bytes.get(self.at..self.at + N)?.try_into().ok()?;
        self.at += N;
        Some(bytes)
    }

    #[inline]
    fn number(&mut self, number: Number) -> Option<f64> {
        macro_rules! take {
            ($number:ty) => {{
                let bytes = self.take()?;
                let big = self.big_endian;
                (if big {
                    <$number>::from_be_bytes(bytes)
                } else {
                    <$number>::from_le_bytes(bytes)
                }) as f64
            }};
        }
        Some(match number {
            Number::Bool => f64::from(u8::from(self.take::<1>()?[0] != 0)),
            Number::U8 => take!(u8),
            Number::I8 => take!(i8),
            Number::U16 => take!(u16),
            Number::I16 => take!(i16),
            Number::U32 => take!(u32),
            Number::I32 => take!(i32),
            Number::U64 => take!(u64),
            Number::I64 => take!(i64),
            Number::F32 => take!(f32),
            Number::F64 => take!(f64),
        })
    }

    fn count(&mut self) -> Option<u64> {
        let bytes = self.take()?;
        let count =
            if self.big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) };
        Some(count.into())
    }

    fn time(&mut self, signed: [bool; 2]) -> Option<[i64; 2]> {
        let mut one = |signed: bool| {
            let count = self.count()? as u32;
            Some(if signed { i64::from(count as i32) } else { i64::from(count) })
        };
        Some([one(signed[0])?, one(signed[1])?])
    }

    fn skip(&mut self, size: usize, count: u64) -> Option<()> {
        if count > 0 {
            self.seek(size);
        }
        let bytes = usize::try_from(count).ok()?.checked_mul(size)?;
        self.at = self.at.checked_add(bytes).filter(|&at| at <= self.bytes.len())?;
        Some(())
    }

    fn text(&mut self) -> Option<()> {
        let count = self.count()?;
        self.skip(1, count)
    }

    fn wide_text(&mut self, size: usize) -> Option<()> {
        let count = self.count()?;
        self.skip(size, count)
    }
}
