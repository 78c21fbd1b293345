//! The two parts of a material that engines look up by different directions.

/// A part of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// What is taken about the normal: matte bases, sheen, light that facets reflect several times.
    Diffuse,
    /// The rest: highlights about the reflection vector, and fibres about the tangent.
    Specular,
}
