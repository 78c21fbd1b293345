//! Reads explicit reflection maps for several views, and fits a spherical harmonic reflection map to them.
//!
//! ```toml
//! [stage.old-maps]
//! kind = "import-reflection-maps"
//! source = "assets/old-gold/cabral.json"
//! ```
//!
//! `source` names a JSON index, which names the files of the maps: pictures (OpenEXR, Radiance, TIFF) or
//! textures (KTX2, DDS of RGBA floats). `export-cabral`, `export-kautz-mccool` and `export-view-maps` write
//! such an index; for data from other programs, write one by hand. The result is of type `shrm`, for
//! `export-shrm` and the exports of maps.
//!
//! For each texel the coefficients are the least-squares fit to the values of all views, without
//! regularisation: if the views do not determine the coefficients, the item fails (Ramamoorthi and Hanrahan
//! 2002, appendix C). The build notes P, the residual (the part of the maps that the fit does not
//! reproduce, as a share of their root mean square), and how much the coefficients amplify errors in the
//! maps.
//!
//! | maps | result | P at most |
//! | --- | --- | --- |
//! | twelve views of an icosahedron | global | 2 |
//! | K slices for angles theta_o | local, terms with q = 0 | K - 1 |
//! | T x T views | local or global as they are | (T - 1) / 2 |
//! | other views | local or global as they are | as many as they determine |
//!
//! A field with at most this P is recovered to the precision of the files. If the field has more, the rest
//! stays in the residual or aliases into the coefficients. If there is no `degree`, P is the one in the
//! index or, if that is too high or missing, the highest P that the views determine well.
//!
//! ## The index
//!
//! ```json
//! {
//!   "format": "explicit-reflection-maps",
//!   "version": 1,
//!   "centre": "reflection",
//!   "views": "global",
//!   "layout": "cube",
//!   "maps": [
//!     { "file": "front.exr", "view": [1, 0, 0] },
//!     { "file": "top.exr", "view_file": [0, 1, 0] }
//!   ]
//! }
//! ```
//!
//! | member | value |
//! | --- | --- |
//! | `format`, `version` | as above |
//! | `centre` | the direction by which maps are looked up: `reflection` (the vector R; the default), `normal` or `tangent` |
//! | `views` | `global`: each map has a view in the world. `local`: a view in the frame of each texel. `angles`: an angle between central direction and view |
//! | `layout` | `cube`, `lat-long` or `sphere`, as in the manual of `export-cabral` |
//! | `degree` | the P of the field that the maps were made from, if known |
//! | `maps` | one entry for each map |
//! | `resolution`, `method`, `central_direction`, `frame`, `lookup`, `interpolation`, `triangles`, `specula` | optional: for renderers and people |
//!
//! | member of a map | value |
//! | --- | --- |
//! | `file` | the file, relative to the index |
//! | `layer` | in an array texture, which layer, from 0 |
//! | `slice` | in a volume, which slice, from 0 |
//! | `view` or `view_file` | with `global` and `local`: the direction to the viewer, in Specula's frame (+Z up, the centre of a lat-long image along +X) or in the file frame (+Y up, the centre along +Z) |
//! | `up` or `up_file` | with layout `sphere`: the direction that is up in the image; default: against theta of the view |
//! | `right` or `right_file` | with layout `sphere`: optional: the direction that is right in the image, up x view |
//! | `theta_o` | with `angles`: the angle in radians, 0 to pi |
//!
//! If a direction is given in both frames, the two must agree. In a picture, the faces +X -X +Y -Y +Z -Z of
//! a cube are stacked; a texture has six faces. All maps of an index must have the same size. One map for
//! two views, or two maps for one view, give a warning.
//!
//! The item is named after its index. To read several sets with one glob, give each index its own name.
//!
//! ## Sphere maps
//!
//! Balls seen from different views have no texels in common, so each is first interpolated onto a cube, by
//! default with half the ball's edge. This blurs a little, and a ball holds almost no information at its
//! rim, where the central direction is opposite to the view, so expect a residual of a few percent. Cubes
//! and lat-long maps keep their texels.
//!
//! ## Processors
//!
//! As with `import-environment`, the type of processor is part of the key.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Read as _;
use std::path::Path;

use containers::{
    ReadOptions, Texture, decoder_level, is_texture, read_image, read_image_header, read_texture,
};
use engine::{Artifact, Context, Failure, ItemFiles, Kind, Output, Port, Product, Reporter, parameters};
use sh::Degree;
use shrm::{Fit, FitError, GOOD_CONDITION, MapGrid, View, fit_angles, fit_views, from_sphere_maps};
use sphere::{Cube, Direction, LatLong};

use super::map_index::{Entry, FileLayout, Index, Views};
use crate::values::{MAX_RESOLUTION, artifacts};

parameters! {
    /// Parameters of `import-reflection-maps`.
    pub(crate) struct Parameters {
        /// P of the result. Default: that of the index, or the highest that the views determine well.
        #[range(0..=64)]
        degree: Option<usize> = None,
        /// With sphere maps: the edge of the cube that they are interpolated onto. Default: half of theirs.
        #[range(1..=MAX_RESOLUTION)]
        resolution: Option<usize> = None,
    }
}

/// The kind `import-reflection-maps`.
pub(crate) struct ImportReflectionMaps;

impl Kind for ImportReflectionMaps {
    type Parameters = Parameters;

    const NAME: &'static str = "import-reflection-maps";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[shrm::revisions::FIT];
    const TEXT: &'static str = include_str!("import_reflection_maps.rs");
    const SOURCE: bool = true;

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn processor(_: &Parameters) -> Option<&'static str> {
        Some(decoder_level())
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Shrm::TYPE)
    }

    fn check_source(_: &Parameters, context: &Context<'_>) -> Result<(), Failure> {
        let source = context.files.source()?;
        let name = source.file_name().unwrap_or(source.as_os_str()).to_string_lossy().into_owned();
        check(source, &context.files).map_err(|failure| failure.context(format!("cannot import {name}")))
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let source = context.files.source()?;
        let name = source.file_name().unwrap_or(source.as_os_str()).to_string_lossy().into_owned();
        let fit = import(parameters, source, context)
            .map_err(|failure| failure.context(format!("cannot import {name}")))?;
        Output::artifact(artifacts::Shrm(fit.map))
    }
}

/// Checks the index and the headers of the pictures that it names; textures must only exist.
fn check(source: &Path, files: &ItemFiles<'_>) -> Result<(), Failure> {
    let index = Index::decode(&files.read(source)?)?;
    sampling(&index)?;
    let mut checked = BTreeSet::new();
    let mut size = None;
    for entry in index.maps.iter().filter(|entry| checked.insert(&entry.file)) {
        let found = check_file(&entry.file, index.layout, files)
            .map_err(|failure| failure.context(entry.file.clone()))?;
        if let Some(found) = found {
            check_size(&index, entry, *size.get_or_insert(found), found)?;
        }
    }
    Ok(())
}

/// The size of the map in a picture; `None` for a texture.
fn check_file(file: &str, layout: FileLayout, files: &ItemFiles<'_>) -> Result<Option<[usize; 2]>, Failure> {
    /// The number of bytes that tell a texture from a picture.
    const SIGNATURE: u64 = 64;
    let mut opened = files.open(Path::new(file))?;
    let mut bytes = Vec::new();
    opened.by_ref().take(SIGNATURE).read_to_end(&mut bytes)?;
    if is_texture(&bytes) {
        return Ok(None);
    }
    let header = read_image_header(&mut opened, &ReadOptions::default())?;
    picture_size(layout, header.width, header.height).map(Some)
}

fn import(parameters: &Parameters, source: &Path, context: &Context<'_>) -> Result<Fit, Failure> {
    let reporter = &context.reporter;
    let index = Index::decode(&context.files.read(source)?)?;
    let sampled = sampling(&index)?;
    warn_of_repeated(&index, &sampled, reporter);
    let maps = read_maps(&index, context)?;
    reporter.check_cancelled()?;
    if parameters.resolution.is_some() && index.layout != FileLayout::Sphere {
        reporter.warn("only sphere maps use resolution; these maps keep their texels");
    }
    let (grid, pixels) = on_one_grid(&index, maps, parameters.resolution)?;
    reporter.check_cancelled()?;
    let centre = index.centre.into();
    let fit = |degree: Option<usize>| {
        let degree = degree.map(Degree::new).transpose()?;
        let fit = match &sampled {
            Sampling::Views(view, directions) => fit_views(grid, centre, *view, directions, &pixels, degree),
            Sampling::Angles(angles) => fit_angles(grid, centre, angles, &pixels, degree),
        };
        fit.map_err(|error| failure(error, &index, grid))
    };
    let fitted = match (parameters.degree, index.degree) {
        (Some(degree), _) => fit(Some(degree))?,
        (None, Some(of_index)) => match fit(Some(of_index)) {
            Ok(fitted) if fitted.condition <= GOOD_CONDITION => fitted,
            _ => fit(None)?,
        },
        (None, None) => fit(None)?,
    };
    note_fit(&fitted, &index, reporter);
    Ok(fitted)
}

/// The views, or the angles, of the maps.
enum Sampling {
    Views(View, Vec<Direction>),
    Angles(Vec<f64>),
}

fn sampling(index: &Index) -> Result<Sampling, Failure> {
    let directions = || index.maps.iter().map(Entry::view).collect::<Result<Vec<_>, _>>();
    Ok(match index.views {
        Views::Global => Sampling::Views(View::Global, directions()?),
        Views::Local => Sampling::Views(View::Local, directions()?),
        Views::Angles => Sampling::Angles(index.maps.iter().map(Entry::angle).collect::<Result<_, _>>()?),
    })
}

/// Warns of two entries that name the same map or the same view: most often a line that was copied and not
/// edited.
fn warn_of_repeated(index: &Index, sampled: &Sampling, reporter: &Reporter) {
    /// Two views are the same if they round to the same multiple of this.
    const STEP: f64 = 1e-6;
    let rounded = |value: f64| (value / STEP).round() as i64;
    let view = |k: usize| match sampled {
        Sampling::Views(_, views) => views[k].vector().to_array().map(rounded),
        Sampling::Angles(angles) => [rounded(angles[k]), 0, 0],
    };
    let map = |k: usize| (&index.maps[k].file, index.maps[k].layer, index.maps[k].slice);
    let all = 0..index.maps.len();
    if let Some((a, b)) = repeated(all.clone().map(map)) {
        reporter.warn(format!("entries {} and {} of `maps` name the same map, {}", a + 1, b + 1, map(a).0));
    }
    if let Some((a, b)) = repeated(all.map(view)) {
        reporter.warn(format!(
            "entries {} and {} of `maps`, in {} and {}, have the same view",
            a + 1,
            b + 1,
            map(a).0,
            map(b).0
        ));
    }
}

/// The positions of the first two equal values.
fn repeated<T: Ord>(values: impl Iterator<Item = T>) -> Option<(usize, usize)> {
    let mut seen = BTreeMap::new();
    for (position, value) in values.enumerate() {
        if let Some(before) = seen.insert(value, position) {
            return Some((before, position));
        }
    }
    None
}

/// Maps of one size, one after the other.
struct ReadMaps {
    /// The columns and rows of a map; of a cube, those of a face.
    size: [usize; 2],
    pixels: Vec<[f32; 3]>,
}

/// Reads each file once and takes the maps from them.
fn read_maps(index: &Index, context: &Context<'_>) -> Result<ReadMaps, Failure> {
    let mut files: BTreeMap<&str, Texture> = BTreeMap::new();
    let mut maps: Option<ReadMaps> = None;
    for entry in &index.maps {
        context.reporter.check_cancelled()?;
        if !files.contains_key(entry.file.as_str()) {
            // Only the current picture is kept: each holds one map.
            files.retain(|_, file| file.layers * file.depth > 1);
            let file = open(&entry.file, index.layout, context)
                .map_err(|failure| failure.context(entry.file.clone()))?;
            files.insert(&entry.file, file);
        }
        let Some(file) = files.get(entry.file.as_str()) else { continue };
        let pixels = part(file, entry).map_err(|failure| failure.context(entry.file.clone()))?;
        let size = [file.width, file.height];
        let maps = maps.get_or_insert_with(|| ReadMaps { size, pixels: Vec::new() });
        check_size(index, entry, maps.size, size)?;
        if maps.pixels.len() + pixels.len() > containers::MAX_PIXELS {
            return Err(Failure::new(format!(
                "the maps have more than {} texels together",
                containers::MAX_PIXELS
            )));
        }
        maps.pixels.extend_from_slice(pixels);
    }
    // An index names at least one map.
    maps.ok_or_else(|| Failure::new("`maps` is empty"))
}

/// Checks that a map has the size of the first one.
fn check_size(index: &Index, entry: &Entry, first: [usize; 2], size: [usize; 2]) -> Result<(), Failure> {
    if first == size {
        return Ok(());
    }
    let [[a, b], [c, d]] = [first, size];
    Err(Failure::new(format!(
        "{}: {c} x {d} texels, but {} has {a} x {b}; all maps of an index must have the same size",
        entry.file, index.maps[0].file
    )))
}

/// The size of the map in a picture of these columns and rows.
fn picture_size(layout: FileLayout, width: usize, height: usize) -> Result<[usize; 2], Failure> {
    let faces = layout.faces();
    let fits = height.is_multiple_of(faces) && fits(layout, width, height / faces, faces);
    if fits { Ok([width, height / faces]) } else { Err(wrong_shape(layout, width, height)) }
}

fn fits(layout: FileLayout, width: usize, height: usize, faces: usize) -> bool {
    match layout {
        FileLayout::Cube => faces == 6 && width == height,
        FileLayout::LatLong => faces == 1 && width == 2 * height,
        FileLayout::Sphere => faces == 1 && width == height,
    }
}

/// Reads a file, a texture or a picture of one layer, and checks that it can hold a map of the layout.
fn open(file: &str, layout: FileLayout, context: &Context<'_>) -> Result<Texture, Failure> {
    let bytes = context.files.read(Path::new(file))?;
    if is_texture(&bytes) {
        let texture = read_texture(&bytes)?.texture;
        let Texture { width, height, layers, faces, .. } = texture;
        if !fits(layout, width, height, faces) {
            return Err(wrong_shape(layout, width, height * faces));
        }
        return Ok(Texture { layers: layers.max(1), smaller_levels: Vec::new(), ..texture });
    }
    let decoded = read_image(&bytes, &ReadOptions::default())?;
    for warning in &decoded.warnings {
        context.reporter.warn(format!("{file}: {warning}"));
    }
    let [width, height] = picture_size(layout, decoded.image.width(), decoded.image.height())?;
    let pixels = decoded.image.into_pixels();
    Ok(Texture { width, height, layers: 1, faces: layout.faces(), pixels, ..Texture::default() })
}

fn wrong_shape(layout: FileLayout, width: usize, height: usize) -> Failure {
    let rule = match layout {
        FileLayout::Cube => {
            "a cube has six square faces, stacked in a picture that is six times as high as wide"
        }
        FileLayout::LatLong => "a lat-long map is twice as wide as high",
        FileLayout::Sphere => "a sphere map is square",
    };
    Failure::new(format!("{rule}; this file is {width} x {height}"))
}

/// The pixels of an entry's map in its file.
fn part<'a>(file: &'a Texture, entry: &Entry) -> Result<&'a [[f32; 3]], Failure> {
    let texels = file.width * file.height * file.faces;
    let ((name, at, count), (other, none)) = if file.depth > 1 {
        (("slice", entry.slice, file.depth), ("layer", entry.layer))
    } else {
        (("layer", entry.layer, file.layers), ("slice", entry.slice))
    };
    if none.is_some_and(|at| at > 0) {
        return Err(Failure::new(format!("`{other}` is given, but the file has no {other}s")));
    }
    let at = match at {
        Some(at) if at < count => at,
        None if count == 1 => 0,
        Some(at) => {
            return Err(Failure::new(format!("`{name}` is {at}; the file has {count}, counted from 0")));
        }
        None => return Err(Failure::new(format!("`{name}` is missing; the file has {count}"))),
    };
    Ok(&file.pixels[at * texels..][..texels])
}

/// The maps on one grid: their own, or for sphere maps a cube.
fn on_one_grid(
    index: &Index,
    maps: ReadMaps,
    resolution: Option<usize>,
) -> Result<(MapGrid, Vec<[f32; 3]>), Failure> {
    let [width, height] = maps.size;
    match index.layout {
        FileLayout::Cube => Ok((MapGrid::Cube(Cube { edge: width }), maps.pixels)),
        FileLayout::LatLong => Ok((MapGrid::LatLong(LatLong { width, height }), maps.pixels)),
        FileLayout::Sphere => {
            if let Some(bad) = maps.pixels.as_flattened().iter().position(|value| !value.is_finite()) {
                let (map, texel) = (bad / 3 / (width * height), bad / 3 % (width * height));
                return Err(not_finite(index, map, texel, width, maps.pixels.as_flattened()[bad]));
            }
            let axes = index.maps.iter().map(Entry::axes).collect::<Result<Vec<_>, _>>()?;
            let grid = MapGrid::Cube(Cube { edge: resolution.unwrap_or(width.div_ceil(2)) });
            Ok((grid, from_sphere_maps(width, &axes, &maps.pixels, grid)))
        }
    }
}

/// An error of the fit, with the file that causes it.
fn failure(error: FitError, index: &Index, grid: MapGrid) -> Failure {
    match error {
        FitError::NotFinite { map, texel, value } => not_finite(index, map, texel, grid.shape()[2], value),
        FitError::TooFewViews { .. } | FitError::Undetermined { .. } => {
            Failure::from(error).help("lower degree or leave it out, or add maps for other views")
        }
        error => error.into(),
    }
}

fn not_finite(index: &Index, map: usize, texel: usize, width: usize, value: f32) -> Failure {
    let entry = &index.maps[map];
    let part = match (entry.layer, entry.slice) {
        (Some(layer), _) => format!(", layer {layer}"),
        (None, Some(slice)) => format!(", slice {slice}"),
        (None, None) => String::new(),
    };
    let rows = if index.layout == FileLayout::Cube { " (rows of faces below each other)" } else { "" };
    Failure::new(format!(
        "{}{part}: {value} at column {}, row {}{rows}",
        entry.file,
        texel % width,
        texel / width
    ))
    .help("repair the map: every value must be a finite number")
}

/// Notes the degree, the residual and the condition of the fit.
fn note_fit(fit: &Fit, index: &Index, reporter: &Reporter) {
    let p = fit.map.p().get();
    reporter.note(format!(
        "P = {p} from {} maps: the residual is {:.2e} of the maps' root mean square, errors grow by a factor of {:.2}",
        index.maps.len(),
        fit.residual,
        fit.condition
    ));
    if let Some(degree) = index.degree.filter(|degree| *degree > p) {
        reporter.note(format!("the maps were made from P = {degree}; these views determine only P = {p}"));
    }
}
