//! Runs an item on a machine that has nothing of its project but what was sent: `specula run-item`.
//!
//! The kind runs as it would at home. It sees the files that were sent under the names that they have there,
//! and those alone; if it reads another, the run ends with a report that names it, and whoever sent the item
//! sends it again with that file. Only programs (in a folder of PATH) are those of this machine.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parking_lot::Mutex;

use super::item_request::{
    FILES, FORMAT, ITEM, ItemEnd, ItemReport, ItemRequest, REPORT, artifact_place, file_place, output_place,
};
use super::run::{panicked, undeclared};
use super::shared_results::is_in_one_of;
use crate::error::{Error, ErrorKind};
use crate::key::Digest;
use crate::kinds::{Configured, Context, ErasedKind, Failure, Handle, Kinds, Output, Product};
use crate::manifest::Table;
use crate::own_time::own_time;
use crate::platform::path_text;
use crate::storage::{Blob, FileRead, Files, ReadKind, canonical, normal, path_name, read_file};

/// Runs the item of a folder, and writes its outputs and its report there. Returns the failure of the item,
/// if it fails.
///
/// # Errors
/// If the folder has no item that this program can run, or nothing can be written there.
pub fn run_item(folder: &Path, kinds: &Kinds) -> Result<Option<Failure>, Error> {
    let folder = std::path::absolute(folder).map_err(|error| Error::io(&error, "find", folder))?;
    let request = request(&folder)?;
    let root = folder.join(FILES);
    fs::create_dir_all(&root).map_err(|error| Error::io(&error, "create", &root))?;
    // A folder is there, even if nothing in it was sent.
    for known in request.folders.iter().filter(|known| known.entries.is_some()) {
        let place = folder.join(file_place(&known.name));
        fs::create_dir_all(&place).map_err(|error| Error::io(&error, "create", &place))?;
    }
    let scratch = folder.join("scratch");
    fs::create_dir_all(&scratch).map_err(|error| Error::io(&error, "create", &scratch))?;
    let sent = SentFiles::new(&folder, &request);
    let (ran, time) = own_time(|| run(&folder, &scratch, &request, kinds, &sent));
    let _ = fs::remove_dir_all(&scratch);
    let (made, messages, reads) = ran;
    let needs = std::mem::take(&mut *sent.missing.lock());
    let (end, failure) = match made {
        _ if !needs.is_empty() => (ItemEnd::Needs(needs), None),
        Err(failure) => {
            let failure = at_home(failure, &root);
            let Failure { chain, help, system_error, .. } = failure.clone();
            (ItemEnd::Failed { chain, help, system_error }, Some(failure))
        }
        Ok(output) => (ItemEnd::Made(store(&folder, &output)?), None),
    };
    let [warnings, notes] = messages.map(|all| all.iter().map(|text| without(text, &root)).collect());
    let report = ItemReport { end, milliseconds: time.as_secs_f64() * 1e3, warnings, notes, reads };
    write(&folder.join(REPORT), &serde_json::to_vec(&report).unwrap_or_default())?;
    Ok(failure)
}

fn request(folder: &Path) -> Result<ItemRequest, Error> {
    let file = folder.join(ITEM);
    let bytes = read_file(&file).map_err(|error| Error::io(&error, "read", &file))?;
    let wrong = |message: String| {
        Error::new(ErrorKind::Io, format!("{}: {message}", path_text(&file))).with_help(
            "builds with --remote-executor write this file; the program must be the one that runs the build",
        )
    };
    let version = env!("CARGO_PKG_VERSION");
    let value =
        serde_json::from_slice::<serde_json::Value>(&bytes).map_err(|error| wrong(error.to_string()))?;
    let [format, of] = ["format", "version"].map(|key| value.get(key).cloned().unwrap_or_default());
    if format != FORMAT || of != version {
        return Err(wrong(format!("this is specula {version}, but the item needs version {of}")));
    }
    serde_json::from_value(value).map_err(|error| wrong(error.to_string()))
}

type Messages = [Vec<String>; 2];

/// The output, the warnings and notes, and what was read.
fn run(
    folder: &Path,
    scratch: &Path,
    request: &ItemRequest,
    kinds: &Kinds,
    sent: &SentFiles,
) -> (Result<Output, Failure>, Messages, Vec<FileRead>) {
    let (kind, configured) = match configured(request, kinds) {
        Ok(found) => found,
        Err(failure) => return (Err(failure), Messages::default(), Vec::new()),
    };
    let context = context(folder, scratch, request, kind, sent);
    let ran = catch_unwind(AssertUnwindSafe(|| configured.run(&context)));
    let product = product(request, kind, &*configured);
    let made = ran.unwrap_or_else(|panic| Err(panicked(kind.name(), panic.as_ref())));
    let made = made.and_then(|output| match (&output, product) {
        (Output::Artifact { .. }, Product::Artifact(_)) => Ok(output),
        (Output::Files(files), Product::Files(names)) if files.len() == names.len() => Ok(output),
        _ => Err(undeclared(kind.name())),
    });
    let reads = context.files.reads().into_iter().map(|read| FileRead {
        path: path_name(&folder.join(FILES), &read.path),
        kind: read.kind,
        digest: read.digest,
        found: read.found.as_deref().map(|found| path_name(&folder.join(FILES), found)),
        modified: None,
    });
    let reads = reads.collect();
    (made, [context.reporter.warnings(), context.reporter.notes()], reads)
}

fn configured<'k>(
    request: &ItemRequest,
    kinds: &'k Kinds,
) -> Result<(&'k dyn ErasedKind, Arc<dyn Configured>), Failure> {
    let wrong = |what: String| {
        Failure::new(format!("this program differs from the one of the build: {what}")).system_error()
    };
    let kind = kinds.get(&request.kind).ok_or_else(|| wrong(format!("it has no kind {}", request.kind)))?;
    if kind.revision() != request.revision {
        let (here, there) = (kind.revision(), request.revision);
        return Err(wrong(format!("it has revision {here} of kind {}, not {there}", request.kind)));
    }
    let table = Table::parse(&request.parameters).ok();
    let configured = table.and_then(|table| kind.configure(&table).ok());
    let configured = configured.filter(|found| canonical(&found.canonical()) == request.canonical);
    let configured = configured.ok_or_else(|| wrong("it parses the parameters differently".into()))?;
    if configured.processor() != request.processor.as_deref() {
        let message = format!(
            "{} makes different bytes on this processor than on the processor of the build",
            request.kind
        );
        return Err(Failure::new(message).system_error());
    }
    Ok((kind.as_ref(), configured))
}

/// A name that lives as long as this short process.
fn forever(name: &str) -> &'static str {
    Box::leak(name.to_owned().into_boxed_str())
}

fn product(request: &ItemRequest, kind: &dyn ErasedKind, configured: &dyn Configured) -> Product {
    let names = request.inputs.iter().map(|input| input.port.as_str()).collect::<Vec<_>>();
    let type_of = |port: &str| {
        let at = request.inputs.iter().find(|input| input.port == port)?;
        at.items.first().map(|item| forever(&item.type_name))
    };
    let ports = kind.ports_named(&names);
    let types = ports.iter().filter_map(|port| Some((port.name.as_str(), type_of(&port.name)?)));
    configured.product(&types.collect::<Vec<_>>())
}

fn context<'c>(
    folder: &Path,
    scratch: &Path,
    request: &ItemRequest,
    kind: &dyn ErasedKind,
    sent: &'c SentFiles,
) -> Context<'c> {
    let root = folder.join(FILES);
    let mut context = Context::new(sent)
        .with_folder(root.clone())
        .with_out(root.join(&request.out))
        .with_scratch(scratch.to_path_buf());
    for input in &request.inputs {
        let handles = input.items.iter().map(|item| {
            let (place, digest) = (folder.join(artifact_place(item.digest)), item.digest);
            let load = move || match read_file(&place) {
                Ok(bytes) if Digest::of(&bytes) == digest => Ok(bytes),
                Ok(_) => {
                    Err(Failure::new(format!("the artifact {digest} has different bytes")).system_error())
                }
                Err(error) => {
                    let failure = Failure::from(error);
                    Err(failure.context(format!("cannot read the artifact {digest}")).system_error())
                }
            };
            (item.key.clone(), Arc::new(Handle::new(forever(&item.type_name), digest, load)))
        });
        context = context.with_input(&input.port, handles.collect());
    }
    if let Some(source) = &request.source {
        context = context.with_source(root.join(source));
    }
    if let (Some(key), true) = (&request.key, kind.shows_keys()) {
        context = context.with_key(key.clone());
    }
    if let Some(recipe) = &request.recipe {
        context = context.with_recipe(recipe.clone());
    }
    context
}

fn store(folder: &Path, output: &Output) -> Result<Vec<Blob>, Error> {
    let write = |(index, bytes): (usize, &[u8])| {
        write(&folder.join(output_place(index)), bytes)?;
        Ok(Blob { digest: Digest::of(bytes), bytes: bytes.len() as u64 })
    };
    output.stored().into_iter().enumerate().map(write).collect()
}

fn write(place: &Path, bytes: &[u8]) -> Result<(), Error> {
    let made = fs::create_dir_all(place.parent().unwrap_or(Path::new(".")));
    made.and_then(|()| fs::write(place, bytes)).map_err(|error| Error::io(&error, "write", place))
}

/// A failure with the names that files have at home.
fn at_home(failure: Failure, root: &Path) -> Failure {
    Failure {
        chain: failure.chain.iter().map(|text| without(text, root)).collect(),
        help: failure.help.map(|text| without(&text, root)),
        ..failure
    }
}

/// A text without the folder of this run.
fn without(text: &str, root: &Path) -> String {
    let root = path_text(root);
    text.replace(&format!("{root}{}", std::path::MAIN_SEPARATOR), "").replace(&root, ".")
}

/// The files that were sent, under the names that they have at home.
struct SentFiles {
    root: PathBuf,
    /// The place of each file here; `None` if there is none of this name at home.
    files: BTreeMap<String, Option<PathBuf>>,
    folders: BTreeMap<String, Option<Vec<(String, bool)>>>,
    programs: Vec<PathBuf>,
    /// The places that were read and are not here, in order.
    missing: Mutex<Vec<(String, ReadKind)>>,
}

impl SentFiles {
    fn new(folder: &Path, request: &ItemRequest) -> Self {
        let place = |name: &str| folder.join(file_place(name));
        let files = request.files.iter();
        let files = files.map(|file| (file.name.clone(), file.digest.map(|_| place(&file.name))));
        let folders = request.folders.iter().map(|folder| (folder.name.clone(), folder.entries.clone()));
        Self {
            root: folder.join(FILES),
            files: files.collect(),
            folders: folders.collect(),
            programs: std::env::var_os("PATH")
                .map_or_else(Vec::new, |path| std::env::split_paths(&path).collect()),
            missing: Mutex::default(),
        }
    }

    /// The name that a path has at home.
    fn name(&self, path: &Path) -> String {
        path_name(&self.root, path)
    }

    fn is_program(&self, path: &Path) -> bool {
        is_in_one_of(path, &self.programs)
    }

    fn is_missing(&self, name: String, kind: ReadKind) -> io::Error {
        let text = format!("{name} was not sent with the item");
        let mut missing = self.missing.lock();
        if !missing.contains(&(name.clone(), kind)) {
            missing.push((name, kind));
        }
        io::Error::new(io::ErrorKind::NotFound, text)
    }
}

impl Files for SentFiles {
    fn read(&self, path: &Path) -> io::Result<Arc<Vec<u8>>> {
        let name = self.name(path);
        match self.files.get(&name).or_else(|| self.files.get(&self.name(&normal(path)))) {
            Some(Some(place)) => read_file(place).map(Arc::new),
            Some(None) => Err(io::ErrorKind::NotFound.into()),
            None if self.is_program(path) => read_file(path).map(Arc::new),
            None => Err(self.is_missing(name, ReadKind::Content)),
        }
    }

    fn list(&self, path: &Path) -> io::Result<Vec<(String, bool)>> {
        let name = self.name(path);
        match self.folders.get(&name) {
            Some(Some(entries)) => Ok(entries.clone()),
            Some(None) => Err(io::ErrorKind::NotFound.into()),
            None => Err(self.is_missing(name, ReadKind::Names)),
        }
    }

    fn is_folder(&self, path: &Path) -> bool {
        let name = self.name(path);
        match self.folders.get(&name) {
            Some(entries) => entries.is_some(),
            None => {
                let _ = self.is_missing(name, ReadKind::Names);
                false
            }
        }
    }
}
