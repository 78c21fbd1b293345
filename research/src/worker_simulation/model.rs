//! What the server knows, and what its workers make.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bazel_remote_apis::build::bazel::remote::execution::v2 as re;
use engine::serde_json::{Value, json};
use engine::{Digest, serde_json};
use prost::Message;
use sha2::{Digest as _, Sha256};
use tonic::Status;

use super::measured::Measured;

/// The bytes of a blob. An output is made when it is read, so that the memory has room for all.
#[derive(Clone)]
pub(crate) enum Blob {
    Bytes(Vec<u8>),
    Made { seed: u64, bytes: usize },
}

impl Blob {
    pub(crate) fn read(&self) -> Vec<u8> {
        match self {
            Self::Bytes(bytes) => bytes.clone(),
            Self::Made { seed, bytes } => made(*seed, *bytes),
        }
    }
}

/// Bytes that nobody can compress, and that depend on the seed.
fn made(seed: u64, bytes: usize) -> Vec<u8> {
    let mut state = seed | 1;
    let mut all = Vec::with_capacity(bytes + 8);
    while all.len() < bytes {
        // Marsaglia's xorshift64.
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        all.extend_from_slice(&state.to_le_bytes());
    }
    all.truncate(bytes);
    all
}

/// The name of bytes.
pub(crate) fn digest_of(bytes: &[u8]) -> re::Digest {
    let hash = Digest(Sha256::digest(bytes).into()).to_string();
    re::Digest { hash, size_bytes: bytes.len() as i64 }
}

/// The binary form of a name's hash.
pub(crate) fn key(digest: &re::Digest) -> Result<[u8; 32], Status> {
    let wrong = || Status::invalid_argument(format!("{:?} is no SHA-256", digest.hash));
    let mut hash = [0; 32];
    if digest.hash.len() != 64 || !digest.hash.is_ascii() {
        return Err(wrong());
    }
    for (index, byte) in hash.iter_mut().enumerate() {
        let pair = &digest.hash[2 * index..2 * index + 2];
        *byte = u8::from_str_radix(pair, 16).map_err(|_| wrong())?;
    }
    Ok(hash)
}

/// How the workers are.
#[derive(Clone, Copy, Debug)]
pub struct Workers {
    /// How many there are.
    pub count: usize,
    /// An item takes its time in the sample, multiplied by this.
    pub times: f64,
    /// An output has its bytes in the sample, multiplied by this.
    pub share: f64,
}

/// What happened to actions.
#[derive(Debug, Default)]
pub(crate) struct Ran {
    pub(crate) actions: u64,
    pub(crate) busy: Duration,
    pub(crate) waited: Duration,
    pub(crate) longest_wait: Duration,
    /// When the first one arrived, and the last one ended.
    pub(crate) first: Option<Instant>,
    pub(crate) last: Option<Instant>,
    /// The actions that ended in each second.
    pub(crate) by_second: Vec<u32>,
}

/// The server's memory.
pub(crate) struct Model {
    pub(crate) workers: Workers,
    measured: Measured,
    blobs: Mutex<HashMap<[u8; 32], Blob>>,
    pub(crate) results: Mutex<HashMap<[u8; 32], re::ActionResult>>,
    pub(crate) ran: Mutex<Ran>,
    pub(crate) queue: AtomicUsize,
    pub(crate) longest_queue: AtomicUsize,
    /// The bytes that were sent although the server had them.
    pub(crate) sent_again: AtomicU64,
}

pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Model {
    pub(crate) fn new(workers: Workers, measured: Measured) -> Self {
        Self {
            workers,
            measured,
            blobs: Mutex::default(),
            results: Mutex::default(),
            ran: Mutex::default(),
            queue: AtomicUsize::new(0),
            longest_queue: AtomicUsize::new(0),
            sent_again: AtomicU64::new(0),
        }
    }

    pub(crate) fn has(&self, hash: &[u8; 32]) -> bool {
        locked(&self.blobs).contains_key(hash)
    }

    /// The digests, among these, of blobs that are not here.
    pub(crate) fn missing(&self, digests: Vec<re::Digest>) -> Result<Vec<re::Digest>, Status> {
        let keys = digests.iter().map(key).collect::<Result<Vec<_>, _>>()?;
        let blobs = locked(&self.blobs);
        let all = digests.into_iter().zip(keys);
        Ok(all.filter(|(_, key)| !blobs.contains_key(key)).map(|(digest, _)| digest).collect())
    }

    /// Stores bytes under their name.
    pub(crate) fn store(&self, digest: &re::Digest, bytes: Vec<u8>) -> Result<(), Status> {
        if digest_of(&bytes) != *digest {
            return Err(Status::invalid_argument("a blob has other bytes than its name says"));
        }
        let size = bytes.len() as u64;
        if locked(&self.blobs).insert(key(digest)?, Blob::Bytes(bytes)).is_some() {
            self.sent_again.fetch_add(size, Ordering::Relaxed);
        }
        Ok(())
    }

    pub(crate) fn read(&self, digest: &re::Digest) -> Result<Option<Vec<u8>>, Status> {
        let blob = locked(&self.blobs).get(&key(digest)?).cloned();
        Ok(blob.map(|blob| blob.read()))
    }

    fn message<M: Message + Default>(&self, digest: Option<&re::Digest>) -> Result<M, Status> {
        let gone = || Status::failed_precondition("a blob of the action is missing");
        let bytes = self.read(digest.ok_or_else(gone)?)?.ok_or_else(gone)?;
        M::decode(&bytes[..]).map_err(|error| Status::invalid_argument(error.to_string()))
    }

    /// Reads an action and what belongs to it: the item's request, and the number of its outputs.
    pub(crate) fn item(&self, action: &re::Digest) -> Result<(Vec<u8>, usize), Status> {
        let action = self.message::<re::Action>(Some(action))?;
        let command = self.message::<re::Command>(action.command_digest.as_ref())?;
        let root = self.message::<re::Directory>(action.input_root_digest.as_ref())?;
        self.check_tree(&root)?;
        let item = root.files.iter().find(|file| file.name == "item.json");
        let item = item.and_then(|file| file.digest.as_ref());
        let text = self.read(item.ok_or_else(|| Status::invalid_argument("there is no item.json"))?)?;
        let text = text.ok_or_else(|| Status::failed_precondition("item.json is missing"))?;
        Ok((text, command.output_paths.len()))
    }

    /// Whether all that a worker would fetch is there.
    fn check_tree(&self, folder: &re::Directory) -> Result<(), Status> {
        for digest in folder.files.iter().filter_map(|file| file.digest.as_ref()) {
            if !self.has(&key(digest)?) {
                return Err(Status::failed_precondition(format!("{} is missing", digest.hash)));
            }
        }
        for inner in &folder.directories {
            self.check_tree(&self.message::<re::Directory>(inner.digest.as_ref())?)?;
        }
        Ok(())
    }

    /// What an item leaves, and how long that takes.
    pub(crate) fn run(&self, text: &[u8], outputs: usize) -> Result<(re::ActionResult, Duration), Status> {
        let wrong = |what: &str| Status::invalid_argument(format!("item.json: {what}"));
        let request = serde_json::from_slice::<Value>(text).map_err(|error| wrong(&error.to_string()))?;
        let kind = request["kind"].as_str().ok_or_else(|| wrong("no kind"))?;
        let Digest(name) = Digest::of(text);
        let seed = u64::from_le_bytes(name[..8].try_into().unwrap_or_default());
        let item = self.measured.item(kind, &request["canonical"], seed >> 32);
        let item = item.ok_or_else(|| wrong(&format!("{kind} has parameters that were not measured")))?;
        if outputs != item.outputs.len() + 1 {
            return Err(wrong(&format!("{kind} makes {} outputs, not {}", item.outputs.len(), outputs - 1)));
        }
        let mut files = Vec::with_capacity(outputs);
        let mut described = Vec::with_capacity(outputs);
        let mut new = Vec::with_capacity(outputs);
        let mut add = |path: String, bytes: &[u8], blob: Blob| -> Result<(), Status> {
            let digest = digest_of(bytes);
            new.push((key(&digest)?, blob));
            files.push(re::OutputFile { path, digest: Some(digest), ..Default::default() });
            Ok(())
        };
        for (index, bytes) in item.outputs.iter().enumerate() {
            // At least so many that no two outputs are the same.
            let size = ((*bytes as f64 * self.workers.share) as usize).max(32);
            let seed = seed.wrapping_add((index as u64) << 33);
            let content = made(seed, size);
            described.push(json!({ "digest": Digest::of(&content).to_string(), "bytes": size }));
            add(format!("outputs/{index}"), &content, Blob::Made { seed, bytes: size })?;
        }
        let read = |file: &Value| json!({ "path": file["name"], "listing": false, "digest": file["digest"] });
        let reads = request["files"].as_array().into_iter().flatten().map(read).collect::<Vec<_>>();
        let milliseconds = item.milliseconds * self.workers.times;
        let report = json!({
            "end": { "made": described },
            "milliseconds": milliseconds,
            "warnings": [],
            "notes": [],
            "reads": reads,
        });
        let report = report.to_string().into_bytes();
        add("outputs/report.json".into(), &report, Blob::Bytes(report.clone()))?;
        locked(&self.blobs).extend(new);
        let result = re::ActionResult { output_files: files, ..Default::default() };
        Ok((result, Duration::from_secs_f64(milliseconds / 1e3)))
    }
}
