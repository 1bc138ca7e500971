//! Isolation from panics of other crates' readers.

use std::cell::Cell;
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use crate::Error;

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Returns whether this thread is within another crate's reader, whose panics are caught and
/// reported as errors: a panic hook need not print them.
#[doc(hidden)]
pub fn is_guarded() -> bool {
    GUARDED.get()
}

/// Runs another crate's reader and converts its errors, and its panics, to [`Error::Damaged`]: such
/// readers trust some numbers of a file.
pub(crate) fn guarded<T, E: Display>(
    path: &Path,
    format: &'static str,
    find: impl FnOnce() -> Result<T, E>,
) -> Result<T, Error> {
    GUARDED.set(true);
    let caught = catch_unwind(AssertUnwindSafe(find));
    GUARDED.set(false);
    let found = match caught {
        Ok(Ok(found)) => return Ok(found),
        Ok(Err(error)) => error.to_string(),
        Err(_) => "its parts contradict each other".to_owned(),
    };
    Err(Error::Damaged { path: path.to_owned(), format, found })
}
