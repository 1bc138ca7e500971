//! Files that are read only if they are no longer than their kind can be.

use std::io::Read;
use std::path::Path;

use crate::Error;

/// Ten thousand trials take a few of these.
pub(crate) const MOST_BYTES: u64 = 64 << 20;

/// The bytes of a file, if it is one and no longer than that: a pipe may never end, and a device
/// such as `/dev/zero` does not.
///
/// # Errors
/// [`Error::Io`], [`Error::NotAFile`], [`Error::TooLarge`].
pub fn read_bounded(path: &Path, most: u64) -> Result<Vec<u8>, Error> {
    let failed = |source| Error::Io { path: path.to_owned(), source };
    let data = std::fs::metadata(path).map_err(failed)?;
    // A folder is told by the system, in its own words.
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

/// The text of a TOML file for an excerpt or advice; empty if it cannot be had.
pub(crate) fn text_of(path: &Path) -> String {
    let bytes = read_bounded(path, MOST_BYTES).unwrap_or_default();
    String::from_utf8(bytes).unwrap_or_default()
}
