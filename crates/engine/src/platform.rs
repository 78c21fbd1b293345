//! The differences between operating systems: stamps of files, renames over open files, names that differ
//! only in case or in the encoding of their accents.

use std::borrow::Cow;
use std::fs::{self, File, Metadata, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};
use unicode_normalization::UnicodeNormalization;

use crate::timestamp::Timestamp;

/// What the file system knows of a file without reading it: size, times of change in nanoseconds, identity.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Stamp {
    size: u64,
    modified: i64,
    /// The last change of the file's metadata (Unix) or its creation (Windows).
    changed: i64,
    inode: u64,
}

/// The coarsest resolution of times of change on any file system (FAT).
const COARSEST: i64 = 2_000_000_000;

impl Stamp {
    pub(crate) fn of(metadata: &Metadata) -> Self {
        let (changed, inode) = identity(metadata);
        Self { size: metadata.len(), modified: modified(metadata), changed, inode }
    }

    /// When the content was last modified; `None` if the system does not know.
    pub(crate) fn modified(&self) -> Option<Timestamp> {
        u64::try_from(self.modified)
            .ok()
            .filter(|_| self.modified < i64::MAX)
            .map(|time| Timestamp(time / 1_000_000))
    }

    /// Whether this is the stamp of the same content of the same file, which may have been renamed since.
    pub(crate) fn is_renamed(&self, before: &Self) -> bool {
        *self == Self { changed: self.changed, ..*before }
    }

    /// Whether every later change of the file shows in the stamp: its last change is old enough, by the clock
    /// of its file system. `now` is a time of change that the file system gave before the file was read.
    pub(crate) fn is_settled(&self, now: i64) -> bool {
        self.modified.max(self.changed).saturating_add(COARSEST) <= now
    }
}

/// Gives a file that was just written a time of change that no later write can give it again; returns its
/// stamp, and whether that was possible.
///
/// The clock of writes advances only every few milliseconds, so a second write at once may not show in the
/// time of change. This time has an odd number of 100 nanoseconds instead. A file system that keeps time more
/// coarsely rounds it.
pub(crate) fn mark_written(file: &File) -> io::Result<(Stamp, bool)> {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let time = UNIX_EPOCH + Duration::new(now.as_secs(), now.subsec_micros() * 1000 + 700);
    // A file system without such times is handled as one that keeps them coarsely.
    let _ = file.set_modified(time);
    let stamp = Stamp::of(&file.metadata()?);
    Ok((stamp, stamp.modified == nanoseconds(time)))
}

/// When the content was last modified, in nanoseconds since 1970.
pub(crate) fn modified(metadata: &Metadata) -> i64 {
    metadata.modified().map_or(i64::MAX, nanoseconds)
}

fn nanoseconds(time: std::time::SystemTime) -> i64 {
    let magnitude = |span: Duration| i64::try_from(span.as_nanos()).unwrap_or(i64::MAX);
    match time.duration_since(UNIX_EPOCH) {
        Ok(since) => magnitude(since),
        Err(before) => -magnitude(before.duration()),
    }
}

#[cfg(unix)]
fn identity(metadata: &Metadata) -> (i64, u64) {
    use std::os::unix::fs::MetadataExt;
    (metadata.ctime().saturating_mul(1_000_000_000).saturating_add(metadata.ctime_nsec()), metadata.ino())
}

#[cfg(not(unix))]
fn identity(metadata: &Metadata) -> (i64, u64) {
    (metadata.created().map_or(0, nanoseconds), 0)
}

/// The identity of a folder or file, which distinguishes it from another one of the same name, as far as the
/// system knows: device and inode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Identity(u64, u64);

/// The identity of a folder; `None` if there is no folder at the path.
pub(crate) fn folder_identity(path: &Path) -> Option<Identity> {
    let metadata = fs::metadata(path).ok().filter(Metadata::is_dir)?;
    Some(Identity(device(&metadata), identity(&metadata).1))
}

/// The identity of a file, whatever name it is found by; `None` if there is none, or if the system has no
/// identities of files.
pub(crate) fn file_identity(path: &Path) -> Option<Identity> {
    let metadata = fs::metadata(path).ok().filter(|metadata| cfg!(unix) && metadata.is_file())?;
    Some(Identity(device(&metadata), identity(&metadata).1))
}

/// Whether a file has several names (hard links).
#[cfg(unix)]
pub(crate) fn has_other_names(metadata: &Metadata) -> bool {
    metadata.is_file() && std::os::unix::fs::MetadataExt::nlink(metadata) > 1
}

#[cfg(not(unix))]
pub(crate) fn has_other_names(_: &Metadata) -> bool {
    false
}

#[cfg(unix)]
fn device(metadata: &Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::dev(metadata)
}

#[cfg(not(unix))]
fn device(_: &Metadata) -> u64 {
    0
}

/// Where the drives that hold some paths are mounted, by one look; `None` if the system does not say, or if
/// one of the paths does not exist.
pub(crate) fn mount_points<const N: usize>(paths: [&Path; N]) -> Option<[PathBuf; N]> {
    let table = fs::read_to_string(MOUNTS).ok()?;
    let mut mounts = [const { PathBuf::new() }; N];
    for (mount, path) in mounts.iter_mut().zip(paths) {
        *mount = innermost_mount(&table, &fs::canonicalize(path).ok()?)?.0.into();
    }
    Some(mounts)
}

/// The table of mounts: `36 35 98:0 /root /mount/point options - type source options`.
const MOUNTS: &str = "/proc/self/mountinfo";

/// The type of the file system of a path, if other machines can change files there without an event.
pub(crate) fn shared_file_system(path: &Path) -> Option<String> {
    shared_mount(&fs::read_to_string(MOUNTS).ok()?, path)
}

/// The type of the file system of a path by a table of mounts, if it is shared.
fn shared_mount(table: &str, path: &Path) -> Option<String> {
    const SHARED: [&str; 16] = [
        "nfs",
        "nfs4",
        "cifs",
        "smb3",
        "smbfs",
        "9p",
        "afs",
        "ceph",
        "gfs2",
        "glusterfs",
        "lustre",
        "ncpfs",
        "ocfs2",
        "prl_fs",
        "vboxsf",
        "virtiofs",
    ];
    let (_, kind) = innermost_mount(table, path)?;
    (SHARED.contains(&kind.as_str()) || kind.starts_with("fuse.")).then_some(kind)
}

/// The mount of a path by a table of mounts: its place, and the type of its file system.
fn innermost_mount(table: &str, path: &Path) -> Option<(String, String)> {
    let mounts = table.lines().filter_map(|line| {
        let (mount, kind) = line.split_once(" - ")?;
        let point = unescaped(mount.split(' ').nth(4)?);
        path.starts_with(&point).then(|| (point, kind.split(' ').next().unwrap_or_default().to_owned()))
    });
    // If one mount covers another, the last one counts.
    mounts.max_by_key(|(point, _)| point.len())
}

/// A path of the table of mounts, where four characters are written in octal.
fn unescaped(path: &str) -> String {
    path.replace("\\040", " ").replace("\\011", "\t").replace("\\012", "\n").replace("\\134", "\\")
}

/// Renames a file over another (or to a new name) in one step, even while others have the old one open.
///
/// On Windows a virus scanner or viewer may hold the place for a moment; the rename is retried for two
/// seconds.
pub(crate) fn replace(from: &Path, to: &Path) -> io::Result<()> {
    retry_while_held(|| fs::rename(from, to))
}

/// Removes a file; it is not an error if it does not exist.
pub(crate) fn remove(path: &Path) -> io::Result<()> {
    match retry_while_held(|| fs::remove_file(path)) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}

fn retry_while_held(mut act: impl FnMut() -> io::Result<()>) -> io::Result<()> {
    let mut pause = Duration::from_millis(1);
    loop {
        match act() {
            Err(error) if is_held_by_another(&error) && pause < Duration::from_secs(1) => {
                std::thread::sleep(pause);
                pause *= 2;
            }
            other => return other,
        }
    }
}

/// `ERROR_ACCESS_DENIED`, `ERROR_SHARING_VIOLATION`, `ERROR_LOCK_VIOLATION`.
fn is_held_by_another(error: &io::Error) -> bool {
    cfg!(windows) && matches!(error.raw_os_error(), Some(5 | 32 | 33))
}

/// Options with which opening a pipe does not wait for its other end.
#[cfg(unix)]
pub(crate) fn without_waiting(options: &mut OpenOptions) -> &mut OpenOptions {
    use std::os::unix::fs::OpenOptionsExt;
    options.custom_flags(libc::O_NONBLOCK | libc::O_NOCTTY)
}

#[cfg(not(unix))]
pub(crate) fn without_waiting(options: &mut OpenOptions) -> &mut OpenOptions {
    options
}

/// A name as systems compare it that ignore case (Windows, macOS) and the encoding of accents (macOS): the
/// normal form C, in lower case.
pub(crate) fn folded(name: &str) -> Cow<'_, str> {
    if !name.is_ascii() {
        Cow::Owned(name.nfc().flat_map(char::to_lowercase).nfc().collect())
    } else if name.bytes().any(|byte| byte.is_ascii_uppercase()) {
        Cow::Owned(name.to_ascii_lowercase())
    } else {
        Cow::Borrowed(name)
    }
}

/// Whether two spellings name one file, as `Sky.exr` and `sky.exr` do on a file system that ignores case.
pub(crate) fn is_one_file(a: &Path, b: &Path) -> bool {
    match (fs::canonicalize(a), fs::canonicalize(b)) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_is_settled_when_its_last_change_is_two_seconds_old() {
        let stamp = Stamp { size: 1, modified: 5_000_000_000, changed: 4_000_000_000, inode: 1 };
        assert!(!stamp.is_settled(6_999_999_999));
        assert!(stamp.is_settled(7_000_000_000));
        let stamp = Stamp { changed: 6_000_000_000, ..stamp };
        assert!(!stamp.is_settled(7_000_000_000), "a file whose time of change was set back");
        assert!(!stamp.is_settled(0), "a file from the future");
    }

    #[test]
    fn names_are_folded_as_systems_compare_them() {
        for (name, expected) in [
            ("sky", "sky"),
            ("Sky.EXR", "sky.exr"),
            ("caf\u{e9}", "caf\u{e9}"),
            ("cafe\u{301}", "caf\u{e9}"),
            ("CAFE\u{301}", "caf\u{e9}"),
            ("\u{c9}", "\u{e9}"),
            ("\u{1112}\u{1161}\u{11ab}", "\u{d55c}"),
            // The lower case of a dotted I is two characters, which have another normal form than I.
            ("\u{130}", "i\u{307}"),
        ] {
            assert_eq!(folded(name), expected, "{name:?}");
            assert_eq!(folded(&folded(name)), expected, "{name:?} twice");
        }
    }

    #[test]
    fn the_innermost_mount_of_a_path_counts() {
        let table = "22 1 8:1 / / rw - ext4 /dev/sda1 rw\n\
                     36 22 0:45 / /mnt/light\\040box rw shared:1 - nfs4 server:/x rw\n\
                     37 36 8:2 / /mnt/light\\040box/local rw - xfs /dev/sdb rw\n\
                     38 22 0:46 / /ssh rw - fuse.sshfs me@host: rw\n";
        let kind = |path: &str| shared_mount(table, Path::new(path));
        assert_eq!(kind("/home/me/a.exr"), None);
        assert_eq!(kind("/mnt/light box/a.exr").as_deref(), Some("nfs4"));
        assert_eq!(kind("/mnt/light box/local/a.exr"), None);
        assert_eq!(kind("/mnt/light boxes/a.exr"), None);
        assert_eq!(kind("/ssh/a.exr").as_deref(), Some("fuse.sshfs"));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn mounts_are_unknown_while_a_folder_is_away() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("source.txt");
        fs::write(&inside, "").unwrap();
        let [source, project] = mount_points([&inside, folder.path()]).unwrap();
        assert_eq!(source, project);
        assert!(mount_points([&inside, &folder.path().join("away")]).is_none());
    }

    #[test]
    fn replace_works_over_an_open_file() {
        let folder = tempfile::tempdir().unwrap();
        let (new, old) = (folder.path().join("new"), folder.path().join("old"));
        fs::write(&new, "new").unwrap();
        fs::write(&old, "old").unwrap();
        let open = fs::File::open(&old).unwrap();
        replace(&new, &old).unwrap();
        drop(open);
        assert_eq!(fs::read_to_string(&old).unwrap(), "new");
        assert!(!new.exists());
    }

    #[test]
    fn two_files_with_equal_content_are_not_one() {
        let folder = tempfile::tempdir().unwrap();
        let (a, b) = (folder.path().join("a"), folder.path().join("b"));
        fs::write(&a, "x").unwrap();
        fs::write(&b, "x").unwrap();
        assert!(!is_one_file(&a, &b));
        assert!(is_one_file(&a, &folder.path().join(".").join("a")));
    }
}
