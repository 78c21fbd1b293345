//! How a file stores a value: as a half or as a float.

use half::f16;

/// The samples of a written OpenEXR file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Precision {
    /// 32 bits: every value is kept.
    #[default]
    Float,
    /// 16 bits: 11 significant bits, at most 65504.
    Half,
}

/// The nearest half, ties to even; what is past the largest, +-65504, becomes that.
pub(crate) fn to_half(value: f32) -> f16 {
    const MAX: f32 = 65504.0;
    f16::from_f32(value.clamp(-MAX, MAX))
}
