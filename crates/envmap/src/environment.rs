//! Distant light as an image on the sphere.

use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use sh::{ImageRows, Stop, Stopped, unstopped};
use sphere::{AngularProbe, Cube, Direction, LatLong, MirrorBall, OpenExrCube, OpenExrLatLong, Rotation};

use crate::area;
use crate::audit::audit;
use crate::canvas::{LatLongCanvas, MOST_TEXELS};
use crate::cube_map::CubeMap;
use crate::error::Error;
use crate::fill::{Completed, Fill, placed};
use crate::image::Image;
use crate::lat_long_on_cube::LatLongOnCube;
use crate::layout::Layout;
use crate::part::Part;
use crate::pixels::{CodedRows, Pixels};
use crate::resample::{OnCanvas, resample, resample_points};
use crate::texels::{Texels, Turned};

/// Distant light: linear Rec. 709 radiance on a lat-long grid in Specula's frame.
///
/// `pixels` has `grid.height` rows of `grid.width` texels, row 0 toward +Z; all values are finite.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    grid: LatLong,
    pixels: Pixels,
}

impl Environment {
    /// An environment; `None` if the number of pixels is not that of the grid, or a value is not finite.
    pub fn new(grid: LatLong, pixels: Vec<[f32; 3]>) -> Option<Self> {
        let fits = grid.width.checked_mul(grid.height) == Some(pixels.len()) && !pixels.is_empty();
        (fits && pixels.as_flattened().iter().all(|value| value.is_finite())).then(|| Self::of(grid, pixels))
    }

    /// The environment whose rows [`Environment::blocks`] gave; `None` if there are not as many blocks as the
    /// grid needs, or a value is not finite.
    pub fn from_blocks(grid: LatLong, blocks: Vec<CodedRows>) -> Option<Self> {
        let fits = !grid.is_empty() && blocks.len() == CodedRows::count(grid.height);
        (fits && blocks.iter().all(CodedRows::is_finite))
            .then(|| Self { grid, pixels: Pixels::of_blocks(grid.width, grid.height, blocks) })
    }

    fn of(grid: LatLong, pixels: Vec<[f32; 3]>) -> Self {
        Self { grid, pixels: Pixels::new(grid.width, pixels) }
    }

    /// The environment that a picture shows, on the lat-long grid `grid`, by default
    /// [`Layout::default_grid`].
    ///
    /// A lat-long image that keeps its size is not resampled; one that shrinks by whole factors is averaged
    /// by exact areas ([`Environment::downsampled`]). Every other picture is interpolated bilinearly, across
    /// poles, seams and the edges of cubes, at nine points or more on each of its texels, and averaged over
    /// each new texel. A constant stays constant up to rounding. Lights of a texel or two keep their energy
    /// up to f32 rounding; smooth pictures of texel size h are blurred by h^2 / 12 + g^2 / 24 times their
    /// Laplacian, g the size of the new texels (`tests/conversion.rs` measures both for every layout).
    ///
    /// Pixels that the layout does not use (the corners of a disk, blank cells) are never read.
    ///
    /// # Errors
    /// [`Error::Shape`] if the picture does not have the shape of the layout, [`Error::BadPixels`] if a value
    /// that is used is NaN or infinite, [`Error::Resolution`] if the grid is empty or larger than 2^28
    /// texels.
    ///
    /// # Example: a constant probe makes a constant sky
    ///
    /// ```
    /// use envmap::{Environment, Image, Layout};
    ///
    /// let probe = Image::new(8, 8, vec![[0.5; 3]; 64]).expect("64 pixels");
    /// let sky = Environment::from_image(probe, Layout::Probe, None)?;
    /// assert_eq!((sky.grid().width, sky.grid().height), (8, 4));
    /// assert!(sky.pixels().iter().all(|pixel| *pixel == [0.5; 3]));
    /// # Ok::<(), envmap::Error>(())
    /// ```
    pub fn from_image(image: Image, layout: Layout, grid: Option<LatLong>) -> Result<Self, Error> {
        let (width, height) = (image.width(), image.height());
        let own = layout.default_grid(width, height)?;
        let grid = checked(grid.unwrap_or(own))?;
        let bad = audit(&image, layout)?;
        if bad.nan.is_some() || bad.infinite.is_some() {
            return Err(Error::BadPixels(Box::new(bad)));
        }
        if layout == Layout::LatLong {
            let whole = Self { grid: own, pixels: image.stored().clone() };
            return if grid == own { Ok(whole) } else { whole.resized(grid) };
        }
        let (pixels, canvas) = (image.stored(), LatLongCanvas::new(grid));
        let pixels = match layout {
            Layout::LatLong => resample(own, pixels, &canvas),
            Layout::OpenExrLatLong => resample(OpenExrLatLong { width, height }, pixels, &canvas),
            Layout::OpenExrCube => resample(OpenExrCube { edge: width }, pixels, &canvas),
            Layout::Probe => resample(AngularProbe { edge: width }, pixels, &canvas),
            Layout::MirrorBall => resample(MirrorBall { edge: width }, pixels, &canvas),
            Layout::Cube | Layout::CubeCross | Layout::CubeStrip => {
                let faces = layout.faces(width, height).ok_or_else(|| layout.misfit(width, height))?;
                let cube = Cube { edge: faces.edge() };
                let pixels = Pixels::new(cube.edge, faces.gather(image.pixels()));
                resample(cube, &pixels, &canvas)
            }
        };
        Ok(Self::of(grid, pixels))
    }

    /// The environment that a picture of a part of the sphere shows, completed by `fill`, on the lat-long
    /// grid `grid`, by default [`Part::default_grid`].
    ///
    /// A piece of a lat-long image whose pixels are texels of the default grid keeps them. Every other
    /// picture is resampled as by [`Environment::from_image`]; texels across its border mix both sides by
    /// area.
    ///
    /// # Errors
    /// [`Error::PartSize`] if the picture is not as large as the part, [`Error::BadPixels`] if a value that
    /// is used is NaN or infinite, [`Error::Resolution`] if the grid is empty or larger than 2^28 texels.
    ///
    /// # Example: the upper half of a sky, over black
    ///
    /// ```
    /// use envmap::{Environment, Fill, Image, Part};
    ///
    /// let upper = Image::new(8, 2, vec![[1.0; 3]; 16]).expect("16 pixels");
    /// let part = Part::of_lat_long([8, 2], [8.0, 4.0], [0.0, 0.0]).expect("it fits");
    /// let sky = Environment::from_part(upper, &part, Fill::Black, None)?;
    /// assert_eq!((sky.grid().width, sky.grid().height), (8, 4));
    /// assert!((sky.integral()[0] - std::f64::consts::TAU).abs() < 1e-12);
    /// # Ok::<(), envmap::Error>(())
    /// ```
    pub fn from_part(image: Image, part: &Part, fill: Fill, grid: Option<LatLong>) -> Result<Self, Error> {
        let own = checked(part.default_grid())?;
        let grid = checked(grid.unwrap_or(own))?;
        let bad = audit(&image, *part)?;
        if bad.nan.is_some() || bad.infinite.is_some() {
            return Err(Error::BadPixels(Box::new(bad)));
        }
        if let Some(corner) = part.aligned() {
            let whole = Self::of(own, placed(image, part, fill, own, corner));
            return if grid == own { Ok(whole) } else { whole.resized(grid) };
        }
        let width = image.width();
        let (completed, pixels) = Completed::new(image, part, fill);
        let pixels = Pixels::new(width, pixels);
        Ok(Self::of(grid, resample(completed, &pixels, &LatLongCanvas::new(grid))))
    }

    /// The environment of a cube map, resampled as by [`Environment::from_image`].
    ///
    /// # Errors
    /// [`Error::Resolution`] if the grid is empty or larger than 2^28 texels.
    pub fn from_cube_map(map: &CubeMap, grid: LatLong) -> Result<Self, Error> {
        let grid = checked(grid)?;
        let pixels = Pixels::new(map.cube().edge, map.pixels().to_vec());
        let pixels = resample(map.cube(), &pixels, &LatLongCanvas::new(grid));
        Ok(Self::of(grid, pixels))
    }

    /// The environment on a cube of any size: the mean over each texel of the bilinearly interpolated image,
    /// as by [`Environment::from_image`].
    ///
    /// # Errors
    /// [`Error::Resolution`] if the cube is empty or larger than 2^28 texels.
    pub fn cube_map(&self, cube: Cube) -> Result<CubeMap, Error> {
        let edge = cube.edge;
        checked(LatLong { width: edge, height: edge.saturating_mul(6) })?;
        let points = LatLongOnCube::new(self.grid, cube);
        let pixels = unstopped(|stop| resample_points(self.grid, &self.pixels, &points, stop));
        Ok(CubeMap::from_complete(cube, pixels))
    }

    /// The grid of the texels.
    pub fn grid(&self) -> LatLong {
        self.grid
    }

    /// RGB radiance, row by row from the top. If the environment was imported or read from the cache, its
    /// rows are decoded at the first call and kept, at 12 bytes for each pixel;
    /// [`Environment::map_rows`] needs only a few of them at a time.
    pub fn pixels(&self) -> &[[f32; 3]] {
        self.pixels.whole()
    }

    /// The environment as a picture, of which nothing is decoded or copied.
    pub fn to_image(&self) -> Image {
        Image::of(self.grid, self.pixels.clone())
    }

    /// The results of a function for blocks of rows, in their order. The function gets the first row's number
    /// and the pixels of some whole rows. It runs on all threads; `stop` is asked before each block.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn map_rows<T: Send>(
        &self,
        stop: Stop<'_>,
        function: impl Fn(usize, &[[f32; 3]]) -> T + Sync,
    ) -> Result<Vec<T>, Stopped> {
        self.pixels.map_blocks(stop, function)
    }

    /// [`Environment::map_rows`] of those blocks alone that may have a pixel whose channels have a mean above
    /// `radiance`. Others are not decoded if the sums of their rows are known.
    pub(crate) fn map_brighter_rows<T: Send>(
        &self,
        radiance: f64,
        stop: Stop<'_>,
        function: impl Fn(usize, &[[f32; 3]]) -> T + Sync,
    ) -> Result<Vec<T>, Stopped> {
        self.pixels.map_blocks_where(stop, |block| self.pixels.may_exceed(block, radiance), function)
    }

    /// Some rows, which are decoded into `scratch` if they are not there as floats.
    pub(crate) fn rows<'a>(&'a self, rows: Range<usize>, scratch: &'a mut Vec<[f32; 3]>) -> &'a [[f32; 3]] {
        self.pixels.rows(rows, scratch)
    }

    /// The rows in blocks, compressed without loss: [`CodedRows::HEIGHT`] rows each, but the last.
    pub fn blocks(&self) -> Vec<CodedRows> {
        self.pixels.blocks()
    }

    /// This environment with other values of some texels, which must be finite: numbers of texels, in rising
    /// order, and their values.
    pub(crate) fn replaced(&self, texels: Vec<(u32, [f32; 3])>) -> Self {
        Self { grid: self.grid, pixels: self.pixels.clone().replaced(texels) }
    }

    /// Radiance in a direction, interpolated bilinearly between the four nearest texels, also across the seam
    /// and the poles.
    pub fn radiance(&self, direction: Direction) -> [f64; 3] {
        self.grid.taps(direction).blend(self.pixels())
    }

    /// The integral of radiance over the sphere, in the unit of radiance times sr.
    pub fn integral(&self) -> [f64; 3] {
        unstopped(|stop| self.integral_until(stop))
    }

    /// [`Environment::integral`], unless it is stopped.
    pub(crate) fn integral_until(&self, stop: Stop<'_>) -> Result<[f64; 3], Stopped> {
        let sums = self.pixels.sums(stop)?;
        let mut sum = [0.0; 3];
        for (row, of_row) in sums.iter().flat_map(|sums| &sums.values).enumerate() {
            for channel in 0..3 {
                sum[channel] += of_row[channel] * self.grid.solid_angle(row);
            }
        }
        Ok(sum)
    }

    /// Multiplies radiance by 2^stops; `None` if a value becomes infinite.
    pub fn exposed(&self, stops: f64) -> Option<Self> {
        self.multiplied([math::exp2(stops); 3])
    }

    /// Multiplies red, green and blue by these factors; `None` if a value becomes infinite.
    pub fn multiplied(&self, factors: [f64; 3]) -> Option<Self> {
        if factors == [1.0; 3] {
            return Some(self.clone());
        }
        let all_finite = AtomicBool::new(true);
        let multiply = |_: usize, pixels: &mut [[f32; 3]]| {
            for pixel in pixels.iter_mut() {
                *pixel = [0, 1, 2].map(|c| (f64::from(pixel[c]) * factors[c]) as f32);
            }
            if !pixels.as_flattened().iter().all(|value| value.is_finite()) {
                all_finite.store(false, Ordering::Relaxed);
            }
        };
        let pixels = self.pixels.clone().changed(|_| true, multiply);
        all_finite.into_inner().then_some(Self { grid: self.grid, pixels })
    }

    /// The light turned by an active rotation R: the result at w is this environment at R^-1 w, on the same
    /// grid.
    ///
    /// A yaw by whole columns moves them exactly. Otherwise the image is interpolated bilinearly and averaged
    /// over the new texels, as by [`Environment::from_image`]: with square texels of size h = pi / height, a
    /// harmonic of degree l comes back smaller by l (l + 1) h^2 / 8 at most (0.4 percent at degree 30 of 1024
    /// x 512), less toward the poles, never negative, and lights of one texel keep their energy. Turning its
    /// harmonics instead has no such loss. `stop` is asked before each row.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn rotated(&self, rotation: Rotation, stop: Stop<'_>) -> Result<Self, Stopped> {
        let grid = self.grid;
        if let Some(shift) = whole_columns(rotation, grid.width) {
            let mut pixels = self.pixels().to_vec();
            // A positive yaw turns +X (the centre) toward +Y (the left quarter).
            pixels.chunks_mut(grid.width).for_each(|row| row.rotate_left(shift));
            return Ok(Self::of(grid, pixels));
        }
        let (picture, canvas) = (Turned::new(grid, rotation), &LatLongCanvas::new(grid));
        let points = OnCanvas { picture, canvas };
        let pixels = resample_points(picture, &self.pixels, &points, stop)?;
        Ok(Self::of(grid, pixels))
    }

    /// The means over the texels of a coarser grid, by exact solid angles: the integral over the sphere is
    /// preserved up to f32 rounding of the values.
    ///
    /// A finer grid gets blocks of equal values; [`Environment::resized`] interpolates instead.
    ///
    /// # Errors
    /// [`Error::Resolution`] if the grid is empty or larger than 2^28 texels.
    pub fn downsampled(&self, grid: LatLong) -> Result<Self, Error> {
        let grid = checked(grid)?;
        Ok(Self::of(grid, area::means(self.grid, &self.pixels, grid)))
    }

    /// The means over cells of equal area, by exact solid angles: `rows` rows equal in z from +Z down,
    /// `columns` columns equal in azimuth, the first from 0, toward +X, upward; the azimuth grows toward +Y.
    ///
    /// # Panics
    /// If a number is 0, or that of the columns is odd.
    pub fn means_of_equal_areas(&self, rows: usize, columns: usize) -> Vec<[f32; 3]> {
        assert!(rows > 0 && columns > 0 && columns.is_multiple_of(2), "a grid has an even number of columns");
        area::equal_area_means(self.grid, &self.pixels, rows, columns)
    }

    /// Returns the same light on another grid: by [`Environment::downsampled`] if each new texel consists of
    /// whole old ones, otherwise interpolated and averaged as by [`Environment::from_image`].
    ///
    /// # Errors
    /// [`Error::Resolution`] if the grid is empty or larger than 2^28 texels.
    pub fn resized(&self, grid: LatLong) -> Result<Self, Error> {
        let grid = checked(grid)?;
        if self.grid.width.is_multiple_of(grid.width) && self.grid.height.is_multiple_of(grid.height) {
            return self.downsampled(grid);
        }
        let pixels = resample(self.grid, &self.pixels, &LatLongCanvas::new(grid));
        Ok(Self::of(grid, pixels))
    }
}

impl ImageRows<f32> for Environment {
    fn pixel_count(&self) -> usize {
        self.grid.len()
    }

    fn rows_at_once(&self) -> usize {
        CodedRows::HEIGHT
    }

    fn read_rows<'a>(
        &'a self,
        _: usize,
        rows: Range<usize>,
        scratch: &'a mut Vec<[f32; 3]>,
    ) -> &'a [[f32; 3]] {
        self.rows(rows, scratch)
    }

    fn squares_of_rows(&self, _: usize, rows: Range<usize>, scratch: &mut Vec<[f32; 3]>) -> Vec<[f64; 3]> {
        let mut squares = Vec::with_capacity(rows.len());
        for block in rows.start / CodedRows::HEIGHT..CodedRows::count(rows.end) {
            let of_block = CodedRows::rows(self.grid.height, block);
            let sums = self.pixels.sums_of(block, scratch);
            let within = rows.start.max(of_block.start)..rows.end.min(of_block.end);
            squares
                .extend_from_slice(&sums.squares[within.start - of_block.start..within.end - of_block.start]);
        }
        squares
    }
}

/// Returns the grid, if it can be allocated.
fn checked(grid: LatLong) -> Result<LatLong, Error> {
    match grid.width.checked_mul(grid.height) {
        Some(1..=MOST_TEXELS) => Ok(grid),
        _ => Err(Error::Resolution { width: grid.width, height: grid.height }),
    }
}

/// The number of columns by which a rotation moves an image to the left, if it is a pure yaw by whole
/// columns.
fn whole_columns(rotation: Rotation, width: usize) -> Option<usize> {
    let matrix = rotation.matrix();
    // A column of the largest image is 2^28 of a turn; rounding is far below a thousandth of that.
    let upright = matrix.z_axis.x.abs().max(matrix.z_axis.y.abs()) < 1e-14 && matrix.z_axis.z > 0.0;
    let columns = math::atan2(matrix.x_axis.y, matrix.x_axis.x) / TAU * width as f64;
    (upright && (columns - columns.round()).abs() < 1e-9)
        .then(|| (columns.round() as isize).rem_euclid(width as isize) as usize)
}
