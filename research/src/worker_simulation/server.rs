//! A server of the Remote Execution API with everything in memory, whose workers only wait.

use std::collections::HashMap;
use std::io;
use std::pin::Pin;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use bazel_remote_apis::build::bazel::remote::execution::v2 as re;
use bazel_remote_apis::google::bytestream::byte_stream_server::ByteStreamServer;
use bazel_remote_apis::google::longrunning::Operation;
use bazel_remote_apis::google::longrunning::operations_server::OperationsServer;
use engine::serde_json::{Value, json};
use re::action_cache_server::ActionCacheServer;
use re::capabilities_server::CapabilitiesServer;
use re::content_addressable_storage_server::ContentAddressableStorageServer;
use re::execution_server::ExecutionServer;
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tokio_stream::Stream;
use tonic::Status;
use tonic::transport::Server;

use super::measured::Measured;
use super::metered::{Bytes, Metered};
use super::model::{Model, Ran, locked};
use super::process::processor_seconds;

mod execution;
mod storage;

pub use super::model::Workers;

/// An action that runs or waits.
struct Running {
    end: tokio::sync::watch::Receiver<Option<Operation>>,
    task: tokio::task::AbortHandle,
}

/// Messages of blobs are larger than gRPC's default limit of 4 MiB allows.
const LARGEST_MESSAGE: usize = 16 << 20;

/// A stream of answers.
type Answers<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

/// The calls that are counted.
const CALLS: [&str; 8] = [
    "GetActionResult",
    "UpdateActionResult",
    "FindMissingBlobs",
    "BatchUpdateBlobs",
    "BatchReadBlobs",
    "Execute",
    "Read",
    "Write",
];

/// The server as its services share it.
#[derive(Clone)]
struct Service {
    model: Arc<Model>,
    free: Arc<Semaphore>,
    running: Arc<Mutex<HashMap<String, Running>>>,
    calls: Arc<[AtomicU64; CALLS.len()]>,
    operations: Arc<AtomicU64>,
    delay: Duration,
}

impl Service {
    /// Counts a call, and lets it be on its way for a while: to the server and back.
    async fn call(&self, name: &str) {
        self.count(name);
        if !self.delay.is_zero() {
            tokio::time::sleep(self.delay).await;
        }
    }

    fn count(&self, name: &str) {
        if let Some(index) = CALLS.iter().position(|known| *known == name) {
            self.calls[index].fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// A running server.
pub struct ModelServer {
    service: Service,
    bytes: Arc<Bytes>,
    runtime: tokio::runtime::Runtime,
    port: u16,
    /// The processor time at the last report.
    used: Mutex<f64>,
}

/// The processor time since another that is replaced by that of now.
fn since(before: &Mutex<f64>) -> f64 {
    let now = processor_seconds();
    now - std::mem::replace(&mut *locked(before), now)
}

impl ModelServer {
    /// Starts a server on a free port of this machine. Each call takes `delay` longer.
    ///
    /// # Errors
    /// If there is no port, or no thread starts.
    pub fn start(workers: Workers, measured: Measured, delay: Duration) -> io::Result<Self> {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
        let service = Service {
            free: Arc::new(Semaphore::new(workers.count)),
            model: Arc::new(Model::new(workers, measured)),
            running: Arc::default(),
            calls: Arc::default(),
            operations: Arc::default(),
            delay,
        };
        let bytes = Arc::<Bytes>::default();
        let listener = runtime.block_on(TcpListener::bind("127.0.0.1:0"))?;
        let port = listener.local_addr()?.port();
        let (sender, receiver) = tokio::sync::mpsc::channel(4);
        let counted = Arc::clone(&bytes);
        runtime.spawn(async move {
            while let Ok((stream, _)) = listener.accept().await {
                let _ = stream.set_nodelay(true);
                let metered = Metered { stream, bytes: Arc::clone(&counted) };
                if sender.send(Ok::<_, io::Error>(metered)).await.is_err() {
                    break;
                }
            }
        });
        let storage = ContentAddressableStorageServer::new(service.clone())
            .max_decoding_message_size(LARGEST_MESSAGE)
            .max_encoding_message_size(LARGEST_MESSAGE);
        let results = ActionCacheServer::new(service.clone()).max_decoding_message_size(LARGEST_MESSAGE);
        let router = Server::builder()
            .initial_stream_window_size(Some(4 << 20))
            .initial_connection_window_size(Some(16 << 20))
            .add_service(storage)
            .add_service(results)
            .add_service(ByteStreamServer::new(service.clone()))
            .add_service(CapabilitiesServer::new(service.clone()))
            .add_service(ExecutionServer::new(service.clone()))
            .add_service(OperationsServer::new(service.clone()));
        let incoming = tokio_stream::wrappers::ReceiverStream::new(receiver);
        runtime.spawn(router.serve_with_incoming(incoming));
        Ok(Self { service, bytes, runtime, port, used: Mutex::new(processor_seconds()) })
    }

    /// Where it listens.
    pub fn address(&self) -> String {
        format!("grpc://127.0.0.1:{}", self.port)
    }

    /// What happened since the last call.
    pub fn report(&self) -> Value {
        let model = &self.service.model;
        let calls = CALLS.iter().zip(self.service.calls.iter());
        let calls = calls.map(|(name, count)| ((*name).to_owned(), count.swap(0, Ordering::Relaxed).into()));
        let Ran { actions, busy, waited, longest_wait, first, last, by_second } =
            std::mem::take(&mut *locked(&model.ran));
        let span =
            first.zip(last).map_or(0.0, |(first, last): (Instant, Instant)| (last - first).as_secs_f64());
        json!({
            "calls": calls.collect::<engine::serde_json::Map<_, _>>(),
            "bytes_received": self.bytes.received.swap(0, Ordering::Relaxed),
            "bytes_sent": self.bytes.sent.swap(0, Ordering::Relaxed),
            "bytes_sent_again": model.sent_again.swap(0, Ordering::Relaxed),
            "actions": actions,
            "busy_seconds": busy.as_secs_f64(),
            "span_seconds": span,
            "mean_wait_seconds": waited.as_secs_f64() / actions.max(1) as f64,
            "longest_wait_seconds": longest_wait.as_secs_f64(),
            "processor_seconds": since(&self.used),
            "longest_queue": model.longest_queue.swap(0, Ordering::Relaxed),
            "ended_by_second": by_second,
        })
    }

    /// Stops the server, and what is still running.
    pub fn stop(self) {
        self.runtime.shutdown_background();
    }
}
