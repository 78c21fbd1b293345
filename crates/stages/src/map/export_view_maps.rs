//! Writes explicit reflection maps for T x T views, the whole reflected light field as a table.
//!
//! ```toml
//! [stage.view-maps]
//! kind = "export-view-maps"
//! input = "reflection"
//! views = 9
//! resolution = 32
//! path = "{environment}/{material}/view-maps"
//! ```
//!
//! Each map is a plain reflection map for one view, so a renderer without spherical harmonics can show a
//! material that changes with the view, to any accuracy that the disk has space for (Ramamoorthi and
//! Hanrahan 2002; [RH02, sec. 5.2 and app. C]). It is the largest export: T x T maps, compared with the
//! (P+1)^2 coefficients of `export-shrm`.
//!
//! The views are the texels of a lat-long image of T rows and T columns, theta_j = pi (j + 0.5) / T and
//! phi_k = 2 pi (0.5 - (k + 0.5) / T), in the order of its pixels. A renderer interpolates bilinearly
//! between them, as in such an image; beyond a pole the same row continues half a turn away, which for an
//! odd T is half-way between two columns. With T = 2 P + 1 `import-reflection-maps` can recover a field of
//! degree P completely; for bilinear interpolation without visible error, use about 10 P.
//!
//! | `view` | the views are | |
//! | --- | --- | --- |
//! | `global` | V in the world | each map is smooth over the sphere: look up the maps around V with one central direction |
//! | `local` | w_o = R^-1 V in the frame R = R_z(beta) R_y(alpha) of the texel at (alpha, beta) | the table B(alpha, beta, theta_o, phi_o) of [RH02, sec. 3.2]; frames turn around the poles, so each texel of a look-up needs its own w_o, and maps must not be filtered |
//!
//! The input is a reflection, which is evaluated at each texel, or an SHRM. An SHRM is used unchanged if it
//! has the same layout and resolution; otherwise it is interpolated, with a note. With
//! `resolution = "auto"`, the default, a reflection gets the lowest resolution for which interpolation has
//! an error of 1 %, and an SHRM keeps its own. Each value takes O(P) operations.
//!
//! ## Files
//!
//! After the item's `path`, a folder that holds
//!
//! | `format` | files |
//! | --- | --- |
//! | `ktx2`, `dds` | `/maps.ktx2` or `/maps.dds`: an array of T x T layers, of 2D images or of cubes |
//! | `exr` | `/view-000.exr` ...: a picture for each view; the six faces of a cube are stacked |
//!
//! and finally `/view-maps.json`, the index: the file, layer and view of each map, how to look up a
//! direction, and how to interpolate. The manual of `import-reflection-maps` lists its members.
//!
//! A material with a matte base under a highlight gets two such folders: `{path}-diffuse` has the maps of
//! the base, looked up by the normal, and `{path}` those of the highlight; a renderer adds both. With
//! `parts = "together"` one folder holds the sum, about the reflection vector.

use engine::{Context, Failure, Kind, Output, Port, Product, Steps, parameters};
use shrm::{MapLayout, MapViews, View};

use super::map_input;
use super::map_source::{MapSource, SetFiles};
use crate::values::{
    Encoding, MAX_RESOLUTION, MapLayoutName, MapsFormat, Numbers, PartsName, Resolution, ViewName, parts,
};

parameters! {
    /// Parameters of `export-view-maps`.
    pub(crate) struct Parameters {
        /// T: there are maps for T x T views.
        #[range(1..=64)]
        views: usize = 9,
        /// The frame in which the views are given; see the table.
        view: ViewName = ViewName(View::Global),
        /// The layout of a map's texels.
        layout: MapLayoutName = MapLayoutName(MapLayout::Cube),
        /// Edge of a cube's face; rows of a lat-long map, which has twice as many columns. Default: "auto".
        #[range(1..=MAX_RESOLUTION)]
        resolution: Option<Resolution> = None,
        /// The container: a KTX2 or DDS array, or an OpenEXR picture for each view.
        format: MapsFormat = MapsFormat::Ktx2,
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

/// The kind `export-view-maps`.
pub(crate) struct ExportViewMaps;

impl Kind for ExportViewMaps {
    type Parameters = Parameters;

    const NAME: &'static str = "export-view-maps";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = map_input::KERNELS;
    const TEXT: &'static str = include_str!("export_view_maps.rs");

    fn ports() -> Vec<Port> {
        vec![MapSource::port()]
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        let files = set_files(parameters).endings(parameters.views * parameters.views);
        Product::Files(parts::endings(parameters.parts, files))
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
    let (ViewName(view), MapLayoutName(layout)) = (parameters.view, parameters.layout);
    let map = source.map(layout, parameters.resolution, view, reporter)?;
    let side = parameters.views;
    let set =
        source.view_set(&map.0, MapViews::Table { side, view }, Some("views"), &context.derived, steps)?;
    if side < 2 * source.p() + 1 {
        reporter.note(format!(
            "{side} x {side} views hold P = {}; the field has P = {}, for which views = {} is enough",
            (side - 1) / 2,
            source.p(),
            2 * source.p() + 1
        ));
    }
    set_files(parameters).encode(&set, source, context)
}

/// The files that the parameters ask for.
fn set_files(parameters: &Parameters) -> SetFiles {
    let picture = |view: usize| format!("view-{view:03}");
    SetFiles { method: "view-maps", encoding: parameters.encoding(), texture: "maps", picture }
}
