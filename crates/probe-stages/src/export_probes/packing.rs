//! The 27 numbers of a probe in seven texels of four, as three.js packs them.

use super::axes::Rows;

/// The parts of a texture, with four numbers of a probe each.
pub(crate) const PARTS: usize = 7;

/// The 27 numbers of nine rows, four at a time, and a last one.
pub(crate) fn packed(rows: &Rows, last: f32) -> [[f32; 4]; PARTS] {
    let numbers = rows.as_flattened();
    std::array::from_fn(|part| [0, 1, 2, 3].map(|k| numbers.get(4 * part + k).copied().unwrap_or(last)))
}

/// The texels of a grid of probes: its seven parts along z, each with its first and its last slice twice, so
/// that a device that blends texels never blends two parts.
pub(crate) fn stacked(probes: &[[[f32; 4]; PARTS]], [nx, ny, nz]: [usize; 3]) -> Vec<[f32; 4]> {
    let mut texels = Vec::with_capacity(PARTS * nx * ny * (nz + 2));
    for part in 0..PARTS {
        let slices = probes.chunks_exact((nx * ny).max(1));
        let (first, last) = (slices.clone().next(), slices.clone().next_back());
        let padded = first.into_iter().chain(slices).chain(last);
        texels.extend(padded.flatten().map(|probe| probe[part]));
    }
    texels
}
