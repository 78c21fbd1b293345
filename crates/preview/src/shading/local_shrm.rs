//! The local SHRM at a pixel [RH02, eqs. 6 and 7, sec. 7.5]: four texels around the central direction C, each
//! evaluated at the view in its own frame, are blended.
//!
//! A texel at (alpha, beta) has coefficients over w_o = R^-1 V with R = R_z(beta) R_y(alpha). The axes of R
//! follow from the texel's direction c without angles: s = (c_z x, c_z y, -sin alpha), e = (-y, x, 0) and c,
//! where (x, y) is the direction of (c_x, c_y), and (1, 0) at a pole. A zonal map has only the rows q = 0 and
//! depends only on V.c.

use brdf::Centre;
use glam::{Vec3, Vec3A, Vec4};
use shrm::{Shrm, Terms};

use super::cube::{self, Taps};
use super::harmonics::Harmonics;
use super::surface::Surface;

/// A local map on a cube in the CPU's layout: each coefficient fills a vector of four.
#[derive(Clone, Debug)]
pub struct LocalShrm {
    centre: Centre,
    edge: u32,
    zonal: bool,
    rows: usize,
    harmonics: Harmonics,
    /// The coefficients, shape [texels, rows].
    coefficients: Vec<Vec3A>,
}

impl LocalShrm {
    /// The layout of a local map on a cube; `None` if the map is global or lat-long.
    pub fn new(map: &Shrm) -> Option<Self> {
        let shrm::MapGrid::Cube(cube) = map.grid() else { return None };
        (map.view() == shrm::View::Local).then(|| Self {
            centre: map.centre(),
            edge: cube.edge as u32,
            zonal: map.terms() == Terms::Zonal,
            rows: map.rows(),
            harmonics: Harmonics::new(map.p().get()),
            coefficients: map.values().iter().map(|&value| Vec3A::from(value)).collect(),
        })
    }
}

/// Radiance toward the viewer.
pub fn local_shrm(map: &LocalShrm, surface: &Surface) -> Vec3 {
    let taps = cube::taps(map.edge, surface.central(map.centre));
    let harmonics = &map.harmonics;
    let texels = taps.texel.map(|texel| &map.coefficients[texel.index(map.edge) * map.rows..][..map.rows]);
    // One sum per texel, so that the additions are independent.
    let mut sums = [Vec3A::ZERO; 4];
    let mut add = |row: usize, share: Vec4| {
        for k in 0..4 {
            sums[k] += texels[k][row] * share[k];
        }
    };
    let [x, y, z] = into_frames(&taps, map.edge, surface.view);
    let weight = Vec4::from(taps.weight);
    if map.zonal {
        harmonics.zonal(z, weight, add);
    } else {
        harmonics.visit([x, y, z], weight, |p, q, cosine, sine| {
            add(p * p + p + q, cosine);
            if q > 0 {
                add(p * p + p - q, sine);
            }
        });
    }
    (sums[0] + sums[1] + (sums[2] + sums[3])).into()
}

/// The parts x, y and z of R^-1 V in the frames of four texels, one lane each.
fn into_frames(taps: &Taps, edge: u32, v: Vec3) -> [Vec4; 3] {
    let centres = taps.texel.map(|texel| texel.centre(edge));
    let lanes = |axis: usize| Vec4::from_array(centres.map(|centre| centre[axis]));
    let [x, y, z] = [lanes(0), lanes(1), lanes(2)];
    let length = (x * x + y * y + z * z).sqrt();
    let [x, y, z] = [x / length, y / length, z / length];
    let sine = (x * x + y * y).sqrt();
    let is_off_pole = sine.cmpgt(Vec4::ZERO);
    let cosine_beta = Vec4::select(is_off_pole, x / sine, Vec4::ONE);
    let sine_beta = Vec4::select(is_off_pole, y / sine, Vec4::ZERO);
    [
        z * cosine_beta * v.x + z * sine_beta * v.y - sine * v.z,
        cosine_beta * v.y - sine_beta * v.x,
        x * v.x + y * v.y + z * v.z,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shading::testkit::{ROUNDING, apart, map, surfaces};
    use shrm::View;

    /// The place of a tap is off by about 8 edge roundings of the largest value, and each of the (P + 1)^2
    /// harmonics by 10 (p + 1) roundings.
    fn check(map: &Shrm) {
        let values = map.values().as_flattened();
        let largest = values.iter().fold(0.0_f32, |most, value| most.max(value.abs()));
        let shrm::MapGrid::Cube(cube) = map.grid() else { unreachable!() };
        let p = map.p().get();
        let size = f64::from(largest) * (map.rows() as f64 * (2 * p + 1) as f64).sqrt();
        let allowed = ROUNDING * size * (8 * cube.edge + 10 * (p + 1)) as f64;
        let mut lookup = map.lookup();
        let short = LocalShrm::new(map).unwrap();
        for (surface, [normal, tangent, view]) in surfaces() {
            let central = map.centre().central(normal, tangent, view);
            let expected = lookup.radiance(central, view).map(f64::from);
            let found = local_shrm(&short, &surface);
            assert!(apart(found, expected) < allowed, "{surface:?}: {found} {expected:?}, {allowed:e}");
        }
    }

    #[test]
    fn radiance_matches_the_kernel() {
        for centre in [Centre::Reflection, Centre::Normal, Centre::Tangent] {
            for (edge, p) in [(1, 2), (16, 0), (33, 2), (64, 5), (16, 12)] {
                check(&map(centre, edge, p, View::Local));
            }
        }
    }

    #[test]
    fn radiance_of_zonal_maps_matches_the_kernel() {
        let all = map(Centre::Reflection, 16, 6, View::Local);
        let rows = (0..all.grid().len())
            .flat_map(|texel| (0..=6).map(|p| all.texel(texel)[p * p + p]).collect::<Vec<_>>())
            .collect();
        check(&Shrm::new(all.grid(), View::Local, all.centre(), all.p(), Terms::Zonal, rows).unwrap());
    }

    #[test]
    fn only_local_maps_on_cubes_are_accepted() {
        assert!(LocalShrm::new(&map(Centre::Normal, 4, 1, View::Global)).is_none());
        let grid = shrm::MapGrid::LatLong(sphere::LatLong::with_rows(8));
        assert!(
            LocalShrm::new(&map(Centre::Normal, 4, 1, View::Local).resampled(grid, View::Local)).is_none()
        );
    }
}
