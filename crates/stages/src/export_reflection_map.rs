//! Writes a reflection map: the light that a material reflects, per direction.
//!
//! A texel in direction w holds the radiance that is reflected when the material's central direction is w.
//! For a phong material that direction is the reflection vector: look the map up by it. For a lambert
//! material it is the surface normal, and the map is an *irradiance map*: with albedo 1 it holds the
//! irradiance divided by pi, which is what a renderer multiplies by a surface's albedo.
//!
//! ## Materials that change with the view
//!
//! A plain map has one value for each central direction. For a material whose highlight changes with the view
//! (P > 0) it holds the mean over all views or, with `view = "head-on"`, what is seen when the surface is
//! viewed straight on (the view, the normal and the reflection vector are one; a kajiya-kay material is
//! looked up by the tangent, and the view is at a right angle to it). The share of the
//! reflected energy that changes with the view is lost: a note says how much it is, or above 1 % a warning.
//! `export-shrm` keeps it.
//!
//! ## Two maps
//!
//! A material with a matte base under a highlight has no one direction to look a map up by. It gets two:
//! `{path}-diffuse` is looked up by the normal, `{path}`, with the highlight, by the reflection vector, and a
//! renderer adds them. Other materials have no such file. With `parts = "together"` one map holds the sum
//! about the reflection vector, where the base shows the light of the wrong direction. A note says by how
//! many stops, or a warning if more than 5 % of the views are off by more than 0.1 stops.
//!
//! ## Lamps
//!
//! Suns and lamps that `project-sh` keeps beside its series are in the map, exactly: each adds what the
//! material reflects of its disk. A game whose sun is a light of its own, with shadows, would then have it
//! twice. With `lamps = "separate"` the map holds the rest alone; `export-sh` with `lamps = "separate"`
//! writes the lights themselves, in the engine's own frame.
//!
//! ## Texels
//!
//! The map is evaluated from coefficients at the centre of each texel. It holds every detail if a lat-long
//! map has more rows than the degree, or the edge of a cube has more texels than two thirds of the degree.
//! Values are linear Rec. 709 radiance; a PNG holds them tone-mapped, by the `filmic` curve of
//! `contact-sheet`, and is for looking only.
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
//! With the other formats the ending is `.hdr` or `.png`. `import-environment` reads each file back with the
//! same `layout`.
//!
//! ## Negative values
//!
//! If `convolve` chose the degrees, what is negative is too little to be seen, and becomes 0. With degrees of
//! yours a truncated series rings, so that a map of a material that is much sharper than its lighting's
//! degree can hold negative values. A note counts them. OpenEXR keeps them, because they are part of the
//! function; Radiance and PNG cannot hold them: they become 0, with a warning. A `window` of `project-sh`
//! prevents them.
//!
//! ## Values past the largest half
//!
//! A half holds numbers up to 65504. If a value exceeds that, all files of the map have 32-bit floats, and a
//! note says so. With `precision = "half"` larger values, of either sign, become +-65504, and a warning says
//! which share of the red, green and blue light is lost. With `overflow = "error"` the item fails instead.
//!
//! ## Example
//!
//! ```toml
//! [stage.irradiance]
//! kind = "export-reflection-map"
//! input = "reflection"
//! layout = "cube"
//! resolution = 64
//! path = "{environment}/{material}/reflection"
//! ```

use containers::{Encoded, Precision, write_exr, write_png, write_rgbe};
use engine::{Context, Failure, Kind, Output, Port, Product, choice, parameters};
use envmap::{Image, ToneMap, to_srgb8};
use sh::{Synthesis, energy_per_degree, lambda, synthesise_cube};
use shrm::degrees::DARK;
use shrm::{MapGrid, Plain, Reflection};
use sphere::{Cube, Face, LatLong};

use crate::artifacts;
use crate::choices::{LampsName, MOST, Overflow, PrecisionName, STOPS};
use crate::overflow::{self, Content};
use crate::parts::{self, PartsName};
use crate::share::report_loss;

choice! {
    /// Which map represents a material that changes with the view.
    pub(crate) enum PlainName: Plain {
        /// The mean over all views.
        Mean = "mean",
        /// The surface viewed straight on.
        HeadOn = "head-on",
    }
}

choice! {
    /// How the sphere lies on the written images.
    pub(crate) enum Layout {
        /// One image of latitude and longitude.
        LatLong = "lat-long",
        /// Six files.
        Cube = "cube",
        /// One image, faces below each other.
        CubeStrip = "cube-strip",
        /// One image, faces unfolded.
        CubeCross = "cube-cross",
    }
}

choice! {
    /// The container of the written images.
    pub(crate) enum Format {
        /// OpenEXR.
        Exr = "exr",
        /// Radiance.
        Rgbe = "rgbe",
        /// PNG, tone-mapped.
        Png = "png",
    }
}

parameters! {
    /// Parameters of `export-reflection-map`.
    pub(crate) struct Parameters {
        /// How the sphere lies on the written images; see Files.
        layout: Layout = Layout::LatLong,
        /// Rows of a lat-long map, which has twice as many columns; texels along the edge of a cube's face.
        #[range(1..=MOST)]
        resolution: usize = 128,
        /// The container: OpenEXR, Radiance, or a tone-mapped PNG for looking.
        format: Format = Format::Exr,
        /// With format "exr": 16-bit or 32-bit numbers. A half holds 3 digits, up to 65504; "auto" is half
        /// unless a value exceeds that.
        precision: PrecisionName = PrecisionName::Auto,
        /// What happens to values past 65504 if the file is to be of halves; see Values past the largest
        /// half.
        overflow: Overflow = Overflow::Clamp,
        /// With format "png": stops by which radiance is multiplied before tone mapping. 0 is the radiance
        /// as it is, so that the maps of several environments can be compared.
        #[range(STOPS)]
        exposure: f64 = 0.0,
        /// For a material that changes with the view (P > 0): the mean over all views, or the surface viewed
        /// straight on.
        view: PlainName = PlainName(Plain::Mean),
        /// Whether suns and lamps are in the map or left to the renderer; see Lamps.
        lamps: LampsName = LampsName::Baked,
        /// The maps of a material with a matte base under a highlight: one for each part, or one for both.
        parts: PartsName = PartsName::Separate,
    }
}

/// The kind `export-reflection-map`.
pub(crate) struct ExportReflectionMap;

impl Kind for ExportReflectionMap {
    type Parameters = Parameters;

    const NAME: &'static str = "export-reflection-map";
    const REVISION: u32 = 6;
    const KERNELS: &'static [u32] = &[sh::revisions::TRANSFORM, brdf::revisions::MODELS];
    const TEXT: &'static str = include_str!("export_reflection_map.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Reflection>("reflection")]
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        let extension = match parameters.format {
            Format::Exr => ".exr",
            Format::Rgbe => ".hdr",
            Format::Png => ".png",
        };
        let files = match parameters.layout {
            Layout::Cube => Face::ALL.map(|face| format!("/{}{extension}", face.name())).into(),
            _ => vec![extension.to_owned()],
        };
        Product::Files(parts::endings(parameters.parts, files))
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let is_exr = parameters.format == Format::Exr;
        let mut errors = Vec::new();
        if parameters.exposure != 0.0 && parameters.format != Format::Png {
            errors.push(("exposure", "only format = \"png\" uses it".into()));
        }
        errors.extend(overflow::check(parameters.overflow, parameters.precision, is_exr));
        if parameters.precision != PrecisionName::Auto && !is_exr {
            errors.push(("precision", "only format = \"exr\" uses it".into()));
        }
        errors
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reflection = &context.get::<artifacts::Reflection>("reflection")?.0;
        parts::note(parameters.parts, reflection, context);
        if parameters.parts == PartsName::Together && reflection.parts().is_some() {
            note_lost_together(reflection, parameters.view.0, context);
        }
        let split = reflection.parts().cloned();
        parts::export(parameters.parts, reflection, split, context, |field, _, _| {
            files(parameters, field, context)
        })
    }
}

/// The files of one map.
fn files(
    parameters: &Parameters,
    reflection: &Reflection,
    context: &Context<'_>,
) -> Result<Vec<Vec<u8>>, Failure> {
    let PlainName(plain) = parameters.view;
    let shown = match plain {
        Plain::Mean => "the mean over all views",
        Plain::HeadOn => "the surface viewed straight on",
    };
    let lost = view_dependent_share(reflection);
    if lost > 0.0 {
        let what = format!(
            "the reflected energy changes with the view (P = 1 to {}) and is lost: the map holds {shown}",
            reflection.brdf().p().get()
        );
        report_loss(context, lost, &what, "export-shrm keeps it");
    }
    let pixels = match parameters.lamps {
        LampsName::Baked => texels(reflection, plain, grid(parameters))?,
        LampsName::Separate => texels(&reflection.clone().without_lamps(), plain, grid(parameters))?,
    };
    context.check_cancelled()?;
    report_negatives(parameters.format, &pixels, context);
    encoded(parameters, pixels, context)
}

/// Stops at 5 % of the views from which a loss is a warning.
const SHOWS: f64 = 0.1;

/// Says what one map of both parts loses.
fn note_lost_together(reflection: &Reflection, plain: Plain, context: &Context<'_>) {
    let dark = DARK * reflection.light_mean();
    let lost = reflection.plain_samples(plain).error(&reflection.samples(), dark);
    let found = format!(
        "95 % of the views of a ball are within {:.2} stops of both parts, 99 % within {:.2}",
        lost.p95, lost.p99
    );
    if lost.p95 > SHOWS {
        context.warn(format!(
            "{found}: the matte base shows the light of the wrong direction; leave out `parts`"
        ));
    } else {
        context.note(found);
    }
}

/// The files of a map's texels, of a kind that writes no others.
pub(crate) fn write(
    parameters: &Parameters,
    pixels: Vec<[f32; 3]>,
    context: &Context<'_>,
) -> Result<Output, Failure> {
    Ok(Output::Files(encoded(parameters, pixels, context)?))
}

/// The files of a map's texels.
fn encoded(
    parameters: &Parameters,
    pixels: Vec<[f32; 3]>,
    context: &Context<'_>,
) -> Result<Vec<Vec<u8>>, Failure> {
    let precision = match parameters.format {
        Format::Exr => {
            let choice = (parameters.precision, parameters.overflow);
            overflow::precision(&pixels, Content::Light(grid(parameters)), choice, context)?
        }
        Format::Rgbe | Format::Png => Precision::Float,
    };
    let images = arrange(parameters, pixels)?;
    let files = images.iter().map(|image| encode(parameters, precision, image, context.recipe()));
    files.map(|file| Ok(file?.bytes)).collect()
}

/// The share of the energy of the reflected field that has p > 0; 0 for a black one.
///
/// The energy of B_lmpq over central directions and views is Lambda_l^2 |L_lm|^2 |rho_lpq|^2, summed over
/// both signs of q.
fn view_dependent_share(reflection: &Reflection) -> f64 {
    let (mut dependent, mut total) = (0.0, 0.0);
    let (brdf, light) = (reflection.brdf(), energy_per_degree(reflection.lighting()));
    for (l, light) in light.iter().enumerate() {
        for p in 0..=brdf.p().get() {
            for q in 0..=p {
                let rho = brdf.get(l, p, q);
                let signs = if q == 0 { 1.0 } else { 2.0 };
                let energy: f64 =
                    (0..3).map(|c| light[c] * math::powi(lambda(l) * rho[c], 2)).sum::<f64>() * signs;
                total += energy;
                dependent += if p > 0 { energy } else { 0.0 };
            }
        }
    }
    if total > 0.0 { dependent / total } else { 0.0 }
}

/// One map of a reflection, with the lamps beside it, at the texels of a grid.
pub(crate) fn texels(reflection: &Reflection, plain: Plain, grid: MapGrid) -> Result<Vec<[f32; 3]>, Failure> {
    let field = reflection.plain(plain);
    let mut pixels: Vec<[f32; 3]> = match grid {
        MapGrid::LatLong(grid) => Synthesis::new(grid, field.degree())?.synthesise(&field),
        MapGrid::Cube(cube) => synthesise_cube(&field, cube)?,
    };
    if let Some(lamps) = reflection.lamps() {
        for (pixel, lamps) in pixels.iter_mut().zip(lamps.plain(plain, grid)) {
            (0..3).for_each(|channel| pixel[channel] += lamps[channel]);
        }
    }
    if reflection.is_for_light() {
        pixels.iter_mut().for_each(|pixel| *pixel = pixel.map(|value| value.max(0.0)));
    }
    Ok(pixels)
}

/// The texels that a layout shows.
pub(crate) fn grid(parameters: &Parameters) -> MapGrid {
    match parameters.layout {
        Layout::LatLong => MapGrid::LatLong(LatLong::with_rows(parameters.resolution)),
        Layout::Cube | Layout::CubeStrip | Layout::CubeCross => {
            MapGrid::Cube(Cube { edge: parameters.resolution })
        }
    }
}

/// The images of the texels' values.
fn arrange(parameters: &Parameters, pixels: Vec<[f32; 3]>) -> Result<Vec<Image>, Failure> {
    let resolution = parameters.resolution;
    match parameters.layout {
        Layout::LatLong => Ok(vec![image(2 * resolution, resolution, pixels)?]),
        Layout::Cube => {
            let faces = pixels.chunks_exact(resolution * resolution);
            faces.map(|face| image(resolution, resolution, face.to_vec())).collect()
        }
        Layout::CubeCross => Ok(vec![cross(Cube { edge: resolution }, &pixels)?]),
        // Six faces below each other are a strip.
        Layout::CubeStrip => Ok(vec![image(resolution, 6 * resolution, pixels)?]),
    }
}

/// The vertical cross: each pixel has the value of the texel in the same direction.
fn cross(cube: Cube, pixels: &[[f32; 3]]) -> Result<Image, Failure> {
    let edge = cube.edge;
    let (width, height) = (3 * edge, 4 * edge);
    let texel = |position: f64| ((position * edge as f64) as usize).min(edge - 1);
    let at = |index: usize| {
        let looks = envmap::Layout::CubeCross.direction(width, height, index / width, index % width);
        looks.map_or([0.0; 3], |direction| {
            let (face, s, t) = cube.position(direction);
            pixels[(face as usize * edge + texel(t)) * edge + texel(s)]
        })
    };
    image(width, height, (0..width * height).map(at).collect())
}

/// A picture of these pixels.
pub(crate) fn image(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Result<Image, Failure> {
    let found = pixels.len();
    Image::new(width, height, pixels)
        .ok_or_else(|| Failure::new(format!("{found} pixels do not fill {width} x {height}")))
}

/// Reports how many values are negative because of ringing.
fn report_negatives(format: Format, pixels: &[[f32; 3]], context: &Context<'_>) {
    let values = || pixels.as_flattened().iter().copied();
    let negative = values().filter(|value| *value < 0.0).count();
    if negative == 0 {
        return;
    }
    let (least, total) = (values().fold(0.0, f32::min), values().count());
    let written = match format {
        Format::Exr => "black where a renderer clamps them",
        Format::Rgbe | Format::Png => "written as 0",
    };
    let what =
        format!("the values are negative, the least is {least:.3e}, because the series is cut: {written}");
    let help = "leave out `degree` in project-brdf and project-sh, or set window = \"hanning\" in convolve";
    report_loss(context, negative as f64 / total as f64, &what, help);
}

/// The file of an image.
fn encode(
    parameters: &Parameters,
    precision: Precision,
    image: &Image,
    recipe: &str,
) -> Result<Encoded, Failure> {
    let recipe = Some(recipe);
    match parameters.format {
        Format::Exr => Ok(write_exr(image, precision, recipe)?),
        Format::Rgbe => Ok(write_rgbe(image, recipe)?),
        Format::Png => {
            let codes = to_srgb8(image.pixels(), parameters.exposure, ToneMap::Filmic);
            Ok(Encoded {
                bytes: write_png(image.width(), image.height(), &codes, recipe)?,
                ..Encoded::default()
            })
        }
    }
}
