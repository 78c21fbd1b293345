//! Writes compact maps: the scale space of an environment (`scale-space`), the taps of a material
//! (`fit-taps`), or both in one file.
//!
//! ```toml
//! [stage.compact]
//! kind = "export-taps"
//! inputs = { scale-space = "light", taps = "taps" }
//! path = "{environment}/{material}/taps"
//! ```
//!
//! A renderer needs one scale space for each environment and one table for each material. Connect one of
//! them to write it once, or both for one file of a pair. For a pair the build compares the taps with the
//! sum over the pixels of the environment, toward 2000 views of a ball (100 if the material reflects in a
//! cone about its tangent), and warns if 95 % or 99 % of them are not within `accept`.
//!
//! ## Taps and lights of a pair
//!
//! A look-up costs a pixel about 20 operations and a light 35, so the build measures each number of taps
//! that `fit-taps` has tried (1, 2, 3, 4, 6 and 8 with `taps = "auto"`) with each number of the scale
//! space's lights, and takes the cheapest combination within `accept`, or else the most accurate one. Other
//! lights are blurred into the map; nothing is lost. With `lights = "all"` the map of an environment is the
//! same for every material, so a renderer needs it only once.
//!
//! ## Files
//!
//! The folder `path` contains these files if their inputs are connected:
//!
//! | file | content |
//! | --- | --- |
//! | `levels.ktx2` | the levels of the scale space |
//! | `normals.ktx2` | the light about the normal, by the kernels y = 0, 1/3, 2/3 and 1 |
//! | `table.ktx2` | the taps of the material |
//! | `taps.json` | the lights beside the levels, each with its direction, its angular radius in radians and the irradiance of a surface that faces it; the standard deviations `std` of the levels in radians; `diffuse`, nine coefficients whose dot with the harmonics Y(N), row l*l + l + m, is the radiance of a white diffuse surface; and the table as numbers |
//!
//! With `layout = "cube-array"` the light is an array of four cubes with mips, level k being mip k / 4 of
//! layer k % 4, and an array of four cubes. With `layout = "atlas"`, for engines that have no arrays of
//! cubes, each is one picture of all faces of all levels; face f of level k, with a border of one texel, has
//! its corner at
//!
//! > x = min(o, 1) 4 (n_0 + 2) + (k mod 4) (n + 2), y = 6 max(n_0 - 2 n + 2 (o - 1), 0) + f (n + 2)
//!
//! with o = k / 4 rounded down, n = n_0 / 2^o, and n_0 the `resolution` of the scale space. DDS files have
//! the extension `.dds`, and OpenEXR pictures, which are always an atlas, `.exr`.
//!
//! The table has 65 columns, column i for 1 - cos(theta_v) = i / 64. Rows 2 j and 2 j + 1 are (delta, log2 s)
//! and the weight r, g, b of tap j, angles in radians; the last K rows are r, g, b, y of the taps about the
//! normal.
//!
//! The table is different if the material depends on the direction of its tangent, such as brushed metal:
//! its taps are facets that are tilted against the surface by slopes p along the tangent and q across it,
//! and look along V mirrored about (p, q, 1). The texture is a column of square pictures over the disc of
//! views, (V_x, V_y) / sqrt((1 + V_z) (1 + sqrt(V_z))), `side` texels wide: a quarter of the disc, from 0
//! to 1, if `quarter` of `facets` in `taps.json` is true, otherwise all of it, from -1 to 1. Pictures 2 j
//! and 2 j + 1 are (p, q, log2 s) and the weight r, g, b of tap j, the last K are those about the normal.
//! The tensors are `taps` [side, side, J, 6], p, q, s, r, g, b, and `normals` [side, side, K, 4], rows
//! along y. docs/taps.md has the look-up. The shaders of a `preset` use the tangent of the mesh as the
//! engine provides it.
//!
//! With `varied = true`, `table` holds the tables over a parameter (`vary` of `fit-taps`), as an array of
//! pictures: its layers are the rows above, and its rows the tables, from the first value of the parameter
//! to the last. `taps.json` has these two values as `range`, and `tables` instead of `table`; the tensors
//! `taps` and `normals` have one more dimension, before the others.
//!
//! `format = "safetensors"` writes one file instead, `.safetensors` after the item's `path`:
//!
//! | tensor | shape | content |
//! | --- | --- | --- |
//! | `level_00`, `level_01`, ... | [6, n, n, 3] f32 | M, faces in the order +X -X +Y -Y +Z -Z, n as `scale-space` says |
//! | `std` | \[levels\] f64 | the standard deviation s_k of each level, in radians |
//! | `normal_0` to `normal_3` | [6, 16, 16, 3] f32 | the light about the normal |
//! | `diffuse` | [9, 3] f64 | as above |
//! | `lights` | [n, 7] f64 | direction x, y, z, angular radius, irradiance r, g, b of each light beside M |
//! | `taps` | [65, J, 5] f64 | delta, s, r, g, b of look-up j toward the view with 1 - cos(theta_v) = i / 64 |
//! | `normals` | [65, K, 4] f64 | y, r, g, b of the look-ups about the normal |
//!
//! Directions are in Specula's frame, right-handed with +Z up; a cube is sampled with (-y, z, x).
//!
//! ## Engines
//!
//! `preset` writes the files for an engine: the textures in its format and layout, a shader with the
//! look-ups of this pair, and `README.txt` with the code that loads them. It needs both inputs. The shader
//! is generated from the same source as that of Specula's own preview; those for three.js and Babylon.js
//! were run in the engine.
//!
//! ## In a renderer
//!
//! ```glsl
//! vec3 reflected(vec3 N, vec3 V) {
//!     float nv = max(dot(N, V), 0.0);
//!     vec3 R = 2.0 * nv * N - V;
//!     vec3 T = N - nv * R;                     // toward the normal: dot(N, R) is dot(N, V)
//!     T *= inversesqrt(max(dot(T, T), 1e-12));
//!     vec3 sum = vec3(0.0);
//!     for (int j = 0; j < J; ++j) {            // rows of the table, linear in 1 - nv
//!         sum += weight[j] * M(cos(delta[j]) * R + sin(delta[j]) * T, std[j]);
//!     }
//!     for (int k = 0; k < K; ++k) sum += normal_weight[k] * H(N, y[k]);
//!     return sum;                              // + each light, by the material's own formula
//! }
//! ```
//!
//! M is looked up in two levels, with x = 4 log2(s / s_0) between 0 and the last: level k = floor(x) and the
//! next, mixed by (2^((x - k) / 2) - 1) (1 + sqrt(2)), which is linear in the variance. H is linear in 3 y
//! between two kernels. docs/taps.md has the complete derivation.

use containers::{
    Encoded, Precision, TexelFormat, Texture, tensors, write_dds, write_dds_rgba, write_exr, write_exr_rgba,
    write_ktx2, write_ktx2_rgba,
};
use engine::{Context, Failure, Kind, Output, Port, Product, Reporter, choice, parameters};
use envmap::{CubeMap, Image};
use serde_json::json;
use sh::Light;
use taps::{
    AnyTable, FacetTable, ROWS, ScaleSpace, Source, TapTable, Widths, atlas_picture, facet_texels,
    table_texels,
};

use super::degree_choice::Accept;
use super::pair_choice::{PairLights, choose, tables};
use super::varied_taps;
use crate::engines::{EnginePreset, TapFileNames, TapPreset, tap_texts};
use crate::values::{Content, Excess, artifacts, quantity};

choice! {
    /// The container.
    pub(crate) enum TapsFormat {
        /// KTX2 textures.
        Ktx2 = "ktx2",
        /// DDS textures.
        Dds = "dds",
        /// OpenEXR pictures.
        Exr = "exr",
        /// One file of tensors.
        Safetensors = "safetensors",
    }
}

choice! {
    /// How the faces of all levels lie in a texture.
    pub(crate) enum TapsLayout {
        /// An array of four cubes with mips.
        CubeArray = "cube-array",
        /// One picture, in which each face has a border.
        Atlas = "atlas",
    }
}

choice! {
    /// The numbers of the light.
    pub(crate) enum TapsTexels {
        /// Three mantissas of 9 bits and one exponent: 4 bytes.
        Rgb9E5 = "rgb9e5",
        /// Blocks of 4 x 4 texels, compressed: 1 byte a texel.
        Bc6h = "bc6h",
        /// 16-bit floats: 8 bytes.
        Half = "half",
    }
}

/// The errors that are accepted by default: within a tenth of a stop.
const ACCEPT: Accept = Accept([0.1, 0.25]);

parameters! {
    /// Parameters of `export-taps`.
    pub(crate) struct Parameters {
        /// The engine whose files are written; see Engines.
        preset: Option<EnginePreset> = None,
        /// The container. Default: that of the preset, or "ktx2".
        format: Option<TapsFormat> = None,
        /// How the faces of all levels are laid out in a texture. Default: that of the preset, or
        /// "cube-array"; "exr" is always an "atlas".
        layout: Option<TapsLayout> = None,
        /// The numbers of the light in KTX2 and DDS files. Default: "rgb9e5", or "half" in an atlas.
        texels: Option<TapsTexels> = None,
        /// The errors [p95, p99] of a pair, in stops, above which there is a warning.
        accept: Accept = ACCEPT,
        /// Which lights of the scale space stay separate for a pair; see Taps and lights of a pair.
        lights: PairLights = PairLights::Auto,
        /// Whether the tables over a parameter are written instead of that of the material.
        varied: bool = false,
    }
}

/// The stem of a shader's name.
const STEM: &str = "taps";

/// The name of the numbers beside the textures.
const NUMBERS: &str = "taps.json";

impl Parameters {
    fn taps(&self) -> Option<&'static TapPreset> {
        self.preset.and_then(|preset| preset.taps)
    }

    fn format(&self) -> TapsFormat {
        let of_preset =
            |taps: &TapPreset| if taps.textures == ".exr" { TapsFormat::Exr } else { TapsFormat::Ktx2 };
        self.format.or(self.taps().map(of_preset)).unwrap_or(TapsFormat::Ktx2)
    }

    fn layout(&self) -> TapsLayout {
        let of_preset = |taps: &TapPreset| match taps.source {
            Source::CubeArray => TapsLayout::CubeArray,
            Source::Atlas => TapsLayout::Atlas,
        };
        match self.format() {
            TapsFormat::Exr => TapsLayout::Atlas,
            _ => self.layout.or(self.taps().map(of_preset)).unwrap_or(TapsLayout::CubeArray),
        }
    }

    fn texels(&self) -> TexelFormat {
        match (self.texels, self.layout()) {
            (Some(TapsTexels::Rgb9E5), _) | (None, TapsLayout::CubeArray) => TexelFormat::Rgb9E5,
            (Some(TapsTexels::Bc6h), _) => TexelFormat::Bc6h,
            (Some(TapsTexels::Half), _) | (None, TapsLayout::Atlas) => TexelFormat::Rgba16F,
        }
    }

    /// The ending of textures; `None` if there is one file of tensors.
    fn ending(&self) -> Option<&'static str> {
        match self.format() {
            TapsFormat::Ktx2 => Some(".ktx2"),
            TapsFormat::Dds => Some(".dds"),
            TapsFormat::Exr => Some(".exr"),
            TapsFormat::Safetensors => None,
        }
    }

    /// The names of the files, with a slash before them, for these connected inputs.
    fn names(&self, has_space: bool, has_taps: bool) -> Vec<String> {
        let Some(ending) = self.ending() else { return vec![".safetensors".into()] };
        let textures = [("levels", has_space), ("normals", has_space), ("table", has_taps)];
        let textures = textures.into_iter().filter(|(_, is_there)| *is_there);
        let mut names: Vec<String> = textures.map(|(name, _)| format!("/{name}{ending}")).collect();
        names.push(format!("/{NUMBERS}"));
        if let Some(taps) = self.taps() {
            names.extend([format!("/{STEM}{}", taps.ending), "/README.txt".to_owned()]);
        }
        names
    }
}

/// The kind `export-taps`.
pub(crate) struct ExportTaps;

impl Kind for ExportTaps {
    type Parameters = Parameters;

    const NAME: &'static str = "export-taps";
    const REVISION: u32 = 5;
    const KERNELS: &'static [u32] = &[brdf::revisions::MODELS, taps::revisions::SCALE_SPACE];
    const TEXT: &'static str = include_str!("export_taps.rs");

    fn ports() -> Vec<Port> {
        vec![
            Port::one::<artifacts::ScaleSpace>(SPACE).optional(),
            Port::one::<artifacts::Taps>(TAPS).optional(),
        ]
    }

    fn product(parameters: &Parameters, inputs: &[(&str, &'static str)]) -> Product {
        let has = |port: &str| inputs.iter().any(|(name, _)| *name == port);
        Product::Files(parameters.names(has(SPACE), has(TAPS)))
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let mut errors = Vec::new();
        let format = parameters.format();
        if let Some(preset) = parameters.preset {
            if preset.taps.is_none() {
                errors.push(("preset", format!("there is no shader of taps for {}", preset.name)));
            }
            let given = [("format", parameters.format.is_some()), ("layout", parameters.layout.is_some())];
            let given = given.into_iter().filter(|(_, given)| *given);
            errors.extend(given.map(|(name, _)| (name, "the preset already sets it".into())));
        }
        if format == TapsFormat::Exr && parameters.layout == Some(TapsLayout::CubeArray) {
            errors.push(("layout", "OpenEXR has no arrays of cubes; it holds an atlas".into()));
        }
        if parameters.texels.is_some() && !matches!(format, TapsFormat::Ktx2 | TapsFormat::Dds) {
            errors.push(("texels", "only format = \"ktx2\" or \"dds\" uses it".into()));
        }
        if parameters.varied && format == TapsFormat::Exr {
            errors.push(("format", "OpenEXR has no arrays of pictures; expected another format".into()));
        }
        if parameters.layout() == TapsLayout::Atlas && parameters.texels == Some(TapsTexels::Bc6h) {
            errors.push((
                "texels",
                "a block of \"bc6h\" would have texels of several faces of an atlas".into(),
            ));
        }
        errors
    }

    fn check_inputs(parameters: &Parameters, types: &[(&str, &'static str)]) -> Vec<(&'static str, String)> {
        if types.is_empty() {
            return vec![("inputs", "connect scale-space, taps, or both".into())];
        }
        if parameters.varied {
            let is_alone = types.len() == 1 && types[0].0 == TAPS && parameters.preset.is_none();
            let text = "tables over a parameter are written separately: connect only taps, without a preset";
            return (!is_alone).then(|| ("varied", text.into())).into_iter().collect();
        }
        let is_alone = types.len() == 1 && parameters.preset.is_some();
        let text = "a shader is made for a pair: connect both scale-space and taps";
        is_alone.then(|| ("preset", text.into())).into_iter().collect()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let scales = context.inputs.optional::<artifacts::ScaleSpace>(SPACE)?;
        let taps = context.inputs.optional::<artifacts::Taps>(TAPS)?;
        if parameters.varied {
            let varied = taps.as_ref().and_then(|taps| taps.0.varied.as_ref()).ok_or_else(|| {
                Failure::new("the taps are those of a single material")
                    .help("set `vary = \"roughness\"` in the stage of fit-taps")
            })?;
            return Ok(Output::files(varied_files(parameters.format(), varied, context.recipe())?));
        }
        let chosen = match (&scales, &taps) {
            (Some(scales), Some(taps)) => {
                let (lights, accept) = (parameters.lights, parameters.accept);
                Some(choose(&scales.0, &taps.0, lights, accept, reporter)?)
            }
            _ => None,
        };
        let (space, table) = match &chosen {
            Some((space, table)) => (Some(space), Some(*table)),
            None => (
                scales.as_ref().map(|scales| &scales.0.space),
                taps.as_ref().and_then(|taps| tables(&taps.0).last().copied()),
            ),
        };
        let recipe = context.recipe();
        let Some(ending) = parameters.ending() else {
            let bytes = tensors::encode_compact_map(space, table, Some(recipe))?;
            reporter.note(quantity::size(bytes.len() as u64));
            return Ok(Output::files(vec![bytes]));
        };
        let mut files = Vec::new();
        if let Some(space) = space {
            for maps in [space.levels(), space.normals()] {
                reporter.check_cancelled()?;
                files.push(light_file(parameters, space, maps, recipe, reporter)?);
            }
        }
        if let Some(table) = table {
            files.push(table_file(parameters.format(), table, recipe)?);
        }
        let bytes = files.iter().map(Vec::len).sum::<usize>();
        reporter.note(format!("{} of textures", quantity::size(bytes as u64)));
        files.push(numbers(space, table, recipe)?);
        if let (Some(preset), Some(space), Some(table)) = (parameters.taps(), space, table) {
            let [levels, normals, table_name] =
                ["levels", "normals", "table"].map(|name| format!("{name}{ending}"));
            let names =
                TapFileNames { levels: &levels, normals: &normals, table: &table_name, lights: NUMBERS };
            let counts = [table.taps(), table.normals()];
            let engine = parameters.preset.as_deref();
            let look_up = engine.and_then(|engine| engine.look_up(space.widths(), table.shape(), counts));
            let texts = look_up.map(|look_up| tap_texts(preset, STEM, names, &look_up));
            files.extend(texts.into_iter().flatten().map(|(_, text)| text.into_bytes()));
        }
        Ok(Output::files(files))
    }
}

/// The ports.
const SPACE: &str = "scale-space";
const TAPS: &str = "taps";

/// The texture of the levels, or of the light about normals.
fn light_file(
    parameters: &Parameters,
    space: &ScaleSpace,
    maps: &[CubeMap],
    recipe: &str,
    reporter: &Reporter,
) -> Result<Vec<u8>, Failure> {
    let format = parameters.texels();
    let limit = if parameters.format() == TapsFormat::Exr { TexelFormat::Rgba16F } else { format };
    let texels: Vec<[f32; 3]> = maps.iter().flat_map(|map| map.pixels()).copied().collect();
    let excess = Excess::of(&texels, Content::Values, limit.largest());
    if excess.count > 0 {
        reporter.warn(format!(
            "{}; keep more `lights` of scale-space beside the levels, or lower the exposure of the environment",
            excess.text(Content::Values)
        ));
    }
    let stds: Vec<f64> = (0..space.widths().len()).map(|k| space.widths().std(k)).collect();
    let entries = [
        ("specula.std", json!(stds).to_string()),
        ("specula.lights", json!(space.lights().iter().map(row).collect::<Vec<_>>()).to_string()),
    ];
    let entries = entries.each_ref().map(|(key, value)| (*key, value.as_str()));
    let picture = || -> Result<Image, Failure> {
        atlas_picture(maps).ok_or_else(|| Failure::new("the levels make no atlas"))
    };
    let texture = || -> Result<Texture, Failure> {
        Ok(match parameters.layout() {
            TapsLayout::CubeArray => cube_array(maps),
            TapsLayout::Atlas => {
                let picture = picture()?;
                let (width, height) = (picture.width(), picture.height());
                Texture { width, height, pixels: picture.pixels().to_vec(), ..Texture::default() }
            }
        })
    };
    let made = match parameters.format() {
        TapsFormat::Exr => write_exr(&picture()?, Precision::Half, Some(recipe))?,
        TapsFormat::Dds => write_dds(&texture()?, format.nearest())?,
        _ => write_ktx2(&texture()?, format.nearest(), Some(recipe), &entries)?,
    };
    Ok(made.bytes)
}

/// The levels as an array of four cubes with mips: level k is mip k / 4 of layer k % 4.
fn cube_array(maps: &[CubeMap]) -> Texture {
    let octaves: Vec<Vec<[f32; 3]>> = maps
        .chunks(Widths::PER_OCTAVE)
        .map(|octave| octave.iter().flat_map(|map| map.pixels()).copied().collect())
        .collect();
    let edge = maps.first().map_or(1, |map| map.cube().edge);
    let mut octaves = octaves.into_iter();
    Texture {
        width: edge,
        height: edge,
        layers: Widths::PER_OCTAVE,
        faces: 6,
        pixels: octaves.next().unwrap_or_default(),
        smaller_levels: octaves.collect(),
        ..Texture::default()
    }
}

/// The table as a texture of 65 columns.
fn table_file(format: TapsFormat, table: AnyTable<'_>, recipe: &str) -> Result<Vec<u8>, Failure> {
    let (width, texels) = match table {
        AnyTable::Angle(table) => (ROWS, table_texels(table)),
        AnyTable::View(table) => (table.side(), facet_texels(table)),
    };
    let height = texels.len() / width;
    let sizes = Texture { width, height, ..Texture::default() };
    let counts = [("specula.taps", table.taps()), ("specula.normals", table.normals())];
    let counts = counts.map(|(key, count)| (key, count.to_string()));
    let entries = counts.each_ref().map(|(key, count)| (*key, count.as_str()));
    let made: Encoded = match format {
        TapsFormat::Exr => write_exr_rgba(width, height, &texels, Precision::Half, Some(recipe), &entries)?,
        TapsFormat::Dds => write_dds_rgba(&sizes, &texels, Precision::Half)?,
        _ => write_ktx2_rgba(&sizes, &texels, Precision::Half, Some(recipe), &entries)?,
    };
    Ok(made.bytes)
}

/// A light as seven numbers.
fn row(light: &Light) -> [f64; 7] {
    let ([x, y, z], [r, g, b]) = (light.direction.vector().to_array(), light.irradiance);
    [x, y, z, light.radius, r, g, b]
}

/// The numbers beside the textures.
fn numbers(
    space: Option<&ScaleSpace>,
    table: Option<AnyTable<'_>>,
    recipe: &str,
) -> Result<Vec<u8>, Failure> {
    let mut object = serde_json::Map::new();
    if let Some(space) = space {
        let light = |light: &Light| {
            json!({
                "direction": light.direction.vector().to_array(),
                "radius": light.radius,
                "irradiance": light.irradiance,
            })
        };
        let stds: Vec<f64> = (0..space.widths().len()).map(|k| space.widths().std(k)).collect();
        object.insert("resolution".into(), space.widths().edge().into());
        object.insert("std".into(), json!(stds));
        object.insert("diffuse".into(), json!(space.diffuse().coefficients()));
        object.insert("lights".into(), space.lights().iter().map(light).collect());
    }
    if let Some(table) = table {
        match table {
            AnyTable::Angle(table) => object.insert("table".into(), table_numbers(table)),
            AnyTable::View(table) => object.insert("facets".into(), facet_counts(table)),
        };
    }
    text_of(object, recipe)
}

/// What a texture of facet taps has.
fn facet_counts(table: &FacetTable) -> serde_json::Value {
    let (side, is_quarter) = (table.side(), table.is_quarter());
    json!({ "side": side, "quarter": is_quarter, "taps": table.taps(), "normals": table.normals() })
}

/// The rows of a table.
fn table_numbers(table: &TapTable) -> serde_json::Value {
    let tap = |tap: &taps::Tap| json!({ "delta": tap.delta, "std": tap.std, "weight": tap.weight });
    let normal = |tap: &taps::NormalTap| json!({ "y": tap.y, "weight": tap.weight });
    let row = |row: &taps::TapRow| {
        json!({
            "taps": row.taps.iter().map(tap).collect::<Vec<_>>(),
            "normals": row.normals.iter().map(normal).collect::<Vec<_>>(),
        })
    };
    table.rows().iter().map(row).collect()
}

/// The files of tables over a parameter.
fn varied_files(
    format: TapsFormat,
    tensors::VariedTaps { parameter, fitted }: &tensors::VariedTaps,
    recipe: &str,
) -> Result<Vec<Vec<u8>>, Failure> {
    let varied = &fitted.table;
    if format == TapsFormat::Safetensors {
        return Ok(vec![tensors::encode_varied_table(varied, Some(recipe))?]);
    }
    let mut object = serde_json::Map::new();
    object.insert("parameter".into(), parameter.as_str().into());
    object.insert("range".into(), json!(varied.range()));
    object.insert("tables".into(), varied.tables().iter().map(table_numbers).collect());
    Ok(vec![varied_taps::texture(varied, format == TapsFormat::Dds, recipe)?, text_of(object, recipe)?])
}

/// The text of the numbers, with the recipe.
fn text_of(mut object: serde_json::Map<String, serde_json::Value>, recipe: &str) -> Result<Vec<u8>, Failure> {
    object.insert("specula".into(), serde_json::from_str(recipe)?);
    Ok((serde_json::to_string(&object)? + "\n").into_bytes())
}
