//! Where PATH leads: the folders in which programs are looked up by name.

use std::env;
use std::ffi::OsStr;
use std::path::PathBuf;

use crate::platform::{can_run, program_endings};

/// The folders of PATH, in order.
#[derive(Clone, Debug, Default)]
pub(crate) struct SearchPath(Vec<PathBuf>);

impl SearchPath {
    /// The folders of this process's PATH.
    pub(crate) fn current() -> Self {
        Self::of(env::var_os("PATH").as_deref())
    }

    /// The absolute folders of a value of PATH. A relative folder would depend on the working folder.
    pub(crate) fn of(path: Option<&OsStr>) -> Self {
        let folders = path.into_iter().flat_map(env::split_paths);
        Self(folders.filter(|folder| folder.is_absolute()).collect())
    }

    /// The files that are tried for a name, in order.
    pub(crate) fn candidates(&self, name: &OsStr) -> impl Iterator<Item = PathBuf> {
        let endings = program_endings();
        let names = endings.into_iter().map(|ending| {
            let mut file = name.to_owned();
            file.push(ending);
            file
        });
        let names = names.collect::<Vec<_>>();
        self.0.iter().flat_map(move |folder| names.clone().into_iter().map(|name| folder.join(name)))
    }

    /// The candidates up to the one that is found; all of them if none is.
    pub(crate) fn tried(&self, name: &OsStr) -> Vec<PathBuf> {
        let mut tried = Vec::new();
        for file in self.candidates(name) {
            let is_found = can_run(&file);
            tried.push(file);
            if is_found {
                break;
            }
        }
        tried
    }

    /// The first candidate that can be run.
    pub(crate) fn find(&self, name: &OsStr) -> Option<PathBuf> {
        self.candidates(name).find(|file| can_run(file))
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::fs;
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    #[test]
    fn path_leads_to_the_first_file_that_can_be_run() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, mode: u32| {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, "").unwrap();
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
            path
        };
        let (first, second, _) = (file("a/tool", 0o644), file("b/tool", 0o755), file("c/tool", 0o755));
        let path = env::join_paths(["x", "a", "b", "c"].map(|name| folder.path().join(name))).unwrap();
        let path = SearchPath::of(Some(&path));
        assert_eq!(path.find("tool".as_ref()), Some(second.clone()));
        assert_eq!(path.tried("tool".as_ref()), [folder.path().join("x/tool"), first, second]);
        assert_eq!(path.find("other".as_ref()), None);
        assert_eq!(path.tried("other".as_ref()).len(), 4);
        assert_eq!(SearchPath::of(None).find("tool".as_ref()), None);
        assert_eq!(SearchPath::of(Some("b:.".as_ref())).tried("tool".as_ref()), Vec::<PathBuf>::new());
    }
}
