//! Writes light probes for engines: the files that they load, and the code that loads them.
//!
//! ```toml
//! [stage.for-three]
//! kind = "export-probes"
//! input = "probes"
//! preset = "three"
//! path = "probes"
//! ```
//!
//! | `preset` | what it takes | files |
//! | --- | --- | --- |
//! | `three` | volumes | `probes.json`, `probes.bin` and the module `probes.js`, which makes `LightProbeGridWebGL` or `LightProbeGrid` of them |
//! | `bevy` | up to 8 volumes | `volume-0.ktx2`, ... and the plugin `light_probes.rs` |
//! | `godot` | up to 32 volumes, and points | `light_probes.tscn`, with `LightmapGIData` in `volume-0.tres`, ... and `points.tres`; `places.tscn` |
//! | `unity` | volumes and points | `probes.json`, and the editor script `SpeculaLightProbes.cs` |
//! | `vrc-light-volumes` | up to 32 volumes | `volumes.json`, `volumes.bytes`, and the editor script `SpeculaLightVolumes.cs` |
//! | `ktx2` | up to 32 volumes | `volume-0.ktx2`, `validity-0.ktx2`, ... and `probes.json`, for programs of your own |
//! | `gltf` | volumes and points; also the transport of `bake-probes` | `probes.glb`, points with attributes as `export-gltf` names them |
//! | `transport` | the transport of `bake-probes` | `transport.json`, `transport.bin`, and `relight.js` and `relight.wgsl`, which light it |
//!
//! `probes` are those of `light-probes`, or of `probe-pattern`, whose colours show a wrong axis at once. Each
//! folder has a `README.txt` with the version, the axes, the scale and the lines of code; `gltf` has them in
//! the file. Probes without light of their own have that of their neighbours in every file.
//!
//! All presets but `godot`, `unity` and `gltf` refuse single points, which have no grid.
//!
//! ## The presets in full
//!
//! Each of them is in the axes of the glTF file that the scene was imported from, right-handed, +Y up, in
//! metres, but for the two of Unity, which mirror x as importers of glTF do.
//!
//! `three`
//!
//! - versions: revision 184 and later. Since 187 a grid has a probe in the middle of each cell; until 186 its
//!   outer probes were its corners. The file has the box for both, and the module takes the one for its
//!   `REVISION`. `lattice` of `place-probes` does not matter, except that boxes with probes at the corners
//!   grow by half a spacing in 187: a note says so if two of them overlap for that reason
//! - layout: an RGBA16F or RGBA32F texture of nx x ny x 7 (nz + 2), the 27 coefficients four at a time
//! - scale: radiance. WebGLRenderer ignores `intensity`
//! - a file of its own does not exist in three.js; texels without a container need a `fetch` and no loader
//! - source: three.js examples/jsm/lighting/LightProbeGridWebGL.js, LightProbeGrid.js;
//!   ShaderChunk/lightprobes_pars_fragment.glsl.js; seen in 0.186 and 0.187
//!
//! `bevy`
//!
//! - versions: 0.13 to 0.20; none in browsers
//! - layout: (Rx, 2 Ry, 3 Rz), RGBA16F or RGB9E5: ambient cubes, along z the sides of x, y and z, along y the
//!   positive sides and then the negative ones, as the shader reads them
//! - scale: irradiance over pi along the six axes; negative light is 0, which is noted. Bevy blends three of
//!   them with the squares of the normal, so that what is between the axes is an approximation
//! - source: bevy_pbr/src/light_probe/irradiance_volume.wgsl and .rs; its formula is a test here
//!
//! `godot`
//!
//! - versions: 4; a `LightmapGI` for each volume, which lights objects with `gi_mode` Dynamic
//! - layout: `probe_data` of `LightmapGIData`: points, nine colours each, six tetrahedra a cell, and the tree
//!   that finds them. The outer probes of `lattice = "centres"` are there twice, at the ends of the box too,
//!   because Godot makes light beyond the outer probes too bright
//! - points: `points.tres` has all probes, up to 32,768, with the Delaunay tetrahedra between them. They fill
//!   a box of 2.75 times the size of that around the probes and a margin of 1 m or more; its corners have the
//!   light of the nearest probe. Godot blends what overlaps: the probes of volumes are among them, so that
//!   both have the same light. Text is 1.1 KB a probe of an octree, and 4.5 KB a probe at random places
//! - scale: radiance over pi, as Godot's baker writes it
//! - source: scene/3d/lightmap_gi.cpp; light_storage.cpp, lightmap_tap_sh_light;
//!   scene_forward_clustered.glsl; renderer_scene_cull.cpp, _update_instance_lightmap_captures; their
//!   formulas are tests here; not loaded in Godot
//!
//! `unity`
//!
//! - versions: 2019.4 and later; since 2023.2 probes get their places without a bake of places
//! - scale: `SphericalHarmonicsL2`: irradiance over pi, in the order of Unity
//! - source: EntityLighting.hlsl; HDRP SphericalHarmonics.cs, PackCoefficients; the formula is a test here;
//!   the script was not run
//!
//! `vrc-light-volumes`
//!
//! - versions: REDSIM/VRCLightVolumes 1 and 2
//! - layout: three textures of a volume: (L0.rgb, L1r.z) (L1r.x, L1g.x, L1b.x, L1g.z) (L1r.y, L1g.y, L1b.y,
//!   L1b.z)
//! - scale: irradiance over pi of degree 1; the slopes are multiplied by 1.7699, which the packing of the
//!   world's volumes divides by
//! - source: LightVolume.cs, LVUtils.cs, LightVolumes.cginc; their formulas are tests here; the script was
//!   not run
//!
//! `ktx2`
//!
//! - layout: as for `three`; the 28th number is 1 if a probe has light of its own, else 0. RGBA16F or
//!   RGBA32F. `validity-0.ktx2` has that, too: R8, a texel for each probe, 255 or 0
//! - scale: radiance or, with `evaluation = "irradiance"`, irradiance over pi, as `probes.json` says;
//!   README.txt has the formula in GLSL. `specula schema probes` describes `probes.json`
//!
//! `gltf`
//!
//! - `POSITION` is the place in the grid, `_SH_DEGREE_l_COEF_n` the radiance in Specula's own convention
//!   (`extras` of each mesh), and the first number of `_VALIDITY` is 1 if the probe has light of its own,
//!   else 0. A mesh for each volume and, last, one for the points
//! - of a transport: number j of the matrix [row, column] of a probe is component j % 4 of `_TRANSFER_n` with
//!   n = j / 4, VEC4. Columns are the sky, the emissive materials and the lamps, whose numbers and names are
//!   in `extras`. If a column has colours, the names are `_RED_TRANSFER_n`, `_GREEN_TRANSFER_n` and
//!   `_BLUE_TRANSFER_n`
//!
//! ## Relighting at run time
//!
//! ```toml
//! [stage.relightable]
//! kind = "export-probes"
//! inputs = { probes = "transport", lamps = "lamp-light", scene = "scene" }
//! preset = "transport"
//! path = "relight"
//! ```
//!
//! The transport is exported itself, as halves: 162 bytes a probe where surfaces are grey and the sky has
//! degree 2, 450 with degree 4, three times as much where they are coloured. `relight.js` multiplies it by
//! the coefficients of a sky (`export-sh` with `preset = "specula"`), the colours of lamps and of emissive
//! materials, and `setLight` shows the result in the grids of three.js; `relight.wgsl` does the same on a
//! graphics device. Columns are in Specula's own convention, rows in the axes of the glTF file. A sum that is
//! made at run time has no window against ringing. `transport.json` has the names of the lamps and, if
//! `scene` is connected to the stage of `import-scene`, those of the emissive materials.
//!
//! `compression = "cpca"` stores the sky's matrices in at most `bytes` a probe: clustered principal
//! components (Sloan, Hall, Hart and Snyder 2003). Probes are divided into 1, 4, 16 or 64 clusters, each with
//! a mean matrix and some components, and a probe has a byte that names its cluster and a half for each
//! component. The share of a probe in the clusters counts, so that more probes leave more components. Errors
//! are those of irradiance in all directions, over skies whose harmonics of degree l have a variance of
//! (l + 1)^-3, as those of photographs have, relative to irradiance, RMS over all probes; `cpca` in
//! `transport.json`, and a note, have them for all probes and for the worst one. `relight.js` and
//! `relight.wgsl` light the clusters and blend them: 4 ms rather than 3 for 8,000 probes in JavaScript.
//!
//! ## Numbers
//!
//! `format` is how numbers are stored: `"half"`, or for some presets `"float"` or `"rgb9e5"`, Bevy's
//! smallest, of 4 bytes a texel; its largest error is noted. Halves end at 65,504: light above it is an
//! error, and `scale`, which all light is multiplied by, brings it into the range. Textures have at most
//! 2,048 texels along a side.
//!
//! ## Files
//!
//! In the folder `path`.

mod axes;
mod bevy;
mod columns;
mod gltf;
mod godot;
mod ktx2;
mod light;
mod packing;
mod relight;
mod three;
mod unity;
mod vrc;

use containers::Precision;
use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, choice, parameters};
use probes::Lattice;
use stages::artifacts;
use stages::plugin::{UntilStopped, report_loss};

use self::axes::Rows;
use self::columns::columns;
use self::light::{MaybeFiles, ProbeLight};

pub(crate) use self::ktx2::schema;

choice! {
    /// An engine, or a format.
    pub(crate) enum ProbePreset {
        /// three.js.
        Three = "three",
        /// Bevy.
        Bevy = "bevy",
        /// Godot.
        Godot = "godot",
        /// Unity.
        Unity = "unity",
        /// VRC Light Volumes.
        VrcLightVolumes = "vrc-light-volumes",
        /// KTX2 and JSON for programs of your own.
        Ktx2 = "ktx2",
        /// Points of a binary glTF.
        Gltf = "gltf",
        /// The transport, for programs that light the probes themselves.
        Transport = "transport",
    }
}

choice! {
    /// How numbers are stored.
    pub(crate) enum NumberFormat {
        /// 16-bit floats.
        Half = "half",
        /// 32-bit floats.
        Float = "float",
        /// Three numbers with one exponent.
        Rgb9E5 = "rgb9e5",
    }
}

choice! {
    /// What the sum over harmonics of a direction is.
    pub(crate) enum Evaluation {
        /// The radiance that arrives from there.
        Radiance = "radiance",
        /// The irradiance over pi of a surface that faces there.
        Irradiance = "irradiance",
    }
}

choice! {
    /// How the matrices of a transport are stored.
    pub(crate) enum Compression {
        /// As they are.
        None = "none",
        /// As sums of clustered principal components.
        Cpca = "cpca",
    }
}

/// The most bytes of the sky's matrix of a probe with `cpca`.
const BYTES: usize = 99;

parameters! {
    /// Parameters of `export-probes`.
    pub(crate) struct Parameters {
        /// What the files are for; see the table.
        preset: ProbePreset = ProbePreset::Three,
        /// How numbers are stored: "half" or "float" for three.js and `ktx2`, "half" or "rgb9e5" for Bevy.
        /// Default: "half". Others have one format.
        format: Option<NumberFormat> = None,
        /// What all light is multiplied by.
        #[range(1e-9..=1e9)]
        scale: f64 = 1.0,
        /// With `ktx2`: whether the harmonics are those of radiance, or of irradiance over pi.
        evaluation: Evaluation = Evaluation::Radiance,
        /// With `transport`: how the sky's matrices are stored.
        compression: Compression = Compression::None,
        /// With `cpca`: the most bytes of the sky's matrix of a probe. Default: 99.
        #[range(4..=1024)]
        bytes: Option<usize> = None,
    }
}

impl ProbePreset {
    /// The ways in which its numbers may be stored.
    fn formats(self) -> &'static [NumberFormat] {
        match self {
            Self::Three | Self::Ktx2 => &[NumberFormat::Half, NumberFormat::Float],
            Self::Bevy => &[NumberFormat::Half, NumberFormat::Rgb9E5],
            Self::VrcLightVolumes | Self::Transport => &[NumberFormat::Half],
            Self::Godot | Self::Unity | Self::Gltf => &[NumberFormat::Float],
        }
    }

    /// The names of its files, in the order of their contents.
    fn names(self) -> Vec<String> {
        match self {
            Self::Three => three::NAMES.map(str::to_owned).to_vec(),
            Self::Bevy => bevy::names(),
            Self::Godot => godot::names(),
            Self::Unity => unity::NAMES.map(str::to_owned).to_vec(),
            Self::VrcLightVolumes => vrc::NAMES.map(str::to_owned).to_vec(),
            Self::Ktx2 => ktx2::names(),
            Self::Gltf => vec!["/probes.glb".into()],
            Self::Transport => relight::NAMES.map(str::to_owned).to_vec(),
        }
    }
}

/// The kind `export-probes`.
pub(crate) struct ExportProbes;

impl Kind for ExportProbes {
    type Parameters = Parameters;

    const NAME: &'static str = "export-probes";
    const REVISION: u32 = 2;
    const KERNELS: &'static [u32] = &[probes::revisions::COMPONENTS];
    const TEXT: &'static str = include_str!("export_probes.rs");

    fn ports() -> Vec<Port> {
        vec![
            Port::one::<artifacts::Probes>("probes").or::<artifacts::ProbeTransport>(),
            Port::one::<artifacts::ProbeLamps>("lamps").optional(),
            Port::one::<artifacts::Scene>("scene").optional(),
        ]
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(parameters.preset.names())
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let mut errors = Vec::new();
        let known = parameters.preset.formats();
        if !parameters.format.is_none_or(|format| known.contains(&format)) {
            let words: Vec<&str> = known.iter().map(|format| word(*format)).collect();
            errors.push(("format", format!("this preset stores numbers as {}", words.join(" or "))));
        }
        if parameters.evaluation == Evaluation::Irradiance && parameters.preset != ProbePreset::Ktx2 {
            errors.push(("evaluation", "only \"ktx2\" has a choice; engines evaluate one of them".into()));
        }
        let is_compressed = parameters.compression == Compression::Cpca;
        if is_compressed && parameters.preset != ProbePreset::Transport {
            errors.push(("compression", "only \"transport\" has matrices that relight.js can read".into()));
        }
        if parameters.bytes.is_some() && !is_compressed {
            errors.push(("bytes", "has no effect without compression = \"cpca\"".into()));
        }
        errors
    }

    fn check_inputs(parameters: &Parameters, types: &[(&str, &'static str)]) -> Vec<(&'static str, String)> {
        let has = |port: &str, name: &str| types.contains(&(port, name));
        let is_transport = has("probes", artifacts::ProbeTransport::TYPE);
        let mut errors = Vec::new();
        if parameters.preset == ProbePreset::Transport && has("probes", artifacts::Probes::TYPE) {
            errors
                .push(("preset", "\"transport\" takes the transport of bake-probes, not lit probes".into()));
        }
        if is_transport && ![ProbePreset::Transport, ProbePreset::Gltf].contains(&parameters.preset) {
            errors.push(("preset", "a transport is exported with preset = \"transport\" or \"gltf\"".into()));
        }
        if has("probes", artifacts::Probes::TYPE) {
            for (port, name) in [("lamps", artifacts::ProbeLamps::TYPE), ("scene", artifacts::Scene::TYPE)] {
                if has(port, name) {
                    errors.push((
                        "preset",
                        format!("`{port}` belongs to a transport; lit probes have their light"),
                    ));
                }
            }
        }
        if is_transport && parameters.scale != 1.0 {
            errors.push(("scale", "has no effect on a transport: it is the light that is scaled".into()));
        }
        errors
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        if context.inputs.type_at("probes") == Some(artifacts::ProbeTransport::TYPE) {
            return Ok(Output::Files(transport_files(parameters, context)?));
        }
        let probes = &context.inputs.get::<artifacts::Probes>("probes")?.0;
        let scaled = |value: f32| (f64::from(value) * parameters.scale) as f32;
        let rows: Vec<Rows> =
            probes.light.rows().iter().map(|rows| rows.map(|row| row.map(scaled))).collect();
        if rows.as_flattened().as_flattened().iter().any(|value| !value.is_finite()) {
            return Err(Failure::new("the light is too bright for 32-bit floats").help("set a lower `scale`"));
        }
        let valid: Vec<bool> = (0..rows.len()).map(|probe| probes.places.is_valid(probe)).collect();
        let light = ProbeLight { places: &probes.places, rows: &rows, valid: &valid };
        let format = parameters.format.unwrap_or(parameters.preset.formats()[0]);
        let recipe = context.recipe();
        let files = match parameters.preset {
            ProbePreset::Three => {
                note_overlaps(&light, |text| reporter.note(text));
                let files = three::files(&light, format == NumberFormat::Half, recipe)?;
                files.into_iter().map(Some).collect()
            }
            ProbePreset::Bevy => {
                let (files, loss) = bevy::files(&light, format == NumberFormat::Rgb9E5, recipe)?;
                let bevy::Loss { negative, all, error } = loss;
                if negative > 0 {
                    let text = format!(
                        "{negative} of {all} numbers were below 0, which Bevy cannot store, and are 0"
                    );
                    let help = "light-probes with window = \"non-negative\" leaves none below 0";
                    report_loss(reporter, negative as f64 / all as f64, &text, help);
                }
                if format == NumberFormat::Rgb9E5 {
                    reporter.note(format!("rgb9e5: the largest error is {:.2} % of a texel", 100.0 * error));
                }
                files
            }
            ProbePreset::Godot => reporter.until_stopped(|stop| godot::files(&light, recipe, stop))?,
            ProbePreset::Unity => unity::files(&light, recipe)?.into_iter().map(Some).collect(),
            ProbePreset::VrcLightVolumes => vrc::files(&light, recipe)?.into_iter().map(Some).collect(),
            ProbePreset::Ktx2 => {
                let precision =
                    if format == NumberFormat::Float { Precision::Float } else { Precision::Half };
                ktx2::files(&light, precision, parameters.evaluation == Evaluation::Irradiance, recipe)?
            }
            ProbePreset::Gltf => vec![Some(gltf::file(&light, recipe)?)],
            ProbePreset::Transport => return Err(Failure::new("lit probes have no transport")),
        };
        Ok(Output::Files(files))
    }
}

/// The files of a transport.
fn transport_files(parameters: &Parameters, context: &Context<'_>) -> Result<MaybeFiles, Failure> {
    let stored = &context.inputs.get::<artifacts::ProbeTransport>("probes")?.0;
    let lamps = context.inputs.optional::<artifacts::ProbeLamps>("lamps")?;
    let scene = context.inputs.optional::<artifacts::Scene>("scene")?;
    let columns =
        columns(stored, lamps.as_ref().map(|lamps| &lamps.0), scene.as_ref().map(|scene| &scene.0))?;
    if parameters.preset == ProbePreset::Gltf {
        return Ok(vec![Some(gltf::transport_file(&columns, &stored.places, context.recipe())?)]);
    }
    let most_bytes = (parameters.compression == Compression::Cpca).then(|| parameters.bytes.unwrap_or(BYTES));
    let files = relight::files(&columns, &stored.places, most_bytes, context.recipe(), &context.reporter)?;
    Ok(files.into_iter().map(Some).collect())
}

/// The word of a format in the manifest.
fn word(format: NumberFormat) -> &'static str {
    match format {
        NumberFormat::Half => "\"half\"",
        NumberFormat::Float => "\"float\"",
        NumberFormat::Rgb9E5 => "\"rgb9e5\"",
    }
}

/// Notes volumes with probes at the corners that overlap once they have grown by half a spacing.
fn note_overlaps(light: &ProbeLight<'_>, mut note: impl FnMut(String)) {
    let volumes = light.places.volumes();
    for (index, one) in volumes.iter().enumerate() {
        for other in &volumes[index + 1..] {
            let grown = |volume: &probes::Volume| {
                let half = match volume.lattice {
                    Lattice::Corners => volume.spacing().map(|spacing| 0.5 * spacing),
                    Lattice::Centres => [0.0; 3],
                };
                let [least, most] = volume.bounds;
                [0, 1, 2].map(|k| [least[k] - half[k], most[k] + half[k]])
            };
            let meet =
                |a: [[f32; 2]; 3], b: [[f32; 2]; 3]| (0..3).all(|k| a[k][0] < b[k][1] && b[k][0] < a[k][1]);
            let own = |volume: &probes::Volume| [0, 1, 2].map(|k| [volume.bounds[0][k], volume.bounds[1][k]]);
            if meet(grown(one), grown(other)) && !meet(own(one), own(other)) {
                note(format!(
                    "{} and {} overlap in three.js 187, whose boxes end half a spacing beyond the outer \
                     probes; lattice = \"centres\" keeps them apart",
                    one.name, other.name
                ));
            }
        }
    }
}

#[cfg(test)]
mod tests;
