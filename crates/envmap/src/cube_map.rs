//! A picture on the faces of a cube.

use sphere::Cube;

/// A cube map of RGB values: six faces of `cube.edge`^2 texels in file order, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct CubeMap {
    cube: Cube,
    pixels: Vec<[f32; 3]>,
}

impl CubeMap {
    /// A cube map; `None` if the number of pixels is not that of the cube.
    pub fn new(cube: Cube, pixels: Vec<[f32; 3]>) -> Option<Self> {
        let texels = cube.edge.checked_mul(cube.edge).and_then(|face| face.checked_mul(6));
        (!cube.is_empty() && texels == Some(pixels.len())).then_some(Self { cube, pixels })
    }

    /// Makes a cube map of pixels that fill it.
    pub(crate) fn from_complete(cube: Cube, pixels: Vec<[f32; 3]>) -> Self {
        Self { cube, pixels }
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
