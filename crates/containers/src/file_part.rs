//! Reads parts of a file that is open.

use std::io::{Read, Seek, SeekFrom};

use crate::error::Error;

pub(crate) fn length(file: &mut impl Seek) -> Result<usize, Error> {
    let length = file.seek(SeekFrom::End(0)).map_err(unreadable)?;
    rewind(file)?;
    Ok(usize::try_from(length).unwrap_or(usize::MAX))
}

/// The first bytes of a file: `most`, or all that it has.
pub(crate) fn beginning(file: &mut (impl Read + Seek), most: u64) -> Result<Vec<u8>, Error> {
    rewind(file)?;
    let mut bytes = Vec::new();
    file.by_ref().take(most).read_to_end(&mut bytes).map_err(unreadable)?;
    Ok(bytes)
}

pub(crate) fn rewind(file: &mut impl Seek) -> Result<(), Error> {
    file.rewind().map_err(unreadable)
}

/// So many bytes of a file, at most eight, and zeros; `None` if they are not there.
pub(crate) fn bytes_at(file: &mut (impl Read + Seek), at: usize, count: usize) -> Option<[u8; 8]> {
    let mut bytes = [0; 8];
    file.seek(SeekFrom::Start(at as u64)).ok()?;
    file.read_exact(bytes.get_mut(..count)?).ok()?;
    Some(bytes)
}

/// The bytes of a part of a file, whose length was compared with the file's before; `None` if they are not
/// there.
pub(crate) fn range(file: &mut (impl Read + Seek), at: usize, count: usize) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(at as u64)).ok()?;
    file.by_ref().take(count as u64).read_to_end(&mut bytes).ok()?;
    (bytes.len() == count).then_some(bytes)
}

fn unreadable(error: std::io::Error) -> Error {
    Error::truncated(format!("the file cannot be read: {error}"))
}
