//! Constants that formulas have in both languages.

/// Makes constants for Rust, and `WGSL_CONSTANTS`, their declarations for the shader with a prefix to each
/// name.
macro_rules! shader_constants {
    ($prefix:literal: $($(#[$doc:meta])* $vis:vis $name:ident: $type:ty = $value:expr;)*) => {
        $($(#[$doc])* $vis const $name: $type = $value;)*

        /// The constants, declared for the shader.
        const WGSL_CONSTANTS: &str =
            concat!($("const ", $prefix, stringify!($name), ": ", stringify!($type), " = ", stringify!($value), ";\n",)*);
    };
}
pub(super) use shader_constants;
