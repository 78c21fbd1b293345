//! Which roughness a level of detail holds.

/// The levels of detail of an engine's cube: level 0 is a mirror, level n the last.
pub(crate) struct Levels {
    /// The roughness of level l, from l, n and the width of a face in texels. It is not asked for level 0.
    pub(crate) roughness: fn(f64, f64, f64) -> f64,
    /// The level that the engine's shader looks up for a roughness, from it, n and the width of a face.
    pub(crate) level: fn(f64, f64, f64) -> f64,
    /// The formula of `roughness` as manuals print it, with `{size}` for the width of a face.
    pub(crate) formula: &'static str,
    /// What the manual of `prefilter` says after the formula.
    pub(crate) remark: &'static str,
}

/// Levels that crowd where lobes are wide.
pub(crate) const QUADRATIC: Levels = Levels {
    roughness: |l, n, _| 1.0 - (1.0 - l / n).sqrt(),
    level: |r, n, _| n * r * (2.0 - r),
    formula: "r = 1 - sqrt(1 - l / n)",
    remark: "",
};

/// The power of two with the least ratio to a size; of two, the larger.
pub(crate) fn nearest_power_of_two(size: usize) -> usize {
    let above = size.max(1).checked_next_power_of_two().unwrap_or(1 << (usize::BITS - 1));
    let below = (above / 2).max(1);
    // size / below < above / size, in logarithms.
    if (size as f64) * (size as f64) < (above as f64) * (below as f64) { below } else { above }
}
