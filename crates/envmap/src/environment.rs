//! Distant light as an image on the sphere.

use sphere::{Cube, LatLong};

/// Distant light: linear Rec. 709 radiance on a lat-long grid of Specula's frame.
///
/// `pixels` has `grid.height` rows of `grid.width` texels, row 0 toward +Z; all values are finite.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    grid: LatLong,
    pixels: Vec<[f32; 3]>,
}

impl Environment {
    /// An environment; `None` where the number of pixels is not that of the grid.
    pub fn new(grid: LatLong, pixels: Vec<[f32; 3]>) -> Option<Self> {
        (!grid.is_empty() && pixels.len() == grid.len()).then_some(Self { grid, pixels })
    }

    /// The grid of the texels.
    pub fn grid(&self) -> LatLong {
        self.grid
    }

    /// RGB radiance, row by row from the top.
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }
}

/// A cube map of RGB values: six faces of `cube.edge`^2 texels in file order, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct CubeMap {
    cube: Cube,
    pixels: Vec<[f32; 3]>,
}

impl CubeMap {
    /// A cube map; `None` where the number of pixels is not that of the cube.
    pub fn new(cube: Cube, pixels: Vec<[f32; 3]>) -> Option<Self> {
        (!cube.is_empty() && pixels.len() == cube.len()).then_some(Self { cube, pixels })
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
