//! Compact maps: the scale space of an environment, and the taps of a material.

use ::taps::{
    Fitted, LightPoints, NORMAL_KERNELS, NormalTap, ROWS, ScaleSpace, Tap, TapRow, TapTable, Widths,
};
use brdf::Material;
use envmap::CubeMap;
use safetensors::tensor::Dtype;
use sphere::Cube;

use super::file::{TensorFile, Writer, check_finite, colours, wrong_shape};
use super::material;
use crate::error::{Error, ErrorKind};

/// The numbers of a look-up between levels, and of one about the normal.
const TAP: usize = 5;
const NORMAL: usize = 4;

const TAPS_SHAPE: &str = "[65, J, 5]";
const NORMALS_SHAPE: &str = "[65, K, 4]";
const CUBE_SHAPE: &str = "[6, edge, edge, 3]";

/// The light of an environment for compact maps, and the environment as points.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentScales {
    /// The scale space.
    pub space: ScaleSpace,
    /// What errors are measured against.
    pub points: LightPoints,
}

/// The taps of a material.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialTaps {
    /// The material.
    pub material: Material,
    /// The taps and how well they fit.
    pub fitted: Fitted,
    /// Fits of other numbers of taps, which may be better under an environment.
    pub others: Vec<Fitted>,
}

/// A scale space: `level_00` [6, edge, edge, 3] f32, `level_01` ..., faces in file order; the light about
/// normals `normal_0` ... in the same shape; `std` \[levels\] f64, the standard deviation of each level in
/// radians; `diffuse` [9, 3] f64, the radiance of a white diffuse surface by its normal; `lights` [n, 7] f64
/// if there are some beside it; and `points` [p, 6] f32, the direction and the flux of each point of the
/// environment.
///
/// # Errors
/// If a number is not finite.
pub fn encode_scale_space(scales: &EnvironmentScales, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("scale-space", recipe);
    add_scale_space(&scales.space, &mut file)?;
    let points: Vec<f32> =
        scales.points.points().iter().flat_map(|(direction, flux)| [*direction, *flux]).flatten().collect();
    file.extend_f32(&points);
    file.tensor("points", "F32", &[points.len() / 6, 6]);
    Ok(file.finish())
}

fn add_scale_space(space: &ScaleSpace, file: &mut Writer) -> Result<(), Error> {
    let widths = space.widths();
    file.coefficients("diffuse", space.diffuse().coefficients(), &[9, 3])?;
    file.lights(space.lights())?;
    let stds: Vec<u8> = (0..widths.len()).flat_map(|k| widths.std(k).to_le_bytes()).collect();
    file.data.extend(stds);
    file.tensor("std", "F64", &[widths.len()]);
    let levels = space.levels().iter().enumerate().map(|(k, map)| (format!("level_{k:02}"), map));
    let normals = space.normals().iter().enumerate().map(|(k, map)| (format!("normal_{k}"), map));
    for (name, map) in levels.chain(normals) {
        let values = map.pixels().as_flattened();
        check_finite(&name, values, ErrorKind::Unwritable)?;
        file.extend_f32(values);
        file.tensor(name, "F32", &[6, map.cube().edge, map.cube().edge, 3]);
    }
    Ok(())
}

/// A scale space, from a file of kind `scale-space`.
///
/// # Errors
/// The errors of [`super::decode_lighting`].
pub fn decode_scale_space(bytes: &[u8]) -> Result<EnvironmentScales, Error> {
    const POINTS: &str = "[points, 6]";
    let file = TensorFile::open_as(bytes, "scale-space")?;
    let cube = |name: String| {
        let tensor = file.tensor(&name, Dtype::F32, CUBE_SHAPE)?;
        let pixels = colours(&tensor);
        check_finite(&name, pixels.as_flattened(), ErrorKind::Damaged)?;
        let wrong = || wrong_shape(&name, CUBE_SHAPE, tensor.shape());
        let &[6, edge, width, 3] = tensor.shape() else { return Err(wrong()) };
        CubeMap::new(Cube { edge }, pixels).filter(|_| edge == width).ok_or_else(wrong)
    };
    let first = cube("level_00".into())?;
    let edge = first.cube().edge;
    let widths = Widths::new(edge).ok_or_else(|| {
        let [least, most] = Widths::EDGES;
        Error::damaged(format!(
            "tensor `level_00`: expected an edge of a power of two from {least} to {most}, found {edge}"
        ))
    })?;
    let levels = (0..widths.len()).map(|k| cube(format!("level_{k:02}"))).collect::<Result<_, _>>()?;
    let normals = (0..NORMAL_KERNELS).map(|k| cube(format!("normal_{k}"))).collect::<Result<_, _>>()?;
    let space = ScaleSpace::from_parts(widths, levels, normals, file.series("diffuse")?, file.lights()?)
        .ok_or_else(|| Error::damaged("the levels have not the edges of a scale space"))?;
    let tensor = file.tensor("points", Dtype::F32, POINTS)?;
    let &[_, 6] = tensor.shape() else { return Err(wrong_shape("points", POINTS, tensor.shape())) };
    let rows = colours(&tensor);
    let points = rows.as_chunks::<2>().0.iter().map(|[direction, flux]| (*direction, *flux)).collect();
    let points = LightPoints::from_points(points).ok_or_else(|| {
        Error::damaged("tensor `points`: expected finite numbers and directions of length 1")
    })?;
    Ok(EnvironmentScales { space, points })
}

/// The taps of a material: `taps` [65, J, 5] f64, delta, s, r, g, b of each look-up between levels, and
/// `normals` [65, K, 4] f64, y, r, g, b of each about the normal; row i is for 1 - cos(theta_v) = i / 64. The
/// metadata have the material and `rms`, the residual of the fit in stops. Fits of other numbers of taps
/// have the same names with `others_0_`, `others_1_` ... before them.
///
/// # Errors
/// If a number is not finite, or the material is an empty sum.
pub fn encode_taps(taps: &MaterialTaps, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("taps", recipe);
    for (prefix, fitted) in prefixes().zip([&taps.fitted].into_iter().chain(&taps.others)) {
        add_taps(&fitted.table, &prefix, &mut file)?;
        file.entry(format!("{prefix}rms"), format!("{}", fitted.rms));
    }
    material::add(&taps.material, &mut file)?;
    Ok(file.finish())
}

/// What the names of each fit begin with.
fn prefixes() -> impl Iterator<Item = String> {
    std::iter::once(String::new()).chain((0..).map(|index| format!("others_{index}_")))
}

fn add_taps(table: &TapTable, prefix: &str, file: &mut Writer) -> Result<(), Error> {
    let rows = table.rows();
    let taps = rows.iter().flat_map(|row| &row.taps);
    let taps: Vec<f64> =
        taps.flat_map(|Tap { delta, std, weight: [r, g, b] }| [*delta, *std, *r, *g, *b]).collect();
    let normals = rows.iter().flat_map(|row| &row.normals);
    let normals: Vec<f64> = normals.flat_map(|NormalTap { y, weight: [r, g, b] }| [*y, *r, *g, *b]).collect();
    for (name, values, count, numbers) in
        [("taps", taps, table.taps(), TAP), ("normals", normals, table.normals(), NORMAL)]
    {
        let name = format!("{prefix}{name}");
        check_finite(&name, &values, ErrorKind::Unwritable)?;
        file.data.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        file.tensor(name, "F64", &[ROWS, count, numbers]);
    }
    Ok(())
}

/// The taps of a material, from a file of kind `taps`.
///
/// # Errors
/// The errors of [`super::decode_lighting`].
pub fn decode_taps(bytes: &[u8]) -> Result<MaterialTaps, Error> {
    let file = TensorFile::open_as(bytes, "taps")?;
    let (material, _) = material::of(&file)?.ok_or_else(|| Error::damaged("metadata `material`: missing"))?;
    let fitted = fitted(&file, "")?;
    let is_there = |prefix: &String| file.metadata.contains_key(&format!("{prefix}rms"));
    let others = prefixes().skip(1).take_while(is_there).map(|prefix| self::fitted(&file, &prefix));
    Ok(MaterialTaps { material, fitted, others: others.collect::<Result<_, _>>()? })
}

/// The fit whose names begin so.
fn fitted(file: &TensorFile<'_>, prefix: &str) -> Result<Fitted, Error> {
    let name = format!("{prefix}rms");
    let rms = file.metadata.get(&name).and_then(|text| text.parse::<f64>().ok());
    let rms = rms
        .filter(|rms| rms.is_finite())
        .ok_or_else(|| Error::damaged(format!("metadata `{name}`: expected a number")))?;
    let taps = rows(file, &format!("{prefix}taps"), TAPS_SHAPE, TAP)?;
    let normals = rows(file, &format!("{prefix}normals"), NORMALS_SHAPE, NORMAL)?;
    let row = |(taps, normals): (Vec<f64>, Vec<f64>)| TapRow {
        taps: (taps.as_chunks::<TAP>().0.iter())
            .map(|&[delta, std, r, g, b]| Tap { delta, std, weight: [r, g, b] })
            .collect(),
        normals: (normals.as_chunks::<NORMAL>().0.iter())
            .map(|&[y, r, g, b]| NormalTap { y, weight: [r, g, b] })
            .collect(),
    };
    let table = TapTable::new(taps.into_iter().zip(normals).map(row).collect()).ok_or_else(|| {
        Error::damaged(format!("tensor `{prefix}taps`: expected widths above 0 in 65 rows"))
    })?;
    Ok(Fitted { table, rms })
}

/// The rows of a table of numbers.
fn rows(file: &TensorFile<'_>, name: &str, shape: &str, numbers: usize) -> Result<Vec<Vec<f64>>, Error> {
    let tensor = file.tensor(name, Dtype::F64, shape)?;
    let count = match tensor.shape() {
        &[ROWS, count, found] if found == numbers => count,
        other => return Err(wrong_shape(name, shape, other)),
    };
    let values: Vec<f64> =
        tensor.data().as_chunks::<8>().0.iter().map(|word| f64::from_le_bytes(*word)).collect();
    check_finite(name, &values, ErrorKind::Damaged)?;
    Ok(if count == 0 {
        vec![Vec::new(); ROWS]
    } else {
        values.chunks(count * numbers).map(<[f64]>::to_vec).collect()
    })
}

/// Everything that a renderer needs of an environment and a material, for Python and for tools: the tensors
/// of [`encode_scale_space`] without its points and those of [`encode_taps`], as far as they are given, in
/// f32 and, for lights and `diffuse`, f64.
///
/// # Errors
/// If a number is not finite.
pub fn encode_compact_map(
    space: Option<&ScaleSpace>,
    table: Option<&TapTable>,
    recipe: Option<&str>,
) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("compact-map", recipe);
    if let Some(table) = table {
        add_taps(table, "", &mut file)?;
    }
    if let Some(space) = space {
        add_scale_space(space, &mut file)?;
    }
    Ok(file.finish())
}

#[cfg(test)]
mod tests {
    use brdf::{Fresnel, Ggx, Lambert};
    use sh::{Light, Stop};
    use sphere::{Direction, LatLong};

    use super::*;

    fn scales() -> EnvironmentScales {
        let grid = LatLong::with_rows(16);
        let pixels = (0..grid.len()).map(|k| [1.0, 0.5, k as f32 / 300.0]).collect();
        let environment = envmap::Environment::new(grid, pixels).unwrap();
        let light = Light { direction: Direction::Z, radius: 0.1, irradiance: [0.01; 3] };
        let widths = Widths::new(8).unwrap();
        let space = ScaleSpace::new(&environment, &[light], widths, Stop::NEVER).unwrap();
        EnvironmentScales { space, points: LightPoints::new(&environment).unwrap() }
    }

    fn material_taps(material: Material) -> MaterialTaps {
        let fit = |taps| ::taps::fit(&material, taps, Widths::new(8).unwrap(), Stop::NEVER).unwrap();
        MaterialTaps { fitted: fit(2), others: vec![fit(0), fit(1)], material }
    }

    #[test]
    fn a_scale_space_comes_back_bit_for_bit() {
        let bytes = encode_scale_space(&scales(), Some("{}")).unwrap();
        assert_eq!(decode_scale_space(&bytes).unwrap(), scales());
        for length in (0..bytes.len()).step_by(97) {
            assert!(decode_scale_space(&bytes[..length]).is_err(), "{length} bytes");
        }
    }

    #[test]
    fn taps_come_back_bit_for_bit() {
        let metal = Ggx::new(0.5, Fresnel::Dielectric(1.5), [1.0; 3]).unwrap();
        for material in [Material::Ggx(metal), Material::Lambert(Lambert::new([0.5; 3]).unwrap())] {
            let taps = material_taps(material);
            let bytes = encode_taps(&taps, None).unwrap();
            assert_eq!(decode_taps(&bytes).unwrap(), taps);
            for length in (0..bytes.len()).step_by(97) {
                assert!(decode_taps(&bytes[..length]).is_err(), "{length} bytes");
            }
        }
    }

    #[test]
    fn what_is_damaged_is_named() {
        let bytes = encode_scale_space(&scales(), None).unwrap();
        let header = String::from_utf8_lossy(&bytes[8..]).find("\"level_03\"").unwrap() + 8;
        let mut renamed = bytes.clone();
        renamed[header + 7] = b'9';
        let error = decode_scale_space(&renamed).unwrap_err().to_string();
        assert!(error.contains("`level_03`"), "{error}");
    }
}
