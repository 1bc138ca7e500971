//! Limits on the names in a log: each name costs memory and time, however few bytes define it.

use std::path::Path;

use crate::Error;

/// Maximum number of columns in a log. The largest logs of autopilots have some thousands.
pub(crate) const MOST_COLUMNS: usize = 100_000;

/// Maximum length of a name in bytes.
const LONGEST_NAME: usize = 1000;

/// Checks the number and the length of a log's names.
///
/// # Errors
/// [`Error::TooManyColumns`], [`Error::LongName`].
pub(crate) fn check_names<'a>(
    names: impl ExactSizeIterator<Item = &'a str>,
    path: &Path,
) -> Result<(), Error> {
    if names.len() > MOST_COLUMNS {
        return Err(too_many_columns(path));
    }
    for name in names {
        if name.len() > LONGEST_NAME {
            let (path, found) = (path.to_owned(), name.len());
            let start = name.chars().take(SHOWN).collect();
            return Err(Error::LongName { path, start, found, most: LONGEST_NAME });
        }
    }
    Ok(())
}

/// Number of characters that identify a name in a message.
const SHOWN: usize = 40;

/// Returns the error for a log with more than [`MOST_COLUMNS`].
pub(crate) fn too_many_columns(path: &Path) -> Error {
    Error::TooManyColumns { path: path.to_owned(), most: MOST_COLUMNS }
}
