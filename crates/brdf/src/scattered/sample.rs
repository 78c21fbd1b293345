//! A measurement of a BRDF.

use sphere::Direction;

/// One measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Toward the light, in the frame of the surface (+Z the normal).
    pub incident: Direction,
    /// Toward the viewer.
    pub outgoing: Direction,
    /// The BRDF in 1/sr, RGB, without the cosine.
    pub value: [f64; 3],
}
