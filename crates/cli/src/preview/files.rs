//! What the preview keeps on the disk: pictures, and the window's state. Each file appears whole or not at all.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use ::preview::Picture;
use ::preview::Subject;

/// The folder beside the manifest for what nobody edits; it ignores itself in git, and no watcher attends to it.
const FOLDER: &str = ".specula";

/// A state of a window is some hundred bytes.
const LARGEST_STATE: u64 = 1 << 20;

/// Where things are kept.
#[derive(Clone, Debug)]
pub(crate) struct PreviewFiles {
    folder: PathBuf,
}

impl PreviewFiles {
    /// Those of a manifest.
    pub(crate) fn beside(manifest: &Path) -> Self {
        Self { folder: manifest.with_file_name(FOLDER) }
    }

    /// What the last window left; `None` where there was none.
    ///
    /// # Errors
    /// Why what is there cannot be read.
    pub(crate) fn state(&self) -> Result<Option<String>, String> {
        let file = self.state_file();
        let told = |reason: String| format!("{} is left out: {reason}", file.display());
        match fs::metadata(&file) {
            Ok(metadata) if metadata.len() > LARGEST_STATE => return Err(told("it is too large".into())),
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            _ => {}
        }
        let text =
            engine::read_file(&file).and_then(|bytes| String::from_utf8(bytes).map_err(io::Error::other));
        text.map(Some).map_err(|error| told(error.to_string()))
    }

    /// Keeps the state of a window.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub(crate) fn keep_state(&self, json: &str) -> io::Result<()> {
        self.prepare()?;
        engine::replace_file(&self.state_file(), json.as_bytes())
    }

    fn state_file(&self) -> PathBuf {
        self.folder.join("preview.json")
    }

    /// Where the picture goes that stands in for a window.
    pub(crate) fn still(&self) -> PathBuf {
        self.folder.join("preview.png")
    }

    /// Writes that picture.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub(crate) fn keep_still(&self, picture: &Picture) -> io::Result<()> {
        self.prepare()?;
        write_picture(&self.still(), picture)
    }

    /// Keeps a picture of a subject in a file of its own, `gold-sky-sphere-2.png`, and says where.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub(crate) fn keep_picture(&self, subject: &Subject, picture: &Picture) -> io::Result<PathBuf> {
        let name = format!("{}-{}-{}", subject.material, subject.environment, subject.mesh);
        let plain = |letter: char| if letter.is_alphanumeric() || letter == '.' { letter } else { '-' };
        let name = name.chars().map(plain).collect::<String>();
        self.prepare()?;
        let folder = self.folder.join("screenshots");
        fs::create_dir_all(&folder)?;
        let bytes = png(picture)?;
        let mut number = 0;
        loop {
            number += 1;
            let [file, part] = ["png", "part"].map(|ending| folder.join(format!("{name}-{number}.{ending}")));
            if file.exists() {
                continue;
            }
            // Who makes the part has the number, unless another was done with it in between.
            match File::create_new(&part) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                made => drop(made?),
            }
            if file.exists() {
                fs::remove_file(&part)?;
                continue;
            }
            let written = engine::replace_file(&file, &bytes).map(|()| file);
            let _ = fs::remove_file(&part);
            return written;
        }
    }

    /// Makes the folder, which ignores itself in git, as a build makes it.
    fn prepare(&self) -> io::Result<()> {
        let beside = self.folder.parent().unwrap_or(&self.folder);
        engine::prepare_state_folder(beside).map(|_| ()).map_err(io::Error::other)
    }
}

/// Writes a picture as a PNG.
///
/// # Errors
/// Where the file cannot be written.
pub(crate) fn write_picture(file: &Path, picture: &Picture) -> io::Result<()> {
    let bytes = png(picture)?;
    if let Some(folder) = file.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder)?;
    }
    engine::replace_file(file, &bytes)
}

fn png(picture: &Picture) -> io::Result<Vec<u8>> {
    let [width, height] = picture.size.map(|side| side as usize);
    containers::write_png(width, height, &picture.codes, None).map_err(io::Error::other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_is_read_back_and_nothing_else_is_left_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let kept = PreviewFiles::beside(&folder.path().join("pipeline.toml"));
        assert_eq!(kept.state(), Ok(None));
        kept.keep_state("{}").unwrap();
        kept.keep_state("{\"version\":1}").unwrap();
        assert_eq!(kept.state(), Ok(Some("{\"version\":1}".into())));
        assert_eq!(fs::read_dir(folder.path().join(FOLDER)).unwrap().count(), 2);
        assert_eq!(fs::read_to_string(folder.path().join(FOLDER).join(".gitignore")).unwrap(), "*\n");
    }

    #[test]
    fn a_state_that_cannot_be_read_is_told_and_left() {
        let folder = tempfile::tempdir().unwrap();
        let kept = PreviewFiles::beside(&folder.path().join("pipeline.toml"));
        kept.keep_state("").unwrap();
        fs::write(kept.state_file(), [0xff, 0xfe]).unwrap();
        assert!(kept.state().unwrap_err().contains("preview.json is left out: "));
        fs::write(kept.state_file(), vec![b' '; (LARGEST_STATE + 1) as usize]).unwrap();
        assert!(kept.state().unwrap_err().ends_with("it is too large"));
    }

    #[test]
    fn screenshots_have_names_of_their_own_that_every_disk_takes() {
        let folder = tempfile::tempdir().unwrap();
        let kept = PreviewFiles::beside(&folder.path().join("pipeline.toml"));
        let subject =
            Subject { environment: "a/b".into(), material: "gold (fine)".into(), mesh: "torus-knot".into() };
        let picture =
            Picture { size: [1, 1], codes: vec![[1, 2, 3]], radiance: vec![[0.0; 4]], relative_rms: None };
        let keep = || kept.keep_picture(&subject, &picture).unwrap();
        let first = keep();
        assert!(
            first.ends_with(".specula/screenshots/gold--fine--a-b-torus-knot-1.png"),
            "{}",
            first.display()
        );
        assert!(keep().ends_with("gold--fine--a-b-torus-knot-2.png"));
        // Another program is at work on the third.
        let folder = first.parent().unwrap();
        fs::write(folder.join("gold--fine--a-b-torus-knot-3.part"), "").unwrap();
        assert!(keep().ends_with("gold--fine--a-b-torus-knot-4.png"));
        assert_eq!(fs::read_dir(folder).unwrap().count(), 4, "three pictures and that");
    }
}
