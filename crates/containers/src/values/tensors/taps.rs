//! Compact maps: the scale space of an environment, and the taps of a material.

use ::taps::{
    AnyTable, FacetNode, FacetTable, FacetTap, Fitted, FittedFacets, FittedVaried, LightPoints,
    NORMAL_KERNELS, NormalTap, ROWS, ScaleSpace, Tap, TapRow, TapTable, VariedTable, Weights, Widths,
};
use brdf::Material;
use envmap::CubeMap;
use safetensors::tensor::Dtype;
use sphere::Cube;

use super::file::{TensorFile, Writer, check_finite, colours, wrong_shape};
use super::material;
use crate::error::{Error, ErrorKind};

/// The numbers of a look-up between levels, of one about the normal, and of one by a facet.
const TAP: usize = 5;
const NORMAL: usize = 4;
const FACET: usize = 6;

const TAPS_SHAPE: &str = "[65, J, 5]";
const NORMALS_SHAPE: &str = "[65, K, 4]";
const FACETS_SHAPE: &str = "[25 or 49, the same, J, 6]";
const FACET_NORMALS_SHAPE: &str = "[25 or 49, the same, K, 4]";
const VARIED_TAPS_SHAPE: &str = "[rows, 65, J, 5]";
const VARIED_NORMALS_SHAPE: &str = "[rows, 65, K, 4]";
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
    /// The taps over one of the material's parameters, if they were asked for.
    pub varied: Option<VariedTaps>,
    /// Fits that know the direction of the tangent, with more taps from one to the next, if the material
    /// depends on it; `fitted` and `others` are those of its mean over all turns.
    pub facets: Vec<FittedFacets>,
}

impl MaterialTaps {
    /// The taps for a renderer that has the tangents of surfaces and no choice among several: those that know
    /// the tangent, as many as were fitted, if the material depends on it.
    pub fn table(&self) -> AnyTable<'_> {
        self.facets.last().map_or(AnyTable::Angle(&self.fitted.table), |fit| AnyTable::View(&fit.table))
    }
}

/// The taps of a material over one of its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct VariedTaps {
    /// The name of the parameter.
    pub parameter: String,
    /// The taps and how well they fit.
    pub fitted: FittedVaried,
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
/// metadata have the material and `rms`, the residual of the fit in stops. Fits of other numbers of taps have
/// the same names with `others_0_`, `others_1_` ... before them. Taps over a parameter are Facet taps have
/// `facets_0_`, `facets_1_` ... before the names; they are `taps` [n, n, J, 6], p, q, s, r, g, b of each, and
/// `normals` [n, n, K, 4], by the place in the disc of views, n being 25 for a quarter of it and 49 for all
/// of it ([`FacetTable`]). Taps over a parameter are `varied_taps` [rows, 65, J, 5] and `varied_normals`
/// [rows, 65, K, 4], with the parameter's name, its first and last value and the residuals in the metadata.
///
/// # Errors
/// If a number is not finite, or the material is an empty sum.
pub fn encode_taps(taps: &MaterialTaps, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("taps", recipe);
    for (prefix, fitted) in prefixes().zip([&taps.fitted].into_iter().chain(&taps.others)) {
        add_taps(&fitted.table, &prefix, &mut file)?;
        file.entry(format!("{prefix}rms"), format!("{}", fitted.rms));
    }
    for (index, fitted) in taps.facets.iter().enumerate() {
        let prefix = facet_prefix(index);
        add_facets(&fitted.table, &prefix, &mut file)?;
        file.entry(format!("{prefix}rms"), format!("{}", fitted.rms));
    }
    if let Some(VariedTaps { parameter, fitted }) = &taps.varied {
        add_varied(&fitted.table, VARIED, &mut file)?;
        let texts = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        file.entry("varied", parameter.clone());
        file.entry("varied_range", texts(&fitted.table.range()));
        file.entry("varied_rms", texts(&fitted.rms));
    }
    material::add(&taps.material, &mut file)?;
    Ok(file.finish())
}

/// What the names of each fit of facet taps begin with.
fn facet_prefix(index: usize) -> String {
    format!("facets_{index}_")
}

fn add_facets(table: &FacetTable, prefix: &str, file: &mut Writer) -> Result<(), Error> {
    let nodes = table.nodes();
    let taps = nodes.iter().flat_map(|node| &node.taps);
    let taps: Vec<f64> = taps
        .flat_map(|FacetTap { slope: [p, q], std, weight: [r, g, b] }| [*p, *q, *std, *r, *g, *b])
        .collect();
    let normals = nodes.iter().flat_map(|node| &node.normals);
    let normals: Vec<f64> = normals.flat_map(normal_numbers).collect();
    let side = table.side();
    for (name, values, shape) in [
        ("taps", taps, [side, side, table.taps(), FACET]),
        ("normals", normals, [side, side, table.normals(), NORMAL]),
    ] {
        add_numbers(&format!("{prefix}{name}"), &values, &shape, file)?;
    }
    Ok(())
}

/// A tensor of finite numbers.
fn add_numbers(name: &str, values: &[f64], shape: &[usize], file: &mut Writer) -> Result<(), Error> {
    check_finite(name, values, ErrorKind::Unwritable)?;
    file.data.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    file.tensor(name, "F64", shape);
    Ok(())
}

fn normal_numbers(NormalTap { y, weight: [r, g, b] }: &NormalTap) -> [f64; NORMAL] {
    [*y, *r, *g, *b]
}

/// What the names of taps over a parameter begin with.
const VARIED: &str = "varied_";

/// What the names of each fit begin with.
fn prefixes() -> impl Iterator<Item = String> {
    std::iter::once(String::new()).chain((0..).map(|index| format!("others_{index}_")))
}

fn add_taps(table: &TapTable, prefix: &str, file: &mut Writer) -> Result<(), Error> {
    add_tables(std::slice::from_ref(table), &[ROWS], prefix, file)
}

fn add_varied(varied: &VariedTable, prefix: &str, file: &mut Writer) -> Result<(), Error> {
    add_tables(varied.tables(), &[varied.tables().len(), ROWS], prefix, file)
}

/// Tables with as many taps; `rows` are the first sizes of the shapes.
fn add_tables(tables: &[TapTable], rows: &[usize], prefix: &str, file: &mut Writer) -> Result<(), Error> {
    let all = || tables.iter().flat_map(TapTable::rows);
    let taps = all().flat_map(|row| &row.taps);
    let taps: Vec<f64> =
        taps.flat_map(|Tap { delta, std, weight: [r, g, b] }| [*delta, *std, *r, *g, *b]).collect();
    let normals = all().flat_map(|row| &row.normals);
    let normals: Vec<f64> = normals.flat_map(normal_numbers).collect();
    let counts = tables.first().map_or([0; 2], |table| [table.taps(), table.normals()]);
    for (name, values, count, numbers) in
        [("taps", taps, counts[0], TAP), ("normals", normals, counts[1], NORMAL)]
    {
        add_numbers(&format!("{prefix}{name}"), &values, &[rows, &[count, numbers]].concat(), file)?;
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
    let varied = file.metadata.get("varied").map(|parameter| varied(&file, parameter)).transpose()?;
    let facets = (0..).map(facet_prefix).take_while(is_there).map(|prefix| fitted_facets(&file, &prefix));
    Ok(MaterialTaps {
        others: others.collect::<Result<_, _>>()?,
        facets: facets.collect::<Result<_, _>>()?,
        material,
        fitted,
        varied,
    })
}

/// The fit whose names begin so.
fn fitted(file: &TensorFile<'_>, prefix: &str) -> Result<Fitted, Error> {
    let rms = residual(file, prefix)?;
    let taps = rows(file, &format!("{prefix}taps"), TAPS_SHAPE, &[ROWS], TAP)?;
    let normals = rows(file, &format!("{prefix}normals"), NORMALS_SHAPE, &[ROWS], NORMAL)?;
    let table = TapTable::new(taps.into_iter().zip(normals).map(row).collect()).ok_or_else(|| {
        Error::damaged(format!("tensor `{prefix}taps`: expected widths above 0 in 65 rows"))
    })?;
    Ok(Fitted { table, rms })
}

/// The residual of the fit whose names begin so.
fn residual(file: &TensorFile<'_>, prefix: &str) -> Result<f64, Error> {
    let name = format!("{prefix}rms");
    let rms = file.metadata.get(&name).and_then(|text| text.parse::<f64>().ok());
    rms.filter(|rms| rms.is_finite())
        .ok_or_else(|| Error::damaged(format!("metadata `{name}`: expected a number")))
}

/// The fit of facet taps whose names begin so.
fn fitted_facets(file: &TensorFile<'_>, prefix: &str) -> Result<FittedFacets, Error> {
    let name = format!("{prefix}taps");
    let side = match file.tensor(&name, Dtype::F64, FACETS_SHAPE)?.shape() {
        &[side @ (FacetTable::QUARTER | FacetTable::WHOLE), ..] => side,
        other => return Err(wrong_shape(&name, FACETS_SHAPE, other)),
    };
    let taps = rows(file, &name, FACETS_SHAPE, &[side, side], FACET)?;
    let normals = rows(file, &format!("{prefix}normals"), FACET_NORMALS_SHAPE, &[side, side], NORMAL)?;
    let tap = |&[p, q, std, r, g, b]: &[f64; FACET]| FacetTap { slope: [p, q], std, weight: [r, g, b] };
    let node = |(taps, normals): (Vec<f64>, Vec<f64>)| FacetNode {
        taps: taps.as_chunks().0.iter().map(tap).collect(),
        normals: normal_taps(&normals),
    };
    let table = FacetTable::new(taps.into_iter().zip(normals).map(node).collect())
        .ok_or_else(|| Error::damaged(format!("tensor `{name}`: expected widths above 0")))?;
    Ok(FittedFacets { table, rms: residual(file, prefix)? })
}

/// Look-ups about the normal.
fn normal_taps(numbers: &[f64]) -> Vec<NormalTap> {
    let tap = |&[y, r, g, b]: &[f64; NORMAL]| NormalTap { y, weight: [r, g, b] };
    numbers.as_chunks().0.iter().map(tap).collect()
}

/// A row of numbers of look-ups between levels, and of one about the normal.
fn row((taps, normals): (Vec<f64>, Vec<f64>)) -> TapRow {
    TapRow {
        taps: (taps.as_chunks::<TAP>().0.iter())
            .map(|&[delta, std, r, g, b]| Tap { delta, std, weight: [r, g, b] })
            .collect(),
        normals: normal_taps(&normals),
    }
}

/// The taps over a parameter of this name.
fn varied(file: &TensorFile<'_>, parameter: &str) -> Result<VariedTaps, Error> {
    let numbers = |name: &str| -> Result<Vec<f64>, Error> {
        let wrong = || Error::damaged(format!("metadata `{name}`: expected finite numbers"));
        let text = file.metadata.get(name).ok_or_else(wrong)?;
        let values: Result<Vec<f64>, _> = text.split(' ').map(str::parse).collect();
        values.ok().filter(|values| values.iter().all(|value| value.is_finite())).ok_or_else(wrong)
    };
    let (range, rms) = (numbers("varied_range")?, numbers("varied_rms")?);
    let sizes = [rms.len(), ROWS];
    let taps = rows(file, "varied_taps", VARIED_TAPS_SHAPE, &sizes, TAP)?;
    let normals = rows(file, "varied_normals", VARIED_NORMALS_SHAPE, &sizes, NORMAL)?;
    let all: Vec<TapRow> = taps.into_iter().zip(normals).map(row).collect();
    let tables = all.chunks(ROWS).map(|rows| TapTable::new(rows.to_vec())).collect::<Option<Vec<_>>>();
    let range = <[f64; 2]>::try_from(range).ok();
    let table =
        tables.zip(range).and_then(|(tables, range)| VariedTable::new(range, tables, Weights::Colour));
    let table = table.ok_or_else(|| {
        Error::damaged("tensor `varied_taps`: expected widths above 0 in two tables or more of a range")
    })?;
    Ok(VariedTaps { parameter: parameter.to_owned(), fitted: FittedVaried { table, rms } })
}

/// The rows of a table of numbers, whose shape begins with these sizes.
fn rows(
    file: &TensorFile<'_>,
    name: &str,
    shape: &str,
    sizes: &[usize],
    numbers: usize,
) -> Result<Vec<Vec<f64>>, Error> {
    let tensor = file.tensor(name, Dtype::F64, shape)?;
    let count = match tensor.shape() {
        [first @ .., count, found] if first == sizes && *found == numbers => *count,
        other => return Err(wrong_shape(name, shape, other)),
    };
    let values: Vec<f64> =
        tensor.data().as_chunks::<8>().0.iter().map(|word| f64::from_le_bytes(*word)).collect();
    check_finite(name, &values, ErrorKind::Damaged)?;
    Ok(if count == 0 {
        vec![Vec::new(); sizes.iter().product()]
    } else {
        values.chunks(count * numbers).map(<[f64]>::to_vec).collect()
    })
}

/// A table over a parameter, for Python and for tools: `taps` [rows, 65, J, 5] and `normals` [rows, 65, K, 4]
/// f64 as in [`encode_taps`], and `range`, the first and the last value of the parameter, in the metadata.
///
/// # Errors
/// If a number is not finite.
pub fn encode_varied_table(varied: &VariedTable, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("compact-map", recipe);
    add_varied(varied, "", &mut file)?;
    let [first, last] = varied.range();
    file.entry("range", format!("{first} {last}"));
    Ok(file.finish())
}

/// Everything that a renderer needs of an environment and a material, for Python and for tools: the tensors
/// of [`encode_scale_space`] without its points and those of one fit of [`encode_taps`], as far as they are
/// given, in f32 and, for lights and `diffuse`, f64.
///
/// # Errors
/// If a number is not finite.
pub fn encode_compact_map(
    space: Option<&ScaleSpace>,
    table: Option<AnyTable<'_>>,
    recipe: Option<&str>,
) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("compact-map", recipe);
    match table {
        Some(AnyTable::Angle(table)) => add_taps(table, "", &mut file)?,
        Some(AnyTable::View(table)) => add_facets(table, "", &mut file)?,
        None => {}
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
        let table = VariedTable::new([0.5, 1.0], vec![fit(1).table; 3], Weights::Colour).unwrap();
        let fitted = FittedVaried { table, rms: vec![0.1, 0.2, 0.3] };
        let varied = Some(VariedTaps { parameter: "roughness".into(), fitted });
        MaterialTaps { fitted: fit(2), others: vec![fit(0), fit(1)], varied, facets: facets(), material }
    }

    /// A quarter of the disc of views, and all of it.
    fn facets() -> Vec<FittedFacets> {
        let table = |side: usize, taps: usize| {
            let node = |index: usize| FacetNode {
                taps: vec![
                    FacetTap { slope: [0.1, -0.2], std: 0.1 + index as f64, weight: [1.0, 2.0, 3.0] };
                    taps
                ],
                normals: vec![NormalTap { y: 0.5, weight: [0.5; 3] }],
            };
            FacetTable::new((0..side * side).map(node).collect()).unwrap()
        };
        [(FacetTable::QUARTER, 2), (FacetTable::WHOLE, 1)]
            .map(|(side, taps)| FittedFacets { table: table(side, taps), rms: 0.25 })
            .into()
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
        let metal = Material::Ggx(Ggx::new(0.5, Fresnel::Dielectric(1.5), [1.0; 3]).unwrap());
        let bytes = encode_taps(&material_taps(metal), None).unwrap();
        for (found, put, expected) in [
            ("0.5 1\"", "0.5 0\"", "`varied_taps`: expected widths above 0 in two tables or more of a range"),
            ("0.1 0.2 0.3", "0.1 0.2 nan", "`varied_rms`: expected finite numbers"),
            ("0.1 0.2 0.3", "0.1 0.21234", "`varied_taps`"),
            ("varied_normals", "varied_abnorms", "`varied_normals`"),
            ("facets_1_taps", "facets_1_tips", "`facets_1_taps`"),
            ("facets_0_rms\":\"0.25", "facets_0_rms\":\"0,25", "`facets_0_rms`: expected a number"),
        ] {
            let at = bytes.windows(found.len()).position(|window| window == found.as_bytes()).unwrap();
            let mut damaged = bytes.clone();
            damaged[at..at + put.len()].copy_from_slice(put.as_bytes());
            let error = decode_taps(&damaged).unwrap_err().to_string();
            assert!(error.contains(expected), "{put}: {error}");
        }
    }
}
