//! Reads an environment and makes it a lat-long image of linear Rec. 709 radiance.
//!
//! `source` names OpenEXR (`.exr`), Radiance (`.hdr`, `.pic`), TIFF (`.tif`, `.tiff`), PNG, JPEG, TGA or WebP files, or
//! folders of six cube faces. A glob gives one item per file. The content of a file decides its format, not its name.
//!
//! - OpenEXR: scanlines or tiles; RGB, or Y as grey; half, float or uint. Of several layers the first with colour is
//!   read, an unnamed one before all others, with a warning that lists them; `layer` names another. The
//!   `chromaticities` are converted to Rec. 709.
//! - Radiance: RGBE or XYZE. The header's EXPOSURE is divided out; an EXPOSURE of 0 is ignored with a warning.
//! - TIFF: 8 or 16-bit integers, or 32-bit floats, grey or RGB; of several pages, the first. Floats hold high dynamic
//!   range.
//! - PNG, JPEG, TGA, WebP and TIFF of integers come with a warning: they hold no light brighter than their white.
//!
//! The colours of TIFF, PNG, JPEG and WebP are converted to linear Rec. 709 by the file's ICC profile (sRGB, Display P3,
//! Adobe RGB, Rec. 2020, linear ones and others). Without a profile, integers are taken for sRGB and floats for linear
//! Rec. 709. Integer colours that are more saturated than Rec. 709 are clipped, with a warning.
//!
//! Alpha is ignored, with a warning if it is below 1.
//!
//! ## Layouts
//!
//! | `layout` | what the image is |
//! | --- | --- |
//! | `auto` | a folder is `cube`; an OpenEXR file with an `envmap` attribute is what the attribute says; all else is `lat-long` |
//! | `lat-long` | twice as wide as high, up at the top, pixel centres at half texels; the image centre is Specula's +X |
//! | `openexr-lat-long` | the lat-long of OpenEXR's `envmap` attribute: the first and last rows lie on the poles, and the last column repeats the first |
//! | `openexr-cube` | the cube of OpenEXR's `envmap` attribute: six faces below each other, +X -X +Y -Y +Z -Z, in OpenEXR's orientation |
//! | `probe` | an angular map: the centre looks forward, the distance from it is the angle divided by pi |
//! | `mirror-ball` | a photographed chrome ball: the distance from the centre is sin(angle / 2) |
//! | `cube` | six files, see below |
//! | `cube-cross` | 4 x 3 faces (horizontal cross) or 3 x 4 faces (vertical cross, its -Z turned by half a turn) in one file |
//! | `cube-strip` | 6 x 1 or 1 x 6 faces in one file, +X -X +Y -Y +Z -Z |
//!
//! In Specula's frame +Z is up, and +X is *forward*: the centre of a lat-long image, a probe and a mirror ball, and the
//! +Z face of a cube. A quarter to the left of a lat-long's centre is +Y. A probe's right is -Y, as in a lat-long
//! image; a mirror ball's is +Y, because a reflection is mirrored. Faces look as from inside the cube: +X to the right
//! of forward, +Y up; the crosses unfold around the +Z face.
//!
//! The layout is never guessed from an image's shape: a square image may be a probe or a mirror ball, and only its
//! maker knows. An image whose shape its layout cannot have is an error.
//!
//! A lat-long image keeps its pixels. Every other layout is resampled with antialiasing: each texel is the mean of
//! the image over the texel's area, so that a small lamp keeps its energy.
//!
//! ## Six faces
//!
//! The source is a folder that holds one set of faces, or one face of a set (with `layout = "cube"`): the other five
//! lie beside it, so that `source = "sets/*_px.hdr"` gives one item per set. A face is known by the end of its name,
//! in either case, after any prefix that does not end in a letter:
//!
//! | face | ends in one of |
//! | --- | --- |
//! | +X | `px`, `posx`, `right` |
//! | -X | `nx`, `negx`, `left` |
//! | +Y | `py`, `posy`, `top`, `up` |
//! | -Y | `ny`, `negy`, `bottom`, `down` |
//! | +Z | `pz`, `posz`, `front` |
//! | -Z | `nz`, `negz`, `back` |
//!
//! ## Bad pixels
//!
//! NaN, infinite and negative values spoil every coefficient that is computed from them. They are counted, and the
//! first of each is told by its pixel and direction:
//!
//! | `bad-pixels` | what happens |
//! | --- | --- |
//! | `error` | the item fails |
//! | `zero` | each becomes 0, with a warning |
//! | `clamp` | NaN, negative values and -Inf become 0, +Inf the largest finite value of the image, with a warning |
//!
//! ## Example
//!
//! ```toml
//! [stage.environment]
//! kind = "import-environment"
//! source = "assets/environments/*.{exr,hdr}"
//! exposure = 0.5
//! bad-pixels = "clamp"
//! ```

use std::path::Path;

use containers::{Decoded, OpenExrEnvmap, ReadOptions, read_image};
use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, choice, parameters};
use envmap::{Environment, Image, repair, stack_faces};
use sphere::{Face, LatLong};

use crate::artifacts;
use crate::six_faces::{self, FaceName};

choice! {
    /// How the sphere lies on the image.
    pub(crate) enum Layout {
        /// As the source says: a folder, or the `envmap` attribute; else lat-long.
        Auto = "auto",
        /// Latitude and longitude, pixel centres at half texels.
        LatLong = "lat-long",
        /// OpenEXR's lat-long, with pixels on the poles.
        OpenExrLatLong = "openexr-lat-long",
        /// OpenEXR's cube.
        OpenExrCube = "openexr-cube",
        /// An angular map.
        Probe = "probe",
        /// A chrome ball.
        MirrorBall = "mirror-ball",
        /// Six files.
        Cube = "cube",
        /// A cross of faces.
        CubeCross = "cube-cross",
        /// A strip of faces.
        CubeStrip = "cube-strip",
    }
}

choice! {
    /// What is done with NaN, infinite and negative values.
    pub(crate) enum BadPixels {
        /// The item fails.
        Error = "error",
        /// The value becomes 0.
        Zero = "zero",
        /// The value becomes the nearest that is not bad.
        Clamp = "clamp",
    }
}

parameters! {
    /// Parameters of `import-environment`.
    pub(crate) struct Parameters {
        /// How the sphere lies on the image; see Layouts.
        layout: Layout = Layout::Auto,
        /// The layer of an OpenEXR file: a part's name, a prefix of channels, or "part.prefix". Without it, the first
        /// that holds colour.
        layer: Option<String> = None,
        /// Stops by which the radiance is multiplied, -100 to 100: 1 doubles it.
        exposure: f64 = 0.0,
        /// Rows of the result, 1 to 8192, which has twice as many columns. Without it, a lat-long image keeps its size, and others
        /// keep the density of pixels that they have at the centre of the image or face: half the rows of a
        /// probe, 0.79 of a mirror ball's, twice those of a cube's face.
        resolution: Option<usize> = None,
        /// What is done with NaN, infinite and negative values; see Bad pixels.
        bad_pixels: BadPixels = BadPixels::Error,
    }
}

/// The largest `resolution`: 16384 x 8192 pixels, as many as the largest image that is read.
const MOST_ROWS: usize = 8192;

/// The kind `import-environment`.
pub(crate) struct ImportEnvironment;

impl Kind for ImportEnvironment {
    type Parameters = Parameters;

    const NAME: &'static str = "import-environment";
    const REVISION: u32 = 2;
    const TEXT: &'static str = include_str!("import_environment.rs");
    const SOURCE: bool = true;

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Environment::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let mut faults = Vec::new();
        if let Some(rows) = parameters.resolution.filter(|rows| !(1..=MOST_ROWS).contains(rows)) {
            faults.push(("resolution", format!("resolution: {rows} is not 1 to {MOST_ROWS}")));
        }
        if parameters.exposure.abs() > 100.0 {
            faults.push(("exposure", format!("exposure: {} is not -100 to 100 stops", parameters.exposure)));
        }
        faults
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let source = context.source()?;
        let (image, layout) = read_source(source, parameters, context)?;
        context.check_cancelled()?;
        let policy = match parameters.bad_pixels {
            BadPixels::Error => envmap::BadPixels::Error,
            BadPixels::Zero => envmap::BadPixels::Zero,
            BadPixels::Clamp => envmap::BadPixels::Clamp,
        };
        let (image, found) = repair(image, layout, policy).map_err(|error| {
            let bad = matches!(error, envmap::Error::BadPixels(_));
            let failure = Failure::from(error).context(format!("cannot import {}", name(source)));
            match bad {
                true => failure
                    .help("bad-pixels = \"zero\" or \"clamp\" replaces them; better is to repair the image"),
                false => failure,
            }
        })?;
        if !found.is_clean() {
            context.warn(format!("bad pixels were replaced: {found}"));
        }
        let grid = parameters.resolution.map(LatLong::with_rows);
        if layout != envmap::Layout::LatLong {
            let LatLong { width, height } =
                grid.map_or_else(|| layout.default_grid(image.width(), image.height()), Ok)?;
            context.note(format!(
                "layout {}: {} x {} pixels resampled to {width} x {height}",
                layout.name(),
                image.width(),
                image.height()
            ));
        }
        let environment = Environment::from_image(image, layout, grid)?;
        context.check_cancelled()?;
        let environment = environment.exposed(parameters.exposure).ok_or_else(|| {
            Failure::new(format!("exposure {} makes a value infinite", parameters.exposure))
        })?;
        Output::artifact(artifacts::Environment(environment))
    }
}

/// The picture of the source, and how the sphere lies on it.
fn read_source(
    source: &Path,
    parameters: &Parameters,
    context: &Context<'_>,
) -> Result<(Image, envmap::Layout), Failure> {
    if context.is_folder(source) {
        return match parameters.layout {
            Layout::Auto | Layout::Cube => read_faces(source, None, parameters, context),
            _ => Err(Failure::new(format!("{} is a folder, which can only be six cube faces", name(source)))
                .help("name a file as the source, or leave layout out")),
        };
    }
    if parameters.layout == Layout::Cube {
        let face = FaceName::parse(&name(source)).ok_or_else(|| {
            Failure::new(format!(
                "{} does not end in a face's word, and is not a folder of six faces",
                name(source)
            ))
            .help("with layout = \"cube\" the source is a folder or one face, such as \"sky_px.hdr\"")
        })?;
        let folder = source.parent().unwrap_or(Path::new(""));
        return read_faces(folder, Some(&face), parameters, context);
    }
    let decoded = read_picture(source, parameters, context)?;
    let layout = layout_of(parameters.layout, &decoded, context);
    Ok((decoded.image, layout))
}

/// Six pictures of one set in a folder, stacked in file order.
fn read_faces(
    folder: &Path,
    like: Option<&FaceName>,
    parameters: &Parameters,
    context: &Context<'_>,
) -> Result<(Image, envmap::Layout), Failure> {
    let names = six_faces::find(&context.list(folder)?, like, &name(folder))?;
    let faces = names.iter().map(|name| Ok(read_picture(&folder.join(name), parameters, context)?.image));
    let faces = faces.collect::<Result<Vec<_>, Failure>>()?;
    let faces = <[Image; Face::ALL.len()]>::try_from(faces)
        .map_err(|faces| Failure::new(format!("{} faces are not six", faces.len())))?;
    Ok((stack_faces(faces)?, envmap::Layout::Cube))
}

/// The picture of one file; what its decoder has to say becomes warnings.
fn read_picture(path: &Path, parameters: &Parameters, context: &Context<'_>) -> Result<Decoded, Failure> {
    context.check_cancelled()?;
    let options = ReadOptions { layer: parameters.layer.clone() };
    let decoded = read_image(&context.read(path)?, &options)
        .map_err(|error| Failure::from(error).context(format!("cannot import {}", name(path))))?;
    for warning in &decoded.warnings {
        context.warn(format!("{}: {warning}", name(path)));
    }
    Ok(decoded)
}

/// The layout that was asked for, or that the file declares.
fn layout_of(wanted: Layout, decoded: &Decoded, context: &Context<'_>) -> envmap::Layout {
    let declared = decoded.openexr_envmap.map(|envmap| match envmap {
        OpenExrEnvmap::LatLong => envmap::Layout::OpenExrLatLong,
        OpenExrEnvmap::Cube => envmap::Layout::OpenExrCube,
    });
    let layout = match wanted {
        Layout::Auto => declared.unwrap_or(envmap::Layout::LatLong),
        Layout::LatLong => envmap::Layout::LatLong,
        Layout::OpenExrLatLong => envmap::Layout::OpenExrLatLong,
        Layout::OpenExrCube => envmap::Layout::OpenExrCube,
        Layout::Probe => envmap::Layout::Probe,
        Layout::MirrorBall => envmap::Layout::MirrorBall,
        Layout::Cube => envmap::Layout::Cube,
        Layout::CubeCross => envmap::Layout::CubeCross,
        Layout::CubeStrip => envmap::Layout::CubeStrip,
    };
    if let Some(declared) = declared.filter(|declared| *declared != layout) {
        context.warn(format!(
            "the file's envmap attribute says {}, the manifest says {}",
            declared.name(),
            layout.name()
        ));
    }
    layout
}

/// The last part of a path, for messages.
fn name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
