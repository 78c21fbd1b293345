//! Sine, cosine and arc tangent as polynomials, the same in both twins.
//!
//! WGSL allows errors of 4096 units in the last place for the arc tangent, and of 2^-11 for sine and cosine.
//! These polynomials are from Moshier's Cephes 2 (`sinf`, `cosf`, `atanf`). They are accurate to a few units,
//! and faster than the C library's.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use glam::Vec2;

/// Cosine and sine of an angle in turns, -1 to 1. The error is at most 2e-7.
pub fn circle(turn: f32) -> Vec2 {
    let quarters = (4.0 * turn + 0.5).floor();
    let x = (turn - 0.25 * quarters) * TAU;
    let z = x * x;
    let sine = x + x * z * (-1.666_665_5e-1 + z * (8.332_161e-3 - z * 1.951_529_6e-4));
    let cosine = 1.0 - 0.5 * z + z * z * (4.166_664_6e-2 + z * (-1.388_731_6e-3 + z * 2.443_315_8e-5));
    match quarters as i32 & 3 {
        0 => Vec2::new(cosine, sine),
        1 => Vec2::new(-sine, cosine),
        2 => Vec2::new(-cosine, -sine),
        _ => Vec2::new(sine, -cosine),
    }
}

/// The angle of (x, y) from the x axis, -pi to pi; 0 for (0, 0). The relative error is at most 3e-7 if x is
/// positive; otherwise the absolute error is.
pub fn angle(y: f32, x: f32) -> f32 {
    let (low, high) = (x.abs().min(y.abs()), x.abs().max(y.abs()));
    if high == 0.0 {
        return 0.0;
    }
    // Above pi / 8 the polynomial gives the difference from pi / 4.
    let far = low > 0.414_213_56 * high;
    let t = if far { low - high } else { low } / if far { low + high } else { high };
    let z = t * t;
    let series = -3.333_295e-1 + z * (1.997_771e-1 + z * (-1.387_768_6e-1 + z * 8.053_745e-2));
    let small = t + t * z * series + if far { FRAC_PI_4 } else { 0.0 };
    let right = if y.abs() > x.abs() { FRAC_PI_2 - small } else { small };
    let upper = if x < 0.0 { PI - right } else { right };
    if y < 0.0 { -upper } else { upper }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_polynomials_match_the_library() {
        for i in -20_000..=20_000 {
            let turn = i as f32 / 20_000.0;
            let exact = f64::from(turn) * std::f64::consts::TAU;
            let found = circle(turn).as_dvec2();
            let error = (found.x - exact.cos()).abs().max((found.y - exact.sin()).abs());
            assert!(error < 2e-7, "{turn}: {error:e}");
            for length in [1.0, 1e-3, 1e10] {
                let point = found.as_vec2() * length;
                let exact = f64::from(point.y).atan2(f64::from(point.x));
                let allowed = if point.x > 0.0 { 3e-7 * exact.abs() } else { 3e-7 };
                let error = (f64::from(angle(point.y, point.x)) - exact).abs();
                // Only the library treats y = -0 as below the axis.
                assert!(error <= allowed || point.y == 0.0, "{point}: {error:e}");
            }
        }
        for (y, x) in [(0.0, 0.0), (0.0, 1.0), (1e-30, 1.0), (1.0, 1e-30), (1e-30, 1e-30)] {
            assert!((angle(y, x) - y.atan2(x)).abs() <= 3e-7 * y.atan2(x), "{y} {x}");
        }
        assert_eq!((angle(0.0, -1.0), angle(1.0, 0.0), angle(-1.0, 0.0)), (PI, FRAC_PI_2, -FRAC_PI_2));
    }
}
