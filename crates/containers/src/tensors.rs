//! Coefficients and environments as safetensors, readable from Python in one line.
//!
//! | kind | tensors | metadata |
//! | --- | --- | --- |
//! | `lighting` | `sh` [(F+1)^2, 3] f64, row l*l + l + m | |
//! | `brdf` | `rho` [F+1, P+1, P+1, 3] f64, indexed l, p, q >= 0 | `centre` |
//! | `reflection` | `sh` and `rho`, of one degree F | `centre` |
//! | `material` | `table0` [n_h, n_d, n_phi, 3] f32, ... where it is measured | `material` |
//! | `environment` | `radiance` [height, width, 3] f32, row 0 toward +Z | |
//! | `shrm` | `shrm` [faces, height, width, (P+1)^2, 3] f32, row p*p + p + q | `layout`, `view`, `centre`, `terms` |
//! | `mesh` | `positions` [V, 3], `normals` [V, 3], `tangents` [V, 4], `coordinates` [V, 2] or none f32; `triangles` [T, 3] u32 | |
//!
//! `__metadata__` holds `kind`, `centre` (`reflection`, `normal` or `tangent`) where a BRDF had a part, and
//! `specula`, the recipe. A `shrm` always has every row, zeros included: `terms` is `zonal` where those with q other
//! than 0 are zero throughout, else `all`. Its `layout` is `lat-long` (one face) or `cube` (six), its `view` `local`
//! or `global`; further entries tell a person the frame and the basis. A `rho` of one channel is read as grey. All values are finite, and `rho` is zero where
//! q > min(l, p): that is checked both ways.
//!
//! The file is written here and not by the `safetensors` crate, which keeps metadata in a hash map: its bytes
//! would differ from run to run.

use std::collections::BTreeMap;

use brdf::{BrdfCoefficients, Centre};
use envmap::Environment;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde_json::json;
use sh::{Degree, Expansion};
use sphere::LatLong;

mod material;
mod mesh;
mod reflection_map;

pub use material::{decode_material, encode_material};
pub use mesh::{decode_mesh, encode_mesh};
pub use reflection_map::{decode_shrm, encode_shrm};

use crate::error::{Error, ErrorKind};
use crate::format::refuse_non_files;
use crate::recipe::KEY;

/// What stands in a safetensors file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    /// Name, type and shape of each tensor, in the order of the file.
    pub tensors: Vec<(String, String, Vec<usize>)>,
    /// The entries of `__metadata__`.
    pub metadata: BTreeMap<String, String>,
}

/// What stands in a safetensors file, whoever wrote it.
///
/// # Errors
/// Where the bytes are no safetensors file.
pub fn describe(bytes: &[u8]) -> Result<Description, Error> {
    let file = File::open(bytes)?;
    let mut tensors = file.tensors.tensors();
    tensors.sort_by_key(|(_, tensor)| tensor.data().as_ptr());
    let tensors =
        tensors.into_iter().map(|(name, t)| (name, t.dtype().to_string(), t.shape().to_vec())).collect();
    Ok(Description { tensors, metadata: file.metadata })
}

/// Lighting: `sh` [(F+1)^2, 3].
///
/// # Errors
/// Where a coefficient is not finite.
pub fn encode_lighting(lighting: &Expansion, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("lighting", recipe);
    file.lighting(lighting)?;
    Ok(file.finish())
}

/// Lighting, from a file of kind `lighting`.
///
/// # Errors
/// Where the file is not one that [`encode_lighting`] could have written; the message names the tensor and what
/// was expected.
pub fn decode_lighting(bytes: &[u8]) -> Result<Expansion, Error> {
    File::open_as(bytes, "lighting")?.lighting()
}

/// A BRDF: `rho` [F+1, P+1, P+1, 3] and its centre.
///
/// # Errors
/// Where a coefficient is not finite, or not zero where q > min(l, p).
pub fn encode_brdf(brdf: &BrdfCoefficients, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("brdf", recipe);
    file.brdf(brdf)?;
    Ok(file.finish())
}

/// A BRDF, from a file of kind `brdf`.
///
/// # Errors
/// As [`decode_lighting`].
pub fn decode_brdf(bytes: &[u8]) -> Result<BrdfCoefficients, Error> {
    File::open_as(bytes, "brdf")?.brdf()
}

/// The two factors of a reflected field: `sh` and `rho`, of one degree F.
///
/// # Errors
/// As [`encode_lighting`] and [`encode_brdf`], and where the degrees differ.
pub fn encode_reflection(
    lighting: &Expansion,
    brdf: &BrdfCoefficients,
    recipe: Option<&str>,
) -> Result<Vec<u8>, Error> {
    same_degree(lighting, brdf).map_err(|message| Error::new(ErrorKind::Unwritable, message))?;
    let mut file = Writer::new("reflection", recipe);
    file.brdf(brdf)?;
    file.lighting(lighting)?;
    Ok(file.finish())
}

/// Lighting and BRDF, from a file of kind `reflection`.
///
/// # Errors
/// As [`decode_lighting`].
pub fn decode_reflection(bytes: &[u8]) -> Result<(Expansion, BrdfCoefficients), Error> {
    let file = File::open_as(bytes, "reflection")?;
    let (lighting, brdf) = (file.lighting()?, file.brdf()?);
    same_degree(&lighting, &brdf).map_err(Error::damaged)?;
    Ok((lighting, brdf))
}

/// An environment: `radiance` [height, width, 3] f32.
///
/// # Errors
/// Where a value is not finite.
pub fn encode_environment(environment: &Environment, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let LatLong { width, height } = environment.grid();
    let values = environment.pixels().as_flattened();
    if let Some(first) = values.iter().position(|value| !value.is_finite()) {
        return Err(not_finite("radiance", first, ErrorKind::Unwritable));
    }
    let mut file = Writer::new("environment", recipe);
    file.data.reserve_exact(4 * values.len());
    file.data.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    file.tensor("radiance", "F32", &[height, width, 3]);
    Ok(file.finish())
}

/// An environment, from a file of kind `environment`.
///
/// # Errors
/// As [`decode_lighting`].
pub fn decode_environment(bytes: &[u8]) -> Result<Environment, Error> {
    const NAME: &str = "radiance";
    let file = File::open_as(bytes, "environment")?;
    let tensor = file.tensor(NAME, Dtype::F32, "[height, width, 3]")?;
    let &[height, width, 3] = tensor.shape() else {
        return Err(wrong_shape(NAME, "[height, width, 3]", tensor.shape()));
    };
    let value = |bytes: &[u8]| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let pixels: Vec<[f32; 3]> = tensor
        .data()
        .chunks_exact(12)
        .map(|rgb| [value(&rgb[0..4]), value(&rgb[4..8]), value(&rgb[8..12])])
        .collect();
    if let Some(first) = pixels.as_flattened().iter().position(|value| !value.is_finite()) {
        return Err(not_finite(NAME, first, ErrorKind::Damaged));
    }
    Environment::new(LatLong { width, height }, pixels)
        .ok_or_else(|| wrong_shape(NAME, "[height, width, 3], none of them 0", tensor.shape()))
}

pub(crate) fn read_recipe(bytes: &[u8]) -> Option<String> {
    File::open(bytes).ok()?.metadata.remove(KEY)
}

/// A file being written.
struct Writer {
    metadata: BTreeMap<&'static str, String>,
    /// The header's entry of each tensor. The format wants descending alignment; kinds mix no types.
    tensors: Vec<(String, serde_json::Value)>,
    data: Vec<u8>,
    start: usize,
}

impl Writer {
    fn new(kind: &str, recipe: Option<&str>) -> Self {
        let mut metadata = BTreeMap::from([("kind", kind.to_owned())]);
        metadata.extend(recipe.map(|recipe| (KEY, recipe.to_owned())));
        Self { metadata, tensors: Vec::new(), data: Vec::new(), start: 0 }
    }

    fn lighting(&mut self, lighting: &Expansion) -> Result<(), Error> {
        self.coefficients("sh", lighting.coefficients(), &[lighting.degree().rows(), 3])
    }

    fn brdf(&mut self, brdf: &BrdfCoefficients) -> Result<(), Error> {
        let (l, side) = (brdf.f().get() + 1, brdf.p().get() + 1);
        check_triangle(brdf).map_err(|message| Error::new(ErrorKind::Unwritable, message))?;
        self.metadata.insert("centre", centre_name(brdf.centre()).to_owned());
        self.coefficients("rho", brdf.rho(), &[l, side, side, 3])
    }

    fn coefficients(&mut self, name: &'static str, rows: &[[f64; 3]], shape: &[usize]) -> Result<(), Error> {
        let values = rows.as_flattened();
        if let Some(first) = values.iter().position(|value| !value.is_finite()) {
            return Err(not_finite(name, first, ErrorKind::Unwritable));
        }
        self.data.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        self.tensor(name, "F64", shape);
        Ok(())
    }

    fn extend_f32(&mut self, values: &[f32]) {
        self.data.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    /// Names the data added since the last tensor.
    fn tensor(&mut self, name: impl Into<String>, dtype: &str, shape: &[usize]) {
        let offsets = [self.start, self.data.len()];
        self.start = self.data.len();
        self.tensors.push((name.into(), json!({ "dtype": dtype, "shape": shape, "data_offsets": offsets })));
    }

    fn finish(self) -> Vec<u8> {
        let mut header = format!("{{\"__metadata__\":{}", json!(self.metadata));
        for (name, entry) in &self.tensors {
            header.push_str(&format!(",\"{name}\":{entry}"));
        }
        header.push('}');
        // Spaces fill up to 8 bytes, so that the data are aligned.
        let padded = header.len().next_multiple_of(8);
        header.extend(std::iter::repeat_n(' ', padded - header.len()));
        let mut bytes = Vec::with_capacity(8 + padded + self.data.len());
        bytes.extend_from_slice(&(padded as u64).to_le_bytes());
        bytes.extend_from_slice(header.as_bytes());
        bytes.extend_from_slice(&self.data);
        bytes
    }
}

/// A file being read.
struct File<'a> {
    tensors: SafeTensors<'a>,
    metadata: BTreeMap<String, String>,
}

impl<'a> File<'a> {
    fn open(bytes: &'a [u8]) -> Result<Self, Error> {
        refuse_non_files(bytes)?;
        let describe = |error: safetensors::SafeTensorError| {
            use safetensors::SafeTensorError as Fault;
            match error {
                Fault::HeaderTooSmall | Fault::InvalidHeaderLength | Fault::MetadataIncompleteBuffer => {
                    Error::truncated(format!("the file is truncated or no safetensors file ({error})"))
                }
                other => Error::damaged(format!("no sound safetensors file: {other}")),
            }
        };
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(describe)?;
        let tensors = SafeTensors::deserialize(bytes).map_err(describe)?;
        let metadata = header.metadata().clone().unwrap_or_default().into_iter().collect();
        Ok(Self { tensors, metadata })
    }

    fn open_as(bytes: &'a [u8], kind: &str) -> Result<Self, Error> {
        let file = Self::open(bytes)?;
        match file.metadata.get("kind") {
            Some(found) if found == kind => Ok(file),
            Some(found) => {
                Err(Error::damaged(format!("expected a file of kind `{kind}`, found kind `{found}`")))
            }
            None => Err(Error::damaged(format!(
                "expected a file of kind `{kind}`, found no `kind` in its metadata"
            ))),
        }
    }

    fn tensor(&self, name: &str, dtype: Dtype, shape: &str) -> Result<TensorView<'a>, Error> {
        let tensor = self.tensors.tensor(name).map_err(|_| {
            let names = self.tensors.names().join(", ");
            Error::damaged(format!("expected a tensor `{name}` {shape} {dtype}, found the tensors: {names}"))
        })?;
        if tensor.dtype() != dtype {
            return Err(Error::damaged(format!(
                "tensor `{name}`: expected {dtype}, found {}",
                tensor.dtype()
            )));
        }
        Ok(tensor)
    }

    fn lighting(&self) -> Result<Expansion, Error> {
        const NAME: &str = "sh";
        const SHAPE: &str = "[(F+1)^2, 3]";
        let tensor = self.tensor(NAME, Dtype::F64, SHAPE)?;
        let &[rows, 3] = tensor.shape() else { return Err(wrong_shape(NAME, SHAPE, tensor.shape())) };
        let side = rows.isqrt();
        if side == 0 || side * side != rows {
            return Err(wrong_shape(NAME, SHAPE, tensor.shape()));
        }
        let degree = degree(NAME, side - 1)?;
        Expansion::from_coefficients(degree, coefficients(NAME, &tensor)?)
            .ok_or_else(|| wrong_shape(NAME, SHAPE, tensor.shape()))
    }

    fn centre(&self) -> Result<Centre, Error> {
        let centres = [Centre::Reflection, Centre::Normal, Centre::Tangent];
        self.choice("centre", centres.map(|centre| (centre_name(centre), centre)))
    }

    /// The value of a metadata entry that is one of these words.
    fn choice<T: Copy, const N: usize>(&self, key: &str, words: [(&str, T); N]) -> Result<T, Error> {
        let found = self.metadata.get(key).map(String::as_str);
        if let Some((_, value)) = words.iter().find(|(word, _)| found == Some(word)) {
            return Ok(*value);
        }
        let expected = match words.map(|(word, _)| word).as_slice() {
            [most @ .., last] => format!("{} or {last}", most.join(", ")),
            [] => String::new(),
        };
        let found = found.map_or("none".to_owned(), |found| format!("`{found}`"));
        Err(Error::damaged(format!("metadata `{key}`: expected {expected}, found {found}")))
    }

    fn brdf(&self) -> Result<BrdfCoefficients, Error> {
        const NAME: &str = "rho";
        const SHAPE: &str = "[F+1, P+1, P+1, 1 or 3]";
        let centre = self.centre()?;
        let tensor = self.tensor(NAME, Dtype::F64, SHAPE)?;
        let (l, p) = match *tensor.shape() {
            [l, p, q, 1 | 3] if l > 0 && p > 0 && p == q => (l, p),
            _ => return Err(wrong_shape(NAME, SHAPE, tensor.shape())),
        };
        let brdf = BrdfCoefficients::new(
            centre,
            degree(NAME, l - 1)?,
            degree(NAME, p - 1)?,
            coefficients(NAME, &tensor)?,
        )
        .ok_or_else(|| wrong_shape(NAME, SHAPE, tensor.shape()))?;
        check_triangle(&brdf).map_err(Error::damaged)?;
        Ok(brdf)
    }
}

/// The finite f64 of a tensor whose last axis is colour; one channel is grey.
fn coefficients(name: &str, tensor: &TensorView<'_>) -> Result<Vec<[f64; 3]>, Error> {
    let values: Vec<f64> = tensor
        .data()
        .chunks_exact(8)
        .map(|b| f64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]))
        .collect();
    if let Some(first) = values.iter().position(|value| !value.is_finite()) {
        return Err(not_finite(name, first, ErrorKind::Damaged));
    }
    Ok(match tensor.shape().last() {
        Some(1) => values.into_iter().map(|grey| [grey; 3]).collect(),
        _ => values.chunks_exact(3).map(|rgb| [rgb[0], rgb[1], rgb[2]]).collect(),
    })
}

fn check_triangle(brdf: &BrdfCoefficients) -> Result<(), String> {
    for l in 0..=brdf.f().get() {
        for p in 0..=brdf.p().get() {
            for q in l.min(p) + 1..=brdf.p().get() {
                if brdf.get(l, p, q) != [0.0; 3] {
                    return Err(format!(
                        "tensor `rho`: expected 0 where q > min(l, p), found {:?} at [{l}, {p}, {q}]",
                        brdf.get(l, p, q)
                    ));
                }
            }
        }
    }
    Ok(())
}

fn same_degree(lighting: &Expansion, brdf: &BrdfCoefficients) -> Result<(), String> {
    let (left, right) = (lighting.degree().get(), brdf.f().get());
    if left == right {
        Ok(())
    } else {
        Err(format!("expected `sh` and `rho` of one degree, found {left} and {right}"))
    }
}

pub(crate) const fn centre_name(centre: Centre) -> &'static str {
    match centre {
        Centre::Reflection => "reflection",
        Centre::Normal => "normal",
        Centre::Tangent => "tangent",
    }
}

fn degree(name: &str, l: usize) -> Result<Degree, Error> {
    Degree::new(l).map_err(|error| Error::new(ErrorKind::TooLarge, format!("tensor `{name}`: {error}")))
}

fn wrong_shape(name: &str, expected: &str, found: &[usize]) -> Error {
    Error::damaged(format!("tensor `{name}`: expected the shape {expected}, found {found:?}"))
}

fn not_finite(name: &str, position: usize, kind: ErrorKind) -> Error {
    let (row, channel) = (position / 3, position % 3);
    Error::new(kind, format!("tensor `{name}`: expected finite values; row {row}, channel {channel} is not"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lighting(degree: usize) -> Expansion {
        let degree = Degree::new(degree).unwrap();
        let rows = (0..degree.rows()).map(|i| [i as f64, -0.1 * i as f64, 1e-300]).collect();
        Expansion::from_coefficients(degree, rows).unwrap()
    }

    fn material() -> BrdfCoefficients {
        let (f, p) = (Degree::new(3).unwrap(), Degree::new(2).unwrap());
        let rho = (0..4 * 9)
            .map(|i| {
                let (l, p, q) = (i / 9, i / 3 % 3, i % 3);
                if q > l.min(p) { [0.0; 3] } else { [i as f64, 0.5, -1.0 / 3.0] }
            })
            .collect();
        BrdfCoefficients::new(Centre::Tangent, f, p, rho).unwrap()
    }

    fn environment() -> Environment {
        let grid = LatLong { width: 6, height: 3 };
        Environment::new(grid, (0..18).map(|i| [i as f32, 0.1, 3.0e38]).collect()).unwrap()
    }

    #[test]
    fn every_kind_comes_back_bit_for_bit() {
        let recipe = Some(r#"{"kind":"project-sh","name":"größe"}"#);
        for degree in [0, 1, 5, 30] {
            let bytes = encode_lighting(&lighting(degree), recipe).unwrap();
            assert_eq!(decode_lighting(&bytes).unwrap(), lighting(degree));
            assert_eq!(read_recipe(&bytes).as_deref(), recipe);
            assert_eq!(bytes, encode_lighting(&lighting(degree), recipe).unwrap());
        }
        assert_eq!(decode_brdf(&encode_brdf(&material(), None).unwrap()).unwrap(), material());
        let both = encode_reflection(&lighting(3), &material(), None).unwrap();
        assert_eq!(decode_reflection(&both).unwrap(), (lighting(3), material()));
        let radiance = encode_environment(&environment(), None).unwrap();
        assert_eq!(decode_environment(&radiance).unwrap(), environment());
    }

    #[test]
    fn a_file_describes_itself() {
        let description =
            describe(&encode_reflection(&lighting(3), &material(), Some("{}")).unwrap()).unwrap();
        assert_eq!(
            description.tensors,
            [("rho".into(), "F64".into(), vec![4, 3, 3, 3]), ("sh".into(), "F64".into(), vec![16, 3])]
        );
        let metadata: Vec<_> = description.metadata.into_iter().collect();
        let pair = |key: &str, value: &str| (key.to_owned(), value.to_owned());
        assert_eq!(metadata, [pair("centre", "tangent"), pair("kind", "reflection"), pair("specula", "{}")]);
    }

    fn written(kind: &str, name: &str, dtype: Dtype, shape: Vec<usize>, data: &[u8]) -> Vec<u8> {
        let view = TensorView::new(dtype, shape, data).unwrap();
        let metadata = [("kind".to_owned(), kind.to_owned()), ("centre".to_owned(), "normal".to_owned())];
        safetensors::serialize([(name, view)], Some(metadata.into_iter().collect())).unwrap()
    }

    #[test]
    fn one_channel_of_rho_is_grey() {
        let bytes = written(
            "brdf",
            "rho",
            Dtype::F64,
            vec![2, 1, 1, 1],
            [1.0_f64, 0.5].map(f64::to_le_bytes).as_flattened(),
        );
        let brdf = decode_brdf(&bytes).unwrap();
        assert_eq!((brdf.rho(), brdf.centre()), ([[1.0; 3], [0.5; 3]].as_slice(), Centre::Normal));
    }

    #[test]
    fn faults_name_the_tensor_and_what_was_expected() {
        let zeros = [0_u8; 8 * 64];
        let nan = [0.0, f64::NAN, 0.0].map(f64::to_le_bytes);
        let lighting_faults = [
            (
                written("lighting", "sh", Dtype::F64, vec![3, 3], &zeros[..72]),
                "tensor `sh`: expected the shape [(F+1)^2, 3], found [3, 3]",
            ),
            (
                written("lighting", "sh", Dtype::F64, vec![4, 4], &zeros[..128]),
                "tensor `sh`: expected the shape [(F+1)^2, 3], found [4, 4]",
            ),
            (
                written("lighting", "sh", Dtype::F64, vec![0, 3], &[]),
                "tensor `sh`: expected the shape [(F+1)^2, 3], found [0, 3]",
            ),
            (
                written("lighting", "sh", Dtype::F32, vec![1, 3], &zeros[..12]),
                "tensor `sh`: expected F64, found F32",
            ),
            (
                written("lighting", "SH", Dtype::F64, vec![1, 3], &zeros[..24]),
                "expected a tensor `sh` [(F+1)^2, 3] F64, found the tensors: SH",
            ),
            (
                written("brdf", "sh", Dtype::F64, vec![1, 3], &zeros[..24]),
                "expected a file of kind `lighting`, found kind `brdf`",
            ),
            (
                written("lighting", "sh", Dtype::F64, vec![1, 3], nan.as_flattened()),
                "tensor `sh`: expected finite values; row 0, channel 1 is not",
            ),
        ];
        for (bytes, message) in lighting_faults {
            assert_eq!(decode_lighting(&bytes).unwrap_err().to_string(), message);
        }
        let ones = [1.0_f64; 12].map(f64::to_le_bytes);
        let upper = written("brdf", "rho", Dtype::F64, vec![1, 2, 2, 3], ones.as_flattened());
        assert_eq!(
            decode_brdf(&upper).unwrap_err().to_string(),
            "tensor `rho`: expected 0 where q > min(l, p), found [1.0, 1.0, 1.0] at [0, 0, 1]"
        );
        assert_eq!(decode_lighting(&[]).unwrap_err().kind(), ErrorKind::Empty);
        let empty = written("environment", "radiance", Dtype::F32, vec![0, 4, 3], &[]);
        assert!(decode_environment(&empty).unwrap_err().to_string().contains("none of them 0"));
        assert_eq!(
            encode_reflection(&lighting(2), &material(), None).unwrap_err().kind(),
            ErrorKind::Unwritable
        );
    }
}
