//! The materials of a mesh: which of its triangles are of which material of the file that it was read from.

use crate::material_range::{MaterialRange, Materials};
use crate::mesh::{Mesh, MeshError};

impl Mesh {
    /// Returns the same mesh with the names of the materials of its file, and the material of each range of
    /// its triangles, in order. If no range has a material, the mesh has none.
    ///
    /// # Errors
    /// If the ranges have another number of triangles than the mesh, or one has a material without a name.
    pub fn with_materials(mut self, names: Vec<String>, ranges: &[MaterialRange]) -> Result<Self, MeshError> {
        let triangles = self.triangles().len();
        let sum = ranges.iter().fold(0_usize, |sum, range| sum.saturating_add(range.triangles));
        if sum != triangles {
            return Err(MeshError(format!("materials of {sum} triangles for {triangles}")));
        }
        if let Some(material) =
            ranges.iter().filter_map(|range| range.material).find(|of| *of as usize >= names.len())
        {
            let count = names.len();
            return Err(MeshError(format!("a triangle has the material {material}, and there are {count}")));
        }
        let mut merged: Vec<MaterialRange> = Vec::new();
        for range in ranges.iter().filter(|range| range.triangles > 0) {
            match merged.last_mut() {
                Some(last) if last.material == range.material => last.triangles += range.triangles,
                _ => merged.push(*range),
            }
        }
        let has_any = merged.iter().any(|range| range.material.is_some());
        self.materials = if has_any { Materials { names, ranges: merged } } else { Materials::default() };
        Ok(self)
    }

    /// Returns the mesh with the materials of another mesh, whose triangles are the same.
    pub(crate) fn with_materials_of(mut self, other: &Self) -> Self {
        self.materials = other.materials.clone();
        self
    }

    /// The names of the materials of the file that the mesh was read from, whether triangles have them or
    /// not; empty if no triangle has a material.
    pub fn materials(&self) -> &[String] {
        &self.materials.names
    }

    /// The material of each triangle, as ranges in order; empty if no triangle has a material.
    pub fn material_ranges(&self) -> &[MaterialRange] {
        &self.materials.ranges
    }

    /// The triangles of some materials as a mesh of its own, without names of materials, and for each of its
    /// vertices the one of this mesh that it is. Triangles and vertices keep their order.
    ///
    /// # Example: what has no material is one part
    /// ```
    /// let plane = mesh::shape("plane").unwrap();
    /// let (whole, vertices) = plane.of_materials(|material| material.is_none());
    /// assert_eq!((whole, vertices), (plane, vec![0, 1, 2, 3]));
    /// ```
    pub fn of_materials(&self, is_kept: impl Fn(Option<u32>) -> bool) -> (Self, Vec<u32>) {
        let all = [MaterialRange { material: None, triangles: self.triangles().len() }];
        let ranges = if self.materials.ranges.is_empty() { &all[..] } else { &self.materials.ranges };
        let (mut rest, mut kept) = (self.triangles(), Vec::new());
        for range in ranges {
            let (here, after) = rest.split_at(range.triangles.min(rest.len()));
            if is_kept(range.material) {
                kept.extend_from_slice(here);
            }
            rest = after;
        }
        let mut is_used = vec![false; self.positions().len()];
        kept.iter().flatten().for_each(|&vertex| is_used[vertex as usize] = true);
        let vertices: Vec<u32> =
            (0..is_used.len() as u32).filter(|&vertex| is_used[vertex as usize]).collect();
        let mut places = vec![0; is_used.len()];
        vertices.iter().enumerate().for_each(|(place, &vertex)| places[vertex as usize] = place as u32);
        let part = Self::from_complete(
            chosen(self.positions(), &vertices),
            chosen(self.normals(), &vertices),
            chosen(self.tangents(), &vertices),
            self.coordinates().map(|coordinates| chosen(coordinates, &vertices)),
            kept.into_iter().map(|corners| corners.map(|vertex| places[vertex as usize])).collect(),
        );
        (part, vertices)
    }
}

/// The entries of some vertices.
fn chosen<T: Copy>(of_all: &[T], vertices: &[u32]) -> Vec<T> {
    vertices.iter().map(|&vertex| of_all[vertex as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape;

    fn range(material: Option<u32>, triangles: usize) -> MaterialRange {
        MaterialRange { material, triangles }
    }

    /// Three squares: two of one material around one of another.
    fn striped() -> Mesh {
        let plane = shape("plane").unwrap();
        let names = vec!["red".to_owned(), "unused".to_owned(), "blue".to_owned()];
        let ranges =
            [range(Some(0), 1), range(Some(0), 1), range(Some(2), 2), range(None, 0), range(Some(0), 2)];
        Mesh::joined(&[plane.clone(), plane.clone(), plane]).unwrap().with_materials(names, &ranges).unwrap()
    }

    #[test]
    fn ranges_are_merged_and_kept() {
        let mesh = striped();
        let expected = [range(Some(0), 2), range(Some(2), 2), range(Some(0), 2)];
        assert_eq!(mesh.material_ranges(), expected);
        assert_eq!(mesh.materials(), ["red", "unused", "blue"]);
        let half = glam::DAffine3::from_scale(glam::DVec3::splat(0.5));
        for other in [mesh.transformed(&half).unwrap(), mesh.brushed(None, |_| 1.0).0] {
            assert_eq!((other.materials(), other.material_ranges()), (mesh.materials(), &expected[..]));
        }
        let bare = shape("plane").unwrap();
        assert_eq!(bare.clone().with_materials(vec!["red".into()], &[range(None, 2)]).unwrap(), bare);
    }

    #[test]
    fn a_part_has_the_vertices_of_its_triangles() {
        let mesh = striped();
        let (red, vertices) = mesh.of_materials(|material| material == Some(0));
        assert_eq!(vertices, [0, 1, 2, 3, 8, 9, 10, 11]);
        assert_eq!((red.triangles().len(), red.positions().len()), (4, 8));
        for (part, whole) in red.triangles().iter().zip([0, 1, 4, 5]) {
            for (corner, of) in part.iter().zip(mesh.triangles()[whole]) {
                assert_eq!(vertices[*corner as usize], of);
            }
        }
        assert!(red.materials().is_empty() && red.coordinates().is_some());
        assert!(mesh.of_materials(|material| material == Some(1)).0.triangles().is_empty());
        let plane = shape("plane").unwrap();
        assert_eq!(mesh.of_materials(|material| material == Some(2)).0, plane);
    }

    #[test]
    fn ranges_of_other_triangles_are_refused() {
        let error = |names: &[&str], ranges: &[MaterialRange]| {
            let names = names.iter().map(|name| (*name).to_owned()).collect();
            shape("plane").unwrap().with_materials(names, ranges).unwrap_err().to_string()
        };
        assert_eq!(error(&["red"], &[range(Some(0), 1)]), "materials of 1 triangles for 2");
        assert_eq!(error(&["red"], &[range(Some(1), 2)]), "a triangle has the material 1, and there are 1");
    }
}
