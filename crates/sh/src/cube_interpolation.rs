//! A series on a cube map in less time than the sum at each texel: from the rows of a lat-long image, which
//! fast transforms make, by Lagrange's polynomials through 8 x 8 pixels.
//!
//! Across a pole an image goes on half a turn away; along a row it repeats. A wave of w radians per pixel is
//! off by at most 0.0011 w^8 in each direction. There are at least 3/2 as many rows as degrees, so that w is
//! at most 2.1 and, at the degrees that a prefilter keeps at more than a tenth, below 0.6.

use rayon::prelude::*;
use sphere::{Cube, Face, LatLong};

use crate::{Expansion, Synthesis, TransformError, synthesise_cube};

/// Pixels along each side of the square under a polynomial.
const TAPS: usize = 8;

/// Pixels before the first of a row or column that a polynomial may need.
const MARGIN: usize = TAPS;

/// The highest degree whose texels are summed one by one.
const SUMMED: usize = 40;

/// The values of a series at the centres of a cube's texels: six faces in file order, rows from the top.
///
/// Up to degree 40 they are those of [`synthesise_cube`], whose time grows with edge F^2. Above, the rows of
/// a lat-long image are made by fast transforms, and texels are interpolated between them: for a point light
/// that was convolved with a smooth lobe, within 1e-4 of the largest value (the tests of prefilters compare).
///
/// # Errors
/// [`TransformError::Empty`] if the cube has no texel.
///
/// # Example: a constant sky has one value
/// ```
/// let sky = sh::Expansion::from_coefficients(sh::Degree::ZERO, vec![[3.5449077018110318; 3]]).unwrap();
/// let texels = sh::interpolate_cube(&sky, sphere::Cube { edge: 4 })?;
/// assert!(texels.iter().flatten().all(|value| (value - 1.0).abs() < 1e-6));
/// # Ok::<(), sh::TransformError>(())
/// ```
pub fn interpolate_cube(series: &Expansion, cube: Cube) -> Result<Vec<[f32; 3]>, TransformError> {
    let degree = series.degree();
    if degree.get() <= SUMMED {
        return synthesise_cube(series, cube);
    }
    if cube.is_empty() {
        return Err(TransformError::Empty { columns: 0, rows: 0 });
    }
    let grid = LatLong::with_rows(fast_rows(degree.get() * 3 / 2));
    let rows: Vec<[f32; 3]> = Synthesis::new(grid, degree)?.synthesise(series);
    Ok(interpolate(grid, &rows, cube))
}

/// The least 2^n or 3 2^n that is not below `rows`: rings of this many pixels transform fast.
fn fast_rows(rows: usize) -> usize {
    let power = rows.next_power_of_two();
    if 3 * power / 4 >= rows { 3 * power / 4 } else { power }
}

/// The values at the centres of a cube's texels. The image has an even number of columns and at least
/// [`TAPS`] rows.
fn interpolate(grid: LatLong, pixels: &[[f32; 3]], cube: Cube) -> Vec<[f32; 3]> {
    let image = Padded::new(grid, pixels);
    let edge = cube.edge;
    let mut out = vec![[0.0; 3]; cube.len()];
    out.par_chunks_mut(edge).enumerate().for_each(|(row, texels)| {
        let face = Face::ALL[row / edge];
        for (column, texel) in texels.iter_mut().enumerate() {
            let (x, y) = grid.position(cube.direction(face, row % edge, column));
            *texel = image.at(x, y);
        }
    });
    out
}

/// An image that goes on past its ends by [`MARGIN`] pixels.
struct Padded {
    width: usize,
    values: Vec<f32>,
}

impl Padded {
    fn new(grid: LatLong, pixels: &[[f32; 3]]) -> Self {
        let LatLong { width, height } = grid;
        let padded = width + 2 * MARGIN;
        let mut values = vec![0.0; 3 * padded * (height + 2 * MARGIN)];
        values.par_chunks_mut(3 * padded).enumerate().for_each(|(row, out)| {
            // Rows -1, -2 ... are rows 0, 1 ... half a turn away.
            let (row, turn) = match (row + height - MARGIN) % (2 * height) {
                below if below >= height => (below - height, 0),
                beyond => (height - 1 - beyond, width / 2),
            };
            let source = &pixels[row * width..][..width];
            for (column, out) in out.chunks_exact_mut(3).enumerate() {
                out.copy_from_slice(&source[(column + width - MARGIN % width + turn) % width]);
            }
        });
        Self { width: padded, values }
    }

    /// The value at continuous coordinates; a pixel's centre is at whole numbers.
    fn at(&self, x: f64, y: f64) -> [f32; 3] {
        const BEFORE: usize = TAPS / 2 - 1;
        let (left, top) = (x.floor(), y.floor());
        let (across, down) = (weights(x - left), weights(y - top));
        let first_column = (left as isize + MARGIN as isize) as usize - BEFORE;
        let first_row = (top as isize + MARGIN as isize) as usize - BEFORE;
        let mut columns = [0.0_f32; 3 * TAPS];
        for (row, weight) in down.into_iter().enumerate() {
            let at = 3 * ((first_row + row) * self.width + first_column);
            let values = &self.values[at..][..3 * TAPS];
            columns.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
        }
        let mut sum = [0.0; 3];
        for (rgb, weight) in columns.chunks_exact(3).zip(across) {
            (0..3).for_each(|channel| sum[channel] += weight * rgb[channel]);
        }
        sum
    }
}

/// The Lagrange weights of the pixels -3 ..= 4 at t in [0, 1].
fn weights(t: f64) -> [f32; TAPS] {
    /// The product over the other nodes of (node - other).
    const SCALE: [f64; TAPS] = [-5040.0, 720.0, -240.0, 144.0, -144.0, 240.0, -720.0, 5040.0];
    let offsets: [f64; TAPS] = std::array::from_fn(|node| t + 3.0 - node as f64);
    // Products of all offsets before and after each node.
    let mut result = [1.0; TAPS];
    let (mut before, mut after) = (1.0, 1.0);
    for node in 0..TAPS {
        result[node] *= before;
        before *= offsets[node];
        let mirrored = TAPS - 1 - node;
        result[mirrored] *= after;
        after *= offsets[mirrored];
    }
    std::array::from_fn(|node| (result[node] / SCALE[node]) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_fast_transforms() {
        assert_eq!([5, 6, 7, 8, 9, 12, 13, 892].map(fast_rows), [6, 6, 8, 8, 12, 12, 16, 1024]);
    }

    /// Polynomials of degree 7 pass through their nodes: sums of weights times powers are powers.
    #[test]
    fn polynomials_of_degree_7_are_reproduced() {
        for t in [0.0, 0.3, 0.5, 0.99, 1.0] {
            for power in 0..TAPS as i32 {
                let sum: f64 = weights(t)
                    .iter()
                    .enumerate()
                    .map(|(node, weight)| f64::from(*weight) * (node as f64 - 3.0).powi(power))
                    .sum();
                // Weights are f32, and the largest node to the 7th power is 16384.
                assert!((sum - t.powi(power)).abs() < 1e-3, "{t}^{power}: {sum}");
            }
        }
    }

    /// z, x and y at the poles, the seam and everywhere else.
    #[test]
    fn a_linear_function_passes_over_poles_and_seam() {
        let grid = LatLong::with_rows(32);
        let value = |direction: sphere::Direction| direction.vector().as_vec3().to_array();
        let pixels: Vec<_> = (0..grid.len())
            .map(|index| value(grid.direction(index / grid.width, index % grid.width)))
            .collect();
        for cube in [Cube { edge: 1 }, Cube { edge: 2 }, Cube { edge: 33 }] {
            let found = interpolate(grid, &pixels, cube);
            for (index, found) in found.into_iter().enumerate() {
                let (row, column) = (index / cube.edge, index % cube.edge);
                let direction = cube.direction(Face::ALL[row / cube.edge], row % cube.edge, column);
                let expected = value(direction);
                (0..3).for_each(|axis| assert!((found[axis] - expected[axis]).abs() < 1e-6, "{direction:?}"));
            }
        }
    }
}
