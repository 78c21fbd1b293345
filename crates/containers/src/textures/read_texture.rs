//! Reading a texture of any container.

use super::babylon_env::is_babylon_env;
use super::texture::TextureFile;
use super::{dds, ktx1, ktx2};
use crate::error::{Error, ErrorKind};
use crate::format::refuse_non_files;
use crate::header_word::word;

/// Reads KTX2, DDS or, of cubes, KTX 1, known by its content; as [`crate::textures::ktx2::read_ktx2`] and
/// [`crate::textures::dds::read_dds`].
///
/// # Errors
/// If the file is none of them, truncated, damaged, too large, or of a format that is not a
/// [`crate::textures::texel::TexelFormat`].
pub fn read_texture(bytes: &[u8]) -> Result<TextureFile, Error> {
    refuse_non_files(bytes)?;
    match bytes {
        _ if ktx2::is_ktx2(bytes) => ktx2::read(bytes),
        _ if ktx1::is_ktx1(bytes) => ktx1::read(bytes),
        _ if dds::is_dds(bytes) => dds::read(bytes),
        _ => Err(Error::new(ErrorKind::UnknownFormat, "neither a KTX nor a DDS file")),
    }
}

/// Whether the first bytes of a file, 256 or all, are those of a KTX2, KTX, DDS or `.env` file that declares
/// a cube.
pub fn declares_cube(first: &[u8]) -> bool {
    // The number of faces of KTX2 and of KTX, and DDS's flag of a cube.
    match first {
        _ if ktx2::is_ktx2(first) => word(first, 36) == Some(6),
        _ if ktx1::is_ktx1(first) => word(first, 52) == Some(6),
        _ if dds::is_dds(first) => word(first, 112).is_some_and(|caps| caps & 0x200 != 0),
        _ => is_babylon_env(first),
    }
}

/// Whether the bytes begin as a texture that [`read_texture`] reads.
pub fn is_texture(bytes: &[u8]) -> bool {
    ktx2::is_ktx2(bytes) || ktx1::is_ktx1(bytes) || dds::is_dds(bytes)
}
