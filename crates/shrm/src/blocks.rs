//! Work on the texels of maps in blocks, which ends early if nobody wants the maps any more.

use rayon::prelude::*;
use sh::{Stop, Stopped};

/// Texels of a block.
const BLOCK: usize = 256;

/// The number of blocks of so many texels: how many times work on them asks whether to stop.
pub fn blocks(texels: usize) -> usize {
    texels.div_ceil(BLOCK)
}

/// Changes every texel, which comes with its index. `stop` is asked before each block.
pub(crate) fn for_each(
    texels: &mut [[f32; 3]],
    stop: Stop<'_>,
    change: impl Fn(usize, &mut [f32; 3]) + Sync,
) -> Result<(), Stopped> {
    texels.par_chunks_mut(BLOCK).enumerate().try_for_each(|(block, texels)| {
        stop.check()?;
        (block * BLOCK..).zip(texels).for_each(|(index, texel)| change(index, texel));
        Ok(())
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
            let done =
                for_each(&mut texels, Stop::when(&stop), |index, texel| texel[0] += index as f32 + 1.0);
            assert_eq!((done, asked.into_inner()), (Ok(()), blocks(count)));
            assert!(texels.iter().enumerate().all(|(index, texel)| texel[0] == index as f32 + 1.0));
        }
    }

    #[test]
    fn work_that_is_stopped_has_no_result() {
        let mut texels = vec![[0.0; 3]; 3 * BLOCK];
        let done = for_each(&mut texels, Stop::when(&|| true), |_, texel| texel[0] = 1.0);
        assert_eq!(done, Err(Stopped));
        assert!(texels.iter().all(|texel| texel[0] == 0.0));
    }
}
