//! Cholesky factor of a symmetric matrix in an envelope of small blocks.
//!
//! Sums run in index order with separate multiplications and additions, in register blocks that
//! any compiler vectorises: the bits do not depend on the processor.

#![expect(clippy::inline_always, reason = "kernels are compiled for several processors")]

use isospline_implicit::{Kernel, run_widest};

/// Side of a block.
const SIDE: usize = 8;

/// Columns of a block that are summed at once: eight registers of four floats.
const COLUMNS: usize = 4;

/// Columns first.
type Block = [[f64; SIDE]; SIDE];

/// The lower triangle by block rows, each from its first block that may differ from zero.
#[derive(Clone, Debug, Default)]
pub(crate) struct Envelope {
    n: usize,
    /// First block column of each block row.
    first: Vec<usize>,
    /// Place of that block.
    start: Vec<usize>,
    blocks: Vec<Block>,
}

impl Envelope {
    /// Becomes a zero matrix of as many rows as `lowest`, the first column of each that may
    /// differ from zero.
    pub(crate) fn reset(&mut self, lowest: &[usize]) {
        self.n = lowest.len();
        self.first.clear();
        self.start.clear();
        let mut n_blocks = 0;
        for (i, rows) in lowest.chunks(SIDE).enumerate() {
            let first = rows.iter().fold(i, |acc, &column| acc.min(column / SIDE));
            self.first.push(first);
            self.start.push(n_blocks);
            n_blocks += i + 1 - first;
        }
        self.blocks.clear();
        self.blocks.resize(n_blocks, [[0.0; SIDE]; SIDE]);
        // Rows that fill the last block up.
        if let Some(last) = self.blocks.last_mut() {
            for k in (self.n - 1) % SIDE + 1..SIDE {
                last[k][k] = 1.0;
            }
        }
    }

    /// Adds to the entry `(row, column)`, `column <= row`.
    #[inline]
    pub(crate) fn add(&mut self, row: usize, column: usize, value: f64) {
        let at = self.place(row / SIDE, column / SIDE);
        self.blocks[at][column % SIDE][row % SIDE] += value;
    }

    fn place(&self, i: usize, j: usize) -> usize {
        self.start[i] + j - self.first[i]
    }

    /// Factorises in place; false if a pivot is not a positive finite number.
    pub(crate) fn factorise(&mut self) -> bool {
        run_widest(Factorisation(self))
    }

    #[inline(always)]
    fn factorise_blocks(&mut self) -> bool {
        for i in 0..self.first.len() {
            for j in self.first[i]..=i {
                let from = self.first[i].max(self.first[j]);
                let (row, other) = (self.place(i, from), self.place(j, from));
                let (at, count) = (self.place(i, j), j - from);
                let mut block = self.blocks[at];
                let blocks = &self.blocks;
                subtract(&mut block, &blocks[row..row + count], &blocks[other..other + count]);
                if i != j {
                    divide(&mut block, &blocks[self.place(j, j)]);
                } else if !factorise(&mut block) {
                    return false;
                }
                self.blocks[at] = block;
            }
        }
        true
    }

    /// Solves in place after [`Envelope::factorise`].
    pub(crate) fn solve(&self, rhs: &mut Vec<f64>) {
        rhs.resize(self.first.len() * SIDE, 0.0);
        let (x, _) = rhs.as_chunks_mut::<SIDE>();
        for i in 0..x.len() {
            let mut y = x[i];
            for j in self.first[i]..i {
                let block = &self.blocks[self.place(i, j)];
                for (column, known) in block.iter().zip(&x[j]) {
                    y.iter_mut().zip(column).for_each(|(y, l)| *y -= l * known);
                }
            }
            x[i] = forward(y, &self.blocks[self.place(i, i)]);
        }
        for i in (0..x.len()).rev() {
            let y = backward(x[i], &self.blocks[self.place(i, i)]);
            x[i] = y;
            for j in self.first[i]..i {
                let block = &self.blocks[self.place(i, j)];
                for (column, to) in block.iter().zip(&mut x[j]) {
                    *to -= column.iter().zip(&y).map(|(l, y)| l * y).sum::<f64>();
                }
            }
        }
        rhs.truncate(self.n);
    }
}

struct Factorisation<'a>(&'a mut Envelope);

impl Kernel for Factorisation<'_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        self.0.factorise_blocks()
    }
}

/// `block -= sum of a_k b_k^T`, in parts whose sums stay in registers.
#[inline(always)]
fn subtract(block: &mut Block, a: &[Block], b: &[Block]) {
    for first in (0..SIDE).step_by(COLUMNS) {
        let mut sums = [[0.0; SIDE]; COLUMNS];
        for (a, b) in a.iter().zip(b) {
            for k in 0..SIDE {
                for c in 0..COLUMNS {
                    for r in 0..SIDE {
                        sums[c][r] += b[k][first + c] * a[k][r];
                    }
                }
            }
        }
        for c in 0..COLUMNS {
            for r in 0..SIDE {
                block[first + c][r] -= sums[c][r];
            }
        }
    }
}

/// `block = block l^-T` for a factorised diagonal block.
#[inline(always)]
fn divide(block: &mut Block, l: &Block) {
    for c in 0..SIDE {
        for k in 0..c {
            let (known, weight) = (block[k], l[k][c]);
            block[c].iter_mut().zip(known).for_each(|(x, known)| *x -= known * weight);
        }
        let inverse = 1.0 / l[c][c];
        block[c].iter_mut().for_each(|x| *x *= inverse);
    }
}

/// Cholesky factor of a diagonal block; what stands above the diagonal is not used.
#[inline(always)]
fn factorise(block: &mut Block) -> bool {
    for c in 0..SIDE {
        for k in 0..c {
            let (known, weight) = (block[k], block[k][c]);
            block[c].iter_mut().zip(known).for_each(|(x, known)| *x -= known * weight);
        }
        let pivot = block[c][c];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return false;
        }
        let inverse = 1.0 / pivot.sqrt();
        block[c].iter_mut().for_each(|x| *x *= inverse);
    }
    true
}

fn forward(mut y: [f64; SIDE], l: &Block) -> [f64; SIDE] {
    for c in 0..SIDE {
        y[c] /= l[c][c];
        for r in c + 1..SIDE {
            y[r] -= l[c][r] * y[c];
        }
    }
    y
}

fn backward(mut y: [f64; SIDE], l: &Block) -> [f64; SIDE] {
    for c in (0..SIDE).rev() {
        for r in c + 1..SIDE {
            y[c] -= l[c][r] * y[r];
        }
        y[c] /= l[c][c];
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A diagonally dominant matrix with entries down to `lowest` in each row.
    fn entry(lowest: &[usize], i: usize, j: usize) -> f64 {
        let (i, j) = (i.max(j), i.min(j));
        match (i == j, j >= lowest[i]) {
            (true, _) => 20.0 + i as f64,
            (false, true) => ((i * 7 + j * 3) % 11) as f64 / 11.0 - 0.5,
            (false, false) => 0.0,
        }
    }

    #[test]
    fn envelopes_of_any_size_and_shape_are_solved_to_rounding() {
        for n in [1, 7, 8, 9, 40, 61] {
            for width in [0, 3, 10, 100] {
                let lowest: Vec<usize> =
                    (0..n).map(|i: usize| i.saturating_sub(width + i % 5)).collect();
                let mut matrix = Envelope::default();
                matrix.reset(&lowest);
                for i in 0..n {
                    (lowest[i]..=i).for_each(|j| matrix.add(i, j, entry(&lowest, i, j)));
                }
                assert!(matrix.factorise());
                let x: Vec<f64> = (0..n).map(|i| 1.0 + (i % 4) as f64).collect();
                let product = |i| (0..n).map(|j| entry(&lowest, i, j) * x[j]).sum();
                let mut rhs: Vec<f64> = (0..n).map(product).collect();
                matrix.solve(&mut rhs);
                assert_eq!(rhs.len(), n);
                for (a, b) in rhs.iter().zip(&x) {
                    assert!((a - b).abs() < 1e-13, "{n} rows, width {width}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn an_indefinite_matrix_and_one_that_is_no_number_are_refused() {
        for bad in [-1.0, 0.0, f64::NAN, f64::INFINITY] {
            let mut matrix = Envelope::default();
            matrix.reset(&[0, 0]);
            matrix.add(0, 0, 1.0);
            matrix.add(1, 1, bad);
            assert!(!matrix.factorise(), "{bad}");
        }
    }
}
