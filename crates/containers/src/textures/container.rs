//! What every container of textures has: how its files are known, and what reads them. Each has its own in a
//! module of its name, as `CONTAINER`.

use super::texture::TextureFile;
use crate::error::{Error, ErrorKind};
use crate::format::refuse_non_files;

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
    /// Reads a whole file, which begins with the signature.
    pub(crate) parse: fn(&[u8]) -> Result<TextureFile, Error>,
    /// Reads the recipe that a file holds if Specula wrote it, whatever the pixels are.
    pub(crate) recipe: fn(&[u8]) -> Option<String>,
}

impl Container {
    /// Reads a whole file. The errors name the container.
    pub(crate) fn read(&self, bytes: &[u8]) -> Result<TextureFile, Error> {
        let parsed = refuse_non_files(bytes).and_then(|()| {
            if bytes.starts_with(self.signature) {
                (self.parse)(bytes)
            } else if self.signature.starts_with(bytes) {
                Err(Error::truncated("the file ends before its data does"))
            } else {
                let message = format!("expected a {} file, found other first bytes", self.name);
                Err(Error::new(ErrorKind::UnknownFormat, message))
            }
        });
        parsed.map_err(|error| error.within(self.name))
    }
}
