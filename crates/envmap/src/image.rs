//! A flat picture, without a layout.

use std::ops::Range;

use sphere::LatLong;

use crate::pixels::{CodedRows, Pixels};

/// A picture: RGB values, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    pixels: Pixels,
}

impl Image {
    /// A picture; `None` if it is empty or the number of pixels is not width x height.
    pub fn new(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Option<Self> {
        let fits = width.checked_mul(height) == Some(pixels.len());
        (width > 0 && height > 0 && fits).then(|| Self { width, height, pixels: Pixels::new(width, pixels) })
    }

    /// A picture of blocks of rows, each of [`CodedRows::HEIGHT`] rows except the last; `None` if it is empty
    /// or there are not as many blocks.
    pub fn from_blocks(width: usize, height: usize, blocks: Vec<CodedRows>) -> Option<Self> {
        let fits = width > 0 && height > 0 && blocks.len() == CodedRows::count(height);
        fits.then(|| Self { width, height, pixels: Pixels::of_blocks(width, height, blocks) })
    }

    pub(crate) fn of(grid: LatLong, pixels: Pixels) -> Self {
        Self { width: grid.width, height: grid.height, pixels }
    }

    /// The picture, changed by a function in each block that may have a negative, infinite or NaN value. The
    /// function gets the first row's number and the pixels of all rows.
    pub(crate) fn changed(mut self, change: impl Fn(usize, &mut [[f32; 3]]) + Sync) -> Self {
        let clean: Vec<bool> =
            (0..CodedRows::count(self.height)).map(|block| self.pixels.is_clean(block)).collect();
        self.pixels = self.pixels.changed(|block| !clean[block], change);
        self
    }

    pub(crate) fn stored(&self) -> &Pixels {
        &self.pixels
    }

    /// The number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// RGB values, row by row from the top. Blocks of rows are decoded at the first call.
    pub fn pixels(&self) -> &[[f32; 3]] {
        self.pixels.whole()
    }

    /// RGB values of some rows, which are decoded into `scratch` if the picture consists of blocks.
    pub fn rows<'a>(&'a self, rows: Range<usize>, scratch: &'a mut Vec<[f32; 3]>) -> &'a [[f32; 3]] {
        self.pixels.rows(rows, scratch)
    }

    /// RGB values, row by row from the top.
    pub fn pixels_mut(&mut self) -> &mut [[f32; 3]] {
        self.pixels.whole_mut()
    }

    /// The pixels alone, row by row from the top.
    pub fn into_pixels(self) -> Vec<[f32; 3]> {
        self.pixels.into_whole()
    }
}
