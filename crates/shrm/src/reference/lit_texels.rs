//! The texels of an environment that hold light, in the order and the numbers that the sums read.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use envmap::Environment;
use sphere::{DVec3, LatLong};

/// Dark texels after each row, so that a vector may reach past its end. No vector of a supported CPU is
/// longer.
const PAD: usize = 16;

/// Where a row of texels lies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) cos_theta: f64,
    pub(super) sin_theta: f64,
    /// The exact solid angle of each texel of the row.
    solid_angle: f64,
}

/// The lit texels, row by row, each row followed by [`PAD`] dark ones.
#[derive(Debug)]
pub(super) struct LitTexels {
    grid: LatLong,
    rows: Vec<Row>,
    /// For each row and column, and past the last: the first lit texel there or right of there, [height,
    /// width + 1].
    first: Vec<u32>,
    /// The radiance of each lit texel, as the image has it.
    radiance: Vec<[f32; 3]>,
    /// The cosine and sine of each lit texel's azimuth.
    azimuth: Vec<[f64; 2]>,
    /// The cosine of each texel's azimuth, for vectors, as are `sine` and `rgb`, radiance times solid angle.
    pub(super) cosine: Vec<f32>,
    pub(super) sine: Vec<f32>,
    pub(super) rgb: [Vec<f32>; 3],
}

/// The texels of a row within a cap.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub(super) row: usize,
    /// Half the width of the span, in columns.
    half: f64,
}

impl LitTexels {
    pub(super) fn new(environment: &Environment) -> Self {
        let grid = environment.grid();
        let rows = (0..grid.height).map(|row| {
            let (sin_theta, cos_theta) = math::sin_cos(grid.theta(row));
            Row { cos_theta, sin_theta, solid_angle: grid.solid_angle(row) }
        });
        let mut texels = Self {
            grid,
            rows: rows.collect(),
            first: Vec::with_capacity((grid.width + 1) * grid.height),
            radiance: Vec::new(),
            azimuth: Vec::new(),
            cosine: Vec::new(),
            sine: Vec::new(),
            rgb: Default::default(),
        };
        let columns: Vec<[f64; 2]> = (0..grid.width)
            .map(|column| {
                let (sine, cosine) = math::sin_cos(grid.phi(column));
                [cosine, sine]
            })
            .collect();
        for (row, pixels) in environment.pixels().chunks_exact(grid.width).enumerate() {
            for (pixel, azimuth) in pixels.iter().zip(&columns) {
                texels.first.push(texels.radiance.len() as u32);
                if *pixel != [0.0; 3] {
                    texels.push(row, *pixel, *azimuth);
                }
            }
            texels.first.push(texels.radiance.len() as u32);
            for _ in 0..PAD {
                texels.push(row, [0.0; 3], [1.0, 0.0]);
            }
        }
        texels
    }

    fn push(&mut self, row: usize, pixel: [f32; 3], azimuth: [f64; 2]) {
        self.radiance.push(pixel);
        self.azimuth.push(azimuth);
        self.cosine.push(azimuth[0] as f32);
        self.sine.push(azimuth[1] as f32);
        for (channel, value) in self.rgb.iter_mut().zip(pixel) {
            channel.push((f64::from(value) * self.rows[row].solid_angle) as f32);
        }
    }

    pub(super) fn row(&self, row: usize) -> Row {
        self.rows[row]
    }

    /// The number of lit texels.
    pub(super) fn lit(&self) -> usize {
        self.radiance.len() - PAD * self.grid.height
    }

    /// The direction of a texel of a row, and its radiance times its solid angle.
    pub(super) fn texel(&self, row: usize, index: usize) -> (DVec3, [f64; 3]) {
        let Row { cos_theta, sin_theta, solid_angle } = self.rows[row];
        let [cosine, sine] = self.azimuth[index];
        let weighted = self.radiance[index].map(|value| f64::from(value) * solid_angle);
        (DVec3::new(sin_theta * cosine, sin_theta * sine, cos_theta), weighted)
    }

    /// Every row, whole.
    pub(super) fn whole(&self) -> Vec<Span> {
        (0..self.grid.height).map(|row| Span { row, half: f64::INFINITY }).collect()
    }

    /// The texels whose centres lie within a cap about colatitude `alpha`, by row.
    ///
    /// A texel at (theta, phi) is in it if cos(alpha) cos(theta) + sin(alpha) sin(theta) cos(phi - beta) is
    /// at least `cosine`; solved for phi.
    pub(super) fn within(&self, alpha: f64, cosine: f64) -> Vec<Span> {
        let (sin_alpha, cos_alpha) = math::sin_cos(alpha);
        let columns_per_radian = self.grid.width as f64 / TAU;
        let in_row = |(row, at): (usize, &Row)| {
            let (needed, reach) = (cosine - cos_alpha * at.cos_theta, sin_alpha * at.sin_theta);
            if needed <= -reach {
                Some(Span { row, half: f64::INFINITY })
            } else if needed <= reach {
                Some(Span { row, half: math::acos(needed / reach) * columns_per_radian })
            } else {
                None
            }
        };
        let radius = math::acos(cosine.clamp(-1.0, 1.0));
        let rows_per_radian = self.grid.height as f64 / PI;
        // A row more at both ends, because these bounds round.
        let first = ((alpha - radius) * rows_per_radian - 1.5).max(0.0) as usize;
        let last = (((alpha + radius) * rows_per_radian + 1.5) as usize).min(self.grid.height);
        self.rows.iter().enumerate().take(last).skip(first).filter_map(in_row).collect()
    }

    /// The column coordinate of an azimuth.
    pub(super) fn column(&self, phi: f64) -> f64 {
        (0.5 - phi / TAU) * self.grid.width as f64 - 0.5
    }

    /// The lit texels of a span about a column coordinate: two ranges, of which the first may be read
    /// `beyond` texels past its end without meeting the second (a row in which it would is read whole), up to
    /// [`PAD`].
    #[inline(always)]
    pub(super) fn segments(&self, span: Span, column: f64, beyond: usize) -> [Range<usize>; 2] {
        debug_assert!(beyond <= PAD);
        let width = self.grid.width;
        let first = &self.first[span.row * (width + 1)..][..=width];
        let lit = |from: usize, to: usize| first[from] as usize..first[to] as usize;
        let whole = [lit(0, width), 0..0];
        if 2.0 * span.half >= width as f64 {
            return whole;
        }
        let low = (column - span.half).ceil() as isize;
        let high = (column + span.half).floor() as isize + 1;
        let wrap = |column: isize| column.rem_euclid(width as isize) as usize;
        if low >= 0 && high <= width as isize {
            return [lit(low as usize, (high as usize).max(low as usize)), 0..0];
        }
        let (left, right) = (lit(0, wrap(high)), lit(wrap(low), width));
        if left.end + beyond > right.start { whole } else { [left, right] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sphere::Direction;

    /// Rows and columns that leave no texel of a cap out and take no other, poles and seam included.
    #[test]
    fn spans_hold_the_texels_of_a_cap_and_no_other() {
        let grid = LatLong { width: 64, height: 24 };
        let pixels: Vec<[f32; 3]> = (0..grid.len()).map(|i| [(i % 3) as f32, 0.0, 0.0]).collect();
        let texels = LitTexels::new(&Environment::new(grid, pixels.clone()).unwrap());
        assert_eq!(texels.lit(), pixels.iter().filter(|pixel| pixel[0] > 0.0).count());
        for theta in [0.0, 0.1, 1.0, 1.57, 2.5, 3.1, PI] {
            for phi in [-PI, -3.0, -0.7, 0.0, 1.9, 3.1] {
                for radius in [0.01f64, 0.2, 0.9, 1.4, 2.5] {
                    let centre = Direction::from_angles(theta, phi);
                    let mut expected = 0.0;
                    for (texel, pixel) in pixels.iter().enumerate() {
                        let (row, column) = (texel / grid.width, texel % grid.width);
                        if grid.direction(row, column).dot(centre) >= radius.cos() {
                            expected += f64::from(pixel[0]) * grid.solid_angle(row);
                        }
                    }
                    for beyond in [0, PAD] {
                        let mut found = 0.0;
                        for span in texels.within(theta, radius.cos()) {
                            let mut beside = 0;
                            for segment in texels.segments(span, texels.column(phi), beyond) {
                                for index in segment {
                                    let (direction, weighted) = texels.texel(span.row, index);
                                    found += weighted[0];
                                    beside +=
                                        usize::from(direction.dot(centre.vector()) < radius.cos() - 1e-12);
                                }
                            }
                            assert!(beside <= beyond, "{theta} {phi} {radius}: {beside}");
                        }
                        assert!(found > expected - 1e-12, "{theta} {phi} {radius}: {found} {expected}");
                    }
                }
            }
        }
    }
}
