//! The two parts of a material that engines look up by different directions.

/// A part of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The part that is taken about the normal: matte bases, sheen, light that facets reflect several times.
    Diffuse,
    /// The part that is not about the normal: highlights about the reflection vector, fibres about the
    /// tangent.
    Specular,
}
