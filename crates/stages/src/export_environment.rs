//! Writes an environment as an image or a texture: another layout, size or format, the same light.
//!
//! With `import-environment` before it, and `rotate` between them where the light has to be turned, it
//! converts any environment that Specula reads: a probe to lat-long, a cross to a KTX2 cube. `specula
//! convert` does the same without a manifest.
//!
//! A lat-long image of the environment's own size has its pixels unchanged. Every other image is resampled
//! with antialiasing: each texel is the mean of the light over the texel's area, so a small lamp keeps its
//! energy.
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
//! With the other formats the ending is `.hdr`, `.png`, `.ktx2` or `.dds`. The last two are textures of one
//! level of detail: a `cube` is one file with six faces in it, and there are no strips and crosses.
//! `import-environment` reads `.exr` and `.hdr` back with the same `layout`.
//!
//! Values are linear Rec. 709 radiance; a PNG holds them tone-mapped, by the `filmic` curve of
//! `contact-sheet`, and is for looking only.
//!
//! ## Example
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

use std::borrow::Cow;

use containers::{Precision, Texture};
use engine::{Context, Failure, Kind, Output, Port, Product, choice, parameters};
use envmap::Environment;
use shrm::Plain;
use sphere::{Cube, Face, LatLong};

use crate::choices::{LampsName, MOST, MapsFormat, Overflow, PrecisionName, STOPS};
use crate::export_reflection_map::{self as picture, Layout, PlainName};
use crate::parts::PartsName;
use crate::{artifacts, map_source};

choice! {
    /// The container of the written images.
    pub(crate) enum Format {
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

impl Format {
    fn extension(self) -> &'static str {
        match self {
            Self::Exr => ".exr",
            Self::Rgbe => ".hdr",
            Self::Png => ".png",
            Self::Ktx2 => ".ktx2",
            Self::Dds => ".dds",
        }
    }

    /// The format of a picture, if it is not a texture.
    fn picture(self) -> Result<picture::Format, MapsFormat> {
        match self {
            Self::Exr => Ok(picture::Format::Exr),
            Self::Rgbe => Ok(picture::Format::Rgbe),
            Self::Png => Ok(picture::Format::Png),
            Self::Ktx2 => Err(MapsFormat::Ktx2),
            Self::Dds => Err(MapsFormat::Dds),
        }
    }
}

parameters! {
    /// Parameters of `export-environment`.
    pub(crate) struct Parameters {
        /// How the sphere lies on the written images; see Files.
        layout: Layout = Layout::LatLong,
        /// Rows of a lat-long image, which has twice as many columns; texels along the edge of a cube's face.
        /// Default: as fine as the environment.
        #[range(1..=MOST)]
        resolution: Option<usize> = None,
        /// The container: OpenEXR, Radiance, a tone-mapped PNG for looking, or a KTX2 or DDS texture.
        format: Format = Format::Exr,
        /// With format "exr", "ktx2" or "dds": 16-bit or 32-bit numbers. A half holds 3 digits, up to 65504.
        precision: PrecisionName = PrecisionName(Precision::Half),
        /// With precision "half": what happens to values past 65504: they become 65504, or the item fails.
        overflow: Overflow = Overflow::Clamp,
        /// Stops by which radiance is multiplied.
        #[range(STOPS)]
        exposure: f64 = 0.0,
    }
}

impl Parameters {
    /// The parameters of written pictures, of this resolution.
    fn picture(&self, format: picture::Format, resolution: usize) -> picture::Parameters {
        picture::Parameters {
            layout: self.layout,
            resolution,
            format,
            precision: self.precision,
            overflow: self.overflow,
            exposure: 0.0,
            view: PlainName(Plain::Mean),
            lamps: LampsName::Baked,
            parts: PartsName::Together,
        }
    }

    /// The texels, and the resolution.
    fn texels(&self, environment: &Environment) -> Result<(Vec<[f32; 3]>, usize), Failure> {
        let rows = environment.grid().height;
        if self.layout == Layout::LatLong {
            let rows = self.resolution.unwrap_or(rows.min(MOST));
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
        let edge = self.resolution.unwrap_or(rows.div_ceil(2).min(MOST));
        Ok((environment.cube_map(Cube { edge })?.pixels().to_vec(), edge))
    }
}

/// The kind `export-environment`.
pub(crate) struct ExportEnvironment;

impl Kind for ExportEnvironment {
    type Parameters = Parameters;

    const NAME: &'static str = "export-environment";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[envmap::revisions::RESAMPLING, envmap::revisions::CUBE_MAP];
    const TEXT: &'static str = include_str!("export_environment.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Environment>("environment")]
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        let extension = parameters.format.extension();
        Product::Files(match (parameters.layout, parameters.format.picture()) {
            (Layout::Cube, Ok(_)) => Face::ALL.map(|face| format!("/{}{extension}", face.name())).into(),
            _ => vec![extension.to_owned()],
        })
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let Parameters { format, layout, precision, overflow, .. } = *parameters;
        let mut errors = Vec::new();
        if format.picture().is_err() && matches!(layout, Layout::CubeStrip | Layout::CubeCross) {
            errors.push(("layout", "a texture is \"lat-long\" or \"cube\"".into()));
        }
        let holds_floats = !matches!(format, Format::Rgbe | Format::Png);
        if precision.0 != Precision::Half && !holds_floats {
            errors.push(("precision", "only formats \"exr\", \"ktx2\" and \"dds\" use it".into()));
        }
        if overflow != Overflow::Clamp && (precision.0 != Precision::Half || !holds_floats) {
            errors.push(("overflow", "only precision = \"half\" uses it".into()));
        }
        errors
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let environment = &context.get::<artifacts::Environment>("environment")?.0;
        let exposed = match parameters.exposure {
            0.0 => Cow::Borrowed(environment),
            stops => Cow::Owned(environment.exposed(stops).ok_or_else(|| {
                Failure::new(format!("{stops} stops make a value infinite")).help("choose a lower exposure")
            })?),
        };
        context.check_cancelled()?;
        let (pixels, resolution) = parameters.texels(&exposed)?;
        context.check_cancelled()?;
        let format = match parameters.format.picture() {
            Ok(format) => {
                let picture = parameters.picture(format, resolution);
                return picture::write(&picture, &picture::arrange(&picture, pixels)?, context);
            }
            Err(format) => format,
        };
        let (width, faces) =
            if parameters.layout == Layout::Cube { (resolution, 6) } else { (2 * resolution, 1) };
        let texture = Texture { width, height: resolution, faces, pixels, ..Texture::default() };
        let format = (format, parameters.precision.0, parameters.overflow);
        Ok(Output::Files(map_source::encode(&texture, format, ExportEnvironment::NAME, context)?))
    }
}
