//! Apache Parquet files.

use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;

use bytes::Bytes;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ParquetRecordBatchReaderBuilder, RowSelection,
};
use parquet::basic::Compression;
use parquet::file::metadata::ParquetMetaData;
use parquet::file::reader::ChunkReader;

use crate::content::{Content, Origin, Seekable};
use crate::figure::{Figure, Portion};
use crate::glance::{Glance, Thoroughness, half_a_hole};
use crate::grid::{ChooseTime, Grid};
use crate::guard::guarded;
use crate::note::Note;
use crate::readers::columnar::Columnar;
use crate::readers::parquet_file::SharedFile;
use crate::readers::parquet_pages::sound_groups;
use crate::{Error, Log, ReadOptions, tabular};

/// Name of the format in messages.
const FORMAT: &str = "a Parquet file";

/// Magic bytes at both ends of a file.
const MAGIC: &[u8] = b"PAR1";

/// Returns whether bytes start like a Parquet file.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(MAGIC)
}

/// Reads a Parquet file.
///
/// # Errors
/// Those of [`grid`]; for time: see [`tabular::read`].
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    let path = content.path().to_owned();
    tabular::read(&path, options, |choose_time| grid(content, choose_time))
}

/// Reads some ranges of a Parquet file's rows, whose number its index states; `None` for a file
/// with few rows.
///
/// # Errors
/// As [`read`].
pub(crate) fn glance(
    content: Content,
    options: &ReadOptions,
    how: Thoroughness,
) -> Result<Option<Glance>, Error> {
    let path = content.path().to_owned();
    let (mut origin, file) = content.seekable()?;
    let Seekable::File(file) = file else { return Ok(None) };
    let size = file.metadata().map_err(|error| origin.failed(error))?.len();
    let file = SharedFile::new(file, size);
    let metadata = guarded(&path, FORMAT, || ArrowReaderMetadata::load(&file, Default::default()))?;
    let rows = usize::try_from(metadata.metadata().file_metadata().num_rows()).unwrap_or(0);
    let Some(stretches) = stretches(rows, size, how) else { return Ok(None) };
    origin.reads_in_part(size);
    let selection = RowSelection::from_consecutive_ranges(stretches.iter().cloned(), rows);
    let mut log = tabular::read(&path, options, |choose_time| {
        chunks(file, size, origin, choose_time, Some(selection))
    })?;
    let read: usize = stretches.iter().map(ExactSizeIterator::len).sum();
    let portion = Some(Portion { read, of: Figure::Exact(rows as u64) });
    log.channels.iter_mut().for_each(|channel| channel.portion = portion);
    let part = read as f64 / rows as f64;
    let (parts, bytes) = (stretches.len(), (part * size as f64) as u64);
    let pause_s = half_a_hole(&log, parts, part);
    Ok(Some(Glance { log, parts, bytes, pause_s, has_ends: false }))
}

/// Returns the ranges of rows that a survey reads, from the first to the last; `None` if these are
/// most of the file.
fn stretches(rows: usize, size: u64, how: Thoroughness) -> Option<Vec<Range<usize>>> {
    /// Each part needs at least one page of each column to be unpacked, so there are fewer parts
    /// than in other formats.
    const PARTS: usize = 6;
    let parts = how.parts.clamp(2, PARTS);
    let row = size / (rows as u64).max(1) + 1;
    let each = (how.part_bytes as u64 / row).max(64) as usize;
    let from = |part: usize| part * (rows - each) / (parts - 1);
    let enough = rows > each.checked_mul(2 * parts)?;
    enough.then(|| (0..parts).map(|part| from(part)..from(part) + each).collect())
}

/// Reads the table in a Parquet file.
///
/// # Errors
/// [`Error::Damaged`], also of a file that is cut off, whose index is at its end;
/// [`Error::Unsupported`], [`Error::TooMuch`]; those of `choose_time`.
pub(crate) fn grid(content: Content, choose_time: ChooseTime<'_>) -> Result<Grid, Error> {
    let (origin, mut file) = content.seekable()?;
    let failed = |error| origin.failed(error);
    let mut end = [0; MAGIC.len()];
    let size = file.seek(SeekFrom::End(0)).map_err(failed)?;
    file.seek(SeekFrom::End(-(MAGIC.len() as i64))).map_err(failed)?;
    file.read_exact(&mut end).map_err(failed)?;
    if end != MAGIC {
        let found = "it is cut off, and the index at its end is lost".to_owned();
        return Err(Error::Damaged { path: origin.path().to_owned(), format: FORMAT, found });
    }
    match file {
        Seekable::File(file) => {
            chunks(SharedFile::new(file, size), size, origin, choose_time, None)
        }
        Seekable::Memory(bytes) => {
            chunks(Bytes::from(bytes.into_inner()), size, origin, choose_time, None)
        }
    }
}

fn chunks(
    chunks: impl ChunkReader + 'static,
    size: u64,
    origin: Origin,
    choose_time: ChooseTime<'_>,
    selection: Option<RowSelection>,
) -> Result<Grid, Error> {
    let path = &origin.path().to_owned();
    let metadata =
        guarded(path, FORMAT, || ArrowReaderMetadata::load(&chunks, Default::default()))?;
    check_compression(metadata.metadata(), path)?;
    let groups = metadata.metadata().num_row_groups();
    let sound =
        guarded(path, FORMAT, || Ok::<_, Error>(sound_groups(&chunks, metadata.metadata(), size)))?;
    if sound == 0 && groups > 0 {
        let found = "the headers of its pages are damaged".to_owned();
        return Err(Error::Damaged { path: path.to_owned(), format: FORMAT, found });
    }
    let mut table = Columnar::new(metadata.schema().fields(), path, size, choose_time)?;
    let fields = table.fields();
    let mask = ProjectionMask::roots(metadata.parquet_schema(), fields.iter().copied());
    let reader = ParquetRecordBatchReaderBuilder::new_with_metadata(chunks, metadata);
    let mut reader = reader.with_projection(mask).with_row_groups((0..sound).collect());
    // From a damaged table all intact groups are read, or nothing.
    if let Some(selection) = selection.filter(|_| sound == groups) {
        reader = reader.with_row_selection(selection);
    }
    let batches = guarded(path, FORMAT, || reader.build())?;
    table.take_all(batches, &fields, FORMAT)?;
    let mut grid = table.into_grid(origin, "Parquet");
    if sound < groups {
        let (path, first_row) = (path.to_owned(), grid.rows as u64 + 1);
        let reason = "the headers of their pages are damaged".to_owned();
        grid.notes.push(Note::UnreadableRows { path, first_row, reason });
    }
    Ok(grid)
}

fn check_compression(metadata: &ParquetMetaData, path: &Path) -> Result<(), Error> {
    let groups = metadata.row_groups().iter();
    let mut compressions = groups.flat_map(|group| group.columns()).map(|c| c.compression());
    let unread = |c: &Compression| matches!(c, Compression::BROTLI(_) | Compression::LZO);
    let Some(compression) = compressions.find(unread) else { return Ok(()) };
    Err(Error::Unsupported {
        path: path.to_owned(),
        format: FORMAT,
        detail: format!("with {compression} compression"),
        advice: "write it with zstd, snappy, gzip or lz4",
    })
}
