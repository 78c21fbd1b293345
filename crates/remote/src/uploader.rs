//! Storing results, on a thread of its own: blobs that the server lacks, then the results that name them.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, SyncSender};

use bazel_remote_apis::build::bazel::remote::execution::v2 as re;
use bazel_remote_apis::google::bytestream::WriteRequest;
use bazel_remote_apis::google::bytestream::byte_stream_client::ByteStreamClient;
use engine::{SharedBlob, Upload};
use re::action_cache_client::ActionCacheClient;
use tokio::task::JoinSet;
use tonic::Status;

use crate::blobs::{batches, storage};
use crate::connection::{Connection, LARGEST_MESSAGE, Server};
use crate::protocol::{ActionMessages, action, action_result, blob, digest, digest_of, sha256};

/// Outputs of at most about so many bytes are in memory at a time.
const GROUP: u64 = 32 << 20;

/// The most results of a group.
const MOST_IN_GROUP: usize = 256;

/// A message of a stream.
const PIECE: usize = 1 << 20;

/// What the thread is told.
pub(crate) enum Job {
    Upload(Upload),
    /// Answer when everything before is stored.
    Flush(SyncSender<()>),
}

/// Blobs and results that are stored together.
#[derive(Default)]
struct Group {
    blobs: HashMap<[u8; 32], (SharedBlob, Vec<u8>)>,
    bytes: u64,
    results: Vec<(re::Digest, re::ActionResult)>,
}

impl Group {
    fn add_blob(&mut self, bytes: Vec<u8>) -> SharedBlob {
        let blob = SharedBlob { hash: sha256(&bytes), bytes: bytes.len() as u64 };
        self.bytes += blob.bytes;
        self.blobs.insert(blob.hash.0, (blob, bytes));
        blob
    }

    /// Adds a result with everything that it needs, unless an output is gone.
    fn add(&mut self, upload: &Upload) {
        let mut outputs = Vec::with_capacity(upload.outputs);
        for index in 0..upload.outputs {
            let Some(bytes) = (upload.read)(index) else { return };
            outputs.push(self.add_blob(bytes));
        }
        let last = upload.entries.len().saturating_sub(1);
        for (index, (text, description)) in upload.entries.iter().enumerate() {
            let ActionMessages { action, others } = action(text);
            let name = digest_of(&action);
            others.into_iter().chain([action]).for_each(|bytes| _ = self.add_blob(bytes));
            let outputs = if index == last { &outputs[..] } else { &[] };
            self.results.push((name, action_result(description.clone(), outputs)));
        }
    }

    fn is_full(&self) -> bool {
        self.bytes >= GROUP || self.results.len() >= MOST_IN_GROUP
    }
}

/// Stores what arrives, until nobody can send any more.
pub(crate) fn run(connection: &Arc<Connection>, jobs: &Receiver<Job>) {
    let mut group = Group::default();
    loop {
        // What is there is stored when there is nothing to add at once.
        let job = match jobs.try_recv() {
            Ok(job) => job,
            Err(_) => {
                store(connection, std::mem::take(&mut group));
                match jobs.recv() {
                    Ok(job) => job,
                    Err(_) => return,
                }
            }
        };
        match job {
            Job::Upload(upload) if connection.may_store.load(Ordering::Relaxed) => {
                // Not before there is something to store: nobody should wait for a server in vain.
                if connection.server().is_some() && connection.may_store.load(Ordering::Relaxed) {
                    group.add(&upload);
                }
            }
            Job::Upload(_) => {}
            Job::Flush(done) => {
                store(connection, std::mem::take(&mut group));
                let _ = done.send(());
            }
        }
        if group.is_full() {
            store(connection, std::mem::take(&mut group));
        }
    }
}

fn store(connection: &Arc<Connection>, group: Group) {
    if group.results.is_empty() || !connection.may_store.load(Ordering::Relaxed) {
        return;
    }
    let Some(server) = connection.server() else { return };
    if let Err(status) = connection.runtime.block_on(send(connection, &server, group)) {
        connection.stop_storing(&status);
    }
}

async fn send(connection: &Arc<Connection>, server: &Server, group: Group) -> Result<(), Status> {
    let Group { mut blobs, results, .. } = group;
    let missing = missing(connection, server, blobs.values().map(|(blob, _)| *blob).collect()).await?;
    for batch in batches(&missing, server.batch) {
        let parts =
            batch.into_iter().filter_map(|index| blobs.remove(&missing[index].hash.0)).collect::<Vec<_>>();
        let bytes = parts.iter().map(|(blob, _)| blob.bytes).sum::<u64>();
        match &parts[..] {
            [(large, data)] if large.bytes > server.batch => write(connection, server, *large, data).await?,
            _ => update(connection, server, &parts).await?,
        }
        connection.sent.fetch_add(bytes, Ordering::Relaxed);
    }
    let mut tasks = JoinSet::new();
    for (name, result) in results {
        let (connection, server) = (Arc::clone(connection), server.clone());
        tasks.spawn(async move {
            let store = || async {
                let request = re::UpdateActionResultRequest {
                    instance_name: connection.options.instance.clone(),
                    action_digest: Some(name.clone()),
                    action_result: Some(result.clone()),
                    digest_function: re::digest_function::Value::Sha256 as i32,
                    ..Default::default()
                };
                ActionCacheClient::new(server.channel.clone())
                    .max_encoding_message_size(LARGEST_MESSAGE)
                    .update_action_result(connection.request(request))
                    .await
            };
            connection.call(store).await.map(drop)
        });
    }
    while let Some(stored) = tasks.join_next().await {
        stored.unwrap_or_else(|_| Err(Status::internal("a task ended early")))?;
    }
    Ok(())
}

/// Those of the blobs that the server lacks.
async fn missing(
    connection: &Connection,
    server: &Server,
    blobs: Vec<SharedBlob>,
) -> Result<Vec<SharedBlob>, Status> {
    let ask = || async {
        let request = re::FindMissingBlobsRequest {
            instance_name: connection.options.instance.clone(),
            blob_digests: blobs.iter().map(|blob| digest(*blob)).collect(),
            digest_function: re::digest_function::Value::Sha256 as i32,
        };
        storage(&server.channel).find_missing_blobs(connection.request(request)).await
    };
    let answer = connection.call(ask).await?.into_inner();
    Ok(answer.missing_blob_digests.iter().filter_map(blob).collect())
}

async fn update(
    connection: &Connection,
    server: &Server,
    parts: &[(SharedBlob, Vec<u8>)],
) -> Result<(), Status> {
    let store = || async {
        let requests = parts.iter().map(|(blob, data)| re::batch_update_blobs_request::Request {
            digest: Some(digest(*blob)),
            data: data.clone(),
            ..Default::default()
        });
        let request = re::BatchUpdateBlobsRequest {
            instance_name: connection.options.instance.clone(),
            requests: requests.collect(),
            digest_function: re::digest_function::Value::Sha256 as i32,
        };
        storage(&server.channel).batch_update_blobs(connection.request(request)).await
    };
    let answer = connection.call(store).await?.into_inner();
    let refused = answer.responses.into_iter().filter_map(|one| one.status).find(|status| status.code != 0);
    match refused {
        Some(status) => Err(Status::new(status.code.into(), status.message)),
        None => Ok(()),
    }
}

/// Sends a large blob as a stream.
async fn write(
    connection: &Connection,
    server: &Server,
    large: SharedBlob,
    data: &[u8],
) -> Result<(), Status> {
    let re::Digest { hash, .. } = digest(large);
    let packed = server
        .has_zstd
        .then(|| ruzstd::encoding::compress_to_vec(data, ruzstd::encoding::CompressionLevel::Fastest));
    let (folder, data) = match &packed {
        Some(packed) => ("compressed-blobs/zstd", &packed[..]),
        None => ("blobs", data),
    };
    // A name for this attempt that no other has: of the blob, the process and its count of calls.
    let send = || async {
        let attempt = (std::process::id(), connection.calls.load(Ordering::Relaxed));
        let unique = digest_of(format!("{hash} {attempt:?}").as_bytes()).hash;
        let unique = format!(
            "{}-{}-4{}-8{}-{}",
            &unique[..8],
            &unique[8..12],
            &unique[12..15],
            &unique[15..18],
            &unique[18..30]
        );
        let name = connection.resource(&format!("uploads/{unique}/{folder}/{hash}/{}", large.bytes));
        let pieces = data.chunks(PIECE).enumerate().map(|(index, piece)| WriteRequest {
            resource_name: if index == 0 { name.clone() } else { String::new() },
            write_offset: (index * PIECE) as i64,
            finish_write: (index + 1) * PIECE >= data.len(),
            data: piece.to_vec(),
        });
        let pieces = tokio_stream::iter(pieces.collect::<Vec<_>>());
        let mut client =
            ByteStreamClient::new(server.channel.clone()).max_encoding_message_size(LARGEST_MESSAGE);
        client.write(connection.request(pieces)).await
    };
    connection.call(send).await.map(drop)
}
