//! Directions spread evenly over the sphere.

use std::f64::consts::PI;

use crate::Direction;

/// Direction `index` of `count` on a spiral from +Z to -Z whose turns are the golden angle (Vogel 1979): each
/// stands for an equal solid angle, 4 pi / `count`.
///
/// # Example: the mean of z^2 over the sphere is a third
/// ```
/// let squares = (0..1000).map(|index| sphere::spiral(index, 1000).vector().z.powi(2));
/// assert!((squares.sum::<f64>() / 1000.0 - 1.0 / 3.0).abs() < 1e-6);
/// ```
pub fn spiral(index: usize, count: usize) -> Direction {
    let golden = PI * (3.0 - 5f64.sqrt());
    let z = 1.0 - (2 * index + 1) as f64 / count as f64;
    Direction::from_angles(math::acos(z), golden * index as f64)
}
