//! Values at the vertices of a mesh: transfer and radiance, with the mesh's digest.

use half::f16;
use safetensors::tensor::{Dtype, TensorView};
use sh::Degree;
use transfer::{Form, HalfTransfer, MatteTransfer, StoredTransfer, Visibility};

use super::file::{TensorFile, Writer, degree, wrong_shape};
use crate::error::{Error, ErrorKind};

/// The metadata entry that names the mesh.
const MESH: &str = "mesh";
/// The metadata entry of a visibility that holds O: its shape has only O + F.
const OUTPUT: &str = "output-degree";

/// The prefixes of the names of each channel's tensors, if the channels differ.
const CHANNELS: [&str; 3] = ["red.", "green.", "blue."];

/// A value for each vertex of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct OfMesh<T> {
    /// The values.
    pub value: T,
    /// The digest of the mesh.
    pub mesh: String,
}

/// Transfer in one of its forms, and the digest of the mesh in the metadata.
///
/// | form | tensors |
/// | --- | --- |
/// | matrices | `transfer` [V, (O+1)^2, (F+1)^2] f16 |
/// | visibility | `visibility` [V, (O+F+1)^2] f32, and O as `output-degree` in the metadata |
/// | matte | `matte` [V, (F+1)^2] f32 |
///
/// If red, green and blue differ, the names begin with `red.`, `green.` and `blue.`.
///
/// # Errors
/// If a number is not finite.
pub fn encode_transfer(transfer: &OfMesh<StoredTransfer>, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("transfer", recipe);
    file.entry(MESH, transfer.mesh.clone());
    let channels = transfer.value.channels();
    for (form, prefix) in channels.iter().zip(CHANNELS) {
        let name = |name: &str| if channels.len() == 1 { name.to_owned() } else { format!("{prefix}{name}") };
        match form {
            Form::Matrices(matrices) => {
                let shape = [matrices.len(), matrices.output().rows(), matrices.input().rows()];
                let finite = matrices.values().iter().position(|value| !value.is_finite());
                refuse(&name("transfer"), finite, ErrorKind::Unwritable)?;
                file.data.extend(matrices.values().iter().flat_map(|value| value.to_le_bytes()));
                file.tensor(name("transfer"), "F16", &shape);
            }
            Form::Visibility(visibility) => {
                file.entry(OUTPUT, visibility.output().get().to_string());
                let columns = visibility.output().get() + visibility.input().get() + 1;
                let shape = [visibility.len(), columns * columns];
                file.floats(&name("visibility"), &shape, visibility.values())?;
            }
            Form::Matte(matte) => {
                file.floats(&name("matte"), &[matte.len(), matte.input().rows()], matte.values())?;
            }
        }
    }
    Ok(file.finish())
}

/// Transfer, from a file of kind `transfer`.
///
/// # Errors
/// The errors of [`super::decode_lighting`].
pub fn decode_transfer(bytes: &[u8]) -> Result<OfMesh<StoredTransfer>, Error> {
    let file = TensorFile::open_as(bytes, "transfer")?;
    let coloured = file.tensors.names().iter().any(|name| name.starts_with(CHANNELS[0]));
    let prefixes = if coloured { &CHANNELS[..] } else { &[""] };
    let channels = prefixes.iter().map(|prefix| form(&file, prefix)).collect::<Result<_, _>>()?;
    let value = StoredTransfer::new(channels)
        .ok_or_else(|| Error::damaged("the tensors of red, green and blue have different shapes"))?;
    Ok(OfMesh { value, mesh: digest(&file)? })
}

fn form(file: &TensorFile<'_>, prefix: &str) -> Result<Form, Error> {
    let name = |name: &str| format!("{prefix}{name}");
    if file.has(&name("visibility")) {
        return visibility(file, &name("visibility"));
    }
    if file.has(&name("bases")) {
        let clusters = "the file holds transfer in clusters, which this version does not read; bake it again";
        return Err(Error::unsupported(clusters));
    }
    if file.has(&name("matte")) {
        let (name, shape) = (name("matte"), "[V, (F+1)^2]");
        let tensor = file.tensor(&name, Dtype::F32, shape)?;
        let wrong = || wrong_shape(&name, shape, tensor.shape());
        let &[_, columns] = tensor.shape() else { return Err(wrong()) };
        let input = side(&name, columns).ok_or_else(wrong)??;
        return MatteTransfer::new(input, values(&name, &tensor)?).map(Form::Matte).ok_or_else(wrong);
    }
    let (name, shape) = (name("transfer"), "[V, (O+1)^2, (F+1)^2]");
    let tensor = file.tensor(&name, Dtype::F16, shape)?;
    let wrong = || wrong_shape(&name, shape, tensor.shape());
    let &[_, rows, columns] = tensor.shape() else { return Err(wrong()) };
    let (output, input) = (side(&name, rows).ok_or_else(wrong)??, side(&name, columns).ok_or_else(wrong)??);
    let (words, _) = tensor.data().as_chunks::<2>();
    let values: Vec<f16> = words.iter().map(|word| f16::from_le_bytes(*word)).collect();
    refuse(&name, values.iter().position(|value| !value.is_finite()), ErrorKind::Damaged)?;
    HalfTransfer::new(output, input, values).map(Form::Matrices).ok_or_else(wrong)
}

fn visibility(file: &TensorFile<'_>, name: &str) -> Result<Form, Error> {
    let shape = "[V, (O+F+1)^2]";
    let tensor = file.tensor(name, Dtype::F32, shape)?;
    let wrong = || wrong_shape(name, shape, tensor.shape());
    let &[_, columns] = tensor.shape() else { return Err(wrong()) };
    let sum = side(name, columns).ok_or_else(wrong)??.get();
    let output = file.metadata.get(OUTPUT).and_then(|output| output.parse::<usize>().ok());
    let output = output
        .filter(|output| *output <= sum)
        .ok_or_else(|| Error::damaged(format!("metadata `{OUTPUT}`: expected the degree O, 0 to {sum}")))?;
    let (output, input) = (degree(name, output)?, degree(name, sum - output)?);
    let visibility = Visibility::new(output, input, values(name, &tensor)?);
    visibility.map(Form::Visibility).ok_or_else(|| Error::damaged("a visibility has O and F of 0 to 8"))
}

/// The degree of a side of (degree + 1)^2 rows; none if it is not a square.
fn side(name: &str, rows: usize) -> Option<Result<Degree, Error>> {
    let side = rows.isqrt();
    (side > 0 && side * side == rows).then(|| degree(name, side - 1))
}

impl Writer {
    /// A tensor of finite numbers.
    fn floats(&mut self, name: &str, shape: &[usize], values: &[f32]) -> Result<(), Error> {
        refuse(name, values.iter().position(|value| !value.is_finite()), ErrorKind::Unwritable)?;
        self.data.reserve_exact(4 * values.len());
        self.extend_f32(values);
        self.tensor(name, "F32", shape);
        Ok(())
    }
}

/// The radiance of vertices: `radiance` [V, 3] f32, and the digest of the mesh in the metadata.
///
/// # Errors
/// If a number is not finite.
pub fn encode_vertex_radiance(
    radiance: &OfMesh<Vec<[f32; 3]>>,
    recipe: Option<&str>,
) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("vertex-radiance", recipe);
    file.entry(MESH, radiance.mesh.clone());
    file.floats("radiance", &[radiance.value.len(), 3], radiance.value.as_flattened())?;
    Ok(file.finish())
}

/// The radiance of vertices, from a file of kind `vertex-radiance`.
///
/// # Errors
/// The errors of [`super::decode_lighting`].
pub fn decode_vertex_radiance(bytes: &[u8]) -> Result<OfMesh<Vec<[f32; 3]>>, Error> {
    const NAME: &str = "radiance";
    const SHAPE: &str = "[V, 3]";
    let file = TensorFile::open_as(bytes, "vertex-radiance")?;
    let tensor = file.tensor(NAME, Dtype::F32, SHAPE)?;
    let &[_, 3] = tensor.shape() else { return Err(wrong_shape(NAME, SHAPE, tensor.shape())) };
    let value = values(NAME, &tensor)?;
    let (rows, _) = value.as_chunks::<3>();
    Ok(OfMesh { value: rows.to_vec(), mesh: digest(&file)? })
}

/// Two numbers for each vertex, which say what of a table's materials is there: `blend` \[V, 2\] f32, or
/// \[V\] if all second ones are 0, and the digest of the mesh in the metadata.
///
/// # Errors
/// If a number is not finite.
pub fn encode_vertex_blend(blend: &OfMesh<Vec<[f32; 2]>>, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("vertex-blend", recipe);
    file.entry(MESH, blend.mesh.clone());
    let (count, places) = (blend.value.len(), &blend.value);
    if places.iter().all(|[_, second]| *second == 0.0) {
        let first: Vec<f32> = places.iter().map(|[first, _]| *first).collect();
        file.floats("blend", &[count], &first)?;
    } else {
        file.floats("blend", &[count, 2], places.as_flattened())?;
    }
    Ok(file.finish())
}

/// The blend of vertices, from a file of kind `vertex-blend`.
///
/// # Errors
/// The errors of [`super::decode_lighting`].
pub fn decode_vertex_blend(bytes: &[u8]) -> Result<OfMesh<Vec<[f32; 2]>>, Error> {
    const NAME: &str = "blend";
    const SHAPE: &str = "[V] or [V, 2]";
    let file = TensorFile::open_as(bytes, "vertex-blend")?;
    let tensor = file.tensor(NAME, Dtype::F32, SHAPE)?;
    let numbers = values(NAME, &tensor)?;
    let value = match tensor.shape() {
        [_] => numbers.iter().map(|first| [*first, 0.0]).collect(),
        [_, 2] => numbers.as_chunks::<2>().0.to_vec(),
        other => return Err(wrong_shape(NAME, SHAPE, other)),
    };
    Ok(OfMesh { value, mesh: digest(&file)? })
}

fn values(name: &str, tensor: &TensorView<'_>) -> Result<Vec<f32>, Error> {
    let (words, _) = tensor.data().as_chunks::<4>();
    let values: Vec<f32> = words.iter().map(|word| f32::from_le_bytes(*word)).collect();
    refuse(name, values.iter().position(|value| !value.is_finite()), ErrorKind::Damaged)?;
    Ok(values)
}

/// An error if a number is not finite.
fn refuse(name: &str, first: Option<usize>, kind: ErrorKind) -> Result<(), Error> {
    match first {
        None => Ok(()),
        Some(first) => {
            Err(Error::new(kind, format!("tensor `{name}`: expected finite values; number {first} is not")))
        }
    }
}

fn digest(file: &TensorFile<'_>) -> Result<String, Error> {
    let found = file.metadata.get(MESH).cloned();
    found.ok_or_else(|| Error::damaged("metadata `mesh`: expected the digest of a mesh, found none"))
}

#[cfg(test)]
mod tests {
    use transfer::Transfer;

    use super::*;

    fn numbers(count: usize, value: f32) -> Vec<f32> {
        (0..count).map(|i| value * i as f32).collect()
    }

    fn matrices(value: f32) -> Form {
        let (output, input) = (Degree::new(2).unwrap(), Degree::new(1).unwrap());
        let matrices = Transfer::new(output, input, numbers(3 * 9 * 4, value)).unwrap();
        Form::Matrices(HalfTransfer::of(&matrices))
    }

    fn stored(form: Form) -> OfMesh<StoredTransfer> {
        OfMesh { value: StoredTransfer::new(vec![form]).unwrap(), mesh: "ab12".into() }
    }

    #[test]
    fn values_of_vertices_come_back() {
        let (two, one) = (Degree::new(2).unwrap(), Degree::new(1).unwrap());
        let forms = [
            (matrices(0.25), ("transfer", "F16", vec![3, 9, 4])),
            (
                Form::Visibility(Visibility::new(two, one, numbers(3 * 16, 1.0)).unwrap()),
                ("visibility", "F32", vec![3, 16]),
            ),
            (
                Form::Matte(MatteTransfer::new(one, numbers(3 * 4, 1.0)).unwrap()),
                ("matte", "F32", vec![3, 4]),
            ),
        ];
        for (form, (name, dtype, shape)) in forms {
            let value = stored(form.clone());
            let bytes = encode_transfer(&value, Some("{}")).unwrap();
            assert_eq!(decode_transfer(&bytes).unwrap(), value);
            let tensors = super::super::describe(&bytes).unwrap().tensors;
            assert_eq!(tensors, [(name.to_owned(), dtype.to_owned(), shape)]);
            let coloured = StoredTransfer::new(vec![form; 3]).unwrap();
            let coloured = OfMesh { value: coloured, mesh: "ab12".into() };
            let bytes = encode_transfer(&coloured, None).unwrap();
            assert_eq!(decode_transfer(&bytes).unwrap(), coloured);
            for length in 0..bytes.len() {
                assert!(decode_transfer(&bytes[..length]).is_err(), "cut at {length}");
            }
            // All bits set are NaN.
            let mut bytes = bytes;
            let last = bytes.len() - 4;
            bytes[last..].fill(0xff);
            assert!(decode_transfer(&bytes).is_err(), "NaN");
        }
        for value in [vec![], vec![[1.0, -2.0, 0.5]; 4]] {
            let radiance = OfMesh { value, mesh: "cd".into() };
            let bytes = encode_vertex_radiance(&radiance, None).unwrap();
            assert_eq!(decode_vertex_radiance(&bytes).unwrap(), radiance);
        }
        for (second, shape) in [(0.0, vec![3]), (0.5, vec![3, 2])] {
            let value = vec![[0.0, 0.0], [0.25, second], [1.0, 0.0]];
            let blend = OfMesh { value, mesh: "ef".into() };
            let bytes = encode_vertex_blend(&blend, None).unwrap();
            assert_eq!(decode_vertex_blend(&bytes).unwrap(), blend);
            let (name, _, found) = super::super::describe(&bytes).unwrap().tensors.remove(0);
            assert_eq!((name.as_str(), found), ("blend", shape));
        }
    }

    #[test]
    fn errors_name_the_tensor_and_what_was_expected() {
        for bad in [f32::NAN, 1e6] {
            let error = encode_transfer(&stored(matrices(bad)), None).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Unwritable);
        }
        let written = |shape: &[usize], mesh: bool| {
            let mut file = Writer::new("transfer", None);
            if mesh {
                file.entry(MESH, "ab");
            }
            file.data.resize(2 * shape.iter().product::<usize>(), 0);
            file.tensor("transfer", "F16", shape);
            decode_transfer(&file.finish()).map_err(|error| error.to_string())
        };
        let expected = "tensor `transfer`: expected the shape [V, (O+1)^2, (F+1)^2], found [2, 3, 4]";
        assert_eq!(written(&[2, 3, 4], true).unwrap_err(), expected);
        let expected = "metadata `mesh`: expected the digest of a mesh, found none";
        assert_eq!(written(&[2, 4, 4], false).unwrap_err(), expected);
        assert!(written(&[2, 4, 1], true).is_ok());
        let mut file = Writer::new("transfer", None);
        file.entry(MESH, "ab");
        file.floats("visibility", &[1, 16], &[0.0; 16]).unwrap();
        let error = decode_transfer(&file.finish()).unwrap_err().to_string();
        assert_eq!(error, "metadata `output-degree`: expected the degree O, 0 to 3");
    }

    #[test]
    fn forms_of_earlier_versions_are_named() {
        for (names, expected) in [
            (
                &["bases", "cluster", "weights"][..],
                "the file holds transfer in clusters, which this version does not read; bake it again",
            ),
            (&["transfer"], "tensor `transfer`: expected F16, found F32"),
        ] {
            for prefixes in [&[""][..], &CHANNELS[..]] {
                let mut file = Writer::new("transfer", None);
                file.entry(MESH, "ab");
                for prefix in prefixes {
                    for name in names {
                        file.floats(&format!("{prefix}{name}"), &[1, 4, 4], &[0.0; 16]).unwrap();
                    }
                }
                let error = decode_transfer(&file.finish()).unwrap_err().to_string();
                assert_eq!(error.replace(prefixes[0], ""), expected);
            }
        }
    }
}
