//! Reads an environment and makes it a lat-long image of linear Rec. 709 radiance.
//!
//! `source` names OpenEXR (`.exr`), Radiance (`.hdr`, `.pic`), TIFF (`.tif`, `.tiff`), PNG, JPEG, TGA or WebP
//! files, or folders of six cube faces. A glob gives one item per file. The content of a file decides its
//! format, not its name.
//!
//! - OpenEXR: scanlines or tiles; RGB, or Y as grey; half, float or uint. Of several layers the first with
//!   colour is read, an unnamed one before all others, with a warning that lists them; `layer` names another.
//!   The `chromaticities` are converted to Rec. 709.
//! - Radiance: RGBE or XYZE. The header's EXPOSURE is divided out; an EXPOSURE of 0 is ignored with a
//!   warning.
//! - TIFF: 8 or 16-bit integers, or 32-bit floats, grey or RGB; of several pages, the first. Floats hold high
//!   dynamic range.
//! - PNG, JPEG, TGA, WebP and TIFF of integers come with a warning: they hold no light brighter than their
//!   white.
//!
//! The colours of TIFF, PNG, JPEG and WebP are converted to linear Rec. 709 by the file's ICC profile (sRGB,
//! Display P3, Adobe RGB, Rec. 2020, linear ones and others). Without a profile, integers are taken for sRGB
//! and floats for linear Rec. 709. Integer colours that are more saturated than Rec. 709 are clipped, with a
//! warning.
//!
//! Alpha is ignored, with a warning if it is below 1.
//!
//! ## Layouts
//!
//! | `layout` | what the image is |
//! | --- | --- |
//! | `auto` | a folder is `cube`; an OpenEXR file with an `envmap` attribute has the layout that the attribute names; everything else is `lat-long` |
//! | `lat-long` | twice as wide as high, up at the top, pixel centres at half texels; the image centre is Specula's +X |
//! | `openexr-lat-long` | the lat-long of OpenEXR's `envmap` attribute: the first and last rows lie on the poles, and the last column repeats the first |
//! | `openexr-cube` | the cube of OpenEXR's `envmap` attribute: six faces below each other, +X -X +Y -Y +Z -Z, in OpenEXR's orientation |
//! | `probe` | an angular map: the centre looks forward, the distance from it is the angle divided by pi |
//! | `mirror-ball` | a photographed chrome ball: the distance from the centre is sin(angle / 2) |
//! | `cube` | six files, see below |
//! | `cube-cross` | 4 x 3 faces (horizontal cross) or 3 x 4 faces (vertical cross, its -Z turned by half a turn) in one file |
//! | `cube-strip` | 6 x 1 or 1 x 6 faces in one file, +X -X +Y -Y +Z -Z |
//!
//! In Specula's frame +Z is up, and +X is *forward*: the centre of a lat-long image, a probe and a mirror
//! ball, and the +Z face of a cube. A quarter to the left of a lat-long's centre is +Y. The right of a probe
//! is -Y, as in a lat-long image; the right of a mirror ball is +Y, because a reflection is mirrored. Faces
//! are seen from inside the cube: +X is to the right of forward, +Y is up. The crosses unfold around the +Z
//! face.
//!
//! The layout is never guessed from an image's shape: a square image may be a probe or a mirror ball, and
//! only its author knows which. If the image's shape does not fit the layout, the item fails.
//!
//! A lat-long image keeps its pixels. Every other layout is resampled with antialiasing: each texel is the
//! mean of the image over the texel's area, so a small lamp keeps its energy.
//!
//! ## Six faces
//!
//! The source is a folder that holds one set of faces, or one face of a set (with `layout = "cube"`): the
//! other five are in the same folder, so `source = "sets/*_px.hdr"` gives one item per set. The end of a
//! file's name says which face it is, in upper or lower case, after any prefix that does not end in a letter:
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
//! NaN, infinite and negative values spoil every coefficient that is computed from them. The message counts
//! them, and names the pixel and the direction of the first of each:
//!
//! | `bad-pixels` | what happens |
//! | --- | --- |
//! | `error` | the item fails |
//! | `zero` | each becomes 0, with a warning |
//! | `clamp` | NaN, negative values and -Inf become 0, +Inf becomes the largest finite value of the image, with a warning |
//!
//! `specula check` reads the header of an image alone: it finds a wrong shape, a layer that does not exist
//! and a file that is not an image, but not bad pixels.
//!
//! ## Processors
//!
//! The pixels of DWA-compressed OpenEXR, and of images with an ICC profile made of tables, differ in last
//! bits between processors with and without AVX2, and on ARM. So the kind of processor is part of the key:
//! machines of different kinds do not share these items, and later ones if the pixels are equal.
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

use std::path::{Path, PathBuf};

use containers::{
    Decoded, ImageHeader, OpenExrEnvmap, ReadOptions, decoder_level, read_image, read_image_header,
};
use engine::{Artifact, Context, Failure, Kind, OrAuto, Output, Port, Product, choice, parameters};
use envmap::{BadPixels, Environment, Image, Layout, check_faces, repair, stack_faces};
use sphere::{Face, LatLong};

use crate::artifacts;
use crate::choices::STOPS;
use crate::six_faces::{self, FaceName};

choice! {
    /// How the sphere lies on an image.
    pub(crate) enum LayoutName: Layout {
        /// Latitude and longitude, pixel centres at half texels.
        LatLong,
        /// OpenEXR's lat-long, with pixels on the poles.
        OpenExrLatLong,
        /// OpenEXR's cube.
        OpenExrCube,
        /// An angular map.
        Probe,
        /// A chrome ball.
        MirrorBall,
        /// Six files.
        Cube,
        /// A cross of faces.
        CubeCross,
        /// A strip of faces.
        CubeStrip,
    }
}

choice! {
    /// What happens to NaN, infinite and negative values.
    pub(crate) enum BadPixelsName: BadPixels {
        /// The item fails.
        Error,
        /// The value becomes 0.
        Zero,
        /// The value becomes the nearest that is not bad.
        Clamp,
    }
}

parameters! {
    /// Parameters of `import-environment`.
    pub(crate) struct Parameters {
        /// How the sphere lies on the image; see Layouts. "auto" takes it from the source: a folder is a
        /// cube, an `envmap` attribute names its layout, everything else is lat-long.
        layout: OrAuto<LayoutName> = OrAuto::Auto,
        /// The layer of an OpenEXR file: a part's name, a prefix of channels, or "part.prefix". Default: the
        /// first layer that holds colour.
        layer: Option<String> = None,
        /// Stops by which the radiance is multiplied: 1 doubles it.
        #[range(STOPS)]
        exposure: f64 = 0.0,
        /// Rows of the result, which has twice as many columns. Default: a lat-long image keeps its size, and
        /// the others keep the density of pixels at the centre of the image or face: half the rows of a
        /// probe, 0.79 times those of a mirror ball, twice those of a cube's face.
        #[range(1..=MOST_ROWS)]
        resolution: Option<usize> = None,
        /// What happens to NaN, infinite and negative values; see Bad pixels.
        bad_pixels: BadPixelsName = BadPixelsName(BadPixels::Error),
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
    const KERNELS: &'static [u32] = &[envmap::revisions::RESAMPLING];
    const TEXT: &'static str = include_str!("import_environment.rs");
    const SOURCE: bool = true;

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn processor(_: &Parameters) -> Option<&'static str> {
        Some(decoder_level())
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Environment::TYPE)
    }

    fn check_source(parameters: &Parameters, context: &Context<'_>) -> Result<(), Failure> {
        let source = context.source()?;
        match Pictures::find(source, parameters, context)? {
            Pictures::One => {
                let header = read_header(source, parameters, context)?;
                let layout = layout_of(parameters.layout, header.openexr_envmap, context);
                let checked = layout.check(header.width, header.height);
                checked
                    .map_err(|error| Failure::from(error).context(format!("cannot import {}", name(source))))
            }
            Pictures::Faces(paths) => {
                let mut sizes = [[0; 2]; Face::ALL.len()];
                for (size, path) in sizes.iter_mut().zip(&paths) {
                    let header = read_header(path, parameters, context)?;
                    *size = [header.width, header.height];
                }
                check_faces(sizes)?;
                Ok(())
            }
        }
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let source = context.source()?;
        let (image, layout) = read_source(source, parameters, context)?;
        context.check_cancelled()?;
        let (image, found) = repair(image, layout, parameters.bad_pixels.0).map_err(|error| {
            let bad = matches!(error, envmap::Error::BadPixels(_));
            let failure = Failure::from(error).context(format!("cannot import {}", name(source)));
            match bad {
                true => failure.help(
                    "bad-pixels = \"zero\" or \"clamp\" replaces them; it is better to repair the image",
                ),
                false => failure,
            }
        })?;
        if !found.is_clean() {
            context.warn(format!("bad pixels were replaced: {found}"));
        }
        let grid = parameters.resolution.map(LatLong::with_rows);
        if layout != Layout::LatLong {
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

/// The pictures of a source.
enum Pictures {
    /// The source itself.
    One,
    /// The faces of a cube, in file order.
    Faces(Vec<PathBuf>),
}

impl Pictures {
    fn find(source: &Path, parameters: &Parameters, context: &Context<'_>) -> Result<Self, Failure> {
        if context.is_folder(source) {
            return match parameters.layout {
                OrAuto::Auto | OrAuto::Fixed(LayoutName(Layout::Cube)) => Self::faces(source, None, context),
                _ => Err(Failure::new(format!(
                    "{} is a folder, but only six cube faces can be read from a folder",
                    name(source)
                ))
                .help("name a file as the source, or remove layout")),
            };
        }
        if parameters.layout == OrAuto::Fixed(LayoutName(Layout::Cube)) {
            let face = FaceName::parse(&name(source)).ok_or_else(|| {
                Failure::new(format!(
                    "{} is not a folder of six faces, and its name does not end in a face's word",
                    name(source)
                ))
                .help("with layout = \"cube\" the source is a folder or one face, such as \"sky_px.hdr\"")
            })?;
            let folder = source.parent().unwrap_or(Path::new(""));
            return Self::faces(folder, Some(&face), context);
        }
        Ok(Self::One)
    }

    /// The six images of one set in a folder.
    fn faces(folder: &Path, like: Option<&FaceName>, context: &Context<'_>) -> Result<Self, Failure> {
        let names = six_faces::find(&context.list(folder)?, like, &name(folder))?;
        Ok(Self::Faces(names.iter().map(|name| folder.join(name)).collect()))
    }
}

/// The image of the source, and its layout.
fn read_source(
    source: &Path,
    parameters: &Parameters,
    context: &Context<'_>,
) -> Result<(Image, Layout), Failure> {
    match Pictures::find(source, parameters, context)? {
        Pictures::One => {
            let decoded = read_picture(source, parameters, context)?;
            let layout = layout_of(parameters.layout, decoded.openexr_envmap, context);
            Ok((decoded.image, layout))
        }
        Pictures::Faces(paths) => {
            let faces = paths.iter().map(|path| Ok(read_picture(path, parameters, context)?.image));
            let faces = faces.collect::<Result<Vec<_>, Failure>>()?;
            let faces = <[Image; Face::ALL.len()]>::try_from(faces)
                .map_err(|faces| Failure::new(format!("a cube has six faces, not {}", faces.len())))?;
            Ok((stack_faces(faces)?, Layout::Cube))
        }
    }
}

/// The header of one file.
fn read_header(path: &Path, parameters: &Parameters, context: &Context<'_>) -> Result<ImageHeader, Failure> {
    let options = ReadOptions { layer: parameters.layer.clone() };
    read_image_header(&mut context.open(path)?, &options)
        .map_err(|error| Failure::from(error).context(format!("cannot import {}", name(path))))
}

/// The image of one file; the messages of its decoder become warnings.
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

/// The layout that the manifest names, or else the one that the file declares.
fn layout_of(wanted: OrAuto<LayoutName>, declared: Option<OpenExrEnvmap>, context: &Context<'_>) -> Layout {
    let declared = declared.map(|envmap| match envmap {
        OpenExrEnvmap::LatLong => Layout::OpenExrLatLong,
        OpenExrEnvmap::Cube => Layout::OpenExrCube,
    });
    let layout = match wanted {
        OrAuto::Auto => declared.unwrap_or(Layout::LatLong),
        OrAuto::Fixed(LayoutName(layout)) => layout,
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
