//! Coefficients and environments as safetensors, readable from Python in one line.
//!
//! | kind | tensors | metadata |
//! | --- | --- | --- |
//! | `lighting` | `sh` [(F+1)^2, 3] f64, row l*l + l + m; `lights` if there are some beside the series | |
//! | `light-field` | `points` [P, 3] and the light at each, `sh` [P, (F+1)^2, 3], f64 | |
//! | `brdf` | `rho` [F+1, P+1, P+1, 3] f64, indexed l, p, q >= 0; `rho` of its parts; the tables of its material | `centre`, `material`; `degrees` is `for-light` if they are to be chosen, `tolerance 0.03` if that share of the energy chose them |
//! | `reflection` | `sh` and `rho`, of one degree F; those of its parts; `lights` beside them and the tables of the material | `centre`, `material`; `degrees` is `for-light` if they were chosen |
//! | `material` | `table0` [n_h, n_d, n_phi, 3] f32, ... if it is measured; `base_color` [height, width, 3] u8 if previews show a texture | `material`, `base_color` |
//! | `environment` | `radiance` [height, width, 3] f32, row 0 toward +Z; in the cache `rows` \[bytes\] u8 ([`encode_environment_rows`]) | in the cache `width`, `height`, `lengths` |
//! | `shrm` | `shrm` [faces, height, width, (P+1)^2, 3] f32, row p*p + p + q; `lights` if they are beside the map | `layout`, `view`, `centre`, `terms`, `lamps` |
//! | `components` | `components` [K, 6, edge + 2, edge + 2, 3] and `weights` [K, 64, 64] f32; in 8 bits see [`encode_packed_components`]; `lights` as above | `centre`, `components`, `edge`, `frame`, `disc`, `lamps` |
//! | `prefiltered` | `sh` as above; `level0` [6, edge, edge, 3] f32, `level1` ... | `distribution`; `levels`, JSON: roughness and method of each |
//! | `scale-space` | `level_00` [6, edge, edge, 3] f32, ..., `normal_0` to `normal_3`; `std`, `diffuse`, `lights` and `points` ([`encode_scale_space`]) | |
//! | `taps` | `taps` [65, J, 5] and `normals` [65, K, 4] f64 ([`encode_taps`]); the tables of the material | `material`, `rms` |
//! | `compact-map` | the tensors of both, without `points` ([`encode_compact_map`]) | |
//! | `brdf-table` | `c` [Q, N, N, (F+1)^2, channels] f32, row 0 of the map toward +y, row l*l + l + m | `below`, `channels`, `degree` |
//! | `transfer` | `transfer` [V, (O+1)^2, (F+1)^2] f16, rows in each vertex' frame, or another form ([`encode_transfer`]) | `mesh`, the digest of the mesh |
//! | `vertex-radiance` | `radiance` [V, 3] f32 | `mesh` |
//! | `light-rig` | `direction` [n, 3], `radiance` [n, 3], `pdf` \[n\], `mip` \[n\] f32 ([`encode_light_rig`]) | `rows` |
//! | `direction-samples` | `point` [n, 2], `direction` [n, 3], `pdf` \[n\], `weight` \[n\] f32 ([`encode_direction_samples`]) | `count`, `mean`, `variance`, `standard-error` |
//! | `wavelets` | `level0` [R, 2 R, 3], `level1` ..., or `haar` [R, 2 R, 3], or `index` \[n\] u32 and `haar` [n, 3], f32 ([`encode_wavelets`]) | `rows`, `form`, `error` |
//! | `scene` | `triangles` [T, 3, 3], `attributes` [A, 3, 10] f32, `texture0` [height, width, 4] u16 and more ([`encode_scene`]) | `materials`, `lamps`, `nodes`, `boxes`, `part`, `surfaces` |
//! | `probe-transport` | `sky` [P, (F+1)^2, (O+1)^2, 1 or 3], `direct` and `indirect` [P, E, (F+1)^2, 3] f16 or f32, the tensors of `probe-places`, and `bricks.*` u64 if known ([`encode_probe_transport`]) | `places`, `surfaces`, `volumes` |
//! | `probe-lamps` | `direct` and `indirect` [L, P, (F+1)^2, 3] f32 ([`encode_probe_lamps`]) | `lamps`, `places`, `surfaces` |
//! | `probe-places` | `positions` [P, 3] f32, `repairs` \[P\] u8 and more ([`encode_probe_places`]) | `volumes`, and `triangles`, their digest |
//! | `probes` | `sh` [P, 9, 3] f32 and the tensors of `probe-places` ([`encode_probes`]) | `volumes` |
//! | `mesh` | `positions` [V, 3], `normals` [V, 3], `tangents` [V, 4], `coordinates` [V, 2] or none f32; `triangles` [T, 3] u32 | |
//!
//! `lights` is [n, 7] f64: the direction x, y, z of a disk, its angular radius in radians, and the irradiance
//! RGB of a surface that faces it ([`sh::Light`]).
//!
//! The two parts of a material that has two centres are named by a prefix: `diffuse.rho` and `specular.rho`
//! are their coefficients, `diffuse.sh` and `specular.sh` the lighting at their degrees, `diffuse.centre` and
//! `specular.centre` their centres.
//!
//! `__metadata__` holds `kind`, `centre` (`reflection`, `normal` or `tangent`) if a BRDF had a part, and
//! `specula`, the recipe. A `shrm` always has every row, zeros included: `terms` is `zonal` if those with q
//! other than 0 are zero throughout, else `all`. Its `layout` is `lat-long` (one face) or `cube` (six), its
//! `view` `local` or `global`; further entries state the frame and the basis. A `rho` of one channel
//! is read as grey. All values are finite, and `rho` is zero where q > min(l, p): that is checked both ways.
//!
//! The file is written here and not by the `safetensors` crate, which keeps metadata in a hash map: its bytes
//! would differ from run to run.

use std::collections::BTreeMap;

use brdf::{BrdfCoefficients, Material, Part};
use envmap::{CodedRows, Environment};
use safetensors::tensor::Dtype;
use serde_json::json;
use sh::{Expansion, Lighting};
use shrm::{Lamps, Reflection};
use sphere::LatLong;

mod arrays;
mod base_color;
mod brdf_table;
mod components;
mod direction_samples;
mod file;
mod light_field;
mod light_rig;
mod material;
mod mesh;
mod prefiltered;
mod probe_places;
mod probe_transport;
mod probes;
mod reflection_map;
mod scene;
mod taps;
mod transfer;
mod wavelets;

use crate::error::{Error, ErrorKind};
use crate::limits;
use crate::recipe::KEY;
use file::{TensorFile, Writer, check_finite, colours, wrong_shape};

pub use brdf_table::{decode_brdf_table, encode_brdf_table};
pub use components::{WEIGHTS, component_metadata, encode_components, encode_packed_components};
pub use direction_samples::encode_direction_samples;
pub use light_field::{decode_light_field, encode_light_field};
pub use light_rig::encode_light_rig;
pub use material::{decode_material, decode_textured_material, encode_material, encode_textured_material};
pub use mesh::{decode_mesh, encode_mesh};
pub use prefiltered::{decode_prefiltered, encode_prefiltered};
pub use probe_places::{decode_probe_places, encode_probe_places};
pub use probe_transport::{
    ProbeLamps, ProbeTransport, TransportPrecision, decode_probe_lamps, decode_probe_transport,
    encode_probe_lamps, encode_probe_transport,
};
pub use probes::{Probes, decode_probes, encode_probes};
pub use reflection_map::{decode_lights, decode_shrm, encode_shrm};
pub use scene::{StoredScene, decode_scene, encode_scene};
pub use taps::{
    EnvironmentScales, MaterialTaps, VariedTaps, decode_scale_space, decode_taps, encode_compact_map,
    encode_scale_space, encode_taps, encode_varied_table,
};
pub use transfer::{
    OfMesh, decode_transfer, decode_vertex_blend, decode_vertex_radiance, encode_transfer,
    encode_vertex_blend, encode_vertex_radiance,
};
pub use wavelets::{Wavelets, encode_wavelets};

/// The entry that says what chooses or chose the degrees; those that were named have none.
const DEGREES: &str = "degrees";
/// The value of [`DEGREES`] for degrees that are chosen, or were chosen, for a light.
const FOR_LIGHT: &str = "for-light";
/// The value of [`DEGREES`] for degrees that meet a tolerance, which follows.
const TOLERANCE: &str = "tolerance ";

/// What chooses the degrees of a BRDF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DegreeSource {
    /// Each light chooses its own: the coefficients are more than enough.
    Light,
    /// They were named.
    Named,
    /// They are the least that lose no more than this share of the energy.
    Tolerance(f64),
}

impl DegreeSource {
    /// The entry [`DEGREES`].
    fn entry(self) -> Option<String> {
        match self {
            Self::Light => Some(FOR_LIGHT.to_owned()),
            Self::Named => None,
            Self::Tolerance(tolerance) => Some(format!("{TOLERANCE}{tolerance}")),
        }
    }

    /// The meaning of such an entry. A program that writes a BRDF names its degrees.
    fn of(entry: Option<&str>) -> Self {
        let tolerance = |text: &str| text.strip_prefix(TOLERANCE)?.parse().ok();
        match entry {
            Some(FOR_LIGHT) => Self::Light,
            Some(text) => tolerance(text).map_or(Self::Named, Self::Tolerance),
            None => Self::Named,
        }
    }
}

/// The tensors and the metadata of a safetensors file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    /// Name, type and shape of each tensor, in the order of the file.
    pub tensors: Vec<(String, String, Vec<usize>)>,
    /// The entries of `__metadata__`.
    pub metadata: BTreeMap<String, String>,
}

/// The prefixes of the names of each part's tensors.
const PARTS: [(Part, &str); 2] = [(Part::Diffuse, "diffuse."), (Part::Specular, "specular.")];

/// The tensors and the metadata of a safetensors file, whichever program wrote it.
///
/// # Errors
/// If the bytes are not a safetensors file.
pub fn describe(bytes: &[u8]) -> Result<Description, Error> {
    let file = TensorFile::open(bytes)?;
    let mut tensors = file.tensors.tensors();
    tensors.sort_by_key(|(_, tensor)| tensor.data().as_ptr());
    let tensors =
        tensors.into_iter().map(|(name, t)| (name, t.dtype().to_string(), t.shape().to_vec())).collect();
    Ok(Description { tensors, metadata: file.metadata })
}

/// Lighting: `sh` [(F+1)^2, 3], and `lights` [n, 7] if there are some beside the series.
///
/// # Errors
/// If a number is not finite.
pub fn encode_lighting(lighting: &Lighting, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("lighting", recipe);
    file.lighting("", &lighting.series)?;
    file.lights(&lighting.lights)?;
    Ok(file.finish())
}

/// Lighting, from a file of kind `lighting`.
///
/// # Errors
/// If the file is not one that [`encode_lighting`] could have written; the message names the tensor and what
/// was expected.
pub fn decode_lighting(bytes: &[u8]) -> Result<Lighting, Error> {
    let file = TensorFile::open_as(bytes, "lighting")?;
    Ok(Lighting { series: file.lighting("")?, lights: file.lights()? })
}

/// The coefficients of a BRDF, and the material that they are of.
#[derive(Clone, Debug, PartialEq)]
pub struct Brdf {
    /// The coefficients rho_lpq.
    pub coefficients: BrdfCoefficients,
    /// The material, if it is known.
    pub material: Option<Material>,
    /// What chooses the degrees.
    pub degrees: DegreeSource,
    /// The coefficients of its diffuse and its specular part, each about its own centre, if it has both.
    pub parts: Option<[BrdfCoefficients; 2]>,
}

/// A BRDF: `rho` [F+1, P+1, P+1, 3] and its centre, and the material that it is of, if that is to travel with
/// it.
///
/// # Errors
/// If a coefficient is not finite, or not zero where q > min(l, p).
pub fn encode_brdf(brdf: &Brdf, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("brdf", recipe);
    file.brdf("", &brdf.coefficients)?;
    if let Some(degrees) = brdf.degrees.entry() {
        file.entry(DEGREES, degrees);
    }
    for ((_, prefix), part) in PARTS.iter().zip(brdf.parts.iter().flatten()) {
        file.brdf(prefix, part)?;
    }
    if let Some(material) = &brdf.material {
        material::add(material, &mut file)?;
    }
    Ok(file.finish())
}

/// A BRDF and its material, from a file of kind `brdf`.
///
/// # Errors
/// The errors of [`decode_lighting`].
pub fn decode_brdf(bytes: &[u8]) -> Result<Brdf, Error> {
    let file = TensorFile::open_as(bytes, "brdf")?;
    let part = |(_, prefix): (Part, &str)| file.brdf(prefix);
    let [diffuse, specular] = PARTS;
    let parts = match file.has("diffuse.rho") {
        true => Some([part(diffuse)?, part(specular)?]),
        false => None,
    };
    Ok(Brdf {
        parts,
        coefficients: file.brdf("")?,
        material: material::of(&file)?.map(|(material, _)| material),
        degrees: DegreeSource::of(file.metadata.get(DEGREES).map(String::as_str)),
    })
}

/// A reflected field: its two factors `sh` and `rho`, of one degree F, and its lamps.
///
/// # Errors
/// The errors of [`encode_lighting`] and [`encode_brdf`].
pub fn encode_reflection(reflection: &Reflection, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("reflection", recipe);
    file.brdf("", reflection.brdf())?;
    file.lighting("", reflection.lighting())?;
    for ((_, prefix), part) in PARTS.iter().zip(reflection.parts().into_iter().flatten()) {
        file.brdf(prefix, part.brdf())?;
        file.lighting(prefix, part.lighting())?;
    }
    if reflection.is_for_light() {
        file.entry(DEGREES, FOR_LIGHT);
    }
    if let Some(lamps) = reflection.lamps() {
        file.lights(&lamps.lights)?;
    }
    if let Some(material) = reflection.material() {
        material::add(material, &mut file)?;
    }
    Ok(file.finish())
}

/// A reflected field, from a file of kind `reflection`.
///
/// # Errors
/// The errors of [`decode_lighting`], and errors if the degrees differ or there are lights without a
/// material.
pub fn decode_reflection(bytes: &[u8]) -> Result<Reflection, Error> {
    let file = TensorFile::open_as(bytes, "reflection")?;
    let lights = file.lights()?;
    let material = material::of(&file)?.map(|(material, _)| material);
    if !lights.is_empty() && material.is_none() {
        return Err(Error::damaged("metadata `material`: missing, but `lights` need what reflects them"));
    }
    let field = |prefix: &str, material: Option<Material>| -> Result<Reflection, Error> {
        let (lighting, brdf) = (file.lighting(prefix)?, file.brdf(prefix)?);
        same_degree(&lighting, &brdf).map_err(Error::damaged)?;
        let field = Reflection::convolve(&lighting, &brdf);
        let field = if file.is_for_light() { field.marked_for_light() } else { field };
        Ok(match material {
            Some(material) => field.with_lamps(Lamps { lights: lights.clone(), material }),
            None => field,
        })
    };
    let part = |(part, prefix): (Part, &str)| {
        let of_part = material.as_ref().map(|material| material.part(part));
        match of_part {
            Some(None) => {
                Err(Error::damaged("metadata `material`: has one part, but the tensors are of two"))
            }
            of_part => field(prefix, of_part.flatten()),
        }
    };
    let whole = field("", material.clone())?;
    let [diffuse, specular] = PARTS;
    Ok(match file.has("diffuse.rho") {
        true => whole.with_parts([part(diffuse)?, part(specular)?]),
        false => whole,
    })
}

/// An environment: `radiance` [height, width, 3] f32.
///
/// # Errors
/// If a value is not finite.
pub fn encode_environment(environment: &Environment, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let LatLong { width, height } = environment.grid();
    let values = environment.pixels().as_flattened();
    check_finite("radiance", values, ErrorKind::Unwritable)?;
    let mut file = Writer::new("environment", recipe);
    file.data.reserve_exact(4 * values.len());
    file.extend_f32(values);
    file.tensor("radiance", "F32", &[height, width, 3]);
    Ok(file.finish())
}

/// An environment as the cache has it, which is smaller than the photograph that it was made from: `rows`
/// \[bytes\] u8, the blocks of [`Environment::blocks`] one after the other. The metadata have `width`,
/// `height` and, in JSON, the `lengths` of the blocks in bytes.
pub fn encode_environment_rows(environment: &Environment) -> Vec<u8> {
    let LatLong { width, height } = environment.grid();
    let blocks = environment.blocks();
    let lengths: Vec<usize> = blocks.iter().map(|block| block.bytes().len()).collect();
    let mut file = Writer::new("environment", None);
    file.entry("width", width.to_string());
    file.entry("height", height.to_string());
    file.entry("lengths", json!(lengths).to_string());
    file.tensor_of_bytes("rows", lengths.iter().sum());
    file.finish_with(blocks.iter().map(CodedRows::bytes))
}

/// The environment of a file that [`encode_environment_rows`] wrote.
fn environment_of_rows(file: &TensorFile<'_>) -> Result<Environment, Error> {
    let entry = |key: &str| {
        let text = file.metadata.get(key).map_or("", String::as_str);
        text.parse::<usize>().map_err(|_| Error::damaged(format!("metadata `{key}`: expected a number")))
    };
    let (width, height) = (entry("width")?, entry("height")?);
    limits::pixels(width, height)?;
    let lengths = file.metadata.get("lengths").and_then(|text| serde_json::from_str::<Vec<usize>>(text).ok());
    let lengths = lengths.ok_or_else(|| Error::damaged("metadata `lengths`: expected numbers"))?;
    let tensor = file.tensor("rows", Dtype::U8, "[bytes]")?;
    let mut rest = tensor.data();
    let mut blocks = Vec::with_capacity(lengths.len().min(height));
    let wrong = || Error::damaged(format!("tensor `rows`: expected {width} x {height} pixels in blocks"));
    for (index, length) in lengths.into_iter().enumerate() {
        let (block, after) = rest.split_at_checked(length).ok_or_else(wrong)?;
        let rows = CodedRows::rows(height, index).len();
        blocks.push(CodedRows::from_bytes(width, rows, block.to_vec()).ok_or_else(wrong)?);
        rest = after;
    }
    let environment = Environment::from_blocks(LatLong { width, height }, blocks);
    environment.filter(|_| rest.is_empty()).ok_or_else(wrong)
}

/// An environment, from a file of kind `environment`.
///
/// # Errors
/// The errors of [`decode_lighting`].
pub fn decode_environment(bytes: &[u8]) -> Result<Environment, Error> {
    const NAME: &str = "radiance";
    let file = TensorFile::open_as(bytes, "environment")?;
    if file.has("rows") {
        return environment_of_rows(&file);
    }
    let tensor = file.tensor(NAME, Dtype::F32, "[height, width, 3]")?;
    let &[height, width, 3] = tensor.shape() else {
        return Err(wrong_shape(NAME, "[height, width, 3]", tensor.shape()));
    };
    let pixels = colours(&tensor);
    check_finite(NAME, pixels.as_flattened(), ErrorKind::Damaged)?;
    Environment::new(LatLong { width, height }, pixels)
        .ok_or_else(|| wrong_shape(NAME, "[height, width, 3], none of them 0", tensor.shape()))
}

pub(crate) fn read_recipe(bytes: &[u8]) -> Option<String> {
    TensorFile::open(bytes).ok()?.metadata.remove(KEY)
}

fn same_degree(lighting: &Expansion, brdf: &BrdfCoefficients) -> Result<(), String> {
    let (left, right) = (lighting.degree().get(), brdf.f().get());
    if left == right {
        Ok(())
    } else {
        Err(format!("expected `sh` and `rho` of one degree, found {left} and {right}"))
    }
}

#[cfg(test)]
mod tests {
    use brdf::Centre;
    use safetensors::tensor::TensorView;
    use sh::{Degree, Light};
    use sphere::Direction;

    use super::*;

    fn series(degree: usize) -> Expansion {
        let degree = Degree::new(degree).unwrap();
        let rows = (0..degree.rows()).map(|i| [i as f64, -0.1 * i as f64, 1e-300]).collect();
        Expansion::from_coefficients(degree, rows).unwrap()
    }

    fn lighting(degree: usize) -> Lighting {
        let light = |x: f64| Light {
            direction: Direction::from_angles(x, 2.0),
            radius: 0.01,
            irradiance: [x, 1.0, 1e5],
        };
        Lighting { series: series(degree), lights: (0..degree % 3).map(|i| light(i as f64)).collect() }
    }

    fn coefficients() -> BrdfCoefficients {
        let (f, p) = (Degree::new(3).unwrap(), Degree::new(2).unwrap());
        let rho = (0..4 * 9)
            .map(|i| {
                let (l, p, q) = (i / 9, i / 3 % 3, i % 3);
                if q > l.min(p) { [0.0; 3] } else { [i as f64, 0.5, -1.0 / 3.0] }
            })
            .collect();
        BrdfCoefficients::new(Centre::Tangent, f, p, rho).unwrap()
    }

    /// Coefficients about the normal.
    fn diffuse() -> BrdfCoefficients {
        let rho = (0..3).map(|l| [l as f64, 0.1, 0.2]).collect();
        BrdfCoefficients::new(Centre::Normal, Degree::new(2).unwrap(), Degree::ZERO, rho).unwrap()
    }

    fn table() -> Material {
        let values = (0..2 * 2 * 2).map(|i| [i as f32, 0.5, 1.0]).collect();
        Material::Measured(brdf::Measured::new([2, 2, 2], values).unwrap())
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
        let layers = vec![Material::Lambert(brdf::Lambert::new([0.5; 3]).unwrap()), table(), table()];
        for (material, degrees) in [
            (None, DegreeSource::Named),
            (Some(table()), DegreeSource::Tolerance(0.03)),
            (Some(Material::layers(layers).unwrap()), DegreeSource::Light),
        ] {
            let parts = (degrees == DegreeSource::Light).then(|| [diffuse(), coefficients()]);
            let brdf = Brdf { coefficients: coefficients(), degrees, material, parts };
            assert_eq!(decode_brdf(&encode_brdf(&brdf, None).unwrap()).unwrap(), brdf);
        }
        let plain = Reflection::convolve(&series(3), &coefficients());
        assert_eq!(decode_reflection(&encode_reflection(&plain, None).unwrap()).unwrap(), plain);
        let lit =
            plain.marked_for_light().with_lamps(Lamps { lights: lighting(5).lights, material: table() });
        assert_eq!(decode_reflection(&encode_reflection(&lit, None).unwrap()).unwrap(), lit);
        let base = Material::Lambert(brdf::Lambert::new([0.5; 3]).unwrap());
        let lamps = |material| Lamps { lights: lighting(5).lights, material };
        let part = |brdf, material| {
            Reflection::convolve(&series(2), &brdf).marked_for_light().with_lamps(lamps(material))
        };
        let parts = [part(diffuse(), base.clone()), part(coefficients(), table())];
        let both = lit.with_lamps(lamps(Material::layers(vec![base, table()]).unwrap())).with_parts(parts);
        assert_eq!(decode_reflection(&encode_reflection(&both, None).unwrap()).unwrap(), both);
        // A material of one part does not go with the tensors of two.
        let alone = both.with_lamps(lamps(table()));
        let error = decode_reflection(&encode_reflection(&alone, None).unwrap()).unwrap_err().to_string();
        assert_eq!(error, "metadata `material`: has one part, but the tensors are of two");
        let radiance = encode_environment(&environment(), None).unwrap();
        assert_eq!(decode_environment(&radiance).unwrap(), environment());
    }

    #[test]
    fn a_file_describes_itself() {
        let description = describe(
            &encode_reflection(&Reflection::convolve(&series(3), &coefficients()), Some("{}")).unwrap(),
        )
        .unwrap();
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
        let brdf = decode_brdf(&bytes).unwrap().coefficients;
        assert_eq!((brdf.rho(), brdf.centre()), ([[1.0; 3], [0.5; 3]].as_slice(), Centre::Normal));
    }

    #[test]
    fn errors_name_the_tensor_and_what_was_expected() {
        let zeros = [0_u8; 8 * 64];
        let nan = [0.0, f64::NAN, 0.0].map(f64::to_le_bytes);
        let lighting_errors = [
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
        for (bytes, message) in lighting_errors {
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
        let mut lit = lighting(1);
        lit.lights[0].irradiance[2] = f64::NAN;
        assert_eq!(encode_lighting(&lit, None).unwrap_err().kind(), ErrorKind::Unwritable);
        lit.lights[0] = Light { radius: -1.0, irradiance: [1.0; 3], ..lit.lights[0] };
        let message = decode_lighting(&encode_lighting(&lit, None).unwrap()).unwrap_err().to_string();
        assert!(
            message.starts_with("tensor `lights`: expected a direction, a radius from 0 to pi / 2"),
            "{message}"
        );
    }
}
