//! A BRDF table: coefficients of rho_hat for every view.

use brdf::{BelowHorizon, BrdfTable};
use safetensors::tensor::Dtype;

use super::file::{TensorFile, Writer, degree, wrong_shape};
use crate::error::{Error, ErrorKind};
use crate::values::brdf_table_metadata::{below_name, brdf_table_metadata, incident_name};

const NAME: &str = "c";
const SHAPE: &str = "[Q, N, N, (F+1)^2, 1 or 3]";

/// A BRDF table: `c` [Q, N, N, (F+1)^2, channels] f32, one channel if it is grey. If two parameters vary, Q
/// is Q_a Q_b, which `grid` in the metadata has.
///
/// # Errors
/// If a number is not finite.
pub fn encode_brdf_table(table: &BrdfTable, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    check(table.values(), table.texel(), ErrorKind::Unwritable)?;
    let mut file = Writer::new("brdf-table", recipe);
    file.metadata.extend(brdf_table_metadata(table).into_iter().map(|(key, value)| (key.to_owned(), value)));
    file.data.reserve_exact(4 * table.values().len());
    file.extend_f32(table.values());
    let (size, rows) = (table.size(), table.degree().rows());
    file.tensor(NAME, "F32", &[table.count(), size, size, rows, table.channels()]);
    Ok(file.finish())
}

/// A BRDF table, from a file of kind `brdf-table`.
///
/// # Errors
/// The errors of [`super::decode_lighting`].
pub fn decode_brdf_table(bytes: &[u8]) -> Result<BrdfTable, Error> {
    let file = TensorFile::open_as(bytes, "brdf-table")?;
    let words = [BelowHorizon::Clamped, BelowHorizon::Mirrored].map(|below| (below_name(below), below));
    let below = file.choice("below", words)?;
    let lit_from_below = file.choice("incident", [false, true].map(|lit| (incident_name(lit), lit)))?;
    let tensor = file.tensor(NAME, Dtype::F32, SHAPE)?;
    let wrong = || wrong_shape(NAME, SHAPE, tensor.shape());
    let &[_, size, columns, rows, channels] = tensor.shape() else { return Err(wrong()) };
    let side = rows.isqrt();
    if size != columns || side == 0 || side * side != rows {
        return Err(wrong());
    }
    let (words, _) = tensor.data().as_chunks::<4>();
    let values: Vec<f32> = words.iter().map(|word| f32::from_le_bytes(*word)).collect();
    check(&values, rows * channels, ErrorKind::Damaged)?;
    let table = BrdfTable::new(degree(NAME, side - 1)?, size, channels, below, values).ok_or_else(wrong)?;
    let count = table.count();
    let table = table.with_lit_from_below(lit_from_below);
    let Some(words) = file.metadata.get("grid") else { return Ok(table) };
    let grid = words.split_once(" x ").map(|(along, across)| [along, across].map(str::parse));
    let table = match grid {
        Some([Ok(along), Ok(across)]) => table.with_grid([along, across]),
        _ => None,
    };
    table.ok_or_else(|| {
        Error::damaged(format!(
            "metadata `grid`: expected Q_a x Q_b of {count} materials, as in `{count} x 1`, found `{words}`"
        ))
    })
}

fn check(values: &[f32], texel: usize, kind: ErrorKind) -> Result<(), Error> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(first) => {
            let message =
                format!("tensor `{NAME}`: expected finite values; one of texel {} is not", first / texel);
            Err(Error::new(kind, message))
        }
    }
}

#[cfg(test)]
mod tests {
    use sh::Degree;

    use super::*;
    use crate::values::tensors::describe;

    fn table(count: usize, channels: usize, below: BelowHorizon) -> BrdfTable {
        let values = (0..count * 9 * 4 * channels).map(|i| 0.25 * i as f32 - 1.0).collect();
        BrdfTable::new(Degree::new(1).unwrap(), 3, channels, below, values).unwrap()
    }

    #[test]
    fn tables_come_back() {
        for (count, channels, below) in
            [(1, 1, BelowHorizon::Clamped), (2, 3, BelowHorizon::Mirrored), (3, 1, BelowHorizon::Mirrored)]
        {
            let table = table(count, channels, below).with_lit_from_below(channels == 1);
            let bytes = encode_brdf_table(&table, Some("{}")).unwrap();
            assert_eq!(decode_brdf_table(&bytes).unwrap(), table);
            assert_eq!(bytes, encode_brdf_table(&table, Some("{}")).unwrap());
            let tensors = describe(&bytes).unwrap().tensors;
            assert_eq!(tensors, [("c".to_owned(), "F32".to_owned(), vec![count, 3, 3, 4, channels])]);
        }
        let grid = table(6, 1, BelowHorizon::Clamped).with_grid([2, 3]).unwrap();
        let bytes = encode_brdf_table(&grid, None).unwrap();
        assert_eq!(decode_brdf_table(&bytes).unwrap(), grid);
        let shown = describe(&bytes).unwrap().metadata;
        assert!(shown.iter().any(|(key, value)| key == "grid" && value == "2 x 3"), "{shown:?}");
    }

    #[test]
    fn errors_name_the_tensor_and_what_was_expected() {
        let written = |shape: &[usize], below: &str, numbers: &[f32]| {
            let mut file = Writer::new("brdf-table", None);
            file.entry("below", below);
            file.entry("incident", "hemisphere");
            file.extend_f32(numbers);
            file.tensor(NAME, "F32", shape);
            decode_brdf_table(&file.finish()).unwrap_err().to_string()
        };
        let expected = "tensor `c`: expected the shape [Q, N, N, (F+1)^2, 1 or 3], found ";
        for shape in [&[1, 2, 1, 1, 1][..], &[1, 1, 1, 2, 1], &[1, 1, 1, 1, 2], &[1, 1, 2, 1]] {
            let zeros = vec![0.0; shape.iter().product()];
            assert_eq!(written(shape, "clamped", &zeros), format!("{expected}{shape:?}"));
        }
        assert_eq!(written(&[0, 1, 1, 1, 1], "clamped", &[]), format!("{expected}[0, 1, 1, 1, 1]"));
        assert_eq!(
            written(&[1, 1, 1, 1, 1], "open", &[0.0]),
            "metadata `below`: expected clamped or mirrored, found `open`"
        );
        for words in ["1 x 2", "-1 x -1", "1", "one x one"] {
            let mut file = Writer::new("brdf-table", None);
            for (key, value) in [("below", "clamped"), ("incident", "hemisphere"), ("grid", words)] {
                file.entry(key, value);
            }
            file.extend_f32(&[0.0]);
            file.tensor(NAME, "F32", &[1; 5]);
            let found = decode_brdf_table(&file.finish()).unwrap_err().to_string();
            let expected = "metadata `grid`: expected Q_a x Q_b of 1 materials, as in `1 x 1`, found ";
            assert_eq!(found, format!("{expected}`{words}`"));
        }
        let nan = written(&[2, 1, 1, 1, 1], "clamped", &[0.0, f32::NAN]);
        assert_eq!(nan, "tensor `c`: expected finite values; one of texel 1 is not");
        let infinite =
            BrdfTable::new(Degree::ZERO, 1, 1, BelowHorizon::Clamped, vec![f32::INFINITY]).unwrap();
        assert_eq!(encode_brdf_table(&infinite, None).unwrap_err().kind(), ErrorKind::Unwritable);
    }
}
