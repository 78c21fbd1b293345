//! Actions, digests and requests of the Remote Execution API, version 2.

use std::fmt::Write as _;

use bazel_remote_apis::build::bazel::remote::execution::v2 as re;
use engine::{Digest, SharedBlob, SharedResult};
use prost::Message as _;
use sha2::{Digest as _, Sha256};

pub(crate) fn sha256(bytes: &[u8]) -> Digest {
    Digest(Sha256::digest(bytes).into())
}

/// The digest of bytes as messages have it.
pub(crate) fn digest_of(bytes: &[u8]) -> re::Digest {
    digest(SharedBlob { hash: sha256(bytes), bytes: bytes.len() as u64 })
}

pub(crate) fn digest(blob: SharedBlob) -> re::Digest {
    let mut hash = String::with_capacity(64);
    for byte in blob.hash.0 {
        let _ = write!(hash, "{byte:02x}");
    }
    re::Digest { hash, size_bytes: blob.bytes.try_into().unwrap_or(i64::MAX) }
}

/// The blob that a message names; `None` if it is not a SHA-256 with a size.
pub(crate) fn blob(digest: &re::Digest) -> Option<SharedBlob> {
    let text = digest.hash.as_bytes();
    let mut hash = [0; 32];
    if text.len() != 64 {
        return None;
    }
    for (byte, pair) in hash.iter_mut().zip(text.chunks_exact(2)) {
        *byte = u8::from_str_radix(str::from_utf8(pair).ok()?, 16).ok()?;
    }
    Some(SharedBlob { hash: Digest(hash), bytes: digest.size_bytes.try_into().ok()? })
}

/// The messages of an action of the engine: the Action and what it refers to.
pub(crate) struct ActionMessages {
    pub(crate) action: Vec<u8>,
    /// The command and the empty input root.
    pub(crate) others: [Vec<u8>; 2],
}

pub(crate) fn action(text: &[u8]) -> ActionMessages {
    let command = re::Command {
        arguments: vec!["specula".into(), "run-item".into(), String::from_utf8_lossy(text).into_owned()],
        ..Default::default()
    };
    let (command, root) = (command.encode_to_vec(), re::Directory::default().encode_to_vec());
    let action = re::Action {
        command_digest: Some(digest_of(&command)),
        input_root_digest: Some(digest_of(&root)),
        ..Default::default()
    };
    ActionMessages { action: action.encode_to_vec(), others: [command, root] }
}

/// The message that is stored for an action.
pub(crate) fn action_result(description: Vec<u8>, outputs: &[SharedBlob]) -> re::ActionResult {
    let file = |(index, blob): (usize, &SharedBlob)| re::OutputFile {
        path: index.to_string(),
        digest: Some(digest(*blob)),
        ..Default::default()
    };
    re::ActionResult {
        output_files: outputs.iter().enumerate().map(file).collect(),
        stdout_raw: description,
        ..Default::default()
    }
}

/// The outputs of what is stored; `None` if it is not what [`action_result`] makes.
pub(crate) fn outputs(result: &re::ActionResult) -> Option<Vec<SharedBlob>> {
    let mut outputs = vec![None; result.output_files.len()];
    for file in &result.output_files {
        let place = outputs.get_mut(file.path.parse::<usize>().ok()?)?;
        *place = Some(blob(file.digest.as_ref()?)?);
    }
    outputs.into_iter().collect()
}

pub(crate) fn shared_result(result: &re::ActionResult, description: Vec<u8>) -> Option<SharedResult> {
    Some(SharedResult { description, outputs: outputs(result)? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digests_return_and_others_are_refused() {
        let one = SharedBlob { hash: sha256(b"light"), bytes: 5 };
        assert_eq!(blob(&digest(one)), Some(one));
        assert_eq!(digest_of(b"").hash, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
        for (hash, size_bytes) in [("ab", 1), ("g".repeat(64).as_str(), 1), ("0".repeat(64).as_str(), -1)] {
            assert_eq!(blob(&re::Digest { hash: hash.into(), size_bytes }), None, "{hash} {size_bytes}");
        }
    }

    #[test]
    fn an_action_has_one_digest_and_another_text_another() {
        let digest = |text: &[u8]| digest_of(&action(text).action);
        assert_eq!(digest(b"{}"), digest(b"{}"));
        assert_ne!(digest(b"{}"), digest(b"{ }"));
    }

    #[test]
    fn results_return_and_those_with_other_files_are_refused() {
        let blobs =
            [SharedBlob { hash: sha256(b"a"), bytes: 1 }, SharedBlob { hash: sha256(b"bc"), bytes: 2 }];
        let mut result = action_result(b"{}".to_vec(), &blobs);
        result.output_files.reverse();
        assert_eq!(outputs(&result).unwrap(), blobs);
        for path in ["2", "0", "-1", "../0", ""] {
            result.output_files[0].path = path.into();
            assert_eq!(outputs(&result), None, "{path:?}");
        }
    }
}
