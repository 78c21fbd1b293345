//! The files that other programs have open for writing, as far as the system shows it.
//!
//! Linux shows the open files of the processes of the same user, and all of them to root. Other systems show
//! none.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::platform::{Identity, canonicalize, file_identity, has_other_names};

/// Returns the files that a program has open for writing, by the names that they have in `files`.
pub(crate) fn being_written<'a>(files: impl IntoIterator<Item = &'a Path>) -> HashSet<PathBuf> {
    // A file may have several names among them, and others elsewhere.
    let (mut real, mut linked) = (HashMap::<PathBuf, Vec<&Path>>::new(), HashMap::<_, Vec<&Path>>::new());
    for file in files {
        if let Ok(path) = canonicalize(file) {
            if fs::metadata(&path).is_ok_and(|found| has_other_names(&path, &found)) {
                linked.entry(file_identity(&path)).or_default().push(file);
            }
            real.entry(path).or_default().push(file);
        }
    }
    let mut found = HashSet::new();
    if !real.is_empty() {
        for_each_open_file(&mut |path, is_writable| {
            let by_identity = || (!linked.is_empty()).then(|| linked.get(&file_identity(&path))).flatten();
            if let Some(files) = real.get(&path).or_else(by_identity)
                && is_writable()
            {
                found.extend(files.iter().map(|file| file.to_path_buf()));
            }
        });
    }
    found
}

pub(crate) fn open_for_writing() -> HashSet<Identity> {
    let mut found = HashSet::new();
    for_each_open_file(&mut |path, is_writable| {
        if is_writable() {
            found.extend(file_identity(&path));
        }
    });
    found
}

/// Calls a function with the path of each open file, and with what finds out whether it may be written to.
fn for_each_open_file(visit: &mut dyn FnMut(PathBuf, &dyn Fn() -> bool)) {
    if !cfg!(target_os = "linux") {
        return;
    }
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    for process in processes.filter(|process| process.file_name().to_string_lossy().parse::<u32>().is_ok()) {
        let process = process.path();
        for open in fs::read_dir(process.join("fd")).into_iter().flatten().flatten() {
            // Pipes, sockets and devices have no such path.
            if let Ok(path) = fs::read_link(open.path())
                && path.is_absolute()
                && !path.starts_with("/dev")
            {
                visit(path, &|| is_writable(&process.join("fdinfo").join(open.file_name())));
            }
        }
    }
}

/// Whether a description of an open file, with a line `flags: 0100001` in octal, says that it may be written
/// to.
fn is_writable(description: &Path) -> bool {
    const WRITE_ONLY_OR_BOTH: u32 = 0o3;
    let text = fs::read_to_string(description).unwrap_or_default();
    let flags = text.lines().find_map(|line| line.strip_prefix("flags:"));
    let flags = flags.and_then(|flags| u32::from_str_radix(flags.trim(), 8).ok());
    flags.is_some_and(|flags| flags & WRITE_ONLY_OR_BOTH != 0)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::fs::{File, OpenOptions};

    use super::*;

    #[test]
    fn a_file_is_being_written_as_long_as_it_is_open_for_that() {
        let folder = tempfile::tempdir().unwrap();
        let [written, read, other] = ["written", "read", "other"].map(|name| folder.path().join(name));
        [&written, &read, &other].into_iter().for_each(|file| fs::write(file, "").unwrap());
        let _reader = File::open(&read).unwrap();
        let all = || [&written, &read, &other].into_iter().map(PathBuf::as_path);
        for options in [OpenOptions::new().write(true), OpenOptions::new().read(true).append(true)] {
            let writer = options.open(&written).unwrap();
            assert_eq!(being_written(all()), HashSet::from([written.clone()]));
            drop(writer);
            assert_eq!(being_written(all()), HashSet::new());
        }
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&written, &link).unwrap();
        let _writer = OpenOptions::new().append(true).open(&written).unwrap();
        let names = [written.as_path(), link.as_path()];
        assert_eq!(being_written(names), names.map(Path::to_path_buf).into());
        let other_name = folder.path().join("other name");
        fs::hard_link(&written, &other_name).unwrap();
        assert_eq!(being_written([other_name.as_path()]), HashSet::from([other_name.clone()]));
        assert!(open_for_writing().contains(&file_identity(&other_name).unwrap()));
    }
}
