//! Writes a reflection map: the light that a material reflects, for each direction.
//!
//! ```toml
//! [stage.irradiance]
//! kind = "export-reflection-map"
//! input = "reflection"
//! layout = "cube"
//! resolution = 64
//! path = "{environment}/{material}/reflection"
//! ```
//!
//! A texel in direction w holds the radiance that is reflected when the material's central direction is w.
//! For a phong material that direction is the reflection vector: look the map up by it. For a lambert
//! material it is the surface normal, and the map is an *irradiance map*: with albedo 1 it holds the
//! irradiance divided by pi, which a renderer multiplies by the albedo of a surface.
//!
//! ## Materials that change with the view
//!
//! A plain map has one value for each central direction. For a material whose highlight changes with the
//! view (P > 0) it holds the mean over all views or, with `view = "head-on"`, the reflection of the
//! material itself, not of its series, for a surface viewed straight on (the view, the normal and the
//! reflection vector are the same; for a kajiya-kay material, which is looked up by the tangent, the view
//! is perpendicular to it). Reflected energy that changes with the view is lost: a note reports its share,
//! or a warning if it is above 1 %. `export-shrm` keeps it.
//!
//! ## Two maps
//!
//! A material with a matte base under a highlight cannot be looked up by a single direction, so it gets two
//! maps. `{path}-diffuse` is looked up by the normal, `{path}`, with the highlight, by the reflection
//! vector, and a renderer adds them. Other materials have only `{path}`. With `parts = "together"` one map
//! holds the sum about the reflection vector, so the base shows light from the wrong direction. A note
//! reports the error in stops, or a warning if more than 5 % of the views are off by more than 0.1 stops.
//!
//! ## Lamps
//!
//! Suns and lamps that `project-sh` keeps separate are in the map, exactly: the material reflects the disk
//! of each. If the sun of a game is a separate light, with shadows, it would then count twice. With
//! `lamps = "separate"` the map holds only the rest; `export-sh` with `lamps = "separate"` writes the
//! lights themselves, in the engine's own frame.
//!
//! ## Texels
//!
//! The map is evaluated from coefficients at the centre of each texel. It holds every detail if a lat-long
//! map has more rows than the degree, or the edge of a cube has more texels than two thirds of the degree.
//! Values are linear Rec. 709 radiance. A PNG is tone-mapped with the `filmic` curve of `contact-sheet`,
//! and is only for viewing.
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
//! With the other formats the extension is `.hdr` or `.png`. `import-environment` reads each file back with
//! the same `layout`.
//!
//! ## Negative values
//!
//! If `convolve` chose the degrees, negative values are too small to be visible, and become 0. If you set
//! the degrees, a truncated series rings, and a map of a material that is much sharper than its lighting's
//! degree can contain negative values. A note counts them. OpenEXR keeps them, because they are part of the
//! function; Radiance and PNG cannot hold them: they become 0, with a warning. A `window` of `project-sh`
//! prevents them.

use std::any::Any;

use engine::{Context, Failure, Kind, Output, Port, Product, Reporter, parameters};
use shrm::degrees::BLACK_SHARE;
use shrm::{Plain, Reflection};

use super::map_pictures::{Layout, MapPictures, PictureFormat, endings, texels};
use crate::values::{
    Encoding, ExportedMaps, FileFormat, LampsName, MAX_RESOLUTION, Numbers, PartsName, PlainName, STOPS,
    UntilStopped, artifacts, parts, report_loss,
};

parameters! {
    /// Parameters of `export-reflection-map`.
    pub(crate) struct Parameters {
        /// How the sphere is laid out on the written images; see Files.
        layout: Layout = Layout::LatLong,
        /// Rows of a lat-long map, which has twice as many columns; texels along the edge of a cube's face.
        #[range(1..=MAX_RESOLUTION)]
        resolution: usize = 128,
        /// The container: OpenEXR, Radiance, or a tone-mapped PNG for viewing.
        format: PictureFormat = PictureFormat::Exr,
        /// With format "png": stops by which radiance is multiplied before tone mapping. 0 keeps the
        /// radiance, so that the maps of several environments can be compared.
        #[range(STOPS)]
        exposure: f64 = 0.0,
        /// For a material that changes with the view (P > 0): the mean over all views, or the surface viewed
        /// straight on.
        view: PlainName = PlainName(Plain::Mean),
        /// Whether suns and lamps are in the map or left to the renderer; see Lamps.
        lamps: LampsName = LampsName::Baked,
        /// For a material with a matte base under a highlight: one map for each part, or one for both.
        parts: PartsName = PartsName::Separate,
        ..numbers: Numbers,
    }
}

impl Parameters {
    fn pictures(&self) -> MapPictures {
        MapPictures { layout: self.layout, resolution: self.resolution }
    }

    fn encoding(&self) -> Encoding<PictureFormat> {
        Encoding::new(self.format, self.numbers).with_exposure(self.exposure)
    }
}

/// The kind `export-reflection-map`.
pub(crate) struct ExportReflectionMap;

impl Kind for ExportReflectionMap {
    type Parameters = Parameters;

    const NAME: &'static str = "export-reflection-map";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] =
        &[sh::revisions::TRANSFORM, brdf::revisions::MODELS, shrm::revisions::MEAN_LOBE];
    const TEXT: &'static str = include_str!("export_reflection_map.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Reflection>("reflection")]
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(parts::endings(
            parameters.parts,
            endings(parameters.layout, parameters.format.container()),
        ))
    }

    fn details(parameters: &Parameters) -> Option<Box<dyn Any>> {
        let joins_parts = Some(parameters.parts == PartsName::Together);
        Some(Box::new(ExportedMaps { joins_parts, ..ExportedMaps::default() }))
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        parameters.encoding().check()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let reflection = &context.inputs.get::<artifacts::Reflection>("reflection")?.0;
        parts::note(parameters.parts, reflection, reporter);
        if parameters.parts == PartsName::Together && reflection.parts().is_some() {
            note_lost_together(reflection, parameters.view.0, reporter)?;
        }
        let split = reflection.parts().cloned();
        parts::export(parameters.parts, reflection, split, reporter, |field, _, _| {
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
    let reporter = &context.reporter;
    let PlainName(plain) = parameters.view;
    let shown = match plain {
        Plain::Mean => "the mean over all views",
        Plain::HeadOn => "the surface viewed straight on",
    };
    let lost = reflection.view_dependent_share();
    if lost > 0.0 {
        let what = format!(
            "the reflected energy changes with the view (P = 1 to {}) and is lost: the map holds {shown}",
            reflection.brdf().p().get()
        );
        report_loss(reporter, lost, &what, "export-shrm keeps it");
    }
    let pictures = parameters.pictures();
    let grid = pictures.grid();
    let pixels = match parameters.lamps {
        LampsName::Baked => texels(reflection, plain, grid, &context.derived)?,
        LampsName::Separate => texels(&reflection.clone().without_lamps(), plain, grid, &context.derived)?,
    };
    reporter.check_cancelled()?;
    report_negatives(parameters.format, &pixels, reporter);
    pictures.files(pixels, parameters.encoding(), context)
}

/// The loss in stops at 5 % of the views from which it is a warning.
const SHOWS: f64 = 0.1;

/// Notes what one map of both parts loses.
fn note_lost_together(reflection: &Reflection, plain: Plain, reporter: &Reporter) -> Result<(), Failure> {
    let dark = BLACK_SHARE * reflection.light_mean();
    let samples = reporter.until_stopped(|stop| reflection.samples(stop))?;
    let lost = reflection.plain_samples(plain).error(&samples, dark);
    let found = format!(
        "95 % of the views of a ball are within {:.2} stops of both parts, 99 % within {:.2}",
        lost.p95, lost.p99
    );
    if lost.p95 > SHOWS {
        reporter
            .warn(format!("{found}: the matte base shows light from the wrong direction; leave out `parts`"));
    } else {
        reporter.note(found);
    }
    Ok(())
}

/// Reports how many values are negative because of ringing.
fn report_negatives(format: PictureFormat, pixels: &[[f32; 3]], reporter: &Reporter) {
    let values = || pixels.as_flattened().iter().copied();
    let negative = values().filter(|value| *value < 0.0).count();
    if negative == 0 {
        return;
    }
    let (least, total) = (values().fold(0.0, f32::min), values().count());
    let written = match format {
        PictureFormat::Exr => "a renderer that clamps them shows black",
        PictureFormat::Rgbe | PictureFormat::Png => "written as 0",
    };
    let what =
        format!("the values are negative, down to {least:.3e}, because the series is truncated: {written}");
    let help = "leave out `degree` and `tolerance` in project-brdf and project-sh, or set window = \"hanning\" \
                in convolve";
    report_loss(reporter, negative as f64 / total as f64, &what, help);
}
