//! Rectangles of equal flux.

use std::f64::consts::{PI, TAU};
use std::num::NonZeroU32;
use std::ops::Range;

use super::{LightMasses, Region};

/// Texels in a rectangle, whose border has light on every side.
struct Rectangle {
    rows: Range<usize>,
    columns: Range<usize>,
    flux: f64,
    /// The place at which the rectangle is to be cut; `None` if it is one texel.
    cut: Option<Cut>,
}

/// The row or the column before which a rectangle is cut.
enum Cut {
    Row(usize),
    Column(usize),
}

/// The light of at most `count` rectangles. Every lit texel is in one of them.
pub(super) fn regions(masses: &LightMasses, count: NonZeroU32) -> Vec<Region> {
    let grid = masses.grid();
    let mut rectangles: Vec<Rectangle> =
        Rectangle::new(masses, 0..grid.height, 0..grid.width).into_iter().collect();
    while rectangles.len() < count.get() as usize {
        let divisible = rectangles.iter().enumerate().filter(|(_, rectangle)| rectangle.cut.is_some());
        // Of equal ones the last.
        let Some((index, _)) = divisible.max_by(|a, b| a.1.flux.total_cmp(&b.1.flux)) else { break };
        let Rectangle { rows, columns, cut, .. } = rectangles.swap_remove(index);
        let [first, second] = match cut {
            Some(Cut::Row(at)) => [(rows.start..at, columns.clone()), (at..rows.end, columns)],
            Some(Cut::Column(at)) => [(rows.clone(), columns.start..at), (rows, at..columns.end)],
            None => break,
        };
        for (rows, columns) in [first, second] {
            rectangles.extend(Rectangle::new(masses, rows, columns));
        }
    }
    let sum = |rectangle: &Rectangle| {
        let mut region = Region::default();
        for row in rectangle.rows.clone() {
            rectangle.columns.clone().for_each(|column| region.add(masses, row * grid.width + column));
        }
        region
    };
    rectangles.iter().map(sum).collect()
}

impl Rectangle {
    /// The lit part of a rectangle; `None` if it is dark.
    fn new(masses: &LightMasses, rows: Range<usize>, columns: Range<usize>) -> Option<Self> {
        let grid = masses.grid();
        let (mut by_row, mut by_column) = (vec![0.0; rows.len()], vec![0.0; columns.len()]);
        for (row, sum) in rows.clone().zip(&mut by_row) {
            for (column, of_column) in columns.clone().zip(&mut by_column) {
                let weight = masses.weight(row * grid.width + column);
                *sum += weight;
                *of_column += weight;
            }
        }
        let lit = |sums: &[f64]| {
            let first = sums.iter().position(|sum| *sum > 0.0)?;
            let last = sums.iter().rposition(|sum| *sum > 0.0)?;
            Some(first..last + 1)
        };
        let (lit_rows, lit_columns) = (lit(&by_row)?, lit(&by_column)?);
        let middle =
            PI * (rows.start as f64 + (lit_rows.start + lit_rows.end) as f64 / 2.0) / grid.height as f64;
        let height = lit_rows.len() as f64 * PI / grid.height as f64;
        let width = lit_columns.len() as f64 * TAU / grid.width as f64 * math::sin(middle);
        let across_columns = lit_rows.len() == 1 || (lit_columns.len() > 1 && width >= height);
        let cut = match across_columns {
            _ if lit_rows.len() == 1 && lit_columns.len() == 1 => None,
            true => {
                Some(Cut::Column(columns.start + lit_columns.start + median(&by_column[lit_columns.clone()])))
            }
            false => Some(Cut::Row(rows.start + lit_rows.start + median(&by_row[lit_rows.clone()]))),
        };
        let shift = |range: Range<usize>, by: usize| range.start + by..range.end + by;
        Some(Self {
            flux: by_row.iter().sum(),
            rows: shift(lit_rows, rows.start),
            columns: shift(lit_columns, columns.start),
            cut,
        })
    }
}

/// The number of elements, at least one and not all, whose sum is nearest to half of the whole.
fn median(sums: &[f64]) -> usize {
    let half = sums.iter().sum::<f64>() / 2.0;
    let (mut before, mut best) = (0.0, (f64::INFINITY, 1));
    for (index, sum) in sums[..sums.len() - 1].iter().enumerate() {
        before += sum;
        let off = f64::abs(before - half);
        if off < best.0 {
            best = (off, index + 1);
        }
    }
    best.1
}
