//! What only GLSL has.

/// What the shaders of most maps need in GLSL.
pub(super) const PRECISION: &str = "\
// GLSL ES 3.00, GLSL 3.30 or later.
precision highp float;
precision highp int;
";
