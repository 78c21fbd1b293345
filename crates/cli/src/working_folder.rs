//! The working folder by its name.
//!
//! The system knows a working folder itself, not its name: if the folder is moved away and another one put in
//! its place, a process stays in the old one. What runs for long finds the new one by the name.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use engine::{canonicalize, path_text};

/// The folder of `-C`.
static ENTERED: OnceLock<PathBuf> = OnceLock::new();

/// Makes a folder the working folder.
pub(crate) fn enter(folder: &Path) -> io::Result<()> {
    let named = named().join(folder);
    std::env::set_current_dir(folder)?;
    let _ = ENTERED.set(named);
    Ok(())
}

/// The absolute path of a file that is named relative to the working folder.
pub(crate) fn path(file: &Path) -> PathBuf {
    named().join(file)
}

/// The name of a file in messages: relative to the working folder if it is inside.
pub(crate) fn name(file: &Path) -> String {
    let path = path(file);
    path_text(path.strip_prefix(named()).unwrap_or(file))
}

/// The absolute path of the working folder, with the links that lead to it as they were named.
fn named() -> PathBuf {
    if let Some(entered) = ENTERED.get() {
        return entered.clone();
    }
    let real = std::env::current_dir().unwrap_or_default();
    // A shell keeps the name by which its user entered the folder.
    let of_shell = std::env::var_os("PWD").map(PathBuf::from).filter(|folder| folder.is_absolute());
    of_shell.filter(|folder| canonicalize(folder).is_ok_and(|folder| folder == real)).unwrap_or(real)
}
