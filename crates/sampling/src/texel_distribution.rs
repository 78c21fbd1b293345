//! The distribution of pieces in each leaf: a row of pieces first, then a piece in it.
//!
//! Running sums stand in blocks that end with their total, repeated up to whole vectors: the entries that
//! are not above u times the total are counted, and there are never more than pieces. Each block's sums
//! begin at 0, so that a dim texel in a leaf is told as precisely as a bright one elsewhere.

use rayon::prelude::*;

use crate::LeafGrid;
use crate::cell_distribution::BELOW_ONE;
use crate::f32x8::LANES;
use crate::pieces::Pieces;

/// Running sums of the pieces of each leaf.
#[derive(Clone)]
pub(crate) struct TexelDistribution {
    leaf_columns: usize,
    /// The first row of pieces of each row of leaves, where its blocks begin, and how long they are.
    leaf_rows: Vec<LeafRow>,
    /// The first column of pieces of each column of leaves.
    first_columns: Vec<u32>,
    /// The running sums over the rows of pieces of each leaf.
    rows: Vec<f32>,
    /// The running sums over the columns of pieces in a leaf, by row of pieces, then column of leaves.
    columns: Vec<f32>,
    width: usize,
}

#[derive(Clone, Copy)]
struct LeafRow {
    first: usize,
    start: usize,
    length: usize,
}

/// A piece that was drawn in its leaf.
#[derive(Clone, Copy, Default)]
pub(crate) struct DrawnPiece {
    pub(crate) row: usize,
    pub(crate) column: usize,
    /// The remainders of the two uniforms, in [0, 1).
    pub(crate) rest: [f32; 2],
    /// The probability of the piece, given the leaf.
    pub(crate) probability: f32,
}

impl TexelDistribution {
    /// The distribution with these masses: `masses(row, output)` writes those of a row of pieces.
    pub(crate) fn new(pieces: &Pieces, leaves: LeafGrid, masses: impl Fn(usize, &mut [f32]) + Sync) -> Self {
        let firsts = |leaves: usize, leaf: &dyn Fn(usize) -> usize, count: usize| {
            let mut firsts = vec![0; leaves + 1];
            (0..count).for_each(|piece| firsts[leaf(piece) + 1] = piece + 1);
            firsts
        };
        let row_firsts = firsts(leaves.rows(), &|k| pieces.rows[k].leaf, pieces.rows.len());
        let column_firsts = firsts(leaves.columns(), &|k| pieces.columns[k].leaf, pieces.columns.len());
        let padded = |pair: &[usize]| (pair[1] - pair[0]).next_multiple_of(LANES);
        let width = column_firsts.windows(2).map(padded).max().unwrap_or(LANES);
        let leaf_columns = leaves.columns();
        let mut columns = vec![0.0; pieces.rows.len() * leaf_columns * width];
        columns.par_chunks_mut(leaf_columns * width).enumerate().for_each(|(row, blocks)| {
            let mut row_masses = vec![0.0; pieces.columns.len()];
            masses(row, &mut row_masses);
            for (block, pair) in blocks.chunks_exact_mut(width).zip(column_firsts.windows(2)) {
                add_up(row_masses[pair[0]..pair[1]].iter().copied(), block);
            }
        });
        let (mut leaf_rows, mut rows) = (Vec::new(), Vec::new());
        for pair in row_firsts.windows(2) {
            let (start, length) = (rows.len(), padded(pair));
            leaf_rows.push(LeafRow { first: pair[0], start, length });
            rows.resize(start + leaf_columns * length, 0.0);
            for (column, block) in rows[start..].chunks_exact_mut(length).enumerate() {
                let total = |row: usize| columns[(row * leaf_columns + column + 1) * width - 1];
                add_up((pair[0]..pair[1]).map(total), block);
            }
        }
        let first_columns = column_firsts.iter().map(|&first| first as u32).collect();
        Self { leaf_columns, leaf_rows, first_columns, rows, columns, width }
    }

    #[inline(always)]
    pub(crate) fn mass(&self, row: usize, column: usize) -> f32 {
        let LeafRow { start, length, .. } = self.leaf_rows[row];
        self.rows[start + (column + 1) * length - 1]
    }

    /// The piece of two uniforms below 1 in a leaf that has mass.
    #[inline(always)]
    pub(crate) fn draw(&self, row: usize, column: usize, u: [f32; 2]) -> DrawnPiece {
        let LeafRow { first, start, length } = self.leaf_rows[row];
        let (down, rest_t, share_t) = search(&self.rows[start + column * length..][..length], u[0]);
        let piece_row = first + down;
        let (right, rest_s, share_s) = search(self.block(piece_row, column), u[1]);
        DrawnPiece {
            row: piece_row,
            column: self.first_columns[column] as usize + right,
            rest: [rest_t, rest_s],
            probability: share_t * share_s,
        }
    }

    pub(crate) fn probability(&self, leaf: [usize; 2], piece: [usize; 2]) -> f32 {
        let [(_, share_t), (_, share_s)] = self.intervals(leaf, piece);
        if share_t > 0.0 { share_t * share_s } else { 0.0 }
    }

    /// The uniforms that lead to a place in a piece of a leaf.
    pub(crate) fn invert(&self, leaf: [usize; 2], piece: [usize; 2], rest: [f32; 2]) -> [f32; 2] {
        let [rows, columns] = self.intervals(leaf, piece);
        let invert = |(lower, share): (f32, f32), rest: f32| (lower + share * rest).clamp(0.0, BELOW_ONE);
        [invert(rows, rest[0]), invert(columns, rest[1])]
    }

    fn intervals(&self, leaf: [usize; 2], piece: [usize; 2]) -> [(f32, f32); 2] {
        let LeafRow { first, start, length } = self.leaf_rows[leaf[0]];
        let rows = &self.rows[start + leaf[1] * length..][..length];
        let right = piece[1] - self.first_columns[leaf[1]] as usize;
        [interval(rows, piece[0] - first), interval(self.block(piece[0], leaf[1]), right)]
    }

    #[inline(always)]
    fn block(&self, row: usize, leaf_column: usize) -> &[f32] {
        &self.columns[(row * self.leaf_columns + leaf_column) * self.width..][..self.width]
    }
}

/// Writes running sums, the last repeated to the end of the block.
fn add_up(masses: impl Iterator<Item = f32>, block: &mut [f32]) {
    let mut sum = 0.0;
    let mut sums = masses.map(|mass| {
        sum += mass;
        sum
    });
    let mut last = 0.0;
    for entry in block {
        last = sums.next().unwrap_or(last);
        *entry = last;
    }
}

/// Finds the piece of a uniform below 1; returns it, the remainder of the uniform, and the piece's share.
#[inline(always)]
fn search(sums: &[f32], u: f32) -> (usize, f32, f32) {
    let total = sums[sums.len() - 1];
    // Below the total: u is at least half a unit of rounding below 1.
    let v = u * total;
    let mut counts = [0u32; LANES];
    for sums in sums.chunks_exact(LANES) {
        for k in 0..LANES {
            counts[k] += u32::from(sums[k] <= v);
        }
    }
    let index = (counts.iter().sum::<u32>() as usize).min(sums.len() - 1);
    let lower = if index > 0 { sums[index - 1] } else { 0.0 };
    let width = sums[index] - lower;
    (index, ((v - lower) / width).clamp(0.0, BELOW_ONE), width / total)
}

/// Where a piece begins and how long it is, as shares of all.
fn interval(sums: &[f32], index: usize) -> (f32, f32) {
    let total = sums[sums.len() - 1];
    let lower = if index > 0 { sums[index - 1] } else { 0.0 };
    if total > 0.0 { (lower / total, (sums[index] - lower) / total) } else { (0.0, 0.0) }
}
