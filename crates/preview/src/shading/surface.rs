//! The point of a surface that a mode shades, in the light's frame.
//!
//! Surfaces have two sides: the normal of a back face is flipped. An interpolated normal, or one from a file,
//! may still point away from the viewer. If N.V < e, it is bent toward the view V,
//!
//! > N' = N + (e - N.V) V, normalised.
//!
//! This is continuous, keeps N'.V at e or above, and maps even N = -V to V.

use brdf::Centre;
use glam::Vec3;

/// The bound e: the smallest cosine between the normal and the view before the bent normal is normalised.
pub const GRAZING: f32 = 1e-3;

/// The square of a length that counts as 0.
const NOTHING: f32 = 1e-24;

/// If a smaller share of a tangent's square is perpendicular to the normal, that part is mostly rounding.
const ALONG: f32 = 1e-6;

/// A point of a surface. Unit vectors in the light's frame; normal and tangent are perpendicular.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The normal, on the viewer's side.
    pub normal: Vec3,
    /// The tangent.
    pub tangent: Vec3,
    /// The direction toward the viewer.
    pub view: Vec3,
}

impl Surface {
    /// The surface with an interpolated normal and tangent, at the end of a ray; all vectors may have any
    /// length.
    ///
    /// `front` says whether the viewer sees the face's outer side. A normal of length 0 becomes the view, and
    /// a tangent along the normal becomes any perpendicular direction.
    pub fn new(normal: Vec3, tangent: Vec3, ray: Vec3, front: bool) -> Self {
        let view = -ray.normalize();
        let side = if front { normal } else { -normal };
        let mut normal = unit_or(side, view);
        let cosine = normal.dot(view);
        if cosine < GRAZING {
            normal = (normal + view * (GRAZING - cosine)).normalize();
        }
        let rest = tangent - normal * normal.dot(tangent);
        let square = rest.dot(rest);
        let is_along = square <= NOTHING || square <= ALONG * tangent.dot(tangent);
        let tangent = if is_along { across(normal) } else { rest / square.sqrt() };
        Self { normal, tangent, view }
    }

    /// The central direction of a map: the reflection of the view about the normal, 2 (N.V) N - V; the
    /// normal; or the tangent.
    pub fn central(&self, centre: Centre) -> Vec3 {
        match centre {
            Centre::Reflection => self.normal * (2.0 * self.normal.dot(self.view)) - self.view,
            Centre::Normal => self.normal,
            Centre::Tangent => self.tangent,
        }
    }
}

/// The direction of `v`, or `other` if the length of `v` counts as 0.
pub(super) fn unit_or(v: Vec3, other: Vec3) -> Vec3 {
    let square = v.dot(v);
    if square > NOTHING { v / square.sqrt() } else { other }
}

/// A direction perpendicular to a normal.
pub(super) fn across(normal: Vec3) -> Vec3 {
    let other = if normal.z.abs() < 0.9 { Vec3::Z } else { Vec3::X };
    other.cross(normal).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shading::testkit::{apart, directions, surfaces};

    /// Errors are a few roundings of vectors of length 1.
    #[test]
    fn the_central_direction_matches_the_kernels() {
        for (surface, [normal, tangent, view]) in surfaces() {
            for centre in [Centre::Reflection, Centre::Normal, Centre::Tangent] {
                let expected = centre.central(normal, tangent, view).vector().to_array();
                assert!(apart(surface.central(centre), expected) < 1e-6, "{surface:?}");
            }
        }
    }

    #[test]
    fn every_surface_is_a_frame_that_faces_the_viewer() {
        let directions: Vec<Vec3> = directions().iter().map(|d| d.vector().as_vec3()).collect();
        let odd = [Vec3::ZERO, Vec3::splat(1e-20), Vec3::X * 1e15, Vec3::Z];
        for (k, &ray) in directions.iter().enumerate() {
            for normal in [directions[k * 5 % directions.len()], ray, -ray, odd[k % 4]] {
                for tangent in [directions[k * 11 % directions.len()], normal, odd[(k + 1) % 4]] {
                    for front in [false, true] {
                        let surface = Surface::new(normal, tangent, ray * 3.0, front);
                        let Surface { normal: n, tangent: t, view: v } = surface;
                        for unit in [n, t, v] {
                            assert!((unit.length() - 1.0).abs() < 1e-6, "{surface:?}");
                        }
                        // The tangent's rounding over its perpendicular part: 1e-7 / 1e-3.
                        assert!(n.dot(t).abs() < 3e-4, "{surface:?}");
                        assert!(n.dot(v) > 0.99 * GRAZING, "{surface:?} {}", n.dot(v));
                    }
                }
            }
        }
    }

    #[test]
    fn only_a_normal_that_points_away_is_bent_and_as_little_as_possible() {
        let ray = -Vec3::Z;
        let tilted = |cosine: f32| Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
        for cosine in [1.0, 0.5, 0.01] {
            let unchanged = Surface::new(tilted(cosine) * 2.0, Vec3::Y, ray, true);
            assert!((unchanged.normal - tilted(cosine)).length() < 1e-6);
            assert_eq!(Surface::new(-tilted(cosine) * 2.0, Vec3::Y, ray, false), unchanged);
        }
        for cosine in [-0.5, -0.01, 0.0] {
            let bent = Surface::new(tilted(cosine), Vec3::Y, ray, true).normal;
            assert!((bent - Vec3::X).length() < 2.0 * GRAZING, "{bent}");
        }
    }
}
