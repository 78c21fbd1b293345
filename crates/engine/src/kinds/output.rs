//! What an item makes: what its kind declares before a run, and what a run returns.

use std::any::Any;
use std::sync::{Arc, LazyLock};

use super::artifact::Artifact;
use super::exported_files::ExportedFiles;
use super::failure::Failure;
use crate::key::Digest;

/// The product of an item: an artifact or files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Product {
    /// An artifact of this type, for other stages.
    Artifact(&'static str),
    /// Files: the endings that are put after the item's `path`, such as `.exr` or `/px.exr`. Of several,
    /// the last is the index, which is renamed into place after the others. Names are declared before
    /// anything runs; a run may leave out some of the files ([`Output::Files`]).
    Files(Vec<String>),
}

impl Product {
    /// The type of what arrives at a port that is connected to the stage.
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::Artifact(name) => name,
            Self::Files(_) => ExportedFiles::TYPE,
        }
    }

    /// The place of the file with this ending.
    pub(crate) fn place(&self, ending: &str) -> Option<usize> {
        match self {
            Self::Artifact(_) => None,
            Self::Files(endings) => endings.iter().position(|own| own == ending),
        }
    }
}

/// The output of a run of an item.
pub enum Output {
    /// An artifact: its encoded bytes, and the value for consumers of the same build.
    Artifact {
        /// The bytes.
        bytes: Vec<u8>,
        /// The value that the bytes encode.
        value: Arc<dyn Any + Send + Sync>,
    },
    /// The files, in the order of [`Product::Files`]. `None`: the item does not export this one of its
    /// declared files. A file that it published there before is removed.
    Files(Vec<Option<Vec<u8>>>),
}

impl Output {
    /// An artifact.
    ///
    /// # Errors
    /// If it cannot be encoded.
    pub fn artifact<T: Artifact>(value: T) -> Result<Self, Failure> {
        Ok(Self::Artifact { bytes: value.encode()?, value: Arc::new(value) })
    }

    /// All declared files, in the order of [`Product::Files`].
    pub fn files(files: Vec<Vec<u8>>) -> Self {
        Self::Files(files.into_iter().map(Some).collect())
    }

    /// The digests of the bytes, in order. Files that are left out have a digest of their own.
    pub fn digests(&self) -> Vec<Digest> {
        self.stored().into_iter().map(Digest::of).collect()
    }

    /// The bytes that the cache has of the artifact, or of each file.
    pub(crate) fn stored(&self) -> Vec<&[u8]> {
        match self {
            Self::Artifact { bytes, .. } => vec![bytes],
            Self::Files(files) => files.iter().map(|file| file.as_deref().unwrap_or(LEFT_OUT)).collect(),
        }
    }
}

/// The bytes that the cache has in place of a file that an item does not export.
const LEFT_OUT: &[u8] = b"specula: this item does not export this file\n";

/// Whether an output in the cache stands for a file that its item does not export.
pub(crate) fn is_left_out(digest: Digest) -> bool {
    static DIGEST: LazyLock<Digest> = LazyLock::new(|| Digest::of(LEFT_OUT));
    digest == *DIGEST
}

/// Whether the bytes of an output in the cache stand for a file that its item does not export.
pub fn stands_for_no_file(bytes: &[u8]) -> bool {
    bytes == LEFT_OUT
}
