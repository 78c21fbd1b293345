//! What a stage that exports files hands to a stage that is connected to it: how large the files are, and
//! what wrote them.

use serde::{Deserialize, Serialize};

use super::artifact::Artifact;
use super::failure::Failure;

/// The sizes of the files that an item exports, and the parameters by which they were made, for a kind that
/// reports on exports.
///
/// A port takes them from every stage that exports files. The files themselves do not arrive, so a consumer
/// reruns if a size or a parameter changes, and not if a file has other bytes of the same number or another
/// name. A kind that reads a file has a port for it: [`Port::many_files`](super::Port::many_files).
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ExportedFiles {
    /// The kind of the stage.
    pub kind: String,
    /// The parameters of the stage with defaults filled in, as canonical JSON:
    /// [`Parameters::from_canonical`](crate::Parameters::from_canonical) reads them.
    pub parameters: serde_json::Value,
    /// The bytes of each file, in the order of [`Product::Files`](super::Product::Files); 0 for one that the
    /// item leaves out.
    pub bytes: Vec<u64>,
}

impl ExportedFiles {
    /// The bytes of all files together.
    pub fn total(&self) -> u64 {
        self.bytes.iter().sum()
    }
}

impl Artifact for ExportedFiles {
    const TYPE: &'static str = "files";

    /// JSON: `{"kind":"export-taps","parameters":{},"bytes":[1024,0]}`.
    fn encode(&self) -> Result<Vec<u8>, Failure> {
        serde_json::to_vec(self).map_err(|error| Failure::new(error.to_string()))
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        serde_json::from_slice(bytes).map_err(|error| Failure::new(format!("sizes of files: {error}")))
    }
}
