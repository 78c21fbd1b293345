//! Bytes on a server.

use serde::{Deserialize, Serialize};

use crate::key::Digest;

/// A blob on the server: its digest there (SHA-256), and its size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SharedBlob {
    /// The digest by which the server knows it.
    pub hash: Digest,
    /// The size in bytes.
    pub bytes: u64,
}
