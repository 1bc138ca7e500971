//! Readers of others, kept from taking ours down with them.

use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use crate::Error;

/// What another crate's reader finds, its errors as [`Error::Damaged`]; likewise its panics, for
/// such readers trust some numbers of a file.
pub(crate) fn guarded<T, E: Display>(
    path: &Path,
    format: &'static str,
    find: impl FnOnce() -> Result<T, E>,
) -> Result<T, Error> {
    let found = match catch_unwind(AssertUnwindSafe(find)) {
        Ok(Ok(found)) => return Ok(found),
        Ok(Err(error)) => error.to_string(),
        Err(_) => "its parts contradict each other".to_owned(),
    };
    Err(Error::Damaged { path: path.to_owned(), format, found })
}
