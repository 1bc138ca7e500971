//! Apache Arrow IPC files, which Feather version 2 files are, and streams.

use std::io::Cursor;
use std::path::Path;

use arrow_array::RecordBatch;
use arrow_ipc::reader::{FileReader, StreamReader};
use arrow_ipc::{Message, MessageHeader, root_as_footer, root_as_message};
use arrow_schema::{ArrowError, SchemaRef};

use crate::content::{Content, Origin};
use crate::grid::{ChooseTime, Grid};
use crate::guard::guarded;
use crate::note::Note;
use crate::readers::columnar::Columnar;
use crate::unpack::{TooMuch, limit};
use crate::{Error, Log, ReadOptions, tabular};

/// What messages call the format.
const FORMAT: &str = "an Arrow file";

/// What stands at both ends of a file.
const MAGIC: &[u8] = b"ARROW1";

/// Where the stream within a file starts.
const STREAM: usize = 8;

/// What stands before each message of a stream.
const CONTINUES: [u8; 4] = [0xff; 4];

/// Whether bytes start like an Arrow file, or like a stream: with a schema.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(MAGIC)
        || matches!(next(head, 0), Some(Next::Message { message, .. })
            if message.header_type() == MessageHeader::Schema)
}

/// Reads an Arrow file.
///
/// # Errors
/// Those of [`grid`]; of time: see [`tabular::read`].
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    let path = content.path().to_owned();
    tabular::read(&path, options, |choose_time| grid(content, choose_time))
}

/// Reads the table in an Arrow file. One that is cut off gives the batches before the cut, for a
/// file is a stream with an index behind it.
///
/// # Errors
/// [`Error::Damaged`], [`Error::TooMuch`]; those of `choose_time`.
pub(crate) fn grid(content: Content, choose_time: ChooseTime<'_>) -> Result<Grid, Error> {
    let (origin, bytes) = content.bytes()?;
    let is_file = bytes.starts_with(MAGIC);
    let path = origin.path().to_owned();
    let size = bytes.len() as u64;
    if is_file && bytes.ends_with(MAGIC) {
        check_blocks(&bytes, &path)?;
        let reader = guarded(&path, FORMAT, || FileReader::try_new(Cursor::new(bytes), None))?;
        return batches(reader.schema(), reader, &path, size, choose_time)
            .map(|table| table.into_grid(origin, "Arrow IPC"));
    }
    stream(bytes, if is_file { STREAM } else { 0 }, origin, choose_time)
}

fn stream(
    mut bytes: Vec<u8>,
    start: usize,
    origin: Origin,
    choose_time: ChooseTime<'_>,
) -> Result<Grid, Error> {
    let (path, size) = (origin.path().to_owned(), bytes.len() as u64);
    let (end, is_whole) = whole_messages(&bytes, start, &path)?;
    bytes.truncate(end);
    bytes.drain(..start);
    let reader = guarded(&path, FORMAT, || StreamReader::try_new(Cursor::new(bytes), None))?;
    let table = batches(reader.schema(), reader, &path, size, choose_time)?;
    let mut grid = table.into_grid(origin, "Arrow IPC");
    // The index of a file is missed with its end.
    if start > 0 || !is_whole {
        grid.notes.push(Note::Truncated { path, byte: end as u64, last_s: None });
    }
    Ok(grid)
}

fn batches<'a>(
    schema: SchemaRef,
    mut reader: impl Iterator<Item = Result<RecordBatch, ArrowError>>,
    path: &'a Path,
    size: u64,
    choose_time: ChooseTime<'_>,
) -> Result<Columnar<'a>, Error> {
    let mut table = Columnar::new(schema.fields(), path, size, choose_time)?;
    let fields: Vec<usize> = (0..schema.fields().len()).collect();
    while let Some(batch) = guarded(path, FORMAT, || reader.next().transpose())? {
        table.take(&batch, &fields)?;
    }
    Ok(table)
}

/// What stands at a place of a stream.
enum Next<'a> {
    /// A message, where its body is, and where the next one may be.
    Message { message: Message<'a>, body: std::ops::Range<usize> },
    /// The mark of its end.
    End,
}

/// The message at `at`; `None` where none stands, or not the whole of one.
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

/// How far the messages from `start` on are whole, and whether the stream ends there by itself.
fn whole_messages(bytes: &[u8], start: usize, path: &Path) -> Result<(usize, bool), Error> {
    let mut at = start;
    while let Some(Next::Message { message, body }) = next(bytes, at) {
        let Some(content) = bytes.get(body.clone()) else { break };
        check_unpacked(&message, content, bytes.len(), path)?;
        at = body.end;
    }
    let is_whole = at == bytes.len() || matches!(next(bytes, at), Some(Next::End));
    Ok((at, is_whole))
}

/// Looks at every message that the index of a file names.
fn check_blocks(bytes: &[u8], path: &Path) -> Result<(), Error> {
    let damaged = |found: &str| Error::Damaged {
        path: path.to_owned(),
        format: FORMAT,
        found: found.to_owned(),
    };
    let lost = || damaged("the index at its end is damaged");
    let before_magic = &bytes[..bytes.len() - MAGIC.len()];
    let (before, length) = before_magic.split_last_chunk().ok_or_else(lost)?;
    let length = u32::from_le_bytes(*length) as usize;
    let footer = before.len().checked_sub(length).map(|start| &before[start..]).ok_or_else(lost)?;
    let footer = root_as_footer(footer).map_err(|_| lost())?;
    let blocks = footer.dictionaries().into_iter().flatten();
    for block in blocks.chain(footer.recordBatches().into_iter().flatten()) {
        let wrong = || damaged("the index at its end points at no message");
        let at = usize::try_from(block.offset()).map_err(|_| wrong())?;
        let Some(Next::Message { message, body }) = next(bytes, at) else { return Err(wrong()) };
        let content = bytes.get(body).ok_or_else(wrong)?;
        check_unpacked(&message, content, bytes.len(), path)?;
    }
    Ok(())
}

/// Refuses a message whose buffers claim to unpack to more than a file of its size may hold: they
/// are believed when memory is taken.
fn check_unpacked(
    message: &Message<'_>,
    body: &[u8],
    size: usize,
    path: &Path,
) -> Result<(), Error> {
    let dictionary = message.header_as_dictionary_batch().and_then(|batch| batch.data());
    let Some(batch) = message.header_as_record_batch().or(dictionary) else { return Ok(()) };
    if batch.compression().is_none() {
        return Ok(());
    }
    let buffers = batch.buffers().into_iter().flatten();
    let claimed = buffers.filter_map(|buffer| {
        let start = usize::try_from(buffer.offset()).ok()?;
        let length = i64::from_le_bytes(*body.get(start..)?.first_chunk()?);
        // Minus one stands for bytes that are not packed.
        u64::try_from(length).ok()
    });
    let (packed, unpacked) = (size as u64, claimed.fold(0, u64::saturating_add));
    if unpacked > limit(packed) {
        return Err(Error::io(path, std::io::Error::other(TooMuch { unpacked, packed })));
    }
    Ok(())
}
