//! Storing results, on a thread of its own: blobs that the server lacks, then the results that name them.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, SyncSender};

use bazel_remote_apis::build::bazel::remote::execution::v2 as re;
use engine::{SharedBlob, SharedResult, Upload, UploadOutputs};
use re::action_cache_client::ActionCacheClient;
use tokio::task::JoinSet;
use tonic::Status;

use crate::connection::{Connection, LARGEST_MESSAGE, Server};
use crate::lists::{Lists, Part};
use crate::protocol::{ActionMessages, action, action_result, digest_of, sha256};
use crate::sending::send_missing;

/// Outputs of at most about so many bytes are in memory at a time.
const GROUP: u64 = 32 << 20;

/// The most results of a group.
const MOST_IN_GROUP: usize = 256;

/// A job for the thread that uploads.
pub(crate) enum Job {
    Upload(Upload),
    List(Vec<u8>),
    /// Answer when everything before is stored.
    Flush(SyncSender<()>),
}

/// Blobs and results that are stored together.
#[derive(Default)]
struct Group {
    blobs: HashMap<[u8; 32], (SharedBlob, Vec<u8>)>,
    bytes: u64,
    results: Vec<(re::Digest, re::ActionResult)>,
    /// The results with their lists, items and actions.
    listed: Vec<(Vec<u8>, String, Vec<u8>, SharedResult)>,
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
        let outputs = match &upload.outputs {
            UploadOutputs::There(blobs) => blobs.clone(),
            UploadOutputs::Here { count, read } => {
                let mut outputs = Vec::with_capacity(*count);
                for index in 0..*count {
                    let Some(bytes) = read(index) else { return };
                    outputs.push(self.add_blob(bytes));
                }
                outputs
            }
        };
        let last = upload.entries.len().saturating_sub(1);
        for (index, (text, description)) in upload.entries.iter().enumerate() {
            let outputs = if index == last { &outputs[..] } else { &[] };
            self.add_result(text, description.clone(), outputs);
            let result = SharedResult { description: description.clone(), outputs: outputs.to_vec() };
            self.listed.push((upload.list.clone(), upload.item.clone(), text.clone(), result));
        }
    }

    fn add_result(&mut self, text: &[u8], description: Vec<u8>, outputs: &[SharedBlob]) {
        let ActionMessages { action, others } = action(text);
        let name = digest_of(&action);
        others.into_iter().chain([action]).for_each(|bytes| _ = self.add_blob(bytes));
        self.results.push((name, action_result(description, outputs)));
    }

    fn is_full(&self) -> bool {
        self.bytes >= GROUP || self.results.len() >= MOST_IN_GROUP
    }
}

/// Stores what arrives, until nobody can send any more.
pub(crate) fn run(connection: &Arc<Connection>, lists: &Lists, jobs: &Receiver<Job>) {
    let mut group = Group::default();
    loop {
        // What is there is stored when there is nothing to add at once.
        let job = match jobs.try_recv() {
            Ok(job) => job,
            Err(_) => {
                store(connection, lists, std::mem::take(&mut group));
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
            Job::List(list) => {
                store(connection, lists, std::mem::take(&mut group));
                lists.parts(&list, &mut |Part { name, text, outputs }| {
                    let mut part = Group::default();
                    part.add_result(&name, text, &outputs);
                    store(connection, lists, part);
                });
            }
            Job::Flush(done) => {
                store(connection, lists, std::mem::take(&mut group));
                let _ = done.send(());
            }
        }
        if group.is_full() {
            store(connection, lists, std::mem::take(&mut group));
        }
    }
}

fn store(connection: &Arc<Connection>, lists: &Lists, mut group: Group) {
    if group.results.is_empty() || !connection.may_store.load(Ordering::Relaxed) {
        return;
    }
    let Some(server) = connection.server() else { return };
    let listed = std::mem::take(&mut group.listed);
    match connection.runtime.block_on(send(connection, &server, group)) {
        Ok(()) => {
            listed.into_iter().for_each(|(list, item, action, result)| {
                lists.add(&list, &item, &action, result);
            });
        }
        Err(status) => connection.stop_storing(&status),
    }
}

async fn send(connection: &Arc<Connection>, server: &Server, group: Group) -> Result<(), Status> {
    let Group { mut blobs, results, .. } = group;
    let all = blobs.values().map(|(blob, _)| *blob).collect();
    let mut take = |blob: SharedBlob| blobs.remove(&blob.hash.0).map(|(_, bytes)| bytes);
    send_missing(connection, server, all, &mut take).await?;
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
