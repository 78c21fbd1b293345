//! Many points or directions at once, in blocks that threads share.
//!
//! Blocks do not depend on the number of threads, and each element is computed by itself.

use rayon::prelude::*;

/// The elements that a thread takes at a time.
const BLOCK: usize = 4096;

/// One output for each input.
///
/// # Panics
/// If the slices have different lengths.
pub(crate) fn map_into<I: Copy + Sync, O: Send>(
    inputs: &[I],
    outputs: &mut [O],
    one: impl Fn(I) -> O + Sync,
) {
    assert_eq!(inputs.len(), outputs.len(), "one of each");
    inputs.par_chunks(BLOCK).zip(outputs.par_chunks_mut(BLOCK)).for_each(|(inputs, outputs)| {
        for (input, output) in inputs.iter().zip(outputs) {
            *output = one(*input);
        }
    });
}

/// The directions and densities of points, which `draw` finds for a block. A few points are drawn by the
/// thread that asks.
///
/// # Panics
/// If the slices have different lengths.
pub(crate) fn draw_into(
    points: &[[f32; 2]],
    directions: &mut [[f32; 3]],
    densities: &mut [f32],
    draw: impl Fn(&[[f32; 2]], &mut [[f32; 3]], &mut [f32]) + Sync,
) {
    assert!(points.len() == directions.len() && points.len() == densities.len(), "one of each");
    if points.len() <= BLOCK {
        return draw(points, directions, densities);
    }
    let outputs = directions.par_chunks_mut(BLOCK).zip(densities.par_chunks_mut(BLOCK));
    points.par_chunks(BLOCK).zip(outputs).for_each(|(points, (directions, densities))| {
        draw(points, directions, densities);
    });
}
