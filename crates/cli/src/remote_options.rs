//! The shared cache of a build: where it is and how it is used, from the command line, the environment and
//! `specula.toml`.
//!
//! The first that says something counts: an option, a variable (`SPECULA_REMOTE_CACHE`,
//! `SPECULA_REMOTE_HEADER`), `specula.toml` beside the manifest, `specula.toml` of the user. Headers are
//! secrets: `specula.toml` can only name a file of them, and they are in no message, event or record.

use std::fs;
use std::path::{Path, PathBuf};

use engine::SharedCacheOptions;
use toml::{Table, Value};

use crate::arguments::{RemoteArguments, RemoteDownload, RemoteUpload};
use crate::exit::Exit;
use crate::print;

const CACHE: &str = "SPECULA_REMOTE_CACHE";
#[cfg(feature = "remote")]
const HEADER: &str = "SPECULA_REMOTE_HEADER";

/// The file with a table `[remote]`.
const FILE: &str = "specula.toml";

/// What an option may be called in `[remote]`.
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
) -> Result<Option<SharedCacheOptions>, Exit> {
    let of_watcher = |mut options: Options| {
        if options.upload == RemoteUpload::Auto {
            options.upload = RemoteUpload::Never;
        }
        options.download = RemoteDownload::All;
        options
    };
    opened(options(arguments, manifest).map(|options| options.map(of_watcher)))
}

/// The cache that a build of this manifest shares; `None` if none is named.
pub(crate) fn shared_cache(
    arguments: &RemoteArguments,
    manifest: &Path,
) -> Result<Option<SharedCacheOptions>, Exit> {
    opened(options(arguments, manifest))
}

fn opened(options: Result<Option<Options>, OptionError>) -> Result<Option<SharedCacheOptions>, Exit> {
    options.and_then(|options| options.map(connected).transpose()).map_err(|error| {
        print::error(&error.chain, error.help);
        Exit::Usage
    })
}

/// What is wrong with the options, and what to do.
#[derive(Debug, PartialEq)]
struct OptionError {
    chain: Vec<String>,
    help: Option<&'static str>,
}

impl OptionError {
    fn new(message: impl Into<String>) -> Self {
        Self { chain: vec![message.into()], help: None }
    }
}

/// All options, each with the value that counts.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(not(feature = "remote"), allow(dead_code, reason = "without a client nothing is done with them"))]
struct Options {
    cache: String,
    /// Where items run; empty if they all run here.
    executor: String,
    jobs: u64,
    properties: Vec<(String, String)>,
    program: Option<String>,
    /// In MiB.
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

fn options(arguments: &RemoteArguments, manifest: &Path) -> Result<Option<Options>, OptionError> {
    let beside = manifest.parent().unwrap_or(Path::new("")).join(FILE);
    let of_user = dirs::config_dir().map(|folder| folder.join("specula").join(FILE));
    let files = [Some(beside), of_user].into_iter().flatten();
    let tables = files.map(|file| table(&file)).collect::<Result<Vec<_>, _>>()?;
    let variable = std::env::var(CACHE).ok().filter(|value| !value.is_empty());
    merged(arguments, variable, &tables)
}

/// A table `[remote]`, and the folder that its paths are relative to.
type Settings = (PathBuf, Table);

fn table(file: &Path) -> Result<Settings, OptionError> {
    let folder = file.parent().unwrap_or(Path::new("")).to_path_buf();
    let text = match fs::read_to_string(file) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok((folder, Table::new())),
        Err(error) => return Err(OptionError::new(format!("cannot read {}: {error}", file.display()))),
    };
    let wrong = |message: String| OptionError::new(format!("{}: {message}", file.display()));
    let table = text.parse::<Table>().map_err(|error| wrong(error.message().to_owned()))?;
    let remote = match table.get("remote") {
        None => Table::new(),
        Some(Value::Table(remote)) => remote.clone(),
        Some(_) => return Err(wrong("expected a table [remote]".into())),
    };
    if let Some(unknown) = remote.keys().find(|key| !KEYS.contains(&key.as_str())) {
        let near = engine::nearest(unknown, KEYS)
            .map_or_else(String::new, |near| format!("; did you mean {near:?}?"));
        return Err(wrong(format!(
            "unknown key {unknown:?} in [remote]{near} Known are {}",
            KEYS.join(", ")
        )));
    }
    Ok((folder, remote))
}

fn merged(
    arguments: &RemoteArguments,
    variable: Option<String>,
    tables: &[Settings],
) -> Result<Option<Options>, OptionError> {
    let value = |key: &str| tables.iter().find_map(|(folder, table)| Some((folder, table.get(key)?)));
    let expected =
        |key: &str, what: &str| OptionError::new(format!("{FILE}: {key} of [remote]: expected {what}"));
    let text = |key: &str| match value(key) {
        None => Ok(None),
        Some((_, Value::String(text))) => Ok(Some(text.clone())),
        Some(_) => Err(expected(key, "a text")),
    };
    let path = |key: &str| match value(key) {
        None => Ok(None),
        Some((folder, Value::String(text))) => Ok(Some(folder.join(text))),
        Some(_) => Err(expected(key, "a path")),
    };
    let truth = |key: &str| match value(key) {
        None => Ok(None),
        Some((_, Value::Boolean(truth))) => Ok(Some(*truth)),
        Some(_) => Err(expected(key, "true or false")),
    };
    let number = |key: &str, what: &str, range: std::ops::RangeInclusive<i64>| match value(key) {
        None => Ok(None),
        Some((_, Value::Integer(number))) if range.contains(number) => Ok(u64::try_from(*number).ok()),
        Some(_) => {
            let (least, most) = (range.start(), range.end());
            Err(expected(key, &format!("a whole number of {what} from {least} to {most}")))
        }
    };
    let seconds = number("timeout", "seconds", 1..=86_400)?;
    let jobs = number("jobs", "items", 1..=4096)?;
    let source_limit = number("source-limit", "MiB", 0..=1 << 20)?;
    let mut properties = match value("exec-properties") {
        None => Vec::new(),
        Some((_, Value::Table(table))) => {
            let text = |(name, value): (&String, &Value)| Some((name.clone(), value.as_str()?.to_owned()));
            let texts = table.iter().map(text).collect::<Option<Vec<_>>>();
            texts.ok_or_else(|| expected("exec-properties", "a table of texts"))?
        }
        Some(_) => return Err(expected("exec-properties", "a table of texts")),
    };
    for written in &arguments.remote_default_exec_properties {
        let Some((name, value)) = written.split_once('=') else {
            let message = format!("--remote-default-exec-properties {written:?} is not NAME=VALUE");
            return Err(OptionError::new(message));
        };
        properties.retain(|(known, _)| known != name);
        properties.push((name.to_owned(), value.to_owned()));
    }
    let upload = match text("upload")?.as_deref() {
        None => None,
        Some("auto") => Some(RemoteUpload::Auto),
        Some("never") => Some(RemoteUpload::Never),
        Some("always") => Some(RemoteUpload::Always),
        Some(_) => return Err(expected("upload", "\"auto\", \"never\" or \"always\"")),
    };
    let download = match text("download")?.as_deref() {
        None => None,
        Some("outputs") => Some(RemoteDownload::Outputs),
        Some("all") => Some(RemoteDownload::All),
        Some(_) => return Err(expected("download", "\"outputs\" or \"all\"")),
    };
    let executor = arguments.remote_executor.clone().or(text("executor")?).unwrap_or_default();
    let cache = arguments.remote_cache.clone().or(variable).or(text("cache")?);
    let options = Options {
        cache: cache.unwrap_or_else(|| executor.clone()),
        executor,
        jobs: arguments.remote_jobs.map(u64::from).or(jobs).unwrap_or(64),
        properties,
        program: arguments.remote_program.clone().or(text("program")?),
        source_limit: arguments.remote_source_limit.map(u64::from).or(source_limit).unwrap_or(64),
        instance: arguments.remote_instance_name.clone().or(text("instance-name")?).unwrap_or_default(),
        headers: arguments.remote_header.clone(),
        header_file: path("header-file")?,
        timeout: arguments.remote_timeout.or(seconds).unwrap_or(60),
        upload: arguments.remote_upload.or(upload).unwrap_or_default(),
        download: arguments.remote_download.or(download).unwrap_or_default(),
        compression: arguments.remote_cache_compression || truth("compression")?.unwrap_or(false),
        required: arguments.remote_required || truth("required")?.unwrap_or(false),
        authority: arguments.tls_certificate.clone().or(path("tls-certificate")?),
        client_certificate: arguments.tls_client_certificate.clone().or(path("tls-client-certificate")?),
        client_key: arguments.tls_client_key.clone().or(path("tls-client-key")?),
    };
    // An empty name turns a cache of specula.toml off.
    Ok((!options.cache.is_empty()).then_some(options))
}

#[cfg(not(feature = "remote"))]
fn connected(options: Options) -> Result<SharedCacheOptions, OptionError> {
    Err(OptionError {
        chain: vec![format!(
            "this specula cannot use the shared cache {}: it was built without the feature `remote`",
            options.cache
        )],
        help: Some(
            "build it with `cargo install --path crates/cli --features remote`, or give --remote-cache= to build without",
        ),
    })
}

#[cfg(feature = "remote")]
fn connected(options: Options) -> Result<SharedCacheOptions, OptionError> {
    use std::sync::Arc;
    use std::time::Duration;

    use engine::{Executor, ExecutorOptions};
    use remote::{Address, Program, RemoteCache, RemoteExecutor, RemoteOptions, TlsFiles, UploadChoice};

    let wrong = |error: &dyn std::fmt::Display| OptionError::new(error.to_string());
    let read = |file: &Option<PathBuf>| match file {
        None => Ok(None),
        Some(file) => {
            let bytes = fs::read(file)
                .map_err(|error| OptionError::new(format!("cannot read {}: {error}", file.display())));
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
        None => Err(OptionError::new("a header is not NAME=VALUE, such as authorization=Bearer 1234")),
    });
    let client = match (read(&options.client_certificate)?, read(&options.client_key)?) {
        (Some(certificate), Some(key)) => Some((certificate, key)),
        (None, None) => None,
        _ => return Err(OptionError::new("--tls-client-certificate and --tls-client-key belong together")),
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

/// What this machine is called.
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

    fn settings(text: &str) -> Settings {
        (PathBuf::from("/studio"), text.parse().unwrap())
    }

    #[test]
    fn the_command_line_counts_before_the_variable_before_the_files() {
        let tables = [
            settings("cache = \"grpc://beside:1\""),
            settings("cache = \"grpc://user:1\"\nupload = \"never\""),
        ];
        let cache = |arguments: &RemoteArguments, variable: Option<&str>, tables: &[Settings]| {
            merged(arguments, variable.map(str::to_owned), tables).unwrap().map(|options| options.cache)
        };
        let none = RemoteArguments::default();
        let given =
            RemoteArguments { remote_cache: Some("grpc://given:1".into()), ..RemoteArguments::default() };
        assert_eq!(cache(&given, Some("grpc://variable:1"), &tables).unwrap(), "grpc://given:1");
        assert_eq!(cache(&none, Some("grpc://variable:1"), &tables).unwrap(), "grpc://variable:1");
        assert_eq!(cache(&none, None, &tables).unwrap(), "grpc://beside:1");
        assert_eq!(cache(&none, None, &tables[1..]).unwrap(), "grpc://user:1");
        assert_eq!(cache(&none, None, &[]), None);
        let off = RemoteArguments { remote_cache: Some(String::new()), ..RemoteArguments::default() };
        assert_eq!(cache(&off, Some("grpc://variable:1"), &tables), None);
        assert_eq!(merged(&none, None, &tables).unwrap().unwrap().upload, RemoteUpload::Never);
    }

    #[test]
    fn paths_are_relative_to_their_file_and_wrong_values_are_named() {
        let none = RemoteArguments::default();
        let tables = [settings("cache = \"grpc://a:1\"\nheader-file = \"secrets/header\"")];
        let options = merged(&none, None, &tables).unwrap().unwrap();
        assert_eq!(options.header_file, Some(PathBuf::from("/studio/secrets/header")));
        for (text, expected) in [
            ("upload = \"often\"", "upload of [remote]: expected \"auto\", \"never\" or \"always\""),
            ("timeout = 0", "timeout of [remote]: expected a whole number of seconds"),
            ("cache = 1", "cache of [remote]: expected a text"),
            ("required = \"yes\"", "required of [remote]: expected true or false"),
        ] {
            let error = merged(&none, None, &[settings(text)]).unwrap_err();
            assert!(error.chain[0].contains(expected), "{error:?}");
        }
    }

    #[test]
    fn unknown_keys_are_refused_with_the_nearest() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(FILE);
        assert!(table(&file).unwrap().1.is_empty());
        fs::write(&file, "[remote]\nheader = \"authorization=1234\"\n").unwrap();
        let error = table(&file).unwrap_err();
        assert!(error.chain[0].contains("unknown key \"header\" in [remote]"), "{error:?}");
        assert!(!error.chain[0].contains("1234"), "{error:?}");
    }
}
