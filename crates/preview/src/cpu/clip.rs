//! Clipping of triangles (Sutherland and Hodgman 1974).
//!
//! There are six planes: near and far, as on a graphics device, and one far outside the picture on each side,
//! so that the remaining screen coordinates fit into integers. A new corner is always computed from the inner
//! end of its edge to the outer one, so that two triangles that share an edge have bit-identical new corners.

use glam::{Vec2, Vec3, Vec4};

/// A corner of a triangle before division.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Corner {
    /// The clip coordinates of the corner.
    pub(super) clip: Vec4,
    /// The position in the mesh's coordinates.
    pub(super) position: Vec3,
    /// The normal in the light's frame, of any length.
    pub(super) normal: Vec3,
    /// The tangent in the light's frame, of any length.
    pub(super) tangent: Vec3,
    /// The coordinates of the texture, if the object shows one.
    pub(super) coordinates: Vec2,
}

/// The clipping planes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Planes {
    /// The largest x / w and y / w.
    guard: Vec2,
}

/// Larger coordinates might overflow f32; no visible point has them.
const MAX_COORDINATE: f32 = 1e30;

impl Planes {
    /// The planes of a picture with this size in samples, 2^17 samples or more beyond each side.
    pub(super) fn new(size: [u32; 2]) -> Self {
        let reach = |samples: u32| 1.0 + 262_144.0 / samples.max(1) as f32;
        Self { guard: Vec2::new(reach(size[0]), reach(size[1])) }
    }

    /// The distance of a point to the inner side of each plane.
    fn inside(&self, clip: Vec4) -> [f32; 6] {
        let reach = self.guard * clip.w;
        [clip.z, clip.w - clip.z, reach.x + clip.x, reach.x - clip.x, reach.y + clip.y, reach.y - clip.y]
    }

    /// One bit for each plane that a point is outside of; [`LOST`] if its coordinates are not usable.
    pub(super) fn outside(&self, clip: Vec4) -> u8 {
        if clip.to_array().iter().any(|value| value.is_nan() || value.abs() > MAX_COORDINATE) {
            return LOST;
        }
        let bits = self.inside(clip).into_iter().enumerate();
        bits.map(|(plane, inside)| if inside >= 0.0 { 0 } else { 1 << plane }).sum()
    }

    /// The clipped triangle, 0 or 3 to 9 corners in its order. `crossed` has a bit for each clipping plane.
    pub(super) fn cut(&self, triangle: [Corner; 3], crossed: u8) -> Vec<Corner> {
        let mut polygon = triangle.to_vec();
        for plane in (0..6).filter(|plane| crossed >> plane & 1 == 1) {
            let inside = |corner: &Corner| self.inside(corner.clip)[plane];
            let mut next = Vec::with_capacity(polygon.len() + 1);
            for (k, corner) in polygon.iter().enumerate() {
                let other = &polygon[(k + 1) % polygon.len()];
                let (here, there) = (inside(corner), inside(other));
                if here >= 0.0 {
                    next.push(*corner);
                    if there < 0.0 {
                        next.push(between(corner, other, here / (here - there)));
                    }
                } else if there >= 0.0 {
                    next.push(between(other, corner, there / (there - here)));
                }
            }
            polygon = next;
        }
        polygon
    }
}

/// The result of [`Planes::outside`] for coordinates that are infinite, NaN or too large.
pub(super) const LOST: u8 = 0xff;

/// A point on the edge from the inner corner to the outer one.
fn between(inner: &Corner, outer: &Corner, share: f32) -> Corner {
    let between = |inner: Vec3, outer: Vec3| inner + (outer - inner) * share;
    Corner {
        clip: inner.clip + (outer.clip - inner.clip) * share,
        position: between(inner.position, outer.position),
        normal: between(inner.normal, outer.normal),
        tangent: between(inner.tangent, outer.tangent),
        coordinates: inner.coordinates + (outer.coordinates - inner.coordinates) * share,
    }
}
