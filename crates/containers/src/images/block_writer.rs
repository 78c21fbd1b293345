//! Collects the pixels of a picture as they come, and encodes each block of rows once it is complete.

use std::collections::BTreeMap;
use std::ops::Range;

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

impl Patch {
    fn height(&self) -> usize {
        self.pixels.len() / self.width.max(1)
    }
}

/// The blocks of a picture, some of which are still incomplete.
pub(crate) struct BlockWriter {
    width: usize,
    height: usize,
    /// The part of the picture that has pixels: left, top, right and bottom. The rest is black.
    filled: [usize; 4],
    open: BTreeMap<usize, OpenBlock>,
    done: Vec<Option<(CodedRows, OutsideGamut)>>,
    /// Memory of blocks that are done, for those that follow.
    spare: Vec<Vec<[f32; 3]>>,
}

struct OpenBlock {
    pixels: Vec<[f32; 3]>,
    missing: usize,
    /// Whether the pixels are still whatever the memory held before.
    is_new: bool,
}

impl OpenBlock {
    /// Copies the part of a patch that lies in these rows of a picture of `width` columns.
    fn copy(&mut self, rows: Range<usize>, width: usize, patch: &Patch) {
        let left = patch.corner[0].clamp(0, width as i64);
        let right = (patch.corner[0] + patch.width as i64).clamp(left, width as i64);
        let columns = (left - patch.corner[0]) as usize..(right - patch.corner[0]) as usize;
        if columns.is_empty() {
            return;
        }
        for (y, pixels) in patch.pixels.chunks_exact(patch.width.max(1)).enumerate() {
            let row = usize::try_from(patch.corner[1] + y as i64);
            let Some(row) = row.ok().filter(|row| rows.contains(row)) else { continue };
            let pixels = &pixels[columns.clone()];
            let at = (row - rows.start) * width + left as usize;
            self.pixels[at..at + pixels.len()].copy_from_slice(pixels);
            self.missing = self.missing.saturating_sub(pixels.len());
        }
    }
}

impl BlockWriter {
    /// A picture of which this part will be written: left, top, right and bottom.
    pub(crate) fn new(width: usize, height: usize, part: [i64; 4]) -> Self {
        let within = |at: i64, most: usize| usize::try_from(at).unwrap_or(0).min(most);
        let [left, top, right, bottom] = part;
        let filled = [within(left, width), within(top, height), within(right, width), within(bottom, height)];
        let done = vec![None; CodedRows::count(height)];
        Self { width, height, filled, open: BTreeMap::new(), done, spare: Vec::new() }
    }

    /// The number of pixels of a block that will be written.
    fn filled(&self, block: usize) -> usize {
        let rows = CodedRows::rows(self.height, block);
        let [left, top, right, bottom] = self.filled;
        rows.end.min(bottom).saturating_sub(rows.start.max(top)) * right.saturating_sub(left)
    }

    /// A block that is incomplete, or one in which everything is missing; its memory may be that of another.
    fn take(&mut self, block: usize) -> OpenBlock {
        if let Some(open) = self.open.remove(&block) {
            return open;
        }
        OpenBlock { pixels: self.spare.pop().unwrap_or_default(), missing: self.filled(block), is_new: true }
    }

    /// Writes patches that do not overlap with earlier ones. Blocks that this completes are changed by
    /// `finish`, and encoded.
    pub(crate) fn write(
        &mut self,
        patches: &[Patch],
        finish: impl Fn(&mut [[f32; 3]]) -> OutsideGamut + Sync,
    ) {
        let mut of_blocks: BTreeMap<usize, Vec<&Patch>> = BTreeMap::new();
        for patch in patches {
            let row = |row: i64| usize::try_from(row).unwrap_or(0).min(self.height);
            let rows = row(patch.corner[1])..row(patch.corner[1] + patch.height() as i64);
            let blocks = rows.start / CodedRows::HEIGHT..CodedRows::count(rows.end);
            for block in blocks.filter(|_| !rows.is_empty()) {
                of_blocks.entry(block).or_default().push(patch);
            }
        }
        let blocks = of_blocks.into_iter().map(|(block, patches)| (block, self.take(block), patches));
        let blocks = blocks.collect();
        self.fill(blocks, |missing| missing == 0, finish);
    }

    /// Copies patches into blocks, and encodes those that are `complete`.
    fn fill(
        &mut self,
        blocks: Vec<(usize, OpenBlock, Vec<&Patch>)>,
        complete: impl Fn(usize) -> bool + Sync,
        finish: impl Fn(&mut [[f32; 3]]) -> OutsideGamut + Sync,
    ) {
        let (width, height) = (self.width, self.height);
        let filled = blocks.into_par_iter().map(|(block, mut open, patches)| {
            let rows = CodedRows::rows(height, block);
            if open.is_new {
                open.pixels.clear();
                open.pixels.resize(rows.len() * width, [0.0; 3]);
                open.is_new = false;
            }
            patches.into_iter().for_each(|patch| open.copy(rows.clone(), width, patch));
            let coded = complete(open.missing).then(|| {
                let outside = finish(&mut open.pixels);
                (CodedRows::encode(width, &open.pixels), outside)
            });
            (block, open, coded)
        });
        for (block, open, coded) in filled.collect::<Vec<_>>() {
            if coded.is_some() {
                self.spare.push(open.pixels);
                self.done[block] = coded;
            } else {
                self.open.insert(block, open);
            }
        }
    }

    /// The picture, and what `finish` found; pixels that were not written are black.
    pub(crate) fn into_image(
        mut self,
        finish: impl Fn(&mut [[f32; 3]]) -> OutsideGamut + Sync,
    ) -> Option<(Image, OutsideGamut)> {
        let rest: Vec<usize> = (0..self.done.len()).filter(|block| self.done[*block].is_none()).collect();
        let rest = rest.into_iter().map(|block| (block, self.take(block), Vec::new())).collect();
        self.fill(rest, |_| true, finish);
        let (blocks, outside): (Vec<_>, Vec<_>) = self.done.into_iter().flatten().unzip();
        let outside = outside.into_iter().fold(OutsideGamut::default(), OutsideGamut::and);
        Some((Image::from_blocks(self.width, self.height, blocks)?, outside))
    }
}
