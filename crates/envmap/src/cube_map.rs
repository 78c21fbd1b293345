//! A picture on the faces of a cube.

use sphere::Cube;

use crate::canvas::CubeCanvas;
use crate::environment::MOST_TEXELS;
use crate::resample::resample;
use crate::{Environment, Error};

/// A cube map of RGB values: six faces of `cube.edge`^2 texels in file order, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct CubeMap {
    cube: Cube,
    pixels: Vec<[f32; 3]>,
}

impl CubeMap {
    /// A cube map; `None` where the number of pixels is not that of the cube.
    pub fn new(cube: Cube, pixels: Vec<[f32; 3]>) -> Option<Self> {
        let texels = cube.edge.checked_mul(cube.edge).and_then(|face| face.checked_mul(6));
        (!cube.is_empty() && texels == Some(pixels.len())).then_some(Self { cube, pixels })
    }

    /// An environment on a cube of any size: the mean over each texel of the bilinearly interpolated image, as
    /// by [`Environment::from_image`].
    ///
    /// # Errors
    /// [`Error::Resolution`] where the cube is empty or larger than 2^28 texels.
    pub fn from_environment(environment: &Environment, cube: Cube) -> Result<Self, Error> {
        let edge = cube.edge;
        match edge.checked_mul(edge).and_then(|face| face.checked_mul(6)) {
            Some(1..=MOST_TEXELS) => {}
            _ => return Err(Error::Resolution { width: edge, height: edge.saturating_mul(6) }),
        }
        let grid = environment.grid();
        let pixels = resample(grid, grid.width, environment.pixels(), &CubeCanvas(cube));
        Ok(Self { cube, pixels })
    }

    /// The size of the cube.
    pub fn cube(&self) -> Cube {
        self.cube
    }

    /// RGB values, face by face, row by row from the top.
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }
}
