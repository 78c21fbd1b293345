//! Reading a texture of any container.

use super::CONTAINERS;
use super::babylon_env::is_babylon_env;
use super::container::Container;
use super::texture::TextureFile;
use crate::error::{Error, ErrorKind};
use crate::format::refuse_non_files;

/// Reads KTX2, DDS or, of cubes, KTX 1, known by its content; as [`crate::textures::ktx2::read_ktx2`] and
/// [`crate::textures::dds::read_dds`].
///
/// # Errors
/// If the file is none of them, truncated, damaged, too large, or of a format that is not a
/// [`crate::textures::texel::TexelFormat`].
pub fn read_texture(bytes: &[u8]) -> Result<TextureFile, Error> {
    refuse_non_files(bytes)?;
    let container = container_of(bytes);
    let container =
        container.ok_or_else(|| Error::new(ErrorKind::UnknownFormat, "neither a KTX nor a DDS file"))?;
    container.read(bytes)
}

/// The container that the bytes begin as.
pub(crate) fn container_of(bytes: &[u8]) -> Option<&'static Container> {
    CONTAINERS.into_iter().find(|container| bytes.starts_with(container.signature))
}

/// The names of the containers that [`read_texture`] reads, as texts have them.
pub fn texture_containers() -> [&'static str; CONTAINERS.len()] {
    CONTAINERS.map(|container| container.name)
}

/// Whether files of textures have this ending, without its dot and in lower case: that of a container or
/// `env`, Babylon.js' own.
pub fn is_texture_ending(ending: &str) -> bool {
    ending == "env" || CONTAINERS.iter().any(|container| container.ending == ending)
}

/// Whether the first bytes of a file, 256 or all, are those of a KTX2, KTX, DDS or `.env` file that declares
/// a cube.
pub fn declares_cube(first: &[u8]) -> bool {
    match container_of(first) {
        Some(container) => (container.declares_cube)(first),
        None => is_babylon_env(first),
    }
}

/// Whether the bytes begin as a texture that [`read_texture`] reads.
pub fn is_texture(bytes: &[u8]) -> bool {
    container_of(bytes).is_some()
}
