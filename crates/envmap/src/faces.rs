//! Six faces in one picture: stacks, strips and crosses.

use sphere::Face;

use crate::error::Error;
use crate::image::Image;

/// Six pictures in file order (+X -X +Y -Y +Z -Z) as one of [`crate::Layout::Cube`], stacked from the top.
///
/// # Errors
/// [`Error::FaceSize`] if a face is not square or not as large as the first.
pub fn stack_faces(faces: [Image; 6]) -> Result<Image, Error> {
    let edge = check_faces(faces.each_ref().map(|face| [face.width(), face.height()]))?;
    let mut pixels = Vec::with_capacity(6 * edge * edge);
    for image in &faces {
        pixels.extend_from_slice(image.pixels());
    }
    // Six faces of edge x edge always fill this picture.
    Image::new(edge, 6 * edge, pixels).ok_or(Error::Resolution { width: edge, height: 6 * edge })
}

/// Checks that six faces of these columns and rows, in file order, are squares of one size; returns their
/// edge.
///
/// # Errors
/// [`Error::FaceSize`] names the first that does not fit.
pub fn check_faces(sizes: [[usize; 2]; 6]) -> Result<usize, Error> {
    let edge = sizes[0][0];
    for (face, [width, height]) in Face::ALL.into_iter().zip(sizes) {
        if width != edge || height != edge {
            return Err(Error::FaceSize { face, width, height, edge });
        }
    }
    Ok(edge)
}

/// The places of the faces in a picture of square cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrangement {
    /// The number of texels along an edge of a cell.
    edge: usize,
    /// The number of cells across.
    across: usize,
    /// The face of each cell, row by row.
    cells: &'static [Option<Face>],
}

const STACK: &[Option<Face>] = &[
    Some(Face::PositiveX),
    Some(Face::NegativeX),
    Some(Face::PositiveY),
    Some(Face::NegativeY),
    Some(Face::PositiveZ),
    Some(Face::NegativeZ),
];

#[rustfmt::skip]
const HORIZONTAL: &[Option<Face>] = &[
    None,                  Some(Face::PositiveY), None,                  None,
    Some(Face::NegativeX), Some(Face::PositiveZ), Some(Face::PositiveX), Some(Face::NegativeZ),
    None,                  Some(Face::NegativeY), None,                  None,
];

#[rustfmt::skip]
const VERTICAL: &[Option<Face>] = &[
    None,                  Some(Face::PositiveY), None,
    Some(Face::NegativeX), Some(Face::PositiveZ), Some(Face::PositiveX),
    None,                  Some(Face::NegativeY), None,
    None,                  Some(Face::NegativeZ), None,
];

/// The number of cells across and down, and the face of each cell.
type Cells = (usize, usize, &'static [Option<Face>]);

/// The arrangements of stacked faces, of a strip and of a cross.
pub(crate) const STACKS: &[Cells] = &[(1, 6, STACK)];
pub(crate) const STRIPS: &[Cells] = &[(6, 1, STACK), (1, 6, STACK)];
pub(crate) const CROSSES: &[Cells] = &[(4, 3, HORIZONTAL), (3, 4, VERTICAL)];

impl Arrangement {
    /// The first of some arrangements that fits the shape of a picture.
    pub(crate) fn fitting(arrangements: &[Cells], width: usize, height: usize) -> Option<Self> {
        arrangements.iter().find_map(|&(across, down, cells)| {
            let edge = width / across;
            (edge > 0 && edge.checked_mul(across) == Some(width) && edge.checked_mul(down) == Some(height))
                .then_some(Self { edge, across, cells })
        })
    }

    /// The number of texels along an edge of a face.
    pub(crate) fn edge(self) -> usize {
        self.edge
    }

    /// The face, row and column of a pixel; `None` in a blank cell.
    pub(crate) fn texel(self, row: usize, column: usize) -> Option<(Face, usize, usize)> {
        let edge = self.edge;
        let face = self.cells[row / edge * self.across + column / edge]?;
        let (row, column) = (row % edge, column % edge);
        Some(if self.is_turned(face) {
            (face, edge - 1 - row, edge - 1 - column)
        } else {
            (face, row, column)
        })
    }

    /// Gathers the faces in file order, each upright, row by row.
    pub(crate) fn gather(self, pixels: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let (edge, width) = (self.edge, self.edge * self.across);
        let mut faces = Vec::with_capacity(6 * edge * edge);
        for face in Face::ALL {
            let cell = self.cells.iter().position(|&cell| cell == Some(face)).unwrap_or(0);
            let origin = cell / self.across * edge * width + cell % self.across * edge;
            let row = |row: usize| &pixels[origin + row * width..][..edge];
            for down in 0..edge {
                if self.is_turned(face) {
                    faces.extend(row(edge - 1 - down).iter().rev());
                } else {
                    faces.extend_from_slice(row(down));
                }
            }
        }
        faces
    }

    /// Whether a face is turned by half a turn: -Z below -Y in the vertical cross.
    fn is_turned(self, face: Face) -> bool {
        self.across == 3 && face == Face::NegativeZ
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Layout;
    use sphere::Cube;

    #[test]
    fn crosses_are_continuous_across_their_folds() {
        let edge = 8;
        for (width, height, folds) in [(4 * edge, 3 * edge, 5), (3 * edge, 4 * edge, 5)] {
            let look = |row, column| Layout::CubeCross.direction(width, height, row, column);
            let mut crossed = 0;
            for row in 0..height {
                for column in 0..width {
                    for (next_row, next_column) in [(row + 1, column), (row, column + 1)] {
                        let (Some(here), Some(next)) = (look(row, column), look(next_row, next_column))
                        else {
                            continue;
                        };
                        // Texels of a face are 2 / edge apart at most, over a fold too.
                        let step = (here.vector() - next.vector()).length();
                        assert!(step < 2.0 / edge as f64, "{row} {column}: {step}");
                        crossed +=
                            usize::from(row / edge != next_row / edge || column / edge != next_column / edge);
                    }
                }
            }
            // A cube unfolds over five of its twelve edges.
            assert_eq!(crossed, folds * edge);
        }
        // The horizontal cross also closes from -Z to -X.
        let look = |column| Layout::CubeCross.direction(32, 24, 12, column).unwrap().vector();
        assert!((look(31) - look(0)).length() < 2.0 / edge as f64);
    }

    #[test]
    fn strips_hold_the_faces_in_file_order() {
        let cube = Cube { edge: 4 };
        for (k, face) in Face::ALL.into_iter().enumerate() {
            let expected = Some(cube.direction(face, 1, 2));
            assert_eq!(Layout::CubeStrip.direction(24, 4, 1, 4 * k + 2), expected);
            assert_eq!(Layout::CubeStrip.direction(4, 24, 4 * k + 1, 2), expected);
            assert_eq!(Layout::Cube.direction(4, 24, 4 * k + 1, 2), expected);
        }
    }

    #[test]
    fn gathered_faces_are_those_of_the_pixels() {
        for (layout, width, height) in [
            (Layout::Cube, 3, 18),
            (Layout::CubeStrip, 18, 3),
            (Layout::CubeStrip, 3, 18),
            (Layout::CubeCross, 12, 9),
            (Layout::CubeCross, 9, 12),
        ] {
            let pixels: Vec<_> = (0..width * height).map(|k| [k as f32, 0.0, 0.0]).collect();
            let arrangement = layout.faces(width, height).unwrap();
            let faces = arrangement.gather(&pixels);
            assert_eq!(faces.len(), 54);
            let mut seen = 0;
            for row in 0..height {
                for column in 0..width {
                    if let Some((face, r, c)) = arrangement.texel(row, column) {
                        assert_eq!(faces[(face as usize * 3 + r) * 3 + c], pixels[row * width + column]);
                        seen += 1;
                    }
                }
            }
            assert_eq!(seen, 54, "{layout:?}");
        }
    }

    #[test]
    fn faces_of_different_sizes_are_named() {
        let square = |edge: usize| Image::new(edge, edge, vec![[0.0; 3]; edge * edge]).unwrap();
        let mut faces = std::array::from_fn(|_| square(2));
        assert_eq!(stack_faces(faces.clone()).unwrap().height(), 12);
        faces[3] = square(3);
        assert_eq!(
            stack_faces(faces).unwrap_err().to_string(),
            "the six faces of a cube are square and equally large; face ny is 3 x 3, face px has 2 columns"
        );
    }
}
