//! Probes for everything else: a KTX2 of three dimensions for each volume, and JSON that says what is in it.

use containers::{Precision, Texture, write_ktx2_r8, write_ktx2_rgba};
use engine::Failure;
use probes::Lattice;
use serde::Serialize;
use serde_json::{Value, json};

use super::axes::{Grid, IRRADIANCE, OF_FILES, Rows};
use super::light::{LitVolume, MaybeFiles, ProbeLight, check_halves, check_texture};
use super::packing::{PARTS, packed, stacked};
use crate::json::document;

/// The most volumes that are exported.
pub(crate) const MOST_VOLUMES: usize = 32;

/// The largest texture of three dimensions that graphics devices are known to have.
const MOST_TEXELS: usize = 2048;

/// What the first member of `probes.json` says.
const FORMAT: &str = "specula probes 1";

/// The members of `probes.json`.
#[derive(Serialize)]
struct File {
    format: &'static str,
    frame: &'static str,
    evaluation: &'static str,
    scale: &'static str,
    layout: &'static str,
    volumes: Vec<VolumeEntry>,
}

/// A volume in `probes.json`.
#[derive(Serialize)]
struct VolumeEntry {
    name: String,
    file: String,
    validity: String,
    resolution: [usize; 3],
    lattice: &'static str,
    #[serde(rename = "box")]
    bounds: [[f32; 3]; 2],
    first: [f32; 3],
    spacing: [f32; 3],
}

/// The names of the files of so many volumes at most, in the order of their contents.
pub(crate) fn names() -> Vec<String> {
    let of = |index: usize| [format!("/{}", file_name(index)), format!("/{}", validity_name(index))];
    (0..MOST_VOLUMES).flat_map(of).chain(["/README.txt".into(), "/probes.json".into()]).collect()
}

fn file_name(index: usize) -> String {
    format!("volume-{index}.ktx2")
}

fn validity_name(index: usize) -> String {
    format!("validity-{index}.ktx2")
}

/// The files of some volumes with 16-bit or 32-bit numbers: radiance, or irradiance over pi.
///
/// # Errors
/// If there are points or too many volumes, a texture is larger than those of devices, or a number has no
/// half.
pub(crate) fn files(
    light: &ProbeLight<'_>,
    precision: Precision,
    is_irradiance: bool,
    recipe: &str,
) -> Result<MaybeFiles, Failure> {
    let (mut files, mut volumes) = (Vec::new(), Vec::new());
    for (index, lit) in light.only_volumes("preset = \"ktx2\"", MOST_VOLUMES)?.iter().enumerate() {
        let grid = Grid::of(lit.volume, OF_FILES);
        let [nx, ny, nz] = grid.counts;
        let name = &lit.volume.name;
        check_texture([nx, ny, PARTS * (nz + 2)], MOST_TEXELS, name)?;
        let texels = texels(lit, &grid, is_irradiance);
        if precision == Precision::Half {
            check_halves(texels.as_flattened(), name, "set format = \"float\", or a lower `scale`")?;
        }
        let sizes = Texture { width: nx, height: ny, depth: PARTS * (nz + 2), ..Texture::default() };
        files.push(Some(write_ktx2_rgba(&sizes, &texels, precision, Some(recipe), &[])?.bytes));
        let sizes = Texture { depth: nz, ..sizes };
        let validity: Vec<u8> = grid.probes().map(|probe| if lit.valid[probe] { 255 } else { 0 }).collect();
        files.push(Some(write_ktx2_r8(&sizes, &validity, Some(recipe), &[])?.bytes));
        let (lattice, bounds) = match lit.volume.lattice {
            Lattice::Centres => ("centres", grid.box_of_centres()),
            Lattice::Corners => ("corners", grid.box_of_corners()),
        };
        volumes.push(VolumeEntry {
            name: name.clone(),
            file: file_name(index),
            validity: validity_name(index),
            resolution: grid.counts,
            lattice,
            bounds: bounds.map(|end| end.map(|x| x as f32)),
            first: grid.first.map(|x| x as f32),
            spacing: grid.spacing.map(|x| x as f32),
        });
    }
    files.resize(2 * MOST_VOLUMES, None);
    files.push(Some(include_str!("ktx2.txt").into()));
    let file = File {
        format: FORMAT,
        frame: "right-handed, +Y up, metres: the axes of the glTF file",
        evaluation: if is_irradiance { "irradiance" } else { "radiance" },
        scale: if is_irradiance {
            "irradiance over pi, orthonormal harmonics without Condon-Shortley phase"
        } else {
            "radiance, orthonormal harmonics without Condon-Shortley phase"
        },
        layout: "7 parts along z, each with its first and last slice twice; 9 x RGB, then validity",
        volumes,
    };
    files.push(Some(document(&file, recipe)?));
    Ok(files)
}

/// The JSON Schema of `probes.json`.
pub(crate) fn schema() -> Value {
    let numbers = json!({ "type": "array", "items": { "type": "number" }, "minItems": 3, "maxItems": 3 });
    let described = |schema: &Value, text: &str| {
        let mut schema = schema.clone();
        schema["description"] = text.into();
        schema
    };
    let text = |text: &str| json!({ "type": "string", "description": text });
    let volume = json!({
        "type": "object",
        "properties": {
            "name": text("The name of the box."),
            "file": text("The texture, beside this file."),
            "validity": text("The texture of validity, R8 with a texel for each probe: 255 for one with light of \
                              its own, 0 for one that has that of its neighbours."),
            "resolution": {
                "type": "array",
                "items": { "type": "integer", "minimum": 1, "maximum": MOST_TEXELS },
                "minItems": 3,
                "maxItems": 3,
                "description": "The probes along x, y and z.",
            },
            "lattice": {
                "enum": ["centres", "corners"],
                "description": "Whether probes stand in the middle of the cells that divide the box, or at \
                                their corners.",
            },
            "box": {
                "type": "array",
                "items": numbers,
                "minItems": 2,
                "maxItems": 2,
                "description": "The least and the greatest coordinates, in metres.",
            },
            "first": described(&numbers, "Where the first probe stands, in metres."),
            "spacing": described(&numbers, "The distance between probes along x, y and z, in metres."),
        },
        "required": ["name", "file", "validity", "resolution", "lattice", "box", "first", "spacing"],
        "additionalProperties": false,
    });
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Light probes of Specula",
        "description": "probes.json of `export-probes` with preset = \"ktx2\".",
        "type": "object",
        "properties": {
            "format": { "const": FORMAT, "description": "What the file is, with its version." },
            "frame": text("The axes and the unit of all places."),
            "evaluation": {
                "enum": ["radiance", "irradiance"],
                "description": "Whether the sum over harmonics of a direction is the radiance from there, or the \
                                irradiance over pi of a surface that faces there.",
            },
            "scale": text("What the coefficients are."),
            "layout": text("Where they are in the texture."),
            "volumes": { "type": "array", "items": volume, "maxItems": MOST_VOLUMES },
            "specula": { "type": "object", "description": "The recipe: how the file was made." },
        },
        "required": ["format", "frame", "evaluation", "scale", "layout", "volumes"],
        "additionalProperties": false,
    })
}

/// The texels of a volume: 27 coefficients and the validity of each probe.
fn texels(lit: &LitVolume<'_>, grid: &Grid, is_irradiance: bool) -> Vec<[f32; 4]> {
    let of_radiance = |row: usize| if is_irradiance { IRRADIANCE[row.isqrt()] } else { 1.0 };
    let probe = |probe: usize| {
        let rows = OF_FILES.rows(&lit.rows[probe]);
        let rows: Rows =
            std::array::from_fn(|row| rows[row].map(|x| (of_radiance(row) * f64::from(x)) as f32));
        packed(&rows, if lit.valid[probe] { 1.0 } else { 0.0 })
    };
    let probes: Vec<_> = grid.probes().map(probe).collect();
    stacked(&probes, grid.counts)
}

#[cfg(test)]
mod tests {
    use containers::read_ktx2;
    use probes::Volume;

    use super::*;
    use crate::testkit::{blended, bright_rows, direction, exact, noise, places, sample};

    /// The formula of README.txt, at 200 places with normals.
    #[test]
    fn the_formula_of_the_readme_gives_the_light() {
        let bounds = [[-1.0, 2.0, 0.5], [3.0, 5.0, 2.5]];
        for (lattice, is_irradiance) in [Lattice::Centres, Lattice::Corners]
            .into_iter()
            .flat_map(|lattice| [(lattice, false), (lattice, true)])
        {
            let volume = Volume::new("hall".into(), bounds, [5, 3, 4], lattice).unwrap();
            let rows = bright_rows(volume.len());
            let valid: Vec<bool> = (0..volume.len()).map(|probe| probe % 3 > 0).collect();
            let lit = LitVolume { volume: &volume, rows: &rows, valid: &valid };
            let grid = Grid::of(&volume, OF_FILES);
            let texels = texels(&lit, &grid, is_irradiance);
            let share = if is_irradiance { [1.0; 3] } else { [1.0, 2.0 / 3.0, 0.25] };
            let [nx, ny, nz] = grid.counts;
            for k in 0..200 {
                let at = [0, 1, 2].map(|axis| {
                    let [least, most] = [bounds[0][axis], bounds[1][axis]];
                    least + (0.5 + 0.6 * noise(900 * axis + k)) * (most - least)
                });
                let p = OF_FILES.vector(at);
                let u = [0, 1, 2].map(|axis| {
                    let last = grid.counts[axis] as f64 - 1.0;
                    ((p[axis] - grid.first[axis]) / grid.spacing[axis]).clamp(0.0, last)
                });
                let numbers: Vec<f64> = (0..7)
                    .flat_map(|part| {
                        let z =
                            (f64::from(part) * (nz as f64 + 2.0) + 1.5 + u[2]) / (7.0 * (nz as f64 + 2.0));
                        let uvw = [(u[0] + 0.5) / nx as f64, (u[1] + 0.5) / ny as f64, z];
                        sample(&texels, [nx, ny, 7 * (nz + 2)], uvw)
                    })
                    .collect();
                let normal = direction(k);
                let expected = exact(&blended(&volume, &rows, at.map(f64::from)), normal);
                let [x, y, z] = OF_FILES.vector(normal.map(|x| x as f32));
                let basis = [
                    0.282095,
                    0.488603 * y,
                    0.488603 * z,
                    0.488603 * x,
                    1.092548 * x * y,
                    1.092548 * y * z,
                    0.315392 * (3.0 * z * z - 1.0),
                    1.092548 * x * z,
                    0.546274 * (x * x - y * y),
                ];
                let term = |row: usize| share[row.isqrt()] * basis[row];
                for channel in 0..3 {
                    let found: f64 = (0..9).map(|row| term(row) * numbers[3 * row + channel]).sum();
                    assert!((found - expected[channel]).abs() < 1e-5, "{found} {expected:?}");
                }
            }
            let validity = |probe: usize| texels[(6 * (nz + 2) + 1) * nx * ny + probe][3];
            let first: Vec<bool> = grid.probes().take(nx * ny).map(|probe| valid[probe]).collect();
            assert!((0..nx * ny).all(|probe| validity(probe) == f32::from(u8::from(first[probe]))));
        }
    }

    /// A byte for each probe, in the order of the grid.
    #[test]
    fn validity_has_a_texture_of_its_own() {
        let volume =
            Volume::new("hall".into(), [[0.0; 3], [2.0, 3.0, 4.0]], [2, 3, 4], Lattice::Centres).unwrap();
        let places = places(vec![volume.clone()], Vec::new());
        let (rows, valid): (_, Vec<bool>) = (bright_rows(24), (0..24).map(|probe| probe % 5 > 0).collect());
        let light = ProbeLight { places: &places, rows: &rows, valid: &valid };
        let files = files(&light, Precision::Half, true, "{}").unwrap();
        let found = read_ktx2(files[1].as_ref().unwrap()).unwrap();
        assert_eq!([found.width, found.height, found.depth], [3, 4, 2]);
        // x of files is y of ours, y is z and z is x.
        for (at, texel) in found.pixels.iter().enumerate() {
            let probe = volume.index([at / 12, at % 3, at / 3 % 4]);
            assert_eq!(*texel, [f32::from(u8::from(valid[probe])), 0.0, 0.0]);
        }
        let json: Value = serde_json::from_slice(files.last().unwrap().as_ref().unwrap()).unwrap();
        assert_eq!(
            (&json["evaluation"], &json["volumes"][0]["validity"]),
            (&"irradiance".into(), &names()[1][1..].into())
        );
    }

    #[test]
    fn the_file_is_a_texture_of_three_dimensions() {
        let volume =
            Volume::new("hall".into(), [[0.0; 3], [2.0, 3.0, 4.0]], [2, 3, 4], Lattice::Centres).unwrap();
        let (rows, valid) = (bright_rows(24), [true; 24]);
        let lit = LitVolume { volume: &volume, rows: &rows, valid: &valid };
        let texels = texels(&lit, &Grid::of(&volume, OF_FILES), false);
        let sizes = Texture { width: 3, height: 4, depth: 28, ..Texture::default() };
        let file = write_ktx2_rgba(&sizes, &texels, Precision::Float, None, &[]).unwrap();
        let found = read_ktx2(&file.bytes).unwrap();
        assert_eq!([found.width, found.height, found.depth], [3, 4, 28]);
        assert!(found.pixels.iter().zip(&texels).all(|(found, texel)| found[..] == texel[..3]));
    }
}
