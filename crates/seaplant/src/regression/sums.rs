//! Rows reduced to triangles that can be merged in any order.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::Row;
use super::triangle::{BLOCK_ROWS, Batch, Block, WIDTH, width};
use crate::Terms;

/// Reduced rows by batch number.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sums {
    batches: BTreeMap<u64, Batch>,
}

impl Sums {
    /// Adds consecutive rows; the first has its number, and a batch a fixed number of rows.
    pub(crate) fn add_in_batches(
        &mut self,
        mut first: u64,
        mut rows: &[Row],
        batch_rows: u64,
        terms: Terms,
    ) {
        while !rows.is_empty() {
            let batch = first / batch_rows;
            let room = ((batch + 1) * batch_rows - first).min(rows.len() as u64);
            let (now, later) = rows.split_at(room as usize);
            self.add(batch, now, terms);
            (first, rows) = (first + room, later);
        }
    }

    fn add(&mut self, batch: u64, rows: &[Row], terms: Terms) {
        let batch = self.batches.entry(batch).or_default();
        let mut block = Block::default();
        for rows in rows.chunks(BLOCK_ROWS) {
            block.push(rows, None);
            batch.triangle.absorb(&mut block.columns, block.rows, width(terms));
            batch.rows += block.rows;
            block.rows = 0;
        }
    }

    /// Merges the sums of another part.
    pub(crate) fn merge(&mut self, other: &Self) {
        for (number, batch) in &other.batches {
            self.batches.entry(*number).or_default().merge(batch);
        }
    }

    /// Returns the number of rows in all batches.
    pub(crate) fn rows(&self) -> usize {
        self.batches.values().map(|batch| batch.rows).sum()
    }

    /// Merges groups of `count` neighbouring batches.
    pub(crate) fn grouped(&self, count: u64) -> Vec<Batch> {
        let mut groups: BTreeMap<u64, Batch> = BTreeMap::new();
        for (number, batch) in &self.batches {
            groups.entry(number / count.max(1)).or_default().merge(batch);
        }
        groups.into_values().collect()
    }
}

impl Batch {
    /// Merges two triangles by `[R₁; R₂] = Q R`: the result is that of the rows of both.
    fn merge(&mut self, other: &Self) {
        let mut columns: [[f64; WIDTH]; WIDTH] =
            std::array::from_fn(|j| other.triangle.column(j).into());
        self.triangle.absorb(&mut columns, WIDTH, WIDTH);
        self.rows += other.rows;
    }
}
