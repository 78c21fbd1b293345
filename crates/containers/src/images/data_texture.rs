//! A picture whose numbers are data rather than colours: PNG, JPEG or WebP.
//!
//! Numbers are taken as they are stored, 0 to 1 for integers; profiles and gamma do not apply.

use brdf::Wrap;

use super::raster::Raster;
use super::recognition::identify;
use super::{jpeg, png, webp};
use crate::error::Error;
use crate::format::Format;

/// The texels of a picture, red, green, blue and alpha as they are stored.
#[derive(Clone, Debug, PartialEq)]
pub struct DataTexture {
    width: usize,
    height: usize,
    texels: Vec<[f32; 4]>,
}

impl DataTexture {
    /// Reads a picture. A grey one has three equal channels, one without alpha 1 there.
    ///
    /// # Errors
    /// If it is not PNG, JPEG or WebP, or is damaged.
    pub fn read(bytes: &[u8]) -> Result<Self, Error> {
        let raster = raster_of_texture(bytes)?;
        let (channels, depth) = (raster.channels, raster.depth);
        let number = |sample: &[u8]| match *sample {
            [code] => f32::from(code) / 255.0,
            [a, b] => f32::from(u16::from_ne_bytes([a, b])) / 65535.0,
            _ => 0.0,
        };
        let texels = raster.samples.chunks_exact(channels * depth).map(|pixel| {
            let mut numbers = [1.0; 4];
            let stored = pixel.chunks_exact(depth).map(number);
            numbers.iter_mut().zip(stored).for_each(|(slot, number)| *slot = number);
            match channels {
                1 => [numbers[0], numbers[0], numbers[0], 1.0],
                2 => [numbers[0], numbers[0], numbers[0], numbers[1]],
                _ => numbers,
            }
        });
        Ok(Self { width: raster.width, height: raster.height, texels: texels.collect() })
    }

    /// The number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The texels, row by row from the top.
    pub fn texels(&self) -> &[[f32; 4]] {
        &self.texels
    }

    /// The four numbers at coordinates (u, v), v downward, between the four nearest texels; `wrap` along u
    /// and v.
    ///
    /// # Example: the middle of black and white is grey
    /// ```
    /// use containers::{DataTexture, Wrap, write_png};
    /// let texture = DataTexture::read(&write_png(2, 1, &[[0; 3], [255; 3]], None)?)?;
    /// assert_eq!(texture.at([0.5, 0.5], [Wrap::Clamp; 2], |texel| texel), [0.5, 0.5, 0.5, 1.0]);
    /// # Ok::<(), containers::Error>(())
    /// ```
    pub fn at<const N: usize>(
        &self,
        coordinates: [f32; 2],
        wrap: [Wrap; 2],
        decode: impl Fn([f32; 4]) -> [f32; N],
    ) -> [f32; N] {
        let place = |x: f32, size: usize, wrap: Wrap| {
            let at = f64::from(x) * size as f64 - 0.5;
            let first = at.floor();
            let column = |k: f64| -> usize {
                let n = size as f64;
                let inside = match wrap {
                    Wrap::Repeat => k.rem_euclid(n),
                    Wrap::Mirror => {
                        let twice = k.rem_euclid(2.0 * n);
                        if twice < n { twice } else { 2.0 * n - 1.0 - twice }
                    }
                    Wrap::Clamp => k,
                };
                inside.clamp(0.0, n - 1.0) as usize
            };
            (column(first), column(first + 1.0), (at - first) as f32)
        };
        let (left, right, to_right) = place(coordinates[0], self.width, wrap[0]);
        let (top, bottom, to_bottom) = place(coordinates[1], self.height, wrap[1]);
        let mut sum = [0.0; N];
        for (row, weight_v) in [(top, 1.0 - to_bottom), (bottom, to_bottom)] {
            for (column, weight_u) in [(left, 1.0 - to_right), (right, to_right)] {
                let texel = decode(self.texels[row * self.width + column]);
                sum.iter_mut().zip(texel).for_each(|(sum, number)| *sum += weight_u * weight_v * number);
            }
        }
        sum
    }
}

/// The samples of a picture in one of the formats that glTF knows: PNG, JPEG or WebP.
pub(crate) fn raster_of_texture(bytes: &[u8]) -> Result<Raster, Error> {
    let format = identify(bytes)?;
    let raster = match format {
        Format::Png => png::raster(bytes),
        Format::WebP => webp::raster(bytes),
        Format::Jpeg => jpeg::raster(bytes),
        _ => {
            let name = format.name();
            let message = format!("textures in {name} are not read; expected PNG, JPEG or WebP");
            return Err(Error::unsupported(message));
        }
    };
    raster.map_err(|error| error.within(format.name()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_are_repeated_mirrored_or_go_on() {
        let row = [[0; 3], [85; 3], [255; 3]];
        let texture = DataTexture::read(&crate::images::png::write_png(3, 1, &row, None).unwrap()).unwrap();
        assert_eq!((texture.width(), texture.height(), texture.texels().len()), (3, 1, 3));
        let at = |u: f32, wrap: Wrap| texture.at([u, 0.3], [wrap; 2], |[red, ..]| [red])[0];
        let near = |a: f32, b: f32| assert!((a - b).abs() < 1e-5, "{a} {b}");
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            near(at(0.5, wrap), 1.0 / 3.0);
            near(at(2.0 / 3.0, wrap), 2.0 / 3.0);
        }
        for (u, repeated, mirrored, clamped) in [
            (1.0, 0.5, 1.0, 1.0),
            (7.0 / 6.0, 0.0, 1.0, 1.0),
            (-1.0 / 6.0, 1.0, 0.0, 0.0),
            (1.5, 1.0 / 3.0, 1.0 / 3.0, 1.0),
        ] {
            near(at(u, Wrap::Repeat), repeated);
            near(at(u, Wrap::Mirror), mirrored);
            near(at(u, Wrap::Clamp), clamped);
        }
        assert!(at(f32::MAX, Wrap::Repeat).is_finite() && at(-1e30, Wrap::Mirror).is_finite());
    }

    #[test]
    fn other_pictures_are_not_textures() {
        let picture = envmap::Image::new(1, 1, vec![[0.5; 3]]).unwrap();
        let bytes = crate::images::radiance::write_rgbe(&picture, None).unwrap().bytes;
        let message = DataTexture::read(&bytes).unwrap_err().to_string();
        assert_eq!(message, "textures in Radiance are not read; expected PNG, JPEG or WebP");
    }
}
