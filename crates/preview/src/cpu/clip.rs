//! Triangles cut by what a projection can show (Sutherland and Hodgman 1974).
//!
//! Six planes: near and far, as a graphics device cuts, and on each side one far outside of the picture, so that
//! what is left has screen coordinates that fit whole numbers. A new corner is always computed from the inner end of its edge to
//! the outer one, so that two triangles that share an edge share the new corner to the bit.

use glam::{Vec2, Vec3, Vec4};

/// A corner of a triangle before division.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Corner {
    /// Clip coordinates.
    pub(super) clip: Vec4,
    /// The normal in the light's frame, of any length.
    pub(super) normal: Vec3,
    /// The tangent in the light's frame, of any length.
    pub(super) tangent: Vec3,
}

/// The planes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Planes {
    /// x and y may be as many times w as this.
    guard: Vec2,
}

/// Past this f32 may overflow on the way; nothing that is seen is as far.
const FAR_OUT: f32 = 1e30;

impl Planes {
    /// Those of a picture with a size in samples: 2^17 samples or more beyond each side.
    pub(super) fn new(size: [u32; 2]) -> Self {
        let reach = |samples: u32| 1.0 + 262_144.0 / samples.max(1) as f32;
        Self { guard: Vec2::new(reach(size[0]), reach(size[1])) }
    }

    /// How far a point is inside each plane.
    fn inside(&self, clip: Vec4) -> [f32; 6] {
        let reach = self.guard * clip.w;
        [clip.z, clip.w - clip.z, reach.x + clip.x, reach.x - clip.x, reach.y + clip.y, reach.y - clip.y]
    }

    /// One bit for each plane that a point is outside of; all of them where it is no point.
    pub(super) fn outside(&self, clip: Vec4) -> u8 {
        if clip.to_array().iter().any(|value| value.is_nan() || value.abs() > FAR_OUT) {
            return LOST;
        }
        let bits = self.inside(clip).into_iter().enumerate();
        bits.map(|(plane, inside)| if inside >= 0.0 { 0 } else { 1 << plane }).sum()
    }

    /// What the planes leave of a triangle, 0 or 3 to 9 corners in its order. `crossed` has a bit for each plane to cut by.
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

/// What [`Planes::outside`] says of numbers that are infinite, not numbers, or too large.
pub(super) const LOST: u8 = 0xff;

/// A point of the edge from the inner corner to the outer one.
fn between(inner: &Corner, outer: &Corner, share: f32) -> Corner {
    Corner {
        clip: inner.clip + (outer.clip - inner.clip) * share,
        normal: inner.normal + (outer.normal - inner.normal) * share,
        tangent: inner.tangent + (outer.tangent - inner.tangent) * share,
    }
}
