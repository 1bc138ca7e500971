//! Reads files only up to the size that is plausible for their kind.

use std::io::Read;
use std::path::Path;

use crate::Error;

/// Size limit; ten thousand trials take a few MiB.
pub(crate) const MOST_BYTES: u64 = 64 << 20;

/// Reads a regular file up to that size: a pipe may never end, and a device such as `/dev/zero`
/// does not.
///
/// # Errors
/// [`Error::Io`], [`Error::NotAFile`], [`Error::TooLarge`].
pub fn read_bounded(path: &Path, most: u64) -> Result<Vec<u8>, Error> {
    let failed = |source| Error::Io { path: path.to_owned(), source };
    let data = std::fs::metadata(path).map_err(failed)?;
    // The system reports a folder in its own words.
    if !data.is_file() && !data.is_dir() {
        return Err(Error::NotAFile { path: path.to_owned() });
    }
    let mut bytes = Vec::new();
    let file = std::fs::File::open(path).map_err(failed)?;
    file.take(most + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > most {
        return Err(Error::TooLarge { path: path.to_owned(), most });
    }
    Ok(bytes)
}

/// Returns the text of a TOML file for an excerpt or advice; empty if it cannot be read.
pub(crate) fn text_of(path: &Path) -> String {
    let bytes = read_bounded(path, MOST_BYTES).unwrap_or_default();
    String::from_utf8(bytes).unwrap_or_default()
}
