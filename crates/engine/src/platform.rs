//! The differences between operating systems: stamps of files, renames over open files, names that differ
//! only in case or in the encoding of their accents.

#[cfg(unix)]
mod unix;
#[cfg(windows)]
mod windows;

use std::borrow::Cow;
use std::ffi::OsStr;
use std::fs::{self, File, Metadata};
use std::io;
use std::path::{Component, Path, PathBuf, Prefix};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};
use unicode_normalization::UnicodeNormalization;

use crate::timestamp::{Timestamp, nanoseconds};
#[cfg(unix)]
use unix as system;
#[cfg(windows)]
use windows as system;

pub(crate) use system::{can_run, has_other_names, program_endings, type_of};

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
        let (changed, inode) = system::changed(metadata);
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

/// The identity of a folder or file, which distinguishes it from another one of the same name: its drive, and
/// its number there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Identity(u64, u64);

/// The identity of a folder; `None` if there is no folder at the path.
pub(crate) fn folder_identity(path: &Path) -> Option<Identity> {
    let metadata = fs::metadata(path).ok().filter(Metadata::is_dir)?;
    system::identity(path, &metadata).map(|(drive, number)| Identity(drive, number))
}

/// The identity of a file, whatever name it is found by; `None` if there is none.
pub(crate) fn file_identity(path: &Path) -> Option<Identity> {
    let metadata = fs::metadata(path).ok().filter(Metadata::is_file)?;
    system::identity(path, &metadata).map(|(drive, number)| Identity(drive, number))
}

/// The path of what exists, absolute and with all links followed.
///
/// # Errors
/// If nothing is there, or it cannot be looked at.
pub fn canonicalize(path: impl AsRef<Path>) -> io::Result<PathBuf> {
    fs::canonicalize(path).map(plain)
}

/// An absolute path, with its links as they are; it need not exist.
pub(crate) fn absolute(path: &Path) -> PathBuf {
    plain(std::path::absolute(path).unwrap_or_else(|_| path.into()))
}

/// A path in the one spelling that paths are compared in: on Windows with a drive's letter in upper case and
/// without the `\\?\` that the system puts before resolved paths.
fn plain(path: PathBuf) -> PathBuf {
    if !cfg!(windows) {
        return path;
    }
    path.to_str().map(|text| windows_text(text).into()).unwrap_or(path)
}

/// Where the drives that hold some paths are mounted, by one look; `None` if the system does not say, or if
/// one of the paths does not exist.
pub(crate) fn mount_points<const N: usize>(paths: [&Path; N]) -> Option<[PathBuf; N]> {
    let table = fs::read_to_string(MOUNTS).ok()?;
    let mut mounts = [const { PathBuf::new() }; N];
    for (mount, path) in mounts.iter_mut().zip(paths) {
        *mount = innermost_mount(&table, &canonicalize(path).ok()?)?.0.into();
    }
    Some(mounts)
}

/// The table of mounts: `36 35 98:0 /root /mount/point options - type source options`.
const MOUNTS: &str = "/proc/self/mountinfo";

/// The type of the file system of a path, if other machines can change files there without an event.
pub(crate) fn shared_file_system(path: &Path) -> Option<String> {
    let is_share = |path: &Path| match path.components().next() {
        Some(Component::Prefix(prefix)) => matches!(prefix.kind(), Prefix::UNC(..) | Prefix::VerbatimUNC(..)),
        _ => false,
    };
    // A drive's letter may stand for a share.
    if is_share(path) || cfg!(windows) && canonicalize(path).is_ok_and(|real| is_share(&real)) {
        return Some("a network share".into());
    }
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
/// # Errors
/// If it cannot be renamed. On Windows a program may hold the file in its place: a virus scanner for a
/// moment, an engine for as long as it runs. The rename is retried for two seconds; then the error names that
/// program.
pub(crate) fn replace(from: &Path, to: &Path) -> io::Result<()> {
    retry_while_held(to, &[ACCESS_DENIED, SHARING_VIOLATION, LOCK_VIOLATION], || fs::rename(from, to))
}

/// Removes a file; it is not an error if it does not exist.
///
/// # Errors
/// If it cannot be removed. On Windows a program may hold it: that is tried for two seconds, then the error
/// names that program.
pub(crate) fn remove(path: &Path) -> io::Result<()> {
    let held = &[ACCESS_DENIED, SHARING_VIOLATION, LOCK_VIOLATION];
    match retry_while_held(path, held, || fs::remove_file(path)) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}

/// Opens a file to read, without waiting for the other end of a pipe.
///
/// # Errors
/// If it cannot be opened. On Windows the program that writes it may not let others read it: it is tried for
/// two seconds, then the error names that program.
pub(crate) fn open_to_read(path: &Path) -> io::Result<File> {
    let open = || system::without_waiting(File::options().read(true)).open(path);
    retry_while_held(path, &[SHARING_VIOLATION, LOCK_VIOLATION], open)
}

/// Windows refuses to replace a file that another program has open and does not share; some file systems
/// refuse it for every open file. A file that is marked read-only gives the same error.
const ACCESS_DENIED: i32 = 5;
/// Another program has the file open and does not share it.
const SHARING_VIOLATION: i32 = 32;
/// Another program has locked a part of the file.
const LOCK_VIOLATION: i32 = 33;

/// How long to wait for a program that holds a file.
const LONGEST_HOLD: Duration = Duration::from_secs(2);

fn retry_while_held<T>(path: &Path, held: &[i32], mut act: impl FnMut() -> io::Result<T>) -> io::Result<T> {
    let mut pause = Duration::from_millis(1);
    loop {
        match act() {
            Err(error) if cfg!(windows) && error.raw_os_error().is_some_and(|code| held.contains(&code)) => {
                let metadata = fs::symlink_metadata(path);
                if metadata.as_ref().is_ok_and(|found| found.is_dir()) {
                    return Err(error);
                }
                if metadata.is_ok_and(|found| found.permissions().readonly()) {
                    return Err(io::Error::new(io::ErrorKind::PermissionDenied, MarkedReadOnly));
                }
                if pause >= LONGEST_HOLD {
                    return Err(io::Error::new(io::ErrorKind::TimedOut, HeldOpen::of(path, &error)));
                }
                std::thread::sleep(pause);
                pause *= 2;
            }
            other => return other,
        }
    }
}

/// The error of a file that is marked read-only, as version control marks what is not checked out.
#[derive(Debug, thiserror::Error)]
#[error("the file is marked read-only")]
pub(crate) struct MarkedReadOnly;

/// The error of a file that other programs do not let go.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct HeldOpen(String);

impl HeldOpen {
    fn of(path: &Path, error: &io::Error) -> Self {
        match system::programs_that_hold(path).as_slice() {
            [] => Self(format!("another program has it open ({error})")),
            programs => Self(format!("{} has it open", programs.join(" and "))),
        }
    }
}

/// A path as people of this system write it: on Windows with `\` between its parts, and without the `\\?\`
/// that the system itself puts before resolved paths.
pub fn path_text(path: impl AsRef<Path>) -> String {
    let text = path.as_ref().display().to_string();
    if cfg!(windows) { windows_text(&text) } else { text }
}

/// A path as people write it on Windows. No name there contains a `/`.
fn windows_text(path: &str) -> String {
    let path = path.replace('/', r"\");
    let disk = |path: &str| path.as_bytes().get(1) == Some(&b':');
    match (path.strip_prefix(r"\\?\UNC\"), path.strip_prefix(r"\\?\").unwrap_or(&path)) {
        (Some(share), _) => format!(r"\\{share}"),
        (None, plain) if disk(plain) => format!("{}{}", plain[..1].to_ascii_uppercase(), &plain[1..]),
        _ => path,
    }
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

/// What a name in a folder is known by: on systems that ignore case, an event may spell it differently than
/// the manifest does.
pub(crate) fn name_key(name: &OsStr) -> Cow<'_, OsStr> {
    match name.to_str() {
        Some(text) if cfg!(any(windows, target_vendor = "apple")) => match folded(text) {
            Cow::Borrowed(_) => Cow::Borrowed(name),
            Cow::Owned(folded) => Cow::Owned(folded.into()),
        },
        _ => Cow::Borrowed(name),
    }
}

/// Whether two spellings name one file, as `Sky.exr` and `sky.exr` do on a file system that ignores case.
pub(crate) fn is_one_file(a: &Path, b: &Path) -> bool {
    match (canonicalize(a), canonicalize(b)) {
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

    /// On Windows only some file systems can.
    #[cfg(unix)]
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
        assert!(file_identity(&a).is_some() && file_identity(&a) != file_identity(&b));
        assert_eq!(file_identity(&a), file_identity(&folder.path().join(".").join("a")));
        assert_ne!(folder_identity(folder.path()), folder_identity(&std::env::temp_dir()));
        assert_eq!((file_identity(folder.path()), folder_identity(&a)), (None, None));
    }

    #[test]
    fn paths_on_windows_are_shown_as_people_write_them() {
        for (path, expected) in [
            ("maps/brushed/steel.toml", r"maps\brushed\steel.toml"),
            (r"C:\studio\assets/steel.toml", r"C:\studio\assets\steel.toml"),
            ("d:/studio", r"D:\studio"),
            (r"\\?\c:\studio\a.exr", r"C:\studio\a.exr"),
            (r"\\?\UNC\server\share\a.exr", r"\\server\share\a.exr"),
            ("//server/share/a.exr", r"\\server\share\a.exr"),
            (
                r"\\?\Volume{b75e2c83-0000-0000-0000-602f00000000}\a",
                r"\\?\Volume{b75e2c83-0000-0000-0000-602f00000000}\a",
            ),
            ("", ""),
        ] {
            assert_eq!(windows_text(path), expected, "{path}");
        }
    }

    #[cfg(windows)]
    mod held {
        use std::os::windows::fs::OpenOptionsExt;

        use super::*;

        const FILE_SHARE_READ: u32 = 1;

        /// A folder with a file `place` that this process has open, and a file `new`.
        fn holding(share: u32) -> (tempfile::TempDir, File, [PathBuf; 2]) {
            let folder = tempfile::tempdir().unwrap();
            let paths = ["new", "place"].map(|name| folder.path().join(name));
            paths
                .iter()
                .for_each(|path| fs::write(path, path.file_name().unwrap().as_encoded_bytes()).unwrap());
            let file = File::options().read(true).share_mode(share).open(&paths[1]).unwrap();
            (folder, file, paths)
        }

        fn let_go_soon(file: File) -> std::thread::JoinHandle<()> {
            std::thread::spawn(move || {
                std::thread::sleep(Duration::from_millis(200));
                drop(file);
            })
        }

        #[test]
        fn a_file_that_is_soon_let_go_is_replaced_removed_and_read() {
            let (_folder, file, [new, place]) = holding(FILE_SHARE_READ);
            let holder = let_go_soon(file);
            replace(&new, &place).unwrap();
            assert_eq!(fs::read(&place).unwrap(), b"new");
            holder.join().unwrap();
            let (_folder, file, [_, place]) = holding(FILE_SHARE_READ);
            let holder = let_go_soon(file);
            remove(&place).unwrap();
            holder.join().unwrap();
            let (_folder, file, [_, place]) = holding(0);
            let holder = let_go_soon(file);
            assert_eq!(io::read_to_string(open_to_read(&place).unwrap()).unwrap(), "place");
            holder.join().unwrap();
        }

        #[test]
        fn a_file_that_is_kept_stays_as_it_is_and_the_error_says_who_has_it() {
            let (_folder, file, [new, place]) = holding(0);
            for error in [replace(&new, &place), remove(&place), open_to_read(&place).map(drop)] {
                let error = error.unwrap_err();
                assert_eq!(error.kind(), io::ErrorKind::TimedOut);
                assert!(error.to_string().contains(" has it open"), "{error}");
            }
            drop(file);
            assert_eq!(
                (fs::read(&place).unwrap(), fs::read(&new).unwrap()),
                (b"place".into(), b"new".into())
            );
        }

        #[test]
        fn a_file_that_is_marked_read_only_is_not_replaced() {
            let (_folder, file, [new, place]) = holding(7);
            drop(file);
            let mark = |is_marked: bool| {
                let mut permissions = fs::metadata(&place).unwrap().permissions();
                permissions.set_readonly(is_marked);
                fs::set_permissions(&place, permissions).unwrap();
            };
            mark(true);
            if let Err(error) = replace(&new, &place) {
                assert_eq!(error.to_string(), "the file is marked read-only");
                assert_eq!(fs::read(&place).unwrap(), b"place");
                mark(false);
                replace(&new, &place).unwrap();
            }
            assert_eq!(fs::read(&place).unwrap(), b"new");
        }
    }
}
