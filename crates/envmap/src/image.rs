//! A flat picture, without a layout.

/// A picture: RGB values, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    pixels: Vec<[f32; 3]>,
}

impl Image {
    /// A picture; `None` if it is empty or the number of pixels is not width x height.
    pub fn new(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Option<Self> {
        let fits = width.checked_mul(height) == Some(pixels.len());
        (width > 0 && height > 0 && fits).then_some(Self { width, height, pixels })
    }

    /// The number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// RGB values, row by row from the top.
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// RGB values, row by row from the top.
    pub fn pixels_mut(&mut self) -> &mut [[f32; 3]] {
        &mut self.pixels
    }

    /// The pixels alone, row by row from the top.
    pub fn into_pixels(self) -> Vec<[f32; 3]> {
        self.pixels
    }
}
