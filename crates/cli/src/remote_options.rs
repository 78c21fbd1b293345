//! The shared cache of a build: where it is and how it is used, from the command line, the environment and
//! `specula.toml`.
//!
//! The first that says something counts: an option, a variable (`SPECULA_REMOTE_CACHE`,
//! `SPECULA_REMOTE_HEADER`), `specula.toml` beside the manifest, `specula.toml` of the user. Headers are
//! secrets: `specula.toml` can only name a file of them, and they are in no message, event or record.

#[cfg(feature = "remote")]
use std::fs;
use std::path::{Path, PathBuf};

use engine::SharedCacheOptions;

use crate::arguments::{RemoteArguments, RemoteDownload, RemoteUpload};
use crate::command_error::CommandError;
use crate::settings::RemoteSettings;

const CACHE: &str = "SPECULA_REMOTE_CACHE";
#[cfg(feature = "remote")]
const HEADER: &str = "SPECULA_REMOTE_HEADER";

/// The names that options may have in `[remote]`.
const KEYS: [&str; 16] = [
    "cache",
    "executor",
    "jobs",
    "exec-properties",
    "program",
    "source-limit",
    "instance-name",
    "header-file",
    "timeout",
    "upload",
    "download",
    "compression",
    "required",
    "tls-certificate",
    "tls-client-certificate",
    "tls-client-key",
];

/// The cache that a watcher of this manifest shares; `None` if none is named. Of the results of a person's
/// trials nothing is stored, unless `always` is asked for, and nobody waits for that. Everything is received:
/// it is looked at, and the next edit needs it.
pub(crate) fn shared_cache_of_watcher(
    arguments: &RemoteArguments,
    manifest: &Path,
) -> Result<Option<SharedCacheOptions>, CommandError> {
    let of_watcher = |mut options: Options| {
        if options.upload == RemoteUpload::Auto {
            options.upload = RemoteUpload::Never;
        }
        options.download = RemoteDownload::All;
        options
    };
    options(arguments, manifest)?.map(of_watcher).map(connected).transpose()
}

/// The cache that a build of this manifest shares; `None` if none is named.
pub(crate) fn shared_cache(
    arguments: &RemoteArguments,
    manifest: &Path,
) -> Result<Option<SharedCacheOptions>, CommandError> {
    options(arguments, manifest)?.map(connected).transpose()
}

/// All options, each with the value that counts.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(not(feature = "remote"), allow(dead_code, reason = "without a client they are not used"))]
struct Options {
    cache: String,
    /// The address of the server that runs items; empty if they all run here.
    executor: String,
    jobs: u64,
    properties: Vec<(String, String)>,
    program: Option<String>,
    /// The limit of the files that an item may read on a worker, in MiB.
    source_limit: u64,
    instance: String,
    headers: Vec<String>,
    header_file: Option<PathBuf>,
    timeout: u64,
    upload: RemoteUpload,
    download: RemoteDownload,
    compression: bool,
    required: bool,
    authority: Option<PathBuf>,
    client_certificate: Option<PathBuf>,
    client_key: Option<PathBuf>,
}

fn options(arguments: &RemoteArguments, manifest: &Path) -> Result<Option<Options>, CommandError> {
    let settings = RemoteSettings::read(manifest, &KEYS)?;
    let variable = std::env::var(CACHE).ok().filter(|value| !value.is_empty());
    merged(arguments, variable, &settings)
}

fn merged(
    arguments: &RemoteArguments,
    variable: Option<String>,
    settings: &RemoteSettings,
) -> Result<Option<Options>, CommandError> {
    let seconds = settings.number("timeout", "seconds", 1..=86_400)?;
    let jobs = settings.number("jobs", "items", 1..=4096)?;
    let source_limit = settings.number("source-limit", "MiB", 0..=1 << 20)?;
    let mut properties = settings.texts("exec-properties")?.unwrap_or_default();
    for written in &arguments.remote_default_exec_properties {
        let Some((name, value)) = written.split_once('=') else {
            let message = format!("--remote-default-exec-properties {written:?} is not NAME=VALUE");
            return Err(CommandError::usage([message]));
        };
        properties.retain(|(known, _)| known != name);
        properties.push((name.to_owned(), value.to_owned()));
    }
    let upload = settings.choice(
        "upload",
        &[("auto", RemoteUpload::Auto), ("never", RemoteUpload::Never), ("always", RemoteUpload::Always)],
    )?;
    let download =
        settings.choice("download", &[("outputs", RemoteDownload::Outputs), ("all", RemoteDownload::All)])?;
    let executor = arguments.remote_executor.clone().or(settings.text("executor")?).unwrap_or_default();
    let cache = arguments.remote_cache.clone().or(variable).or(settings.text("cache")?);
    let options = Options {
        cache: cache.unwrap_or_else(|| executor.clone()),
        executor,
        jobs: arguments.remote_jobs.map(u64::from).or(jobs).unwrap_or(64),
        properties,
        program: arguments.remote_program.clone().or(settings.text("program")?),
        source_limit: arguments.remote_source_limit.map(u64::from).or(source_limit).unwrap_or(64),
        instance: arguments
            .remote_instance_name
            .clone()
            .or(settings.text("instance-name")?)
            .unwrap_or_default(),
        headers: arguments.remote_header.clone(),
        header_file: settings.path("header-file")?,
        timeout: arguments.remote_timeout.or(seconds).unwrap_or(60),
        upload: arguments.remote_upload.or(upload).unwrap_or_default(),
        download: arguments.remote_download.or(download).unwrap_or_default(),
        compression: arguments.remote_cache_compression || settings.switch("compression")?.unwrap_or(false),
        required: arguments.remote_required || settings.switch("required")?.unwrap_or(false),
        authority: arguments.tls_certificate.clone().or(settings.path("tls-certificate")?),
        client_certificate: arguments
            .tls_client_certificate
            .clone()
            .or(settings.path("tls-client-certificate")?),
        client_key: arguments.tls_client_key.clone().or(settings.path("tls-client-key")?),
    };
    // An empty name turns a cache of specula.toml off.
    Ok((!options.cache.is_empty()).then_some(options))
}

#[cfg(not(feature = "remote"))]
fn connected(options: Options) -> Result<SharedCacheOptions, CommandError> {
    let message = format!(
        "this specula cannot use the shared cache {}: it was built without the feature `remote`",
        options.cache
    );
    let help = "build it with `cargo install --path crates/cli --features remote`, or set --remote-cache= to \
                build without it";
    Err(CommandError::usage([message]).with_help(Some(help)))
}

#[cfg(feature = "remote")]
fn connected(options: Options) -> Result<SharedCacheOptions, CommandError> {
    use std::sync::Arc;
    use std::time::Duration;

    use engine::{Executor, ExecutorOptions};
    use remote::{Address, Program, RemoteCache, RemoteExecutor, RemoteOptions, TlsFiles, UploadChoice};

    let wrong = |error: &dyn std::fmt::Display| CommandError::usage([error.to_string()]);
    let read = |file: &Option<PathBuf>| match file {
        None => Ok(None),
        Some(file) => {
            let bytes = fs::read(file).map_err(|error| {
                CommandError::usage([format!("cannot read {}: {error}", engine::path_text(file))])
            });
            bytes.map(Some)
        }
    };
    let mut headers = options.headers;
    let of_file = read(&options.header_file)?.unwrap_or_default();
    let variable = std::env::var(HEADER).unwrap_or_default();
    let lines = [String::from_utf8_lossy(&of_file).into_owned(), variable];
    headers.extend(
        lines.iter().flat_map(|text| text.lines()).filter(|line| !line.trim().is_empty()).map(str::to_owned),
    );
    let headers = headers.iter().map(|header| match header.split_once('=') {
        Some((name, value)) => Ok((name.trim().to_owned(), value.trim().to_owned())),
        // Its value may be secret.
        None => Err(CommandError::usage([
            "a header is not NAME=VALUE, such as authorization=Bearer 1234".to_owned()
        ])),
    });
    let client = match (read(&options.client_certificate)?, read(&options.client_key)?) {
        (Some(certificate), Some(key)) => Some((certificate, key)),
        (None, None) => None,
        _ => {
            return Err(CommandError::usage([
                "--tls-client-certificate and --tls-client-key belong together".to_owned(),
            ]));
        }
    };
    let of_cache = RemoteOptions {
        address: Address::parse(&options.cache).map_err(|error| wrong(&error))?,
        instance: options.instance,
        headers: headers.collect::<Result<_, _>>()?,
        tls: TlsFiles { authority: read(&options.authority)?, client },
        timeout: Duration::from_secs(options.timeout),
        upload: match options.upload {
            RemoteUpload::Auto => UploadChoice::Auto,
            RemoteUpload::Never => UploadChoice::Never,
            RemoteUpload::Always => UploadChoice::Always,
        },
        compress: options.compression,
    };
    let cache = RemoteCache::new(of_cache.clone()).map_err(|error| wrong(&error))?;
    let executor = match options.executor.as_str() {
        "" => None,
        address => {
            let address = Address::parse(address).map_err(|error| wrong(&error))?;
            let program = match options.program {
                Some(path) => Program::There(path),
                None => Program::Sent(std::env::current_exe().map_err(|error| wrong(&error))?),
            };
            let of_executor = RemoteOptions { address, ..of_cache };
            let executor = RemoteExecutor::new(&cache, of_executor, program, options.properties);
            Some(ExecutorOptions {
                executor: Arc::new(executor.map_err(|error| wrong(&error))?) as Arc<dyn Executor>,
                jobs: usize::try_from(options.jobs).unwrap_or(64),
                most_bytes: options.source_limit << 20,
            })
        }
    };
    Ok(SharedCacheOptions {
        executor,
        cache: Arc::new(cache),
        version: env!("CARGO_PKG_VERSION").into(),
        machine: machine_name(),
        download_all: options.download == RemoteDownload::All,
        is_required: options.required,
        programs: std::env::var_os("PATH")
            .map_or_else(Vec::new, |path| std::env::split_paths(&path).collect()),
    })
}

#[cfg(feature = "remote")]
fn machine_name() -> String {
    let variables = ["HOSTNAME", "COMPUTERNAME"].into_iter().filter_map(|name| std::env::var(name).ok());
    let files = ["/proc/sys/kernel/hostname", "/etc/hostname"].into_iter();
    let names = variables.chain(files.filter_map(|file| fs::read_to_string(file).ok()));
    let mut names = names.map(|name| name.trim().to_owned()).filter(|name| !name.is_empty());
    names.next().unwrap_or_else(|| "an unnamed machine".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_counts_before_the_variable_before_the_files() {
        let texts = ["cache = \"grpc://beside:1\"", "cache = \"grpc://user:1\"\nupload = \"never\""];
        let options = |arguments: &RemoteArguments, variable: Option<&str>, texts: &[&str]| {
            let settings = RemoteSettings::of_texts(texts);
            merged(arguments, variable.map(str::to_owned), &settings).unwrap()
        };
        let cache = |arguments: &RemoteArguments, variable: Option<&str>, texts: &[&str]| {
            options(arguments, variable, texts).map(|options| options.cache)
        };
        let none = RemoteArguments::default();
        let given =
            RemoteArguments { remote_cache: Some("grpc://given:1".into()), ..RemoteArguments::default() };
        assert_eq!(cache(&given, Some("grpc://variable:1"), &texts).unwrap(), "grpc://given:1");
        assert_eq!(cache(&none, Some("grpc://variable:1"), &texts).unwrap(), "grpc://variable:1");
        assert_eq!(cache(&none, None, &texts).unwrap(), "grpc://beside:1");
        assert_eq!(cache(&none, None, &texts[1..]).unwrap(), "grpc://user:1");
        assert_eq!(cache(&none, None, &[]), None);
        let off = RemoteArguments { remote_cache: Some(String::new()), ..RemoteArguments::default() };
        assert_eq!(cache(&off, Some("grpc://variable:1"), &texts), None);
        assert_eq!(options(&none, None, &texts).unwrap().upload, RemoteUpload::Never);
    }

    #[test]
    fn paths_are_relative_to_their_file_and_wrong_values_are_named() {
        let none = RemoteArguments::default();
        let merged = |text: &str| merged(&none, None, &RemoteSettings::of_texts(&[text]));
        let options = merged("cache = \"grpc://a:1\"\nheader-file = \"secrets/header\"").unwrap().unwrap();
        assert_eq!(options.header_file, Some(PathBuf::from("/studio/secrets/header")));
        for (text, expected) in [
            ("upload = \"often\"", "expected \"auto\" or \"never\" or \"always\""),
            ("timeout = 0", "expected a whole number of seconds from 1 to 86400"),
            ("cache = 1", "expected a text"),
            ("required = \"yes\"", "expected true or false"),
        ] {
            let error = merged(text).unwrap_err().to_string();
            assert!(error.starts_with("specula.toml:1:") && error.contains(expected), "{error}");
        }
    }
}
