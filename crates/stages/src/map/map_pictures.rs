//! The pictures of a map with one value for each direction: arranged by a layout, in a picture's container.

use engine::{Context, DerivedValues, Failure, choice};
use envmap::Image;
use sh::{Synthesis, synthesise_cube};
use shrm::{MapGrid, Plain, Reflection};
use sphere::{Cube, Face, LatLong};

use crate::map::disk_means::disk_means;
use crate::values::{Container, Content, Encoding, FileFormat, image};

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
    pub(crate) enum PictureFormat {
        /// OpenEXR.
        Exr = "exr",
        /// Radiance.
        Rgbe = "rgbe",
        /// PNG, tone-mapped.
        Png = "png",
    }
}

impl FileFormat for PictureFormat {
    fn container(self) -> Container {
        match self {
            Self::Exr => Container::Exr,
            Self::Rgbe => Container::Rgbe,
            Self::Png => Container::Png,
        }
    }
}

/// The endings of the names of a map's files: of a picture for each face of a cube, or of one file.
pub(crate) fn endings(layout: Layout, container: Container) -> Vec<String> {
    let ending = container.ending();
    match layout {
        Layout::Cube if !container.is_texture() => {
            Face::ALL.map(|face| format!("/{}{ending}", face.name())).into()
        }
        _ => vec![ending.to_owned()],
    }
}

/// The arrangement of a map that is written as pictures.
pub(crate) struct MapPictures {
    pub(crate) layout: Layout,
    /// Rows of a lat-long map; texels along the edge of a cube's face.
    pub(crate) resolution: usize,
}

impl MapPictures {
    /// The texels that the layout shows.
    pub(crate) fn grid(&self) -> MapGrid {
        match self.layout {
            Layout::LatLong => MapGrid::LatLong(LatLong::with_rows(self.resolution)),
            Layout::Cube | Layout::CubeStrip | Layout::CubeCross => {
                MapGrid::Cube(Cube { edge: self.resolution })
            }
        }
    }

    /// The files of the texels' values.
    pub(crate) fn files(
        &self,
        pixels: Vec<[f32; 3]>,
        encoding: Encoding<impl FileFormat>,
        context: &Context<'_>,
    ) -> Result<Vec<Vec<u8>>, Failure> {
        let writer = encoding.writer(&pixels, Content::Light(self.grid()), context)?;
        let images = self.arrange(pixels)?;
        images.iter().map(|image| Ok(writer.picture(image)?.bytes)).collect()
    }

    /// The images of the texels' values.
    fn arrange(&self, pixels: Vec<[f32; 3]>) -> Result<Vec<Image>, Failure> {
        let resolution = self.resolution;
        match self.layout {
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
}

/// One map of a reflection, with the lamps beside it, at the texels of a grid.
pub(crate) fn texels(
    reflection: &Reflection,
    plain: Plain,
    grid: MapGrid,
    derived: &DerivedValues<'_>,
) -> Result<Vec<[f32; 3]>, Failure> {
    let field = reflection.plain(plain);
    let mut pixels: Vec<[f32; 3]> = match grid {
        MapGrid::LatLong(grid) => Synthesis::new(grid, field.degree())?.synthesise(&field),
        MapGrid::Cube(cube) => synthesise_cube(&field, cube)?,
    };
    if let Some(lamps) = reflection.lamps() {
        let disks = disk_means(&lamps.lights, derived);
        for (pixel, lamps) in pixels.iter_mut().zip(lamps.plain_over(plain, grid, &disks)) {
            (0..3).for_each(|channel| pixel[channel] += lamps[channel]);
        }
    }
    if reflection.is_for_light() {
        pixels.iter_mut().for_each(|pixel| *pixel = pixel.map(|value| value.max(0.0)));
    }
    Ok(pixels)
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
