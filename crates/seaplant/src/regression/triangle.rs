//! Rows reduced to triangles, batch by batch.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::Row;
use crate::Terms;
use crate::terms::Term;

/// Number of columns of a triangle, `[τ, v|v|, 1, v̇, v]`; the last is omitted unless fitted.
pub(super) const WIDTH: usize = 5;
pub(super) const ONE: usize = 2;
pub(super) const V_DOT: usize = 3;

pub(super) fn width(terms: Terms) -> usize {
    if terms.has(Term::Linear) { WIDTH } else { WIDTH - 1 }
}

pub(super) const fn place(term: Term) -> usize {
    match term {
        Term::Force => 0,
        Term::Quadratic => 1,
        Term::Bias => ONE,
        Term::Linear => 4,
    }
}

/// Number of rows reduced at a time: 512 rows of five numbers fit the first-level cache.
pub(super) const BLOCK_ROWS: usize = 512;

/// Rows to be reduced, stored by columns.
pub(super) struct Block {
    pub(super) columns: [[f64; BLOCK_ROWS]; WIDTH],
    pub(super) rows: usize,
}

impl Default for Block {
    fn default() -> Self {
        Self { columns: [[0.0; BLOCK_ROWS]; WIDTH], rows: 0 }
    }
}

impl Block {
    /// Appends rows; `ones` is the constant's column where that is not 1.
    pub(super) fn push(&mut self, rows: &[Row], ones: Option<&[f64]>) {
        let space = self.rows..self.rows + rows.len();
        for (term, place) in [
            (0, place(Term::Force)),
            (1, place(Term::Quadratic)),
            (2, place(Term::Linear)),
            (3, V_DOT),
        ] {
            let column = self.columns[place][space.clone()].iter_mut();
            column.zip(rows).for_each(|(x, row)| *x = row[term]);
        }
        match ones {
            None => self.columns[ONE][space].fill(1.0),
            Some(ones) => self.columns[ONE][space].copy_from_slice(ones),
        }
        self.rows += rows.len();
    }
}

/// Consecutive rows, reduced.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Batch {
    pub(super) triangle: Triangle,
    pub(super) rows: usize,
}

/// The factor R of a QR decomposition, row by row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Triangle([[f64; WIDTH]; WIDTH]);

impl Triangle {
    pub(super) fn merged(batches: &[Batch]) -> Self {
        let mut whole = Self::default();
        for batch in batches {
            let mut columns: [[f64; WIDTH]; WIDTH] =
                std::array::from_fn(|j| batch.triangle.column(j).into());
            whole.absorb(&mut columns, WIDTH, WIDTH);
        }
        whole
    }

    /// Updates R with the rows of a block below it by Householder reflections, in the first `width`
    /// columns; overwrites the block.
    pub(super) fn absorb<const N: usize>(
        &mut self,
        block: &mut [[f64; N]; WIDTH],
        rows: usize,
        width: usize,
    ) {
        for j in 0..width {
            let (done, rest) = block[..width].split_at_mut(j + 1);
            let mirror = &done[j][..rows];
            let square = dot(mirror, mirror);
            if square == 0.0 {
                continue;
            }
            let top = self.0[j][j];
            let reflected = -(top * top + square).sqrt().copysign(top);
            let mirror_top = top - reflected;
            let weight = 2.0 / (mirror_top * mirror_top + square);
            self.0[j][j] = reflected;
            for (k, column) in rest.iter_mut().enumerate() {
                let top = &mut self.0[j][j + 1 + k];
                let column = &mut column[..rows];
                let part = weight * (mirror_top * *top + dot(mirror, column));
                *top -= part * mirror_top;
                column.iter_mut().zip(mirror).for_each(|(x, mirror)| *x -= part * mirror);
            }
        }
    }

    pub(super) fn column(&self, j: usize) -> SVector<f64, WIDTH> {
        SVector::from_fn(|i, _| self.0[i][j])
    }
}

/// Returns a scalar product from eight parallel sums, which do not depend on each other.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}
