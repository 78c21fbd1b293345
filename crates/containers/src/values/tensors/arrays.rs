//! Tensors whose first axis counts things, as lists of their numbers.

use safetensors::tensor::Dtype;

use super::file::{TensorFile, Writer, wrong_shape};
use crate::error::{Error, ErrorKind};

impl Writer {
    /// A tensor of f32, which may be anything.
    pub(super) fn numbers(&mut self, name: &str, shape: &[usize], values: &[f32]) {
        self.data.reserve(4 * values.len());
        self.extend_f32(values);
        self.tensor(name, "F32", shape);
    }

    /// A tensor of u32.
    pub(super) fn words(&mut self, name: &str, shape: &[usize], values: &[u32]) {
        self.data.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        self.tensor(name, "U32", shape);
    }

    /// A tensor of u64.
    pub(super) fn long_words(&mut self, name: &str, shape: &[usize], values: &[u64]) {
        self.data.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        self.tensor(name, "U64", shape);
    }
}

impl TensorFile<'_> {
    /// The numbers of a tensor whose shape is that of one thing, `columns`, after their count; `shape` is
    /// for messages.
    pub(super) fn array<T, const N: usize>(
        &self,
        name: &str,
        dtype: Dtype,
        shape: &str,
        columns: &[usize],
        number: impl Fn([u8; N]) -> T,
    ) -> Result<Vec<T>, Error> {
        let tensor = self.tensor(name, dtype, shape)?;
        match tensor.shape() {
            [_, found @ ..] if found == columns => {
                Ok(tensor.data().as_chunks::<N>().0.iter().map(|word| number(*word)).collect())
            }
            found => Err(wrong_shape(name, shape, found)),
        }
    }
}

/// An error that names the first number that is not finite.
pub(super) fn refuse_infinite(
    name: &str,
    mut values: impl Iterator<Item = f32>,
    kind: ErrorKind,
) -> Result<(), Error> {
    match values.position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(first) => {
            Err(Error::new(kind, format!("tensor `{name}`: expected finite values; number {first} is not")))
        }
    }
}
