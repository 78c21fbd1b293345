//! The pixels of a picture: blocks of rows that are compressed without loss and decoded where they are read.
//!
//! A photograph of 16384 x 8192 pixels has 1.6 GB of floats, of which most consumers need a few rows at a
//! time. [`row_codec`] keeps them in less than its source has; whoever needs pixels in no order gets all of
//! them as floats, which are then kept.

use std::fmt;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

use rayon::prelude::*;
use sh::{Stop, Stopped, unstopped};

use crate::row_codec;
use crate::row_sums::RowSums;

/// The pixels that are decoded at once if consumers need more rows than a block has: 48 MiB.
const BAND: usize = 1 << 22;

/// Some rows of a picture, compressed without loss; equal rows have equal bytes.
#[derive(Clone)]
pub struct CodedRows {
    bytes: Arc<Vec<u8>>,
    /// The sums of the rows, unless they were read from a file.
    sums: Option<Arc<RowSums>>,
}

impl CodedRows {
    /// The rows of a block but the last of a picture.
    pub const HEIGHT: usize = 32;

    /// The number of blocks of a picture of `height` rows.
    pub fn count(height: usize) -> usize {
        height.div_ceil(Self::HEIGHT)
    }

    /// The rows of one of the blocks of a picture of `height` rows.
    pub fn rows(height: usize, block: usize) -> Range<usize> {
        let first = block.saturating_mul(Self::HEIGHT).min(height);
        first..first.saturating_add(Self::HEIGHT).min(height)
    }

    /// Encodes rows of `width` pixels.
    ///
    /// # Panics
    /// If there are no columns, or the rows are not complete.
    pub fn encode(width: usize, rows: &[[f32; 3]]) -> Self {
        assert!(rows.len().is_multiple_of(width), "whole rows");
        let mut bytes = row_codec::encode(width, rows);
        bytes.shrink_to_fit();
        Self { bytes: Arc::new(bytes), sums: Some(Arc::new(RowSums::of(width, rows))) }
    }

    /// The block that [`CodedRows::bytes`] gave; `None` if it does not have so many pixels.
    pub fn from_bytes(width: usize, height: usize, bytes: Vec<u8>) -> Option<Self> {
        row_codec::is_complete(width, height, &bytes).then(|| Self { bytes: Arc::new(bytes), sums: None })
    }

    /// The bytes, for a file.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Whether no value is negative, infinite or NaN.
    pub(crate) fn is_clean(&self) -> bool {
        row_codec::is_clean(&self.bytes)
    }

    /// Whether no value is infinite or NaN.
    pub(crate) fn is_finite(&self) -> bool {
        row_codec::is_finite(&self.bytes)
    }

    fn decode(&self, width: usize, rows: &mut [[f32; 3]]) {
        row_codec::decode(width, &self.bytes, rows);
    }
}

impl PartialEq for CodedRows {
    fn eq(&self, other: &Self) -> bool {
        self.bytes == other.bytes
    }
}

/// The pixels of a picture, row by row from the top.
#[derive(Clone)]
pub(crate) struct Pixels(Arc<Stored>);

#[derive(Clone)]
struct Stored {
    width: usize,
    height: usize,
    /// The blocks of rows; none if there are only floats.
    blocks: Vec<CodedRows>,
    /// Pixels in place of those in the blocks, in order: a few lamps would make 32-bit floats of all rows
    /// beside them.
    replaced: Vec<(u32, [f32; 3])>,
    /// The sums of each of the blocks, with the pixels that replace others, once they are known.
    sums: Vec<OnceLock<Arc<RowSums>>>,
    whole: OnceLock<Vec<[f32; 3]>>,
}

impl Pixels {
    /// Floats; there must be at least one column, and only whole rows.
    pub(crate) fn new(width: usize, pixels: Vec<[f32; 3]>) -> Self {
        let height = pixels.len() / width;
        let (blocks, replaced, sums, whole) = (Vec::new(), Vec::new(), Vec::new(), OnceLock::from(pixels));
        Self(Arc::new(Stored { width, height, blocks, replaced, sums, whole }))
    }

    /// Blocks, of [`CodedRows::HEIGHT`] rows each but the last.
    pub(crate) fn of_blocks(width: usize, height: usize, blocks: Vec<CodedRows>) -> Self {
        let sums = blocks.iter().map(|block| block.sums.clone().map_or_else(OnceLock::new, OnceLock::from));
        let (replaced, sums, whole) = (Vec::new(), sums.collect(), OnceLock::new());
        Self(Arc::new(Stored { width, height, blocks, replaced, sums, whole }))
    }

    /// The number of columns.
    pub(crate) fn width(&self) -> usize {
        self.0.width
    }

    /// The number of rows.
    pub(crate) fn height(&self) -> usize {
        self.0.height
    }

    /// These pixels with others in some places, which are in order and each once.
    pub(crate) fn replaced(mut self, others: Vec<(u32, [f32; 3])>) -> Self {
        if self.0.blocks.is_empty() {
            let pixels = self.whole_mut();
            others.into_iter().for_each(|(at, value)| pixels[at as usize] = value);
            return self;
        }
        let Stored { width, height, blocks, replaced, sums, .. } = &*self.0;
        let (width, height, blocks, sums) = (*width, *height, blocks.clone(), sums.clone());
        let replaced = if replaced.is_empty() { others } else { merged(replaced, others) };
        let mut stored = Stored { width, height, blocks, replaced, sums, whole: OnceLock::new() };
        for block in 0..stored.sums.len() {
            if !stored.replaced_in(block).is_empty() {
                stored.sums[block] = OnceLock::new();
            }
        }
        Self(Arc::new(stored))
    }

    /// All pixels as floats, which are kept.
    ///
    /// They are decoded outside of the cell, though two that need them at once then decode them twice: a
    /// thread that waits for the others takes up whatever else is to be done, and that may need the same
    /// pixels. It would wait for itself.
    pub(crate) fn whole(&self) -> &[[f32; 3]] {
        let Stored { width, height, whole, .. } = &*self.0;
        if let Some(pixels) = whole.get() {
            return pixels;
        }
        let mut pixels = vec![[0.0; 3]; width * height];
        let rows = pixels.par_chunks_mut(width * CodedRows::HEIGHT);
        rows.enumerate().for_each(|(block, rows)| self.0.decode(block, rows));
        whole.get_or_init(|| pixels)
    }

    /// All pixels as floats, and nothing else.
    pub(crate) fn whole_mut(&mut self) -> &mut [[f32; 3]] {
        self.whole();
        let stored = Arc::make_mut(&mut self.0);
        stored.blocks.clear();
        stored.replaced.clear();
        stored.sums.clear();
        stored.whole.get_mut().map_or(&mut [], Vec::as_mut_slice)
    }

    pub(crate) fn into_whole(mut self) -> Vec<[f32; 3]> {
        self.whole_mut();
        Arc::unwrap_or_clone(self.0).whole.into_inner().unwrap_or_default()
    }

    /// Some rows, which are decoded into `scratch` if they are not there as floats.
    pub(crate) fn rows<'a>(&'a self, rows: Range<usize>, scratch: &'a mut Vec<[f32; 3]>) -> &'a [[f32; 3]] {
        self.decoded(rows, scratch, |first, scratch| {
            let blocks = scratch.chunks_mut(self.width() * CodedRows::HEIGHT);
            blocks.enumerate().for_each(|(block, rows)| self.0.decode(first + block, rows));
        })
    }

    /// [`Pixels::rows`], decoded on all threads, for a caller that runs on one.
    pub(crate) fn band<'a>(&'a self, rows: Range<usize>, scratch: &'a mut Vec<[f32; 3]>) -> &'a [[f32; 3]] {
        self.decoded(rows, scratch, |first, scratch| {
            let blocks = scratch.par_chunks_mut(self.width() * CodedRows::HEIGHT);
            blocks.enumerate().for_each(|(block, rows)| self.0.decode(first + block, rows));
        })
    }

    /// Some rows. If they are not there as floats, `decode` gets the number of the first block that has some
    /// of them, and room for all such blocks.
    fn decoded<'a>(
        &'a self,
        rows: Range<usize>,
        scratch: &'a mut Vec<[f32; 3]>,
        decode: impl FnOnce(usize, &mut [[f32; 3]]),
    ) -> &'a [[f32; 3]] {
        let Stored { width, height, whole, .. } = &*self.0;
        if let Some(whole) = whole.get() {
            return &whole[rows.start * width..rows.end * width];
        }
        let first = rows.start / CodedRows::HEIGHT;
        let last = CodedRows::count(rows.end).max(first);
        let from = first * CodedRows::HEIGHT;
        let until = (last * CodedRows::HEIGHT).min(*height);
        scratch.resize((until - from) * width, [0.0; 3]);
        decode(first, scratch);
        &scratch[(rows.start - from) * width..(rows.end - from) * width]
    }

    /// The rows that are decoded at once by [`Pixels::band`].
    pub(crate) fn rows_of_band(&self) -> usize {
        (BAND / self.width()).max(1)
    }

    /// The results of a function for each block of rows, in their order. It gets the first row's number and
    /// the pixels of all rows.
    pub(crate) fn map_blocks<T: Send>(
        &self,
        stop: Stop<'_>,
        function: impl Fn(usize, &[[f32; 3]]) -> T + Sync,
    ) -> Result<Vec<T>, Stopped> {
        self.map_blocks_where(stop, |_| true, function)
    }

    /// [`Pixels::map_blocks`] of the blocks that are wanted alone.
    pub(crate) fn map_blocks_where<T: Send>(
        &self,
        stop: Stop<'_>,
        wanted: impl Fn(usize) -> bool + Sync,
        function: impl Fn(usize, &[[f32; 3]]) -> T + Sync,
    ) -> Result<Vec<T>, Stopped> {
        let block = |scratch: &mut Vec<_>, block: usize| {
            stop.check()?;
            let rows = CodedRows::rows(self.0.height, block);
            Ok(function(rows.start, self.rows(rows.clone(), scratch)))
        };
        let blocks: Vec<usize> =
            (0..CodedRows::count(self.0.height)).filter(|block| wanted(*block)).collect();
        blocks.into_par_iter().map_init(Vec::new, block).collect()
    }

    /// The sums of the rows of each block, in their order. Blocks whose sums are not known are decoded.
    pub(crate) fn sums(&self, stop: Stop<'_>) -> Result<Vec<Arc<RowSums>>, Stopped> {
        let block = |scratch: &mut Vec<_>, block: usize| {
            stop.check()?;
            Ok(self.sums_of(block, scratch))
        };
        (0..CodedRows::count(self.0.height)).into_par_iter().map_init(Vec::new, block).collect()
    }

    /// The sums of the rows of a block, which is decoded into `scratch` if they are not known.
    pub(crate) fn sums_of(&self, block: usize, scratch: &mut Vec<[f32; 3]>) -> Arc<RowSums> {
        let kept = self.0.sums.get(block);
        if let Some(sums) = kept.and_then(OnceLock::get) {
            return Arc::clone(sums);
        }
        let rows = self.rows(CodedRows::rows(self.0.height, block), scratch);
        let sums = Arc::new(RowSums::of(self.0.width, rows));
        kept.map_or(&sums, |kept| kept.get_or_init(|| Arc::clone(&sums))).clone()
    }

    /// Whether a pixel of a block may have a greater radiance; it is not decoded to find out.
    pub(crate) fn may_exceed(&self, block: usize, radiance: f64) -> bool {
        let sums = self.0.sums.get(block).and_then(OnceLock::get);
        sums.is_none_or(|sums| sums.brightest > radiance)
    }

    /// Gives a function the wanted blocks of rows one after the other: the first row's number and the pixels.
    pub(crate) fn visit_blocks(
        &self,
        wanted: impl Fn(usize) -> bool,
        mut function: impl FnMut(usize, &[[f32; 3]]),
    ) {
        let mut scratch = Vec::new();
        for block in (0..CodedRows::count(self.0.height)).filter(|block| wanted(*block)) {
            let rows = CodedRows::rows(self.0.height, block);
            function(rows.start, self.rows(rows.clone(), &mut scratch));
        }
    }

    /// The blocks of rows, which are encoded if there are only floats.
    pub(crate) fn blocks(&self) -> Vec<CodedRows> {
        if !self.0.blocks.is_empty() {
            return self.clone().changed(|_| false, |_, _| {}).0.blocks.clone();
        }
        let width = self.0.width;
        unstopped(|stop| self.map_blocks(stop, |_, rows| CodedRows::encode(width, rows)))
    }

    /// Whether no value is negative, infinite or NaN, if that is known of the rows of a block.
    pub(crate) fn is_clean(&self, block: usize) -> bool {
        let is_clean = |value: &f32| (0.0..=f32::MAX).contains(value);
        self.0.blocks.get(block).is_some_and(CodedRows::is_clean)
            && self.0.replaced_in(block).iter().all(|(_, rgb)| rgb.iter().all(is_clean))
    }

    /// These pixels, changed by a function in each block for which it is `wanted`. The function gets the
    /// first row's number and the pixels of all rows.
    pub(crate) fn changed(
        mut self,
        wanted: impl Fn(usize) -> bool + Sync,
        change: impl Fn(usize, &mut [[f32; 3]]) + Sync,
    ) -> Self {
        let Stored { width, height, .. } = *self.0;
        if self.0.blocks.is_empty() {
            let rows = self.whole_mut().par_chunks_mut(width * CodedRows::HEIGHT).enumerate();
            let rows = rows.filter(|(block, _)| wanted(*block));
            rows.for_each(|(block, rows)| change(block * CodedRows::HEIGHT, rows));
            return self;
        }
        let changed = |scratch: &mut Vec<_>, (index, block): (usize, &CodedRows)| {
            let is_wanted = wanted(index);
            if !is_wanted && self.0.replaced_in(index).is_empty() {
                return block.clone();
            }
            let rows = CodedRows::rows(height, index);
            scratch.resize(rows.len() * width, [0.0; 3]);
            self.0.decode(index, scratch);
            if is_wanted {
                change(rows.start, scratch);
            }
            CodedRows::encode(width, scratch)
        };
        let blocks = self.0.blocks.par_iter().enumerate().map_init(Vec::new, changed).collect();
        Self::of_blocks(width, height, blocks)
    }
}

/// Pixels in order of their places; where both lists have one, it is that of `later`.
fn merged(earlier: &[(u32, [f32; 3])], mut later: Vec<(u32, [f32; 3])>) -> Vec<(u32, [f32; 3])> {
    let has_later = |at: u32| later.binary_search_by_key(&at, |(at, _)| *at).is_ok();
    let kept: Vec<_> = earlier.iter().filter(|(at, _)| !has_later(*at)).copied().collect();
    later.extend(kept);
    later.sort_unstable_by_key(|(at, _)| *at);
    later
}

impl Stored {
    /// The pixels of a block.
    fn decode(&self, block: usize, rows: &mut [[f32; 3]]) {
        let Some(coded) = self.blocks.get(block) else { return };
        coded.decode(self.width, rows);
        let first = block * CodedRows::HEIGHT * self.width;
        self.replaced_in(block).iter().for_each(|(at, value)| rows[*at as usize - first] = *value);
    }

    fn replaced_in(&self, block: usize) -> &[(u32, [f32; 3])] {
        let rows = CodedRows::rows(self.height, block);
        let at = |row: usize| self.replaced.partition_point(|(at, _)| (*at as usize) < row * self.width);
        &self.replaced[at(rows.start)..at(rows.end)]
    }
}

impl PartialEq for Pixels {
    fn eq(&self, other: &Self) -> bool {
        let size = |pixels: &Self| [pixels.0.width, pixels.0.height];
        size(self) == size(other) && self.whole() == other.whole()
    }
}

impl fmt::Debug for Pixels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.whole()).finish()
    }
}

impl fmt::Debug for CodedRows {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("CodedRows").field(&self.bytes.len()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_those_of_the_floats() {
        let (width, height) = (3, 100);
        let floats: Vec<_> = (0..width * height).map(|i| [i as f32, 0.5, 0.1]).collect();
        let plain = Pixels::new(width, floats.clone());
        let coded = Pixels::of_blocks(width, height, plain.blocks());
        let mut scratch = Vec::new();
        for rows in [0..0, 0..1, 31..33, 5..100, 64..96, 99..100] {
            let expected = &floats[rows.start * width..rows.end * width];
            for pixels in [&plain, &coded] {
                assert_eq!(pixels.rows(rows.clone(), &mut scratch), expected, "{rows:?}");
            }
        }
        let sums = |pixels: &Pixels| {
            let sum = |first, rows: &[[f32; 3]]| (first, rows.iter().map(|rgb| rgb[0]).sum::<f32>());
            unstopped(|stop| pixels.map_blocks(stop, sum))
        };
        assert_eq!(sums(&plain), sums(&coded));
        assert!(coded.0.whole.get().is_none(), "nothing was decoded as a whole");
        let negate = |pixels: Pixels| {
            pixels.changed(|block| block == 1, |_, rows| rows.iter_mut().for_each(|rgb| rgb[0] = -rgb[0]))
        };
        let (plain, coded) = (negate(plain), negate(coded));
        assert_eq!(plain, coded);
        assert_eq!(plain.whole()[32 * width], [-(32.0 * 3.0), 0.5, 0.1]);
        assert!(!coded.is_clean(1) && coded.is_clean(0) && !plain.is_clean(0));
        assert_eq!(plain.blocks(), coded.blocks());
        assert_eq!(coded.clone().into_whole(), plain.whole());
    }

    #[test]
    fn replaced_pixels_are_read_in_place_of_those_of_the_blocks() {
        let (width, height) = (3, 100);
        let plain = Pixels::new(width, (0..width * height).map(|i| [i as f32, 0.5, 0.1]).collect());
        let coded = Pixels::of_blocks(width, height, plain.blocks());
        let others = vec![(1, [7.0; 3]), (95, [0.3, 0.2, 0.1]), (96, [-1.0; 3]), (299, [9.0; 3])];
        let [plain, coded] = [plain, coded].map(|pixels| pixels.replaced(others.clone()));
        let mut scratch = Vec::new();
        for rows in [0..1, 31..33, 64..96, 5..100] {
            let expected = &plain.whole()[rows.start * width..rows.end * width];
            assert_eq!(coded.rows(rows.clone(), &mut scratch), expected, "{rows:?}");
        }
        assert!(coded.0.whole.get().is_none(), "nothing was decoded as a whole");
        assert!(coded.is_clean(0) && !coded.is_clean(1), "of a negative pixel");
        assert_eq!(coded.blocks(), plain.blocks());
        let double = |_, rows: &mut [[f32; 3]]| rows.iter_mut().for_each(|rgb| rgb[0] *= 2.0);
        let [plain_twice, coded_twice] = [&plain, &coded]
            .map(|pixels| pixels.clone().changed(|block| block > 0, double).replaced(vec![(1, [1.0; 3])]));
        assert_eq!(coded_twice.blocks(), plain_twice.blocks());
        let [plain, coded] =
            [plain, coded].map(|pixels| pixels.replaced(vec![(0, [3.0; 3]), (96, [2.0; 3])]));
        assert!(coded.0.whole.get().is_none(), "nothing was decoded as a whole");
        assert_eq!(coded.into_whole(), plain.into_whole());
    }

    /// A thread that waits for the blocks takes up another task that needs the same pixels.
    #[test]
    fn tasks_of_one_pool_share_pixels_without_waiting_for_themselves() {
        let (width, height) = (64, 40 * CodedRows::HEIGHT);
        let plain = Pixels::new(width, (0..width * height).map(|i| [i as f32, 0.5, 0.1]).collect());
        let blocks = plain.blocks();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(4).build().unwrap();
        for _ in 0..100 {
            let coded = Pixels::of_blocks(width, height, blocks.clone());
            pool.scope(|scope| {
                (0..16).for_each(|_| scope.spawn(|_| assert_eq!(coded.whole(), plain.whole())));
            });
        }
    }

    #[test]
    fn bytes_of_another_size_are_no_block() {
        let block = CodedRows::encode(8, &[[1.0; 3]; 16]);
        let found = |width, height| CodedRows::from_bytes(width, height, block.bytes().to_vec());
        assert_eq!(found(8, 2), Some(block.clone()));
        assert_eq!(found(8, 3), None);
        assert_eq!(found(17, 2), None);
        assert_eq!(CodedRows::from_bytes(8, 2, Vec::new()), None);
    }
}
