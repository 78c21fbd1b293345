//! How a cache is used.

use std::fmt;
use std::time::Duration;

use crate::Address;

/// Whether results are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UploadChoice {
    /// Results are stored if the server lets us.
    #[default]
    Auto,
    /// Results are never stored.
    Never,
    /// Results are always stored; if the server does not let us, that is a warning.
    Always,
}

/// Certificates, as PEM.
#[derive(Clone, Default, PartialEq, Eq)]
pub struct TlsFiles {
    /// The authority that the server's certificate is checked with; `None`: those of the system.
    pub authority: Option<Vec<u8>>,
    /// Our certificate and its key.
    pub client: Option<(Vec<u8>, Vec<u8>)>,
}

impl fmt::Debug for TlsFiles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (authority, client) = (self.authority.is_some(), self.client.is_some());
        f.debug_struct("TlsFiles").field("authority", &authority).field("client", &client).finish()
    }
}

/// Options of a cache.
#[derive(Clone, PartialEq, Eq)]
pub struct RemoteOptions {
    /// The server.
    pub address: Address,
    /// The instance of the server; empty if it has one only.
    pub instance: String,
    /// Headers of every call. Secret: they are in no message.
    pub headers: Vec<(String, String)>,
    /// Certificates.
    pub tls: TlsFiles,
    /// The time limit of a call.
    pub timeout: Duration,
    /// Whether results are stored.
    pub upload: UploadChoice,
    /// Whether large blobs are compressed if the server offers it.
    pub compress: bool,
}

impl fmt::Debug for RemoteOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let headers = self.headers.iter().map(|(name, _)| name).collect::<Vec<_>>();
        f.debug_struct("RemoteOptions")
            .field("address", &self.address)
            .field("instance", &self.instance)
            .field("headers", &headers)
            .finish_non_exhaustive()
    }
}
