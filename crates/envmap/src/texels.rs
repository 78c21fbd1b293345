//! Bilinear interpolation on every layout: the texels that make up the radiance of a direction, and their
//! weights.
//!
//! Interpolation continues past every border of the picture: over the seam, over the poles to the opposite
//! meridian, on the neighbouring face of a cube, and over the rim of a disk.

use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use sphere::{
    AngularProbe, Cube, DMat3, Direction, Face, LatLong, MirrorBall, OpenExrCube, OpenExrLatLong, Rotation,
};

/// Four texels and their weights, which sum to 1.
#[derive(Clone, Copy, Debug)]
pub struct Taps {
    /// The indices of the texels, along rows, rows along faces.
    pub index: [usize; 4],
    /// The weight of each texel.
    pub weight: [f64; 4],
}

impl Taps {
    /// The weighted sum of four pixels.
    pub fn blend(&self, pixels: &[[f32; 3]]) -> [f64; 3] {
        self.blend_by(|index| pixels[index])
    }

    /// The weighted sum of four pixels that are made when they are asked for, by their index.
    pub fn blend_by(&self, mut pixel: impl FnMut(usize) -> [f32; 3]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (index, weight) in self.index.into_iter().zip(self.weight) {
            let pixel = pixel(index);
            for channel in 0..3 {
                sum[channel] += weight * f64::from(pixel[channel]);
            }
        }
        sum
    }
}

/// The texels of a picture on the sphere.
pub trait Texels: Copy + Sync {
    /// The texels that make up the radiance of a direction.
    fn taps(self, direction: Direction) -> Taps;

    /// The side, in radians, of a square as large as the smallest texel within `radius` of a direction; it
    /// may be 0 where texels degenerate.
    fn side(self, direction: Direction, radius: f64) -> f64;

    /// The solid angle of a texel, in steradians.
    fn solid_angle(self, texel: usize) -> f64;

    /// Whether the layout uses a texel.
    fn uses(self, _texel: usize) -> bool {
        true
    }

    /// The direction of a texel; `None` if the layout does not use it.
    fn direction(self, texel: usize) -> Option<Direction>;
}

/// The whole number below a coordinate that is -1 or more.
fn below(x: f64) -> isize {
    (x + 1.0) as isize - 1
}

/// Bilinear weights in the order (0, 0), (1, 0), (0, 1), (1, 1) of (column, row).
fn bilinear(x: f64, y: f64) -> [f64; 4] {
    [(1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y]
}

impl Taps {
    /// The taps at continuous coordinates of a lat-long image: a texel's centre is at whole numbers. The
    /// column may be up to a turn past either side, the row half a texel.
    pub(crate) fn of_lat_long(grid: LatLong, x: f64, y: f64) -> Self {
        let (width, height) = (grid.width as isize, grid.height as isize);
        let top = below(y);
        let lower = y - top as f64;
        // A row past a pole is the first row seen from the other side, half a turn away.
        let across = |row: isize| {
            let (inside, x) = match row {
                row if row < 0 => (0, x + 0.5 * width as f64),
                row if row >= height => (height - 1, x + 0.5 * width as f64),
                row => (row, x),
            };
            let left = (x + width as f64) as isize - width;
            let wrapped = |column: isize| match column {
                column if column < 0 => column + width,
                column if column >= width => (column - width) % width,
                column => column,
            };
            let start = inside * width;
            ((start + wrapped(left)) as usize, (start + wrapped(left + 1)) as usize, x - left as f64)
        };
        let (a, b, x0) = across(top);
        let (c, d, x1) = across(top + 1);
        let upper = 1.0 - lower;
        Self { index: [a, b, c, d], weight: [(1.0 - x0) * upper, x0 * upper, (1.0 - x1) * lower, x1 * lower] }
    }
}

impl Texels for LatLong {
    fn taps(self, direction: Direction) -> Taps {
        let (x, y) = self.position(direction);
        Taps::of_lat_long(self, x, y)
    }

    fn side(self, direction: Direction, radius: f64) -> f64 {
        side_between_meridians(direction, radius, TAU / self.width as f64, PI / self.height as f64)
    }

    fn solid_angle(self, texel: usize) -> f64 {
        LatLong::solid_angle(self, texel / self.width)
    }

    fn direction(self, texel: usize) -> Option<Direction> {
        Some(LatLong::direction(self, texel / self.width, texel % self.width))
    }
}

impl Texels for OpenExrLatLong {
    fn taps(self, direction: Direction) -> Taps {
        let (x, y) = self.position(direction);
        let left = (x as usize).min(self.width - 2);
        let top = (y as usize).min(self.height - 2);
        let first = top * self.width + left;
        Taps {
            index: [first, first + 1, first + self.width, first + self.width + 1],
            weight: bilinear(x - left as f64, y - top as f64),
        }
    }

    fn side(self, direction: Direction, radius: f64) -> f64 {
        side_between_meridians(
            direction,
            radius,
            TAU / (self.width - 1) as f64,
            PI / (self.height - 1) as f64,
        )
    }

    fn solid_angle(self, texel: usize) -> f64 {
        OpenExrLatLong::solid_angle(self, texel / self.width, texel % self.width)
    }

    fn direction(self, texel: usize) -> Option<Direction> {
        Some(OpenExrLatLong::direction(self, texel / self.width, texel % self.width))
    }
}

fn side_between_meridians(direction: Direction, radius: f64, column: f64, row: f64) -> f64 {
    let v = direction.vector();
    let sine = (v.x * v.x + v.y * v.y).sqrt();
    (row * column * (sine - radius).max(0.0)).sqrt()
}

impl Texels for Cube {
    fn taps(self, direction: Direction) -> Taps {
        let (face, s, t) = self.position(direction);
        let edge = self.edge as isize;
        let (x, y) = (s * edge as f64 - 0.5, t * edge as f64 - 0.5);
        let (left, top) = (below(x), below(y));
        let mut weight = bilinear(x - left as f64, y - top as f64);
        let first = face as isize * edge * edge + top * edge + left;
        if left >= 0 && top >= 0 && left + 1 < edge && top + 1 < edge {
            let first = first as usize;
            return Taps { index: [first, first + 1, first + self.edge, first + self.edge + 1], weight };
        }
        let mut index = [0; 4];
        let mut missing = None;
        for (k, (row, column)) in
            [(top, left), (top, left + 1), (top + 1, left), (top + 1, left + 1)].into_iter().enumerate()
        {
            match self.continued(face, row, column) {
                Some(texel) => index[k] = texel,
                None => missing = Some(k),
            }
        }
        // Three faces meet at a corner: the fourth texel is the mean of the other three.
        if let Some(corner) = missing {
            let share = weight[corner] / 3.0;
            for k in 0..4 {
                weight[k] = if k == corner { 0.0 } else { weight[k] + share };
            }
            index[corner] = index[3 - corner];
        }
        Taps { index, weight }
    }

    fn side(self, direction: Direction, radius: f64) -> f64 {
        side_on_face(direction, radius, self.edge)
    }

    fn solid_angle(self, texel: usize) -> f64 {
        Cube::solid_angle(self, texel / self.edge % self.edge, texel % self.edge)
    }

    fn direction(self, texel: usize) -> Option<Direction> {
        let face = Face::ALL[texel / (self.edge * self.edge)];
        Some(Cube::direction(self, face, texel / self.edge % self.edge, texel % self.edge))
    }
}

/// The texel of a cube at a row and column that may lie one step outside of a face.
pub(crate) trait Continued {
    /// The texel, on the neighbouring face if it lies there; `None` past a corner.
    fn continued(self, face: Face, row: isize, column: isize) -> Option<usize>;
}

impl Continued for Cube {
    fn continued(self, face: Face, row: isize, column: isize) -> Option<usize> {
        let edge = self.edge as isize;
        let inside = |k: isize| (0..edge).contains(&k);
        if inside(row) && inside(column) {
            return Some(((face as isize * edge + row) * edge + column) as usize);
        }
        if !inside(row) && !inside(column) {
            return None;
        }
        // Coordinates along an edge are the same on both faces, so a tiny step past the edge finds the
        // neighbour.
        let beside = |k: isize| {
            if k < 0 {
                -1e-9
            } else if k >= edge {
                1.0 + 1e-9
            } else {
                (k as f64 + 0.5) / edge as f64
            }
        };
        let (face, s, t) = self.position(self.direction_at(face, beside(column), beside(row)));
        let texel = |s: f64| ((s * edge as f64) as usize).min(self.edge - 1);
        Some((face as usize * self.edge + texel(t)) * self.edge + texel(s))
    }
}

impl Texels for OpenExrCube {
    fn taps(self, direction: Direction) -> Taps {
        let (face, x, y) = self.position(direction);
        let left = (x as usize).min(self.edge - 2);
        let top = (y as usize).min(self.edge - 2);
        let first = (face * self.edge + top) * self.edge + left;
        Taps {
            index: [first, first + 1, first + self.edge, first + self.edge + 1],
            weight: bilinear(x - left as f64, y - top as f64),
        }
    }

    fn side(self, direction: Direction, radius: f64) -> f64 {
        side_on_face(direction, radius, self.edge - 1)
    }

    fn solid_angle(self, texel: usize) -> f64 {
        OpenExrCube::solid_angle(self, texel / self.edge, texel % self.edge)
    }

    fn direction(self, texel: usize) -> Option<Direction> {
        Some(OpenExrCube::direction(self, texel / self.edge, texel % self.edge))
    }
}

/// A texel of (2 / edge)^2 in a face's plane has (2 / edge)^2 m^3 steradians, at the distance 1 / m.
fn side_on_face(direction: Direction, radius: f64, edge: usize) -> f64 {
    let m = (direction.vector().abs().max_element() - radius).max(1.0 / 3.0_f64.sqrt());
    2.0 / edge as f64 * m * m.sqrt()
}

impl Texels for AngularProbe {
    fn taps(self, direction: Direction) -> Taps {
        disk_taps(self.edge, self.position(direction))
    }

    fn side(self, direction: Direction, radius: f64) -> f64 {
        // Texels have 2 pi / edge along the radius and sin(t) / t of it around the centre.
        let t = math::acos(direction.vector().x.clamp(-1.0, 1.0)) + radius;
        TAU / self.edge as f64 * if t < PI { (math::sin(t) / t).sqrt() } else { 0.0 }
    }

    fn uses(self, texel: usize) -> bool {
        is_in_disk(self.edge, texel / self.edge, texel % self.edge)
    }

    fn solid_angle(self, texel: usize) -> f64 {
        AngularProbe::solid_angle(self, texel / self.edge, texel % self.edge)
    }

    fn direction(self, texel: usize) -> Option<Direction> {
        AngularProbe::direction(self, texel / self.edge, texel % self.edge)
    }
}

impl Texels for MirrorBall {
    fn taps(self, direction: Direction) -> Taps {
        disk_taps(self.edge, self.position(direction))
    }

    fn side(self, _direction: Direction, _radius: f64) -> f64 {
        // All texels have 4 (2 / edge)^2 steradians.
        4.0 / self.edge as f64
    }

    fn uses(self, texel: usize) -> bool {
        is_in_disk(self.edge, texel / self.edge, texel % self.edge)
    }

    fn solid_angle(self, texel: usize) -> f64 {
        MirrorBall::solid_angle(self, texel / self.edge, texel % self.edge)
    }

    fn direction(self, texel: usize) -> Option<Direction> {
        MirrorBall::direction(self, texel / self.edge, texel % self.edge)
    }
}

/// The taps in a disk; (column, row) lies inside.
fn disk_taps(edge: usize, (x, y): (f64, f64)) -> Taps {
    let (left, top) = (below(x), below(y));
    let weight = bilinear(x - left as f64, y - top as f64);
    let index = [(top, left), (top, left + 1), (top + 1, left), (top + 1, left + 1)]
        .map(|(row, column)| disk_texel(edge, row, column));
    Taps { index, weight }
}

/// Whether the centre of a texel lies in the disk; measured in half texels from its centre, so that the test
/// is exact.
fn is_in_disk(edge: usize, row: usize, column: usize) -> bool {
    let from_centre = |k: usize| (2 * k as i64 + 1 - edge as i64).pow(2);
    from_centre(row) + from_centre(column) <= (edge as i64).pow(2)
}

/// The texel at a row and column, or, if its centre is outside the disk, the one that continues the picture
/// over the rim: from radius 1 + x to radius 1 - x on the other side of the centre.
fn disk_texel(edge: usize, row: isize, column: isize) -> usize {
    let size = edge as isize;
    let (a, b) = (2 * column + 1 - size, 2 * row + 1 - size);
    // In half texels from the centre, as in `is_in_disk`.
    if a * a + b * b <= size * size {
        return row as usize * edge + column as usize;
    }
    let (a, b, rim) = (a as f64, b as f64, size as f64);
    let radius = math::hypot(a, b);
    // The nearest centre is at most half the diagonal of a texel away, but it must be in the disk too.
    let inward = (2.0 * rim - radius).min(rim - 2.0 * FRAC_1_SQRT_2 - 0.01).max(0.0) / radius;
    let nearest = |k: f64| (((rim - 1.0 - k * inward) / 2.0).round().max(0.0) as usize).min(edge - 1);
    nearest(b) * edge + nearest(a)
}

/// A picture turned by a rotation R: its radiance at w is the picture's at R^-1 w.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turned<T> {
    texels: T,
    back: DMat3,
    there: DMat3,
}

impl<T> Turned<T> {
    pub(crate) fn new(texels: T, rotation: Rotation) -> Self {
        Self { texels, back: rotation.inverse().matrix(), there: rotation.matrix() }
    }
}

impl<T: Texels> Texels for Turned<T> {
    fn taps(self, direction: Direction) -> Taps {
        self.texels.taps(Direction::from_unit(self.back * direction.vector()))
    }

    fn side(self, direction: Direction, radius: f64) -> f64 {
        self.texels.side(Direction::from_unit(self.back * direction.vector()), radius)
    }

    fn uses(self, texel: usize) -> bool {
        self.texels.uses(texel)
    }

    fn solid_angle(self, texel: usize) -> f64 {
        self.texels.solid_angle(texel)
    }

    fn direction(self, texel: usize) -> Option<Direction> {
        let direction = self.texels.direction(texel)?;
        Some(Direction::from_unit(self.there * direction.vector()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uneven values in [0, 1), one for each texel.
    fn noise(texel: usize) -> f32 {
        ((texel * 2_654_435_761) % 65_536) as f32 / 65_536.0
    }

    fn at<T: Texels>(texels: T, pixels: &[[f32; 3]], direction: Direction) -> f64 {
        let taps = texels.taps(direction);
        assert!(taps.weight.iter().all(|&weight| weight >= -1e-15), "{taps:?}");
        assert!((taps.weight.iter().sum::<f64>() - 1.0).abs() < 1e-14, "{taps:?}");
        assert!(taps.index.iter().all(|&texel| texels.uses(texel)), "{taps:?}");
        taps.blend(pixels)[0]
    }

    #[test]
    fn a_cube_is_continuous_over_edges_and_corners() {
        for edge in [1, 2, 3, 8] {
            let cube = Cube { edge };
            let pixels: Vec<_> = (0..cube.len()).map(|texel| [noise(texel); 3]).collect();
            for face in Face::ALL {
                for k in 0..=40 {
                    let along = f64::from(k) / 40.0;
                    for (s, t) in [(0.0, along), (1.0, along), (along, 0.0), (along, 1.0)] {
                        let step = 1e-9;
                        let moved =
                            |x: f64, by: f64| if x == 0.0 || x == 1.0 { x + (x - 0.5) * by } else { x };
                        let value =
                            |by: f64| at(cube, &pixels, cube.direction_at(face, moved(s, by), moved(t, by)));
                        // Values differ by 1 over a texel at most, and the step is 1e-9 of a face or two.
                        let jump = (value(-step) - value(step)).abs();
                        assert!(jump < 10.0 * step * edge as f64, "{edge} {face:?} {s} {t}: {jump}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_corner_is_the_mean_of_its_three_texels() {
        let cube = Cube { edge: 4 };
        let pixels: Vec<_> = (0..cube.len()).map(|texel| [noise(texel); 3]).collect();
        let corner = Direction::normalised(sphere::DVec3::new(1.0, 1.0, 1.0));
        // (x, y, z) = (1, 1, 1) has cube coordinates (-1, 1, 1): faces -X, +Y and +Z.
        let texel =
            |face: usize, row: usize, column: usize| f64::from(pixels[(face * 4 + row) * 4 + column][0]);
        let expected = (texel(1, 0, 3) + texel(2, 3, 0) + texel(4, 0, 0)) / 3.0;
        assert!((at(cube, &pixels, corner) - expected).abs() < 1e-12);
    }

    #[test]
    fn the_radiance_at_a_texel_is_its_value() {
        fn check<T: Texels>(texels: T, count: usize) {
            let pixels: Vec<_> = (0..count).map(|texel| [noise(texel); 3]).collect();
            for texel in 0..count {
                let Some(direction) = texels.direction(texel) else { continue };
                assert!(texels.uses(texel));
                let found = at(texels, &pixels, direction);
                assert!((found - f64::from(noise(texel))).abs() < 1e-9, "{texel}");
            }
        }
        check(LatLong { width: 7, height: 5 }, 35);
        check(Cube { edge: 5 }, 150);
        check(AngularProbe { edge: 9 }, 81);
        check(AngularProbe { edge: 10 }, 100);
        check(MirrorBall { edge: 10 }, 100);
        let turned = Turned::new(Cube { edge: 3 }, Rotation::from_yaw_pitch_roll(0.3, 1.0, -2.0));
        check(turned, 54);
    }

    #[test]
    fn the_nodes_of_openexr_keep_their_values() {
        // Poles and the seam hold one direction in several texels, so compare where it is unique.
        let map = OpenExrLatLong { width: 9, height: 5 };
        let pixels: Vec<_> = (0..45).map(|texel| [noise(texel); 3]).collect();
        for texel in (9..36).filter(|texel| texel % 9 != 0 && texel % 9 != 8) {
            let found = at(map, &pixels, Texels::direction(map, texel).unwrap());
            assert!((found - f64::from(noise(texel))).abs() < 1e-12);
        }
        let cube = OpenExrCube { edge: 4 };
        let pixels: Vec<_> = (0..96).map(|texel| [noise(texel); 3]).collect();
        for texel in
            (0..96).filter(|texel| (1..3).contains(&(texel % 4)) && (1..3).contains(&(texel / 4 % 4)))
        {
            let found = at(cube, &pixels, Texels::direction(cube, texel).unwrap());
            assert!((found - f64::from(noise(texel))).abs() < 1e-12);
        }
    }

    #[test]
    fn a_disk_continues_over_its_rim() {
        fn check<T: Texels>(texels: T, edge: usize) {
            let pixels: Vec<_> = (0..edge * edge).map(|texel| [noise(texel); 3]).collect();
            for k in 0..100 {
                let phi = f64::from(k) * 0.0628;
                for away in [0.0, 1e-8, 0.01, 0.1] {
                    // `at` asserts that no tap leaves the disk.
                    let (sine, cosine) = f64::sin_cos(away);
                    at(
                        texels,
                        &pixels,
                        Direction::normalised([-cosine, sine * phi.cos(), sine * phi.sin()].into()),
                    );
                }
            }
        }
        for edge in [1, 2, 3, 4, 5, 9, 16, 31] {
            check(AngularProbe { edge }, edge);
            check(MirrorBall { edge }, edge);
        }
    }
}
