//! A picture on the faces of a cube.

use sphere::{Cube, Face};

use crate::texels::Continued;

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

    /// The cube with half as many texels along an edge: the means of 2 x 2 texels. `None` if the edge is odd.
    ///
    /// # Example
    /// ```
    /// use envmap::CubeMap;
    /// let pixels = (0..24).map(|texel| [texel as f32; 3]).collect();
    /// let halved = CubeMap::new(sphere::Cube { edge: 2 }, pixels).unwrap().halved().unwrap();
    /// assert_eq!(halved.pixels()[..2], [[1.5; 3], [5.5; 3]]);
    /// assert!(halved.halved().is_none());
    /// ```
    pub fn halved(&self) -> Option<Self> {
        let edge = self.cube.edge;
        if !edge.is_multiple_of(2) {
            return None;
        }
        let half = Cube { edge: edge / 2 };
        let texel = |index: usize| {
            // The rows of all six faces are one picture.
            let (row, column) = (index / half.edge, index % half.edge);
            let [above, below] =
                [2 * row, 2 * row + 1].map(|row| &self.pixels[row * edge + 2 * column..][..2]);
            std::array::from_fn(|c| 0.25 * (above[0][c] + above[1][c] + below[0][c] + below[1][c]))
        };
        Some(Self { cube: half, pixels: (0..half.len()).map(texel).collect() })
    }

    /// The faces with a border of one texel around each: six pictures of (edge + 2)^2 texels, rows from the
    /// top.
    ///
    /// The border has the texels of the neighbouring faces and at corners, where three faces meet, the mean
    /// of theirs, so that a bilinear look-up in a face alone finds what one in the cube finds.
    ///
    /// # Example: the right border of +X is the left column of -Z
    /// ```
    /// use envmap::CubeMap;
    /// let pixels = (0..24).map(|texel| [texel as f32; 3]).collect();
    /// let bordered = CubeMap::new(sphere::Cube { edge: 2 }, pixels).unwrap().bordered();
    /// assert_eq!(bordered.len(), 6 * 16);
    /// assert_eq!([bordered[7], bordered[11]], [[20.0; 3], [22.0; 3]]);
    /// ```
    pub fn bordered(&self) -> Vec<[f32; 3]> {
        let edge = self.cube.edge as isize;
        let texel = |face: Face, row: isize, column: isize| {
            let at = |row, column| self.cube.continued(face, row, column).map(|index| self.pixels[index]);
            at(row, column).unwrap_or_else(|| {
                let inside = |k: isize| k.clamp(0, edge - 1);
                let nearest = [(inside(row), inside(column)), (inside(row), column), (row, inside(column))];
                let nearest = nearest.map(|(row, column)| at(row, column).unwrap_or_default());
                std::array::from_fn(|c| (nearest[0][c] + nearest[1][c] + nearest[2][c]) / 3.0)
            })
        };
        let faces = Face::ALL.into_iter();
        faces
            .flat_map(|face| {
                (-1..=edge).flat_map(move |row| (-1..=edge).map(move |column| (face, row, column)))
            })
            .map(|(face, row, column)| texel(face, row, column))
            .collect()
    }
}
