//! Haar wavelets of values on a grid of cells of any size, orthonormal over the area that the cells have.
//!
//! Each step takes cells two by two, in both directions, and turns their values into one for the four and
//! three differences (the non-standard decomposition); what has no partner goes on alone. A value v in a
//! cell of area a is the coefficient sqrt(a) v of the function that is 1 / sqrt(a) there. Two neighbours of
//! areas a and b, with the coefficients u and v, are replaced by their whole c u + s v and their difference
//! s u - c v, where c = sqrt(a / (a + b)) and s = sqrt(b / (a + b)). With equal areas these are the common
//! wavelets; with those of the texels of a lat-long image, the wavelets are orthonormal on the sphere.
//!
//! All is done in place: the wavelet at (row, column) came of the step whose stride is the largest power of
//! two that divides both.

use rayon::prelude::*;

/// Raised when the coefficients, or which of them are the largest, change: every kind of stage that writes
/// some adds this to its own revision.
pub const REVISION: u32 = 1;

/// The coefficients of values on a grid of cells in Haar wavelets, for N channels.
///
/// Each wavelet but the first has the mean 0. So whatever wavelets are dropped, the integral stays as long
/// as the first is kept, and the squared error, integrated over the area, is the sum of the squares of what
/// was dropped.
///
/// # Example: half of a picture is brighter
/// ```
/// use sampling::Haar;
///
/// let mut haar = Haar::new(&[1.0, 1.0], &[1.0, 1.0], vec![[3.0], [1.0], [3.0], [1.0]]);
/// let largest = haar.by_size();
/// assert!(haar.error_without(&largest[2..]) < 1e-6);
/// haar.keep(&largest[..2]);
/// assert!((haar.values()[0][0] - 3.0).abs() < 1e-6 && (haar.values()[1][0] - 1.0).abs() < 1e-6);
/// ```
#[derive(Clone, Debug)]
pub struct Haar<const N: usize> {
    heights: Vec<f64>,
    widths: Vec<f64>,
    coefficients: Vec<[f32; N]>,
}

impl<const N: usize> Haar<N> {
    /// The wavelets of values that are given row by row. The area of a cell is the height of its row times
    /// the width of its column.
    ///
    /// # Panics
    /// If there are not as many values as cells, there is none, or a height or a width is not positive.
    pub fn new(heights: &[f64], widths: &[f64], values: Vec<[f32; N]>) -> Self {
        assert!(!values.is_empty() && values.len() == heights.len() * widths.len(), "a value for each cell");
        assert!(heights.iter().chain(widths).all(|side| *side > 0.0), "cells have an area");
        let mut haar = Self { heights: heights.to_vec(), widths: widths.to_vec(), coefficients: values };
        haar.scale(f64::sqrt);
        for (stride, turns) in haar.steps().iter().enumerate().map(|(step, turns)| (1 << step, turns)) {
            haar.turn_columns(stride, &turns[1]);
            haar.turn_rows(stride, &turns[0]);
        }
        haar
    }

    /// The values, row by row.
    pub fn values(&self) -> Vec<[f32; N]> {
        let mut haar = self.clone();
        for (stride, turns) in haar.steps().iter().enumerate().map(|(step, turns)| (1 << step, turns)).rev() {
            haar.turn_rows(stride, &turns[0]);
            haar.turn_columns(stride, &turns[1]);
        }
        haar.scale(|area| area.sqrt().recip());
        haar.coefficients
    }

    /// The coefficients, row by row.
    pub fn coefficients(&self) -> &[[f32; N]] {
        &self.coefficients
    }

    /// The number of a coefficient in the usual layout, in which the wavelets of each step are together: the
    /// wholes of a step in the upper left part, then, at the same places of the parts to the right, below
    /// and both, the differences between columns, rows and both.
    pub fn in_blocks(&self, index: usize) -> usize {
        let (rows, columns) = (self.heights.len(), self.widths.len());
        let (row, column) = (index / columns, index % columns);
        if index == 0 {
            return 0;
        }
        let step = (row | column).trailing_zeros();
        let place = |at: usize, count: usize| {
            let (at, count) = (at >> step, count.div_ceil(1 << step));
            at / 2 + at % 2 * count.div_ceil(2)
        };
        place(row, rows) * columns + place(column, columns)
    }

    /// The numbers of all coefficients: that of the mean, then by the sums of squares over the channels, the
    /// largest first; of equal ones the earlier comes first.
    pub fn by_size(&self) -> Vec<u32> {
        let sizes = self.coefficients.par_iter().map(square);
        let mut sizes: Vec<(u32, f64)> =
            (0..self.coefficients.len() as u32).into_par_iter().zip(sizes).collect();
        sizes[1..].par_sort_unstable_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        sizes.into_iter().map(|(index, _)| index).collect()
    }

    /// The root mean square of the error if these coefficients are dropped, relative to that of the values;
    /// 0 if the values are 0. The numbers are in the order of [`Haar::by_size`].
    pub fn error_without(&self, dropped: &[u32]) -> f64 {
        let whole = self.energy();
        let rest: f64 = dropped.iter().rev().map(|index| square(&self.coefficients[*index as usize])).sum();
        if whole > 0.0 { (rest / whole).sqrt() } else { 0.0 }
    }

    /// How many of the coefficients, in the order of [`Haar::by_size`], leave an error of at most
    /// `tolerance`, as by [`Haar::error_without`]. At least 1.
    pub fn needed(&self, order: &[u32], tolerance: f64) -> usize {
        let most = tolerance * tolerance * self.energy();
        let mut rest = 0.0;
        let dropped = order.iter().rev().take_while(|index| {
            rest += square(&self.coefficients[**index as usize]);
            rest <= most
        });
        (order.len() - dropped.count()).max(1)
    }

    /// Drops all coefficients but these.
    pub fn keep(&mut self, kept: &[u32]) {
        let mut few = vec![[0.0; N]; self.coefficients.len()];
        for index in kept {
            few[*index as usize] = self.coefficients[*index as usize];
        }
        self.coefficients = few;
    }

    fn energy(&self) -> f64 {
        self.coefficients.iter().map(square).sum()
    }

    /// Multiplies each value by a function of its cell's area.
    fn scale(&mut self, factor: impl Fn(f64) -> f64 + Sync) {
        let rows = self.coefficients.par_chunks_mut(self.widths.len()).zip(&self.heights);
        rows.for_each(|(row, height)| {
            for (value, width) in row.iter_mut().zip(&self.widths) {
                let factor = factor(height * width);
                *value = value.map(|channel| (f64::from(channel) * factor) as f32);
            }
        });
    }

    /// The turns of each step, of rows and of columns.
    fn steps(&self) -> Vec<[Vec<Turn>; 2]> {
        let mut sides = [self.heights.clone(), self.widths.clone()];
        let mut steps = Vec::new();
        while sides.iter().any(|side| side.len() > 1) {
            let step = sides.each_ref().map(|side| side.as_chunks::<2>().0.iter().map(turn).collect());
            steps.push(step);
            sides = sides.map(|side| side.chunks(2).map(|pair| pair.iter().sum()).collect());
        }
        steps
    }

    fn turn_columns(&mut self, stride: usize, turns: &[Turn]) {
        self.coefficients.par_chunks_mut(stride * self.widths.len()).for_each(|rows| {
            for (pair, turn) in turns.iter().enumerate() {
                let first = 2 * pair * stride;
                let (left, right) = rows.split_at_mut(first + stride);
                turned(&mut left[first], &mut right[0], *turn);
            }
        });
    }

    fn turn_rows(&mut self, stride: usize, turns: &[Turn]) {
        let columns = self.widths.len();
        let pairs = self.coefficients.par_chunks_mut(2 * stride * columns).zip(turns);
        pairs.for_each(|(rows, turn)| {
            let (upper, lower) = rows.split_at_mut(stride * columns);
            let columns = upper[..columns].iter_mut().zip(lower).step_by(stride);
            columns.for_each(|(upper, lower)| turned(upper, lower, *turn));
        });
    }
}

/// The numbers c and s by which two neighbouring cells are replaced by their whole and their difference.
type Turn = [f64; 2];

/// The numbers c and s of two cells with the areas a and b.
fn turn([a, b]: &[f64; 2]) -> Turn {
    [(a / (a + b)).sqrt(), (b / (a + b)).sqrt()]
}

/// Turns the coefficients of two cells into those of their whole and their difference. It is its own inverse.
fn turned<const N: usize>(a: &mut [f32; N], b: &mut [f32; N], [cosine, sine]: Turn) {
    for (a, b) in a.iter_mut().zip(b) {
        let (u, v) = (f64::from(*a), f64::from(*b));
        (*a, *b) = ((cosine * u + sine * v) as f32, (sine * u - cosine * v) as f32);
    }
}

fn square<const N: usize>(coefficient: &[f32; N]) -> f64 {
    coefficient.iter().map(|value| f64::from(*value) * f64::from(*value)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sides of cells, none like the next.
    fn sides(count: usize, seed: f64) -> Vec<f64> {
        (0..count).map(|i| 1.2 + (seed + 3.0 * i as f64).sin()).collect()
    }

    /// Heights, widths and values.
    type Grid = (Vec<f64>, Vec<f64>, Vec<[f32; 2]>);

    fn grids() -> Vec<Grid> {
        let sizes = [(1, 1), (1, 2), (4, 1), (4, 8), (16, 32), (8, 2), (5, 7), (37, 74), (6, 1)];
        let grid = |(rows, columns): (usize, usize)| {
            let value = |i: usize| [(7.0 * i as f32).sin(), (0.1 * i as f32).cos() + 2.0];
            (sides(rows, 0.1), sides(columns, 2.0), (0..rows * columns).map(value).collect())
        };
        sizes.map(grid).into()
    }

    /// The integral of the squared difference, by its definition.
    fn squared(heights: &[f64], widths: &[f64], a: &[[f32; 2]], b: &[[f32; 2]]) -> f64 {
        let cell = |(i, (a, b)): (usize, (&[f32; 2], &[f32; 2]))| {
            let area = heights[i / widths.len()] * widths[i % widths.len()];
            area * (0..2).map(|c| f64::from(a[c] - b[c]).powi(2)).sum::<f64>()
        };
        a.iter().zip(b).enumerate().map(cell).sum()
    }

    #[test]
    fn all_wavelets_return_the_values_and_the_first_is_their_mean() {
        for (heights, widths, values) in grids() {
            let haar = Haar::new(&heights, &widths, values.clone());
            for (a, b) in haar.values().as_flattened().iter().zip(values.as_flattened()) {
                assert!((a - b).abs() < 3e-6, "{} x {}: {a}, {b}", heights.len(), widths.len());
            }
            let area: f64 = heights.iter().sum::<f64>() * widths.iter().sum::<f64>();
            let cell = |(i, v): (usize, &[f32; 2])| {
                heights[i / widths.len()] * widths[i % widths.len()] * f64::from(v[1])
            };
            let integral: f64 = values.iter().enumerate().map(cell).sum();
            assert!((f64::from(haar.coefficients()[0][1]) * area.sqrt() / integral - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn what_is_dropped_is_the_error() {
        for (heights, widths, values) in grids() {
            let haar = Haar::new(&heights, &widths, values.clone());
            let order = haar.by_size();
            assert_eq!(order[0], 0);
            let whole = squared(&heights, &widths, &values, &vec![[0.0; 2]; values.len()]);
            for count in [1, values.len().div_ceil(3), values.len()] {
                let mut few = haar.clone();
                few.keep(&order[..count]);
                let found = squared(&heights, &widths, &values, &few.values());
                let told = haar.error_without(&order[count..]);
                assert!((told * told * whole - found).abs() < 1e-5 * whole, "{count}: {told}");
                // As many are needed for just this error.
                let needed = haar.needed(&order, told * (1.0 + 1e-9));
                assert!(needed == count || haar.error_without(&order[needed..]) >= told * (1.0 - 1e-9));
            }
            let sizes: Vec<f64> =
                order[1..].iter().map(|i| square(&haar.coefficients()[*i as usize])).collect();
            assert!(sizes.is_sorted_by(|a, b| a >= b));
        }
    }

    /// Against the wavelets of a row and a column of four, written out.
    #[test]
    fn equal_areas_have_the_common_wavelets() {
        let values: Vec<[f32; 1]> = [9.0, 7.0, 3.0, 5.0].map(|value| [value]).into();
        let root = 0.5f32.sqrt();
        let expected = [12.0, 2.0 * root, 4.0, -2.0 * root];
        for (heights, widths) in [(vec![1.0], vec![1.0; 4]), (vec![1.0; 4], vec![1.0])] {
            let haar = Haar::new(&heights, &widths, values.clone());
            for (found, expected) in haar.coefficients().iter().zip(expected) {
                assert!((found[0] - expected).abs() < 1e-5, "{found:?} {expected}");
            }
            let places = [0, 1, 2, 3].map(|index| haar.in_blocks(index));
            assert_eq!(places, [0, 2, 1, 3], "whole, coarse difference, then the two fine ones");
        }
        // 2 x 2 cells have four wavelets: the whole, and the differences of columns, of rows and of both.
        let values: Vec<[f32; 1]> = [9.0, 7.0, 3.0, 5.0].map(|value| [value]).into();
        let haar = Haar::new(&[1.0; 2], &[1.0; 2], values);
        let found: Vec<f32> = haar.coefficients().iter().map(|value| value[0]).collect();
        for (found, expected) in found.iter().zip([12.0, 0.0, 4.0, 2.0]) {
            assert!((found - expected).abs() < 1e-5, "{found} {expected}");
        }
    }

    #[test]
    fn blocks_hold_each_coefficient_once() {
        for (heights, widths, values) in grids() {
            let haar = Haar::new(&heights, &widths, values);
            let mut places: Vec<usize> =
                (0..heights.len() * widths.len()).map(|i| haar.in_blocks(i)).collect();
            places.sort_unstable();
            assert!(places.into_iter().eq(0..heights.len() * widths.len()));
        }
    }
}
