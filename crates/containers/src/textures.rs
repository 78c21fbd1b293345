//! Files that a graphics device takes as they are: texels, levels, layers and faces.

pub(crate) mod babylon_env;
mod bc6h;
mod container;
mod dds;
mod ktx1;
mod ktx2;
mod read_texture;
pub(crate) mod rgbd;
mod texel;
mod texture;

/// Every container of textures, in the order in which texts list them.
pub(crate) const CONTAINERS: [&container::Container; 3] =
    [&ktx2::CONTAINER, &ktx1::CONTAINER, &dds::CONTAINER];

pub(crate) use babylon_env::check_levels;
pub use babylon_env::{
    BabylonEnv, Polynomial, is_babylon_env, read_babylon_env, read_babylon_polynomial, write_babylon_env,
};
pub use dds::{read_dds, write_dds, write_dds_rgba};
pub use ktx1::write_ktx1;
pub use ktx2::{read_ktx2, write_ktx2, write_ktx2_r8, write_ktx2_rgba, write_ktx2_zstd};
pub(crate) use read_texture::container_of;
pub use read_texture::{declares_cube, is_texture, is_texture_ending, read_texture, texture_containers};
pub use texel::{ByteFormat, Rounding, TexelEncoding, TexelFormat};
pub use texture::{Texture, TextureFile};
