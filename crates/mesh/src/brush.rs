//! The direction of brushing: tangents along a constant vector, or turned about the normal.
//!
//! A brushed metal has its scratches along the tangent. Kautz, Sloan and Snyder [KSS02, sec. 6] project a
//! constant vector b into the surface at each point: T = b - N (N.b), normalised. A turn by an angle a takes
//! that to cos(a) T + sin(a) B, with the bitangent B = w (N x T): where a texture is mirrored (w = -1), so is
//! the turn.

use glam::DVec3;

use crate::Mesh;
use crate::normals::{double, unit};

/// The sine of the angle between N and the vector below which the vector has no direction in the surface.
const PARALLEL: f64 = 1e-3;

impl Mesh {
    /// The mesh with tangents along a vector projected into the surface, or along its own if there is none,
    /// then turned about the normal by the angle of each vertex, in radians; and the number of vertices that
    /// keep their own direction because the normal is parallel to the vector.
    ///
    /// # Example: the plane's tangents are +X; a quarter turn takes them to +Y
    /// ```
    /// let plane = mesh::shape("plane").unwrap();
    /// let (turned, parallel) = plane.brushed(None, |_| std::f64::consts::FRAC_PI_2);
    /// let [x, y, ..] = turned.tangents()[0];
    /// assert!(x.abs() < 1e-7 && y == 1.0 && parallel == 0);
    /// assert_eq!(plane.brushed(Some([0.0, 0.0, 1.0]), |_| 0.0).1, 4);
    /// ```
    pub fn brushed(&self, vector: Option<[f64; 3]>, turn: impl Fn(usize) -> f64) -> (Self, usize) {
        let vector = vector.and_then(|vector| DVec3::from_array(vector).try_normalize());
        let mut parallel = 0;
        let brushed = |(vertex, (normal, &[x, y, z, w])): (usize, (&[f32; 3], &[f32; 4]))| {
            let normal = double(*normal);
            let own = double([x, y, z]);
            let along = match vector.map(|vector| vector - normal * normal.dot(vector)) {
                Some(level) if level.length() > PARALLEL => level.normalize(),
                Some(_) => {
                    parallel += 1;
                    own
                }
                None => own,
            };
            let (sine, cosine) = math::sin_cos(turn(vertex));
            let turned = along * cosine + normal.cross(along) * (f64::from(w) * sine);
            let [x, y, z] = unit(turned).unwrap_or([x, y, z]);
            [x, y, z, w]
        };
        let tangents = self.normals().iter().zip(self.tangents()).enumerate().map(brushed).collect();
        let mesh = Self::from_complete(
            self.positions().to_vec(),
            self.normals().to_vec(),
            tangents,
            self.coordinates().map(<[_]>::to_vec),
            self.triangles().to_vec(),
        );
        (mesh.with_materials_of(self), parallel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_lie_in_the_surface_along_the_vector() {
        let sphere = crate::shape("sphere").unwrap();
        let vector = DVec3::new(0.0, 0.0, 2.0);
        let (brushed, parallel) = sphere.brushed(Some(vector.to_array()), |_| 0.0);
        // The poles are parallel: a vertex for each of 257 columns.
        assert_eq!(parallel, 2 * 257);
        for (normal, [x, y, z, w]) in brushed.normals().iter().zip(brushed.tangents()) {
            let (normal, tangent) = (double(*normal), double([*x, *y, *z]));
            assert!(normal.dot(tangent).abs() < 1e-6 && (tangent.length() - 1.0).abs() < 1e-6 && *w == 1.0);
            // In the plane of the normal and the vector, on its side.
            assert!(normal.cross(vector).dot(tangent).abs() < 1e-6 && tangent.z > -1e-6);
        }
        assert_eq!((brushed.positions(), brushed.triangles()), (sphere.positions(), sphere.triangles()));
    }

    #[test]
    fn a_mirrored_tangent_turns_the_other_way() {
        let normals = vec![[0.0, 0.0, 1.0]; 2];
        let tangents = vec![[1.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, -1.0]];
        let mesh = Mesh::new(vec![[0.0; 3]; 2], normals, tangents, None, Vec::new()).unwrap();
        let (turned, _) = mesh.brushed(None, |_| 0.5);
        let [a, b] = turned.tangents() else { panic!("two") };
        assert_eq!(a[..3], [0.5f64.cos() as f32, 0.5f64.sin() as f32, 0.0]);
        assert_eq!(b[..3], [a[0], -a[1], 0.0]);
    }
}
