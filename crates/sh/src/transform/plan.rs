//! What analysis and synthesis on one grid share.

use super::fourier::{Fourier, FourierScratch};
use super::grid::Grid;
use super::precision::{ForEachPrecision, PerPrecision, Precision};
use super::spare::Spare;
use super::sums::{self, Group, Rows};
use crate::f64x4::SimdLevel;
use crate::vector::Vector8;

/// Why a grid cannot carry a transform.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TransformError {
    /// The grid has no pixel.
    #[error("a grid of {columns} columns and {rows} rows has no pixel")]
    Empty {
        /// The number of columns of the grid.
        columns: usize,
        /// The number of rows of the grid.
        rows: usize,
    },
    /// Too few columns to distinguish the cosines and sines of every order.
    #[error("{columns} columns are too few for degree {degree}: at least {} are needed", 2 * degree + 1)]
    TooFewColumns {
        /// The number of columns of the grid.
        columns: usize,
        /// The requested degree.
        degree: usize,
    },
    /// Too few rows to distinguish the degrees.
    #[error("{rows} rows are too few for degree {degree}: at least {} are needed", degree + 1)]
    TooFewRows {
        /// The number of rows of the grid.
        rows: usize,
        /// The requested degree.
        degree: usize,
    },
}

/// The plan that analysis and synthesis share: sizes, tables and spare memory.
pub struct TransformPlan {
    pub(super) grid: Grid,
    pub(super) degree: usize,
    pub(super) level: SimdLevel,
    pub(super) rows: Rows,
    along_rows: ForEachPrecision<AlongRowsOf>,
}

/// What works along the rows, in the precision of the pixels.
pub(super) struct AlongRows<T: Precision> {
    pub(super) fourier: Fourier<T>,
    pub(super) fourier_scratch: Spare<FourierScratch<T>>,
    workspaces: Spare<Workspace<T>>,
}

struct AlongRowsOf;

impl PerPrecision for AlongRowsOf {
    type Of<T: Precision> = AlongRows<T>;
}

/// The memory of one analysis or synthesis.
#[derive(Default)]
pub(super) struct Workspace<T: Precision> {
    /// Fourier coefficients along the rows: one group for each m and each eight pairs of rows.
    pub(super) groups: Vec<Group<T>>,
    /// Coefficients by rising m, then l: (cosine, sine) of each channel.
    pub(super) orders: Vec<[f64; 6]>,
}

impl TransformPlan {
    pub(super) fn new(level: SimdLevel, grid: Grid, degree: usize) -> Self {
        let northern: Vec<(f64, f64)> =
            (0..grid.height().div_ceil(2)).map(|row| grid.cosine_sine(row)).collect();
        let rows = Rows::new(&northern, degree);
        Self { degree, level, rows, along_rows: ForEachPrecision::new(), grid }
    }

    pub(super) fn along_rows<T: Precision>(&self) -> &AlongRows<T> {
        self.along_rows.get(|| AlongRows {
            fourier: Fourier::new(self.level, self.grid.width(), self.grid.height(), self.degree),
            fourier_scratch: Spare::default(),
            workspaces: Spare::default(),
        })
    }

    /// Runs `work` with memory of this plan's size; what it holds on entry is arbitrary.
    pub(super) fn with_workspace<T: Precision, R>(&self, work: impl FnOnce(&mut Workspace<T>) -> R) -> R {
        let mut workspace = self.along_rows::<T>().workspaces.take();
        let orders = self.degree + 1;
        workspace.groups.resize(orders * self.rows.groups(), [Vector8::ZERO; sums::PARTS]);
        workspace.orders.resize(orders * (orders + 1) / 2, [0.0; 6]);
        work(&mut workspace)
    }
}

/// The orders m up to `degree`, `count` by `count`.
pub(super) fn blocks_of_orders(degree: usize, count: usize) -> Vec<std::ops::Range<usize>> {
    (0..=degree).step_by(count).map(|m| m..(m + count).min(degree + 1)).collect()
}

/// Cuts a slice into consecutive parts of the given lengths.
pub(super) fn split<T>(mut slice: &mut [T], lengths: impl Iterator<Item = usize>) -> Vec<&mut [T]> {
    lengths
        .map(|length| {
            let (part, rest) = std::mem::take(&mut slice).split_at_mut(length);
            slice = rest;
            part
        })
        .collect()
}
