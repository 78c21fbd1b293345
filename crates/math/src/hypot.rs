//! The length of a vector, nearly always the double that is nearest to it.
//!
//! C. F. Borges, "An Improved Algorithm for hypot(a,b)" (2019), his corrected form without fused
//! multiply-add: one step of Newton's method after the square root, with a residual whose terms are nearly
//! exact.

/// The length of (x, y). Near overflow and underflow it is `libm`'s.
#[inline]
pub(crate) fn hypot(x: f64, y: f64) -> f64 {
    let (x, y) = (x.abs(), y.abs());
    let (long, short) = if x > y { (x, y) } else { (y, x) };
    if long < 1e150 && short > 1e-140 { plain(long, short) } else { libm::hypot(x, y) }
}

/// The length of a vector with 0 < short <= long, where no square overflows.
#[inline]
fn plain(long: f64, short: f64) -> f64 {
    let h = (long * long + short * short).sqrt();
    let residual = if h <= 2.0 * short {
        let over = h - short;
        long * (2.0 * over - long) + (over - 2.0 * (long - short)) * over
    } else {
        let over = h - long;
        2.0 * over * (long - 2.0 * short) + ((4.0 * over - short) * short + over * over)
    };
    h - residual / (2.0 * h)
}
