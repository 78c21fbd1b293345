//! Collects the pixels of a picture as they come, and encodes each block of rows once it is complete.

use std::collections::BTreeMap;

use envmap::{CodedRows, Image};
use rayon::prelude::*;

use super::outside_gamut::OutsideGamut;

/// A rectangle of pixels, row by row.
pub(crate) struct Patch {
    /// Column and row of its corner, which may lie outside of the picture.
    pub(crate) corner: [i64; 2],
    pub(crate) width: usize,
    pub(crate) pixels: Vec<[f32; 3]>,
}

/// The blocks of a picture, some of which are still incomplete.
pub(crate) struct BlockWriter {
    width: usize,
    height: usize,
    /// The part of the picture that has pixels: left, top, right and bottom. The rest is black.
    filled: [usize; 4],
    open: BTreeMap<usize, OpenBlock>,
    done: Vec<Option<(CodedRows, OutsideGamut)>>,
}

struct OpenBlock {
    pixels: Vec<[f32; 3]>,
    missing: usize,
}

impl BlockWriter {
    /// A picture of which this part will be written: left, top, right and bottom.
    pub(crate) fn new(width: usize, height: usize, part: [i64; 4]) -> Self {
        let within = |at: i64, most: usize| usize::try_from(at).unwrap_or(0).min(most);
        let [left, top, right, bottom] = part;
        let filled = [within(left, width), within(top, height), within(right, width), within(bottom, height)];
        let done = vec![None; CodedRows::count(height)];
        Self { width, height, filled, open: BTreeMap::new(), done }
    }

    fn open(&self, block: usize) -> OpenBlock {
        let rows = CodedRows::rows(self.height, block);
        let [left, top, right, bottom] = self.filled;
        let filled = rows.end.min(bottom).saturating_sub(rows.start.max(top)) * right.saturating_sub(left);
        OpenBlock { pixels: vec![[0.0; 3]; rows.len() * self.width], missing: filled }
    }

    /// Writes patches that do not overlap with earlier ones. Blocks that this completes are changed by
    /// `finish`, and encoded.
    pub(crate) fn write(
        &mut self,
        patches: &[Patch],
        finish: impl Fn(&mut [[f32; 3]]) -> OutsideGamut + Sync,
    ) {
        for patch in patches {
            for (y, pixels) in patch.pixels.chunks_exact(patch.width.max(1)).enumerate() {
                let Ok(row) = usize::try_from(patch.corner[1] + y as i64) else { continue };
                let left = patch.corner[0].clamp(0, self.width as i64);
                let right = (patch.corner[0] + patch.width as i64).clamp(left, self.width as i64);
                if row >= self.height || left == right {
                    continue;
                }
                let pixels = &pixels[(left - patch.corner[0]) as usize..(right - patch.corner[0]) as usize];
                let block = row / CodedRows::HEIGHT;
                if !self.open.contains_key(&block) {
                    self.open.insert(block, self.open(block));
                }
                let Some(open) = self.open.get_mut(&block) else { continue };
                let at = row % CodedRows::HEIGHT * self.width + left as usize;
                open.pixels[at..at + pixels.len()].copy_from_slice(pixels);
                open.missing = open.missing.saturating_sub(pixels.len());
            }
        }
        let complete: Vec<usize> =
            self.open.iter().filter(|(_, open)| open.missing == 0).map(|(block, _)| *block).collect();
        self.close(complete, finish);
    }

    fn close(&mut self, blocks: Vec<usize>, finish: impl Fn(&mut [[f32; 3]]) -> OutsideGamut + Sync) {
        let open: Vec<_> =
            blocks.iter().map(|block| self.open.remove(block).unwrap_or_else(|| self.open(*block))).collect();
        let width = self.width;
        let coded = open.into_par_iter().map(|mut open| {
            let outside = finish(&mut open.pixels);
            (CodedRows::encode(width, &open.pixels), outside)
        });
        let coded: Vec<_> = coded.collect();
        blocks.into_iter().zip(coded).for_each(|(block, coded)| self.done[block] = Some(coded));
    }

    /// The picture, and what `finish` found; pixels that were not written are black.
    pub(crate) fn into_image(
        mut self,
        finish: impl Fn(&mut [[f32; 3]]) -> OutsideGamut + Sync,
    ) -> Option<(Image, OutsideGamut)> {
        let rest = (0..self.done.len()).filter(|block| self.done[*block].is_none()).collect();
        self.close(rest, finish);
        let (blocks, outside): (Vec<_>, Vec<_>) = self.done.into_iter().flatten().unzip();
        let outside = outside.into_iter().fold(OutsideGamut::default(), OutsideGamut::and);
        Some((Image::from_blocks(self.width, self.height, blocks)?, outside))
    }
}
