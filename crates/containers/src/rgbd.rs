//! RGBD: four bytes for a colour up to 255, as Babylon.js has it, in PNG files that lie upside down.
//!
//! With D = floor(255 / max(1, the largest channel)), at most 255, a channel is the byte (value * D /
//! 255)^(1/2.2) and the alpha is D (Babylon.js helperFunctions.fx, toRGBD and fromRGBD).

use rayon::prelude::*;

use crate::error::Error;
use crate::format::Format;
use crate::texel::Packed;
use crate::{png, raster};

const GAMMA: f32 = 2.2;

fn pack(texel: [f32; 3]) -> [u8; 4] {
    // NaN is 0 by `max`.
    let texel = texel.map(|value| value.max(0.0));
    let largest = texel.iter().fold(1.0_f32, |a, b| a.max(*b));
    let divisor = (255.0 / largest).floor().max(1.0);
    let code =
        |value: f32| (255.0 * math::pow((value * divisor / 255.0).min(1.0), 1.0 / GAMMA)).round() as u8;
    let [r, g, b] = texel.map(code);
    [r, g, b, divisor as u8]
}

fn unpack([r, g, b, divisor]: [u8; 4]) -> [f32; 3] {
    [r, g, b].map(|code| math::pow(f32::from(code) / 255.0, GAMMA) * 255.0 / f32::from(divisor.max(1)))
}

/// A face as a PNG, the last row first.
pub(crate) fn write_face(edge: usize, texels: &[[f32; 3]]) -> Result<Packed, Error> {
    let rows = texels.par_chunks_exact(edge).rev();
    let codes: Vec<[u8; 4]> = rows.flat_map_iter(|row| row.iter().map(|texel| pack(*texel))).collect();
    let values = texels.as_flattened();
    Ok(Packed {
        bytes: png::write_rgba(edge, edge, &codes)?,
        negative: values.iter().filter(|value| **value < 0.0).count(),
    })
}

/// The texels of a face with this edge.
///
/// # Errors
/// If the bytes are no PNG or WebP with 8 bits for each of four channels, or three, whose D is 1 because an
/// encoder left an opaque alpha out; or if they have another size.
pub(crate) fn read_face(edge: usize, bytes: &[u8]) -> Result<Vec<[f32; 3]>, Error> {
    let format = Format::sniff(bytes).filter(|format| matches!(format, Format::Png | Format::WebP));
    let Some(format) = format else {
        return Err(Error::unsupported("expected a PNG or a WebP, found other first bytes"));
    };
    let raster = raster::raster(bytes, format)?;
    if !matches!((raster.channels, raster.depth), (3 | 4, 1)) {
        return Err(Error::unsupported("expected an image of four channels of 8 bits, which RGBD is"));
    }
    if (raster.width, raster.height) != (edge, edge) {
        let (width, height) = (raster.width, raster.height);
        return Err(Error::damaged(format!("expected {edge} x {edge} pixels, found {width} x {height}")));
    }
    let rows = raster.samples.chunks_exact(raster.channels * edge).rev();
    let texel = |rgbd: &[u8]| unpack([rgbd[0], rgbd[1], rgbd[2], rgbd.get(3).copied().unwrap_or(u8::MAX)]);
    Ok(rows.flat_map(|row| row.chunks_exact(raster.channels).map(texel)).collect())
}

#[cfg(test)]
mod tests {
    use ::image::codecs::png::PngEncoder;
    use ::image::{ExtendedColorType, ImageEncoder};

    use super::*;

    #[test]
    fn a_colour_is_within_two_percent_and_ends_at_255() {
        for step in 0..2000 {
            let value = 0.05 * 1.004_f32.powi(step);
            let [found, ..] = unpack(pack([value, 0.5 * value, 0.0]));
            let expected = value.min(255.0);
            assert!((found / expected - 1.0).abs() < 0.02, "{value}: {found}");
        }
        assert_eq!(unpack(pack([1e6, -1.0, f32::NAN])), [255.0, 0.0, 0.0]);
    }

    #[test]
    fn a_face_lies_upside_down() {
        let texels = [[0.0; 3], [0.0; 3], [1.0; 3], [1.0; 3]];
        let bytes = write_face(2, &texels).unwrap().bytes;
        let raster = raster::raster(&bytes, Format::Png).unwrap();
        assert_eq!(raster.samples[..4], [255, 255, 255, 255]);
        assert_eq!(read_face(2, &bytes).unwrap(), texels);
        assert!(read_face(4, &bytes).unwrap_err().to_string().contains("expected 4 x 4 pixels"));
        // Where D is 1 everywhere, an encoder may leave the alpha out.
        let mut opaque = Vec::new();
        let rgb = [255_u8, 255, 255, 255, 255, 255, 0, 0, 0, 0, 0, 0];
        PngEncoder::new(&mut opaque).write_image(&rgb, 2, 2, ExtendedColorType::Rgb8).unwrap();
        assert_eq!(read_face(2, &opaque).unwrap(), texels);
    }
}
