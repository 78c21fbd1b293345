//! How the pixels of a layer lie in the display window, and the pixels of one of its blocks.

use exr::block::{BlockIndex, UncompressedBlock};
use exr::math::Vec2;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header;
use half::f16;
use half::slice::HalfFloatSliceExt;

use super::layer::Layer;
use crate::error::Error;
use crate::images::block_writer::{BlockWriter, Patch};

/// How the pixels of a layer lie in the display window.
pub(super) struct Window {
    size: [usize; 2],
    /// The data window's corner in the display window, and its size.
    corner: [i64; 2],
    data: [usize; 2],
    /// Whether the windows differ.
    pub(super) partial: bool,
    /// The channel of alpha.
    alpha: Option<usize>,
}

impl Window {
    pub(super) fn new(header: &Header, layer: &Layer) -> Self {
        let display = header.shared_attributes.display_window;
        let at = header.own_attributes.layer_position;
        // The layer's own alpha: that of another says nothing of these colours.
        let colour = header.channels.list[layer.channels[0]].name.to_string();
        let alpha = colour.rsplit_once('.').map_or("A".to_owned(), |(prefix, _)| format!("{prefix}.A"));
        let alpha = header.channels.list.iter().position(|channel| channel.name.eq(alpha.as_str()));
        Self {
            size: [display.size.0, display.size.1],
            data: [header.layer_size.0, header.layer_size.1],
            corner: [
                i64::from(at.0) - i64::from(display.position.0),
                i64::from(at.1) - i64::from(display.position.1),
            ],
            partial: at != display.position || header.layer_size != display.size,
            alpha,
        }
    }

    pub(super) fn writer(&self) -> BlockWriter {
        let [left, top] = self.corner;
        let [right, bottom] = [left + self.data[0] as i64, top + self.data[1] as i64];
        BlockWriter::new(self.size[0], self.size[1], [left, top, right, bottom])
    }

    /// The pixels of a block in memory that may be of another, and whether alpha is below 1 in one of them.
    pub(super) fn patch(
        &self,
        header: &Header,
        layer: &Layer,
        block: &UncompressedBlock,
        mut pixels: Vec<[f32; 3]>,
    ) -> Result<(Patch, bool), Error> {
        let BlockIndex { pixel_position, pixel_size, .. } = block.index;
        let width = pixel_size.0;
        pixels.clear();
        pixels.resize(width * pixel_size.1, [0.0; 3]);
        let mut is_transparent = false;
        let mut rest = block.data.as_slice();
        for (y, line) in pixels.chunks_exact_mut(width.max(1)).enumerate() {
            for (channel, description) in header.channels.list.iter().enumerate() {
                // The data window begins at a sample.
                let Vec2(step, rows) = description.sampling;
                if !(pixel_position.1 + y).is_multiple_of(rows) {
                    continue;
                }
                let length = width / step * description.sample_type.bytes_per_sample();
                let (samples, after) = rest
                    .split_at_checked(length)
                    .ok_or_else(|| Error::damaged("a block is shorter than its pixels"))?;
                rest = after;
                if self.alpha == Some(channel) {
                    visit(description.sample_type, samples, |_, value| is_transparent |= value < 1.0);
                }
                for target in (0..3).filter(|&c| layer.channels[c] == channel) {
                    if step == 1 {
                        let line = &mut line[..width];
                        visit(description.sample_type, samples, |x, value| line[x][target] = value);
                    } else {
                        visit(description.sample_type, samples, |x, value| line[x * step][target] = value);
                    }
                }
            }
        }
        let corner = [self.corner[0] + pixel_position.0 as i64, self.corner[1] + pixel_position.1 as i64];
        Ok((Patch { corner, width, pixels }, is_transparent))
    }
}

/// Halves that are converted at once.
const HALVES: usize = 64;

/// Gives every sample of a line, in the order of this machine's bytes, as f32.
fn visit(kind: SampleType, bytes: &[u8], mut each: impl FnMut(usize, f32)) {
    let word = |bytes: &[u8]| [bytes[0], bytes[1], bytes[2], bytes[3]];
    match kind {
        SampleType::F16 => {
            let (mut halves, mut floats) = ([f16::ZERO; HALVES], [0.0; HALVES]);
            for (index, bytes) in bytes.chunks(2 * HALVES).enumerate() {
                let words = bytes.as_chunks::<2>().0;
                halves.iter_mut().zip(words).for_each(|(half, word)| *half = f16::from_ne_bytes(*word));
                halves.convert_to_f32_slice(&mut floats);
                let floats = floats[..words.len()].iter().enumerate();
                floats.for_each(|(x, value)| each(index * HALVES + x, *value));
            }
        }
        SampleType::F32 => {
            bytes.chunks_exact(4).enumerate().for_each(|(x, bytes)| each(x, f32::from_ne_bytes(word(bytes))));
        }
        SampleType::U32 => {
            bytes
                .chunks_exact(4)
                .enumerate()
                .for_each(|(x, bytes)| each(x, u32::from_ne_bytes(word(bytes)) as f32));
        }
    }
}
