//! The sphere that every picture of a report shows: seen from far away along +X, up is +Z.
//!
//! The camera is orthographic, so the view V = -X is the same for every pixel, and the pixel itself is the
//! normal: N = (-sqrt(1 - x^2 - y^2), -x, -y) for x to the right and y down. The reflection vector R = 2
//! (N.V) N - V runs over the whole sphere, and w_o over every angle to it, so one picture tests all views of
//! a map.

use brdf::Centre;
use shrm::stops::{self, quantiles};
use sphere::{DMat3, DVec3, Direction};

use crate::picture::ball_camera::tangent;
use crate::picture::report::figures::Errors;

/// Pixels that stand for the whole picture: one of 1, 2, 4, 8, ..., in squares or in a chequerboard of
/// squares.
/// A finer lattice has all pixels of a coarser one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lattice {
    halvings: u32,
}

/// The first lattice has so many pixels at least, unless the whole picture has fewer.
const FIRST_LATTICE: usize = 800;

impl Lattice {
    /// The lattice of the whole picture.
    pub(crate) const ALL: Self = Self { halvings: 0 };

    /// Returns the coarsest lattice with this many of so many pixels, and at least as coarse as another.
    pub(crate) fn at_most(self, count: usize, of: usize) -> Self {
        let mut lattice = self;
        while of >> lattice.halvings > count.max(1) {
            lattice.halvings += 1;
        }
        lattice
    }

    /// The lattice to begin with in a picture of so many pixels.
    pub(crate) fn first(pixels: usize) -> Self {
        Self { halvings: (pixels / FIRST_LATTICE).max(1).ilog2() }
    }

    /// Returns the coarser of two lattices.
    pub(crate) fn coarser(self, other: Self) -> Self {
        Self { halvings: self.halvings.max(other.halvings) }
    }

    /// Returns the lattice with twice as many pixels; `None` if this is the whole picture.
    pub(crate) fn finer(self) -> Option<Self> {
        Some(Self { halvings: self.halvings.checked_sub(1)? })
    }

    /// The number of the picture's pixels of which one is in the lattice.
    pub(crate) fn one_of(self) -> usize {
        1 << self.halvings
    }

    /// The distance of the lattice's rows, or of the rows of a chequerboard's squares.
    fn step(self) -> usize {
        1 << (self.halvings / 2)
    }

    fn holds(self, [x, y]: [usize; 2]) -> bool {
        let step = self.step();
        x.is_multiple_of(step)
            && y.is_multiple_of(step)
            && (self.halvings.is_multiple_of(2) || (x / step + y / step).is_multiple_of(2))
    }

    /// The index of the coarser lattice, of four shifted against each other, that a pixel of this one is in.
    fn quarter(self, [x, y]: [usize; 2]) -> usize {
        let [x, y] = [x / self.step(), y / self.step()];
        // The axes of a chequerboard are its diagonals.
        let [u, v] = if self.halvings.is_multiple_of(2) { [x, y] } else { [(x + y) / 2, x.abs_diff(y) / 2] };
        2 * (u % 2) + v % 2
    }
}

/// The pixels of a lattice that see the sphere.
pub(crate) struct Sphere {
    edge: usize,
    lattice: Lattice,
    pixels: Vec<Pixel>,
}

struct Pixel {
    index: usize,
    normal: Direction,
    /// Whether the pixel's centre sees the sphere. The ring of pixels around it only completes the outline in
    /// pictures.
    inside: bool,
}

impl Sphere {
    /// The sphere in a picture of `edge` x `edge` pixels whose border it touches.
    pub(crate) fn new(edge: usize) -> Self {
        Self::on(Lattice::ALL, edge)
    }

    /// The pixels of a lattice in a picture of `edge` x `edge` pixels.
    pub(crate) fn on(lattice: Lattice, edge: usize) -> Self {
        let half = edge as f64 / 2.0;
        let at = |i: usize| (i as f64 + 0.5 - half) / half;
        let pixels = (0..edge * edge).filter_map(|index| {
            if !lattice.holds([index % edge, index / edge]) {
                return None;
            }
            let (x, y) = (at(index % edge), at(index / edge));
            let radius = math::hypot(x, y);
            if radius > 1.0 + 2.0 / half {
                return None;
            }
            let shrink = 0.999_f64.min(radius) / radius.max(1e-9);
            let (x, y) = (x * shrink, y * shrink);
            let normal = Direction::normalised(DVec3::new(-(1.0 - x * x - y * y).sqrt(), -x, -y));
            Some(Pixel { index, normal, inside: radius < 1.0 })
        });
        Self { edge, lattice, pixels: pixels.collect() }
    }

    /// The direction toward the camera, in the world's frame.
    pub(crate) fn view() -> Direction {
        Direction::normalised(-DVec3::X)
    }

    /// The lattice of the sphere's pixels.
    pub(crate) fn lattice(&self) -> Lattice {
        self.lattice
    }

    /// The index of each pixel in the picture.
    pub(crate) fn indices(&self) -> impl ExactSizeIterator<Item = usize> {
        self.pixels.iter().map(|pixel| pixel.index)
    }

    /// Whether each pixel is in a lattice.
    fn inside(&self, lattice: Lattice) -> impl Iterator<Item = bool> {
        self.pixels.iter().map(move |pixel| pixel.inside && lattice.holds(self.place(pixel)))
    }

    fn place(&self, pixel: &Pixel) -> [usize; 2] {
        [pixel.index % self.edge, pixel.index / self.edge]
    }

    /// The central direction that each pixel sees. The tangent is Z x N.
    pub(crate) fn central(&self, centre: Centre) -> Vec<Direction> {
        let central =
            |pixel: &Pixel| centre.central(pixel.normal, tangent(pixel.normal.vector()), Self::view());
        self.pixels.iter().map(central).collect()
    }

    /// The frame of the surface at each pixel, brushed along +Z: the projection of +Z into the surface, N x
    /// that, and the normal N as columns, in the order of [`Sphere::central`].
    pub(crate) fn brushed(&self) -> Vec<DMat3> {
        let frame = |pixel: &Pixel| {
            let normal = pixel.normal.vector();
            let tangent = (DVec3::Z - normal * normal.z).try_normalize().unwrap_or(DVec3::Y);
            DMat3::from_cols(tangent, normal.cross(tangent), normal)
        };
        self.pixels.iter().map(frame).collect()
    }

    /// The root of the mean squared difference from `truth` over pixels and channels, divided by the root of
    /// the mean of `truth` squared. Both in the order of [`Sphere::central`]. If the truth is black: 0 if
    /// both are equal, infinite otherwise.
    fn relative_rms(&self, values: &[[f32; 3]], truth: &[[f32; 3]], lattice: Lattice) -> f64 {
        let (mut difference, mut energy) = (0.0, 0.0);
        for ((is_inside, value), truth) in self.inside(lattice).zip(values).zip(truth) {
            if is_inside {
                for channel in 0..3 {
                    difference += math::powi(f64::from(value[channel] - truth[channel]), 2);
                    energy += math::powi(f64::from(truth[channel]), 2);
                }
            }
        }
        if difference == 0.0 { 0.0 } else { (difference / energy).sqrt() }
    }

    /// The errors of values that a renderer reads, in the order of [`Sphere::central`]: a value below 0 is
    /// black to it. `dark` is the radiance below which black is black, e of [`Errors`]. Only the pixels of
    /// the lattice count.
    pub(crate) fn errors(
        &self,
        values: &[[f32; 3]],
        truth: &[[f32; 3]],
        dark: f64,
        lattice: Lattice,
    ) -> Errors {
        let (mut quarters, mut negative): ([Vec<f64>; 4], _) = (Default::default(), 0_usize);
        for (((pixel, is_inside), value), truth) in
            self.pixels.iter().zip(self.inside(lattice)).zip(values).zip(truth)
        {
            if is_inside {
                let quarter = &mut quarters[lattice.quarter(self.place(pixel))];
                for (&value, &truth) in value.iter().zip(truth) {
                    negative += usize::from(f64::from(value) < -0.1 * dark);
                    quarter.push(stops::error(f64::from(value), f64::from(truth), dark));
                }
            }
        }
        let mut all = quarters.concat();
        let [p95, p99] = quantiles(&mut all);
        let of_quarters = quarters.map(|mut stops| quantiles(&mut stops));
        Errors {
            rms: self.relative_rms(values, truth, lattice),
            p95,
            p99,
            negative: negative as f64 / all.len().max(1) as f64,
            p95_uncertainty: uncertainty(of_quarters.map(|[p95, _]| p95)),
            p99_uncertainty: uncertainty(of_quarters.map(|[_, p99]| p99)),
        }
    }

    /// Whether each pixel, in the order of [`Sphere::central`], is in a lattice.
    pub(crate) fn within(&self, lattice: Lattice) -> impl Iterator<Item = bool> {
        self.pixels.iter().map(move |pixel| lattice.holds(self.place(pixel)))
    }

    /// The values of every pixel of the whole picture's sphere, in the order of its [`Sphere::central`], from
    /// those that were measured on a lattice: the others are means of the ones around them.
    pub(crate) fn filled(&self, lattice: Lattice, values: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let mut measured = vec![None; self.edge * self.edge];
        for ((pixel, is_measured), value) in self.pixels.iter().zip(self.within(lattice)).zip(values) {
            measured[pixel.index] = is_measured.then_some(*value);
        }
        let reach = 1.5 * (lattice.one_of() as f64).sqrt();
        let span = reach as usize;
        let around = |pixel: &Pixel| {
            if let Some(value) = measured[pixel.index] {
                return value;
            }
            let ([x, y], mut sum, mut total) = (self.place(pixel), [0.0; 3], 0.0);
            for row in y.saturating_sub(span)..=(y + span).min(self.edge - 1) {
                for column in x.saturating_sub(span)..=(x + span).min(self.edge - 1) {
                    let distance = math::hypot(row.abs_diff(y) as f64, column.abs_diff(x) as f64);
                    let weight = (1.0 - math::powi(distance / reach, 2)).max(0.0) as f32;
                    if let Some(value) = measured[row * self.edge + column] {
                        (0..3).for_each(|channel| sum[channel] += weight * value[channel]);
                        total += weight;
                    }
                }
            }
            if total > 0.0 { sum.map(|sum| sum / total) } else { [0.0; 3] }
        };
        Self::new(self.edge).pixels.iter().map(around).collect()
    }

    /// The whole picture, black outside the sphere, of [filled](Sphere::filled) values.
    pub(crate) fn picture(&self, values: &[[u8; 3]]) -> Vec<[u8; 3]> {
        let mut picture = vec![[0; 3]; self.edge * self.edge];
        for (pixel, value) in Self::new(self.edge).pixels.iter().zip(values) {
            picture[pixel.index] = *value;
        }
        picture
    }
}

/// The standard error of a figure, from that of four lattices that make up the whole. The error of a share of
/// the picture that is covered by a region falls with the number of pixels to the power of 3/4 on a lattice:
/// only squares at the region's outline count.
fn uncertainty(figures: [f64; 4]) -> f64 {
    let mean = figures.iter().sum::<f64>() / 4.0;
    let variance = figures.iter().map(|figure| math::powi(figure - mean, 2)).sum::<f64>() / 3.0;
    variance.sqrt() / math::pow(4.0_f64, 0.75)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_reflects_backward_and_the_outline_forward() {
        let sphere = Sphere::new(65);
        let middle = sphere.pixels.iter().position(|pixel| pixel.index == 32 * 65 + 32).unwrap();
        let reflected = sphere.central(Centre::Reflection);
        assert!((reflected[middle].vector() + DVec3::X).length() < 1e-12);
        // Up in the picture is +Z, right is -Y.
        let (top, right) = (65 * 8 + 32, 32 * 65 + 56);
        let normals = sphere.central(Centre::Normal);
        let of =
            |index| normals[sphere.pixels.iter().position(|pixel| pixel.index == index).unwrap()].vector();
        assert!(of(top).z > 0.7 && of(right).y < -0.7);
        // The reflections cover the sphere: some lie within 10 degrees of straight ahead.
        assert!(reflected.iter().any(|r| r.vector().x > 0.985));
        for (tangent, normal) in sphere.central(Centre::Tangent).iter().zip(&normals) {
            assert!(tangent.dot(*normal).abs() < 1e-12);
        }
    }

    #[test]
    fn errors_are_relative_to_the_truth() {
        let sphere = Sphere::new(16);
        let count = sphere.pixels.len();
        let (truth, off) = (vec![[2.0_f32; 3]; count], vec![[2.5_f32; 3]; count]);
        assert!((sphere.relative_rms(&off, &truth, Lattice::ALL) - 0.25).abs() < 1e-12);
        let black = vec![[0.0_f32; 3]; count];
        assert_eq!(sphere.relative_rms(&black, &black, Lattice::ALL), 0.0);
        assert_eq!(sphere.relative_rms(&off, &black, Lattice::ALL), f64::INFINITY);
        // A pixel that does not see the sphere does not count.
        let outside = sphere.pixels.iter().position(|pixel| !pixel.inside).unwrap();
        let mut one = truth.clone();
        one[outside] = [9.0; 3];
        assert_eq!(sphere.relative_rms(&one, &truth, Lattice::ALL), 0.0);
    }

    #[test]
    fn errors_in_stops_count_what_an_eye_sees() {
        let sphere = Sphere::new(64);
        let inside: Vec<usize> =
            (0..sphere.pixels.len()).filter(|pixel| sphere.pixels[*pixel].inside).collect();
        let truth = vec![[1.0_f32; 3]; sphere.pixels.len()];
        let mut values = truth.clone();
        // 2 % of the pixels are twice as bright, another 0.5 % are far below zero.
        let count = |share: f64| (share * inside.len() as f64) as usize;
        for pixel in &inside[..count(0.02)] {
            values[*pixel] = [2.0; 3];
        }
        for pixel in &inside[count(0.5)..count(0.505)] {
            values[*pixel] = [-7.0; 3];
        }
        let errors = sphere.errors(&values, &truth, 0.01, Lattice::ALL);
        assert!(errors.p95 == 0.0 && (errors.p99 - (2.01_f64 / 1.01).log2()).abs() < 1e-6, "{errors:?}");
        assert!((errors.negative - 0.005).abs() < 1e-3, "{errors:?}");
        // Black is black: what is far below the mean radiance does not count, nor does rounding below zero.
        let dark = vec![[0.0_f32; 3]; truth.len()];
        let errors = sphere.errors(&vec![[-1e-4; 3]; truth.len()], &dark, 0.01, Lattice::ALL);
        assert_eq!((errors.p99, errors.negative), (0.0, 0.0));
    }

    #[test]
    fn a_finer_lattice_has_twice_the_pixels_and_those_of_the_coarser_one() {
        for halvings in 1..=6 {
            let coarse = Sphere::on(Lattice { halvings }, 96);
            let fine = Sphere::on(coarse.lattice.finer().unwrap(), 96);
            let ratio = fine.pixels.len() as f64 / coarse.pixels.len() as f64;
            assert!((1.8..2.2).contains(&ratio), "{halvings}: {ratio}");
            let of_fine: Vec<usize> = fine.indices().collect();
            assert!(coarse.indices().all(|index| of_fine.binary_search(&index).is_ok()));
            let mut quarters = [0_usize; 4];
            fine.pixels.iter().for_each(|pixel| quarters[fine.lattice.quarter(fine.place(pixel))] += 1);
            let even = fine.pixels.len() / 4;
            assert!(quarters.iter().all(|count| count.abs_diff(even) < even / 4 + 8), "{quarters:?}");
        }
        assert_eq!(Lattice::ALL.finer(), None);
        assert_eq!([700, 1000, 3300, 7300].map(|pixels| Lattice::first(pixels).one_of()), [1, 1, 4, 8]);
    }

    /// The root mean square of both over twelve pictures; measured: their ratio is 0.98.
    #[test]
    fn the_uncertainty_of_a_figure_is_about_its_error() {
        let edge = 192;
        let errors = |lattice, phase: f64| {
            let sphere = Sphere::on(lattice, edge);
            let truth = vec![[1.0_f32; 3]; sphere.pixels.len()];
            let value = |index: usize| {
                let [x, y] = [index % edge, index / edge].map(|at| at as f64 / edge as f64);
                let wave =
                    ((9.0 * x + phase).sin() * (7.0 * y + 2.0 * phase).cos() + (23.0 * x * y).sin()).exp();
                [(1.0 + 0.1 * wave) as f32; 3]
            };
            sphere.errors(&sphere.indices().map(value).collect::<Vec<_>>(), &truth, 0.01, lattice)
        };
        let (mut squares, mut expected) = (0.0, 0.0);
        for phase in 0..12 {
            let phase = 0.5 * f64::from(phase);
            let right = errors(Lattice::ALL, phase);
            for halvings in [3, 4, 5] {
                let found = errors(Lattice { halvings }, phase);
                squares += (found.p95 - right.p95).powi(2);
                expected += found.p95_uncertainty.powi(2);
                assert!(found.p95_uncertainty < 0.04 * found.p95, "{found:?}");
            }
        }
        let ratio = (squares / expected).sqrt();
        assert!((0.7..1.4).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_picture_that_is_filled_has_the_values_that_were_measured_and_means_between_them() {
        for halvings in 0..=4 {
            let sphere = Sphere::on(Lattice { halvings }, 64);
            let value =
                |index: usize| [0.5 + (index % 64) as f32 / 64.0 + 2.0 * (index / 64) as f32 / 64.0; 3];
            let values: Vec<_> = sphere.indices().map(value).collect();
            let filled = sphere.filled(sphere.lattice, &values);
            let whole = Sphere::new(64);
            assert_eq!(filled.len(), whole.pixels.len());
            for ((pixel, index), filled) in whole.pixels.iter().zip(whole.indices()).zip(&filled) {
                let error = (filled[0] - value(index)[0]).abs();
                let limit = if sphere.lattice.holds(whole.place(pixel)) { 0.0 } else { 0.25 };
                assert!(error <= limit, "{halvings}: {error}");
            }
        }
    }
}
