//! Writes an environment as an image or a texture: another layout, size or format, the same light.
//!
//! ```toml
//! [stage.skybox]
//! kind = "export-environment"
//! input = "environment"
//! layout = "cube"
//! resolution = 512
//! format = "ktx2"
//! path = "{environment}/skybox"
//! ```
//!
//! After `import-environment`, and `rotate` if the light has to be turned, it converts any environment that
//! Specula reads: a probe to lat-long, a cross to a KTX2 cube. `specula convert` does the same without a
//! manifest.
//!
//! A lat-long image with the environment's own size keeps the pixels unchanged. Every other image is
//! resampled with antialiasing: each texel is the mean of the light over its area, so a small lamp keeps
//! its energy.
//!
//! ## Files
//!
//! | `layout` | files, after the item's `path` |
//! | --- | --- |
//! | `lat-long` | `.exr`: twice as wide as high, the image centre looks along +X |
//! | `cube` | `/px.exr`, `/nx.exr`, `/py.exr`, `/ny.exr`, `/pz.exr`, `/nz.exr`: a folder of six faces |
//! | `cube-strip` | `.exr`: the faces +X -X +Y -Y +Z -Z from top to bottom |
//! | `cube-cross` | `.exr`: a vertical cross, three faces wide and four high; the corners are black |
//!
//! With the other formats the extension is `.hdr`, `.png`, `.ktx2` or `.dds`. The last two are textures: a
//! `cube` is one file with six faces, and there are no strips and crosses. With `levels = true` they have
//! levels of detail, each with half the rows of the one before, in which a texel is the mean of the light
//! over its area. `texels` packs texels into 4 bytes or 1 byte, and small parts of the image keep their
//! light; `zstd` compresses a KTX2 texture without loss. `import-environment` reads `.exr` and `.hdr` back
//! with the same `layout`, `.ktx2` and `.dds` without it.
//!
//! Values are linear Rec. 709 radiance. A PNG is tone-mapped with the `filmic` curve of `contact-sheet`,
//! and is only for viewing.
//!
//! ## Prefiltered cubes
//!
//! To write a cube with all its levels of detail for your own renderer, connect `prefilter` instead of an
//! environment. It can have any lobe and any list of roughnesses:
//!
//! ```toml
//! [stage.sheen]
//! kind = "export-environment"
//! input = "prefiltered"
//! layout = "cube"
//! format = "ktx2"
//! path = "{environment}/sheen"
//! ```
//!
//! `layout` must be `"cube"`, and `format` one with levels: `"ktx2"` or `"dds"`. The edge of each level has
//! half the texels of the one before, and the faces have the same orientation as those of an environment. A
//! `.ktx2` stores the lobe and the roughness of each level under the keys `specula.distribution` and
//! `specula.roughness`, and the build notes them. `export-engine` writes cubes for the engines that it
//! knows.

use std::any::Any;
use std::borrow::Cow;

use containers::{TexelFormat, Texture, write_dds, write_ktx2, write_ktx2_zstd};
use engine::{Artifact, Choice, Context, Failure, Kind, Output, Port, Product, choice, parameters};
use envmap::Environment;
use shrm::{MapGrid, Prefiltered};
use sphere::{Cube, LatLong};

use crate::engines::ExportedLight;
use crate::map::{Layout, MapPictures, endings};
use crate::values::{
    Container, Content, DistributionName, Encoding, Excess, FileFormat, MAX_RESOLUTION, Numbers, Overflow,
    PrecisionName, STOPS, artifacts,
};

choice! {
    /// The container of the written images.
    pub(crate) enum EnvironmentFormat {
        /// OpenEXR.
        Exr = "exr",
        /// Radiance.
        Rgbe = "rgbe",
        /// PNG, tone-mapped.
        Png = "png",
        /// One KTX2 texture.
        Ktx2 = "ktx2",
        /// One DDS texture.
        Dds = "dds",
    }
}

impl FileFormat for EnvironmentFormat {
    fn container(self) -> Container {
        match self {
            Self::Exr => Container::Exr,
            Self::Rgbe => Container::Rgbe,
            Self::Png => Container::Png,
            Self::Ktx2 => Container::Ktx2,
            Self::Dds => Container::Dds,
        }
    }
}

choice! {
    /// How the texels of a texture are packed.
    pub(crate) enum PackedTexels {
        /// Three mantissas with one exponent, 4 bytes.
        Rgb9E5 = "rgb9e5",
        /// Blocks of BC6H, 1 byte a texel.
        Bc6h = "bc6h",
    }
}

impl PackedTexels {
    fn format(self) -> TexelFormat {
        match self {
            Self::Rgb9E5 => TexelFormat::Rgb9E5,
            Self::Bc6h => TexelFormat::Bc6h,
        }
    }
}

parameters! {
    /// Parameters of `export-environment`.
    pub(crate) struct Parameters {
        /// How the sphere is laid out on the written images; see Files.
        layout: Layout = Layout::LatLong,
        /// Rows of a lat-long image, which has twice as many columns; texels along the edge of a cube's face.
        /// Default: as fine as the environment.
        #[range(1..=MAX_RESOLUTION)]
        resolution: Option<usize> = None,
        /// The container: OpenEXR, Radiance, a tone-mapped PNG for viewing, or a KTX2 or DDS texture.
        format: EnvironmentFormat = EnvironmentFormat::Exr,
        /// How the texels of a KTX2 or DDS texture are packed: three mantissas with one exponent, 4 bytes,
        /// or blocks of BC6H, 1 byte per texel. Default: not packed; then `precision` applies.
        texels: Option<PackedTexels> = None,
        /// Whether a KTX2 or DDS texture of an environment has levels of detail.
        levels: bool = false,
        /// Whether the levels of a KTX2 texture are compressed with Zstandard.
        zstd: bool = false,
        /// Stops by which radiance is multiplied.
        #[range(STOPS)]
        exposure: f64 = 0.0,
        ..numbers: Numbers,
    }
}

impl Parameters {
    fn encoding(&self) -> Encoding<EnvironmentFormat> {
        Encoding::new(self.format, self.numbers)
    }

    fn is_texture(&self) -> bool {
        self.format.container().is_texture()
    }

    /// The texels, and the resolution.
    fn texels(&self, environment: &Environment) -> Result<(Vec<[f32; 3]>, usize), Failure> {
        let rows = environment.grid().height;
        if self.layout == Layout::LatLong {
            let rows = self.resolution.unwrap_or(rows.min(MAX_RESOLUTION));
            let grid = LatLong::with_rows(rows);
            let is_as_it_is = grid == environment.grid();
            let pixels = if is_as_it_is {
                environment.pixels().to_vec()
            } else {
                environment.resized(grid)?.pixels().to_vec()
            };
            return Ok((pixels, rows));
        }
        // A face looks at half of the angle of a lat-long image's rows.
        let edge = self.resolution.unwrap_or(rows.div_ceil(2).min(MAX_RESOLUTION));
        Ok((environment.cube_map(Cube { edge })?.pixels().to_vec(), edge))
    }
}

impl Parameters {
    /// The levels after the first, down to a cube of one texel a face, or a lat-long image of one row.
    fn smaller_levels(
        &self,
        environment: &Environment,
        resolution: usize,
        context: &Context<'_>,
    ) -> Result<Vec<Vec<[f32; 3]>>, Failure> {
        let mut levels = Vec::new();
        let mut rows = resolution / 2;
        while rows > 0 {
            context.reporter.check_cancelled()?;
            levels.push(match self.layout {
                Layout::Cube => environment.cube_map(Cube { edge: rows })?.pixels().to_vec(),
                // The width of a level is half of the one before, rounded down.
                _ => environment
                    .resized(LatLong { width: (2 * resolution) >> (levels.len() + 1), height: rows })?
                    .pixels()
                    .to_vec(),
            });
            rows /= 2;
        }
        Ok(levels)
    }

    /// The file of a texture, whose brightest level has these texels.
    fn file(
        &self,
        texture: &Texture,
        brightest: &[[f32; 3]],
        content: Content,
        entries: &[(&str, &str)],
        context: &Context<'_>,
    ) -> Result<Vec<u8>, Failure> {
        let Some(texels) = self.texels.map(PackedTexels::format) else {
            let writer = self.encoding().writer(brightest, content, context)?;
            let write = if self.zstd {
                writer.texture_zstd(texture, entries)
            } else {
                writer.texture(texture, entries)
            };
            return Ok(write?.bytes);
        };
        let (name, largest) = (texels.name(), texels.largest());
        let excess = Excess::of(brightest, content, largest);
        if excess.count > 0 && self.numbers.overflow == Overflow::Error {
            let text = format!("{} values exceed {largest}, the largest number of {name}", excess.count);
            return Err(
                Failure::new(text).help("leave out `texels` and set precision = \"float\" to keep them")
            );
        }
        if excess.count > 0 {
            context.reporter.warn(format!(
                "{}; {name} ends at {largest}, and 32-bit floats keep it: leave out `texels`",
                excess.text(content)
            ));
        }
        let recipe = Some(context.recipe());
        let encoded = match self.format {
            EnvironmentFormat::Ktx2 if self.zstd => write_ktx2_zstd(texture, texels, recipe, entries)?,
            EnvironmentFormat::Ktx2 => write_ktx2(texture, texels, recipe, entries)?,
            _ => write_dds(texture, texels)?,
        };
        if encoded.negative > 0 {
            context.reporter.warn(format!(
                "{} negative values became 0, because {name} cannot hold them",
                encoded.negative
            ));
        }
        Ok(encoded.bytes)
    }
}

/// The port of the light.
const ENVIRONMENT: &str = "environment";

/// The kind `export-environment`.
pub(crate) struct ExportEnvironment;

impl Kind for ExportEnvironment {
    type Parameters = Parameters;

    const NAME: &'static str = "export-environment";
    const REVISION: u32 = 2;
    const KERNELS: &'static [u32] = &[envmap::revisions::RESAMPLING, envmap::revisions::CUBE_MAP];
    const TEXT: &'static str = include_str!("export_environment.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Environment>(ENVIRONMENT).or::<artifacts::Prefiltered>()]
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(endings(parameters.layout, parameters.format.container()))
    }

    fn details(parameters: &Parameters) -> Option<Box<dyn Any>> {
        let is_texture = parameters.is_texture();
        is_texture.then(|| Box::new(ExportedLight::Texture) as Box<dyn Any>)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let mut errors = Vec::new();
        if parameters.is_texture() && matches!(parameters.layout, Layout::CubeStrip | Layout::CubeCross) {
            errors.push(("layout", "a texture is \"lat-long\" or \"cube\"".into()));
        }
        if parameters.texels.is_some() && !parameters.is_texture() {
            errors.push(("texels", "only format = \"ktx2\" or \"dds\" uses it".into()));
        }
        if parameters.texels.is_some() && parameters.numbers.precision != PrecisionName::Auto {
            errors.push(("precision", "packed texels already set them".into()));
        }
        if parameters.levels && !parameters.is_texture() {
            errors.push(("levels", "only format = \"ktx2\" or \"dds\" has them".into()));
        }
        if parameters.zstd && parameters.format != EnvironmentFormat::Ktx2 {
            errors.push(("zstd", "only format = \"ktx2\" can be compressed".into()));
        }
        errors.extend(parameters.encoding().check());
        errors
    }

    fn check_inputs(parameters: &Parameters, types: &[(&str, &'static str)]) -> Vec<(&'static str, String)> {
        let mut errors = Vec::new();
        if types.contains(&(ENVIRONMENT, artifacts::Prefiltered::TYPE)) {
            if parameters.layout != Layout::Cube {
                errors.push(("layout", "a prefiltered cube is written as layout = \"cube\"".into()));
            }
            if !parameters.is_texture() {
                let text = "the levels of a prefiltered cube need a texture: format = \"ktx2\" or \"dds\"";
                errors.push(("format", text.into()));
            }
            if parameters.levels {
                errors.push(("levels", "a prefiltered cube already has levels".into()));
            }
            if parameters.resolution.is_some() {
                errors.push(("resolution", "a prefiltered cube already has a size".into()));
            }
        }
        errors
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        if context.inputs.type_at(ENVIRONMENT) == Some(artifacts::Prefiltered::TYPE) {
            return with_levels(
                &context.inputs.get::<artifacts::Prefiltered>(ENVIRONMENT)?.0,
                parameters,
                context,
            );
        }
        let environment = &context.inputs.get::<artifacts::Environment>(ENVIRONMENT)?.0;
        let exposed = match parameters.exposure {
            0.0 => Cow::Borrowed(environment),
            stops => Cow::Owned(environment.exposed(stops).ok_or_else(|| {
                Failure::new(format!("{stops} stops make a value infinite")).help("choose a lower exposure")
            })?),
        };
        context.reporter.check_cancelled()?;
        let (pixels, resolution) = parameters.texels(&exposed)?;
        context.reporter.check_cancelled()?;
        let (layout, encoding) = (parameters.layout, parameters.encoding());
        if !parameters.is_texture() {
            let pictures = MapPictures { layout, resolution };
            return Ok(Output::files(pictures.files(pixels, encoding, context)?));
        }
        let (width, faces) = if layout == Layout::Cube { (resolution, 6) } else { (2 * resolution, 1) };
        let mut texture = Texture { width, height: resolution, faces, pixels, ..Texture::default() };
        if parameters.levels {
            texture.smaller_levels = parameters.smaller_levels(&exposed, resolution, context)?;
        }
        let grid = match layout {
            Layout::Cube => MapGrid::Cube(Cube { edge: resolution }),
            _ => MapGrid::LatLong(LatLong::with_rows(resolution)),
        };
        let entries = [("specula.kind", ExportEnvironment::NAME)];
        let content = Content::Light(grid);
        Ok(Output::files(vec![parameters.file(&texture, &texture.pixels, content, &entries, context)?]))
    }
}

/// A prefiltered cube as one texture.
fn with_levels(
    cube: &Prefiltered,
    parameters: &Parameters,
    context: &Context<'_>,
) -> Result<Output, Failure> {
    let factor = math::exp2(parameters.exposure) as f32;
    let mut levels = cube.levels.iter().map(|level| -> Vec<[f32; 3]> {
        level.map.pixels().iter().map(|texel| texel.map(|value| value * factor)).collect()
    });
    let edge = cube.levels.first().map_or(1, |level| level.map.cube().edge);
    let texture = Texture {
        width: edge,
        height: edge,
        faces: 6,
        pixels: levels.next().unwrap_or_default(),
        smaller_levels: levels.collect(),
        ..Texture::default()
    };
    if let Some(place) = texture.first_not_finite() {
        return Err(Failure::new(format!("{place}: the value is not finite")).help(
            "choose a lower exposure, or repair the environment with bad-pixels of import-environment",
        ));
    }
    let words = DistributionName::words();
    let lobe = words.into_iter().find(|(.., lobe)| lobe.0 == cube.distribution).map_or("", |(word, ..)| word);
    let roughness: Vec<String> = cube.levels.iter().map(|level| level.roughness.to_string()).collect();
    let roughness = roughness.join(" ");
    context.reporter.note(format!("{} levels of the lobe {lobe}, roughness {roughness}", cube.levels.len()));
    // One precision for all levels: that of the brightest, which is the sharpest, wherever it is in the list.
    let peak =
        |pixels: &[[f32; 3]]| pixels.as_flattened().iter().fold(0.0_f32, |most, value| most.max(*value));
    let brightest = texture.levels().max_by(|a, b| peak(a).total_cmp(&peak(b))).unwrap_or_default();
    let content = Content::Light(MapGrid::Cube(Cube { edge: (brightest.len() / 6).isqrt() }));
    let entries = [
        ("specula.kind", ExportEnvironment::NAME),
        ("specula.distribution", lobe),
        ("specula.roughness", roughness.as_str()),
    ];
    Ok(Output::files(vec![parameters.file(&texture, brightest, content, &entries, context)?]))
}
