//! Text tables.

use crate::content::Content;
use crate::framing::Framing;
use crate::{Error, Log, ReadOptions, grid, tabular};

/// Separates records by lines, unless the text starts with a byte-order mark.
pub(crate) fn framing(head: &[u8]) -> Option<Framing> {
    encoding_rs::Encoding::for_bom(head).is_none().then_some(Framing::Lines)
}

/// Reads a text table.
///
/// # Errors
/// For the table: see [`grid::read`]; for time: see [`tabular::read`].
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    let path = content.path().to_owned();
    tabular::read(&path, options, |choose_time| grid::read(content, choose_time))
}
