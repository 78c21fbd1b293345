//! The material files that the window edits. A file is written only when the user saves.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ::preview::{MaterialForm, PreviewUpdate};
use brdf::Material;
use engine::{Failure, canonicalize, path_text};

/// The materials whose files were read, by their names in the catalog.
#[derive(Default)]
pub(crate) struct MaterialEdits {
    files: BTreeMap<String, MaterialText>,
    /// The materials whose latest update was sent.
    sent: BTreeSet<String>,
}

/// A material file as it was read last.
struct MaterialText {
    file: Result<PathBuf, String>,
    text: Result<String, String>,
    edit: Option<Edit>,
}

/// An edit: other values of a file's parameters.
struct Edit {
    form: MaterialForm,
    /// The material with these values, or why there is none.
    material: Result<Material, Vec<String>>,
    /// Whether the file has these values already.
    is_saved: bool,
}

impl MaterialEdits {
    /// Reads the file of a material if that is new or `again` is set, and returns an update if it has
    /// changed. Instead of a file there may be a reason for having none.
    pub(crate) fn follow(
        &mut self,
        material: &str,
        file: Result<&Path, String>,
        again: bool,
    ) -> Option<PreviewUpdate> {
        let file = file.map(Path::to_owned);
        let known = self.files.get(material).filter(|known| known.file == file);
        let is_sent = self.sent.contains(material);
        if known.is_some() && is_sent && !again {
            return None;
        }
        let text = match &file {
            Ok(file) => read(file),
            Err(reason) => Err(reason.clone()),
        };
        if is_sent && known.is_some_and(|known| known.text == text) {
            return None;
        }
        let edit = self.files.remove(material).and_then(|known| known.edit);
        let known = MaterialText { file, text, edit };
        let form = known.form();
        // What was saved is the file's own until the file changes again.
        let is_current = |edit: &Edit| !edit.is_saved || form.as_ref() == Ok(&edit.form);
        let edit = known.edit.filter(is_current);
        let unsaved = edit.as_ref().filter(|edit| !edit.is_saved).map(|edit| edit.form.clone());
        self.files.insert(material.into(), MaterialText { edit, ..known });
        self.sent.insert(material.into());
        Some(PreviewUpdate::Material { material: material.into(), form, edited: unsaved })
    }

    /// Forgets what was sent: the window is another one.
    pub(crate) fn reopened(&mut self) {
        self.sent.clear();
    }

    /// Gives a material other values than its file has, or those of its file.
    pub(crate) fn edit(&mut self, material: &str, form: Option<MaterialForm>) {
        let Some(known) = self.files.get_mut(material) else { return };
        known.edit = form.map(|form| {
            let material = known.with_form(&form).and_then(|(file, text)| material_of(file, &text));
            Edit { form, material, is_saved: false }
        });
    }

    /// Writes the values of a form to the file of a material; returns the file.
    ///
    /// # Errors
    /// If the file has changed since it was read, or cannot be written. Lines for a message.
    pub(crate) fn save(&mut self, material: &str, form: MaterialForm) -> Result<PathBuf, Vec<String>> {
        let unknown = || vec![format!("{material} has no file")];
        let known = self.files.get_mut(material).ok_or_else(unknown)?;
        let (file, text) = known.with_form(&form)?;
        let file = file.to_owned();
        let made = material_of(&file, &text)?;
        if read(&file) != known.text {
            // The window asks what to do with it when the material is shown.
            self.sent.remove(material);
            return Err(vec![format!("{} has changed on the disk", path_text(file))]);
        }
        write(&file, &text).map_err(|error| vec![format!("{}: {error}", path_text(&file))])?;
        known.text = Ok(text);
        known.edit = Some(Edit { form, material: Ok(made), is_saved: true });
        self.sent.remove(material);
        Ok(file)
    }

    /// The material with the values that the window gave it, if they are not those of its results: `built` is
    /// what the last build made of the file.
    pub(crate) fn material(
        &mut self,
        material: &str,
        built: impl FnOnce() -> Option<Material>,
    ) -> Result<Option<Material>, Vec<String>> {
        let Some(known) = self.files.get_mut(material) else { return Ok(None) };
        let Some(edit) = &known.edit else { return Ok(None) };
        let edited = edit.material.clone()?;
        if edit.is_saved && built().is_some_and(|built| built == edited) {
            known.edit = None;
            return Ok(None);
        }
        Ok(Some(edited))
    }

    /// The first material with unsaved values whose name is that of another file among these.
    pub(crate) fn unsaved_of_another_file<'f>(
        &self,
        file_of: impl Fn(&str) -> Option<Result<&'f Path, String>>,
    ) -> Option<&str> {
        let real = |file: &Path| canonicalize(file).ok();
        let is_other = |(material, known): &(&String, &MaterialText)| {
            let is_unsaved = known.edit.as_ref().is_some_and(|edit| !edit.is_saved);
            is_unsaved
                && file_of(material).is_some_and(|file| match (&known.file, file) {
                    (Ok(known), Ok(file)) => real(known) != real(file),
                    _ => true,
                })
        };
        self.files.iter().find(is_other).map(|(material, _)| material.as_str())
    }

    /// The files with values that are not saved.
    pub(crate) fn unsaved(&self) -> impl Iterator<Item = &Path> {
        let files = self.files.values();
        let unsaved = files.filter(|known| known.edit.as_ref().is_some_and(|edit| !edit.is_saved));
        unsaved.filter_map(|known| known.file.as_deref().ok())
    }
}

impl MaterialText {
    /// The file's own values.
    fn form(&self) -> Result<MaterialForm, String> {
        let (file, text) = self.parts()?;
        // What the kind does not read is not edited either.
        material_of(file, text).map_err(|lines| lines.join(": "))?;
        stages::material_form(&name(file), text)
    }

    /// The file, and its text with the values of a form.
    fn with_form(&self, form: &MaterialForm) -> Result<(&Path, String), Vec<String>> {
        let line = |reason| vec![reason];
        let (file, text) = self.parts().map_err(line)?;
        Ok((file, stages::material_with_form(&name(file), text, form).map_err(line)?))
    }

    fn parts(&self) -> Result<(&Path, &str), String> {
        Ok((self.file.as_ref().map_err(Clone::clone)?, self.text.as_ref().map_err(Clone::clone)?))
    }
}

fn name(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The text of a material file.
fn read(file: &Path) -> Result<String, String> {
    if let Some(reason) = stages::why_not_editable(file) {
        return Err(reason);
    }
    let cannot = |error: String| format!("{}: {error}", path_text(file));
    let bytes = engine::read_file(file).map_err(|error| cannot(error.to_string()))?;
    String::from_utf8(bytes).map_err(|error| cannot(error.to_string()))
}

/// Replaces a file, which keeps its permissions. A link stays a link.
pub(super) fn write(file: &Path, text: &str) -> io::Result<()> {
    let file = canonicalize(file)?;
    let permissions = fs::metadata(&file)?.permissions();
    engine::replace_file(&file, text.as_bytes())?;
    fs::set_permissions(&file, permissions)
}

/// The material of a text, as the kind `import-material` reads it.
fn material_of(file: &Path, text: &str) -> Result<Material, Vec<String>> {
    let folder = file.parent().unwrap_or(Path::new(""));
    let read = |path: &Path| {
        let path = folder.join(path);
        let cannot = |error| Failure::from(error).context(format!("cannot read {}", path_text(&path)));
        engine::read_file(&path).map(Arc::new).map_err(cannot)
    };
    let read = stages::read_material(&name(file), text.as_bytes(), None, &read);
    read.map(|found| found.material).map_err(|failure| failure.chain)
}

#[cfg(test)]
mod tests {
    use ::preview::FormField;
    use brdf::Value;

    use super::*;

    const GOLD: &str = "# Gold.\nmodel = \"phong\"\nexponent = 4 # broad\n";
    const EXPONENT: FormField = FormField { section: 0, parameter: 0 };

    fn exponent(form: &MaterialForm) -> f64 {
        match form.value(EXPONENT) {
            Some(Value::Number(number)) => *number,
            other => panic!("{other:?}"),
        }
    }

    fn with_exponent(form: &MaterialForm, exponent: f64) -> MaterialForm {
        let mut form = form.clone();
        form.set(EXPONENT, &Value::Number(exponent));
        form
    }

    /// The form of an update.
    fn form(update: Option<PreviewUpdate>) -> MaterialForm {
        match update {
            Some(PreviewUpdate::Material { form: Ok(form), .. }) => form,
            other => panic!("{other:?}"),
        }
    }

    /// A file, the edits that follow it, and its form.
    fn gold() -> (tempfile::TempDir, PathBuf, MaterialEdits, MaterialForm) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("gold.toml");
        fs::write(&file, GOLD).unwrap();
        let mut edits = MaterialEdits::default();
        let form = form(edits.follow("gold", Ok(&file), false));
        (folder, file, edits, form)
    }

    #[test]
    fn nothing_is_written_before_it_is_saved_and_then_only_the_value() {
        let (folder, file, mut edits, form) = gold();
        assert_eq!(exponent(&form), 4.0);
        let edited = with_exponent(&form, 12.5);
        edits.edit("gold", Some(edited.clone()));
        assert_eq!(fs::read_to_string(&file).unwrap(), GOLD);
        assert_eq!(edits.unsaved().collect::<Vec<_>>(), [file.as_path()]);
        let shown = edits.material("gold", || None).unwrap().unwrap();
        assert_eq!(shown.values().number("exponent"), Ok(12.5));

        assert_eq!(edits.save("gold", edited.clone()).as_ref(), Ok(&file));
        assert_eq!(fs::read_to_string(&file).unwrap(), GOLD.replace("= 4 ", "= 12.5 "));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left beside it");
        assert_eq!(edits.unsaved().count(), 0);
        assert_eq!(self::form(edits.follow("gold", Ok(&file), false)), edited);
        assert!(edits.follow("gold", Ok(&file), true).is_none(), "it is as it was sent");
        // It is shown until the build has made it.
        let old = material_of(&file, GOLD).unwrap();
        assert!(edits.material("gold", || Some(old)).unwrap().is_some());
        assert!(edits.material("gold", || Some(shown)).unwrap().is_none());
        assert!(edits.material("gold", || None).unwrap().is_none());
    }

    #[test]
    fn a_file_that_changed_meanwhile_is_not_overwritten() {
        let (_folder, file, mut edits, form) = gold();
        let edited = with_exponent(&form, 8.0);
        edits.edit("gold", Some(edited.clone()));
        let theirs = GOLD.replace("= 4 ", "= 5 ");
        fs::write(&file, &theirs).unwrap();
        let refused = edits.save("gold", edited.clone()).unwrap_err();
        assert!(refused[0].ends_with("gold.toml has changed on the disk"), "{refused:?}");
        assert_eq!(fs::read_to_string(&file).unwrap(), theirs);

        let Some(PreviewUpdate::Material { form: Ok(on_disk), edited: unsaved, .. }) =
            edits.follow("gold", Ok(&file), true)
        else {
            panic!("the window is told")
        };
        assert_eq!((exponent(&on_disk), unsaved), (5.0, Some(edited.clone())));
        assert_eq!(edits.save("gold", edited), Ok(file.clone()), "the user chose to keep the edit");
        assert_eq!(fs::read_to_string(&file).unwrap(), GOLD.replace("= 4 ", "= 8 "));
    }

    #[test]
    fn a_form_that_no_longer_fits_is_an_error_and_a_window_that_opens_again_gets_the_edit() {
        let (_folder, file, mut edits, form) = gold();
        let edited = with_exponent(&form, 8.0);
        edits.edit("gold", Some(edited.clone()));
        edits.reopened();
        let again = edits.follow("gold", Ok(&file), false);
        assert!(
            matches!(&again, Some(PreviewUpdate::Material { edited: Some(unsaved), .. }) if *unsaved == edited),
            "{again:?}"
        );
        fs::write(&file, "model = \"lambert\"\nalbedo = 0.5\n").unwrap();
        edits.follow("gold", Ok(&file), true);
        edits.edit("gold", Some(edited.clone()));
        assert_eq!(edits.material("gold", || None), Err(vec!["gold.toml now has other parameters".into()]));
        assert!(edits.save("gold", edited).is_err());
        edits.edit("gold", None);
        assert_eq!(edits.material("gold", || None), Ok(None));
    }

    #[test]
    fn a_material_without_an_editable_file_says_why() {
        let folder = tempfile::tempdir().unwrap();
        let why = |file: Result<&Path, String>| match MaterialEdits::default().follow("gold", file, false) {
            Some(PreviewUpdate::Material { form: Err(reason), .. }) => reason,
            other => panic!("{other:?}"),
        };
        assert_eq!(why(Err("a stage makes it".into())), "a stage makes it");
        assert!(why(Ok(Path::new("/x/gold.binary"))).starts_with("gold.binary: a measured table"));
        let file = folder.path().join("bad.toml");
        fs::write(&file, "model = \"phong\"\nexponent = -1\n").unwrap();
        assert!(why(Ok(&file)).contains("exponent: -1 is not a number from 0"), "{}", why(Ok(&file)));
        assert!(why(Ok(&folder.path().join("none.toml"))).contains("none.toml: "));
    }

    #[cfg(unix)]
    #[test]
    fn links_and_permissions_stay() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let (folder, file, mut edits, _) = gold();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
        let link = folder.path().join("link.toml");
        symlink(&file, &link).unwrap();
        let form = form(edits.follow("link", Ok(&link), false));
        edits.save("link", with_exponent(&form, 9.0)).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
        assert_eq!(fs::read_to_string(&file).unwrap(), GOLD.replace("= 4 ", "= 9 "));
    }
}
