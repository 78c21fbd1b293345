//! What a build does, according to its events.

mod artifacts;
mod cache;
mod changed;
mod determinism;
mod elsewhere;
mod explanations;
mod exported_files;
mod failures;
mod forced;
mod hostile;
mod interruptions;
mod outdated;
mod progress;
mod publishing;
mod rebuilds;
mod renamed;
mod shared;
mod snapshot;
mod sources;
#[cfg(unix)]
mod unseen;
mod watch;

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use parking_lot::Mutex;

use crate::answers::Explanation;
use crate::build::{BuildOptions, BuildSession};
use crate::cancel::Cancel;
use crate::error::Error;
use crate::event::{Event, Reason, Summary};
use crate::kinds::{Artifact as _, Context, Failure, Kind, Kinds, Output, Port, Product};
use crate::manifest::Parameters;
use crate::plan::Plan;
use crate::platform::{self, canonicalize, path_text};
use crate::testkit::{Nothing, Text, kinds};

/// A program that PATH finds.
const PROGRAM: &str = if cfg!(windows) { "cmd" } else { "cargo" };

/// Exports every text in capitals.
const CHAIN: &str = r#"
schema = 1
out = "out"
[stage]
text = { kind = "text-source", source = "*.txt" }
loud = { kind = "upper", input = "text" }
file = { kind = "write", input = "loud" }
"#;

/// Exports every text of `in` in capitals, under its name.
const CAPITALS: &str = r#"
schema = 1
[stage]
text = { kind = "text-source", source = "in/*.txt" }
upper = { kind = "upper", input = "text" }
write = { kind = "write", input = "upper", path = "{text}" }
"#;

/// A kind that makes a text of a text: of its source if it has one, otherwise of its input.
#[allow(unreachable_pub, reason = "`Kind`, which all of them are, is public")]
pub trait TextKind: Send + Sync + 'static {
    type Parameters: Parameters;
    const NAME: &'static str;
    const REVISION: u32 = 1;
    const SOURCE: bool = false;

    fn make(parameters: &Self::Parameters, text: &str, context: &Context<'_>) -> Result<String, Failure>;
}

impl<K: TextKind> Kind for K {
    type Parameters = K::Parameters;
    const NAME: &'static str = K::NAME;
    const REVISION: u32 = K::REVISION;
    const TEXT: &'static str = "//! Makes a text.\n";
    const SOURCE: bool = K::SOURCE;

    fn ports() -> Vec<Port> {
        if K::SOURCE { Vec::new() } else { vec![Port::one::<Text>("text")] }
    }

    fn product(_: &K::Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Text::TYPE)
    }

    fn run(parameters: &K::Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let made = if K::SOURCE {
            let bytes = context.files.read(context.files.source()?)?.to_vec();
            K::make(parameters, &String::from_utf8(bytes)?, context)
        } else {
            K::make(parameters, &context.inputs.get::<Text>("text")?.0, context)
        };
        Output::artifact(Text(made?))
    }
}

/// The kinds of the tests, with one in place of that of its name.
fn replacing<K: Kind>(kind: K) -> Kinds {
    let kinds = kinds();
    let others = kinds.iter().filter(|other| other.name() != K::NAME).cloned();
    others.fold(Kinds::new(), Kinds::with_erased).with(kind)
}

/// Asserts that a text contains each of these parts.
#[track_caller]
fn assert_has<const N: usize>(text: impl AsRef<str>, parts: [&str; N]) {
    let text = text.as_ref();
    parts.iter().for_each(|part| assert!(text.contains(part), "no {part:?} in {text}"));
}

/// A project of two texts, which is not built yet.
fn two_texts(manifest: &str) -> Project {
    let project = Project::new(manifest);
    project.write("a.txt", "one");
    project.write("b.txt", "two");
    project
}

/// A project in a folder of its own.
struct Project {
    /// Removed at the end, if the project has one of its own.
    _temporary: Option<tempfile::TempDir>,
    folder: PathBuf,
    kinds: Kinds,
    options: BuildOptions,
    cancel: Cancel,
}

/// Removes a folder. That of std does not end if a folder in it is watched in Wine, which goes on to list it.
fn remove_tree(folder: &Path) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            remove_tree(&entry.path())
        } else {
            std::fs::remove_file(entry.path())
        }?;
    }
    std::fs::remove_dir(folder)
}

impl Project {
    fn new(manifest: &str) -> Self {
        let temporary = tempfile::tempdir().unwrap();
        let folder = canonicalize(temporary.path()).unwrap();
        let project = Self { _temporary: Some(temporary), ..Self::at(folder) };
        project.write("pipeline.toml", manifest);
        project
    }

    /// A project in a folder that may not exist yet.
    fn at(folder: PathBuf) -> Self {
        let options = BuildOptions { jobs: Some(1), keep_going: true, ..BuildOptions::default() };
        Self { _temporary: None, folder, kinds: kinds(), options, cancel: Cancel::default() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// A path as [`log`] shows it.
    fn unix_path(&self, name: &str) -> String {
        test_data::unix_paths(path_text(self.path(name)))
    }

    fn write(&self, name: &str, text: &str) {
        let (path, deadline) = (self.path(name), Instant::now() + Duration::from_secs(5));
        let write =
            || std::fs::create_dir_all(path.parent().unwrap()).and_then(|()| std::fs::write(&path, text));
        // On Windows a folder that was removed stays for as long as it is watched.
        while let Err(error) = write() {
            assert!(cfg!(windows) && Instant::now() < deadline, "{}: {error}", path.display());
        }
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    fn exists(&self, name: &str) -> bool {
        self.path(name).exists()
    }

    fn remove(&self, name: &str) {
        assert!(self.removes(name), "{name} stays");
    }

    /// Removes a file or folder. Some systems do not remove a folder that is watched.
    fn removes(&self, name: &str) -> bool {
        let (path, deadline) = (self.path(name), Instant::now() + Duration::from_secs(5));
        if !path.is_dir() {
            platform::remove(&path).unwrap();
            return true;
        }
        // A watcher puts back what has gone, and on Windows what is open stays for a moment.
        while remove_tree(&path).is_err() {
            if cfg!(unix) || Instant::now() > deadline {
                return false;
            }
        }
        true
    }

    fn rename(&self, from: &str, to: &str) {
        // On Windows a build that reads the file is in the way for a moment.
        platform::replace(&self.path(from), &self.path(to)).unwrap();
    }

    #[cfg(unix)]
    fn remove_link(&self, name: &str) {
        std::fs::remove_file(self.path(name)).unwrap();
    }

    /// Changes the manifest.
    fn edit(&self, old: &str, new: &str) {
        let text = self.read("pipeline.toml");
        assert!(text.contains(old), "{old:?} is not in the manifest");
        self.write("pipeline.toml", &text.replace(old, new));
    }

    fn plan(&self) -> Plan {
        Plan::load(&self.path("pipeline.toml"), &self.kinds).unwrap()
    }

    fn try_build(&self) -> (Vec<Event>, Result<Summary, Error>) {
        self.try_build_of(&self.plan(), &self.options)
    }

    fn try_build_of(&self, plan: &Plan, options: &BuildOptions) -> (Vec<Event>, Result<Summary, Error>) {
        let events = Mutex::new(Vec::new());
        let summary = crate::build::build(plan, options, &self.cancel, &|event| events.lock().push(event));
        (events.into_inner(), summary)
    }

    /// The events and the summary of a dry run.
    fn rehearse(&self) -> (Vec<Event>, Summary) {
        let options = BuildOptions { dry_run: true, ..self.options.clone() };
        let (events, summary) = self.try_build_of(&self.plan(), &options);
        (events, summary.unwrap())
    }

    /// Builds, and returns the events as lines.
    fn build(&self) -> String {
        let (events, summary) = self.try_build();
        summary.unwrap();
        log(&events)
    }

    /// Builds by a session that may have built before, and returns the events as lines.
    fn build_on(&self, session: &BuildSession) -> String {
        self.build_of(session, &self.plan(), &self.options)
    }

    fn build_of(&self, session: &BuildSession, plan: &Plan, options: &BuildOptions) -> String {
        let events = Mutex::new(Vec::new());
        session.build(plan, options, &self.cancel, &|event| events.lock().push(event)).unwrap();
        log(&events.into_inner())
    }

    fn explain(&self, target: &str) -> Vec<Explanation> {
        crate::answers::explain(&self.plan(), target).unwrap()
    }

    /// Every file under a folder with its content, sorted.
    fn files(&self, folder: &str) -> Vec<(String, Vec<u8>)> {
        let mut found = Vec::new();
        collect(&self.path(folder), "", &mut found);
        found.sort();
        found
    }

    /// The stored blob that has some content.
    fn blob(&self, content: &str) -> PathBuf {
        let name = crate::Digest::of(content.as_bytes()).to_string();
        self.path(".specula/blobs").join(&name[..2]).join(&name[2..])
    }
}

fn collect(folder: &Path, prefix: &str, found: &mut Vec<(String, Vec<u8>)>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            collect(&entry.path(), &format!("{name}/"), found);
        } else if let Ok(bytes) = std::fs::read(entry.path()) {
            // A file that disappears meanwhile is left out: a watcher may be running.
            found.push((name, bytes));
        }
    }
}

/// Events as lines, without times and with shortened digests.
fn log(events: &[Event]) -> String {
    let mut text = String::new();
    for event in events {
        let _ = match event {
            Event::Planned { stages, items, .. } => writeln!(text, "planned {stages} stages, {items} items"),
            Event::ManifestWarnings { diagnostics } => writeln!(text, "warnings: {diagnostics}"),
            Event::Waiting { holder, .. } => writeln!(text, "waiting for {holder}"),
            Event::UpToDate { item, host: None } => writeln!(text, "up to date {item}"),
            Event::UpToDate { item, host: Some(host) } => writeln!(text, "from {host} {item}"),
            Event::SharedCache { host, message } => writeln!(text, "trouble at {host}: {message}"),
            Event::Started { item, reasons, host } => {
                let reasons = reasons.iter().map(reason).collect::<Vec<_>>();
                let place = host.as_ref().map_or_else(String::new, |host| format!(" at {host}"));
                writeln!(text, "run {item}{place}: {}", reasons.join("; "))
            }
            Event::TaskTimed { .. } | Event::Progress { .. } => Ok(()),
            Event::Warning { item, message } => writeln!(text, "warning {item}: {message}"),
            Event::Note { item, message } => writeln!(text, "note {item}: {message}"),
            Event::Finished { item, changed, .. } => {
                writeln!(text, "ran {item}{}", if *changed { "" } else { ", the same result" })
            }
            Event::Failed { item, error, help } => {
                let help = help.as_ref().map_or_else(String::new, |help| format!(" ({help})"));
                writeln!(text, "FAILED {item}: {}{help}", error.join(": "))
            }
            Event::Skipped { item, because } => match because {
                Some(because) => writeln!(text, "skipped {item} because of {because}"),
                None => writeln!(text, "skipped {item}"),
            },
            Event::Published { file, bytes, restored, .. } => {
                writeln!(text, "{} {file} {bytes}", if *restored { "restored" } else { "published" })
            }
            Event::Removed { file, .. } => writeln!(text, "removed {file}"),
            Event::Leftovers { folder, files, published_by, .. } => {
                writeln!(text, "left over in {folder}: {files} of {}", published_by.join(", "))
            }
            Event::Watching { .. } => writeln!(text, "watching"),
            Event::Noticed { changes, .. } => {
                let paths = changes.iter().map(|change| format!("{} {:?}", change.path, change.what));
                writeln!(text, "noticed {}", paths.collect::<Vec<_>>().join(", "))
            }
            Event::Rejected { diagnostics } => writeln!(text, "rejected: {diagnostics}"),
            Event::RebuildLoop { item, files } => writeln!(text, "loop {item}: {}", files.join(", ")),
            Event::Accepted => writeln!(text, "accepted"),
            Event::BuildError { error, .. } => writeln!(text, "build error: {}", error.join(": ")),
            Event::Ended(Summary {
                ran, up_to_date, failed, skipped, published, removed, cancelled, ..
            }) => {
                let cancelled = if *cancelled { ", cancelled" } else { "" };
                writeln!(
                    text,
                    "ended: {ran} ran, {up_to_date} up to date, {failed} failed, {skipped} skipped, \
                     {published} published, {removed} removed{cancelled}"
                )
            }
        };
    }
    test_data::unix_paths(text)
}

fn reason(reason: &Reason) -> String {
    let known = |digest: &Option<crate::key::Digest>| if digest.is_some() { "some" } else { "none" };
    match reason {
        Reason::NeverBuilt => "never built".into(),
        Reason::FailedBefore => "failed before".into(),
        Reason::Parameter { name, old, new } => format!("{name} {old} -> {new}"),
        Reason::Input { port, item, old, new } => {
            format!("{port} {item} {} -> {}", known(old), known(new))
        }
        Reason::Awaits { port, item } => format!("{port} after {item}"),
        Reason::File { path, old, new, .. } => format!("file {path} {} -> {}", known(old), known(new)),
        Reason::Program { name, old, new } => format!("PATH: {name} {old:?} -> {new:?}"),
        Reason::Kind { old, new } => format!("kind {old} -> {new}"),
        Reason::ResultLost => "result lost".into(),
        Reason::Returned => "returned".into(),
        Reason::Forced => "forced".into(),
    }
}
