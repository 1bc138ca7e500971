//! Apache Parquet files.

use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use bytes::Bytes;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::basic::Compression;
use parquet::file::reader::ChunkReader;

use crate::content::{Content, Origin, Seekable};
use crate::grid::{ChooseTime, Grid};
use crate::guard::guarded;
use crate::readers::columnar::Columnar;
use crate::{Error, Log, ReadOptions, tabular};

/// What messages call the format.
const FORMAT: &str = "a Parquet file";

/// What stands at both ends of a file.
const MAGIC: &[u8] = b"PAR1";

/// Whether bytes start like a Parquet file.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(MAGIC)
}

/// Reads a Parquet file.
///
/// # Errors
/// Those of [`grid`]; of time: see [`tabular::read`].
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    let path = content.path().to_owned();
    tabular::read(&path, options, |choose_time| grid(content, choose_time))
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
        Seekable::File(file) => chunks(file, size, origin, choose_time),
        Seekable::Memory(bytes) => {
            chunks(Bytes::from(bytes.into_inner()), size, origin, choose_time)
        }
    }
}

fn chunks(
    chunks: impl ChunkReader + 'static,
    size: u64,
    origin: Origin,
    choose_time: ChooseTime<'_>,
) -> Result<Grid, Error> {
    let path = &origin.path().to_owned();
    let reader = guarded(path, FORMAT, || ParquetRecordBatchReaderBuilder::try_new(chunks))?;
    check_compression(&reader, path)?;
    let mut table = Columnar::new(reader.schema().fields(), path, size, choose_time)?;
    let fields = table.fields();
    let mask = ProjectionMask::roots(reader.parquet_schema(), fields.iter().copied());
    let batches = guarded(path, FORMAT, || reader.with_projection(mask).build())?;
    table.take_all(batches, &fields, FORMAT)?;
    Ok(table.into_grid(origin, "Parquet"))
}

fn check_compression<T>(
    reader: &ParquetRecordBatchReaderBuilder<T>,
    path: &Path,
) -> Result<(), Error>
where
    T: ChunkReader + 'static,
{
    let groups = reader.metadata().row_groups().iter();
    let mut compressions =
        groups.flat_map(|group| group.columns()).map(|column| column.compression());
    let unread = |c: &Compression| matches!(c, Compression::BROTLI(_) | Compression::LZO);
    let Some(compression) = compressions.find(unread) else { return Ok(()) };
    Err(Error::Unsupported {
        path: path.to_owned(),
        format: FORMAT,
        detail: format!("with {compression} compression"),
        advice: "write it with zstd, snappy, gzip or lz4",
    })
}
