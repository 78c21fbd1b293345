//! Cabral's twelve maps (Cabral, Olano and Nemec 1999; [RH02, app. C]): the three maps around the view, each
//! looked up bilinearly, are blended with the view's weights in their triangle, as in `shrm::icosahedron`.
//!
//! > w_a = V.(b x c) / s,  w_b = V.(c x a) / s,  w_c = V.(a x b) / s,  s the sum of the three numerators.

use std::array;

use glam::Vec3;
use shrm::icosahedron::{self, TRIANGLES};

use super::cube;
use super::surface::Surface;

/// The icosahedron's vertices.
#[derive(Clone, Debug)]
pub struct Icosahedron {
    points: [Vec3; 12],
}

impl Default for Icosahedron {
    fn default() -> Self {
        let vertices = icosahedron::vertices();
        Self { points: array::from_fn(|vertex| vertices[vertex].vector().as_vec3()) }
    }
}

impl Icosahedron {
    /// The three vertices around a view and their shares.
    ///
    /// A view lies in the triangle whose centre is nearest.
    pub fn corners(&self, view: Vec3) -> ([usize; 3], [f32; 3]) {
        let dots = self.points.map(|point| point.dot(view));
        let mut nearest = 0;
        let mut most = -4.0;
        for (triangle, [a, b, c]) in TRIANGLES.into_iter().enumerate() {
            let middle = dots[a] + dots[b] + dots[c];
            if middle > most {
                (nearest, most) = (triangle, middle);
            }
        }
        let vertices = TRIANGLES[nearest];
        let [a, b, c] = vertices.map(|vertex| self.points[vertex]);
        let parts = [b.cross(c), c.cross(a), a.cross(b)].map(|across| view.dot(across).max(0.0));
        let sum = parts[0] + parts[1] + parts[2];
        (vertices, parts.map(|part| part / sum))
    }
}

/// The radiance toward the viewer; `maps` has shape [12, texels], with texels in the order of `sphere::Cube`.
pub fn cabral(
    icosahedron: &Icosahedron,
    edge: u32,
    maps: &[[f32; 3]],
    centre: brdf::Centre,
    surface: &Surface,
) -> Vec3 {
    let taps = cube::taps(edge, surface.central(centre));
    let (vertices, shares) = icosahedron.corners(surface.view);
    let texels = maps.len() / 12;
    let mut sum = Vec3::ZERO;
    for (vertex, share) in vertices.into_iter().zip(shares) {
        sum += taps.blend(edge, &maps[vertex * texels..][..texels]) * share;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shading::testkit::{apart, map, surfaces};
    use brdf::Centre;
    use sh::Stop;
    use shrm::{MapViews, View, ViewSet};

    /// Values are about 1; places are off by 8 edge roundings, shares by a few.
    #[test]
    fn radiance_matches_the_kernel() {
        let icosahedron = Icosahedron::default();
        for centre in [Centre::Reflection, Centre::Normal, Centre::Tangent] {
            let map = map(centre, 32, 3, View::Local);
            let maps = ViewSet::from_shrm(&map, MapViews::Icosahedron, Stop::NEVER).unwrap().unwrap();
            for (surface, [normal, tangent, view]) in surfaces() {
                let expected = maps.radiance(centre.central(normal, tangent, view), view).map(f64::from);
                let found = cabral(&icosahedron, 32, maps.maps(), centre, &surface);
                assert!(apart(found, expected) < 5e-5, "{surface:?}: {found} {expected:?}");
            }
        }
    }
}
