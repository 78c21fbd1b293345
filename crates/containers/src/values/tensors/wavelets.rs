//! Light on cells of equal area: a mipmap, or Haar wavelets.

use super::file::Writer;
use crate::error::{Error, ErrorKind};

/// Values of `rows` x 2 `rows` cells of equal area: rows equal in z from +Z down, columns equal in azimuth
/// from +X toward +Y.
#[derive(Clone, Debug, PartialEq)]
pub enum Wavelets {
    /// The means over the cells, row by row, then over larger and larger ones.
    Mipmap(Vec<Vec<[f32; 3]>>),
    /// All wavelets, those of each step together, row by row.
    All(Vec<[f32; 3]>),
    /// The largest wavelets.
    Largest {
        /// The number of each, row by row, and itself.
        wavelets: Vec<(u32, [f32; 3])>,
        /// The root mean square of the error, relative to that of the light.
        error: f64,
    },
}

/// Light on cells of equal area as a file, f32: `level0` [rows, 2 rows, 3], `level1` ... of a mipmap; `haar`
/// [rows, 2 rows, 3] of all wavelets; `index` \[n\] u32 and `haar` [n, 3] of the largest.
///
/// # Errors
/// If a number is not finite, or there are not as many as cells.
pub fn encode_wavelets(rows: usize, wavelets: &Wavelets, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("wavelets", recipe);
    file.entry("rows", rows.to_string());
    match wavelets {
        Wavelets::Mipmap(levels) => {
            file.entry("form", "mipmap");
            for (level, values) in levels.iter().enumerate() {
                let [height, width] = [rows, 2 * rows].map(|side| (side >> level).max(1));
                add(&mut file, &format!("level{level}"), values, &[height, width, 3])?;
            }
        }
        Wavelets::All(values) => {
            file.entry("form", "haar");
            add(&mut file, "haar", values, &[rows, 2 * rows, 3])?;
        }
        Wavelets::Largest { wavelets, error } => {
            file.entry("form", "haar");
            file.entry("error", error.to_string());
            let values: Vec<[f32; 3]> = wavelets.iter().map(|(_, value)| *value).collect();
            file.data.extend(wavelets.iter().flat_map(|(index, _)| index.to_le_bytes()));
            file.tensor("index", "U32", &[wavelets.len()]);
            add(&mut file, "haar", &values, &[wavelets.len(), 3])?;
        }
    }
    Ok(file.finish())
}

/// Adds a tensor.
fn add(file: &mut Writer, name: &str, values: &[[f32; 3]], shape: &[usize]) -> Result<(), Error> {
    let values = values.as_flattened();
    let unwritable = |message| Err(Error::new(ErrorKind::Unwritable, message).within("safetensors"));
    if values.len() != shape.iter().product::<usize>() {
        return unwritable(format!(
            "tensor `{name}`: expected the shape {shape:?}, found {} numbers",
            values.len()
        ));
    }
    if let Some(at) = values.iter().position(|value| !value.is_finite()) {
        let (value, row) = (values[at], at / 3);
        return unwritable(format!("tensor `{name}`: expected finite values; row {row} has {value}"));
    }
    file.extend_f32(values);
    file.tensor(name, "F32", shape);
    Ok(())
}
