//! Limits on what a log names: each name costs memory and time, however few bytes make it.

use std::path::Path;

use crate::Error;

/// Columns of a log, at most. The largest logs of autopilots have some thousands.
pub(crate) const MOST_COLUMNS: usize = 100_000;

/// Bytes of a name, at most.
const LONGEST_NAME: usize = 1000;

/// Checks how many names a log has, and how long they are.
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

/// Characters of a name by which it is recognised.
const SHOWN: usize = 40;

/// The error of a log with more than [`MOST_COLUMNS`].
pub(crate) fn too_many_columns(path: &Path) -> Error {
    Error::TooManyColumns { path: path.to_owned(), most: MOST_COLUMNS }
}
