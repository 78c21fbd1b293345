//! Files that a graphics device takes as they are: texels, levels, layers and faces.

pub(crate) mod babylon_env;
mod bc6h;
mod dds;
pub(crate) mod ktx1;
pub(crate) mod ktx2;
mod read_texture;
pub(crate) mod rgbd;
mod texel;
mod texture;

pub(crate) use babylon_env::check_levels;
pub use babylon_env::{
    BabylonEnv, Polynomial, is_babylon_env, read_babylon_env, read_babylon_polynomial, write_babylon_env,
};
pub use dds::{read_dds, write_dds};
pub use ktx1::write_ktx1;
pub use ktx2::{read_ktx2, write_ktx2, write_ktx2_rgba, write_ktx2_zstd};
pub use read_texture::{declares_cube, is_texture, read_texture};
pub use texel::{ByteFormat, TexelFormat};
pub use texture::{Texture, TextureFile};
