//! The parts of a mesh in a file, and their completion to a mesh.

use glam::{DAffine3, DMat3};

use crate::mesh::{List, Mesh, MeshError, check};
use crate::normals::{double, flat_normals, unit_normals};
use crate::tangents::{by_coordinates, unit_tangents, without_coordinates};

/// The parts of a mesh in a file: each list that is given has one entry for every vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parts {
    /// The positions of the vertices.
    pub positions: Vec<[f32; 3]>,
    /// The normals of the vertices, of any length.
    pub normals: Option<Vec<[f32; 3]>>,
    /// The tangents of the vertices, of any length, and the sign of the bitangent.
    pub tangents: Option<Vec<[f32; 4]>>,
    /// The texture coordinates of the vertices, v downward.
    pub coordinates: Option<Vec<[f32; 2]>>,
    /// The vertices of each triangle, counter-clockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Parts {
    /// The complete mesh, by the rules of the glTF 2.0 specification (section 3.7.2.1).
    ///
    /// - Without normals every triangle is flat: it gets three vertices of its own, and the tangents of the
    ///   file are ignored. A normal of length 0 becomes the mean of the triangles around its vertex, weighted
    ///   by area.
    /// - Without tangents, MikkTSpace computes them from the coordinates; a vertex with several tangents
    ///   becomes several vertices. Without coordinates, or if they are degenerate, the tangent is Z x N,
    ///   toward the east, or X at a pole. Tangents of a file are made orthogonal to the normals.
    ///
    /// Triangles keep their number and order; those without area are kept too, and do not contribute to their
    /// neighbours.
    ///
    /// # Errors
    /// The errors of [`Mesh::new`].
    pub fn complete(self) -> Result<Mesh, MeshError> {
        Ok(self.complete_with_sources()?.0)
    }

    /// Returns the mesh of [`Parts::complete`], and for each of its vertices the one of the parts that it was
    /// made of.
    ///
    /// # Errors
    /// The errors of [`Mesh::new`].
    pub fn complete_with_sources(self) -> Result<(Mesh, Vec<u32>), MeshError> {
        self.check()?;
        let mut sources: Vec<u32> = (0..self.positions.len() as u32).collect();
        let Self { mut positions, normals, mut tangents, mut coordinates, mut triangles } = self;
        let mut normals = match normals {
            Some(mut normals) => {
                unit_normals(&mut normals, &positions, &triangles);
                normals
            }
            None => {
                tangents = None;
                let corners = || triangles.iter().flatten().map(|&vertex| vertex as usize);
                coordinates = coordinates.map(|pairs| corners().map(|vertex| pairs[vertex]).collect());
                let normals = flat_normals(&positions, &triangles);
                sources = triangles.iter().flatten().copied().collect();
                positions = corners().map(|vertex| positions[vertex]).collect();
                triangles = (0..triangles.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
                normals
            }
        };
        let tangents = match (tangents, &coordinates) {
            (Some(tangents), _) => unit_tangents(&tangents, &normals),
            (None, None) => without_coordinates(&normals),
            (None, Some(pairs)) => {
                let made = by_coordinates(&positions, &normals, pairs, &triangles);
                for &vertex in &made.copied {
                    positions.push(positions[vertex as usize]);
                    normals.push(normals[vertex as usize]);
                }
                sources.extend(&made.copied);
                let copied = made.copied.iter().map(|&vertex| pairs[vertex as usize]);
                coordinates = Some(pairs.iter().copied().chain(copied).collect());
                triangles = made.triangles;
                made.tangents
            }
        };
        Ok((Mesh::from_complete(positions, normals, tangents, coordinates, triangles), sources))
    }

    /// Returns the same parts with each vertex transformed by a map of its own: normals stay orthogonal to
    /// the surface, tangents stay along it.
    ///
    /// A map that mirrors inverts the signs of bitangents and the orientation of the triangles that begin
    /// with the vertex, so that the outside stays outside. A map that flattens may leave normals and tangents
    /// of length 0.
    #[must_use]
    pub fn posed(mut self, map: impl Fn(usize) -> DAffine3) -> Self {
        let mut mirrored = Vec::with_capacity(self.positions.len());
        for (vertex, position) in self.positions.iter_mut().enumerate() {
            let map = map(vertex);
            let linear = map.matrix3;
            let mirrors = linear.determinant() < 0.0;
            *position = map.transform_point3(double(*position)).as_vec3().to_array();
            if let Some(normal) = self.normals.as_mut().and_then(|normals| normals.get_mut(vertex)) {
                // The cofactors are the inverse transpose times the determinant; they exist without an
                // inverse.
                let DMat3 { x_axis, y_axis, z_axis } = linear;
                let cofactors =
                    DMat3::from_cols(y_axis.cross(z_axis), z_axis.cross(x_axis), x_axis.cross(y_axis));
                let outward = cofactors * double(*normal) * if mirrors { -1.0 } else { 1.0 };
                *normal = outward.normalize_or_zero().as_vec3().to_array();
            }
            if let Some(tangent) = self.tangents.as_mut().and_then(|tangents| tangents.get_mut(vertex)) {
                let [x, y, z, sign] = *tangent;
                let along = (linear * double([x, y, z])).normalize_or_zero().as_vec3();
                *tangent = along.extend(if mirrors { -sign } else { sign }).to_array();
            }
            mirrored.push(mirrors);
        }
        for corners in &mut self.triangles {
            if mirrored.get(corners[0] as usize) == Some(&true) {
                corners.swap(1, 2);
            }
        }
        self
    }

    fn check(&self) -> Result<(), MeshError> {
        // In the worst case every corner becomes an additional vertex.
        let most = self.triangles.len().saturating_mul(3).saturating_add(self.positions.len());
        if u32::try_from(most).is_err() {
            return Err(MeshError(format!("{most} vertices are more than 32 bits can count")));
        }
        let mut lists = vec![List::of("positions", &self.positions)];
        lists.extend(self.normals.as_deref().map(|normals| List::of("normals", normals)));
        lists.extend(self.tangents.as_deref().map(|tangents| List::of("tangents", tangents)));
        lists.extend(self.coordinates.as_deref().map(|pairs| List::of("coordinates", pairs)));
        check(self.positions.len(), &lists, &self.triangles)
    }
}

impl Mesh {
    /// The mesh transformed by an affine map: normals stay orthogonal to the surface, tangents stay along it.
    ///
    /// A map that mirrors inverts the orientation of triangles and the signs of bitangents, so that the
    /// outside stays outside. After a map that flattens, normals and tangents of length 0 are replaced as by
    /// [`Parts::complete`].
    ///
    /// # Errors
    /// If a position becomes too large.
    pub fn transformed(&self, place: &DAffine3) -> Result<Self, MeshError> {
        let parts = Parts {
            positions: self.positions().to_vec(),
            normals: Some(self.normals().to_vec()),
            tangents: Some(self.tangents().to_vec()),
            coordinates: self.coordinates().map(<[_]>::to_vec),
            triangles: self.triangles().to_vec(),
        };
        Ok(parts.posed(|_| *place).complete()?.with_materials_of(self))
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};
    use proptest::prelude::*;

    use super::*;
    use crate::{SHAPES, shape};

    /// Two triangles of a square in the plane z = 0, seen from above, with the coordinate u(x) at its
    /// vertices.
    fn square(u: impl Fn(f32) -> f32) -> Parts {
        let positions = vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
        Parts {
            normals: Some(vec![[0.0, 0.0, 3.0]; 4]),
            coordinates: Some(positions.iter().map(|&[x, y, _]| [u(x), -y]).collect()),
            positions,
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Parts::default()
        }
    }

    fn assert_sound(mesh: &Mesh) {
        for (&normal, &[x, y, z, sign]) in mesh.normals().iter().zip(mesh.tangents()) {
            let (normal, tangent) = (Vec3::from(normal), Vec3::new(x, y, z));
            assert!((normal.length() - 1.0).abs() < 1e-6 && (tangent.length() - 1.0).abs() < 1e-6);
            assert!(normal.dot(tangent).abs() < 1e-6 && sign.abs() == 1.0, "{normal} {tangent} {sign}");
        }
    }

    /// Flat triangles, and a vertex with two tangents.
    #[test]
    fn every_vertex_knows_what_it_was_made_of() {
        let flat = Parts { normals: None, coordinates: None, ..square(|x| x) };
        let mirrored = square(|x| if x < 0.0 { 1.0 } else { 0.0 });
        for parts in [flat, mirrored, square(|x| x)] {
            let given = parts.positions.clone();
            let (mesh, sources) = parts.complete_with_sources().unwrap();
            assert_eq!(mesh.positions().len(), sources.len());
            for (position, source) in mesh.positions().iter().zip(sources) {
                assert_eq!(*position, given[source as usize]);
            }
        }
    }

    /// MikkTSpace does not know the formulas of these shapes. Facets turn their derivatives by at most half
    /// an angle of the grid; each vertex at a pole belongs to one triangle. The knot's tangents lead along
    /// the tube, while its coordinates wind around it, most where it bends inward.
    #[test]
    fn tangents_made_of_coordinates_are_those_of_the_formulas() {
        for name in SHAPES {
            let exact = shape(name).unwrap();
            let parts = Parts {
                positions: exact.positions().to_vec(),
                normals: Some(exact.normals().to_vec()),
                tangents: None,
                coordinates: exact.coordinates().map(<[_]>::to_vec),
                triangles: exact.triangles().to_vec(),
            };
            let made = parts.complete().unwrap();
            assert_sound(&made);
            assert_eq!(
                (made.positions(), made.triangles()),
                (exact.positions(), exact.triangles()),
                "{name}"
            );
            let least = if name == "torus-knot" { 0.7 } else { 0.9998 };
            for (vertex, (made, tangent)) in made.tangents().iter().zip(exact.tangents()).enumerate() {
                let cosine: f32 = (0..3).map(|axis| made[axis] * tangent[axis]).sum();
                let pole = name == "sphere" && exact.normals()[vertex][2].abs() == 1.0;
                assert!(
                    pole || cosine > least && made[3] == 1.0,
                    "{name}, vertex {vertex}: {made:?} {tangent:?}"
                );
            }
        }
    }

    #[test]
    fn a_mirrored_picture_turns_the_tangent_and_the_sign() {
        let right = square(|x| x).complete().unwrap();
        assert_eq!(right.tangents(), [[1.0, 0.0, 0.0, 1.0]; 4]);
        let mirrored = square(|x| -x).complete().unwrap();
        assert_eq!(mirrored.tangents(), [[-1.0, 0.0, 0.0, -1.0]; 4]);
        assert_eq!(right.normals(), [[0.0, 0.0, 1.0]; 4]);
    }

    /// Two squares share an edge, and a picture is mirrored at it: its two vertices become four.
    #[test]
    fn a_vertex_on_both_sides_of_a_mirrored_picture_becomes_two() {
        let mut parts = square(|x| (x - 1.0).abs());
        parts.positions.extend([[3.0, -1.0, 0.0], [3.0, 1.0, 0.0]]);
        parts.coordinates.as_mut().unwrap().extend([[2.0, 1.0], [2.0, -1.0]]);
        parts.normals.as_mut().unwrap().extend([[0.0, 0.0, 1.0]; 2]);
        parts.triangles.extend([[1, 4, 5], [1, 5, 2]]);
        let mesh = parts.complete().unwrap();
        assert_eq!(mesh.positions().len(), 8);
        for (triangle, corners) in mesh.triangles().iter().enumerate() {
            for &corner in corners {
                let expected = if triangle < 2 { [-1.0, 0.0, 0.0, -1.0] } else { [1.0, 0.0, 0.0, 1.0] };
                assert_eq!(mesh.tangents()[corner as usize], expected, "triangle {triangle}");
            }
        }
    }

    #[test]
    fn without_normals_every_triangle_is_flat_and_tangents_are_ignored() {
        let parts = Parts {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            tangents: Some(vec![[f32::MIN_POSITIVE, 0.0, 0.0, 1.0]; 4]),
            coordinates: Some(vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.5]]),
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            ..Parts::default()
        };
        let mesh = parts.complete().unwrap();
        assert_sound(&mesh);
        assert_eq!((mesh.positions().len(), mesh.triangles().len()), (12, 4));
        let third = 1.0 / 3.0_f32.sqrt();
        let faces = [[0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [third; 3]];
        for (corners, normal) in mesh.triangles().iter().zip(faces) {
            for &corner in corners {
                let found = Vec3::from(mesh.normals()[corner as usize]);
                assert!((found - Vec3::from(normal)).length() < 1e-6, "{found} {normal:?}");
            }
        }
        assert_eq!(mesh.coordinates().unwrap()[9..], [[1.0, 0.0], [0.0, 1.0], [0.5, 0.5]]);
    }

    #[test]
    fn without_coordinates_tangents_lead_east() {
        let normals = vec![[1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, -1.0], [0.0, 0.0, 0.5]];
        let parts = Parts { positions: vec![[0.0; 3]; 4], normals: Some(normals), ..Parts::default() };
        let mesh = parts.complete().unwrap();
        assert_sound(&mesh);
        let east = [[0.0, 1.0, 0.0, 1.0], [-1.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 1.0]];
        assert_eq!(mesh.tangents(), east);
    }

    #[test]
    fn a_normal_without_length_is_the_mean_of_its_triangles() {
        let mut parts = square(|x| x);
        parts.normals = Some(vec![[0.0; 3]; 4]);
        parts.positions.push([9.0; 3]);
        parts.normals.as_mut().unwrap().push([0.0; 3]);
        parts.coordinates.as_mut().unwrap().push([0.0; 2]);
        let mesh = parts.complete().unwrap();
        assert_sound(&mesh);
        assert_eq!(mesh.normals(), [[0.0, 0.0, 1.0]; 5]);
    }

    #[test]
    fn tangents_of_a_file_are_put_beside_the_normals() {
        let mut parts = square(|x| x);
        parts.tangents = Some(vec![
            [0.0, 5.0, 5.0, -0.5],
            [0.0, 0.0, 1.0, 1.0],
            [0.0, 0.0, 0.0, -1.0],
            [1e-30, 0.0, 0.0, 1.0],
        ]);
        let mesh = parts.complete().unwrap();
        let east = [1.0, 0.0, 0.0, 1.0];
        assert_eq!(mesh.tangents(), [[0.0, 1.0, 0.0, -1.0], east, east, east]);
    }

    /// MikkTSpace's time is quadratic in the number of triangles around one vertex, and its recursion is as
    /// deep as that number.
    #[test]
    fn a_fan_of_many_triangles_is_done_without_mikktspace() {
        let rim = 200_000_u32;
        let mut positions = vec![[0.0; 3]];
        positions.extend((0..rim).map(|k| {
            let (sine, cosine) = (std::f64::consts::TAU * f64::from(k) / f64::from(rim)).sin_cos();
            [cosine as f32, sine as f32, 0.0]
        }));
        let parts = Parts {
            normals: Some(vec![[0.0, 0.0, 1.0]; positions.len()]),
            coordinates: Some(positions.iter().map(|&[x, y, _]| [y, x]).collect()),
            positions,
            triangles: (0..rim).map(|k| [0, 1 + k, 1 + (k + 1) % rim]).collect(),
            ..Parts::default()
        };
        assert_eq!(parts.complete().unwrap().tangents()[7], [1.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn a_mesh_may_be_empty() {
        for coordinates in [None, Some(Vec::new())] {
            for normals in [None, Some(Vec::new())] {
                let mesh = Parts { normals, coordinates: coordinates.clone(), ..Parts::default() }.complete();
                assert_eq!(mesh.unwrap().triangles().len(), 0);
            }
        }
    }

    #[test]
    fn errors_are_reported_before_anything_is_computed() {
        let error = |change: fn(&mut Parts)| {
            let mut parts = square(|x| x);
            change(&mut parts);
            parts.complete().unwrap_err().to_string()
        };
        assert_eq!(error(|parts| parts.coordinates = Some(vec![])), "0 coordinates for 4 positions");
        assert_eq!(
            error(|parts| parts.triangles[1][2] = 4),
            "triangle 1 has corners [0, 2, 4], and there are 4 vertices"
        );
        assert_eq!(
            error(|parts| parts.normals.as_mut().unwrap()[3][1] = f32::NAN),
            "the normals of vertex 3 hold a number that is not finite"
        );
    }

    #[test]
    fn a_squeezed_sphere_has_the_normals_of_an_ellipsoid() {
        let scales = DVec3::new(2.0, 0.5, -1.0);
        let place = glam::DAffine3::from_scale(scales);
        let sphere = shape("sphere").unwrap();
        let mesh = sphere.transformed(&place).unwrap();
        assert_sound(&mesh);
        for (position, normal) in mesh.positions().iter().zip(mesh.normals()) {
            let gradient = (Vec3::from(*position).as_dvec3() / (scales * scales)).normalize().as_vec3();
            assert!((gradient - Vec3::from(*normal)).length() < 1e-5, "{gradient} {normal:?}");
        }
        // Mirrored: the outside stays outside, and pictures on the surface are mirrored.
        for &[a, b, c] in mesh.triangles() {
            let [at, right, up] = [a, b, c].map(|k| Vec3::from(mesh.positions()[k as usize]));
            assert!((right - at).cross(up - at).dot(Vec3::from(mesh.normals()[a as usize])) > 0.0);
        }
        assert!(mesh.tangents().iter().all(|tangent| tangent[3] == -1.0));
    }

    #[test]
    fn a_flattened_sphere_keeps_to_its_plane() {
        let place = glam::DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.0));
        let mesh = shape("sphere").unwrap().transformed(&place).unwrap();
        assert_sound(&mesh);
        let upright = mesh.normals().iter().filter(|normal| normal[2].abs() == 1.0).count();
        assert_eq!(upright, mesh.normals().len());
        let nothing = glam::DAffine3::from_scale(DVec3::ZERO);
        assert_sound(&shape("torus-knot").unwrap().transformed(&nothing).unwrap());
        let huge = glam::DAffine3::from_scale(DVec3::splat(1e300));
        let error = shape("plane").unwrap().transformed(&huge).unwrap_err();
        assert_eq!(error.to_string(), "the positions of vertex 0 hold a number that is not finite");
    }

    #[test]
    fn joined_meshes_keep_their_triangles() {
        let [plane, sphere] = ["plane", "sphere"].map(|name| shape(name).unwrap());
        let both = Mesh::joined(&[plane.clone(), sphere.clone()]).unwrap();
        assert_eq!(both.positions().len(), 4 + sphere.positions().len());
        assert_eq!(both.coordinates().unwrap()[4..], *sphere.coordinates().unwrap());
        assert_eq!(both.triangles()[2], sphere.triangles()[0].map(|vertex| vertex + 4));
        let bare = Mesh::new(vec![[0.0; 3]], vec![[0.0, 0.0, 1.0]], vec![[1.0; 4]], None, vec![]).unwrap();
        assert_eq!(Mesh::joined(&[plane, bare]).unwrap().coordinates(), None);
        assert_eq!(Mesh::joined(&[]).unwrap().positions().len(), 0);
    }

    /// Numbers that coincide, cancel, overflow and vanish.
    fn number() -> impl Strategy<Value = f32> {
        prop_oneof![
            4 => (-2..=2_i8).prop_map(f32::from),
            2 => -1.0_f32..1.0,
            1 => prop::sample::select(vec![-0.0, 1e-45, 1e-30, 1e19, -3e38, f32::MAX]),
        ]
    }

    proptest! {
        #[test]
        fn any_soup_of_triangles_becomes_a_sound_mesh(
            vertices in prop::collection::vec(prop::array::uniform8(number()), 1..9),
            corners in prop::collection::vec(prop::array::uniform3(0..9_u32), 0..24),
            has in prop::array::uniform3(any::<bool>()),
        ) {
            let count = vertices.len() as u32;
            let parts = Parts {
                positions: vertices.iter().map(|v| [v[0], v[1], v[2]]).collect(),
                normals: has[0].then(|| vertices.iter().map(|v| [v[3], v[4], v[5]]).collect()),
                tangents: has[1].then(|| vertices.iter().map(|v| [v[5], v[6], v[0], v[7]]).collect()),
                coordinates: has[2].then(|| vertices.iter().map(|v| [v[6], v[7]]).collect()),
                triangles: corners.iter().map(|c| c.map(|vertex| vertex % count)).collect(),
            };
            let mesh = parts.complete().unwrap();
            assert_sound(&mesh);
            prop_assert_eq!(mesh.triangles().len(), corners.len());
            let again = Mesh::new(
                mesh.positions().to_vec(),
                mesh.normals().to_vec(),
                mesh.tangents().to_vec(),
                mesh.coordinates().map(<[_]>::to_vec),
                mesh.triangles().to_vec(),
            );
            prop_assert_eq!(again, Ok(mesh));
        }
    }
}
