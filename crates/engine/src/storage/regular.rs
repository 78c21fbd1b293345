//! Regular files: read without waiting for a pipe or device, bounded by their size, and replaced atomically.
//!
//! A path may come from a manifest, a material or a record in `.specula`, and lead to a pipe that nobody
//! writes to, an endless device, or a link. Each of these is an error here, at once.

use std::fs::{self, File, Metadata};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::key::Digest;
use crate::platform;

/// The largest file that is read: an environment of 16384 x 8192 texels takes 2 GiB.
pub(crate) const MOST_BYTES: u64 = 8 << 30;

/// Files are read in blocks of this size, between which a read can be stopped.
const BLOCK: usize = 1 << 20;

/// Reads a regular file whole, links followed.
///
/// # Errors
/// If it cannot be read, is a folder, pipe, socket or device, is larger than 8 GiB, or grows while it is read
/// ([`io::ErrorKind::ResourceBusy`]).
pub fn read_file(path: &Path) -> io::Result<Vec<u8>> {
    read_until(path, &|| false)
}

/// Writes a file under a temporary, hidden name beside its place and renames it, so that it appears complete
/// or not at all. A link at the place is replaced, not followed.
///
/// # Errors
/// If it cannot be written; nothing is left of it then.
pub fn replace_file(path: &Path, bytes: &[u8]) -> io::Result<()> {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    let number = NEXT.fetch_add(1, Ordering::Relaxed);
    let temporary = path.with_file_name(format!(".specula-{}-{number}.part", std::process::id()));
    replace_through(&temporary, path, None, &mut |mut file| file.write_all(bytes))
}

/// Creates a folder in one that exists; it is not an error if it is there already.
///
/// Unlike [`fs::create_dir_all`] it does not create the folders around it. The project's folder may have been
/// moved away, and if it came back because of a build that still runs, what is put in its place would land
/// inside it.
pub(crate) fn create_folder(folder: &Path) -> io::Result<()> {
    match fs::create_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists && folder.is_dir() => Ok(()),
        created => created,
    }
}

/// Creates a folder, and those around it that are inside another one.
pub(crate) fn create_folders(inside: &Path, folder: &Path) -> io::Result<()> {
    let mut missing = folder.ancestors().take_while(|above| *above != inside).collect::<Vec<_>>();
    missing.reverse();
    missing.into_iter().try_for_each(create_folder)
}

/// Writes a file under a temporary name and renames it to its place. The folders around the place that are in
/// the folder `inside` are created if necessary; without that folder, none is.
///
/// # Errors
/// If it cannot be written; nothing is left of it then.
pub(crate) fn replace_through(
    temporary: &Path,
    place: &Path,
    inside: Option<&Path>,
    write: &mut dyn FnMut(File) -> io::Result<()>,
) -> io::Result<()> {
    let rename = || platform::replace(temporary, place);
    let written = create_new(temporary).and_then(write).and_then(|()| match (rename(), inside) {
        (Err(error), Some(inside)) if error.kind() == io::ErrorKind::NotFound => {
            create_folders(inside, place.parent().unwrap_or(place))?;
            rename()
        }
        (renamed, _) => renamed,
    });
    written.inspect_err(|_| {
        let _ = fs::remove_file(temporary);
    })
}

/// Reads a file as [`read_file`] does, until `stop` says to stop.
///
/// # Errors
/// [`io::ErrorKind::Interrupted`] if it was stopped, or an error of [`read_file`].
pub(crate) fn read_until(path: &Path, stop: &dyn Fn() -> bool) -> io::Result<Vec<u8>> {
    let (mut file, metadata) = open(path)?;
    let mut bytes = Vec::new();
    // One more than the size, so that the end of the file is seen.
    let room = usize::try_from(metadata.len()).ok().and_then(|length| length.checked_add(1));
    room.ok_or(io::ErrorKind::OutOfMemory).map(|room| bytes.try_reserve_exact(room))??;
    copy(&mut file, metadata.len(), stop, |block| bytes.extend_from_slice(block))?;
    Ok(bytes)
}

/// The digest of a regular file's content.
pub(crate) fn hash(path: &Path) -> io::Result<Digest> {
    hash_until(path, &|| false)
}

/// The digest of a regular file's content; the work ends early if `stop` returns true.
///
/// # Errors
/// The errors of [`hash`]; [`io::ErrorKind::Interrupted`] if it was stopped.
pub(crate) fn hash_until(path: &Path, stop: &dyn Fn() -> bool) -> io::Result<Digest> {
    let (mut file, metadata) = open(path)?;
    let mut hasher = blake3::Hasher::new();
    copy(&mut file, metadata.len(), stop, |block| _ = hasher.update(block))?;
    Ok(Digest(*hasher.finalize().as_bytes()))
}

/// Opens a regular file to read, links followed.
pub(crate) fn open(path: &Path) -> io::Result<(File, Metadata)> {
    // Checked before it is opened, because opening some devices has effects, and after, because it may have
    // been replaced.
    check(&fs::metadata(path)?)?;
    let file = platform::open_to_read(path)?;
    let metadata = file.metadata()?;
    check(&metadata)?;
    Ok((file, metadata))
}

/// Writes a file that must not exist yet, not even as a link; returns it open.
///
/// # Errors
/// If something exists there, or it cannot be written. What was written of it remains.
pub(crate) fn write_new(path: &Path, bytes: &[u8]) -> io::Result<File> {
    let mut file = create_new(path)?;
    file.write_all(bytes)?;
    Ok(file)
}

fn create_new(path: &Path) -> io::Result<File> {
    match File::create_new(path) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            // Left by a killed process with the same number, or prepared by someone: a link is removed, not
            // its target.
            fs::remove_file(path)?;
            File::create_new(path)
        }
        created => created,
    }
}

/// Refuses a path in the engine's own folder that is a link, or that exists and is not of the expected type.
/// Links are refused because they may lead anywhere: the folder may have come with someone else's project.
pub(crate) fn check_own(path: &Path, folder: bool) -> io::Result<()> {
    let expected = if folder { "a folder" } else { "a file" };
    match fs::symlink_metadata(path) {
        Ok(found) if found.is_symlink() => Err(other(format!("it is a link, not {expected}"))),
        Ok(found) if folder && !found.is_dir() || !folder && !found.is_file() => {
            Err(other(format!("it is {}, not {expected}", platform::type_of(found.file_type()))))
        }
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

pub(crate) fn links_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let links = entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_symlink()));
    links.map(|entry| entry.path()).collect()
}

fn check(metadata: &Metadata) -> io::Result<()> {
    if metadata.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder, not a file"));
    }
    if !metadata.is_file() {
        return Err(other(format!("it is {}, not a file", platform::type_of(metadata.file_type()))));
    }
    if metadata.len() > MOST_BYTES {
        let (bytes, most) = (metadata.len(), MOST_BYTES >> 30);
        return Err(io::Error::new(
            io::ErrorKind::FileTooLarge,
            format!("it has {bytes} bytes, but at most {most} GiB are read"),
        ));
    }
    Ok(())
}

fn other(message: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, message)
}

/// Reads a file of so many bytes, block by block.
fn copy(
    file: &mut File,
    length: u64,
    stop: &dyn Fn() -> bool,
    mut take: impl FnMut(&[u8]),
) -> io::Result<()> {
    let mut block = vec![0; usize::try_from(length).map_or(BLOCK, |length| BLOCK.min(length + 1))];
    let mut left = length;
    loop {
        if stop() {
            return Err(io::Error::new(io::ErrorKind::Interrupted, "stopped"));
        }
        let count = match file.read(&mut block) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            count => count?,
        };
        if count == 0 {
            return Ok(());
        }
        left = left.checked_sub(count as u64).ok_or_else(|| {
            let message = format!("it grew beyond its {length} bytes while it was read");
            io::Error::new(io::ErrorKind::ResourceBusy, message)
        })?;
        take(&block[..count]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_whole_and_has_its_digest() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bytes");
        for length in [0, 1, BLOCK - 1, BLOCK, BLOCK + 1, 3 * BLOCK + 7] {
            let bytes = (0..length).map(|n| (n * n) as u8).collect::<Vec<_>>();
            fs::write(&path, &bytes).unwrap();
            assert_eq!(read_file(&path).unwrap(), bytes);
            assert_eq!(hash(&path).unwrap(), Digest::of(&bytes));
        }
        assert_eq!(read_file(folder.path()).unwrap_err().kind(), io::ErrorKind::IsADirectory);
        assert_eq!(read_file(&folder.path().join("none")).unwrap_err().kind(), io::ErrorKind::NotFound);
    }

    #[cfg(unix)]
    #[test]
    fn pipes_devices_and_sockets_are_errors_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let socket = folder.path().join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&pipe, &link).unwrap();
        for (path, expected) in [
            (pipe.as_path(), "it is a pipe, not a file"),
            (&link, "it is a pipe, not a file"),
            (&socket, "it is a socket, not a file"),
            (Path::new("/dev/zero"), "it is a device, not a file"),
        ] {
            assert_eq!(read_file(path).unwrap_err().to_string(), expected);
            assert_eq!(hash(path).unwrap_err().to_string(), expected);
        }
    }

    #[test]
    fn endless_files_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sparse");
        File::create(&path).unwrap().set_len(MOST_BYTES + 1).unwrap();
        assert_eq!(read_file(&path).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
        // Its size is not that of its content.
        if Path::new("/proc/self/maps").exists() {
            let error = read_file(Path::new("/proc/self/maps")).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::ResourceBusy);
        }
    }

    #[test]
    fn a_read_can_be_stopped() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bytes");
        fs::write(&path, vec![1; 3 * BLOCK]).unwrap();
        let asked = std::cell::Cell::new(0);
        let stop = || asked.replace(asked.get() + 1) == 2;
        assert_eq!(read_until(&path, &stop).unwrap_err().kind(), io::ErrorKind::Interrupted);
        asked.set(0);
        assert_eq!(hash_until(&path, &stop).unwrap_err().kind(), io::ErrorKind::Interrupted);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_replaced_and_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let (precious, place) = (folder.path().join("precious"), folder.path().join("place"));
        fs::write(&precious, "precious").unwrap();
        std::os::unix::fs::symlink(&precious, &place).unwrap();
        write_new(&place, b"new").unwrap();
        assert_eq!(fs::read_to_string(&place).unwrap(), "new");
        fs::remove_file(&place).unwrap();
        std::os::unix::fs::symlink(&precious, &place).unwrap();
        replace_file(&place, b"newer").unwrap();
        assert_eq!(fs::read_to_string(&place).unwrap(), "newer");
        assert_eq!(fs::read_to_string(&precious).unwrap(), "precious");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }
}
