//! A prefiltered cube.

use envmap::CubeMap;
use safetensors::tensor::Dtype;
use serde::{Deserialize, Serialize};
use shrm::{Distribution, LevelMethod, Prefiltered, PrefilteredLevel};
use sphere::Cube;

use super::file::{TensorFile, Writer, check_finite, colours, wrong_shape};
use crate::error::{Error, ErrorKind};

/// The entries of the metadata.
const DISTRIBUTION: &str = "distribution";
const LEVELS: &str = "levels";

const DISTRIBUTIONS: [(&str, Distribution); 3] =
    [("ggx", Distribution::Ggx), ("charlie", Distribution::Charlie), ("lambert", Distribution::Lambert)];

/// The entry of the metadata for a level.
#[derive(Serialize, Deserialize)]
#[serde(expecting = "struct Entry")] // the name in messages
struct LevelEntry {
    roughness: f64,
    method: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    degree: Option<usize>,
    negative: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<f64>,
}

/// A prefiltered cube: `sh` [(F+1)^2, 3] f64, the coefficients of the light, and `level0` [6, edge, edge, 3]
/// f32, `level1` ..., faces in file order. The metadata have `distribution` and, as JSON, the roughness and
/// the method of each of the `levels`.
///
/// # Errors
/// If a number is not finite.
pub fn encode_prefiltered(prefiltered: &Prefiltered, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("prefiltered", recipe);
    let name = DISTRIBUTIONS.iter().find(|(_, known)| *known == prefiltered.distribution);
    file.entry(DISTRIBUTION, name.map_or("ggx", |(name, _)| name));
    let entry = |level: &PrefilteredLevel| {
        let (method, degree) = match level.method {
            LevelMethod::Resampled => ("resampled", None),
            LevelMethod::Series { degree } => ("sh", Some(degree)),
            LevelMethod::Quadrature => ("quadrature", None),
        };
        LevelEntry {
            roughness: level.roughness,
            method: method.into(),
            degree,
            negative: level.negative,
            error: level.error,
        }
    };
    let entries: Vec<_> = prefiltered.levels.iter().map(entry).collect();
    let text = serde_json::to_string(&entries)
        .map_err(|error| Error::new(ErrorKind::Unwritable, format!("levels: {error}")))?;
    file.entry(LEVELS, text);
    file.lighting("", &prefiltered.series)?;
    for (l, level) in prefiltered.levels.iter().enumerate() {
        let (name, edge) = (format!("level{l}"), level.map.cube().edge);
        let values = level.map.pixels().as_flattened();
        check_finite(&name, values, ErrorKind::Unwritable)?;
        file.extend_f32(values);
        file.tensor(name, "F32", &[6, edge, edge, 3]);
    }
    Ok(file.finish())
}

/// A prefiltered cube, from a file of kind `prefiltered`.
///
/// # Errors
/// The errors of [`super::decode_lighting`].
pub fn decode_prefiltered(bytes: &[u8]) -> Result<Prefiltered, Error> {
    const SHAPE: &str = "[6, edge, edge, 3]";
    let file = TensorFile::open_as(bytes, "prefiltered")?;
    let distribution = file.choice(DISTRIBUTION, DISTRIBUTIONS)?;
    let text = file.metadata.get(LEVELS).map_or("", String::as_str);
    let entries: Vec<LevelEntry> = serde_json::from_str(text)
        .map_err(|error| Error::damaged(format!("`{LEVELS}` of the metadata: {error}")))?;
    let level = |(l, entry): (usize, LevelEntry)| {
        let name = format!("level{l}");
        let tensor = file.tensor(&name, Dtype::F32, SHAPE)?;
        let pixels = colours(&tensor);
        check_finite(&name, pixels.as_flattened(), ErrorKind::Damaged)?;
        let wrong = || wrong_shape(&name, SHAPE, tensor.shape());
        let &[6, edge, width, 3] = tensor.shape() else { return Err(wrong()) };
        let map = CubeMap::new(Cube { edge }, pixels).filter(|_| edge == width).ok_or_else(wrong)?;
        let method = match (entry.method.as_str(), entry.degree) {
            ("resampled", None) => LevelMethod::Resampled,
            ("sh", Some(degree)) => LevelMethod::Series { degree },
            ("quadrature", None) => LevelMethod::Quadrature,
            (other, ..) => return Err(Error::damaged(format!("level {l} has the unknown method {other:?}"))),
        };
        let LevelEntry { roughness, negative, error, .. } = entry;
        Ok(PrefilteredLevel { roughness, map, method, negative, error })
    };
    let levels = entries.into_iter().enumerate().map(level).collect::<Result<_, _>>()?;
    Ok(Prefiltered { distribution, levels, series: file.lighting("")? })
}

#[cfg(test)]
mod tests {
    use sh::{Degree, Expansion};

    use super::*;

    fn small() -> Prefiltered {
        let level = |edge: usize, roughness: f64, method| PrefilteredLevel {
            roughness,
            map: CubeMap::new(Cube { edge }, (0..6 * edge * edge).map(|i| [i as f32, 0.5, 0.0]).collect())
                .unwrap(),
            method,
            negative: edge,
            error: (roughness > 0.0).then_some(0.1 + 0.2),
        };
        let levels = vec![
            level(4, 0.0, LevelMethod::Resampled),
            level(2, 1.0 / 3.0, LevelMethod::Quadrature),
            level(1, 1.0, LevelMethod::Series { degree: 74 }),
        ];
        let series = Expansion::from_coefficients(Degree::new(1).unwrap(), vec![[1.0, 2.0, 3.0]; 4]).unwrap();
        Prefiltered { distribution: Distribution::Charlie, levels, series }
    }

    #[test]
    fn a_cube_comes_back_bit_for_bit() {
        let bytes = encode_prefiltered(&small(), Some("{}")).unwrap();
        assert_eq!(decode_prefiltered(&bytes).unwrap(), small());
        assert_eq!(crate::read_recipe::read_recipe(&bytes).as_deref(), Some("{}"));
    }

    #[test]
    fn a_level_that_is_missing_or_not_finite_is_named() {
        let bytes = encode_prefiltered(&small(), None).unwrap();
        let text = String::from_utf8_lossy(&bytes[8..]).find("\"level1\"").unwrap() + 8;
        let mut renamed = bytes.clone();
        renamed[text + 6] = b'7';
        let error = decode_prefiltered(&renamed).unwrap_err().to_string();
        assert!(error.contains("`level1`"), "{error}");
        let mut cube = small();
        cube.levels[2].map = CubeMap::new(Cube { edge: 1 }, vec![[f32::NAN; 3]; 6]).unwrap();
        let error = encode_prefiltered(&cube, None).unwrap_err().to_string();
        assert!(error.contains("level2"), "{error}");
        for length in 0..bytes.len() {
            assert!(decode_prefiltered(&bytes[..length]).is_err(), "{length} bytes");
        }
    }
}
