//! Apache Arrow IPC files, including Feather version 2, and streams.

use std::io::Cursor;
use std::path::Path;

use arrow_array::RecordBatch;
use arrow_ipc::reader::{FileReader, StreamReader};
use arrow_ipc::{Block, Message, MessageHeader, root_as_footer, root_as_message};
use arrow_schema::{ArrowError, SchemaRef};

use crate::content::{Content, Origin};
use crate::error::TooMuch;
use crate::grid::{ChooseTime, Grid};
use crate::guard::guarded;
use crate::note::Note;
use crate::readers::columnar::Columnar;
use crate::unpack::limit;
use crate::{Error, Log, ReadOptions, tabular};

/// Name of the format in messages.
const FORMAT: &str = "an Arrow file";

/// Name of the format in the log's source.
const NAME: &str = "Arrow IPC";

/// Magic bytes at both ends of a file.
const MAGIC: &[u8] = b"ARROW1";

/// Position of the stream within a file.
const STREAM: usize = 8;

/// Marker before each message of a stream.
const CONTINUES: [u8; 4] = [0xff; 4];

/// Returns whether bytes start like an Arrow file, or like a stream: with a schema.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(MAGIC)
        || matches!(next(head, 0), Some(Next::Message { message, .. })
            if message.header_type() == MessageHeader::Schema)
}

/// Reads an Arrow file.
///
/// # Errors
/// Those of [`grid`]; for time: see [`tabular::read`].
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    let path = content.path().to_owned();
    tabular::read(&path, options, |choose_time| grid(content, choose_time))
}

/// Reads the table in an Arrow file. A truncated or damaged file yields the batches before the
/// damage, because a file is a stream followed by an index.
///
/// # Errors
/// [`Error::Damaged`], [`Error::TooMuch`]; those of `choose_time`.
pub(crate) fn grid(content: Content, choose_time: ChooseTime<'_>) -> Result<Grid, Error> {
    let (origin, bytes) = content.bytes()?;
    let path = origin.path().to_owned();
    let size = bytes.len() as u64;
    if bytes.starts_with(MAGIC) && is_indexed(&bytes) {
        let reader = guarded(&path, FORMAT, || FileReader::try_new(Cursor::new(bytes), None))?;
        return batches(reader.schema(), reader, &path, size, choose_time)
            .map(|table| table.into_grid(origin, NAME));
    }
    stream(bytes, origin, choose_time)
}

fn stream(mut bytes: Vec<u8>, origin: Origin, choose_time: ChooseTime<'_>) -> Result<Grid, Error> {
    let (path, size) = (origin.path().to_owned(), bytes.len() as u64);
    let start = if bytes.starts_with(MAGIC) { STREAM } else { 0 };
    let (end, ending) = sound_messages(&bytes, start);
    bytes.truncate(end);
    bytes.drain(..start.min(bytes.len()));
    let reader = guarded(&path, FORMAT, || StreamReader::try_new(Cursor::new(bytes), None))?;
    let table = batches(reader.schema(), reader, &path, size, choose_time)?;
    let mut grid = table.into_grid(origin, NAME);
    match ending {
        Ending::Marked => {}
        Ending::Cut => {
            grid.notes.push(Note::Truncated { path, byte: end as u64, last_s: None });
        }
        Ending::TooMuch(too_much) if grid.rows == 0 => {
            return Err(Error::io(&path, std::io::Error::other(too_much)));
        }
        Ending::TooMuch(too_much) => {
            let (first_row, reason) = (grid.rows as u64 + 1, too_much.to_string());
            grid.notes.push(Note::UnreadableRows { path, first_row, reason });
        }
    }
    Ok(grid)
}

fn batches<'a>(
    schema: SchemaRef,
    reader: impl Iterator<Item = Result<RecordBatch, ArrowError>>,
    path: &'a Path,
    size: u64,
    choose_time: ChooseTime<'_>,
) -> Result<Columnar<'a>, Error> {
    let mut table = Columnar::new(schema.fields(), path, size, choose_time)?;
    let fields: Vec<usize> = (0..schema.fields().len()).collect();
    table.take_all(reader, &fields, FORMAT)?;
    Ok(table)
}

/// Content at a position of a stream.
enum Next<'a> {
    /// A message, the range of its body, and the earliest position of the next message.
    Message { message: Message<'a>, body: std::ops::Range<usize> },
    /// The end marker.
    End,
}

/// Parses the message at `at`; `None` if there is none or it is incomplete.
fn next(bytes: &[u8], at: usize) -> Option<Next<'_>> {
    let rest = bytes.get(at..)?.strip_prefix(&CONTINUES)?;
    let length = u32::from_le_bytes(*rest.first_chunk()?) as usize;
    if length == 0 {
        return Some(Next::End);
    }
    let message = root_as_message(rest.get(4..4_usize.checked_add(length)?)?).ok()?;
    let body = at + 8 + length;
    let end = body.checked_add(usize::try_from(message.bodyLength()).ok()?)?;
    Some(Next::Message { message, body: body..end })
}

/// End of a stream.
enum Ending {
    /// Regular, with the end marker.
    Marked,
    /// Within a message, or where no message starts.
    Cut,
    /// Before a message that claims to hold more than is possible.
    TooMuch(TooMuch),
}

/// Returns the position up to which the messages from `start` are complete and valid, and how they
/// end.
fn sound_messages(bytes: &[u8], start: usize) -> (usize, Ending) {
    let mut at = start;
    loop {
        match next(bytes, at) {
            Some(Next::End) => return (at, Ending::Marked),
            None if at == bytes.len() => return (at, Ending::Marked),
            None => return (at, Ending::Cut),
            Some(Next::Message { message, body }) => {
                let Some(content) = bytes.get(body.clone()) else { return (at, Ending::Cut) };
                if let Err(too_much) = check_unpacked(&message, content, bytes.len()) {
                    return (at, Ending::TooMuch(too_much));
                }
                at = body.end;
            }
        }
    }
}

/// Returns whether a file ends in an index and all messages in the index are valid.
fn is_indexed(bytes: &[u8]) -> bool {
    let footer = || {
        let (rest, length) = bytes.strip_suffix(MAGIC)?.split_last_chunk()?;
        let start = rest.len().checked_sub(u32::from_le_bytes(*length) as usize)?;
        root_as_footer(&rest[start..]).ok()
    };
    let Some(footer) = footer() else { return false };
    let sound = |block: &Block| {
        let at = usize::try_from(block.offset()).ok()?;
        let Some(Next::Message { message, .. }) = next(bytes, at) else { return None };
        // The reader uses the index, not the message, to find its body and to allocate memory for
        // it.
        let body = at.checked_add(usize::try_from(block.metaDataLength()).ok()?)?;
        let end = body.checked_add(usize::try_from(block.bodyLength()).ok()?)?;
        check_unpacked(&message, bytes.get(body..end)?, bytes.len()).ok()
    };
    let dictionaries = footer.dictionaries().into_iter().flatten();
    let batches = footer.recordBatches().into_iter().flatten();
    dictionaries.chain(batches).all(|block| sound(block).is_some())
}

/// Rejects a message whose buffers claim to unpack to more than a file of its size may hold: the
/// reader allocates memory by these claims.
fn check_unpacked(message: &Message<'_>, body: &[u8], size: usize) -> Result<(), TooMuch> {
    let dictionary = message.header_as_dictionary_batch().and_then(|batch| batch.data());
    let Some(batch) = message.header_as_record_batch().or(dictionary) else { return Ok(()) };
    if batch.compression().is_none() {
        return Ok(());
    }
    let buffers = batch.buffers().into_iter().flatten();
    let claimed = buffers.filter_map(|buffer| {
        let start = usize::try_from(buffer.offset()).ok()?;
        let length = i64::from_le_bytes(*body.get(start..)?.first_chunk()?);
        // Minus one means that the bytes are not packed.
        u64::try_from(length).ok()
    });
    let (packed, unpacked) = (size as u64, claimed.fold(0, u64::saturating_add));
    if unpacked > limit(packed) { Err(TooMuch { unpacked, packed }) } else { Ok(()) }
}
