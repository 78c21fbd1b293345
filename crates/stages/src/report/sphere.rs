//! The sphere that every picture of a report shows: seen from far away along +X, up is +Z.
//!
//! The camera is orthographic, so the view V = -X is the same for every pixel, and the pixel itself is the
//! normal: N = (-sqrt(1 - x^2 - y^2), -x, -y) for x to the right and y down. The reflection vector R = 2
//! (N.V) N - V runs over the whole sphere, and w_o over every angle to it, so one picture tests all views of
//! a map.

use brdf::Centre;
use sphere::{DVec3, Direction};

use crate::report::figures::Errors;

/// The pixels in the middle of squares of so many pixels: what takes much work for each texel of a map is
/// measured at these alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lattice {
    /// The edge of a square, in pixels.
    pub(crate) step: usize,
}

impl Lattice {
    /// The whole picture.
    pub(crate) const ALL: Self = Self { step: 1 };

    /// The middle of the square that a row or a column is in.
    fn middle(self, at: usize) -> usize {
        at - at % self.step + self.step / 2
    }

    fn holds(self, edge: usize, index: usize) -> bool {
        [index % edge, index / edge].into_iter().all(|at| self.middle(at) == at)
    }
}

/// The pixels that see the sphere.
pub(crate) struct Sphere {
    edge: usize,
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
    /// A picture of `edge` x `edge` pixels whose border the sphere touches.
    pub(crate) fn new(edge: usize) -> Self {
        let half = edge as f64 / 2.0;
        let at = |i: usize| (i as f64 + 0.5 - half) / half;
        let pixels = (0..edge * edge).filter_map(|index| {
            let (x, y) = (at(index % edge), at(index / edge));
            let radius = x.hypot(y);
            if radius > 1.0 + 2.0 / half {
                return None;
            }
            let shrink = 0.999_f64.min(radius) / radius.max(1e-9);
            let (x, y) = (x * shrink, y * shrink);
            let normal = Direction::normalised(DVec3::new(-(1.0 - x * x - y * y).sqrt(), -x, -y));
            Some(Pixel { index, normal, inside: radius < 1.0 })
        });
        Self { edge, pixels: pixels.collect() }
    }

    /// The direction toward the camera, in the world's frame.
    pub(crate) fn view() -> Direction {
        Direction::normalised(-DVec3::X)
    }

    /// The central direction that each pixel sees. The tangent is Z x N.
    pub(crate) fn central(&self, centre: Centre) -> Vec<Direction> {
        let tangent =
            |normal: Direction| Direction::new(DVec3::Z.cross(normal.vector())).unwrap_or(Direction::Y);
        let central = |pixel: &Pixel| centre.central(pixel.normal, tangent(pixel.normal), Self::view());
        self.pixels.iter().map(central).collect()
    }

    /// The root of the mean squared difference from `truth` over pixels and channels, divided by the root of
    /// the mean of `truth` squared. Both in the order of [`Sphere::central`]. If the truth is black: 0 if
    /// both are equal, infinite otherwise.
    fn relative_rms(&self, values: &[[f32; 3]], truth: &[[f32; 3]], lattice: Lattice) -> f64 {
        let (mut difference, mut energy) = (0.0, 0.0);
        for ((pixel, value), truth) in self.pixels.iter().zip(values).zip(truth) {
            if pixel.inside && lattice.holds(self.edge, pixel.index) {
                for channel in 0..3 {
                    difference += f64::from(value[channel] - truth[channel]).powi(2);
                    energy += f64::from(truth[channel]).powi(2);
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
        let e = dark.max(f64::MIN_POSITIVE);
        let (mut stops, mut negative) = (Vec::with_capacity(3 * self.pixels.len()), 0_usize);
        for ((pixel, value), truth) in self.pixels.iter().zip(values).zip(truth) {
            if pixel.inside && lattice.holds(self.edge, pixel.index) {
                for (&value, &truth) in value.iter().zip(truth) {
                    negative += usize::from(f64::from(value) < -0.1 * dark);
                    let seen = |value: f32| f64::from(value.max(0.0)) + e;
                    stops.push((seen(value) / seen(truth)).log2().abs());
                }
            }
        }
        stops.sort_by(f64::total_cmp);
        let at = |share: f64| stops.get((share * stops.len() as f64) as usize).copied().unwrap_or(0.0);
        Errors {
            rms: self.relative_rms(values, truth, lattice),
            p95: at(0.95),
            p99: at(0.99),
            negative: negative as f64 / stops.len().max(1) as f64,
        }
    }

    /// Whether each pixel, in the order of [`Sphere::central`], is in a lattice.
    pub(crate) fn within(&self, lattice: Lattice) -> impl Iterator<Item = bool> {
        self.pixels.iter().map(move |pixel| lattice.holds(self.edge, pixel.index))
    }

    /// Values in which each pixel has that of its square's middle; black if that is outside the picture.
    pub(crate) fn mosaic(&self, lattice: Lattice, values: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let mut whole = vec![[0.0; 3]; self.edge * self.edge];
        for (pixel, value) in self.pixels.iter().zip(values) {
            whole[pixel.index] = *value;
        }
        let of_middle = |pixel: &Pixel| {
            let [x, y] = [pixel.index % self.edge, pixel.index / self.edge].map(|at| lattice.middle(at));
            if x.max(y) < self.edge { whole[y * self.edge + x] } else { [0.0; 3] }
        };
        self.pixels.iter().map(of_middle).collect()
    }

    /// The whole picture, black outside the sphere, of values in the order of [`Sphere::central`].
    pub(crate) fn picture(&self, values: &[[u8; 3]]) -> Vec<[u8; 3]> {
        let mut picture = vec![[0; 3]; self.edge * self.edge];
        for (pixel, value) in self.pixels.iter().zip(values) {
            picture[pixel.index] = *value;
        }
        picture
    }
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
    fn a_mosaic_shows_the_pixels_of_its_lattice() {
        let sphere = Sphere::new(64);
        let values: Vec<_> = (0..sphere.pixels.len()).map(|pixel| [pixel as f32; 3]).collect();
        assert_eq!(sphere.mosaic(Lattice::ALL, &values), values);
        let lattice = Lattice { step: 3 };
        let held: Vec<bool> = sphere.within(lattice).collect();
        let share = 9.0 * held.iter().filter(|held| **held).count() as f64 / held.len() as f64;
        assert!((0.9..1.1).contains(&share), "{share}");
        let mosaic = sphere.mosaic(lattice, &values);
        for (pixel, held) in held.iter().enumerate() {
            let value = mosaic[pixel][0] as usize;
            assert!(if *held {
                value == pixel
            } else {
                value == 0 || sphere.within(lattice).nth(value) == Some(true)
            });
        }
    }
}
