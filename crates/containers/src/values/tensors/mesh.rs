//! A triangle mesh.

use mesh::{MaterialRange, Mesh, MeshError};
use safetensors::tensor::Dtype;

use super::file::{TensorFile, Writer, wrong_shape};
use crate::error::Error;

/// The entry of the metadata that holds the names of the materials, as a list in JSON.
const MATERIALS: &str = "materials";
/// The number of a range without a material.
const NO_MATERIAL: u32 = u32::MAX;

/// A mesh of V vertices and T triangles: `positions` [V, 3], `normals` [V, 3], `tangents` [V, 4] and, if
/// there are any, `coordinates` [V, 2], all f32; `triangles` [T, 3] u32. If triangles have materials, their
/// names are a list in JSON in the metadata, and `ranges` [R, 2] u32 holds ranges of triangles in order: the
/// place of the material, 4294967295 for none, and the number of triangles.
pub fn encode_mesh(mesh: &Mesh, recipe: Option<&str>) -> Vec<u8> {
    let mut file = Writer::new("mesh", recipe);
    file.vectors("positions", mesh.positions());
    file.vectors("normals", mesh.normals());
    file.vectors("tangents", mesh.tangents());
    if let Some(coordinates) = mesh.coordinates() {
        file.vectors("coordinates", coordinates);
    }
    let corners = mesh.triangles().as_flattened();
    file.data.extend(corners.iter().flat_map(|corner| corner.to_le_bytes()));
    file.tensor("triangles", "U32", &[mesh.triangles().len(), 3]);
    let ranges = mesh.material_ranges();
    if !ranges.is_empty() {
        let row = |range: &MaterialRange| [range.material.unwrap_or(NO_MATERIAL), range.triangles as u32];
        file.entry(MATERIALS, serde_json::json!(mesh.materials()).to_string());
        file.data.extend(ranges.iter().flat_map(row).flat_map(u32::to_le_bytes));
        file.tensor("ranges", "U32", &[ranges.len(), 2]);
    }
    file.finish()
}

/// A mesh, from a file of kind `mesh`.
///
/// # Errors
/// The errors of [`super::decode_lighting`] and of [`Mesh::new`].
pub fn decode_mesh(bytes: &[u8]) -> Result<Mesh, Error> {
    let file = TensorFile::open_as(bytes, "mesh")?;
    let [coordinates, ranges] = ["coordinates", "ranges"].map(|name| file.tensors.names().contains(&name));
    let damaged = |error: MeshError| Error::damaged(error.to_string());
    let mesh = Mesh::new(
        file.vectors("positions", Dtype::F32, f32::from_le_bytes)?,
        file.vectors("normals", Dtype::F32, f32::from_le_bytes)?,
        file.vectors("tangents", Dtype::F32, f32::from_le_bytes)?,
        coordinates.then(|| file.vectors("coordinates", Dtype::F32, f32::from_le_bytes)).transpose()?,
        file.vectors("triangles", Dtype::U32, u32::from_le_bytes)?,
    )
    .map_err(damaged)?;
    if !ranges {
        return Ok(mesh);
    }
    let names = file.metadata.get(MATERIALS).and_then(|names| serde_json::from_str(names).ok());
    let names = names.ok_or_else(|| Error::damaged("expected the names of the materials in the metadata"))?;
    let range = |[material, triangles]: [u32; 2]| MaterialRange {
        material: (material != NO_MATERIAL).then_some(material),
        triangles: triangles as usize,
    };
    let ranges = file.vectors("ranges", Dtype::U32, u32::from_le_bytes)?.into_iter().map(range);
    mesh.with_materials(names, &ranges.collect::<Vec<_>>()).map_err(damaged)
}

impl Writer {
    fn vectors<const N: usize>(&mut self, name: &str, vectors: &[[f32; N]]) {
        self.extend_f32(vectors.as_flattened());
        self.tensor(name, "F32", &[vectors.len(), N]);
    }
}

impl TensorFile<'_> {
    /// A tensor of rows of N numbers, four bytes each.
    fn vectors<T, const N: usize>(
        &self,
        name: &str,
        dtype: Dtype,
        number: impl Fn([u8; 4]) -> T,
    ) -> Result<Vec<[T; N]>, Error> {
        let rows = match name {
            "triangles" => "T",
            "ranges" => "R",
            _ => "V",
        };
        let shape = format!("[{rows}, {N}]");
        let tensor = self.tensor(name, dtype, &shape)?;
        if !matches!(tensor.shape(), &[_, width] if width == N) {
            return Err(wrong_shape(name, &shape, tensor.shape()));
        }
        let (words, _) = tensor.data().as_chunks::<4>();
        let (rows, _) = words.as_chunks::<N>();
        Ok(rows.iter().map(|row| row.map(&number)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::values::tensors::{describe, read_recipe};

    #[test]
    fn meshes_come_back() {
        let shapes = mesh::SHAPES.map(|name| mesh::shape(name).unwrap());
        let bare = Mesh::new(vec![[1.0; 3]], vec![[0.0, 0.0, 1.0]], vec![[1.0; 4]], None, vec![]).unwrap();
        let empty = Mesh::joined(&[]).unwrap();
        let dressed = mesh::shape("plane").unwrap();
        let range = |material| MaterialRange { material, triangles: 1 };
        let names = vec!["one \"two\"".to_owned(), String::new()];
        let dressed = dressed.with_materials(names, &[range(Some(1)), range(None)]).unwrap();
        for mesh in shapes.into_iter().chain([bare, empty, dressed]) {
            let bytes = encode_mesh(&mesh, Some("{}"));
            assert_eq!(decode_mesh(&bytes).unwrap(), mesh);
            assert_eq!(read_recipe(&bytes).as_deref(), Some("{}"));
        }
    }

    #[test]
    fn the_names_and_shapes_are_those_of_the_contract() {
        let mesh = mesh::shape("plane").unwrap();
        let tensors = describe(&encode_mesh(&mesh, None)).unwrap().tensors;
        let expected = [
            ("positions", "F32", [4, 3]),
            ("normals", "F32", [4, 3]),
            ("tangents", "F32", [4, 4]),
            ("coordinates", "F32", [4, 2]),
            ("triangles", "U32", [2, 3]),
        ];
        let expected =
            expected.map(|(name, dtype, shape)| (name.to_owned(), dtype.to_owned(), shape.to_vec()));
        assert_eq!(tensors, expected);
    }

    #[test]
    fn ranges_need_names() {
        let mesh = mesh::shape("plane").unwrap();
        let whole = MaterialRange { material: Some(0), triangles: 2 };
        let bytes = encode_mesh(&mesh.with_materials(vec!["red".to_owned()], &[whole]).unwrap(), None);
        let bytes = |other: &str| {
            let from = br#""materials":"[\"red\"]""#;
            let at = bytes.windows(from.len()).position(|part| part == from).unwrap();
            [&bytes[..at], other.as_bytes(), &bytes[at + from.len()..]].concat()
        };
        let error = |other: &str| decode_mesh(&bytes(other)).unwrap_err().to_string();
        assert_eq!(error(r#""materials":"[       ]""#), "a triangle has the material 0, and there are 0");
        let message = "expected the names of the materials in the metadata";
        assert_eq!(error(r#""materials":"{red}    ""#), message);
    }

    #[test]
    fn errors_name_the_tensor() {
        let error_of = |change: fn(&mut Writer)| {
            let mut file = Writer::new("mesh", None);
            file.vectors("positions", &[[0.0; 3]]);
            file.vectors("normals", &[[0.0; 3]]);
            change(&mut file);
            decode_mesh(&file.finish()).unwrap_err().to_string()
        };
        let triangle = |file: &mut Writer| {
            file.data.extend([0; 11]);
            file.data.push(1);
            file.tensor("triangles", "U32", &[1, 3]);
        };
        let nan = Mesh::new(vec![[0.0; 3]], vec![[1.0, 0.0, 0.0]], vec![[0.0; 4]], None, vec![]).unwrap();
        let mut bytes = encode_mesh(&nan, None);
        let last = bytes.len() - 4;
        bytes[last..].copy_from_slice(&f32::NAN.to_le_bytes());
        let message = decode_mesh(&bytes).unwrap_err().to_string();
        assert_eq!(message, "the tangents of vertex 0 hold a number that is not finite");
        let message = error_of(|_| {});
        assert!(
            message.starts_with("expected a tensor `tangents` [V, 4] F32, found the tensors: "),
            "{message}"
        );
        assert_eq!(
            error_of(|file| file.vectors("tangents", &[[0.0; 3]])),
            "tensor `tangents`: expected the shape [V, 4], found [1, 3]"
        );
        let message = error_of(|file| {
            file.vectors("tangents", &[[0.0; 4]; 2]);
            file.tensor("triangles", "U32", &[0, 3]);
        });
        assert_eq!(message, "2 tangents for 1 positions");
        let mut file = Writer::new("mesh", None);
        file.vectors("positions", &[[0.0; 3]]);
        file.vectors("normals", &[[0.0; 3]]);
        file.vectors("tangents", &[[0.0; 4]]);
        triangle(&mut file);
        let message = "triangle 0 has corners [0, 0, 16777216], and there are 1 vertices";
        assert_eq!(decode_mesh(&file.finish()).unwrap_err().to_string(), message);
    }
}
