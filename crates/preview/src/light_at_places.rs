//! Light that is known at places with normals, such as that of light probes.

use std::fmt::Debug;
use std::sync::Arc;

use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use sh::{Degree, Expansion, rotate};
use sphere::Rotation;
use transfer::{Frames, Transfer, arriving};

/// Light that differs from place to place and with the side that a surface is seen from.
pub trait LightAtPlaces: Debug + Send + Sync {
    /// The degree of the light.
    fn degree(&self) -> Degree;

    /// The light that arrives at a place of a surface with a normal of length 1, in the coordinates of the
    /// scene.
    fn at(&self, place: DVec3, normal: DVec3) -> Expansion;
}

/// Such a light at the vertices of a mesh, in the mesh's coordinates.
#[derive(Clone, Debug)]
pub(crate) struct LightAtMesh {
    pub(crate) light: Arc<dyn LightAtPlaces>,
    /// Brings places from the mesh's coordinates to those of the light.
    pub(crate) to_light: DAffine3,
    /// Turns the light into the mesh's coordinates.
    pub(crate) turn: Rotation,
    /// Whether the object is a mirror image along z.
    pub(crate) is_mirrored: bool,
    /// What is taken of the light.
    pub(crate) degree: Degree,
}

impl PartialEq for LightAtMesh {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.light, &other.light)
            && (self.to_light, self.turn, self.is_mirrored) == (other.to_light, other.turn, other.is_mirrored)
            && self.degree == other.degree
    }
}

impl LightAtMesh {
    /// The light at each vertex: [V, rows, 3], row l l + l + m.
    pub(crate) fn at_vertices(&self, frames: &Frames) -> Vec<f32> {
        // Normals stay normal to a surface under the inverse of the transpose.
        let normals = self.to_light.matrix3.inverse().transpose();
        let vertex = |vertex: usize| {
            let [place, normal] = [frames.positions()[vertex], frames.axes(vertex)[2]];
            let [place, normal] = [place, normal].map(|v| DVec3::from(v.map(f64::from)));
            let normal = (normals * normal).normalize_or_zero();
            let light = self.light.at(self.to_light.transform_point3(place), normal);
            let light = rotate(&light.to_degree(self.degree), self.turn);
            let light = if self.is_mirrored { upside_down(light) } else { light };
            light.coefficients().iter().flat_map(|row| row.map(|x| x as f32)).collect::<Vec<f32>>()
        };
        (0..frames.len()).into_par_iter().flat_map_iter(vertex).collect()
    }

    /// What of that arrives past the mesh, as [`arriving`] has it: linear in each row of the light.
    pub(crate) fn arriving(&self, frames: &Frames, transfer: &[Transfer]) -> Vec<f32> {
        let rows = self.degree.rows();
        let light = self.at_vertices(frames);
        let mut sum = Vec::new();
        for row in 0..rows {
            let mut one = Expansion::zero(self.degree);
            one.coefficients_mut()[row] = [1.0; 3];
            let own = arriving(frames, transfer, &one);
            sum.resize(own.len(), 0.0);
            let each = (own.len() / frames.len().max(1)).max(1);
            let vertices = sum.par_chunks_exact_mut(each).zip(own.par_chunks_exact(each));
            vertices.zip(light.par_chunks_exact(3 * rows)).for_each(|((sum, own), light)| {
                for (at, (sum, own)) in sum.iter_mut().zip(own).enumerate() {
                    *sum += own * light[3 * row + at % 3];
                }
            });
        }
        sum
    }
}

/// The light with +Z and -Z exchanged: Y_lm(x, y, -z) = (-1)^(l + m) Y_lm. A material looks the same in a
/// mirror, so an object that is a mirror image needs no frames of its own.
pub(crate) fn upside_down(mut light: Expansion) -> Expansion {
    for l in 0..=light.degree().get() {
        for row in l * l..(l + 1) * (l + 1) {
            // row = l^2 + l + m, so that l + m has the parity of row - l^2.
            if (row - l * l) % 2 == 1 {
                light.coefficients_mut()[row] = light.coefficients()[row].map(|value| -value);
            }
        }
    }
    light
}
