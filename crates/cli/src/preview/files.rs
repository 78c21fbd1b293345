//! The files that the preview writes: pictures, and the window's state. Each file appears whole or not at
//! all.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use ::preview::{Picture, Subject};
use engine::path_text;

use crate::png_file;

/// The folder beside the manifest for files that nobody edits; git and watchers ignore it.
const FOLDER: &str = ".specula";

/// The name of the folder for pictures that somebody takes.
pub(crate) const SCREENSHOTS: &str = "screenshots";

/// The state of a window takes some hundred bytes.
const LARGEST_STATE: u64 = 1 << 20;

/// The paths of the files that a preview reads and writes.
#[derive(Clone, Debug)]
pub(crate) struct PreviewFiles {
    folder: PathBuf,
    screenshots: PathBuf,
}

impl PreviewFiles {
    pub(crate) fn beside(manifest: &Path) -> Self {
        let folder = manifest.with_file_name(FOLDER);
        Self { folder, screenshots: manifest.with_file_name(SCREENSHOTS) }
    }

    pub(crate) fn with_screenshots(self, folder: &Path) -> Self {
        Self { screenshots: folder.into(), ..self }
    }

    /// The state of the last window; `None` if there was none.
    ///
    /// # Errors
    /// If there is a state and it cannot be read.
    pub(crate) fn state(&self) -> Result<Option<String>, String> {
        let file = self.state_file();
        let ignored = |reason: String| format!("ignoring {}: {reason}", path_text(&file));
        match fs::metadata(&file) {
            Ok(metadata) if metadata.len() > LARGEST_STATE => return Err(ignored("it is too large".into())),
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            _ => {}
        }
        let text =
            engine::read_file(&file).and_then(|bytes| String::from_utf8(bytes).map_err(io::Error::other));
        text.map(Some).map_err(|error| ignored(error.to_string()))
    }

    /// Saves the state of a window.
    pub(crate) fn save_state(&self, json: &str) -> io::Result<()> {
        self.prepare()?;
        engine::replace_file(&self.state_file(), json.as_bytes())
    }

    fn state_file(&self) -> PathBuf {
        self.folder.join("preview.json")
    }

    /// Saves a picture of a subject to a new file, `gold-sky-sphere-2.png`, and returns its path.
    pub(crate) fn save_picture(&self, subject: &Subject, picture: &Picture) -> io::Result<PathBuf> {
        let name = format!("{}-{}-{}", subject.material, subject.environment, subject.mesh);
        let plain = |letter: char| if letter.is_alphanumeric() || letter == '.' { letter } else { '-' };
        let name = name.chars().map(plain).collect::<String>();
        let folder = &self.screenshots;
        fs::create_dir_all(folder)?;
        let mut number = 0;
        loop {
            number += 1;
            let [file, part] = ["png", "part"].map(|ending| folder.join(format!("{name}-{number}.{ending}")));
            if file.exists() {
                continue;
            }
            // Whoever creates the part owns the number, unless another process finished that picture in
            // between.
            match File::create_new(&part) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                made => drop(made?),
            }
            if file.exists() {
                fs::remove_file(&part)?;
                continue;
            }
            let written = write_picture(&file, picture).map(|()| file);
            let _ = fs::remove_file(&part);
            return written;
        }
    }

    /// Creates the folder as a build does, with its `.gitignore`.
    fn prepare(&self) -> io::Result<()> {
        let beside = self.folder.parent().unwrap_or(&self.folder);
        engine::prepare_state_folder(beside).map(|_| ()).map_err(io::Error::other)
    }
}

/// Writes a picture as a PNG.
pub(crate) fn write_picture(file: &Path, picture: &Picture) -> io::Result<()> {
    png_file::write(file, picture.size.map(|side| side as usize), &picture.codes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_is_read_back_and_nothing_else_is_left_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let files = PreviewFiles::beside(&folder.path().join("pipeline.toml"));
        assert_eq!(files.state(), Ok(None));
        files.save_state("{}").unwrap();
        files.save_state("{\"version\":1}").unwrap();
        assert_eq!(files.state(), Ok(Some("{\"version\":1}".into())));
        assert_eq!(fs::read_dir(folder.path().join(FOLDER)).unwrap().count(), 2);
        assert_eq!(fs::read_to_string(folder.path().join(FOLDER).join(".gitignore")).unwrap(), "*\n");
    }

    #[test]
    fn a_state_that_cannot_be_read_is_reported_and_stays() {
        let folder = tempfile::tempdir().unwrap();
        let files = PreviewFiles::beside(&folder.path().join("pipeline.toml"));
        files.save_state("").unwrap();
        fs::write(files.state_file(), [0xff, 0xfe]).unwrap();
        assert!(files.state().unwrap_err().contains("preview.json: "));
        fs::write(files.state_file(), vec![b' '; (LARGEST_STATE + 1) as usize]).unwrap();
        assert!(files.state().unwrap_err().ends_with("it is too large"));
    }

    #[test]
    fn screenshots_have_names_of_their_own_that_every_disk_takes() {
        let folder = tempfile::tempdir().unwrap();
        let files = PreviewFiles::beside(&folder.path().join("pipeline.toml"));
        let subject =
            Subject { environment: "a/b".into(), material: "gold (fine)".into(), mesh: "torus-knot".into() };
        let picture =
            Picture { size: [1, 1], codes: vec![[1, 2, 3]], radiance: vec![[0.0; 4]], relative_rms: None };
        let save = || files.save_picture(&subject, &picture).unwrap();
        let first = save();
        assert!(first.ends_with("screenshots/gold--fine--a-b-torus-knot-1.png"), "{}", first.display());
        assert!(save().ends_with("gold--fine--a-b-torus-knot-2.png"));
        // Another program is writing the third.
        let folder = first.parent().unwrap();
        fs::write(folder.join("gold--fine--a-b-torus-knot-3.part"), "").unwrap();
        assert!(save().ends_with("gold--fine--a-b-torus-knot-4.png"));
        assert_eq!(fs::read_dir(folder).unwrap().count(), 4, "three pictures and that part");
        assert!(!folder.with_file_name(FOLDER).exists(), "they are not in the cache");
    }
}
