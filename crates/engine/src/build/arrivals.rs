//! What consumers receive of an item: its artifact, the sizes of the files that it exports, or one of these
//! files.

use serde_json::Value;

use crate::key::Digest;
use crate::kinds::{Artifact, ExportedFiles, Product, is_left_out};
use crate::plan::ItemIndex;
use crate::storage::{Blob, Record};

/// What an item takes of another one at a port.
#[derive(Clone, Copy)]
pub(crate) struct Arrival<'p> {
    pub(crate) port: &'p str,
    /// The item that made it.
    pub(crate) from: ItemIndex,
    /// The place of the exported file; `None`: its artifact, or the sizes of its files.
    pub(crate) file: Option<usize>,
}

/// The digest of what arrives at a port that takes the file at this place, or no file, of an item that makes
/// this product, by its record.
pub(crate) fn arriving(product: &Product, file: Option<usize>, record: &Record) -> Option<Digest> {
    digest_of(product, file, &record.kind, &record.parameters, &record.outputs)
}

/// Whether a digest is that of something that arrives at consumers of the item with this record.
pub(crate) fn has_made(record: &Record, digest: Digest) -> bool {
    record.outputs.iter().any(|blob| blob.digest == digest)
        || digest_of_sizes(&record.kind, &record.parameters, &record.outputs) == digest
}

/// The digest of what arrives of an item of this kind and parameters with these outputs.
pub(crate) fn digest_of(
    product: &Product,
    file: Option<usize>,
    kind: &str,
    parameters: &Value,
    outputs: &[Blob],
) -> Option<Digest> {
    let first = outputs.first()?;
    Some(match (product, file) {
        (Product::Artifact(_), _) => first.digest,
        (Product::Files(_), Some(place)) => outputs.get(place)?.digest,
        (Product::Files(_), None) => digest_of_sizes(kind, parameters, outputs),
    })
}

fn digest_of_sizes(kind: &str, parameters: &Value, outputs: &[Blob]) -> Digest {
    Digest::of(&exported_files(kind, parameters, outputs).1)
}

/// The bytes of each exported file; 0 for one that was left out.
pub(crate) fn file_sizes(outputs: &[Blob]) -> Vec<u64> {
    outputs.iter().map(|blob| if is_left_out(blob.digest) { 0 } else { blob.bytes }).collect()
}

/// What consumers learn of the files of an item, as a value and encoded.
pub(crate) fn exported_files(kind: &str, parameters: &Value, outputs: &[Blob]) -> (ExportedFiles, Vec<u8>) {
    let (kind, parameters) = (kind.to_owned(), parameters.clone());
    let files = ExportedFiles { kind, parameters, bytes: file_sizes(outputs) };
    let encoded = files.encode().unwrap_or_default();
    (files, encoded)
}
