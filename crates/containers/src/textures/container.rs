//! What every container of textures has: how its files are known, and what reads them. Each has its own in a
//! module of its name, as `CONTAINER`.

use super::texture::TextureFile;
use crate::error::Error;

/// How a container of textures is known and read.
pub(crate) struct Container {
    /// The container's usual name, as texts have it.
    pub(crate) name: &'static str,
    /// The ending of its files' names, without the dot and in lower case.
    pub(crate) ending: &'static str,
    /// The first bytes of every file.
    pub(crate) signature: &'static [u8],
    /// Whether a file that begins with these bytes, 256 of them or all, declares a cube.
    pub(crate) declares_cube: fn(&[u8]) -> bool,
    /// Reads a whole file. Its errors name the container.
    pub(crate) read: fn(&[u8]) -> Result<TextureFile, Error>,
    /// Reads the recipe that a file holds if Specula wrote it, whatever the pixels are.
    pub(crate) recipe: fn(&[u8]) -> Option<String>,
}
