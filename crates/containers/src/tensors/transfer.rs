//! Values at the vertices of a mesh: transfer matrices and radiance, with the mesh's digest.

use safetensors::tensor::{Dtype, TensorView};
use transfer::Transfer;

use super::file::{File, Writer, degree, wrong_shape};
use crate::error::{Error, ErrorKind};

/// The metadata entry that names the mesh.
const MESH: &str = "mesh";

/// A value for each vertex of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct OfMesh<T> {
    /// The values.
    pub value: T,
    /// The digest of the mesh.
    pub mesh: String,
}

/// Transfer matrices: `transfer` [V, (O+1)^2, (F+1)^2] f32, and the digest of the mesh in the metadata.
///
/// # Errors
/// If a number is not finite.
pub fn encode_transfer(transfer: &OfMesh<Transfer>, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let value = &transfer.value;
    let shape = [value.len(), value.output().rows(), value.input().rows()];
    encode("transfer", &shape, value.values(), &transfer.mesh, recipe)
}

/// Transfer matrices, from a file of kind `transfer`.
///
/// # Errors
/// As [`super::decode_lighting`].
pub fn decode_transfer(bytes: &[u8]) -> Result<OfMesh<Transfer>, Error> {
    const NAME: &str = "transfer";
    const SHAPE: &str = "[V, (O+1)^2, (F+1)^2]";
    let file = File::open_as(bytes, NAME)?;
    let tensor = file.tensor(NAME, Dtype::F32, SHAPE)?;
    let wrong = || wrong_shape(NAME, SHAPE, tensor.shape());
    let &[_, rows, columns] = tensor.shape() else { return Err(wrong()) };
    let sides = [rows, columns].map(usize::isqrt);
    if sides.contains(&0) || sides.map(|side| side * side) != [rows, columns] {
        return Err(wrong());
    }
    let [output, input] = [degree(NAME, sides[0] - 1)?, degree(NAME, sides[1] - 1)?];
    let value = Transfer::new(output, input, values(NAME, &tensor)?).ok_or_else(wrong)?;
    Ok(OfMesh { value, mesh: digest(&file)? })
}

/// The radiance of vertices: `radiance` [V, 3] f32, and the digest of the mesh in the metadata.
///
/// # Errors
/// If a number is not finite.
pub fn encode_vertex_radiance(
    radiance: &OfMesh<Vec<[f32; 3]>>,
    recipe: Option<&str>,
) -> Result<Vec<u8>, Error> {
    let rows = radiance.value.as_flattened();
    encode("vertex-radiance", &[radiance.value.len(), 3], rows, &radiance.mesh, recipe)
}

/// The radiance of vertices, from a file of kind `vertex-radiance`.
///
/// # Errors
/// As [`super::decode_lighting`].
pub fn decode_vertex_radiance(bytes: &[u8]) -> Result<OfMesh<Vec<[f32; 3]>>, Error> {
    const NAME: &str = "radiance";
    const SHAPE: &str = "[V, 3]";
    let file = File::open_as(bytes, "vertex-radiance")?;
    let tensor = file.tensor(NAME, Dtype::F32, SHAPE)?;
    let &[_, 3] = tensor.shape() else { return Err(wrong_shape(NAME, SHAPE, tensor.shape())) };
    let value = values(NAME, &tensor)?;
    let (rows, _) = value.as_chunks::<3>();
    Ok(OfMesh { value: rows.to_vec(), mesh: digest(&file)? })
}

/// A number for each vertex, which says what of a table's materials is there: `blend` [V] f32, and the digest
/// of the mesh in the metadata.
///
/// # Errors
/// If a number is not finite.
pub fn encode_vertex_blend(blend: &OfMesh<Vec<f32>>, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    encode("vertex-blend", &[blend.value.len()], &blend.value, &blend.mesh, recipe)
}

/// The blend of vertices, from a file of kind `vertex-blend`.
///
/// # Errors
/// As [`super::decode_lighting`].
pub fn decode_vertex_blend(bytes: &[u8]) -> Result<OfMesh<Vec<f32>>, Error> {
    const NAME: &str = "blend";
    const SHAPE: &str = "[V]";
    let file = File::open_as(bytes, "vertex-blend")?;
    let tensor = file.tensor(NAME, Dtype::F32, SHAPE)?;
    let &[_] = tensor.shape() else { return Err(wrong_shape(NAME, SHAPE, tensor.shape())) };
    Ok(OfMesh { value: values(NAME, &tensor)?, mesh: digest(&file)? })
}

fn encode(
    kind: &'static str,
    shape: &[usize],
    values: &[f32],
    mesh: &str,
    recipe: Option<&str>,
) -> Result<Vec<u8>, Error> {
    let name = kind.rsplit('-').next().unwrap_or(kind);
    check(name, values, ErrorKind::Unwritable)?;
    let mut file = Writer::new(kind, recipe);
    file.entry(MESH, mesh);
    file.data.reserve_exact(4 * values.len());
    file.extend_f32(values);
    file.tensor(name, "F32", shape);
    Ok(file.finish())
}

fn values(name: &str, tensor: &TensorView<'_>) -> Result<Vec<f32>, Error> {
    let (words, _) = tensor.data().as_chunks::<4>();
    let values: Vec<f32> = words.iter().map(|word| f32::from_le_bytes(*word)).collect();
    check(name, &values, ErrorKind::Damaged)?;
    Ok(values)
}

fn check(name: &str, values: &[f32], kind: ErrorKind) -> Result<(), Error> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(first) => {
            Err(Error::new(kind, format!("tensor `{name}`: expected finite values; number {first} is not")))
        }
    }
}

fn digest(file: &File<'_>) -> Result<String, Error> {
    let found = file.metadata.get(MESH).cloned();
    found.ok_or_else(|| Error::damaged("metadata `mesh`: expected the digest of a mesh, found none"))
}

#[cfg(test)]
mod tests {
    use sh::Degree;

    use super::*;

    fn matrices(value: f32) -> OfMesh<Transfer> {
        let (output, input) = (Degree::new(2).unwrap(), Degree::new(1).unwrap());
        let values = (0..3 * 9 * 4).map(|i| value * i as f32).collect();
        OfMesh { value: Transfer::new(output, input, values).unwrap(), mesh: "ab12".into() }
    }

    #[test]
    fn values_of_vertices_come_back() {
        let bytes = encode_transfer(&matrices(0.25), Some("{}")).unwrap();
        assert_eq!(decode_transfer(&bytes).unwrap(), matrices(0.25));
        let tensors = super::super::describe(&bytes).unwrap().tensors;
        assert_eq!(tensors, [("transfer".to_owned(), "F32".to_owned(), vec![3, 9, 4])]);
        for value in [vec![], vec![[1.0, -2.0, 0.5]; 4]] {
            let radiance = OfMesh { value, mesh: "cd".into() };
            let bytes = encode_vertex_radiance(&radiance, None).unwrap();
            assert_eq!(decode_vertex_radiance(&bytes).unwrap(), radiance);
        }
        let blend = OfMesh { value: vec![0.0, 0.25, 1.0], mesh: "ef".into() };
        let bytes = encode_vertex_blend(&blend, None).unwrap();
        assert_eq!(decode_vertex_blend(&bytes).unwrap(), blend);
        assert_eq!(super::super::describe(&bytes).unwrap().tensors[0].0, "blend");
    }

    #[test]
    fn errors_name_the_tensor_and_what_was_expected() {
        let error = encode_transfer(&matrices(f32::NAN), None).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unwritable);
        let written = |shape: &[usize], mesh: bool| {
            let mut file = Writer::new("transfer", None);
            if mesh {
                file.entry(MESH, "ab");
            }
            file.extend_f32(&vec![0.0; shape.iter().product()]);
            file.tensor("transfer", "F32", shape);
            decode_transfer(&file.finish()).map_err(|error| error.to_string())
        };
        let expected = "tensor `transfer`: expected the shape [V, (O+1)^2, (F+1)^2], found [2, 3, 4]";
        assert_eq!(written(&[2, 3, 4], true).unwrap_err(), expected);
        let expected = "metadata `mesh`: expected the digest of a mesh, found none";
        assert_eq!(written(&[2, 4, 4], false).unwrap_err(), expected);
        assert!(written(&[2, 4, 1], true).is_ok());
    }
}
