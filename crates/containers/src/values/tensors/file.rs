//! The file itself: its header, its tensors and their errors.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use brdf::{BrdfCoefficients, Centre};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde_json::json;
use sh::{Degree, Expansion, Light};
use sphere::{DVec3, Direction};

use crate::error::{Error, ErrorKind};
use crate::format::refuse_non_files;
use crate::recipe::KEY;
use crate::values::shrm_metadata::centre_name;

/// The numbers of a light: direction x, y, z, angular radius, irradiance RGB.
const LIGHT: usize = 7;

pub(super) struct Writer {
    pub(super) metadata: BTreeMap<String, String>,
    /// The header's entry of each tensor. The format wants descending alignment; kinds mix no types.
    pub(super) tensors: Vec<(String, serde_json::Value)>,
    pub(super) data: Vec<u8>,
    start: usize,
}

impl Writer {
    pub(super) fn new(kind: &str, recipe: Option<&str>) -> Self {
        let mut metadata = BTreeMap::from([("kind".to_owned(), kind.to_owned())]);
        metadata.extend(recipe.map(|recipe| (KEY.to_owned(), recipe.to_owned())));
        Self { metadata, tensors: Vec::new(), data: Vec::new(), start: 0 }
    }

    /// An entry of the metadata.
    pub(super) fn entry(&mut self, key: impl Into<String>, value: impl Into<String>) {
        self.metadata.insert(key.into(), value.into());
    }

    /// A series. `prefix` goes before the name of its tensor.
    pub(super) fn lighting(&mut self, prefix: &str, lighting: &Expansion) -> Result<(), Error> {
        self.coefficients(&format!("{prefix}sh"), lighting.coefficients(), &[lighting.degree().rows(), 3])
    }

    /// Lights, unless there are none: a row for each.
    pub(super) fn lights(&mut self, lights: &[Light]) -> Result<(), Error> {
        if lights.is_empty() {
            return Ok(());
        }
        let row = |light: &Light| {
            let ([x, y, z], [r, g, b]) = (light.direction.vector().to_array(), light.irradiance);
            [x, y, z, light.radius, r, g, b]
        };
        let values: Vec<f64> = lights.iter().flat_map(row).collect();
        if let Some(first) = values.iter().position(|value| !value.is_finite()) {
            let (row, column) = (first / LIGHT, first % LIGHT);
            return Err(Error::new(
                ErrorKind::Unwritable,
                format!("tensor `lights`: expected finite values; row {row}, column {column} is not"),
            ));
        }
        self.data.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        self.tensor("lights", "F64", &[lights.len(), LIGHT]);
        Ok(())
    }

    /// The coefficients of a BRDF. `prefix` goes before the names of their tensor and their centre.
    pub(super) fn brdf(&mut self, prefix: &str, brdf: &BrdfCoefficients) -> Result<(), Error> {
        let (l, side) = (brdf.f().get() + 1, brdf.p().get() + 1);
        check_triangle(brdf).map_err(|message| Error::new(ErrorKind::Unwritable, message))?;
        self.entry(format!("{prefix}centre"), centre_name(brdf.centre()));
        self.coefficients(&format!("{prefix}rho"), brdf.rho(), &[l, side, side, 3])
    }

    pub(super) fn coefficients(
        &mut self,
        name: &str,
        rows: &[[f64; 3]],
        shape: &[usize],
    ) -> Result<(), Error> {
        let values = rows.as_flattened();
        check_finite(name, values, ErrorKind::Unwritable)?;
        self.data.reserve(size_of_val(values));
        self.data.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        self.tensor(name, "F64", shape);
        Ok(())
    }

    pub(super) fn extend_f32(&mut self, values: &[f32]) {
        self.data.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    /// Names the data added since the last tensor.
    pub(super) fn tensor(&mut self, name: impl Into<String>, dtype: &str, shape: &[usize]) {
        let offsets = [self.start, self.data.len()];
        self.start = self.data.len();
        self.tensors.push((name.into(), json!({ "dtype": dtype, "shape": shape, "data_offsets": offsets })));
    }

    /// Names the data of a file that has only one tensor, whose data [`Writer::finish_with`] gets.
    pub(super) fn tensor_of_bytes(&mut self, name: &str, length: usize) {
        let entry = json!({ "dtype": "U8", "shape": [length], "data_offsets": [0, length] });
        self.tensors.push((name.into(), entry));
    }

    /// The file.
    pub(super) fn finish(self) -> Vec<u8> {
        let header = self.header();
        // The data move, which takes less time than a copy in memory that is new.
        let mut bytes = self.data;
        bytes.reserve_exact(header.len());
        bytes.splice(0..0, header);
        bytes
    }

    /// The file with these data, one after the other.
    pub(super) fn finish_with<'b>(self, data: impl Iterator<Item = &'b [u8]> + Clone) -> Vec<u8> {
        let mut bytes = self.header();
        bytes.reserve_exact(data.clone().map(<[u8]>::len).sum());
        data.for_each(|data| bytes.extend_from_slice(data));
        bytes
    }

    /// What precedes the data.
    fn header(&self) -> Vec<u8> {
        let mut header = format!("{{\"__metadata__\":{}", json!(self.metadata));
        for (name, entry) in &self.tensors {
            header.push_str(&format!(",\"{name}\":{entry}"));
        }
        header.push('}');
        // Spaces fill up to 8 bytes, so that the data are aligned.
        let padded = header.len().next_multiple_of(8);
        header.extend(std::iter::repeat_n(' ', padded - header.len()));
        [&(padded as u64).to_le_bytes(), header.as_bytes()].concat()
    }
}

pub(super) struct TensorFile<'a> {
    pub(super) tensors: SafeTensors<'a>,
    pub(super) metadata: BTreeMap<String, String>,
}

impl<'a> TensorFile<'a> {
    pub(super) fn open(bytes: &'a [u8]) -> Result<Self, Error> {
        refuse_non_files(bytes)?;
        let describe = |error: safetensors::SafeTensorError| {
            use safetensors::SafeTensorError as Damage;
            match error {
                Damage::HeaderTooSmall | Damage::InvalidHeaderLength | Damage::MetadataIncompleteBuffer => {
                    Error::truncated(format!("the file is truncated or not a safetensors file ({error})"))
                }
                other => Error::damaged(format!("not a valid safetensors file: {other}")),
            }
        };
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(describe)?;
        let tensors = SafeTensors::deserialize(bytes).map_err(describe)?;
        let metadata = header.metadata().clone().unwrap_or_default().into_iter().collect();
        Ok(Self { tensors, metadata })
    }

    pub(super) fn open_as(bytes: &'a [u8], kind: &str) -> Result<Self, Error> {
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

    pub(super) fn tensor(&self, name: &str, dtype: Dtype, shape: &str) -> Result<TensorView<'a>, Error> {
        let tensor = self.tensors.tensor(name).map_err(|_| {
            let found = match self.tensors.names().join(", ") {
                names if names.is_empty() => "no tensors".to_owned(),
                names => format!("the tensors: {names}"),
            };
            Error::damaged(format!("expected a tensor `{name}` {shape} {dtype}, found {found}"))
        })?;
        if tensor.dtype() != dtype {
            return Err(Error::damaged(format!(
                "tensor `{name}`: expected {dtype}, found {}",
                tensor.dtype()
            )));
        }
        Ok(tensor)
    }

    /// Whether degrees are, or are to be, chosen for the light.
    pub(super) fn is_for_light(&self) -> bool {
        self.metadata.get(super::DEGREES).is_some_and(|degrees| degrees == super::FOR_LIGHT)
    }

    pub(super) fn lighting(&self, prefix: &str) -> Result<Expansion, Error> {
        self.series(&format!("{prefix}sh"))
    }

    /// The series that a tensor holds.
    pub(super) fn series(&self, name: &str) -> Result<Expansion, Error> {
        const SHAPE: &str = "[(F+1)^2, 3]";
        let tensor = self.tensor(name, Dtype::F64, SHAPE)?;
        let &[rows, 3] = tensor.shape() else { return Err(wrong_shape(name, SHAPE, tensor.shape())) };
        let side = rows.isqrt();
        if side == 0 || side * side != rows {
            return Err(wrong_shape(name, SHAPE, tensor.shape()));
        }
        let degree = degree(name, side - 1)?;
        Expansion::from_coefficients(degree, coefficients(name, &tensor)?)
            .ok_or_else(|| wrong_shape(name, SHAPE, tensor.shape()))
    }

    /// The lights; none if there is no such tensor.
    pub(super) fn lights(&self) -> Result<Vec<Light>, Error> {
        const NAME: &str = "lights";
        const SHAPE: &str = "[lights, 7]";
        if !self.has(NAME) {
            return Ok(Vec::new());
        }
        let tensor = self.tensor(NAME, Dtype::F64, SHAPE)?;
        let &[_, LIGHT] = tensor.shape() else { return Err(wrong_shape(NAME, SHAPE, tensor.shape())) };
        let (words, _) = tensor.data().as_chunks::<8>();
        let values: Vec<f64> = words.iter().map(|word| f64::from_le_bytes(*word)).collect();
        let light = |(index, row): (usize, &[f64])| {
            let vector = DVec3::new(row[0], row[1], row[2]);
            // Normalised again, a direction could change in its last bit.
            let direction = match (vector.length_squared() - 1.0).abs() < 1e-12 {
                true => Some(Direction::from_unit(vector)),
                false => Direction::new(vector),
            };
            let irradiance = [row[4], row[5], row[6]];
            let sound =
                (0.0..=FRAC_PI_2).contains(&row[3]) && irradiance.iter().all(|value| value.is_finite());
            match direction {
                Some(direction) if sound => Ok(Light { direction, radius: row[3], irradiance }),
                _ => Err(Error::damaged(format!(
                    "tensor `lights`: expected a direction, a radius from 0 to pi / 2 and a finite irradiance; row \
                     {index} is {row:?}"
                ))),
            }
        };
        values.chunks_exact(LIGHT).enumerate().map(light).collect()
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.tensors.names().contains(&name)
    }

    pub(super) fn centre(&self, prefix: &str) -> Result<Centre, Error> {
        let centres = [Centre::Reflection, Centre::Normal, Centre::Tangent];
        self.choice(&format!("{prefix}centre"), centres.map(|centre| (centre_name(centre), centre)))
    }

    /// The value of a metadata entry that is one of these words.
    pub(super) fn choice<T: Copy, const N: usize>(
        &self,
        key: &str,
        words: [(&str, T); N],
    ) -> Result<T, Error> {
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

    pub(super) fn brdf(&self, prefix: &str) -> Result<BrdfCoefficients, Error> {
        let name = &*format!("{prefix}rho");
        const SHAPE: &str = "[F+1, P+1, P+1, 1 or 3]";
        let centre = self.centre(prefix)?;
        let tensor = self.tensor(name, Dtype::F64, SHAPE)?;
        let (l, p) = match *tensor.shape() {
            [l, p, q, 1 | 3] if l > 0 && p > 0 && p == q => (l, p),
            _ => return Err(wrong_shape(name, SHAPE, tensor.shape())),
        };
        let brdf = BrdfCoefficients::new(
            centre,
            degree(name, l - 1)?,
            degree(name, p - 1)?,
            coefficients(name, &tensor)?,
        )
        .ok_or_else(|| wrong_shape(name, SHAPE, tensor.shape()))?;
        check_triangle(&brdf).map_err(Error::damaged)?;
        Ok(brdf)
    }
}

/// The finite f64 of a tensor whose last axis is colour; one channel is grey.
pub(super) fn coefficients(name: &str, tensor: &TensorView<'_>) -> Result<Vec<[f64; 3]>, Error> {
    let (words, _) = tensor.data().as_chunks::<8>();
    let values: Vec<f64> = words.iter().map(|word| f64::from_le_bytes(*word)).collect();
    check_finite(name, &values, ErrorKind::Damaged)?;
    Ok(match tensor.shape().last() {
        Some(1) => values.into_iter().map(|grey| [grey; 3]).collect(),
        _ => values.chunks_exact(3).map(|rgb| [rgb[0], rgb[1], rgb[2]]).collect(),
    })
}

/// The f32 of a tensor whose last axis has three channels.
pub(super) fn colours(tensor: &TensorView<'_>) -> Vec<[f32; 3]> {
    let (words, _) = tensor.data().as_chunks::<4>();
    let (rows, _) = words.as_chunks::<3>();
    rows.iter().map(|row| row.map(f32::from_le_bytes)).collect()
}

pub(super) fn check_triangle(brdf: &BrdfCoefficients) -> Result<(), String> {
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

pub(super) fn degree(name: &str, l: usize) -> Result<Degree, Error> {
    Degree::new(l).map_err(|error| Error::new(ErrorKind::TooLarge, format!("tensor `{name}`: {error}")))
}

pub(super) fn wrong_shape(name: &str, expected: &str, found: &[usize]) -> Error {
    Error::damaged(format!("tensor `{name}`: expected the shape {expected}, found {found:?}"))
}

/// An error if a value of a tensor whose last axis is colour is not finite.
pub(super) fn check_finite<T: Copy + Into<f64>>(
    name: &str,
    values: &[T],
    kind: ErrorKind,
) -> Result<(), Error> {
    let Some(first) = values.iter().position(|&value| !value.into().is_finite()) else { return Ok(()) };
    let (row, channel) = (first / 3, first % 3);
    Err(Error::new(
        kind,
        format!("tensor `{name}`: expected finite values; row {row}, channel {channel} is not"),
    ))
}
