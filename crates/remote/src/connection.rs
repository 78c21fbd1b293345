//! The connection to a server: made at the first call, used by all, and given up at the first error that is
//! not an answer.

use std::error::Error as _;
use std::future::Future;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use bazel_remote_apis::build::bazel::remote::execution::v2 as re;
use engine::Trouble;
use parking_lot::Mutex;
use prost::Message as _;
use re::capabilities_client::CapabilitiesClient;
use tokio::runtime::Runtime;
use tonic::metadata::{AsciiMetadataKey, AsciiMetadataValue, MetadataValue};
use tonic::transport::{Certificate, Channel, ClientTlsConfig, Endpoint, Identity};
use tonic::{Code, Request, Status};

use crate::options::{RemoteOptions, UploadChoice};

/// A call that a busy server or a lost connection broke off is made again so many times, after pauses that
/// start with this and grow fourfold.
pub(crate) const RETRIES: u32 = 3;
pub(crate) const PAUSE: Duration = Duration::from_millis(100);

/// The longest wait for a connection.
const CONNECTING: Duration = Duration::from_secs(10);

/// How often it is looked whether a server that runs something is still there.
pub(crate) const PING: Duration = Duration::from_secs(30);

/// How long a server is left alone after an error. A watcher tries it again then.
const PATIENCE: Duration = Duration::from_secs(60);

/// Messages of blobs are larger than gRPC's default limit of 4 MiB allows.
pub(crate) const LARGEST_MESSAGE: usize = 16 << 20;

/// Options that no connection can have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ConnectionError {
    /// A header's name or value has characters that headers cannot have.
    #[error("the header {0:?} is not NAME=VALUE in printable ASCII")]
    Header(String),
    /// Certificates are for encrypted connections.
    #[error("certificates are given, but {0} is not encrypted: expected grpcs://")]
    NotEncrypted(String),
    /// Threads cannot be started.
    #[error("cannot start threads: {0}")]
    Threads(String),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// Storing and reading blobs and results.
    Cache,
    /// Running actions. A call lasts as long as its action, so it has no time limit; that the server is still
    /// there is seen by pings.
    Execution,
}

/// The capabilities that a server said it has.
#[derive(Clone, Debug)]
pub(crate) struct Server {
    pub(crate) channel: Channel,
    /// Whether large blobs are compressed.
    pub(crate) has_zstd: bool,
    /// The most bytes of blobs in one message.
    pub(crate) batch: u64,
}

#[derive(Debug)]
pub(crate) struct Connection {
    pub(crate) runtime: Runtime,
    pub(crate) options: RemoteOptions,
    purpose: Purpose,
    endpoint: Endpoint,
    headers: Vec<(AsciiMetadataKey, AsciiMetadataValue)>,
    server: Mutex<Option<Server>>,
    /// Since when no call is made; `None` if calls are made.
    broken: Mutex<Option<Instant>>,
    pub(crate) may_store: AtomicBool,
    trouble: Mutex<Option<Trouble>>,
    /// A lock that is held by whoever sends large blobs.
    pub(crate) turn: tokio::sync::Mutex<()>,
    pub(crate) calls: AtomicU64,
    pub(crate) received: AtomicU64,
    pub(crate) sent: AtomicU64,
}

impl Connection {
    pub(crate) fn new(options: RemoteOptions, purpose: Purpose) -> Result<Self, ConnectionError> {
        let headers = options.headers.iter().map(|(name, value)| {
            let error = || ConnectionError::Header(name.clone());
            let name = name.to_ascii_lowercase().parse::<AsciiMetadataKey>().map_err(|_| error())?;
            Ok((name, value.parse::<AsciiMetadataValue>().map_err(|_| error())?))
        });
        let headers = headers.collect::<Result<Vec<_>, _>>()?;
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .thread_name("specula remote")
            .enable_all()
            .build()
            .map_err(|error| ConnectionError::Threads(error.to_string()))?;
        let endpoint = endpoint(&options, purpose)?;
        Ok(Self {
            runtime,
            may_store: AtomicBool::new(options.upload != UploadChoice::Never),
            options,
            purpose,
            endpoint,
            headers,
            server: Mutex::default(),
            broken: Mutex::default(),
            trouble: Mutex::default(),
            turn: tokio::sync::Mutex::default(),
            calls: AtomicU64::new(0),
            received: AtomicU64::new(0),
            sent: AtomicU64::new(0),
        })
    }

    /// The server; `None` if it cannot be used. Must not be called from the runtime's own threads.
    pub(crate) fn server(&self) -> Option<Server> {
        // One thread connects, and the others wait for it.
        let mut server = self.server.lock();
        let broken = *self.broken.lock();
        match broken {
            Some(since) if since.elapsed() < PATIENCE => return None,
            Some(_) => *self.broken.lock() = None,
            None => {}
        }
        if server.is_none() {
            match self.runtime.block_on(self.connect()) {
                Ok(connected) => *server = Some(connected),
                Err(message) => self.give_up(message),
            }
        }
        server.clone().filter(|_| !self.is_broken())
    }

    async fn connect(&self) -> Result<Server, String> {
        let address = &self.options.address;
        let channel = self.endpoint.connect().await;
        let channel = channel.map_err(|error| {
            let why = chain(&error);
            format!("cannot connect to {address}: {why}{}", advice_on_encryption(&why))
        })?;
        let ask = || async {
            let request = re::GetCapabilitiesRequest { instance_name: self.options.instance.clone() };
            CapabilitiesClient::new(channel.clone()).get_capabilities(self.request(request)).await
        };
        let answer = self.call(ask).await.map_err(|status| {
            let advice = match is_lost(&status) {
                false => "",
                true if address.is_encrypted() => NO_CERTIFICATE,
                true => " (is the server encrypted? Then its address begins with grpcs://)",
            };
            format!("{address} does not list its capabilities: {}{advice}", said(&status))
        })?;
        let capabilities = answer.into_inner();
        let runs = capabilities.execution_capabilities.is_some_and(|execution| execution.exec_enabled);
        if self.purpose == Purpose::Execution && !runs {
            return Err(format!("{address} runs no actions"));
        }
        let cache = capabilities.cache_capabilities.unwrap_or_default();
        let functions = &cache.digest_functions;
        if !functions.is_empty() && !functions.contains(&(re::digest_function::Value::Sha256 as i32)) {
            return Err(format!("{address} does not know blobs by SHA-256"));
        }
        let may_update = cache.action_cache_update_capabilities.is_some_and(|update| update.update_enabled);
        if !may_update
            && self.purpose == Purpose::Cache
            && self.may_store.swap(false, Ordering::Relaxed)
            && self.options.upload == UploadChoice::Always
        {
            self.say(format!("{address} does not let us store results"));
        }
        let limit = u64::try_from(cache.max_batch_total_size_bytes).ok().filter(|limit| *limit > 0);
        let zstd = re::compressor::Value::Zstd as i32;
        Ok(Server {
            channel,
            has_zstd: self.options.compress && cache.supported_compressors.contains(&zstd),
            batch: limit.map_or(crate::BATCH, |limit| limit.min(crate::BATCH)),
        })
    }

    /// A request with the headers.
    pub(crate) fn request<T>(&self, message: T) -> Request<T> {
        let mut request = Request::new(message);
        let details =
            re::ToolDetails { tool_name: "specula".into(), tool_version: env!("CARGO_PKG_VERSION").into() };
        let about = re::RequestMetadata { tool_details: Some(details), ..Default::default() };
        let about = MetadataValue::from_bytes(&about.encode_to_vec());
        let metadata = request.metadata_mut();
        metadata.insert_bin("build.bazel.remote.execution.v2.requestmetadata-bin", about);
        for (name, value) in &self.headers {
            metadata.insert(name.clone(), value.clone());
        }
        request
    }

    /// Makes a call, again if it was broken off. Each attempt, from its first byte to its last, has the time
    /// limit.
    pub(crate) async fn call<T, F: Future<Output = Result<T, Status>>>(
        &self,
        make: impl Fn() -> F,
    ) -> Result<T, Status> {
        self.retry(|| self.within(make())).await
    }

    /// The answer, if it comes within the time limit; otherwise an error.
    pub(crate) async fn within<T>(
        &self,
        answer: impl Future<Output = Result<T, Status>>,
    ) -> Result<T, Status> {
        let limit = self.options.timeout;
        tokio::time::timeout(limit, answer).await.unwrap_or_else(|_| {
            Err(Status::deadline_exceeded(format!("no answer within {} s", limit.as_secs())))
        })
    }

    /// Makes a call that has its own time limits, again if it was broken off.
    pub(crate) async fn retry<T, F: Future<Output = Result<T, Status>>>(
        &self,
        make: impl Fn() -> F,
    ) -> Result<T, Status> {
        let mut pause = PAUSE;
        for attempt in 0.. {
            self.calls.fetch_add(1, Ordering::Relaxed);
            match make().await {
                Err(status) if attempt < RETRIES && is_passing(&status) && !self.is_broken() => {
                    tokio::time::sleep(pause).await;
                    pause *= 4;
                }
                answer => return answer,
            }
        }
        Err(Status::unavailable("no attempt is left"))
    }

    /// The name of a blob's stream.
    pub(crate) fn resource(&self, name: &str) -> String {
        match self.options.instance.as_str() {
            "" => name.to_owned(),
            instance => format!("{instance}/{name}"),
        }
    }

    pub(crate) fn is_broken(&self) -> bool {
        self.broken.lock().is_some()
    }

    /// Makes no more calls for some time, and says why.
    pub(crate) fn give_up(&self, why: String) {
        if self.broken.lock().replace(Instant::now()).is_none() {
            // Nothing that was said before matters any more.
            *self.trouble.lock() = Some(Trouble { message: why, is_lost: true });
        }
    }

    /// Stores nothing any more.
    pub(crate) fn stop_storing(&self, why: &Status) {
        if self.may_store.swap(false, Ordering::Relaxed) {
            self.say(format!(
                "{} does not store results: {}; it is still read",
                self.options.address,
                said(why)
            ));
        }
    }

    /// Says what is wrong, unless something else is waiting to be said.
    pub(crate) fn say(&self, message: String) {
        self.trouble.lock().get_or_insert(Trouble { message, is_lost: false });
    }

    pub(crate) fn take_trouble(&self) -> Option<Trouble> {
        self.trouble.lock().take()
    }
}

fn endpoint(options: &RemoteOptions, purpose: Purpose) -> Result<Endpoint, ConnectionError> {
    let uri = options.address.uri();
    let error = |error: tonic::transport::Error| ConnectionError::Threads(chain(&error));
    let endpoint = Endpoint::from_shared(uri).map_err(error)?;
    let mut endpoint = endpoint
        .connect_timeout(options.timeout.min(CONNECTING))
        .initial_stream_window_size(Some(4 << 20))
        .initial_connection_window_size(Some(16 << 20))
        .user_agent("specula")
        .map_err(error)?;
    if purpose == Purpose::Execution {
        endpoint = endpoint
            .http2_keep_alive_interval(PING)
            .keep_alive_timeout(options.timeout)
            .keep_alive_while_idle(true);
    }
    let tls = &options.tls;
    if options.address.is_encrypted() {
        let mut config = ClientTlsConfig::new();
        config = match &tls.authority {
            Some(pem) => config.ca_certificate(Certificate::from_pem(pem)),
            None => config.with_native_roots(),
        };
        if let Some((certificate, key)) = &tls.client {
            config = config.identity(Identity::from_pem(certificate, key));
        }
        endpoint = endpoint.tls_config(config).map_err(error)?;
    } else if tls.authority.is_some() || tls.client.is_some() {
        return Err(ConnectionError::NotEncrypted(options.address.to_string()));
    }
    Ok(endpoint)
}

/// Whether the same call may succeed a little later.
pub(crate) fn is_passing(status: &Status) -> bool {
    is_lost(status) || matches!(status.code(), Code::Unavailable | Code::Aborted)
}

/// Whether a status is not the server's answer: the connection ended before it.
fn is_lost(status: &Status) -> bool {
    status.source().is_some()
}

/// The text of a status on one line.
pub(crate) fn said(status: &Status) -> String {
    let text = match status.message() {
        _ if is_lost(status) => {
            format!("the connection was lost ({})", status.source().map(chain).unwrap_or_default())
        }
        "" => format!("{:?}", status.code()),
        message => format!("{:?}: {message}", status.code()),
    };
    let advice = match status.code() {
        Code::Unauthenticated | Code::PermissionDenied => {
            " (is --remote-header authorization=... right and not expired?)"
        }
        Code::DeadlineExceeded => " (--remote-timeout sets the time limit)",
        _ => "",
    };
    text.replace(['\n', '\r'], " ") + advice
}

/// A server that wants the client's certificate closes the connection without one.
const NO_CERTIFICATE: &str =
    " (does the server want a certificate of yours? --tls-client-certificate and --tls-client-key name it)";

/// Advice on what to check if a connection cannot be encrypted.
fn advice_on_encryption(why: &str) -> &'static str {
    // The library's errors are not public: their texts are all that there is.
    if why.contains("invalid peer certificate") {
        " (is --tls-certificate the authority that signed this server's certificate?)"
    } else if why.contains("corrupt message") {
        " (is the server encrypted? If it is not, its address begins with grpc://)"
    } else if why.contains("fatal alert") {
        NO_CERTIFICATE
    } else {
        ""
    }
}

/// An error with its causes, those only that say something new.
fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        let cause_text = cause.to_string();
        if !text.ends_with(&cause_text) {
            text += &format!(": {cause_text}");
        }
        source = cause.source();
    }
    text
}
