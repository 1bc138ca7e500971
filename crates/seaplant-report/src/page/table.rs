//! Tables for the templates.

use serde::Serialize;

/// A table with a caption, a head and row heads.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Table {
    pub(crate) caption: String,
    pub(crate) head: Vec<String>,
    pub(crate) rows: Vec<Row>,
    /// Number of columns of text, which are left-aligned.
    pub(crate) left: usize,
    /// Note below the table; may be empty.
    pub(crate) note: String,
}

/// One row; the first cell is its head.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Row {
    pub(crate) cells: Vec<String>,
    /// True if it is highlighted: the recommended method, a mean.
    pub(crate) strong: bool,
}

impl Table {
    pub(crate) fn new<S: Into<String>>(
        caption: &str,
        head: impl IntoIterator<Item = S>,
        rows: Vec<Row>,
    ) -> Self {
        Self {
            caption: caption.to_owned(),
            head: head.into_iter().map(Into::into).collect(),
            rows,
            left: 1,
            note: String::new(),
        }
    }

    /// Sets the number of text columns.
    pub(crate) fn left(mut self, columns: usize) -> Self {
        self.left = columns;
        self
    }

    pub(crate) fn noted(mut self, note: &str) -> Self {
        note.clone_into(&mut self.note);
        self
    }
}

impl Row {
    pub(crate) fn new<S: Into<String>>(cells: impl IntoIterator<Item = S>) -> Self {
        Self { cells: cells.into_iter().map(Into::into).collect(), strong: false }
    }

    pub(crate) fn strong_if(mut self, strong: bool) -> Self {
        self.strong = strong;
        self
    }
}
