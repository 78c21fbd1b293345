//! Running items on the workers of a server.
//!
//! The input root has the files that the engine names and, unless the workers have it already, the program.
//! An execution that breaks off (a worker or the connection is lost, blobs were evicted meanwhile, the queue
//! is full) is tried again a few times; one that is not wanted any more is cancelled on the server.

use std::collections::{BTreeMap, HashMap};
use std::error::Error as _;
use std::path::PathBuf;
use std::pin::Pin;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bazel_remote_apis::build::bazel::remote::execution::v2 as re;
use bazel_remote_apis::google::longrunning::operations_client::OperationsClient;
use bazel_remote_apis::google::longrunning::{CancelOperationRequest, Operation, operation};
use engine::{Executor, InputFile, RemoteEnd, RemoteError, RemoteRun, SharedBlob, path_text};
use parking_lot::Mutex;
use prost::Message as _;
use re::execution_client::ExecutionClient;
use tonic::{Code, Status, Streaming};

use crate::blobs::receive;
use crate::cache::{RemoteCache, STOP_INTERVAL};
use crate::connection::{
    Connection, ConnectionError, LARGEST_MESSAGE, PAUSE, PING, Purpose, RETRIES, Server, is_passing, said,
};
use crate::options::RemoteOptions;
use crate::protocol::{blob, digest, sha256};
use crate::sending::send_missing;

/// The program's name in an input root.
const PROGRAM: &str = "specula";

/// The PATH in which programs of workers are looked for.
const PATH: &str = "/usr/local/bin:/usr/bin:/bin";

/// How long the end of a cancelled execution is waited for.
const CANCELLING: Duration = Duration::from_secs(5);

/// How long the end of a stream is waited for, after its last message.
const ENDING: Duration = Duration::from_secs(1);

/// The most of a program's messages that is received.
const MOST_SAID: u64 = 64 << 10;

/// The program that workers run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Program {
    /// The program is in this file, which is sent.
    Sent(PathBuf),
    /// A file that workers have at this path, such as that of a container's image.
    There(String),
}

/// Workers of a server.
#[derive(Debug)]
pub struct RemoteExecutor {
    /// The connection over which blobs are sent.
    cache: Arc<Connection>,
    connection: Connection,
    program: Program,
    /// The program on the server, once it was read.
    sent: Mutex<Option<SharedBlob>>,
    properties: Vec<(String, String)>,
}

/// The messages and files that are sent for one run.
struct Messages {
    action: SharedBlob,
    /// The messages, and the files by index.
    messages: HashMap<[u8; 32], Vec<u8>>,
    files: HashMap<[u8; 32], usize>,
    all: Vec<SharedBlob>,
}

/// Why an attempt ended without a result.
enum Broken {
    Stopped,
    Gone(usize),
    /// The attempt failed, and may succeed a little later.
    Passing(Status),
    /// The attempt failed, and will not succeed later.
    Final(Status),
}

impl RemoteExecutor {
    /// The workers of a server that takes its inputs from this cache; `properties` are what each worker must
    /// have.
    ///
    /// # Errors
    /// If the options cannot be those of a connection.
    pub fn new(
        cache: &RemoteCache,
        options: RemoteOptions,
        program: Program,
        properties: Vec<(String, String)>,
    ) -> Result<Self, ConnectionError> {
        let connection = Connection::new(options, Purpose::Execution)?;
        let cache = Arc::clone(&cache.connection);
        Ok(Self { cache, connection, program, sent: Mutex::default(), properties })
    }

    /// The program on the server.
    fn program(&self) -> Result<Option<SharedBlob>, RemoteError> {
        let Program::Sent(file) = &self.program else { return Ok(None) };
        let mut sent = self.sent.lock();
        if sent.is_none() {
            let bytes = std::fs::read(file).map_err(|error| {
                RemoteError::Impossible(format!("cannot read the program {}: {error}", path_text(file)))
            })?;
            *sent = Some(self.blob(&bytes));
        }
        Ok(*sent)
    }

    fn messages(&self, run: &RemoteRun<'_>) -> Result<Messages, RemoteError> {
        let mut files = run.files.clone();
        let program = match (&self.program, self.program()?) {
            (Program::There(path), _) => path.clone(),
            (_, blob) => {
                let inputs = blob.map(|blob| InputFile { path: PROGRAM.into(), blob, is_program: true });
                files.extend(inputs);
                format!("./{PROGRAM}")
            }
        };
        let mut messages = HashMap::new();
        let mut add = |bytes: Vec<u8>| {
            let blob = self.blob(&bytes);
            messages.insert(blob.hash.0, bytes);
            blob
        };
        let paths = files.iter().map(|file| (file.path.as_str(), file)).collect::<Vec<_>>();
        let root = directory(&paths, &mut add);
        let mut properties = self.properties.iter().cloned().collect::<BTreeMap<_, _>>();
        properties.extend(run.properties.iter().cloned());
        let property = |(name, value)| re::platform::Property { name, value };
        let platform = re::Platform { properties: properties.into_iter().map(property).collect() };
        let variable = re::command::EnvironmentVariable { name: "PATH".into(), value: PATH.into() };
        let mut outputs = run.outputs.clone();
        outputs.sort_unstable();
        #[allow(deprecated, reason = "older servers look for the platform in the command")]
        let command = re::Command {
            arguments: [program].into_iter().chain(run.arguments.iter().cloned()).collect(),
            environment_variables: vec![variable],
            output_paths: outputs.clone(),
            output_files: outputs,
            platform: Some(platform.clone()),
            ..Default::default()
        };
        let command = add(command.encode_to_vec());
        let action = re::Action {
            command_digest: Some(digest(command)),
            input_root_digest: Some(digest(root)),
            platform: Some(platform),
            ..Default::default()
        };
        let action = add(action.encode_to_vec());
        let of_files = run.files.iter().enumerate().map(|(index, file)| (file.blob.hash.0, index));
        let files_by_hash = of_files.collect();
        let of_messages = messages
            .iter()
            .map(|(hash, bytes)| SharedBlob { hash: engine::Digest(*hash), bytes: bytes.len() as u64 });
        let mut all = files.iter().map(|file| file.blob).chain(of_messages).collect::<Vec<_>>();
        all.sort_unstable_by_key(|blob| blob.hash);
        all.dedup();
        Ok(Messages { action, messages, files: files_by_hash, all })
    }

    /// Sends the blobs that the server lacks.
    async fn send(&self, server: &Server, sent: &Messages, run: &RemoteRun<'_>) -> Result<(), Broken> {
        let mut gone = None;
        let mut take = |blob: SharedBlob| {
            let hash = &blob.hash.0;
            if let Some(bytes) = sent.messages.get(hash) {
                return Some(bytes.clone());
            }
            // Reading blocks, and may even ask the server.
            let bytes = tokio::task::block_in_place(|| match (sent.files.get(hash), &self.program) {
                (Some(index), _) => (run.read)(*index),
                (None, Program::Sent(file)) => std::fs::read(file).ok(),
                (None, Program::There(_)) => None,
            });
            let bytes = bytes.filter(|bytes| sha256(bytes) == blob.hash);
            if bytes.is_none() {
                gone = Some(sent.files.get(hash).copied().unwrap_or(usize::MAX));
            }
            bytes
        };
        let done = send_missing(&self.cache, server, sent.all.clone(), &mut take).await;
        match (gone, done) {
            (Some(index), _) => Err(Broken::Gone(index)),
            (None, Err(status)) if is_passing(&status) => Err(Broken::Passing(status)),
            (None, done) => done.map_err(Broken::Final),
        }
    }

    /// Runs the action to its end, or until `stopped` returns.
    async fn execute(
        &self,
        server: &Server,
        sent: &Messages,
        is_fresh: bool,
        name: &mut String,
        mut stopped: Pin<&mut impl Future<Output = ()>>,
    ) -> Result<re::ExecuteResponse, Broken> {
        let client =
            || ExecutionClient::new(server.channel.clone()).max_decoding_message_size(LARGEST_MESSAGE);
        let begin = async {
            if !name.is_empty() {
                // The connection broke off; the action may still run.
                let request = re::WaitExecutionRequest { name: std::mem::take(name) };
                if let Ok(stream) = client().wait_execution(self.connection.request(request)).await {
                    return Ok(stream);
                }
            }
            let request = re::ExecuteRequest {
                instance_name: self.connection.options.instance.clone(),
                skip_cache_lookup: is_fresh,
                action_digest: Some(digest(sent.action)),
                digest_function: re::digest_function::Value::Sha256 as i32,
                ..Default::default()
            };
            client().execute(self.connection.request(request)).await
        };
        let mut stream = tokio::select! {
            stream = begin => stream.map_err(broken)?.into_inner(),
            () = &mut stopped => return Err(Broken::Stopped),
        };
        let end = tokio::select! {
            end = end_of(&mut stream, name) => end,
            () = &mut stopped => {
                self.cancel(server, name).await;
                let _ = tokio::time::timeout(CANCELLING, end_of(&mut stream, &mut String::new())).await;
                return Err(Broken::Stopped);
            }
        };
        let response = end?;
        match &response.status {
            Some(status) if status.code != 0 => {
                Err(broken(Status::new(status.code.into(), status.message.clone())))
            }
            _ => Ok(response),
        }
    }

    async fn cancel(&self, server: &Server, name: &str) {
        let request = self.connection.request(CancelOperationRequest { name: name.to_owned() });
        let mut client = OperationsClient::new(server.channel.clone());
        // A server that cannot do this runs the action to its end, for nobody.
        let _ = tokio::time::timeout(CANCELLING, client.cancel_operation(request)).await;
    }

    /// The files and messages that an execution left.
    async fn end(&self, cache: &Server, run: &RemoteRun<'_>, response: re::ExecuteResponse) -> RemoteEnd {
        let result = response.result.unwrap_or_default();
        let files = result
            .output_files
            .iter()
            .filter_map(|file| Some((file.path.as_str(), file.digest.as_ref().and_then(blob)?)));
        let files = files.collect::<HashMap<_, _>>();
        let message = match &result.stderr_digest {
            _ if !result.stderr_raw.is_empty() => result.stderr_raw.clone(),
            Some(named) => self.said_by_program(cache, named).await.unwrap_or_default(),
            None => Vec::new(),
        };
        RemoteEnd {
            outputs: run.outputs.iter().map(|path| files.get(path.as_str()).copied()).collect(),
            exit_code: result.exit_code,
            message: String::from_utf8_lossy(&message).into_owned(),
            worker: result.execution_metadata.map_or_else(String::new, |about| about.worker),
            is_known: response.cached_result,
        }
    }

    async fn said_by_program(&self, cache: &Server, named: &re::Digest) -> Option<Vec<u8>> {
        let named = blob(named).filter(|blob| (1..=MOST_SAID).contains(&blob.bytes))?;
        let (sender, mut receiver) = tokio::sync::mpsc::channel(1);
        receive(&self.cache, cache, &[(0, named)], &sender).await;
        receiver.recv().await?.1
    }
}

impl Executor for RemoteExecutor {
    fn host(&self) -> String {
        self.connection.options.address.host().to_owned()
    }

    fn is_available(&self) -> bool {
        self.cache.server().is_some() && self.connection.server().is_some()
    }

    fn trouble(&self) -> Option<String> {
        self.connection.take_trouble().map(|trouble| trouble.message)
    }

    fn blob(&self, bytes: &[u8]) -> SharedBlob {
        SharedBlob { hash: sha256(bytes), bytes: bytes.len() as u64 }
    }

    fn run(&self, run: &RemoteRun<'_>, stop: &dyn Fn() -> bool) -> Result<RemoteEnd, RemoteError> {
        let address = &self.connection.options.address;
        let sent = self.messages(run)?;
        let mut name = String::new();
        let mut pause = PAUSE;
        let mut left = RETRIES;
        loop {
            let begun = Instant::now();
            let (Some(server), Some(cache)) = (self.connection.server(), self.cache.server()) else {
                return Err(RemoteError::Impossible(format!("{address} cannot be used")));
            };
            let stopped = async {
                while !stop() {
                    tokio::time::sleep(STOP_INTERVAL).await;
                }
            };
            let done = self.connection.runtime.block_on(async {
                tokio::pin!(stopped);
                tokio::select! {
                    done = self.send(&cache, &sent, run) => done?,
                    () = &mut stopped => return Err(Broken::Stopped),
                }
                let response = self.execute(&server, &sent, run.is_fresh, &mut name, stopped).await?;
                Ok(self.end(&cache, run, response).await)
            });
            match done {
                Ok(end) => return Ok(end),
                Err(Broken::Stopped) => return Err(RemoteError::Stopped),
                Err(Broken::Gone(index)) => return Err(RemoteError::InputGone(index)),
                Err(Broken::Passing(_)) if left > 0 && !stop() => {
                    // What took long until it was lost is tried once more, not three times.
                    left = if begun.elapsed() < PING { left - 1 } else { 0 };
                    std::thread::sleep(pause);
                    pause *= 4;
                }
                Err(Broken::Passing(status)) => {
                    let message = format!("{address} does not run items: {}", said(&status));
                    // If the server says how it ended, that is the end of this item alone.
                    if status.code() == Code::Unavailable || status.source().is_some() {
                        self.connection.give_up(message.clone());
                    }
                    return Err(RemoteError::Impossible(message));
                }
                Err(Broken::Final(status)) => {
                    return Err(RemoteError::Impossible(format!("{address}: {}", said(&status))));
                }
            }
        }
    }
}

/// Whether an execution that ended so may succeed when it is sent again: what it lacks is sent again too.
fn broken(status: Status) -> Broken {
    match status.code() {
        Code::InvalidArgument
        | Code::PermissionDenied
        | Code::Unauthenticated
        | Code::Unimplemented
        | Code::DeadlineExceeded
        | Code::OutOfRange => Broken::Final(status),
        _ => Broken::Passing(status),
    }
}

/// The response at the end of an execution; its name is set when the server says it.
async fn end_of(stream: &mut Streaming<Operation>, name: &mut String) -> Result<re::ExecuteResponse, Broken> {
    loop {
        let message = stream.message().await.map_err(broken)?;
        let Some(message) = message else {
            return Err(Broken::Passing(Status::unavailable("the server did not report the end of the run")));
        };
        if !message.name.is_empty() {
            *name = message.name;
        }
        match message.result {
            Some(operation::Result::Response(any)) if message.done => {
                name.clear();
                // Its end is read too. What arrives on a stream that nobody has any more counts as an error
                // of the connection, and after a thousand of them h2 closes it with all that still run.
                let _ = tokio::time::timeout(ENDING, stream.message()).await;
                return re::ExecuteResponse::decode(&any.value[..]).map_err(|error| {
                    Broken::Final(Status::internal(format!("it answers with something else: {error}")))
                });
            }
            Some(operation::Result::Error(status)) if message.done => {
                name.clear();
                return Err(broken(Status::new(status.code.into(), status.message)));
            }
            _ if message.done => {
                return Err(Broken::Passing(Status::unavailable("it ended without a result")));
            }
            _ => {}
        }
    }
}

/// The message of a folder with these files, their paths relative to it; `add` takes the messages of it and
/// of the folders in it.
fn directory(files: &[(&str, &InputFile)], add: &mut dyn FnMut(Vec<u8>) -> SharedBlob) -> SharedBlob {
    let mut here = BTreeMap::new();
    let mut below = BTreeMap::<&str, Vec<(&str, &InputFile)>>::new();
    for (path, file) in files {
        match path.split_once('/') {
            Some((folder, rest)) => below.entry(folder).or_default().push((rest, file)),
            None => _ = here.insert(*path, *file),
        }
    }
    let files = here.into_iter().map(|(name, file)| re::FileNode {
        name: name.into(),
        digest: Some(digest(file.blob)),
        is_executable: file.is_program,
        ..Default::default()
    });
    let files = files.collect();
    let directories = below.into_iter().map(|(name, files)| re::DirectoryNode {
        name: name.into(),
        digest: Some(digest(directory(&files, add))),
    });
    let directories = directories.collect();
    add(re::Directory { files, directories, ..Default::default() }.encode_to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::digest_of;

    #[test]
    fn folders_are_sorted_and_the_same_in_any_order() {
        let file = |path: &str| InputFile {
            path: path.into(),
            blob: SharedBlob { hash: sha256(path.as_bytes()), bytes: 1 },
            is_program: path == "specula",
        };
        let mut files = ["specula", "item.json", "files/b/x.exr", "files/a.exr", "files/b/a.exr"].map(file);
        let of = |files: &[InputFile]| {
            let mut messages = HashMap::new();
            let paths = files.iter().map(|file| (file.path.as_str(), file)).collect::<Vec<_>>();
            let root = directory(&paths, &mut |bytes| {
                let blob = SharedBlob { hash: sha256(&bytes), bytes: bytes.len() as u64 };
                messages.insert(blob.hash.0, bytes);
                blob
            });
            (root, messages)
        };
        let (root, messages) = of(&files);
        assert_eq!(messages.len(), 3);
        let decoded = re::Directory::decode(&messages[&root.hash.0][..]).unwrap();
        let names = decoded.files.iter().map(|file| (file.name.as_str(), file.is_executable));
        assert_eq!(names.collect::<Vec<_>>(), [("item.json", false), ("specula", true)]);
        assert_eq!(decoded.directories[0].name, "files");
        let inner = decoded.directories[0].digest.clone().unwrap();
        assert_eq!(inner, digest_of(&messages[&blob(&inner).unwrap().hash.0]));
        files.reverse();
        assert_eq!(of(&files).0, root);
    }
}
