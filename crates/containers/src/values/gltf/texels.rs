//! The mean of a texture, for a material that is the same everywhere.

use crate::error::Error;
use crate::images::{Raster, srgb_to_linear};

/// The mean of all texels of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mean {
    pub(super) width: usize,
    pub(super) height: usize,
    /// RGB decoded from sRGB to linear.
    pub(super) colour: [f64; 3],
    /// RGBA as they are stored, 0 to 1; a picture without alpha has 1 there.
    pub(super) stored: [f64; 4],
}

impl Mean {
    /// The mean of a picture. As glTF requires (section 3.8.1), ICC profiles and gamma are ignored.
    ///
    /// Colours are decoded before they are averaged; alpha does not weight them.
    pub(super) fn of(raster: &Raster) -> Result<Self, Error> {
        let &Raster { width, height, channels, depth, ref samples, .. } = raster;
        if depth > 2 {
            return Err(Error::unsupported("the texels are floats; expected integers of 8 or 16 bits"));
        }
        // How often each code occurs in each channel: sums of counts have no rounding, and no order.
        let levels = 1_usize << (8 * depth);
        let mut counts = vec![vec![0_u64; levels]; channels];
        for pixel in samples.chunks_exact(channels * depth) {
            for (counts, sample) in counts.iter_mut().zip(pixel.chunks_exact(depth)) {
                let code = match *sample {
                    [code] => usize::from(code),
                    [a, b] => usize::from(u16::from_ne_bytes([a, b])),
                    _ => 0,
                };
                counts[code] += 1;
            }
        }
        let mean = |channel: usize, decode: fn(f64) -> f64| {
            let sum: f64 = counts[channel]
                .iter()
                .enumerate()
                .filter(|(_, count)| **count > 0)
                .map(|(code, count)| decode(code as f64 / (levels - 1) as f64) * *count as f64)
                .sum();
            sum / (width * height) as f64
        };
        let rgb = if channels < 3 { [0; 3] } else { [0, 1, 2] };
        let alpha = if channels.is_multiple_of(2) { mean(channels - 1, |value| value) } else { 1.0 };
        let [red, green, blue] = rgb.map(|channel| mean(channel, |value| value));
        Ok(Self {
            width,
            height,
            colour: rgb.map(|channel| mean(channel, srgb_to_linear)),
            stored: [red, green, blue, alpha],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::images::raster_of_texture;

    fn read(bytes: &[u8]) -> Result<Mean, Error> {
        Mean::of(&raster_of_texture(bytes)?)
    }

    /// Black and white in equal parts are a linear grey of 0.5, which is far from the sRGB code in the
    /// middle.
    #[test]
    fn colours_are_decoded_before_they_are_averaged() {
        let png =
            crate::images::write_png(2, 2, &[[0; 3], [255; 3], [255, 255, 0], [0, 0, 128]], None).unwrap();
        let mean = read(&png).unwrap();
        assert_eq!((mean.width, mean.height), (2, 2));
        let grey = ((128.0 / 255.0 + 0.055) / 1.055_f64).powf(2.4);
        for (found, expected) in mean.colour.into_iter().zip([0.5, 0.5, (1.0 + grey) / 4.0]) {
            assert!((found - expected).abs() < 1e-15, "{mean:?}");
        }
        assert_eq!(mean.stored, [0.5, 0.5, 383.0 / 255.0 / 4.0, 1.0]);
    }

    #[test]
    fn other_pictures_are_not_textures() {
        let picture = envmap::Image::new(1, 1, vec![[0.5; 3]]).unwrap();
        let message =
            read(&crate::images::write_rgbe(&picture, None).unwrap().bytes).unwrap_err().to_string();
        assert_eq!(message, "textures in Radiance are not read; expected PNG, JPEG or WebP");
    }
}
