//! What taps show on the sphere of a report.
//!
//! A material that depends on its tangent is brushed along +Z there, projected into the surface
//! ([`Sphere::brushed`]): its taps and the lights beside them know that direction, as the ground truth does.

use brdf::{Centre, Material};
use rayon::prelude::*;
use sh::Light;
use shrm::Lamps;
use sphere::{DMat3, Direction};
use taps::{AnyTable, ROWS, ScaleSpace, SurfaceFrame, Taps};

use crate::map::has_facets;
use crate::picture::report::sphere::Sphere;

/// The bytes of a light: direction, radius and irradiance as seven 32-bit numbers.
pub(crate) const LIGHT_BYTES: usize = 28;

/// What a material reflects of lights beside a scale space, at each pixel of the sphere.
pub(crate) fn beside_taps(sphere: &Sphere, lights: &[Light], material: &Material) -> Vec<[f64; 3]> {
    let lamps = Lamps { lights: lights.to_vec(), material: material.clone() };
    let (lamps, view) = (lamps.for_views(), Sphere::view());
    if has_facets(material) {
        let frames = sphere.brushed();
        return frames.par_iter().map(|frame| lamps.surface_radiance(*frame, view)).collect();
    }
    let central = sphere.central(material.centre());
    central.par_iter().map(|central| lamps.radiance(*central, view)).collect()
}

/// What taps show at each pixel of the sphere, with the lights beside their scale space, of which each pixel
/// reflects `beside`.
pub(crate) fn shown_by_taps(
    sphere: &Sphere,
    table: AnyTable<'_>,
    space: &ScaleSpace,
    beside: &[[f64; 3]],
) -> Vec<[f32; 3]> {
    let (frames, view) = (sphere.brushed(), Sphere::view());
    let normals = sphere.central(Centre::Normal);
    let pixels = normals.par_iter().zip(&frames).zip(beside);
    let pixel = |((normal, frame), beside): ((&Direction, &DMat3), &[f64; 3])| {
        let frame = SurfaceFrame::new(*normal, Direction::normalised(frame.x_axis));
        let soft = table.reflected(space, frame, view);
        std::array::from_fn(|channel| (soft[channel] + beside[channel]) as f32)
    };
    pixels.map(pixel).collect()
}

/// The bytes of a compact map: texels of four bytes, halves in the table, and the lights.
pub(crate) fn compact_bytes(space: &ScaleSpace, table: AnyTable<'_>) -> usize {
    let texels: usize = space.levels().iter().chain(space.normals()).map(|map| map.cube().len()).sum();
    let columns = match table {
        AnyTable::Angle(_) => ROWS,
        AnyTable::View(table) => table.nodes().len(),
    };
    let rows = 2 * table.taps() + table.normals();
    4 * texels + 8 * columns * rows + LIGHT_BYTES * space.lights().len()
}
