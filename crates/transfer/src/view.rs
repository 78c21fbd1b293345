//! The entries of a table toward the viewer, in the frame of a vertex.

use brdf::BrdfTable;
use glam::Vec3;
use sh::{Degree, Expansion};
use sphere::{DVec3, Direction};

use crate::frames::{Frames, single};
use crate::shading::Viewer;

/// The direction from a vertex toward the viewer, in the vertex' frame; the normal if the viewer stands
/// there.
#[inline(always)]
pub(crate) fn local_view(frames: &Frames, viewer: Viewer, vertex: usize) -> Direction {
    let view = match viewer {
        Viewer::Distant(direction) => single(direction),
        Viewer::At(place) => {
            let position = frames.positions()[vertex].map(f64::from);
            let away = DVec3::from_array(place) - DVec3::from_array(position);
            Direction::new(away).map_or(Vec3::from(frames.normal(vertex)), single)
        }
    };
    Direction::normalised(frames.local(vertex, view).as_dvec3())
}

/// c_i toward the viewer, [(F+1)^2, channels].
#[inline(always)]
pub(crate) fn look_up(frames: &Frames, table: &BrdfTable, viewer: Viewer, vertex: usize, c: &mut [f32]) {
    table.lookup_into(0, local_view(frames, viewer, vertex), c);
}

/// Rows of each channel of a light up to a degree.
pub(crate) fn by_channel(light: &Expansion, degree: Degree) -> [Vec<f32>; 3] {
    [0, 1, 2].map(|c| light.coefficients()[..degree.rows()].iter().map(|rgb| rgb[c] as f32).collect())
}

/// The sum of products, in eight sums that fill a vector register.
#[inline(always)]
pub(crate) fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; 8];
    let (blocks_a, rest_a) = a.as_chunks::<8>();
    let (blocks_b, rest_b) = b.as_chunks::<8>();
    for (a, b) in blocks_a.iter().zip(blocks_b) {
        (0..8).for_each(|lane| sums[lane] += a[lane] * b[lane]);
    }
    let rest: f32 = rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f32>() + rest
}
