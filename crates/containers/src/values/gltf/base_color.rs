//! The picture of a material's base colour, for previews.

use brdf::{BaseColorTexture, TexturePlacement};
use envmap::{ToneMap, box_filtered, to_srgb8};

use crate::images::{Raster, srgb_to_linear};

/// The texture of a picture: its texels in sRGB, each side halved until none is longer than
/// [`BaseColorTexture::LONGEST_SIDE`]. Halving takes means of linear colours. `None` of a picture of floats.
pub(super) fn texture(raster: &Raster, placement: TexturePlacement) -> Option<BaseColorTexture> {
    let &Raster { width, height, channels, depth, ref samples, .. } = raster;
    if depth > 2 {
        return None;
    }
    let code = |pixel: usize, channel: usize| {
        let channel = if channels < 3 { 0 } else { channel };
        let first = (pixel * channels + channel) * depth;
        match samples.get(first..first + depth) {
            Some(&[code]) => usize::from(code),
            Some(&[a, b]) => usize::from(u16::from_ne_bytes([a, b])),
            _ => 0,
        }
    };
    let halvings = (0..usize::BITS).find(|k| width.max(height) >> k <= BaseColorTexture::LONGEST_SIDE)?;
    let size = [width, height].map(|side| (side >> halvings).max(1));
    let texels = if depth == 1 && halvings == 0 {
        (0..width * height).map(|pixel| [0, 1, 2].map(|channel| code(pixel, channel) as u8)).collect()
    } else {
        let codes = 1_usize << (8 * depth);
        let linear: Vec<f32> =
            (0..codes).map(|code| srgb_to_linear(code as f64 / (codes - 1) as f64) as f32).collect();
        let texel = |pixel: usize| [0, 1, 2].map(|channel| linear[code(pixel, channel)]);
        to_srgb8(&box_filtered([width, height], size, texel), 0.0, ToneMap::Plain)
    };
    BaseColorTexture::new(size, texels, placement)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::images::{raster_of_texture, write_png};

    fn read(width: usize, height: usize, texel: impl Fn(usize) -> [u8; 3]) -> BaseColorTexture {
        let texels: Vec<_> = (0..width * height).map(texel).collect();
        let bytes = write_png(width, height, &texels, None).unwrap();
        texture(&raster_of_texture(&bytes).unwrap(), TexturePlacement::default()).unwrap()
    }

    #[test]
    fn small_pictures_are_kept_as_they_are() {
        let texel = |k: usize| [k as u8, (7 * k) as u8, 255 - k as u8];
        let texture = read(16, 16, texel);
        assert_eq!(texture.size(), [16, 16]);
        assert_eq!(texture.texels(), (0..256).map(texel).collect::<Vec<_>>());
    }

    /// Columns of black and white, two by two: their linear mean is 0.5, which is code 188 of sRGB.
    #[test]
    fn large_pictures_are_halved_in_linear_light() {
        let texture = read(4100, 3, |k| [if k % 4100 % 2 == 0 { 0 } else { 255 }; 3]);
        assert_eq!(texture.size(), [512, 1]);
        let inner = &texture.texels()[1..];
        assert!(inner.iter().all(|rgb| rgb[0].abs_diff(188) <= 3), "{inner:?}");
        let exact = read(4096, 2, |k| [if k % 2 == 0 { 0 } else { 255 }; 3]);
        assert_eq!((exact.size(), exact.texels()[7]), ([1024, 1], [188; 3]));
    }
}
