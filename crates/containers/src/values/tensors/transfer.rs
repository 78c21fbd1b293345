//! Values at the vertices of a mesh: transfer and radiance, with the mesh's digest.

use half::f16;
use safetensors::tensor::{Dtype, TensorView};
use sh::Degree;
use transfer::{ClusteredTransfer, Form, HalfTransfer, MatteTransfer, StoredTransfer, Transfer, Visibility};

use super::file::{File, Writer, degree, wrong_shape};
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
/// | matrices | `transfer` [V, (O+1)^2, (F+1)^2] f32 or f16 |
/// | visibility | `visibility` [V, (O+F+1)^2] f32, and O as `output-degree` in the metadata |
/// | clusters | `bases` [K, n+1, (O+1)^2, (F+1)^2] f32: means, then components; `cluster` \[V\] u32; `weights` [V, n] f32 |
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
                file.floats(&name("transfer"), &shape, matrices.values())?;
            }
            Form::Half(matrices) => {
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
            Form::Clusters(clusters) => {
                let (rows, columns, n) =
                    (clusters.output().rows(), clusters.input().rows(), clusters.components());
                let count = clusters.bases().len() / ((n + 1) * rows * columns);
                file.floats(&name("bases"), &[count, n + 1, rows, columns], clusters.bases())?;
                file.data.extend(clusters.clusters().iter().flat_map(|cluster| cluster.to_le_bytes()));
                file.tensor(name("cluster"), "U32", &[clusters.len()]);
                file.floats(&name("weights"), &[clusters.len(), n], clusters.weights())?;
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
    let file = File::open_as(bytes, "transfer")?;
    let coloured = file.tensors.names().iter().any(|name| name.starts_with(CHANNELS[0]));
    let prefixes = if coloured { &CHANNELS[..] } else { &[""] };
    let channels = prefixes.iter().map(|prefix| form(&file, prefix)).collect::<Result<_, _>>()?;
    let value = StoredTransfer::new(channels)
        .ok_or_else(|| Error::damaged("the tensors of red, green and blue have different shapes"))?;
    Ok(OfMesh { value, mesh: digest(&file)? })
}

/// The form of a channel.
fn form(file: &File<'_>, prefix: &str) -> Result<Form, Error> {
    let name = |name: &str| format!("{prefix}{name}");
    if file.has(&name("visibility")) {
        return visibility(file, &name("visibility"));
    }
    if file.has(&name("bases")) {
        return clusters(file, prefix);
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
    let half = file.tensors.tensor(&name).is_ok_and(|tensor| tensor.dtype() == Dtype::F16);
    let tensor = file.tensor(&name, if half { Dtype::F16 } else { Dtype::F32 }, shape)?;
    let wrong = || wrong_shape(&name, shape, tensor.shape());
    let &[_, rows, columns] = tensor.shape() else { return Err(wrong()) };
    let (output, input) = (side(&name, rows).ok_or_else(wrong)??, side(&name, columns).ok_or_else(wrong)??);
    if half {
        let (words, _) = tensor.data().as_chunks::<2>();
        let values: Vec<f16> = words.iter().map(|word| f16::from_le_bytes(*word)).collect();
        refuse(&name, values.iter().position(|value| !value.is_finite()), ErrorKind::Damaged)?;
        return HalfTransfer::new(output, input, values).map(Form::Half).ok_or_else(wrong);
    }
    Transfer::new(output, input, values(&name, &tensor)?).map(Form::Matrices).ok_or_else(wrong)
}

fn visibility(file: &File<'_>, name: &str) -> Result<Form, Error> {
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

fn clusters(file: &File<'_>, prefix: &str) -> Result<Form, Error> {
    let [bases, cluster, weights] = ["bases", "cluster", "weights"].map(|name| format!("{prefix}{name}"));
    let shape = "[K, n+1, (O+1)^2, (F+1)^2]";
    let tensor = file.tensor(&bases, Dtype::F32, shape)?;
    let wrong = || wrong_shape(&bases, shape, tensor.shape());
    let &[_, bases_each, rows, columns] = tensor.shape() else { return Err(wrong()) };
    let n = bases_each.checked_sub(1).ok_or_else(wrong)?;
    let degrees = (side(&bases, rows).ok_or_else(wrong)??, side(&bases, columns).ok_or_else(wrong)??);
    let own = file.tensor(&cluster, Dtype::U32, "[V]")?;
    let (words, _) = own.data().as_chunks::<4>();
    let own = words.iter().map(|word| u32::from_le_bytes(*word)).collect();
    let shares = file.tensor(&weights, Dtype::F32, "[V, n]")?;
    let shares = values(&weights, &shares)?;
    let found = ClusteredTransfer::new(degrees, n, values(&bases, &tensor)?, own, shares);
    found.map(Form::Clusters).ok_or_else(|| {
        Error::damaged("expected n weights and a cluster below K for each vertex, found others")
    })
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
    let file = File::open_as(bytes, "vertex-radiance")?;
    let tensor = file.tensor(NAME, Dtype::F32, SHAPE)?;
    let &[_, 3] = tensor.shape() else { return Err(wrong_shape(NAME, SHAPE, tensor.shape())) };
    let value = values(NAME, &tensor)?;
    let (rows, _) = value.as_chunks::<3>();
    Ok(OfMesh { value: rows.to_vec(), mesh: digest(&file)? })
}

/// A number for each vertex, which says what of a table's materials is there: `blend` \[V\] f32, and the
/// digest of the mesh in the metadata.
///
/// # Errors
/// If a number is not finite.
pub fn encode_vertex_blend(blend: &OfMesh<Vec<f32>>, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("vertex-blend", recipe);
    file.entry(MESH, blend.mesh.clone());
    file.floats("blend", &[blend.value.len()], &blend.value)?;
    Ok(file.finish())
}

/// The blend of vertices, from a file of kind `vertex-blend`.
///
/// # Errors
/// The errors of [`super::decode_lighting`].
pub fn decode_vertex_blend(bytes: &[u8]) -> Result<OfMesh<Vec<f32>>, Error> {
    const NAME: &str = "blend";
    const SHAPE: &str = "[V]";
    let file = File::open_as(bytes, "vertex-blend")?;
    let tensor = file.tensor(NAME, Dtype::F32, SHAPE)?;
    let &[_] = tensor.shape() else { return Err(wrong_shape(NAME, SHAPE, tensor.shape())) };
    Ok(OfMesh { value: values(NAME, &tensor)?, mesh: digest(&file)? })
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

fn digest(file: &File<'_>) -> Result<String, Error> {
    let found = file.metadata.get(MESH).cloned();
    found.ok_or_else(|| Error::damaged("metadata `mesh`: expected the digest of a mesh, found none"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(count: usize, value: f32) -> Vec<f32> {
        (0..count).map(|i| value * i as f32).collect()
    }

    fn matrices(value: f32) -> Transfer {
        let (output, input) = (Degree::new(2).unwrap(), Degree::new(1).unwrap());
        Transfer::new(output, input, numbers(3 * 9 * 4, value)).unwrap()
    }

    fn stored(form: Form) -> OfMesh<StoredTransfer> {
        OfMesh { value: StoredTransfer::new(vec![form]).unwrap(), mesh: "ab12".into() }
    }

    #[test]
    fn values_of_vertices_come_back() {
        let (two, one) = (Degree::new(2).unwrap(), Degree::new(1).unwrap());
        let clusters =
            ClusteredTransfer::new((two, one), 2, numbers(2 * 3 * 36, 0.5), vec![1, 0, 1], numbers(6, 1.0));
        let forms = [
            (Form::Matrices(matrices(0.25)), vec![("transfer", "F32", vec![3, 9, 4])]),
            (Form::Half(HalfTransfer::of(&matrices(0.25))), vec![("transfer", "F16", vec![3, 9, 4])]),
            (
                Form::Visibility(Visibility::new(two, one, numbers(3 * 16, 1.0)).unwrap()),
                vec![("visibility", "F32", vec![3, 16])],
            ),
            (
                Form::Clusters(clusters.unwrap()),
                vec![
                    ("bases", "F32", vec![2, 3, 9, 4]),
                    ("cluster", "U32", vec![3]),
                    ("weights", "F32", vec![3, 2]),
                ],
            ),
            (
                Form::Matte(MatteTransfer::new(one, numbers(3 * 4, 1.0)).unwrap()),
                vec![("matte", "F32", vec![3, 4])],
            ),
        ];
        for (form, expected) in forms {
            let value = stored(form.clone());
            let bytes = encode_transfer(&value, Some("{}")).unwrap();
            assert_eq!(decode_transfer(&bytes).unwrap(), value);
            let tensors = super::super::describe(&bytes).unwrap().tensors;
            let expected =
                expected.into_iter().map(|(name, dtype, shape)| (name.to_owned(), dtype.to_owned(), shape));
            assert_eq!(tensors, expected.collect::<Vec<_>>());
            let coloured = StoredTransfer::new(vec![form; 3]).unwrap();
            let coloured = OfMesh { value: coloured, mesh: "ab12".into() };
            let bytes = encode_transfer(&coloured, None).unwrap();
            assert_eq!(decode_transfer(&bytes).unwrap(), coloured);
            for length in 0..bytes.len() {
                assert!(decode_transfer(&bytes[..length]).is_err(), "cut at {length}");
            }
            // All bits set are NaN, and a cluster that is not there.
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
        let blend = OfMesh { value: vec![0.0, 0.25, 1.0], mesh: "ef".into() };
        let bytes = encode_vertex_blend(&blend, None).unwrap();
        assert_eq!(decode_vertex_blend(&bytes).unwrap(), blend);
        assert_eq!(super::super::describe(&bytes).unwrap().tensors[0].0, "blend");
    }

    #[test]
    fn errors_name_the_tensor_and_what_was_expected() {
        let error = encode_transfer(&stored(Form::Matrices(matrices(f32::NAN))), None).unwrap_err();
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
        let mut file = Writer::new("transfer", None);
        file.entry(MESH, "ab");
        file.floats("visibility", &[1, 16], &[0.0; 16]).unwrap();
        let error = decode_transfer(&file.finish()).unwrap_err().to_string();
        assert_eq!(error, "metadata `output-degree`: expected the degree O, 0 to 3");
    }
}
