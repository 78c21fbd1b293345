//! The index: the tables of a journal in a file, so that the next build does not need to read the journal.
//!
//! ```text
//! header    magic, the bytes and lines of the journal that it covers, the lengths of what follows
//! head      the first two lines of that journal
//! tail      the last bytes that it covers
//! tables    items, stamps, files, publishing, results, blobs, reads
//! names     each with its length before it
//! check     BLAKE3 digest of all before it
//! ```
//!
//! Everything in it is also in the journal. If it does not exist, is damaged, was written by a machine with
//! another byte order, or belongs to an older journal, the journal is read instead. Numbers are stored as in
//! memory.

use std::io::Write as _;
use std::mem::size_of;
use std::path::Path;

use bytemuck::{Pod, Zeroable, bytes_of, cast_slice, pod_read_unaligned};

use super::tables::{NumberedTexts, Tables};
use crate::key::Digest;
use crate::storage::regular::{read_file, replace_through};

/// To be changed with the tables. The number also shows another byte order.
const MAGIC: u64 = 0x5350_4543_494e_0003;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Header {
    magic: u64,
    /// The number of bytes of the journal that are covered.
    length: u64,
    lines: u64,
    /// The rows of each table, the bytes of head and tail, and the names.
    counts: [u64; 10],
}

/// The part of the journal that an index covers.
pub(super) struct Covered {
    pub(super) head: Vec<u8>,
    pub(super) tail: Vec<u8>,
    pub(super) length: u64,
    pub(super) lines: u64,
}

/// Writes an index; the caller holds the lock. If it cannot be written, nothing is lost.
pub(super) fn write(path: &Path, covered: &Covered, tables: &Tables) {
    let Tables { items, stamps, files, publishing, results, blobs, reads, names } = tables;
    let counts = [
        items.len(),
        stamps.len(),
        files.len(),
        publishing.len(),
        results.len(),
        blobs.len(),
        reads.len(),
        covered.head.len(),
        covered.tail.len(),
        names.iter().count(),
    ];
    let header = Header {
        magic: MAGIC,
        length: covered.length,
        lines: covered.lines,
        counts: counts.map(|count| count as u64),
    };
    let parts: [&[u8]; 9] = [
        &covered.head,
        &covered.tail,
        cast_slice(items),
        cast_slice(stamps),
        cast_slice(files),
        cast_slice(publishing),
        cast_slice(results),
        cast_slice(blobs),
        cast_slice(reads),
    ];
    let names = names.iter();
    let mut bytes = Vec::with_capacity(parts.iter().map(|part| part.len()).sum::<usize>() + 4096);
    bytes.extend_from_slice(bytes_of(&header));
    parts.into_iter().for_each(|part| bytes.extend_from_slice(part));
    for name in names {
        bytes.extend_from_slice(&(name.len() as u64).to_ne_bytes());
        bytes.extend_from_slice(name.as_bytes());
    }
    let check = Digest::of(&bytes);
    bytes.extend_from_slice(&check.0);
    // Always the same name, so that a file left by a killed process is overwritten.
    let temporary = path.with_extension("new");
    let _ = replace_through(&temporary, path, None, &mut |mut file| file.write_all(&bytes));
}

/// Reads an index; `None` if there is none that can be used.
pub(super) fn read(path: &Path) -> Option<(Covered, Tables)> {
    let bytes = read_file(path).ok()?;
    let (mut rest, check) = bytes.split_at_checked(bytes.len().checked_sub(32)?)?;
    if Digest::of(rest).0 != check {
        return None;
    }
    let header: Header = pod_read_unaligned(take(&mut rest, size_of::<Header>() as u64)?);
    if header.magic != MAGIC {
        return None;
    }
    let [items, stamps, files, publishing, results, blobs, reads, head, tail, names] = header.counts;
    let covered = Covered {
        head: take(&mut rest, head)?.to_vec(),
        tail: take(&mut rest, tail)?.to_vec(),
        length: header.length,
        lines: header.lines,
    };
    let mut tables = Tables {
        items: table(&mut rest, items)?,
        stamps: table(&mut rest, stamps)?,
        files: table(&mut rest, files)?,
        publishing: table(&mut rest, publishing)?,
        results: table(&mut rest, results)?,
        blobs: table(&mut rest, blobs)?,
        reads: table(&mut rest, reads)?,
        names: NumberedTexts::default(),
    };
    for number in 0..names {
        let length = u64::from_ne_bytes(take(&mut rest, 8)?.try_into().ok()?);
        let name = std::str::from_utf8(take(&mut rest, length)?).ok()?;
        (u64::from(tables.names.number(name)) == number).then_some(())?;
    }
    let fits = covered.tail.len() as u64 <= covered.length && covered.head.len() as u64 <= covered.length;
    (rest.is_empty() && fits && tables.are_sound()).then_some((covered, tables))
}

fn take<'a>(rest: &mut &'a [u8], count: u64) -> Option<&'a [u8]> {
    let (taken, left) = rest.split_at_checked(usize::try_from(count).ok()?)?;
    *rest = left;
    Some(taken)
}

fn table<E: Pod>(rest: &mut &[u8], count: u64) -> Option<Vec<E>> {
    let bytes = take(rest, count.checked_mul(size_of::<E>() as u64)?)?;
    let mut table = vec![E::zeroed(); usize::try_from(count).ok()?];
    bytemuck::cast_slice_mut(&mut table).copy_from_slice(bytes);
    Some(table)
}
