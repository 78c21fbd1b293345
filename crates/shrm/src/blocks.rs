//! Work on the texels of maps in blocks, which ends early if nobody wants the maps any more.

use rayon::prelude::*;

/// Texels of a block.
const BLOCK: usize = 256;

/// The number of blocks of so many texels: how many times work on them asks whether to stop.
pub fn blocks(texels: usize) -> usize {
    texels.div_ceil(BLOCK)
}

/// Changes every texel, which comes with its index; `None` once `stop` says so. It is asked before each
/// block.
pub(crate) fn for_each_unless(
    texels: &mut [[f32; 3]],
    stop: &(dyn Fn() -> bool + Sync),
    change: impl Fn(usize, &mut [f32; 3]) + Sync,
) -> Option<()> {
    texels.par_chunks_mut(BLOCK).enumerate().try_for_each(|(block, texels)| {
        if stop() {
            return None;
        }
        (block * BLOCK..).zip(texels).for_each(|(index, texel)| change(index, texel));
        Some(())
    })
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn every_texel_is_changed_once_and_the_question_comes_once_for_each_block() {
        for count in [0, 1, BLOCK, 3 * BLOCK + 7] {
            let (mut texels, asked) = (vec![[0.0; 3]; count], AtomicUsize::new(0));
            let stop = || asked.fetch_add(1, Ordering::Relaxed) > count;
            let done = for_each_unless(&mut texels, &stop, |index, texel| texel[0] += index as f32 + 1.0);
            assert_eq!((done, asked.into_inner()), (Some(()), blocks(count)));
            assert!(texels.iter().enumerate().all(|(index, texel)| texel[0] == index as f32 + 1.0));
        }
    }

    #[test]
    fn work_that_is_stopped_has_no_result() {
        let mut texels = vec![[0.0; 3]; 3 * BLOCK];
        assert_eq!(for_each_unless(&mut texels, &|| true, |_, texel| texel[0] = 1.0), None);
        assert!(texels.iter().all(|texel| texel[0] == 0.0));
    }
}
