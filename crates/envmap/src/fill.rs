//! A picture of a part of the sphere, completed to the whole.

use sphere::{Direction, LatLong};

use crate::image::Image;
use crate::part::Part;
use crate::texels::{Taps, Texels};

/// The light that comes from where a picture shows nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Fill {
    /// No light comes from there.
    #[default]
    Black,
    /// The mean radiance of the picture over its part of the sphere.
    Mean,
    /// The radiance of the nearest pixel: up and down in a piece of a lat-long image, toward the axis in a
    /// fisheye.
    Edge,
    /// One radiance everywhere, linear Rec. 709.
    Colour([f32; 3]),
}

impl Fill {
    /// The radiance of the missing part; [`Fill::Edge`] has none of its own.
    fn radiance(self, image: &Image, part: &Part) -> [f32; 3] {
        match self {
            Self::Black | Self::Edge => [0.0; 3],
            Self::Colour(colour) => colour,
            Self::Mean => {
                let (mut sum, mut angle) = ([0.0; 3], 0.0);
                for (index, pixel) in image.pixels().iter().enumerate() {
                    let (row, column) = (index / image.width(), index % image.width());
                    if part.uses(row, column) {
                        let own = part.solid_angle(row, column);
                        (0..3).for_each(|channel| sum[channel] += own * f64::from(pixel[channel]));
                        angle += own;
                    }
                }
                sum.map(|sum| if angle > 0.0 { (sum / angle) as f32 } else { 0.0 })
            }
        }
    }
}

/// A part of the sphere and what surrounds it, as the texels of a picture with one more row, whose pixels all
/// hold the radiance of what is missing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Completed<'a> {
    part: &'a Part,
    edge: bool,
}

impl<'a> Completed<'a> {
    /// Prepares the texels, and their pixels.
    pub(crate) fn new(image: Image, part: &'a Part, fill: Fill) -> (Self, Vec<[f32; 3]>) {
        let radiance = fill.radiance(&image, part);
        let width = image.width();
        let mut pixels = image.into_pixels();
        pixels.resize(pixels.len() + width, radiance);
        (Self { part, edge: fill == Fill::Edge }, pixels)
    }

    /// The texel of the pixel in a direction, or that of the missing part.
    pub(crate) fn texel(self, direction: Direction) -> usize {
        let [width, height] = self.part.size();
        match self.part.place(direction) {
            Some([x, y]) => {
                let at = |value: f64, length: usize| (value as usize).min(length - 1);
                at(y, height) * width + at(x, width)
            }
            None if self.edge => self.part.nearest(direction),
            None => width * height,
        }
    }
}

impl Texels for Completed<'_> {
    fn taps(self, direction: Direction) -> Taps {
        let only = |texel: usize| Taps { index: [texel; 4], weight: [1.0, 0.0, 0.0, 0.0] };
        let [width, height] = self.part.size();
        let Some([x, y]) = self.part.place(direction) else { return only(self.texel(direction)) };
        let (left, top) = ((x - 0.5).floor(), (y - 0.5).floor());
        let (across, down) = (x - 0.5 - left, y - 0.5 - top);
        let columns = [left as isize, left as isize + 1].map(|column| self.part.column(column));
        let rows = [top as isize, top as isize + 1].map(|row| row.clamp(0, height as isize - 1) as usize);
        let mut taps = Taps { index: [0; 4], weight: [0.0; 4] };
        let mut sum = 0.0;
        for (k, (weight, [row, column])) in [
            ((1.0 - across) * (1.0 - down), [rows[0], columns[0]]),
            (across * (1.0 - down), [rows[0], columns[1]]),
            ((1.0 - across) * down, [rows[1], columns[0]]),
            (across * down, [rows[1], columns[1]]),
        ]
        .into_iter()
        .enumerate()
        {
            taps.index[k] = row * width + column;
            // At the rim of a fisheye, only pixels inside count.
            taps.weight[k] = if self.part.uses(row, column) { weight } else { 0.0 };
            sum += taps.weight[k];
        }
        if sum < 1e-9 {
            return only(self.part.nearest(direction));
        }
        taps.weight = taps.weight.map(|weight| weight / sum);
        taps
    }

    fn side(self, direction: Direction, radius: f64) -> f64 {
        self.part.side(direction, radius)
    }

    fn uses(self, texel: usize) -> bool {
        let width = self.part.size()[0];
        self.part.uses(texel / width, texel % width)
    }

    fn solid_angle(self, texel: usize) -> f64 {
        let width = self.part.size()[0];
        if self.uses(texel) { self.part.solid_angle(texel / width, texel % width) } else { 0.0 }
    }

    fn direction(self, texel: usize) -> Option<Direction> {
        let width = self.part.size()[0];
        self.part.direction(texel / width, texel % width)
    }
}

/// The picture on a grid that holds its pixels as they are, with its corner at a column and a row.
pub(crate) fn placed(
    image: Image,
    part: &Part,
    fill: Fill,
    grid: LatLong,
    corner: [usize; 2],
) -> Vec<[f32; 3]> {
    let [width, height] = part.size();
    let (completed, pixels) = Completed::new(image, part, fill);
    let mut out = Vec::with_capacity(grid.len());
    for row in 0..grid.height {
        for column in 0..grid.width {
            let [x, y] = [(column + grid.width - corner[0]) % grid.width, row.wrapping_sub(corner[1])];
            let texel = match x < width && y < height {
                true => y * width + x,
                false => completed.texel(grid.direction(row, column)),
            };
            out.push(pixels[texel]);
        }
    }
    out
}
