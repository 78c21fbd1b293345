//! What the exports of explicit maps share: the map that they start from, and the files of maps.

use std::sync::Arc;

use brdf::Part;
use containers::Texture;
use engine::{Artifact, Context, DerivedValues, Failure, Inputs, Output, Port, Reporter, Steps};
use shrm::{Lamps, MapGrid, MapLayout, MapViews, Shrm, View, ViewSet};
use sphere::{Cube, LatLong};

use super::disk_means::disk_means;
use super::map_index::{Entry, NewIndex};
use super::map_input::{MapInput, PartOfMaterial};
use crate::values::{
    Content, Encoding, FileFormat, LampsName, MapsFormat, PartsName, Resolution, UntilStopped, artifacts,
    parts,
};

/// Maps are made exactly from a reflection, or from a spherical harmonic reflection map, which is
/// interpolated if its grid differs.
pub(crate) enum MapSource {
    Reflection(Arc<artifacts::Reflection>),
    Shrm(Arc<artifacts::Shrm>),
}

impl MapSource {
    pub(crate) fn port() -> Port {
        MapInput::port()
    }

    /// The artifact at the port.
    pub(crate) fn of(inputs: &Inputs) -> Result<Self, Failure> {
        let port = &Self::port().name;
        if inputs.type_at(port) == Some(artifacts::Shrm::TYPE) {
            return Ok(Self::Shrm(inputs.get::<artifacts::Shrm>(port)?));
        }
        Ok(Self::Reflection(inputs.get::<artifacts::Reflection>(port)?))
    }

    /// The fields of a reflection's two parts, if its material has two centres.
    pub(crate) fn parts(&self) -> Option<[Self; 2]> {
        let Self::Reflection(reflection) = self else { return None };
        let part = |part: &shrm::Reflection| Self::Reflection(Arc::new(artifacts::Reflection(part.clone())));
        Some(reflection.0.parts()?.each_ref().map(part))
    }

    /// Writes the files of the source's maps: see [`parts::export`].
    pub(crate) fn export(
        &self,
        parts: PartsName,
        reporter: &Reporter,
        write: impl Fn(&Self, Option<Part>, &Steps<'_>) -> Result<Vec<Vec<u8>>, Failure>,
    ) -> Result<Output, Failure> {
        if let Self::Reflection(reflection) = self {
            parts::note(parts, &reflection.0, reporter);
        }
        parts::export(parts, self, self.parts(), reporter, write)
    }

    /// The degree P in the view.
    pub(crate) fn p(&self) -> usize {
        match self {
            Self::Reflection(reflection) => reflection.0.brdf().p().get(),
            Self::Shrm(map) => map.0.p().get(),
        }
    }

    /// The lamps that [`MapSource::map`] does not hold; who makes maps of single views from it adds them
    /// exactly.
    pub(crate) fn lamps(&self) -> Option<&Lamps> {
        match self {
            Self::Reflection(reflection) => reflection.0.lamps(),
            Self::Shrm(_) => None,
        }
    }

    /// Makes pixels as a file has them: what a cut at degrees that were chosen for this light leaves below
    /// zero is black.
    pub(crate) fn finished(&self, mut pixels: Vec<[f32; 3]>) -> Vec<[f32; 3]> {
        if matches!(self, Self::Reflection(reflection) if reflection.0.is_for_light()) {
            pixels.as_flattened_mut().iter_mut().for_each(|value| *value = value.max(0.0));
        }
        pixels
    }

    /// The map without lamps, with texels of this layout. `"auto"`, the default, is the resolution that a
    /// reflection needs, or that of the map.
    pub(crate) fn map(
        &self,
        layout: MapLayout,
        resolution: Option<Resolution>,
        view: View,
        reporter: &Reporter,
    ) -> Result<Arc<artifacts::Shrm>, Failure> {
        let map = match self {
            Self::Reflection(reflection) => {
                let input = MapInput {
                    layout: Some(layout),
                    resolution,
                    error: None,
                    view: Some(view),
                    lamps: LampsName::Separate,
                    small: None,
                };
                let steps = Steps::new(reporter, 1);
                return input.map_of(&reflection.0, PartOfMaterial::All, &steps);
            }
            Self::Shrm(map) => map,
        };
        let resolution = match (resolution, map.0.grid(), layout) {
            (Some(Resolution::Fixed(resolution)), ..) => resolution,
            // The edge of a cube spans a quarter of the equator, the rows of a lat-long map span half a turn.
            (_, MapGrid::Cube(cube), MapLayout::Cube) => cube.edge,
            (_, MapGrid::Cube(cube), MapLayout::LatLong) => 2 * cube.edge,
            (_, MapGrid::LatLong(grid), MapLayout::Cube) => grid.height.div_ceil(2),
            (_, MapGrid::LatLong(grid), MapLayout::LatLong) => grid.height,
        };
        let grid = layout.grid(resolution);
        if grid == map.0.grid() && view == map.0.view() {
            return Ok(Arc::clone(map));
        }
        if grid != map.0.grid() {
            let [old, new] = [map.0.grid(), grid].map(grid_text);
            reporter.note(format!("the map was interpolated from {old} to {new}"));
        }
        Ok(Arc::new(artifacts::Shrm(map.0.resampled(grid, view))))
    }

    /// The maps of single views of a [`MapSource::map`], with the lamps. `count` is the parameter for the
    /// number of maps.
    pub(crate) fn view_set(
        &self,
        map: &Shrm,
        views: MapViews,
        count: Option<&str>,
        derived: &DerivedValues<'_>,
        steps: &Steps<'_>,
    ) -> Result<ViewSet, Failure> {
        let (reporter, maps, texels) = (steps.reporter(), views.count(), map.grid().len());
        check_total(texels, maps, count)?;
        reporter.check_cancelled()?;
        let set = reporter.until_stopped(|stop| ViewSet::from_shrm(map, views, stop))?;
        let set = set.ok_or_else(|| Failure::new(format!("{maps} views are not a set of maps")))?;
        match self.lamps() {
            Some(lamps) => {
                let steps = steps.part(1, maps * shrm::blocks(texels));
                if set.views().angles().is_empty() {
                    return steps.until_stopped(|stop| set.with_lamps(lamps, stop));
                }
                let disks = disk_means(&lamps.lights, derived);
                steps.until_stopped(|stop| set.with_lamps_over(lamps, &disks, stop))
            }
            None => Ok(set),
        }
    }
}

fn grid_text(grid: MapGrid) -> String {
    match grid {
        MapGrid::LatLong(LatLong { width, height }) => format!("lat-long {width} x {height}"),
        MapGrid::Cube(Cube { edge }) => format!("a cube of edge {edge}"),
    }
}

/// Columns and rows of the picture that holds a grid; the faces of a cube are stacked.
pub(crate) fn picture_size(grid: MapGrid) -> [usize; 2] {
    let [faces, height, width] = grid.shape();
    [width, faces * height]
}

/// The files that hold a set of maps: a texture of all maps, or a picture for each map, and last the index.
pub(crate) struct SetFiles {
    /// The method that made the maps, which is also the name of the index.
    pub(crate) method: &'static str,
    pub(crate) encoding: Encoding<MapsFormat>,
    /// The name of the texture, without its ending.
    pub(crate) texture: &'static str,
    /// The name of the picture of a map, without its ending.
    pub(crate) picture: fn(usize) -> String,
}

impl SetFiles {
    /// The endings of the names of the files of so many maps.
    pub(crate) fn endings(&self, maps: usize) -> Vec<String> {
        let files = if self.encoding.container().is_texture() { 1 } else { maps };
        let files = (0..files).map(|map| format!("/{}", self.file(map)));
        files.chain([format!("/{}.json", self.method)]).collect()
    }

    /// The name of the file that holds a map.
    fn file(&self, map: usize) -> String {
        let container = self.encoding.container();
        let name = if container.is_texture() { self.texture.to_owned() } else { (self.picture)(map) };
        format!("{name}{}", container.ending())
    }

    /// The contents of the files.
    pub(crate) fn encode(
        &self,
        set: &ViewSet,
        source: &MapSource,
        context: &Context<'_>,
    ) -> Result<Vec<Vec<u8>>, Failure> {
        let is_texture = self.encoding.container().is_texture();
        let is_volume = matches!(set.views(), MapViews::Angles(_));
        let ([faces, height, width], count) = (set.grid().shape(), set.views().count());
        let (layers, depth) = if is_volume { (0, count) } else { (count, 1) };
        let pixels = source.finished(set.maps().to_vec());
        let texture = Texture { width, height, depth, layers, faces, pixels, ..Texture::default() };
        let mut files = encode(&texture, self.encoding, self.method, context)?;
        let place = |map: usize| {
            let in_texture = is_texture.then_some(map);
            let entry = Entry::of_file(&self.file(map));
            if is_volume { entry.in_slice(in_texture) } else { entry.in_layer(in_texture) }
        };
        let index = NewIndex {
            method: self.method,
            centre: set.centre(),
            views: set.views(),
            layout: set.grid().into(),
            resolution: height,
            degree: source.p(),
            maps: Entry::of_views(set.views(), place),
        };
        files.push(index.encode(context.recipe())?);
        Ok(files)
    }
}

/// The files of a texture of maps: the texture itself, or a picture for each map.
pub(crate) fn encode(
    texture: &Texture,
    encoding: Encoding<impl FileFormat>,
    method: &str,
    context: &Context<'_>,
) -> Result<Vec<Vec<u8>>, Failure> {
    let grid = match texture.faces {
        6 => MapGrid::Cube(Cube { edge: texture.width }),
        _ => MapGrid::LatLong(LatLong { width: texture.width, height: texture.height }),
    };
    let writer = encoding.writer(&texture.pixels, Content::Light(grid), context)?;
    let files = writer.maps(texture, &[("specula.kind", method)])?;
    Ok(files.into_iter().map(|file| file.bytes).collect())
}

/// Fails if there are more texels than a container, or `import-reflection-maps`, can hold, before the maps
/// are made. `count` is the parameter for the number of maps.
pub(crate) fn check_total(texels: usize, maps: usize, count: Option<&str>) -> Result<(), Failure> {
    if texels.saturating_mul(maps) <= containers::MAX_PIXELS {
        return Ok(());
    }
    let lower = count.map_or("lower resolution".into(), |count| format!("lower {count} or resolution"));
    let most = containers::MAX_PIXELS;
    Err(Failure::new(format!("{maps} maps of {texels} texels have more than {most} texels together"))
        .help(lower))
}
