//! Files that are dropped on the page, in a folder that goes with the server.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use tempfile::TempDir;

/// The most bytes of one file: a photograph of 16k x 8k as floats has 1.6 GB.
const MAX_FILE: u64 = 4 << 30;

/// The most bytes of a name on every disk.
const MAX_NAME: usize = 200;

#[derive(Debug)]
pub(super) struct Uploads {
    folder: TempDir,
}

impl Uploads {
    pub(super) fn new() -> io::Result<Self> {
        Ok(Self { folder: tempfile::Builder::new().prefix("specula-page-").tempdir()? })
    }

    /// Writes a file that a page sends under its name, which appears whole or not at all. `Err` within says
    /// what is wrong with it; then its bytes are not read.
    pub(super) fn receive(
        &self,
        name: &str,
        length: u64,
        body: &mut impl Read,
    ) -> io::Result<Result<(), String>> {
        let Some(file) = self.file(name) else { return Ok(Err(format!("{name:?} is no name of a file"))) };
        if length > MAX_FILE {
            return Ok(Err(format!("{name} has more than {} GB", MAX_FILE >> 30)));
        }
        let mut part = tempfile::NamedTempFile::new_in(self.folder.path())?;
        let written = io::copy(&mut body.take(length), part.as_file_mut())?;
        if written < length {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        part.persist(file).map_err(|error| error.error)?;
        Ok(Ok(()))
    }

    /// The files of these names, which were received before.
    pub(super) fn files(&self, names: &[String]) -> Result<Vec<PathBuf>, String> {
        let file = |name: &String| {
            let file = self.file(name).filter(|file| File::open(file).is_ok());
            file.ok_or_else(|| format!("{name:?} was not sent"))
        };
        names.iter().map(file).collect()
    }

    /// The path of a name; `None` if the name is more than one or none.
    fn file(&self, name: &str) -> Option<PathBuf> {
        let is_plain = !name.is_empty()
            && name.len() <= MAX_NAME
            && !name.starts_with('.')
            && !name.ends_with(['.', ' '])
            && !name.contains(|letter: char| letter.is_control() || r#"/\:*?"<>|"#.contains(letter));
        let path = Path::new(name);
        let is_name = path.file_name().is_some_and(|file| file == path.as_os_str());
        (is_plain && is_name).then(|| self.folder.path().join(name))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_file_is_written_whole_under_its_own_name() {
        let uploads = Uploads::new().unwrap();
        let receive = |name: &str, length, bytes: &[u8]| uploads.receive(name, length, &mut { bytes });
        assert_eq!(receive("sky é.hdr", 4, b"abcdrest").unwrap(), Ok(()));
        assert_eq!(fs::read(&uploads.files(&["sky é.hdr".into()]).unwrap()[0]).unwrap(), b"abcd");
        assert!(receive("cut.hdr", 9, b"abcd").is_err());
        assert!(receive("large.hdr", u64::MAX, b"").unwrap().unwrap_err().contains("GB"));
        assert!(uploads.files(&["cut.hdr".into()]).is_err() && uploads.files(&["none.hdr".into()]).is_err());
    }

    #[test]
    fn no_name_leaves_the_folder() {
        let uploads = Uploads::new().unwrap();
        let long = "x".repeat(MAX_NAME + 1);
        for name in [
            "",
            ".",
            "..",
            "../a",
            "/etc/passwd",
            "a/b",
            r"a\b",
            "C:a",
            "a\0b",
            ".hidden",
            "a.",
            "con?",
            &long,
        ] {
            assert!(uploads.receive(name, 1, &mut b"x".as_slice()).unwrap().is_err(), "{name:?}");
        }
    }
}
