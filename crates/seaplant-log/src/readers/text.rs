//! Text tables.

use crate::content::Content;
use crate::{Error, Log, ReadOptions, grid, tabular};

/// Reads a text table.
///
/// # Errors
/// Of the table: see [`grid::read`]; of time: see [`tabular::read`].
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    let path = content.path().to_owned();
    tabular::read(&path, options, |choose_time| grid::read(content, choose_time))
}
