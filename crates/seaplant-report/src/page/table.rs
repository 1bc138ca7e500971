//! Tables for the templates.

use serde::Serialize;

use crate::number::ABSENT;

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

    /// Removes the columns in which no row has a value.
    pub(crate) fn without_empty_columns(mut self) -> Self {
        let has_value = |column: usize| {
            self.rows.iter().any(|row| row.cells.get(column).is_some_and(|cell| cell != ABSENT))
        };
        let kept: Vec<bool> = (0..self.head.len()).map(has_value).collect();
        let keep = |cells: &mut Vec<String>| {
            let mut kept = kept.iter();
            cells.retain(|_| *kept.next().unwrap_or(&true));
        };
        self.left = kept.iter().take(self.left).filter(|kept| **kept).count();
        keep(&mut self.head);
        self.rows.iter_mut().for_each(|row| keep(&mut row.cells));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_without_a_value_are_left_out() {
        let rows = vec![Row::new(["a", ABSENT, "1"]), Row::new(["b", ABSENT, ABSENT])];
        let table =
            Table::new("", ["name", "word", "number"], rows).left(2).without_empty_columns();
        assert_eq!(table.head, ["name", "number"]);
        assert_eq!(table.rows[0].cells, ["a", "1"]);
        assert_eq!((table.rows[1].cells.len(), table.left), (2, 1));
        let empty = Table::new("", ["name"], Vec::new()).without_empty_columns();
        assert!(empty.rows.is_empty());
    }
}
