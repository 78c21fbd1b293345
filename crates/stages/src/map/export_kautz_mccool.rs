//! Writes Kautz and McCool's 3D texture: a reflection map for each angle between central direction and view.
//!
//! ```toml
//! [stage.kautz-mccool]
//! kind = "export-kautz-mccool"
//! input = "reflection"
//! resolution = 64
//! slices = 16
//! path = "{environment}/{material}/kautz-mccool"
//! ```
//!
//! A material whose highlight looks the same from all around its central direction (for most materials the
//! reflection vector R) needs one more dimension than a reflection map: the angle theta_o between R and the
//! view (Kautz and McCool 2000). Slice k of the texture is the reflection map at the angle theta_k
//! (Ramamoorthi and Hanrahan 2002, appendix C):
//!
//! > B(alpha, beta, theta_o) = sum over p of B_p0(alpha, beta) Y_p0(theta_o).
//!
//! For any other material the texture holds the mean around R: the terms with q > 0 are lost, and a warning
//! reports their share of the energy. `export-shrm` keeps them.
//!
//! The angle between R and the view is twice that between the normal and the view: theta_o = 0 is the surface
//! seen head on, and pi is grazing. For materials about a normal or a tangent theta_o is the angle to that;
//! about a normal, only angles up to pi / 2 are visible.
//!
//! The input is a reflection, which is evaluated at each texel, or an SHRM. An SHRM is used unchanged if it
//! is lat-long and has this resolution; otherwise it is interpolated, with a note. With
//! `resolution = "auto"`, the default, a reflection gets the fewest rows for which interpolation has an
//! error of 1 %, and an SHRM keeps its own.
//!
//! ## Files
//!
//! After the item's `path`, a folder that holds
//!
//! | `format` | files |
//! | --- | --- |
//! | `dds`, `ktx2` | `/texture.dds` or `/texture.ktx2`: a volume, one slice for each angle |
//! | `exr` | `/slice-00.exr` ...: a picture for each angle |
//!
//! and finally `/kautz-mccool.json`, the index: the file and angle of each slice, how to look up a
//! direction, and how to interpolate. Slices are lat-long, twice as wide as high, with the centre along +X,
//! because a 3D texture has only two axes for the central direction. The angles are evenly spaced, theta_k
//! = pi k / (slices - 1), both ends included, so a linear 3D filter interpolates them at w = (theta_o / pi
//! (slices - 1) + 0.5) / slices.
//!
//! A material with a matte base under a highlight gets two such folders: `{path}-diffuse` has the maps of
//! the base, looked up by the normal, and `{path}` those of the highlight; a renderer adds both. With
//! `parts = "together"` one folder holds the sum, about the reflection vector.

use std::any::Any;

use engine::{Context, Failure, Kind, Output, Port, Product, Steps, parameters};
use shrm::{MapLayout, MapViews, View, azimuthal_share};

use super::map_input;
use super::map_source::{MapSource, SetFiles};
use crate::values::{
    Encoding, ExportedMaps, MAX_RESOLUTION, MapsFormat, Numbers, PartsName, Resolution, UntilStopped,
    edge_of, parts, report_loss,
};

parameters! {
    /// Parameters of `export-kautz-mccool`.
    pub(crate) struct Parameters {
        /// Rows of a slice, which has twice as many columns. Default: "auto".
        #[range(1..=MAX_RESOLUTION)]
        resolution: Option<Resolution> = None,
        /// The number of angles. A field of degree P can be recovered from P + 1 slices, but needs several
        /// times as many to look smooth when interpolated.
        #[range(2..=256)]
        slices: usize = 16,
        /// The container: a DDS or KTX2 volume, or an OpenEXR picture for each slice.
        format: MapsFormat = MapsFormat::Dds,
        /// For a material with a matte base under a highlight: one map for each part, or one for both.
        parts: PartsName = PartsName::Separate,
        ..numbers: Numbers,
    }
}

impl Parameters {
    fn encoding(&self) -> Encoding<MapsFormat> {
        Encoding::new(self.format, self.numbers)
    }
}

/// The kind `export-kautz-mccool`.
pub(crate) struct ExportKautzMcCool;

impl Kind for ExportKautzMcCool {
    type Parameters = Parameters;

    const NAME: &'static str = "export-kautz-mccool";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = map_input::KERNELS;
    const TEXT: &'static str = include_str!("export_kautz_mccool.rs");

    fn ports() -> Vec<Port> {
        vec![MapSource::port()]
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        let files = set_files(parameters).endings(parameters.slices);
        Product::Files(parts::endings(parameters.parts, files))
    }

    fn details(parameters: &Parameters) -> Option<Box<dyn Any>> {
        let edge = edge_of(parameters.resolution, MapLayout::LatLong);
        let joins_parts = Some(parameters.parts == PartsName::Together);
        let slices = Some(parameters.slices);
        Some(Box::new(ExportedMaps { edge, slices, joins_parts, ..ExportedMaps::default() }))
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        parameters.encoding().check()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        MapSource::of(&context.inputs)?.export(parameters.parts, &context.reporter, |source, _, steps| {
            files(parameters, source, context, steps)
        })
    }
}

/// The files of one field.
fn files(
    parameters: &Parameters,
    source: &MapSource,
    context: &Context<'_>,
    steps: &Steps<'_>,
) -> Result<Vec<Vec<u8>>, Failure> {
    let reporter = &context.reporter;
    let map = source.map(MapLayout::LatLong, parameters.resolution, View::Local, reporter)?;
    let lost = reporter.until_stopped(|stop| azimuthal_share(&map.0, source.lamps(), stop))?;
    // Rounding leaves a share of some 1e-14 in a map that was turned.
    if lost > 1e-9 {
        let what =
            "the reflected energy changes around the central direction (q > 0) and is lost in a 3D texture";
        report_loss(reporter, lost, what, "export-shrm keeps it");
    }
    if parameters.slices <= source.p() {
        reporter.note(format!(
            "{} slices hold P = {}; the field has P = {}",
            parameters.slices,
            parameters.slices - 1,
            source.p()
        ));
    }
    let views = MapViews::even_angles(parameters.slices);
    let set = source.view_set(&map.0, views, Some("slices"), &context.derived, steps)?;
    set_files(parameters).encode(&set, source, context)
}

/// The files that the parameters ask for.
fn set_files(parameters: &Parameters) -> SetFiles {
    let picture = |slice: usize| format!("slice-{slice:02}");
    SetFiles { method: "kautz-mccool", encoding: parameters.encoding(), texture: "texture", picture }
}
