//! The cache as the engine sees it.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel, sync_channel};
use std::time::Duration;

use bazel_remote_apis::build::bazel::remote::execution::v2 as re;
use engine::{Question, SharedBlob, SharedCache, SharedResult, Traffic, Trouble, Upload};
use parking_lot::Mutex;
use re::action_cache_client::ActionCacheClient;
use tokio::sync::Semaphore;
use tokio::task::JoinSet;
use tonic::Code;

use crate::blobs::{batches, receive};
use crate::connection::{Connection, ConnectionError, LARGEST_MESSAGE, Purpose, Server, said};
use crate::lists::{Lists, part_count, part_name};
use crate::options::RemoteOptions;
use crate::protocol::{action, blob, digest_of, shared_result};
use crate::uploader::{self, Job};

/// Questions that are asked at a time.
const QUESTIONS: usize = 256;

/// Calls for blobs that are made at a time.
const BLOB_CALLS: usize = 8;

/// How often a wait looks whether it should stop.
pub(crate) const STOP_INTERVAL: Duration = Duration::from_millis(50);

/// A cache on a server.
#[derive(Debug)]
pub struct RemoteCache {
    pub(crate) connection: Arc<Connection>,
    lists: Arc<Lists>,
    /// To the thread that stores results, which the first result starts.
    jobs: Mutex<Option<Sender<Job>>>,
}

impl RemoteCache {
    /// A cache with these options. It is connected at its first use.
    ///
    /// # Errors
    /// If the options cannot be those of a connection.
    pub fn new(options: RemoteOptions) -> Result<Self, ConnectionError> {
        let connection = Arc::new(Connection::new(options, Purpose::Cache)?);
        Ok(Self { connection, lists: Arc::default(), jobs: Mutex::default() })
    }

    /// Finds the result that is stored under each action, with a call for each.
    fn find_each(&self, server: &Server, actions: &[Vec<u8>]) -> Vec<Option<SharedResult>> {
        let mut found = vec![None; actions.len()];
        self.connection.runtime.block_on(async {
            let limit = Arc::new(Semaphore::new(QUESTIONS));
            let mut tasks = JoinSet::new();
            for (index, text) in actions.iter().enumerate() {
                let Ok(permit) = Arc::clone(&limit).acquire_owned().await else { break };
                if self.connection.is_broken() {
                    break;
                }
                let (connection, server) = (Arc::clone(&self.connection), server.clone());
                let action = action(text).action;
                tasks.spawn(async move {
                    let _permit = permit;
                    (index, find(&connection, &server, &action).await)
                });
            }
            while let Some(Ok((index, result))) = tasks.join_next().await {
                found[index] = result;
            }
        });
        found
    }

    fn load(&self, server: &Server, list: &[u8]) {
        let first = self.find_each(server, &[part_name(list, 0)]).pop().flatten();
        let count = first.as_ref().map_or(0, part_count);
        let names = (1..count).map(|part| part_name(list, part)).collect::<Vec<_>>();
        let others = self.find_each(server, &names);
        self.lists.loaded(list, first.into_iter().chain(others.into_iter().flatten()).collect());
    }

    fn send(&self, job: Job) -> bool {
        let mut jobs = self.jobs.lock();
        let sender = jobs.get_or_insert_with(|| {
            let (sender, receiver) = channel();
            let (connection, lists) = (Arc::clone(&self.connection), Arc::clone(&self.lists));
            // If no thread starts, its receiver is gone, and so is what is sent.
            let _ = std::thread::Builder::new()
                .name("specula upload".into())
                .spawn(move || uploader::run(&connection, &lists, &receiver));
            sender
        });
        sender.send(job).is_ok()
    }
}

impl SharedCache for RemoteCache {
    fn host(&self) -> String {
        self.connection.options.address.host().to_owned()
    }

    fn find(&self, list: &[u8], questions: &[Question]) -> Vec<Option<SharedResult>> {
        let Some(server) = self.connection.server() else { return vec![None; questions.len()] };
        if self.lists.is_worth_loading(list, questions.len()) {
            self.load(&server, list);
        }
        let listed = |one: &Question| self.lists.find(list, &one.item, &one.action);
        let mut found = questions.iter().map(listed).collect::<Vec<_>>();
        let open = (0..questions.len()).filter(|index| found[*index].is_none()).collect::<Vec<_>>();
        let actions = open.iter().map(|index| questions[*index].action.clone()).collect::<Vec<_>>();
        for (index, result) in open.into_iter().zip(self.find_each(&server, &actions)) {
            let Question { item, action } = &questions[index];
            if let Some(result) = &result {
                self.lists.add(list, item, action, result.clone());
            }
            found[index] = result;
        }
        found
    }

    fn read(&self, blobs: &[SharedBlob], each: &mut dyn FnMut(usize, Option<Vec<u8>>) -> bool) {
        let Some(server) = self.connection.server().filter(|_| !blobs.is_empty()) else { return };
        let (sender, mut receiver) = tokio::sync::mpsc::channel(BLOB_CALLS);
        let batches = batches(blobs, server.batch).into_iter();
        let batches = batches.map(|batch| batch.into_iter().map(|index| (index, blobs[index])).collect());
        let batches = batches.collect::<Vec<Vec<_>>>();
        let (connection, server) = (Arc::clone(&self.connection), server.clone());
        self.connection.runtime.spawn(async move {
            let limit = Arc::new(Semaphore::new(BLOB_CALLS));
            for wanted in batches {
                let Ok(permit) = Arc::clone(&limit).acquire_owned().await else { return };
                if connection.is_broken() || sender.is_closed() {
                    return;
                }
                let (connection, server, sender) = (Arc::clone(&connection), server.clone(), sender.clone());
                tokio::spawn(async move {
                    receive(&connection, &server, &wanted, &sender).await;
                    drop(permit);
                });
            }
        });
        while let Some((index, bytes)) = receiver.blocking_recv() {
            if !each(index, bytes) {
                return;
            }
        }
    }

    fn store(&self, upload: Upload) {
        if !self.connection.may_store.load(Ordering::Relaxed) || self.connection.is_broken() {
            return;
        }
        self.send(Job::Upload(upload));
    }

    fn finish(&self, stop: &dyn Fn() -> bool) -> Traffic {
        let may_store =
            || self.connection.may_store.load(Ordering::Relaxed) && !self.connection.is_broken() && !stop();
        let flush = || {
            let (done, stored) = sync_channel(1);
            let is_sent = self.jobs.lock().is_some() && self.send(Job::Flush(done));
            while is_sent && !stop() && stored.recv_timeout(STOP_INTERVAL) == Err(RecvTimeoutError::Timeout) {
            }
        };
        flush();
        for (list, is_loaded) in self.lists.changed() {
            if !may_store() {
                break;
            }
            if let (false, Some(server)) = (is_loaded, self.connection.server()) {
                self.load(&server, &list);
            }
            self.send(Job::List(list));
        }
        flush();
        let Connection { calls, received, sent, .. } = &*self.connection;
        let [calls, received, sent] = [calls, received, sent].map(|count| count.swap(0, Ordering::Relaxed));
        Traffic { calls, received, sent }
    }

    fn trouble(&self) -> Option<Trouble> {
        self.connection.take_trouble()
    }
}

/// Finds the result that is stored under an action.
async fn find(connection: &Connection, server: &Server, action: &[u8]) -> Option<SharedResult> {
    let ask = || async {
        let request = re::GetActionResultRequest {
            instance_name: connection.options.instance.clone(),
            action_digest: Some(digest_of(action)),
            inline_stdout: true,
            digest_function: re::digest_function::Value::Sha256 as i32,
            ..Default::default()
        };
        ActionCacheClient::new(server.channel.clone())
            .max_decoding_message_size(LARGEST_MESSAGE)
            .get_action_result(connection.request(request))
            .await
    };
    let result = match connection.call(ask).await {
        Ok(result) => result.into_inner(),
        Err(status) if status.code() == Code::NotFound => return None,
        Err(status) => {
            let address = &connection.options.address;
            connection.give_up(format!("{address} does not find results: {}", said(&status)));
            return None;
        }
    };
    let description = match &result.stdout_digest {
        Some(named) if result.stdout_raw.is_empty() => description(connection, server, named).await?,
        _ => result.stdout_raw.clone(),
    };
    let found = shared_result(&result, description);
    if found.is_none() {
        let address = &connection.options.address;
        connection.say(format!("{address} has a result that does not fit its action; its item is made here"));
    }
    found
}

/// A description that the server did not send with its result.
async fn description(connection: &Connection, server: &Server, named: &re::Digest) -> Option<Vec<u8>> {
    let named = blob(named).filter(|blob| blob.bytes <= server.batch)?;
    let (sender, mut receiver) = tokio::sync::mpsc::channel(1);
    receive(connection, server, &[(0, named)], &sender).await;
    receiver.recv().await?.1
}
