//! MCAP files: ROS 2 bags, and other recordings of ROS messages.
//!
//! The format is specified at mcap.dev: a record has a type byte, a length and its content; chunks
//! hold records, compressed.

mod index;
mod record;
mod resync;

use std::collections::HashMap;
use std::io;

use self::index::Index;
use self::record::{LONGEST, RECORD, op};
use self::resync::{chunk_is_plausible, head, is_plausible, resync};
use crate::content::Content;
use crate::glance::{Glance, Thoroughness};
use crate::readers::bytes::Bytes;
use crate::readers::ros::{Connection, Encoding, Packing, Recording, Window};
use crate::{Error, Log, ReadOptions};

const FORMAT: &str = "an MCAP file";
const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Returns whether bytes start like an MCAP file.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"\x89MCAP")
}

/// Reads the summary of an MCAP file and some of its chunks; `None` where the summary does not
/// cover all messages.
///
/// # Errors
/// As [`read`].
pub(crate) fn glance(
    content: Content,
    options: &ReadOptions,
    how: Thoroughness,
) -> Result<Option<Glance>, Error> {
    let (origin, file) = content.seekable()?;
    let read = Window::new(file).and_then(|mut window| {
        let length = window.left();
        let mut reader = Reader::new(length, options);
        reader.summary(&mut window)?;
        let Some(choice) = reader.index.choose(length, how) else { return Ok(None) };
        for &place in &choice.places {
            window.go(reader.index.chunks[place].at)?;
            let Some((op::CHUNK, length)) = head(&mut window)? else { return Ok(None) };
            if length > window.left() - RECORD || !chunk_is_plausible(&mut window)? {
                return Ok(None);
            }
            let chunk = &window.look(RECORD + length)?[RECORD as usize..];
            reader.chunk(chunk, true, 0);
        }
        Ok(reader.count().then_some((reader.recording, choice)))
    });
    match read.map_err(|error| origin.failed(error))? {
        Some((recording, choice)) => recording.glance(origin, options, FORMAT, "MCAP", &choice),
        None => Ok(None),
    }
}

/// Reads an MCAP file.
///
/// # Errors
/// [`Error::Io`], [`Error::NoSamples`]; [`Error::Unsupported`] of another version, and of a
/// packing that is not known.
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    if !content.head().starts_with(MAGIC) {
        let (path, detail) = (content.path().to_owned(), "of an unknown version".to_owned());
        let advice = "convert it with the `mcap` command, or copy it again if it is damaged";
        return Err(Error::Unsupported { path, format: FORMAT, detail, advice });
    }
    let (origin, file) = content.seekable()?;
    let read = Window::new(file).and_then(|mut window| {
        let mut reader = Reader::new(window.left(), options);
        reader.summary(&mut window)?;
        reader.records(&mut window)?;
        Ok(reader.recording)
    });
    read.map_err(|error| origin.failed(error))?.log(origin, options, FORMAT, "MCAP")
}

/// State read from the records so far.
struct Reader {
    recording: Recording,
    schemas: HashMap<u16, Schema>,
    channels: HashMap<u16, Option<usize>>,
    /// An unpacked chunk.
    unpacked: Vec<u8>,
    index: Index,
}

struct Schema {
    name: String,
    encoding: String,
    definition: String,
}

impl Reader {
    fn new(length: u64, options: &ReadOptions) -> Self {
        Self {
            recording: Recording::new(length, options),
            schemas: HashMap::new(),
            channels: HashMap::new(),
            unpacked: Vec::new(),
            index: Index::default(),
        }
    }

    /// Reads the schemas and channels that the summary of a complete file repeats, so that damage
    /// to their first copies does no harm.
    fn summary(&mut self, window: &mut Window) -> io::Result<()> {
        const FOOTER: u64 = RECORD + 20;
        let Some(footer) = window.left().checked_sub(FOOTER + MAGIC.len() as u64) else {
            return Ok(());
        };
        window.go(footer)?;
        let bytes = window.look(FOOTER + MAGIC.len() as u64)?;
        let sound = bytes[0] == op::FOOTER && bytes.ends_with(MAGIC);
        let start = Bytes(&bytes[RECORD as usize..]).u64().filter(|&start| sound && start > 0);
        if let Some(start) = start.filter(|&start| start < footer) {
            window.go(start)?;
            while window.at() < footer {
                let Some((kind, length)) = head(window)? else { break };
                if length > window.left() {
                    break;
                }
                let record = &window.look(RECORD + length)?[RECORD as usize..];
                // An invalid record here is read at its first copy.
                let _ = match kind {
                    op::SCHEMA | op::CHANNEL => self.declare(kind, record),
                    op::CHUNK_INDEX => self.index.chunk(record),
                    op::STATISTICS => self.index.count(record),
                    _ => None,
                };
                window.skip(RECORD + length)?;
            }
        }
        window.go(MAGIC.len() as u64)
    }

    /// Sets the number of messages by the summary; returns whether the counts are possible.
    fn count(&mut self) -> bool {
        let Self { index, channels, recording, .. } = self;
        index.counts.iter().all(|(channel, count)| match channels.get(channel) {
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
        while !self.recording.swells() {
            let byte = window.at();
            let Some((kind, length)) = head(window)? else {
                self.recording.truncated(byte);
                return Ok(());
            };
            if matches!(kind, op::DATA_END | op::FOOTER) {
                return Ok(());
            }
            if !is_plausible(window)? {
                let cut = kind == op::CHUNK && chunk_is_plausible(window)?;
                if cut || !resync(window)? {
                    return self.rest(window, byte);
                }
                self.recording.damaged(byte, window.at() - byte);
                continue;
            }
            match kind {
                op::CHUNK => {
                    let chunk = &window.look(RECORD + length)?[RECORD as usize..];
                    self.chunk(chunk, true, byte);
                }
                op::SCHEMA | op::CHANNEL | op::MESSAGE => {
                    let record = &window.look(RECORD + length)?[RECORD as usize..];
                    if !self.record(kind, record, byte) {
                        self.recording.damaged(byte, RECORD + length);
                    }
                }
                _ => {}
            }
            window.skip(RECORD + length)?;
        }
        Ok(())
    }

    /// Reads the part after the last valid record: a truncated chunk may have a valid start.
    fn rest(&mut self, window: &mut Window, byte: u64) -> io::Result<()> {
        window.go(byte)?;
        let left = window.left();
        if window.look(1)?[0] == op::CHUNK && chunk_is_plausible(window)? {
            let chunk = &window.look(left.min(LONGEST))?[RECORD as usize..];
            self.chunk(chunk, false, byte);
        }
        self.recording.truncated(byte);
        Ok(())
    }

    /// Reads the records of a chunk, or of the part of one before the end of the file.
    fn chunk(&mut self, chunk: &[u8], whole: bool, byte: u64) {
        const ADVICE: &str = "convert it: `mcap convert` or `mcap compress` write zstd";
        let mut bytes = Bytes(chunk);
        let mut parts = || {
            bytes.take(16)?;
            Some((bytes.u64()?, bytes.u32()?, bytes.text()?, bytes.u64()?))
        };
        let Some((size, crc, packing, _)) = parts() else {
            return self.recording.damaged(byte, chunk.len() as u64);
        };
        let packing = match packing.as_str() {
            "" => Packing::None,
            "lz4" => Packing::Lz4,
            "zstd" => Packing::Zstd,
            _ => {
                self.recording.unknown_packing(packing, ADVICE);
                return self.recording.damaged(byte, chunk.len() as u64);
            }
        };
        let mut records = std::mem::take(&mut self.unpacked);
        let unpacked = packing.unpack(bytes.0, &mut records) && records.len() as u64 == size;
        self.recording.unpacked(records.len());
        let sound = unpacked && (crc == 0 || crc32fast::hash(&records) == crc);
        // The unpacked part of a truncated chunk is valid.
        let read = (sound || !whole) && self.packed(&records, byte);
        if whole && !read {
            self.recording.damaged(byte, chunk.len() as u64);
        }
        self.unpacked = records;
    }

    /// Reads the records within a chunk; returns whether all are valid.
    fn packed(&mut self, records: &[u8], byte: u64) -> bool {
        let mut bytes = Bytes(records);
        while !bytes.0.is_empty() {
            let mut record = || {
                let kind = bytes.u8()?;
                let length = bytes.u64()?;
                Some((kind, bytes.take(usize::try_from(length).ok()?)?))
            };
            let Some((kind, record)) = record() else { return false };
            if !self.record(kind, record, byte) {
                return false;
            }
        }
        true
    }

    /// Reads a record; returns whether it is valid.
    fn record(&mut self, kind: u8, record: &[u8], byte: u64) -> bool {
        match kind {
            op::MESSAGE => self.message(record, byte).is_some(),
            op::SCHEMA | op::CHANNEL => self.declare(kind, record).is_some(),
            _ => true,
        }
    }

    fn declare(&mut self, kind: u8, record: &[u8]) -> Option<()> {
        let mut bytes = Bytes(record);
        let id = bytes.u16()?;
        if kind == op::SCHEMA {
            let (name, encoding) = (bytes.text()?, bytes.text()?);
            self.schemas.insert(id, Schema { name, encoding, definition: bytes.text()? });
            return Some(());
        }
        let schema = self.schemas.get(&bytes.u16()?);
        let (topic, encoding) = (bytes.text()?, bytes.text()?);
        let index = match connection(topic, &encoding, schema) {
            Ok(connection) => self.recording.topic(&connection),
            Err((topic, why)) => {
                if !self.channels.contains_key(&id) {
                    self.recording.leave_out(topic, why);
                }
                None
            }
        };
        self.channels.insert(id, index);
        Some(())
    }

    fn message(&mut self, record: &[u8], byte: u64) -> Option<()> {
        let mut bytes = Bytes(record);
        let channel = bytes.u16()?;
        bytes.take(4)?;
        let receipt = bytes.u64()?;
        bytes.take(8)?;
        if let Some(topic) = *self.channels.get(&channel)? {
            let receipt = i64::try_from(receipt).unwrap_or(i64::MAX);
            self.recording.message(topic, receipt, bytes.0, byte);
        }
        Some(())
    }
}

/// Returns the connection that a channel describes, if its messages are of ROS.
fn connection(
    topic: String,
    encoding: &str,
    schema: Option<&Schema>,
) -> Result<Connection, (String, &'static str)> {
    const FOREIGN: &str = "has no message encoding of ROS";
    const IDL: &str = "has a definition in IDL, not as a ROS message";
    let encoding = match encoding {
        "cdr" => Encoding::Cdr,
        "ros1" => Encoding::Ros1,
        _ => return Err((topic, FOREIGN)),
    };
    let Some(schema) = schema else { return Err((topic, "has no message definition")) };
    let definition = match schema.encoding.as_str() {
        "ros2msg" | "ros1msg" => Some(schema.definition.clone()),
        // The common types need no definition.
        "" => None,
        "ros2idl" | "omgidl" => return Err((topic, IDL)),
        _ => return Err((topic, FOREIGN)),
    };
    Ok(Connection { topic, kind: schema.name.clone(), encoding, definition })
}
