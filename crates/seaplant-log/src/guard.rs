//! Readers of others, kept from taking ours down with them.

use std::cell::Cell;
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use crate::Error;

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Whether this thread is within another crate's reader, whose panics are caught and told as
/// errors: a panic hook that asks need not print them.
#[doc(hidden)]
pub fn is_guarded() -> bool {
    GUARDED.get()
}

/// What another crate's reader finds, its errors as [`Error::Damaged`]; likewise its panics, for
/// such readers trust some numbers of a file.
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
