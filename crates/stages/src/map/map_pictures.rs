//! The pictures of a map with one value for each direction: arranged by a layout, in a picture's container.

use containers::{Encoded, Precision, write_exr, write_png, write_rgbe};
use engine::{Context, Failure, choice};
use envmap::{Image, ToneMap, to_srgb8};
use sh::{Synthesis, synthesise_cube};
use shrm::{MapGrid, Plain, Reflection};
use sphere::{Cube, Face, LatLong};

use crate::values::{Content, FileFormat, Numbers};

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
    fn has_precision(self) -> bool {
        self == Self::Exr
    }
}

/// The settings of a map that is written as pictures.
pub(crate) struct MapPictures {
    pub(crate) layout: Layout,
    /// Rows of a lat-long map; texels along the edge of a cube's face.
    pub(crate) resolution: usize,
    pub(crate) format: PictureFormat,
    pub(crate) numbers: Numbers,
    /// The exposure in stops, for PNG only.
    pub(crate) exposure: f64,
}

impl MapPictures {
    /// The endings of the files' names.
    pub(crate) fn endings(&self) -> Vec<String> {
        let extension = match self.format {
            PictureFormat::Exr => ".exr",
            PictureFormat::Rgbe => ".hdr",
            PictureFormat::Png => ".png",
        };
        match self.layout {
            Layout::Cube => Face::ALL.map(|face| format!("/{}{extension}", face.name())).into(),
            _ => vec![extension.to_owned()],
        }
    }

    /// The errors of a kind's parameters: those that the format does not use.
    pub(crate) fn check(&self) -> Vec<(&'static str, String)> {
        let mut errors = Vec::new();
        if self.exposure != 0.0 && self.format != PictureFormat::Png {
            errors.push(("exposure", "only format = \"png\" uses it".into()));
        }
        errors.extend(self.numbers.check(self.format));
        errors
    }

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
        context: &Context<'_>,
    ) -> Result<Vec<Vec<u8>>, Failure> {
        let precision =
            self.numbers.precision(self.format, &pixels, Content::Light(self.grid()), &context.reporter)?;
        let images = self.arrange(pixels)?;
        let files = images.iter().map(|image| self.encode(precision, image, context.recipe()));
        files.map(|file| Ok(file?.bytes)).collect()
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

    /// The file of an image.
    fn encode(&self, precision: Precision, image: &Image, recipe: &str) -> Result<Encoded, Failure> {
        let recipe = Some(recipe);
        match self.format {
            PictureFormat::Exr => Ok(write_exr(image, precision, recipe)?),
            PictureFormat::Rgbe => Ok(write_rgbe(image, recipe)?),
            PictureFormat::Png => {
                let codes = to_srgb8(image.pixels(), self.exposure, ToneMap::Filmic);
                Ok(Encoded {
                    bytes: write_png(image.width(), image.height(), &codes, recipe)?,
                    ..Encoded::default()
                })
            }
        }
    }
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
