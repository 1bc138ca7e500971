//! Reads ROS 1 bags, version 2.0, from front to back, indexed or not.

mod header;
mod index;

use std::collections::HashMap;
use std::io;

use self::header::{Header, op};
use self::index::Index;
use crate::content::Content;
use crate::glance::{Glance, Thoroughness};
use crate::readers::bytes::Bytes;
use crate::readers::ros::{Connection, Encoding, Packing, Recording, Window};
use crate::{Error, Log, ReadOptions};

const FORMAT: &str = "a ROS 1 bag";
const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

/// Longer headers and longer records are implausible.
const LONGEST_HEADER: u64 = 1 << 24;
const LONGEST: u64 = 1 << 30;

/// Returns whether bytes start like a ROS 1 bag.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"#ROSBAG")
}

/// Reads the index of a ROS 1 bag and some of its chunks; `None` where the index does not cover all
/// messages.
///
/// # Errors
/// As [`read`].
pub(crate) fn glance(
    content: Content,
    options: &ReadOptions,
    how: Thoroughness,
) -> Result<Option<Glance>, Error> {
    if !content.head().starts_with(MAGIC) {
        return Ok(None);
    }
    let (origin, file) = content.seekable()?;
    let read = Window::new(file).and_then(|mut window| {
        let mut reader = Reader::new(window.left(), options);
        reader.index(&mut window)?;
        let Some(choice) = reader.index.choose(how) else { return Ok(None) };
        for &place in &choice.places {
            window.go(reader.index.chunks[place].at)?;
            let Some((header, data)) = record(&mut window)? else { return Ok(None) };
            let (head, data) = parts(window.look(8 + header + data)?, header);
            if Header(head).op() != Some(op::CHUNK) || !reader.chunk(Header(head), data, true, 0) {
                return Ok(None);
            }
        }
        Ok(reader.count().then_some((reader.recording, choice)))
    });
    match read.map_err(|error| origin.failed(error))? {
        Some((recording, choice)) => {
            recording.glance(origin, options, FORMAT, "ROS 1 bag", &choice)
        }
        None => Ok(None),
    }
}

/// Reads a ROS 1 bag.
///
/// # Errors
/// [`Error::Io`], [`Error::NoSamples`]; [`Error::Unsupported`] of another version, and of a
/// packing that is not known.
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    if !content.head().starts_with(MAGIC) {
        let path = content.path().to_owned();
        let detail = "of another version than 2.0".to_owned();
        let advice = "run `rosbag migrate` on it, or copy it again if it is damaged";
        return Err(Error::Unsupported { path, format: FORMAT, detail, advice });
    }
    let (origin, file) = content.seekable()?;
    let read = Window::new(file).and_then(|mut window| {
        let mut reader = Reader::new(window.left(), options);
        reader.index(&mut window)?;
        reader.records(&mut window)?;
        Ok(reader.recording)
    });
    read.map_err(|error| origin.failed(error))?.log(origin, options, FORMAT, "ROS 1 bag")
}

struct Reader {
    recording: Recording,
    connections: HashMap<u32, Option<usize>>,
    /// An unpacked chunk.
    unpacked: Vec<u8>,
    index: Index,
}

impl Reader {
    fn new(length: u64, options: &ReadOptions) -> Self {
        Self {
            recording: Recording::new(length, options),
            connections: HashMap::new(),
            unpacked: Vec::new(),
            index: Index::default(),
        }
    }

    /// Reads the connections that the index of a complete bag repeats, so that damage to their
    /// first copies does no harm.
    fn index(&mut self, window: &mut Window) -> io::Result<()> {
        let start = MAGIC.len() as u64;
        window.go(start)?;
        let index = record(window)?.and_then(|(header, _)| {
            let header = Header(window.look(4 + header).ok()?.get(4..)?);
            let is_bag = header.op() == Some(op::BAG);
            is_bag.then(|| Some((header.number("index_pos")?, header.number("chunk_count"))))?
        });
        let end = start + window.left();
        if let Some((index, chunks)) = index.filter(|&(index, _)| index > start && index < end) {
            (self.index.at, self.index.count) = (index, chunks.unwrap_or(0));
            window.go(index)?;
            while let Some((header, data)) = record(window)? {
                let bytes = window.look(8 + header + data)?;
                let (head, data) = parts(bytes, header);
                // An invalid record here is read at its first copy.
                let _ = match Header(head).op() {
                    Some(op::CONNECTION) => self.connection(Header(head), data),
                    Some(op::CHUNK_INFO) => self.index.chunk(Header(head), data),
                    _ => break,
                };
                let length = bytes.len() as u64;
                window.skip(length)?;
            }
        }
        window.go(start)
    }

    /// Sets the number of messages by the index; returns whether the counts are possible.
    fn count(&mut self) -> bool {
        let Self { index, connections, recording, .. } = self;
        index.counts.iter().all(|(connection, count)| match connections.get(connection) {
            Some(Some(topic)) => {
                recording.holds(*topic, *count);
                true
            }
            Some(None) => true,
            None => false,
        })
    }

    /// Reads the records from front to back, skipping damage.
    fn records(&mut self, window: &mut Window) -> io::Result<()> {
        while window.left() > 0 && !self.recording.swells() {
            let byte = window.at();
            let Some((header, data)) = record(window)? else {
                if cut_chunk(window)? || !resync(window)? {
                    return self.rest(window, byte);
                }
                self.recording.damaged(byte, window.at() - byte);
                continue;
            };
            let (head, data) = parts(window.look(8 + header + data)?, header);
            if !self.record(Header(head), data, true, byte) {
                self.recording.damaged(byte, (8 + head.len() + data.len()) as u64);
            }
            let length = (8 + head.len() + data.len()) as u64;
            window.skip(length)?;
        }
        Ok(())
    }

    /// Reads the part after the last valid record: a truncated chunk may have a valid start.
    fn rest(&mut self, window: &mut Window, byte: u64) -> io::Result<()> {
        window.go(byte)?;
        let left = window.left();
        let mut bytes = Bytes(window.look(left.min(LONGEST))?);
        let mut cut = || {
            let length = bytes.u32()? as usize;
            let header = Header(bytes.take(length)?);
            bytes.u32()?;
            Some((header, bytes.0))
        };
        if let Some((header, data)) = cut().filter(|(header, _)| header.op() == Some(op::CHUNK)) {
            self.chunk(header, data, false, byte);
        }
        self.recording.truncated(byte);
        Ok(())
    }

    /// Reads a record; returns whether it is valid.
    fn record(&mut self, header: Header<'_>, data: &[u8], whole: bool, byte: u64) -> bool {
        match header.op() {
            Some(op::MESSAGE) => self.message(header, data, byte).is_some(),
            Some(op::CONNECTION) => self.connection(header, data).is_some(),
            Some(op::CHUNK) => self.chunk(header, data, whole, byte),
            op => op.is_some(),
        }
    }

    /// Reads the records of a chunk, or of the part of one before the end of the file; returns
    /// whether all are valid.
    fn chunk(&mut self, header: Header<'_>, data: &[u8], whole: bool, byte: u64) -> bool {
        let packing = match header.field("compression") {
            Some(b"none") => Packing::None,
            Some(b"lz4") => Packing::Lz4,
            Some(b"bz2") => Packing::Bzip2,
            Some(other) => {
                let name = String::from_utf8_lossy(other).into_owned();
                self.recording.unknown_packing(name, "run `rosbag decompress` on it");
                return false;
            }
            None => return false,
        };
        let mut records = std::mem::take(&mut self.unpacked);
        let unpacked = packing.unpack(data, &mut records);
        self.recording.unpacked(records.len());
        let mut bytes = Bytes(&records);
        // There is no checksum, so bytes unpacked before damage may be right; each record is
        // checked.
        let sound = loop {
            if bytes.0.is_empty() {
                break unpacked || !whole;
            }
            let mut next = || {
                let header = bytes.u32()? as usize;
                let header = Header(bytes.take(header)?);
                let data = bytes.u32()? as usize;
                Some((header, bytes.take(data)?))
            };
            let Some((header, data)) = next() else { break false };
            let nested = header.op() == Some(op::CHUNK);
            if nested || !self.record(header, data, true, byte) {
                break false;
            }
        };
        self.unpacked = records;
        sound
    }

    fn connection(&mut self, header: Header<'_>, data: &[u8]) -> Option<()> {
        let id = header.number("conn")? as u32;
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let topic = text(header.field("topic")?);
        let (kind, definition) =
            (Header(data).field("type")?, Header(data).field("message_definition")?);
        let (kind, definition) = (text(kind), Some(text(definition)));
        let connection = Connection { topic, kind, encoding: Encoding::Ros1, definition };
        let topic = self.recording.topic(&connection);
        self.connections.insert(id, topic);
        Some(())
    }

    fn message(&mut self, header: Header<'_>, data: &[u8], byte: u64) -> Option<()> {
        let connection = header.number("conn")? as u32;
        let mut time = Bytes(header.field("time")?);
        let receipt = i64::from(time.u32()?) * 1_000_000_000 + i64::from(time.u32()?);
        if let Some(topic) = *self.connections.get(&connection)? {
            self.recording.message(topic, receipt, data, byte);
        }
        Some(())
    }
}

/// Returns the lengths of header and data of the current record, if it is plausible and complete.
fn record(window: &mut Window) -> io::Result<Option<(u64, u64)>> {
    let left = window.left();
    let Some(header) = Bytes(window.look(4)?).u32().map(u64::from) else { return Ok(None) };
    // The shortest holds `op=` and a byte.
    if !(8..=LONGEST_HEADER).contains(&header) || header + 8 > left {
        return Ok(None);
    }
    let bytes = window.look(8 + header)?;
    let (head, length) = bytes.split_at(4 + header as usize);
    if Header(&head[4..]).op().is_none() {
        return Ok(None);
    }
    let Some(data) = Bytes(length).u32().map(u64::from) else { return Ok(None) };
    Ok((data <= LONGEST && 8 + header + data <= left).then_some((header, data)))
}

/// Returns whether the current record is a chunk whose lengths are consistent but exceed the file.
fn cut_chunk(window: &mut Window) -> io::Result<bool> {
    /// An incompressible chunk is at most this much longer than its content.
    const SPARE: u64 = 1 << 16;
    let Some(header) = Bytes(window.look(4)?).u32().map(u64::from) else { return Ok(false) };
    if header > LONGEST_HEADER {
        return Ok(false);
    }
    let mut bytes = Bytes(window.look(8 + header)?);
    let mut fits = || {
        bytes.take(4)?;
        let header = Header(bytes.take(header as usize)?);
        let (size, length) = (header.number("size")?, u64::from(bytes.u32()?));
        let plain = header.field("compression")? == b"none";
        let fits = if plain { length == size } else { length <= size + size / 16 + SPARE };
        Some(header.op()? == op::CHUNK && length <= LONGEST && fits)
    };
    Ok(fits() == Some(true))
}

/// Splits a record into header and data, given the length of the header.
fn parts(record: &[u8], header: u64) -> (&[u8], &[u8]) {
    let (head, data) = record.split_at(4 + header as usize);
    (&head[4..], &data[4..])
}

/// Moves past the damage to the next plausible record; returns whether there is one.
fn resync(window: &mut Window) -> io::Result<bool> {
    window.skip(1)?;
    while window.left() > 0 {
        // The first two bytes of a header's length are arbitrary, the others almost always zero.
        let ahead = window.look(4096)?;
        let zeros = ahead.windows(4).position(|four| four[2..] == [0, 0] && four[..2] != [0, 0]);
        match zeros {
            Some(0) => {
                if record(window)?.is_some() {
                    return Ok(true);
                }
                window.skip(1)?;
            }
            Some(step) => window.skip(step as u64)?,
            None => {
                let step = ahead.len().saturating_sub(3).max(1) as u64;
                window.skip(step)?;
            }
        }
    }
    Ok(false)
}
