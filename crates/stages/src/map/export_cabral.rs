//! Writes Cabral's maps: twelve reflection maps, one for each vertex of an icosahedron as the view.
//!
//! ```toml
//! [stage.cabral]
//! kind = "export-cabral"
//! input = "reflection"
//! layout = "cube"
//! resolution = 64
//! path = "{environment}/{material}/cabral"
//! ```
//!
//! A renderer that can look up a reflection map can show a material that changes with the view by blending
//! three of twelve (Cabral, Olano and Nemec 1999). Map k holds the radiance toward the view V_k for every
//! central direction of the surface (Ramamoorthi and Hanrahan 2002, equation 12). For most materials that is
//! the reflection vector R: all maps are looked up at the R of the pixel, with no warp between them.
//!
//! Twelve views represent a field up to P = 2 in the view. Reflected energy beyond that blurs or is lost
//! between the vertices: a note reports its share, or a warning if it is above 1 %. `export-shrm` keeps all
//! of it in fewer numbers.
//!
//! The input is a reflection, which is evaluated at each texel, or an SHRM. An SHRM is used unchanged if it
//! has the same layout and resolution; otherwise it is interpolated, with a note. With
//! `resolution = "auto"`, the default, a reflection gets the lowest resolution for which interpolation has
//! an error of 1 %, and an SHRM keeps its own.
//!
//! ## Files
//!
//! After the item's `path`, a folder: `/view-00.exr` to `/view-11.exr` (or `.hdr`, `.dds`), and last
//! `/cabral.json`.
//!
//! | `layout` | one file holds |
//! | --- | --- |
//! | `cube` | six faces +X -X +Y -Y +Z -Z, stacked in a picture, or the faces of a cube map in DDS |
//! | `lat-long` | an image twice as wide as high, its centre along +X |
//! | `sphere` | the image of a mirror ball seen from the view V_k: the centre is R = V_k, the whole rim is R = -V_k |
//!
//! Vertex 0 is +Z and vertex 11 is -Z. Vertices 1 to 5 lie at z = 1 / sqrt(5), at azimuths 0, 72, 144, 216
//! and 288 degrees; vertices 6 to 10 at z = -1 / sqrt(5), at azimuths 36, 108, 180, 252 and 324 degrees.
//!
//! In a sphere map up is toward +Z (against theta of the view) and right is along phi; for the views +-Z phi
//! is 0. The radius is sin(t / 2) at the angle t from the centre. Texels outside the disk repeat the rim.
//!
//! The rim of a ball is coarse: with 96 x 96 texels, look-ups within 30 degrees of -V_k have at least 20
//! times the error of the middle. Prefer `cube` if the renderer supports it.
//!
//! A material with a matte base under a highlight gets two such folders: `{path}-diffuse` has the maps of
//! the base, looked up by the normal, and `{path}` those of the highlight; a renderer adds both. With
//! `parts = "together"` one folder holds the sum, about the reflection vector.
//!
//! ## The index
//!
//! `/cabral.json` holds everything that a renderer needs: for each map its file and view (in Specula's
//! frame and, with +Y up, in the file frame) and the axes of sphere maps; the twenty triangles; how to look
//! up a direction; and how to blend. The manual of `import-reflection-maps` lists its members. To blend,
//! find the triangle (a, b, c) that contains the view V; then
//!
//! > w_a = V.(b x c), w_b = V.(c x a), w_c = V.(a x b), divided by their sum
//!
//! are the weights of the three maps, and are not negative.
//!
//! ## Numbers
//!
//! A truncated series can have negative values. RGBE cannot hold them, so they become 0, with a warning.
//! For the other formats, use `precision` and `overflow`.

use std::any::Any;
use std::f64::consts::FRAC_PI_4;
use std::sync::Arc;

use containers::{Encoded, Texture};
use engine::{Context, Failure, Kind, Output, Port, Product, Reporter, Steps, choice, parameters};
use shrm::{
    MapGrid, MapLayout, MapViews, Shrm, Terms, View, add_to_sphere_maps, icosahedron, sphere_map_axes,
    sphere_map_rows, sphere_maps,
};
use sphere::LatLong;

use super::map_index::{Entry, FileLayout, NewIndex};
use super::map_input::ERROR;
use super::map_source::MapSource;
use super::{map_input, map_source};
use crate::values::{
    Container, Content, Encoding, ExportedMaps, FileFormat, MAX_RESOLUTION, Numbers, PartsName, Resolution,
    UntilStopped, artifacts, edge_of, parts, report_loss,
};

choice! {
    /// How the sphere of central directions lies on a file.
    pub(crate) enum CabralLayout: FileLayout {
        /// Six faces.
        Cube = "cube",
        /// Latitude and longitude.
        LatLong = "lat-long",
        /// A mirror ball seen from the view.
        Sphere = "sphere",
    }
}

choice! {
    /// The container of the maps.
    pub(crate) enum CabralFormat {
        /// OpenEXR.
        Exr = "exr",
        /// Radiance.
        Rgbe = "rgbe",
        /// DirectDraw surfaces.
        Dds = "dds",
    }
}

impl FileFormat for CabralFormat {
    fn container(self) -> Container {
        match self {
            Self::Exr => Container::Exr,
            Self::Rgbe => Container::Rgbe,
            Self::Dds => Container::Dds,
        }
    }
}

parameters! {
    /// Parameters of `export-cabral`.
    pub(crate) struct Parameters {
        /// How the sphere of central directions is laid out in a file; see Files.
        layout: CabralLayout = CabralLayout(FileLayout::Cube),
        /// Texels along the edge of a cube's face or of a sphere map, rows of a lat-long map. Default:
        /// "auto".
        #[range(1..=MAX_RESOLUTION)]
        resolution: Option<Resolution> = None,
        /// The container: OpenEXR, Radiance, or DDS for engines.
        format: CabralFormat = CabralFormat::Exr,
        /// For a material with a matte base under a highlight: one map for each part, or one for both.
        parts: PartsName = PartsName::Separate,
        ..numbers: Numbers,
    }
}

impl Parameters {
    fn encoding(&self) -> Encoding<CabralFormat> {
        Encoding::new(self.format, self.numbers)
    }
}

/// The kind `export-cabral`.
pub(crate) struct ExportCabral;

impl Kind for ExportCabral {
    type Parameters = Parameters;

    const NAME: &'static str = "export-cabral";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = map_input::KERNELS;
    const TEXT: &'static str = include_str!("export_cabral.rs");

    fn ports() -> Vec<Port> {
        vec![MapSource::port()]
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        let maps = (0..12).map(|vertex| format!("/{}", file(vertex, parameters.format)));
        let files = maps.chain(["/cabral.json".to_owned()]).collect();
        Product::Files(parts::endings(parameters.parts, files))
    }

    fn details(parameters: &Parameters) -> Option<Box<dyn Any>> {
        let layout = match parameters.layout.0 {
            FileLayout::Cube => MapLayout::Cube,
            FileLayout::LatLong | FileLayout::Sphere => MapLayout::LatLong,
        };
        let edge = edge_of(parameters.resolution, layout);
        let joins_parts = Some(parameters.parts == PartsName::Together);
        Some(Box::new(ExportedMaps { edge, joins_parts, ..ExportedMaps::default() }))
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
    let vertices = icosahedron::vertices();
    // The lamps, and the files.
    let work = steps.part(1, 2);
    let on_grid = |layout| -> Result<_, Failure> {
        let map = source.map(layout, parameters.resolution, View::Local, reporter)?;
        let set = source.view_set(&map.0, MapViews::Icosahedron, None, &context.derived, &work)?;
        Ok((map, map_source::picture_size(set.grid()), source.finished(set.maps().to_vec())))
    };
    let layout = parameters.layout.0;
    let (map, size, pixels) = match layout {
        FileLayout::Cube => on_grid(MapLayout::Cube)?,
        FileLayout::LatLong => on_grid(MapLayout::LatLong)?,
        FileLayout::Sphere => {
            let (map, edge) = for_spheres(source, parameters.resolution, reporter)?;
            map_source::check_total(edge * edge, vertices.len(), None)?;
            let mut pixels = reporter.until_stopped(|stop| sphere_maps(&map.0, &vertices, edge, stop))?;
            if let Some(lamps) = source.lamps() {
                let steps = work.part(1, vertices.len() * shrm::blocks(edge * edge));
                steps.until_stopped(|stop| add_to_sphere_maps(&mut pixels, lamps, &vertices, edge, stop))?;
            }
            (map, [edge; 2], source.finished(pixels))
        }
    };
    let map = &map.0;
    reporter.check_cancelled()?;
    note_lost(map, reporter);
    let content = match layout {
        FileLayout::Sphere => Content::Values,
        _ => Content::Light(map.grid()),
    };
    let writer = parameters.encoding().writer(&pixels, content, context)?;
    let ([width, rows], faces) = (size, if layout == FileLayout::Cube { 6 } else { 1 });
    let height = rows / faces;
    let steps = work.part(1, vertices.len());
    let encoded = pixels.chunks_exact(width * rows).map(|pixels| {
        steps.step()?;
        let pixels = pixels.to_vec();
        writer.texture(&Texture { width, height, faces, pixels, ..Texture::default() }, &[])
    });
    let encoded: Vec<Encoded> = encoded.collect::<Result<_, _>>()?;
    let negative: usize = encoded.iter().map(|file| file.negative).sum();
    if negative > 0 {
        reporter.warn(format!(
            "{negative} values are negative and turn black, because RGBE has no sign; format = \"exr\" keeps them"
        ));
    }
    let mut files: Vec<Vec<u8>> = encoded.into_iter().map(|file| file.bytes).collect();
    let place = |vertex: usize| {
        let entry = Entry::of_file(&file(vertex, parameters.format));
        if layout == FileLayout::Sphere { entry.with_axes(sphere_map_axes(vertices[vertex])) } else { entry }
    };
    let index = NewIndex {
        method: "cabral",
        centre: map.centre(),
        views: &MapViews::Icosahedron,
        layout,
        resolution: size[0],
        degree: source.p(),
        maps: Entry::of_views(&MapViews::Icosahedron, place),
    };
    files.push(index.encode(context.recipe())?);
    Ok(files)
}

/// The name of a vertex's file.
fn file(vertex: usize, format: CabralFormat) -> String {
    format!("view-{vertex:02}{}", format.container().ending())
}

/// The map that sphere maps are evaluated from (an SHRM unchanged, a reflection on rows that lose nothing),
/// and the edge of the sphere maps. `"auto"` makes a texel in the middle of a ball, 4 / N, as wide as a row.
fn for_spheres(
    source: &MapSource,
    resolution: Option<Resolution>,
    reporter: &Reporter,
) -> Result<(Arc<artifacts::Shrm>, usize), Failure> {
    let edge = |rows: usize| match resolution {
        Some(Resolution::Fixed(edge)) => edge,
        _ => ((rows as f64 / FRAC_PI_4).ceil() as usize).min(MAX_RESOLUTION),
    };
    match source {
        MapSource::Shrm(map) => {
            let rows = match map.0.grid() {
                MapGrid::Cube(cube) => 2 * cube.edge,
                MapGrid::LatLong(grid) => grid.height,
            };
            Ok((Arc::clone(map), edge(rows)))
        }
        MapSource::Reflection(reflection) => {
            let reflection = &reflection.0;
            let rows = sphere_map_rows(reflection.brdf().f(), reflection.brdf().p());
            let grid = MapGrid::LatLong(LatLong::with_rows(rows));
            let map = reporter.until_stopped(|stop| reflection.synthesise(grid, View::Local, stop))?;
            let needed = reflection.resolution(MapLayout::LatLong, ERROR).texels;
            Ok((Arc::new(artifacts::Shrm(map)), edge(needed)))
        }
    }
}

/// A note of the energy with p > 2.
fn note_lost(map: &Shrm, reporter: &Reporter) {
    let p_of = |row: usize| if map.terms() == Terms::Zonal { row } else { row.isqrt() };
    let (mut lost, mut all) = (0.0, 0.0);
    for texel in 0..map.grid().len() {
        let solid_angle = map.grid().solid_angle(texel);
        for (row, value) in map.texel(texel).iter().enumerate() {
            let energy: f64 = value.iter().map(|&value| math::powi(f64::from(value), 2)).sum();
            all += solid_angle * energy;
            lost += if p_of(row) > 2 { solid_angle * energy } else { 0.0 };
        }
    }
    if lost > 0.0 {
        let what = format!(
            "the reflected energy changes faster with the view (P = 3 to {}) than twelve views can \
             represent, and is lost",
            map.p().get()
        );
        report_loss(reporter, lost / all, &what, "export-shrm keeps it");
    }
}
