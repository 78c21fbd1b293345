//! The options of a shared cache and of workers.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

// The options of commands that build with a shared cache; docs/remote.md explains them.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Other machines")]
pub(crate) struct RemoteArguments {
    /// Share results with other machines through a cache at grpc://HOST:PORT, grpcs://HOST:PORT or unix:PATH
    /// [default: SPECULA_REMOTE_CACHE, then [remote] in specula.toml]
    #[arg(long, value_name = "ADDRESS")]
    pub(crate) remote_cache: Option<String>,
    /// Run items on the workers of this server, which is also the cache unless --remote-cache names another
    #[arg(long, value_name = "ADDRESS")]
    pub(crate) remote_executor: Option<String>,
    /// How many items run on workers at a time [default: 64]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=4096))]
    pub(crate) remote_jobs: Option<u16>,
    /// A property that a worker must have, such as container-image=docker://...; may be repeated
    #[arg(long, value_name = "NAME=VALUE")]
    pub(crate) remote_default_exec_properties: Vec<String>,
    /// The path of this program on the workers; without it the program is sent
    #[arg(long, value_name = "PATH")]
    pub(crate) remote_program: Option<String>,
    /// Run items on this machine if they read more than this amount of files [default: 64]
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u32).range(0..=1 << 20))]
    pub(crate) remote_source_limit: Option<u32>,
    /// The name of the server's instance
    #[arg(long, value_name = "NAME")]
    pub(crate) remote_instance_name: Option<String>,
    /// A header of every call, such as authorization=...; may be repeated [also: the lines of
    /// SPECULA_REMOTE_HEADER]
    #[arg(long, value_name = "NAME=VALUE")]
    pub(crate) remote_header: Vec<String>,
    /// The time limit of each call [default: 60]
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..=86_400))]
    pub(crate) remote_timeout: Option<u64>,
    /// Whether to store results of this machine: if the server allows it (auto), never or always
    #[arg(long, value_enum, value_name = "WHEN")]
    pub(crate) remote_upload: Option<RemoteUpload>,
    /// What to download: the files of out and the inputs of items on this machine (outputs), or all
    #[arg(long, value_enum, value_name = "WHAT")]
    pub(crate) remote_download: Option<RemoteDownload>,
    /// Compress large results with Zstandard in transit, if the server supports that
    #[arg(long)]
    pub(crate) remote_cache_compression: bool,
    /// Fail with exit code 4 if a server cannot be used
    #[arg(long)]
    pub(crate) remote_required: bool,
    /// The certificate authority of the server (PEM) [default: those of the system]
    #[arg(long, value_name = "FILE")]
    pub(crate) tls_certificate: Option<PathBuf>,
    /// The certificate of this machine (PEM)
    #[arg(long, value_name = "FILE")]
    pub(crate) tls_client_certificate: Option<PathBuf>,
    /// The key of this machine (PEM)
    #[arg(long, value_name = "FILE")]
    pub(crate) tls_client_key: Option<PathBuf>,
}

/// Whether results are stored in the shared cache.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum RemoteUpload {
    /// If the server allows it.
    #[default]
    Auto,
    /// Never: only read.
    Never,
    /// Always, with a warning if the server does not allow it.
    Always,
}

/// What is received from the shared cache.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum RemoteDownload {
    /// The files of out, and the inputs of items that run on this machine.
    #[default]
    Outputs,
    /// All results that are found.
    All,
}
