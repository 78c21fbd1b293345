//! One map for a reflection that depends on the view: over which views it is taken.

use std::f64::consts::PI;

use brdf::Centre;

/// How one map stands for a reflection that depends on the view.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Plain {
    /// The mean over all views as a ball shows them to a distant camera, weighted by projected area: about
    /// the reflection vector they are spread evenly over all w_o, and the mean is the terms p = 0.
    Mean,
    /// The surface seen head on, V = N. For a map of reflection vectors or normals the view is the central
    /// direction itself; for a map of tangents it is at a right angle to it, and the mean around the tangent
    /// is taken.
    HeadOn,
}

/// Colatitudes of views w_o about a central direction and their weights, which sum to 1: as a ball shows
/// views to a distant camera, the squared sine of the angle between view and normal is spread evenly. About
/// the tangent that is the mean over all normals at right angles to it.
pub(crate) fn mean_views(centre: Centre, rows: usize) -> impl Iterator<Item = (f64, f64)> {
    (0..rows).map(move |row| {
        let share = (row as f64 + 0.5) / rows as f64;
        let even = 1.0 / rows as f64;
        match centre {
            Centre::Reflection => (math::acos(1.0 - 2.0 * share), even),
            Centre::Normal => (math::asin(share.sqrt()), even),
            Centre::Tangent => {
                let theta = math::acos(1.0 - 2.0 * share);
                // The mean of a sine over the sphere is pi / 4.
                (theta, even * math::sin(theta) * 4.0 / PI)
            }
        }
    })
}
