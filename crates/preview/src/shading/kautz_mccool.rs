//! Kautz and McCool's texture (2000; [RH02, app. C]): a reflection map for each of several evenly spaced
//! angles between the central direction and the view, 0 to pi. Look-ups are bilinear in a slice and linear
//! between two.

use std::f32::consts::PI;

use brdf::Centre;
use glam::Vec3;

use super::angles::angle;
use super::cube;
use super::surface::Surface;

/// The radiance toward the viewer; `slices` has shape [count, texels], with texels in the order of
/// `sphere::Cube`. The angle of slice k is pi k / (count - 1).
pub fn kautz_mccool(edge: u32, slices: &[[f32; 3]], count: usize, centre: Centre, surface: &Surface) -> Vec3 {
    let central = surface.central(centre);
    let angle = angle(central.cross(surface.view).length(), central.dot(surface.view));
    let last = count - 1;
    let position = angle / PI * last as f32;
    let low = (position as usize).min(last);
    let high = (low + 1).min(last);
    let share = position - low as f32;
    let taps = cube::taps(edge, central);
    let texels = slices.len() / count;
    let slice = |k: usize| taps.blend(edge, &slices[k * texels..][..texels]);
    let (a, b) = (slice(low), slice(high));
    a + (b - a) * share
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shading::testkit::{apart, map, surfaces};
    use sh::Stop;
    use shrm::{MapViews, View, ViewSet};

    /// Values are about 1; places are off by 8 edge roundings, the place between slices by `count` roundings.
    #[test]
    fn radiance_matches_the_kernel() {
        for (centre, count) in
            [(Centre::Reflection, 1), (Centre::Normal, 2), (Centre::Tangent, 9), (Centre::Reflection, 16)]
        {
            let map = map(centre, 32, 3, View::Local);
            let texture =
                ViewSet::from_shrm(&map, MapViews::even_angles(count), Stop::NEVER).unwrap().unwrap();
            for (surface, [normal, tangent, view]) in surfaces() {
                let expected = texture.radiance(centre.central(normal, tangent, view), view).map(f64::from);
                let found = kautz_mccool(32, texture.maps(), count, centre, &surface);
                assert!(apart(found, expected) < 5e-5, "{surface:?}: {found} {expected:?}");
            }
        }
    }
}
