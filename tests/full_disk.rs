//! A full disk and a folder that cannot be written give a clear error, and the old outputs stay.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::{Project, files_below};

/// A small file system mounted on a folder, unmounted at the end.
struct Mount(PathBuf);

impl Mount {
    /// Mounts a tmpfs; `None`, and the test is skipped, if this user may not.
    fn tmpfs(folder: &Path, size: &str, test: &str) -> Option<Self> {
        fs::create_dir_all(folder).unwrap();
        let options = format!("size={size}");
        let mount = Command::new("mount").args(["-t", "tmpfs", "-o", &options, "tmpfs"]).arg(folder).output();
        if mount.is_ok_and(|output| output.status.success()) {
            return Some(Self(folder.to_path_buf()));
        }
        test_data::skip(test, "this user may not mount a tmpfs");
        None
    }

    fn remount(&self, option: &str) {
        let options = format!("remount,{option}");
        let status = Command::new("mount").args(["-o", &options]).arg(&self.0).status().unwrap();
        assert!(status.success());
    }
}

impl Drop for Mount {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

fn change(project: &Project) {
    project.write("assets/materials/gold.toml", "model = \"phong\"\nexponent = 5\nspecular = 1\n");
}

/// Checks that the error names the folder, the cause and what to do, and that each output is the old or the
/// new one.
fn assert_refused(project: &Project, folder: &str, cause: &str) {
    let (before, clean) = (project.outputs(), Project::small());
    change(&clean);
    clean.ok(&["build"]);
    let after = clean.outputs();
    change(project);
    let run = project.specula(&["build"]).ends(4, []);
    let hint =
        if cause == "No space left" { "hint: free some space" } else { "hint: make the folder writable" };
    for words in [project.path(folder).to_str().unwrap(), cause, hint] {
        assert!(run.stderr.contains(words), "no {words:?} in:\n{}", run.stderr);
    }
    let now = project.outputs();
    assert!(before.keys().eq(now.keys()), "{:?} was {:?}", now.keys(), before.keys());
    for (name, bytes) in &now {
        assert!(
            *bytes == before[name] || *bytes == after[name],
            "{name} is neither the old one nor the new one"
        );
    }
    assert_ne!(now, after, "something was refused");
}

/// Checks that a build succeeds after the cause is removed.
fn assert_recovered(project: &Project) {
    project.ok(&["build"]);
    let clean = Project::small();
    change(&clean);
    clean.ok(&["build"]);
    assert_eq!(project.outputs(), clean.outputs());
}

#[test]
fn a_full_output_disk_is_an_error_and_loses_nothing() {
    let project = Project::small();
    let Some(mount) = Mount::tmpfs(&project.path("out"), "4m", "a_full_output_disk") else { return };
    project.ok(&["build"]);
    let used: usize = project.outputs().values().map(|bytes| bytes.len().next_multiple_of(4096)).sum();
    mount.remount(&format!("size={}k", used / 1024 + 4));
    assert_refused(&project, "out", "No space left");
    mount.remount("size=4m");
    assert_recovered(&project);
}

#[test]
fn a_full_cache_disk_is_an_error_and_loses_nothing() {
    let project = Project::small();
    let Some(mount) = Mount::tmpfs(&project.path(".specula"), "16m", "a_full_cache_disk") else { return };
    project.ok(&["build"]);
    let state = files_below(&project.path(".specula"));
    let used: usize = state.values().map(|bytes| bytes.len().next_multiple_of(4096)).sum();
    mount.remount(&format!("size={}k", used / 1024 + 8));
    assert_refused(&project, ".specula", "No space left");
    mount.remount("size=16m");
    assert_recovered(&project);
}

#[test]
fn a_read_only_output_folder_is_an_error_and_loses_nothing() {
    let project = Project::small();
    let Some(mount) = Mount::tmpfs(&project.path("out"), "4m", "a_read_only_output_folder") else { return };
    project.ok(&["build"]);
    mount.remount("ro");
    assert_refused(&project, "out", "Read-only file system");
    mount.remount("rw");
    assert_recovered(&project);
}

#[test]
fn a_read_only_cache_is_an_error_and_loses_nothing() {
    let project = Project::small();
    let Some(mount) = Mount::tmpfs(&project.path(".specula"), "16m", "a_read_only_cache") else { return };
    project.ok(&["build"]);
    mount.remount("ro");
    assert_refused(&project, ".specula", "Read-only file system");
    mount.remount("rw");
    assert_recovered(&project);
}
