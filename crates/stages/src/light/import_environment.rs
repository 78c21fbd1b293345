//! Reads an environment and converts it to a lat-long image of linear Rec. 709 radiance.
//!
//! ```toml
//! [stage.environment]
//! kind = "import-environment"
//! source = "assets/environments/*.{exr,hdr}"
//! exposure = 0.5
//! bad-pixels = "clamp"
//! ```
//!
//! `source` names OpenEXR (`.exr`), Radiance (`.hdr`, `.pic`), PFM, TIFF (`.tif`, `.tiff`), PNG, JPEG, TGA or
//! WebP files, textures (`.ktx2`, `.ktx`, `.dds`, `.env`, `.gltf`), or folders of six cube faces. A glob
//! gives one item per file. The content of a file decides its format, not its name.
//!
//! - OpenEXR: scanlines or tiles; RGB (also `red green blue`), luminance and chroma, or Y as grey; half,
//!   float or uint; every compression but ZSTD and HTJ2K. Chroma may have half the resolution, unless the
//!   compression is PXR24, B44 or B44A. See Layers.
//! - Radiance: RGBE or XYZE. The header's EXPOSURE is divided out; an EXPOSURE of 0 is ignored with a
//!   warning.
//! - PFM: RGB or grey, in either byte order.
//! - TIFF: unsigned integers of 8 to 64 bits, or floats of 16, 32 or 64; grey, palette, RGB or CMYK. Floats
//!   hold high dynamic range. If there are several pages, the largest is read, but not thumbnails and
//!   masks.
//! - PNG whose cICP chunk says PQ, HLG or linear: high dynamic range. In PQ, 203 cd/m2 becomes 1; HLG is
//!   read as scene light, and its reference white, a signal of 75 %, becomes 1.
//! - JPEG with a gain map (Ultra HDR, Adobe's or ISO 21496-1): high dynamic range. The result is the full
//!   HDR rendition, in which the white of the SDR rendition is 1. A damaged map is an error; if a program
//!   has removed the map, or if it is of Apple's own format, there is a warning. If the map leads from HDR
//!   down to SDR, the picture stays as it is.
//! - Other PNG, JPEG, TGA and WebP files, and TIFF with integers, give a warning: they hold no light
//!   brighter than their white.
//!
//! Alpha is ignored, with a warning if it is below 1. Pictures that a camera stored sideways or upside down
//! (by the Exif orientation in PNG, JPEG and WebP, or that of TIFF and TGA) are turned upright.
//!
//! ## Layers
//!
//! If an OpenEXR file has several layers or parts and there is no `layer`, the first match in this list is
//! read, with a warning that lists all of them:
//!
//! 1. the unnamed layer of R, G and B
//! 2. a layer named `beauty`, `rgba`, `rgb`, `combined`, `color`, `colour`, `image`, `main` or `default`
//! 3. another layer of R, G and B
//! 4. a layer of R, G and B whose name does not mean light, such as `N`, `normal`, `P`, `position`, `uv`
//! 5. luminance and chroma (Y RY BY)
//! 6. grey (Y)
//!
//! A layer of X, Y and Z is a position or a direction, and is never read as light.
//!
//! The picture is the display window. Parts outside the data window are black, with a warning; it is an
//! error if the two do not overlap.
//!
//! ## Colours
//!
//! Everything is converted to linear Rec. 709. The primaries are those of the file:
//!
//! - OpenEXR: the attribute `colorInteropID` (`lin_ap1_scene`), else `chromaticities`, else a name of a
//!   linear space in `oiio:ColorSpace` or `colorspace`; without them Rec. 709.
//! - Radiance: CIE XYZ of equal-energy white with FORMAT=32-bit_rle_xyze, else PRIMARIES, else Rec. 709.
//! - TIFF, PNG, JPEG and WebP: the ICC profile (sRGB, Display P3, Adobe RGB, Rec. 2020, linear ones and
//!   others); cICP in PNG overrides it. Without either, integers are assumed to be sRGB and floats linear
//!   Rec. 709.
//!
//! `colour-space` sets them if the file does not: `rec709`, `rec2020`, `acescg`, `aces2065-1`, `p3` (white
//! D65), `prophoto`, `adobergb` or `xyz` (CIE XYZ in which D65 is white). Names of OCIO and
//! `colorInteropID` are understood, too: `ACES - ACEScg`, `lin_rec2020_scene`. It overrides the file, with
//! a warning if the two differ; the transfer curve of a PNG or JPEG stays. A white other than D65 is
//! adapted with the Bradford transform.
//!
//! Wider primaries can represent colours that Rec. 709 cannot. Such a colour p moves toward the grey of the
//! same luminance Y, by the smallest step that leaves no channel negative: p' = Y + t (p - Y) with t = Y /
//! (Y - min p). A warning reports how many pixels moved and how much light changed; a change below 0.01 %,
//! such as the rounding of 8 bits, is only a note. Pixels with a negative channel in the file's own
//! primaries do not move: see Bad pixels.
//!
//! ## White balance
//!
//! `white-balance` says what was white: either the temperature of the light in kelvin, as a black body
//! relative to D65 (6504 K changes nothing), or the colour of a white or grey object, as `specula inspect`
//! and viewers show it. `grey-card` measures that colour and exposes for it: you give the column of the
//! card's left edge, the row of its upper edge, its width and its height in pixels of the picture, and the
//! mean of these pixels becomes 0.18 in each channel. Red, green and blue are multiplied by one factor
//! each; the factors of `white-balance` keep the luminance of the white. `exposure` applies after both. A
//! note reports the factors.
//!
//! ## Layouts
//!
//! | `layout` | what the image is |
//! | --- | --- |
//! | `auto` | a folder is `cube`; an OpenEXR file with an `envmap` attribute has the layout that the attribute names; if the file says that the picture shows a part of the sphere, it is placed there, see below; everything else is `lat-long` |
//! | `lat-long` | twice as wide as high, up at the top, pixel centres at half texels; the image centre is Specula's +X |
//! | `openexr-lat-long` | the lat-long of OpenEXR's `envmap` attribute: the first and last rows lie on the poles, and the last column repeats the first |
//! | `openexr-cube` | the cube of OpenEXR's `envmap` attribute: six faces below each other, +X -X +Y -Y +Z -Z, in OpenEXR's orientation |
//! | `probe` | an angular map: the centre looks forward, and the distance from it is the angle divided by pi |
//! | `mirror-ball` | a photographed chrome ball: the distance from the centre is sin(angle / 2) |
//! | `cube` | six files, see below |
//! | `cube-cross` | 4 x 3 faces (horizontal cross) or 3 x 4 faces (vertical cross, its -Z turned by half a turn) in one file |
//! | `cube-strip` | 6 x 1 or 1 x 6 faces in one file, +X -X +Y -Y +Z -Z |
//!
//! In Specula's frame +Z is up, and +X is *forward*: the centre of a lat-long image, a probe and a mirror
//! ball, and the +Z face of a cube. A quarter of the width to the left of a lat-long's centre is +Y. The
//! right of a probe is -Y, as in a lat-long image; the right of a mirror ball is +Y, because a reflection
//! is mirrored. Faces are seen from inside the cube: +X is to the right of forward, +Y is up. The crosses
//! unfold around the +Z face.
//!
//! The layout is never guessed from the shape of the image: a square image can be a probe or a mirror ball,
//! and only its author knows which. If the image's shape does not fit the layout, the item fails.
//!
//! A lat-long image keeps its pixels. Every other layout is resampled with antialiasing: each texel is the
//! mean of the image over the texel's area, so a small lamp keeps its energy.
//!
//! ## Parts of the sphere
//!
//! With `layout = "auto"`, a picture is placed on the sphere where its file says. `fill` sets the light of
//! the rest, and a warning reports how much of the sphere that is. These declarations are read:
//!
//! - XMP in PNG, JPEG, WebP and TIFF: Google's photo sphere, the names GPano:... of the namespace
//!   `http://ns.google.com/photos/1.0/panorama/`, as attributes or elements. In OpenEXR, attributes of these
//!   names (`GPano:ProjectionType`), as OpenImageIO writes them.
//! - Radiance: the header's VIEW.
//!
//! | GPano | meaning |
//! | --- | --- |
//! | `ProjectionType` | `equirectangular`, or a fisheye: `fisheye`, `equidistant`, `angular`, `hemispherical` (equidistant), `equisolid`, `stereographic`, `orthographic`; `dome`, `domemaster`, `fulldome` (equidistant, looking up, its lower side forward). Capitals and hyphens do not matter. Others, such as `cubestrip` and `cylindrical`, are an error |
//! | `FullPanoWidthPixels`, `FullPanoHeightPixels` | the size of the whole, 360 x 180 degrees |
//! | `CroppedAreaImageWidthPixels`, `CroppedAreaImageHeightPixels` | the size of the picture before it was resized |
//! | `CroppedAreaLeftPixels`, `CroppedAreaTopPixels` | its position in the whole; if it extends past the right border, it continues at the left |
//! | `PosePitchDegrees`, `PoseRollDegrees` | how the camera was tilted: the light is turned until the horizon is level, with a warning |
//! | `PoseHeadingDegrees` | where the camera looked: the light is not turned by this, and a note says so |
//!
//! If a size or position is missing, a default is assumed, with a warning: half or twice the other one, the
//! picture's own size, or the middle. It is an error if they are not numbers, or contradict each other or
//! the shape of the picture. If there is only a ProjectionType, the picture is the whole.
//!
//! A crop keeps its pixels if they are pixels of a 2:1 whole; others are resampled. A fisheye is assumed to
//! be a square of 180 degrees, with a warning. Sizes change that: a full panorama of 2:1 has 360 x 180
//! degrees at the pixels of an equidistant fisheye, a square one 180 x 180.
//!
//! A VIEW of Radiance is read if its type is a fisheye: `-vta` (equidistant), `-vth` (orthographic) or
//! `-vts` (stereographic), with the degrees `-vh` and `-vv`, the direction `-vd` and up `-vu`, the shift
//! `-vs` and lift `-vl`. Radiance's +Y is Specula's +X, its +Z up. Pixels farther from the axis than half
//! of the larger of `-vh` and `-vv`, such as a square's corners, are not read. With other types, a warning
//! says that the picture was assumed to show the whole sphere.
//!
//! `layout = "lat-long"` treats the picture as the whole sphere and ignores these declarations.
//!
//! ## Six faces
//!
//! The source is a folder that holds one set of faces, or one face of a set (with `layout = "cube"`): the
//! other five are in the same folder, so `source = "sets/*_px.hdr"` gives one item per set. The end of a
//! file's name says which face it is, in upper or lower case, after any prefix that does not end in a letter:
//!
//! | face | by axes | by words | Quake, Source |
//! | --- | --- | --- | --- |
//! | +X | `px`, `posx`, `xpos`, `+X`, `c00` | `right` | `ft` |
//! | -X | `nx`, `negx`, `xneg`, `-X`, `c01` | `left` | `bk` |
//! | +Y | `py`, `posy`, `ypos`, `+Y`, `c02` | `top`, `up` | `up` |
//! | -Y | `ny`, `negy`, `yneg`, `-Y`, `c03` | `bottom`, `down` | `dn` |
//! | +Z | `pz`, `posz`, `zpos`, `+Z`, `c04` | `front` | `rt` |
//! | -Z | `nz`, `negz`, `zneg`, `-Z`, `c05` | `back` | `lf` |
//!
//! These words mean different things in different programs. In Quake's and Source's frame, which is
//! Specula's, `rt` is forward (+X, yaw 0), and `lf` is to the right of `ft`. Unity's skybox of six sides
//! (`_FrontTex`, `_LeftTex`) also has its left at +X, to the right of the front. So the pictures decide: if
//! their edges do not match in the usual arrangement of the words, but do in one of these others, that
//! arrangement is used, with a note. A letter before the word (`desertrt.tga`) is fine if all six are
//! there.
//!
//! ## Textures
//!
//! KTX2, KTX, DDS and Babylon.js' `.env` are read, and glTF with EXT_lights_image_based: level 0 of a cube
//! (the mirror level of a prefiltered one), or of a single picture, whose layout `layout` gives as usual.
//! Texels are halves, floats, RGB9E5, R11G11B10F, BC6H (also signed), RGBD or bytes. Bytes hold no high
//! dynamic range, and a warning says so. KTX2 may be compressed with Zstandard or zlib.
//!
//! The faces are arranged as in the KTX2 specification (see above). Some engines look them up in another
//! frame: `preset` names the engine for which the file was made ({list: engines that load a cube}). Files
//! that Specula wrote record this themselves, except DDS. Without either, the cubes of `.env` and of glTF
//! are in Babylon.js' frame, which those formats come from.
//!
//! ## Bad pixels
//!
//! NaN, infinite and negative values spoil every coefficient that is computed from them. The message counts
//! them, and gives the pixel and the direction of the first of each:
//!
//! | `bad-pixels` | what happens |
//! | --- | --- |
//! | `zero-negative` | negative values become 0, with a warning that gives their share of the light; NaN and infinite values are an error |
//! | `error` | the item fails |
//! | `zero` | each becomes 0, with a warning |
//! | `clamp` | NaN, negative values and -Inf become 0, +Inf becomes the largest finite value of the image, with a warning |
//!
//! Lossy compression (DWA) and the filters of renderers leave a few negative values next to lamps, so these
//! are not an error by default.
//!
//! `specula check` reads only the header of an image: it finds a wrong shape, a layer that does not exist
//! and a file that is not an image, but not bad pixels.
//!
//! ## Processors
//!
//! The pixels of DWA-compressed OpenEXR, and of images with an ICC profile made of tables, differ in the
//! last bits between processors with AVX2, without AVX2, and ARM. So the type of processor is part of the
//! key: machines with different types do not share these items. They share later items if the pixels are
//! equal.

use std::io::Cursor;
use std::path::Path;

use containers::{
    Decoded, ImageHeader, LightTexture, ReadOptions, decoder_level, read_image_header, read_image_until,
    read_light_texture,
};
use engine::{
    Artifact, Context, Failure, ItemFiles, Kind, OrAuto, Output, Port, Product, Steps, choice, parameters,
};
use envmap::{BadPixels, Coverage, Environment, Fill, Image, Layout, check_faces, stack_faces};
use sphere::{Face, LatLong, Rotation};

use super::bad_pixels::{BadPixelsName, repaired};
use super::colour_space_name::ColourSpaceName;
use super::panorama::{FillName, Shown};
use super::source_pictures::{Bytes, SourcePictures, name};
use super::white_balance::{self, GreyCard, WhiteBalance};
use crate::engines::{self, EnginePreset};
use crate::values::{STOPS, UntilStopped, artifacts};

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

parameters! {
    /// Parameters of `import-environment`.
    pub(crate) struct Parameters {
        /// How the sphere is laid out on the image; see Layouts. "auto" takes it from the source: a folder
        /// is a cube, an `envmap` attribute names its layout, a part of the sphere is placed as its file
        /// says, and everything else is lat-long.
        layout: OrAuto<LayoutName> = OrAuto::Auto,
        /// The light of the rest if a picture shows only a part of the sphere: "black"; "mean", the mean of
        /// the picture; "edge", that of the nearest pixel; or linear Rec. 709 radiance, [red, green, blue]
        /// or one number, before `exposure`. See Parts of the sphere.
        fill: FillName = FillName(Fill::Black),
        /// The layer of an OpenEXR file: a part's name, a prefix of channels, or "part.prefix". Default: see
        /// Layers.
        layer: Option<String> = None,
        /// Stops by which the radiance is multiplied: 1 doubles it.
        #[range(STOPS)]
        exposure: f64 = 0.0,
        /// What was white: a temperature in kelvin, or a colour, [red, green, blue]; see White balance.
        white_balance: Option<WhiteBalance> = None,
        /// Where the picture shows a grey card, [left, top, width, height] in pixels: it becomes a grey of
        /// 0.18; see White balance.
        grey_card: Option<GreyCard> = None,
        /// Rows of the result, which has twice as many columns. Default: a lat-long image keeps its size, and
        /// the others keep the density of pixels at the centre of the image or face: half the rows of a
        /// probe, 0.79 times those of a mirror ball, twice those of a cube's face.
        #[range(1..=MOST_ROWS)]
        resolution: Option<usize> = None,
        /// What happens to NaN, infinite and negative values; see Bad pixels.
        bad_pixels: BadPixelsName = BadPixelsName(BadPixels::ZeroNegative),
        /// The primaries of the values: rec709, rec2020, acescg, aces2065-1, p3, prophoto, adobergb or xyz,
        /// or the name of such a space in OCIO or `colorInteropID`; see Colours. Default: as the file says,
        /// or else rec709.
        colour_space: Option<ColourSpaceName> = None,
        /// The engine for which a cube in a texture was made; see Textures. Default: as the file says, or
        /// else the frame of KTX2.
        preset: Option<EnginePreset> = None,
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

    fn manual(text: String) -> String {
        engines::fill_in(&text)
    }

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn processor(_: &Parameters) -> Option<&'static str> {
        Some(decoder_level())
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Environment::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let both = parameters.white_balance.is_some() && parameters.grey_card.is_some();
        both.then(|| ("white-balance", "grey-card measures what was white; remove one of the two".into()))
            .into_iter()
            .collect()
    }

    fn check_source(parameters: &Parameters, context: &Context<'_>) -> Result<(), Failure> {
        let source = context.files.source()?;
        match SourcePictures::find(source, false, wanted(parameters), &context.files)? {
            SourcePictures::One(_) => {
                let header = read_header(source, parameters, &context.files)?;
                let ImageHeader { width, height, openexr_envmap, panorama, .. } = header;
                let within = |failure: Failure| failure.context(format!("cannot import {}", name(source)));
                let wanted = wanted(parameters);
                let shown = Shown::of(wanted, openexr_envmap, panorama, &name(source), &context.reporter);
                match shown.map_err(within)?.coverage {
                    Coverage::Whole(layout) => {
                        layout.check(width, height).map_err(|error| within(error.into()))
                    }
                    Coverage::Part(_) => Ok(()),
                }
            }
            SourcePictures::Faces(_, paths) => {
                let mut sizes = [[0; 2]; Face::ALL.len()];
                for (size, path) in sizes.iter_mut().zip(&paths) {
                    let header = read_header(path, parameters, &context.files)?;
                    *size = [header.width, header.height];
                }
                check_faces(sizes)?;
                Ok(())
            }
            SourcePictures::Texture(bytes) => {
                let (image, layout) = read_texture(source, bytes, parameters, context)?;
                let checked = layout.check(image.width(), image.height());
                checked
                    .map_err(|error| Failure::from(error).context(format!("cannot import {}", name(source))))
            }
        }
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let source = context.files.source()?;
        let (image, shown) = read_source(source, parameters, context)?;
        reporter.check_cancelled()?;
        let image = repaired(image, shown.coverage, parameters.bad_pixels.0, reporter).map_err(|error| {
            let bad = matches!(error, envmap::Error::BadPixels(_));
            let failure = Failure::from(error).context(format!("cannot import {}", name(source)));
            match bad {
                true => failure.help(
                    "bad-pixels = \"zero\" or \"clamp\" replaces them; it is better to repair the image",
                ),
                false => failure,
            }
        })?;
        let factors = white_balance::factors(
            parameters.white_balance,
            parameters.grey_card,
            &image,
            shown.coverage,
            reporter,
        )?;
        let grid = parameters.resolution.map(LatLong::with_rows);
        let mut environment = match shown.coverage {
            Coverage::Whole(layout) => {
                if layout != Layout::LatLong {
                    let LatLong { width, height } =
                        grid.map_or_else(|| layout.default_grid(image.width(), image.height()), Ok)?;
                    reporter.note(format!(
                        "layout {}: {} x {} pixels resampled to {width} x {height}",
                        layout.name(),
                        image.width(),
                        image.height()
                    ));
                }
                Environment::from_image(image, layout, grid)?
            }
            Coverage::Part(part) => {
                shown.report(&part, parameters.fill.0, reporter);
                Environment::from_part(image, &part, parameters.fill.0, grid)?
            }
        };
        reporter.check_cancelled()?;
        if shown.turn != Rotation::IDENTITY {
            environment = reporter.until_stopped(|stop| environment.rotated(shown.turn, stop))?;
        }
        let infinite = |what: String| Failure::new(format!("{what} makes a value infinite"));
        if let Some(factors) = factors {
            environment = environment
                .multiplied(factors)
                .ok_or_else(|| infinite(format!("white balance {factors:?}")))?;
        }
        let environment = environment
            .exposed(parameters.exposure)
            .ok_or_else(|| infinite(format!("exposure {}", parameters.exposure)))?;
        Output::artifact(artifacts::Environment(environment))
    }
}

/// Reads the image of the source, and the layout and turn of its light.
fn read_source(
    source: &Path,
    parameters: &Parameters,
    context: &Context<'_>,
) -> Result<(Image, Shown), Failure> {
    match SourcePictures::find(source, true, wanted(parameters), &context.files)? {
        SourcePictures::One(bytes) => {
            let steps = Steps::new(&context.reporter, 1);
            let decoded = read_picture(source, bytes, parameters, context, &steps)?;
            let Decoded { image, openexr_envmap, panorama, .. } = decoded;
            let shown =
                Shown::of(wanted(parameters), openexr_envmap, panorama, &name(source), &context.reporter);
            let shown =
                shown.map_err(|failure| failure.context(format!("cannot import {}", name(source))))?;
            Ok((image, shown))
        }
        SourcePictures::Faces(files, paths) => {
            let steps = Steps::new(&context.reporter, paths.len());
            let faces =
                paths.iter().map(|path| Ok(read_picture(path, None, parameters, context, &steps)?.image));
            let faces = faces.collect::<Result<Vec<_>, Failure>>()?;
            let faces = <[Image; Face::ALL.len()]>::try_from(faces)
                .map_err(|faces| Failure::new(format!("a cube has six faces, not {}", faces.len())))?;
            check_faces(faces.each_ref().map(|face| [face.width(), face.height()]))?;
            let (faces, arranged) = files.arrange(faces);
            arranged.into_iter().for_each(|note| context.reporter.note(note));
            Ok((stack_faces(faces)?, Shown::whole(Layout::Cube)))
        }
        SourcePictures::Texture(bytes) => {
            let (image, layout) = read_texture(source, bytes, parameters, context)?;
            Ok((image, Shown::whole(layout)))
        }
    }
}

/// The light in a texture, and its layout. `bytes` are those of its file if they were read before.
fn read_texture(
    path: &Path,
    bytes: Option<Bytes>,
    parameters: &Parameters,
    context: &Context<'_>,
) -> Result<(Image, Layout), Failure> {
    let reporter = &context.reporter;
    let within = |failure: Failure| failure.context(format!("cannot import {}", name(path)));
    let bytes = bytes.map_or_else(|| context.files.read(path), Ok)?;
    let read = read_light_texture(&bytes, &parameters.options());
    let LightTexture { mut image, is_cube, is_for_babylon, format, levels, warnings, notes, recipe } =
        read.map_err(|error| within(error.into()))?;
    warnings.iter().for_each(|warning| reporter.warn(format!("{}: {warning}", name(path))));
    notes.iter().for_each(|note| reporter.note(format!("{}: {note}", name(path))));
    let levels = if levels > 1 { format!(", level 0 of {levels}") } else { String::new() };
    if !is_cube {
        reporter.note(format!("{}: {format}, one picture{levels}", name(path)));
        return Ok((image, wanted(parameters).unwrap_or(Layout::LatLong)));
    }
    if let OrAuto::Fixed(LayoutName(layout)) = parameters.layout
        && layout != Layout::Cube
    {
        let message = format!("the file holds a cube, but layout = \"{}\" is not one", layout.name());
        return Err(within(Failure::new(message).help("remove `layout`")));
    }
    let declared = recipe.as_deref().and_then(EnginePreset::of_recipe);
    if let (Some(declared), Some(wanted)) = (declared, parameters.preset)
        && declared != wanted
    {
        let (declared, wanted) = (declared.name, wanted.name);
        reporter.warn(format!(
            "{}: the file was written for {declared}, but is read with preset = \"{wanted}\"",
            name(path)
        ));
    }
    let usual = is_for_babylon.then_some(EnginePreset::BABYLON);
    let preset = parameters.preset.or(declared).or(usual);
    let frame = preset.map_or("the frame of KTX2".into(), |preset| format!("the frame of {}", preset.name));
    reporter.note(format!("{}: {format}, a cube{levels}, in {frame}", name(path)));
    if let Some(preset) = preset {
        let pixels = preset.turned_back(&image);
        image.pixels_mut().copy_from_slice(&pixels);
    }
    Ok((image, Layout::Cube))
}

impl Parameters {
    /// The options that the decoders need.
    fn options(&self) -> ReadOptions {
        ReadOptions { layer: self.layer.clone(), colour_space: self.colour_space.map(|name| name.0) }
    }
}

/// The header of one file.
fn read_header(path: &Path, parameters: &Parameters, files: &ItemFiles<'_>) -> Result<ImageHeader, Failure> {
    read_image_header(&mut files.open(path)?, &parameters.options())
        .map_err(|error| Failure::from(error).context(format!("cannot import {}", name(path))))
}

/// The image of one file, as one of the steps; the messages of its decoder become warnings and notes. `bytes`
/// are those of the file if they were read before.
fn read_picture(
    path: &Path,
    bytes: Option<Bytes>,
    parameters: &Parameters,
    context: &Context<'_>,
    steps: &Steps<'_>,
) -> Result<Decoded, Failure> {
    let reporter = &context.reporter;
    reporter.check_cancelled()?;
    let bytes = bytes.map_or_else(|| context.files.read(path), Ok)?;
    let failed = |failure: Failure| match failure.cancelled {
        true => failure,
        false => failure.context(format!("cannot import {}", name(path))),
    };
    let options = parameters.options();
    // What is wrong with a file is reported by its decoder.
    let blocks =
        read_image_header(&mut Cursor::new(bytes.as_slice()), &options).map_or(0, |header| header.blocks);
    let steps = steps.part(1, blocks);
    let decoded = steps.until_stopped(|stop| read_image_until(&bytes, &options, stop)).map_err(failed)?;
    decoded.warnings.iter().for_each(|warning| reporter.warn(format!("{}: {warning}", name(path))));
    decoded.notes.iter().for_each(|note| reporter.note(format!("{}: {note}", name(path))));
    Ok(decoded)
}

/// The layout that the manifest names.
fn wanted(parameters: &Parameters) -> Option<Layout> {
    match parameters.layout {
        OrAuto::Auto => None,
        OrAuto::Fixed(LayoutName(layout)) => Some(layout),
    }
}
