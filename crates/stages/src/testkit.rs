//! For the tests of kinds: contexts without a disk.

use std::io;
use std::path::Path;
use std::sync::Arc;

use engine::Files;

/// A disk without a file.
pub(crate) struct NoFiles;

impl Files for NoFiles {
    fn read(&self, _: &Path) -> io::Result<Arc<Vec<u8>>> {
        Err(io::ErrorKind::NotFound.into())
    }

    fn list(&self, _: &Path) -> io::Result<Vec<(String, bool)>> {
        Err(io::ErrorKind::NotFound.into())
    }

    fn is_folder(&self, _: &Path) -> bool {
        false
    }
}
