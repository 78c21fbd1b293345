//! The layouts of the sphere in a picture.

use std::f64::consts::FRAC_PI_4;

use sphere::{AngularProbe, Cube, Direction, Face, LatLong, MirrorBall, OpenExrCube, OpenExrLatLong};

use crate::error::Error;
use crate::faces::{Arrangement, CROSSES, STACKS, STRIPS};

/// The arrangement of the sphere in a picture; the crate `sphere` defines the directions of each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Layout {
    /// Equirectangular, twice as wide as high, pixel centres at half texels ([`sphere::LatLong`]).
    LatLong,
    /// An angular map in a square ([`sphere::AngularProbe`]); pixels outside the disk are ignored.
    Probe,
    /// A mirror ball that fills a square ([`sphere::MirrorBall`]); pixels outside the disk are ignored.
    MirrorBall,
    /// A cube unfolded around +Z: 4 x 3 cells (horizontal) or 3 x 4 (vertical); the blank cells are ignored.
    ///
    /// ```text
    ///       +Y                     +Y
    ///   -X  +Z  +X  -Z         -X  +Z  +X
    ///       -Y                     -Y
    ///                              -Z
    /// ```
    ///
    /// In the vertical cross -Z hangs below -Y and is turned by half a turn, so that the picture continues
    /// over that fold. All other faces are oriented as in a cube map of six images.
    CubeCross,
    /// Six faces +X -X +Y -Y +Z -Z side by side (6 x 1) or stacked (1 x 6), none of them turned.
    CubeStrip,
    /// Six faces from six files, stacked by [`crate::stack_faces`]: +X -X +Y -Y +Z -Z from the top.
    Cube,
    /// The lat-long map of OpenEXR's `envmap` attribute: pixel centres on the poles, the first column
    /// repeated at the right edge ([`sphere::OpenExrLatLong`]).
    OpenExrLatLong,
    /// The cube map of OpenEXR's `envmap` attribute: six faces stacked, pixel centres on the edges of
    /// the cube ([`sphere::OpenExrCube`]).
    OpenExrCube,
}

impl Layout {
    /// All layouts.
    pub const ALL: [Self; 8] = [
        Self::LatLong,
        Self::Probe,
        Self::MirrorBall,
        Self::CubeCross,
        Self::CubeStrip,
        Self::Cube,
        Self::OpenExrLatLong,
        Self::OpenExrCube,
    ];

    /// The layout's name in a manifest.
    pub const fn name(self) -> &'static str {
        match self {
            Self::LatLong => "lat-long",
            Self::Probe => "probe",
            Self::MirrorBall => "mirror-ball",
            Self::CubeCross => "cube-cross",
            Self::CubeStrip => "cube-strip",
            Self::Cube => "cube",
            Self::OpenExrLatLong => "openexr-lat-long",
            Self::OpenExrCube => "openexr-cube",
        }
    }

    /// The layout with a name in a manifest.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|layout| layout.name() == name)
    }

    /// The shape that a picture must have, as the beginning of a message.
    const fn rule(self) -> &'static str {
        match self {
            Self::LatLong => "a lat-long image is twice as wide as high",
            Self::Probe => "an angular probe is square",
            Self::MirrorBall => "the image of a mirror ball is square",
            Self::CubeCross => {
                "a cube cross is 4 cells wide and 3 high, or 3 wide and 4 high, of square cells"
            }
            Self::CubeStrip => "a cube strip is six times as wide as high, or six times as high as wide",
            Self::Cube => "six stacked cube faces are six times as high as wide",
            Self::OpenExrLatLong => {
                "a lat-long image of OpenEXR's envmap attribute is twice as wide as high, give or take a column, \
                 and has two rows or more"
            }
            Self::OpenExrCube => {
                "a cube image of OpenEXR's envmap attribute is six times as high as wide, and two columns or more"
            }
        }
    }

    /// Checks the shape of a picture.
    ///
    /// # Errors
    /// [`Error::Shape`], which names the expected shape and a layout that would fit.
    pub fn check(self, width: usize, height: usize) -> Result<(), Error> {
        if self.fits(width, height) { Ok(()) } else { Err(self.misfit(width, height)) }
    }

    /// The error for a picture without the shape of the layout.
    pub(crate) fn misfit(self, width: usize, height: usize) -> Error {
        let fitting = Self::ALL.into_iter().find(|layout| *layout != self && layout.fits(width, height));
        Error::Shape { rule: self.rule(), width, height, fitting: fitting.map(Self::name) }
    }

    fn fits(self, width: usize, height: usize) -> bool {
        let fits = match self {
            Self::LatLong => Some(width) == height.checked_mul(2),
            Self::Probe | Self::MirrorBall => width == height,
            Self::CubeCross | Self::CubeStrip => self.faces(width, height).is_some(),
            Self::Cube => Some(height) == width.checked_mul(6),
            Self::OpenExrLatLong => height >= 2 && height.saturating_mul(2).abs_diff(width) <= 1,
            Self::OpenExrCube => width >= 2 && Some(height) == width.checked_mul(6),
        };
        fits && width > 0 && height > 0
    }

    /// The default grid of the environment that a picture is resampled to.
    ///
    /// A lat-long image keeps its size. Otherwise a texel at the equator is as large as, or smaller than, the
    /// picture's texels in the middle (of a cube: in the middle of a face), and there are twice as many
    /// columns as rows: an angular map of N x N has N columns (it spends 2 pi / N per texel along any line
    /// through its centre), a mirror ball pi N / 2 (its middle is denser: 4 / N), a cube four times the edge
    /// of a face (2 / edge in the middle of a face, 1 / edge at its rim), and OpenEXR's lat-long as many rows
    /// as it has.
    ///
    /// # Errors
    /// [`Error::Shape`] if the picture does not have the shape of the layout.
    pub fn default_grid(self, width: usize, height: usize) -> Result<LatLong, Error> {
        self.check(width, height)?;
        Ok(match self {
            Self::LatLong => LatLong { width, height },
            Self::OpenExrLatLong => LatLong::with_rows(height),
            Self::Probe => LatLong::with_rows(width.div_ceil(2)),
            Self::MirrorBall => LatLong::with_rows((FRAC_PI_4 * width as f64).ceil() as usize),
            Self::CubeCross | Self::CubeStrip => {
                LatLong::with_rows(2 * self.faces(width, height).map_or(1, |a| a.edge()))
            }
            Self::Cube | Self::OpenExrCube => LatLong::with_rows(2 * width),
        })
    }

    /// The direction of a pixel of a picture of this shape; `None` if the layout does not use the pixel
    /// (corners around a disk, blank cells of a cross), the pixel is not in the picture, or the shape is
    /// wrong.
    pub fn direction(self, width: usize, height: usize, row: usize, column: usize) -> Option<Direction> {
        if !self.fits(width, height) || row >= height || column >= width {
            return None;
        }
        match self {
            Self::LatLong => Some(LatLong { width, height }.direction(row, column)),
            Self::OpenExrLatLong => Some(OpenExrLatLong { width, height }.direction(row, column)),
            Self::Probe => AngularProbe { edge: width }.direction(row, column),
            Self::MirrorBall => MirrorBall { edge: width }.direction(row, column),
            Self::OpenExrCube => Some(OpenExrCube { edge: width }.direction(row, column)),
            Self::Cube | Self::CubeCross | Self::CubeStrip => {
                let arrangement = self.faces(width, height)?;
                let (face, row, column) = arrangement.texel(row, column)?;
                Some(Cube { edge: arrangement.edge() }.direction(face, row, column))
            }
        }
    }

    /// The solid angle of a pixel of a picture of this shape, in steradians; 0 if the layout does not use the
    /// pixel, the pixel is not in the picture, or the shape is wrong.
    pub fn solid_angle(self, width: usize, height: usize, row: usize, column: usize) -> f64 {
        if !self.fits(width, height) || row >= height || column >= width {
            return 0.0;
        }
        match self {
            Self::LatLong => LatLong { width, height }.solid_angle(row),
            Self::OpenExrLatLong => OpenExrLatLong { width, height }.solid_angle(row, column),
            Self::Probe => AngularProbe { edge: width }.solid_angle(row, column),
            Self::MirrorBall => MirrorBall { edge: width }.solid_angle(row, column),
            Self::OpenExrCube => OpenExrCube { edge: width }.solid_angle(row, column),
            Self::Cube | Self::CubeCross | Self::CubeStrip => {
                let Some(arrangement) = self.faces(width, height) else { return 0.0 };
                arrangement.texel(row, column).map_or(0.0, |(_, row, column)| {
                    Cube { edge: arrangement.edge() }.solid_angle(row, column)
                })
            }
        }
    }

    /// The places of the faces; `None` if the layout has no faces or the shape is wrong.
    pub(crate) fn faces(self, width: usize, height: usize) -> Option<Arrangement> {
        let arrangements = match self {
            Self::Cube => STACKS,
            Self::CubeStrip => STRIPS,
            Self::CubeCross => CROSSES,
            _ => &[],
        };
        Arrangement::fitting(arrangements, width, height)
    }

    /// The face that holds a pixel, if the layout has the faces of [`Cube`] and uses the pixel.
    pub(crate) fn face(self, width: usize, height: usize, row: usize, column: usize) -> Option<Face> {
        Some(self.faces(width, height)?.texel(row, column)?.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip() {
        for layout in Layout::ALL {
            assert_eq!(Layout::from_name(layout.name()), Some(layout));
        }
        assert_eq!(Layout::from_name("lat long"), None);
    }

    #[track_caller]
    fn check(layout: Layout, width: usize, height: usize, message: &str) {
        assert_eq!(layout.check(width, height).unwrap_err().to_string(), message);
    }

    #[test]
    fn a_wrong_shape_says_what_was_expected_and_what_would_fit() {
        check(
            Layout::LatLong,
            1000,
            1000,
            "a lat-long image is twice as wide as high; this one is 1000 x 1000: is it layout = \"probe\"?",
        );
        check(
            Layout::Probe,
            1024,
            512,
            "an angular probe is square; this one is 1024 x 512: is it layout = \"lat-long\"?",
        );
        check(
            Layout::LatLong,
            768,
            1024,
            "a lat-long image is twice as wide as high; this one is 768 x 1024: is it layout = \"cube-cross\"?",
        );
        check(
            Layout::CubeCross,
            600,
            100,
            "a cube cross is 4 cells wide and 3 high, or 3 wide and 4 high, of square cells; this one is \
             600 x 100: is it layout = \"cube-strip\"?",
        );
        check(Layout::MirrorBall, 7, 5, "the image of a mirror ball is square; this one is 7 x 5");
        assert!(Layout::LatLong.check(usize::MAX, usize::MAX / 2).is_err());
    }

    #[test]
    fn openexr_lat_long_may_lack_a_column_or_have_one_more() {
        for width in [1023, 1024, 1025] {
            assert!(Layout::OpenExrLatLong.check(width, 512).is_ok());
        }
        assert!(Layout::OpenExrLatLong.check(1022, 512).is_err());
        assert!(Layout::OpenExrLatLong.check(2, 1).is_err());
    }

    #[test]
    fn the_pixels_of_every_layout_cover_the_sphere() {
        for (layout, width, height) in [
            (Layout::LatLong, 16, 8),
            (Layout::OpenExrLatLong, 17, 9),
            (Layout::Probe, 16, 16),
            (Layout::MirrorBall, 16, 16),
            (Layout::OpenExrCube, 8, 48),
            (Layout::Cube, 8, 48),
            (Layout::CubeCross, 32, 24),
            (Layout::CubeStrip, 48, 8),
        ] {
            let pixels = (0..width * height).map(|index| (index / width, index % width));
            let angles = pixels.map(|(row, column)| layout.solid_angle(width, height, row, column));
            let sphere = angles.sum::<f64>() / (4.0 * std::f64::consts::PI);
            // The rim of a probe is integrated with the midpoints of a grid.
            assert!((sphere - 1.0).abs() < 1e-3, "{layout:?}: {sphere}");
        }
    }

    #[test]
    fn default_grids_are_no_coarser_than_the_middle_of_the_picture() {
        let rows = |layout: Layout, width, height| layout.default_grid(width, height).unwrap();
        assert_eq!(rows(Layout::LatLong, 64, 32), LatLong { width: 64, height: 32 });
        assert_eq!(rows(Layout::Probe, 1000, 1000), LatLong { width: 1000, height: 500 });
        assert_eq!(rows(Layout::MirrorBall, 100, 100), LatLong { width: 158, height: 79 });
        assert_eq!(rows(Layout::Cube, 256, 1536), LatLong { width: 1024, height: 512 });
        assert_eq!(rows(Layout::CubeCross, 1024, 768), LatLong { width: 1024, height: 512 });
        assert_eq!(rows(Layout::CubeStrip, 1536, 256), LatLong { width: 1024, height: 512 });
        assert_eq!(rows(Layout::OpenExrLatLong, 1023, 512), LatLong { width: 1024, height: 512 });
        assert_eq!(rows(Layout::OpenExrCube, 256, 1536), LatLong { width: 1024, height: 512 });
    }
}
