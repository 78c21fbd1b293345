//! The lines of a journal: what each is about, and how it is written.

use std::io::Write;

use serde::Serialize;

use crate::key::Digest;

/// The subject matter of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub(crate) enum Tag {
    /// The latest result, or the failure, of an item.
    Item = b'i',
    /// A result, by its key.
    Result = b'r',
    /// The stamp of a file, and the digest that it had then.
    Stamp = b's',
    Published = b'p',
    /// A folder that a build is publishing into.
    Publishing = b'o',
}

impl Tag {
    pub(super) const ALL: [Self; 5] =
        [Self::Item, Self::Result, Self::Stamp, Self::Published, Self::Publishing];

    pub(super) fn of(letter: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|tag| *tag as u8 == letter)
    }
}

/// The subject of a line: a shortened digest.
pub(crate) type Subject = u128;

/// The subject with a name of several parts.
pub(crate) fn subject(parts: &[&str]) -> Subject {
    let mut hasher = blake3::Hasher::new();
    for part in parts {
        hasher.update(&(part.len() as u64).to_le_bytes()).update(part.as_bytes());
    }
    short(Digest(*hasher.finalize().as_bytes()))
}

/// The subject with a digest as its name.
pub(crate) fn short(digest: Digest) -> Subject {
    digest.0[..16].iter().fold(0, |value, byte| value << 8 | Subject::from(*byte))
}

/// A line to append.
pub(crate) struct Line {
    tag: Tag,
    subject: Subject,
    json: String,
}

impl Line {
    /// A line with some content; `None` revokes earlier lines.
    pub(crate) fn new<T: Serialize>(tag: Tag, subject: Subject, content: Option<&T>) -> Self {
        let json = serde_json::to_string(&content).unwrap_or_else(|_| "null".into());
        Self { tag, subject, json }
    }

    pub(super) fn write(&self, buffer: &mut Vec<u8>) {
        write_line(buffer, self.tag as u8, self.subject, self.json.as_bytes());
    }
}

pub(super) fn write_line(buffer: &mut Vec<u8>, tag: u8, subject: Subject, json: &[u8]) {
    let start = buffer.len();
    buffer.extend_from_slice(&[b' '; CHECK + 1]);
    let _ = write!(buffer, "{} {subject:032x} ", char::from(tag));
    buffer.extend_from_slice(json);
    let check = check(&buffer[start + CHECK + 1..]);
    buffer[start..start + CHECK].copy_from_slice(&check);
    buffer.push(b'\n');
}

pub(super) const CHECK: usize = 16;
const SUBJECT: usize = 32;

/// The number of bytes before the content.
pub(super) const HEAD: usize = CHECK + 1 + 2 + SUBJECT + 1;

pub(super) fn check(rest: &[u8]) -> [u8; CHECK] {
    let mut check = [0; CHECK];
    check.copy_from_slice(&blake3::hash(rest).to_hex().as_bytes()[..CHECK]);
    check
}
