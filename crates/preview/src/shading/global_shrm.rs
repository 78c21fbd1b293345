//! The global SHRM for a distant viewer [RH02, eq. 12, sec. 7.5]: once per frame every texel is evaluated at
//! the one view V, the sum of B~_pq Y_pq(V), into a plain reflection map. Each pixel then looks up its
//! central direction.
//!
//! The update is the product of a matrix, texels by rows, with the vector Y_pq(V). It reads every coefficient
//! once and is as fast as memory: coefficients are stored in the order in which they are read, in strips
//! whose sums fit into registers.

use brdf::Centre;
use glam::Vec3;
use rayon::prelude::*;
use shrm::Shrm;

use super::cube;
use super::harmonics::Harmonics;
use super::surface::Surface;

/// The number of values of a strip: three for each texel, texels side by side.
const STRIP: usize = 48;
/// The number of texels that a strip covers.
const TEXELS: usize = STRIP / 3;
/// The number of strips of a task.
const TASK: usize = 128;

/// A global map on a cube in the CPU's layout.
#[derive(Clone, Debug)]
pub struct GlobalShrm {
    centre: Centre,
    edge: u32,
    harmonics: Harmonics,
    rows: usize,
    /// The coefficients, shape [strips, rows].
    strips: Vec<[f32; STRIP]>,
}

impl GlobalShrm {
    /// The layout of a global map on a cube; `None` if the map is local or lat-long.
    pub fn new(map: &Shrm) -> Option<Self> {
        let shrm::MapGrid::Cube(cube) = map.grid() else { return None };
        if map.view() != shrm::View::Global {
            return None;
        }
        let rows = map.rows();
        let mut strips = vec![[0.0; STRIP]; cube.len().div_ceil(TEXELS) * rows];
        for (texel, coefficients) in map.values().chunks_exact(rows).enumerate() {
            let (strip, place) = (texel / TEXELS, texel % TEXELS * 3);
            for (row, value) in coefficients.iter().enumerate() {
                strips[strip * rows + row][place..place + 3].copy_from_slice(value);
            }
        }
        let harmonics = Harmonics::new(map.p().get());
        Some(Self { centre: map.centre(), edge: cube.edge as u32, harmonics, rows, strips })
    }

    /// The number of texels.
    pub fn texels(&self) -> usize {
        6 * self.edge as usize * self.edge as usize
    }
}

/// Equation 12: the radiance toward one view at every texel, RGB, in the order of `sphere::Cube`.
///
/// Each texel sums the rows in order: the result is bit-identical for any number of threads.
///
/// # Panics
/// If `radiance` does not have one element per texel.
pub fn global_update_into(map: &GlobalShrm, view: Vec3, radiance: &mut [[f32; 3]]) {
    assert_eq!(radiance.len(), map.texels(), "one value for each texel");
    let mut harmonics = vec![0.0; map.rows];
    map.harmonics.evaluate_into(view, &mut harmonics);
    let tasks = radiance.par_chunks_mut(TASK * TEXELS).zip(map.strips.par_chunks(TASK * map.rows));
    tasks.for_each(|(radiance, strips)| {
        for (radiance, strip) in radiance.chunks_mut(TEXELS).zip(strips.chunks_exact(map.rows)) {
            let mut sums = [0.0; STRIP];
            for (numbers, &harmonic) in strip.iter().zip(&harmonics) {
                for (sum, number) in sums.iter_mut().zip(numbers) {
                    *sum += harmonic * number;
                }
            }
            let radiance = radiance.as_flattened_mut();
            radiance.copy_from_slice(&sums[..radiance.len()]);
        }
    });
}

/// The radiance toward the viewer from a map of [`global_update_into`].
pub fn global_shrm(map: &GlobalShrm, radiance: &[[f32; 3]], surface: &Surface) -> Vec3 {
    cube::sample(map.edge, radiance, surface.central(map.centre))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shading::testkit::{ROUNDING, apart, directions, map, rounded, surfaces};
    use shrm::View;

    fn updated(map: &Shrm, view: Vec3) -> (GlobalShrm, Vec<[f32; 3]>) {
        let short = GlobalShrm::new(map).unwrap();
        let mut radiance = vec![[f32::NAN; 3]; short.texels()];
        global_update_into(&short, view, &mut radiance);
        (short, radiance)
    }

    /// (P + 1)^2 terms, each with one rounding, one more for every sum and 10 (p + 1) for its harmonic.
    #[test]
    fn the_update_is_equation_12() {
        for (edge, p) in [(1, 2), (7, 0), (16, 2), (16, 5), (8, 11), (33, 2)] {
            let map = map(Centre::Reflection, edge, p, View::Global);
            let values = map.values().as_flattened();
            let largest = f64::from(values.iter().fold(0.0_f32, |most, value| most.max(value.abs())));
            let rows = map.rows() as f64;
            let allowed = ROUNDING * largest * rows.sqrt() * (rows + 10.0 * (p + 1) as f64);
            for direction in directions().into_iter().step_by(97) {
                let (short, exact) = rounded(direction);
                let (_, found) = updated(&map, short);
                for (found, expected) in found.into_iter().zip(map.view_map(exact)) {
                    assert!(apart(found.into(), expected.map(f64::from)) < allowed, "{found:?} {expected:?}");
                }
            }
        }
    }

    #[test]
    fn a_pixel_matches_the_kernels_radiance_toward_the_one_view() {
        for centre in [Centre::Reflection, Centre::Normal, Centre::Tangent] {
            let map = map(centre, 32, 2, View::Global);
            let (view, exact) = rounded(sphere::Direction::from_angles(1.1, 0.4));
            let (short, radiance) = updated(&map, view);
            let mut lookup = map.lookup();
            for (surface, [normal, tangent, toward]) in surfaces() {
                let central = centre.central(normal, tangent, toward);
                let expected = lookup.radiance(central, exact).map(f64::from);
                let found = global_shrm(&short, &radiance, &surface);
                assert!(apart(found, expected) < 1e-4, "{found} {expected:?}");
            }
        }
    }

    #[test]
    fn any_number_of_threads_makes_the_same_map() {
        let map = map(Centre::Normal, 40, 3, View::Global);
        let view = Vec3::new(0.6, 0.0, 0.8);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| updated(&map, view).1)
        };
        assert_eq!(with(1), with(3));
    }
}
