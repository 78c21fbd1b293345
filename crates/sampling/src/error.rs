//! Why a function cannot be sampled.

/// Why a function cannot be sampled.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// A coefficient is NaN or infinite.
    #[error("the coefficient of l = {l}, m = {m} is {value}, not a finite number")]
    NotFinite {
        /// The degree of its harmonic.
        l: usize,
        /// The order of its harmonic.
        m: isize,
        /// The coefficient.
        value: f64,
    },
    /// A light beside the series is NaN or infinite.
    #[error("light {index} beside the series has a number that is not finite")]
    LightNotFinite {
        /// The light's place in the list.
        index: usize,
    },
    /// A texel is NaN or infinite.
    #[error("the texel of row {row}, column {column} is {value}, not a finite number")]
    TexelNotFinite {
        /// The texel's row, from the top.
        row: usize,
        /// The texel's column, from the left.
        column: usize,
        /// The value of the texel.
        value: f64,
    },
    /// The density is zero everywhere: the function or its product with light is black, or negative where the
    /// positive part was asked for.
    #[error("no mass: the function is nowhere positive")]
    NoMass,
}
