//! Runs an item on another machine: sends what it needs, and concludes the run as if it had been here.
//!
//! Nothing of it is here that is not needed here: input artifacts that the server has are named, not sent,
//! and outputs stay there until something reads them.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::sync::Arc;

use parking_lot::Mutex;

use super::item_request::{
    FORMAT, ITEM, InputArtifact, ItemEnd, ItemReport, ItemRequest, KnownFile, KnownFolder, PortInputs,
    REPORT, artifact_place, file_place, output_place,
};
use super::outcome::{Outcome, Ran, Refusal};
use super::publish::PublishError;
use super::run::{RunContext, RunRequest};
use super::running::Dependencies;
use super::shared_results::{MOST_READS, SharedBlobs, is_in_one_of, may_ask_for};
use crate::error::Error;
use crate::key::{Digest, ItemKey};
use crate::kinds::{Failure, Product};
use crate::plan::ItemIndex;
use crate::shared::{
    ExecutorOptions, InputFile, Place, RemoteEnd, RemoteError, RemoteRun, Shared, SharedBlob,
};
use crate::storage::{
    Blob, FileRead, Read, ReadKind, digest_now, leads_to, lies_in, list, listing_digest, modified, normal,
    path_name, read_file, recipe,
};
use crate::timestamp::Timestamp;

/// An item is sent at most so many times, each time with the files that it named the time before.
const ROUNDS: usize = 16;

/// The origin of the content of a file of the other machine's folder.
enum ContentOrigin {
    Bytes(Vec<u8>),
    Artifact(Digest),
    File(String, Digest),
}

/// The names that an item may read, and what is asked of each.
type ReadableNames = BTreeSet<(String, ReadKind)>;

impl RunContext<'_> {
    /// Why an item does not run elsewhere; `None` if it may.
    pub(crate) fn why_here(&self, item: ItemIndex, options: &ExecutorOptions) -> Option<String> {
        let stage = &self.check.plan.stages[self.check.plan.items[item].stage];
        if stage.configured.properties().is_none() {
            return Some(format!("{} runs only on the machine of the build", stage.kind.name()));
        }
        let names = self.names(item);
        let size = |(name, kind): &(String, ReadKind)| match kind {
            ReadKind::Content => fs::metadata(self.check.folder.join(name)).ok().map(|found| found.len()),
            ReadKind::Names | ReadKind::Lookup => None,
        };
        let bytes = names.iter().filter_map(size).sum::<u64>();
        (bytes > options.most_bytes).then(|| too_large(bytes, options))
    }

    /// Runs an item elsewhere.
    ///
    /// # Errors
    /// If the journal cannot be written.
    pub(crate) fn run_elsewhere(
        &self,
        request: RunRequest,
        options: &ExecutorOptions,
    ) -> Result<Outcome, Error> {
        let here = |because: &str| Ok(Outcome::Refused(Refusal::of_item(because)));
        let unable = |because: String| Ok(Outcome::Refused(Refusal::by_fault(because)));
        let Some(blobs) = self.shared_blobs else { return here("there is no cache") };
        let (item, started) = (request.item, Timestamp::now());
        let host = options.executor.host();
        let mut names = self.names(item);
        // What the server has of an earlier run does not count if the item is forced.
        let mut is_fresh = self.check.is_forced(item);
        for _ in 0..ROUNDS {
            let sent = self.item_request(&request, &names);
            let reads = sent.reads();
            self.depends_on(item, &reads);
            let end = match self.send(&sent, item, options, blobs, is_fresh) {
                Err(RemoteError::Stopped) => return Ok(Outcome::Stopped),
                Err(RemoteError::InputGone(_)) => return here("an input is gone"),
                Err(RemoteError::TooLarge(why)) => return here(&why),
                Err(RemoteError::Impossible(why)) => return unable(why),
                Ok(end) => end,
            };
            let report = end.outputs.first().copied().flatten().and_then(|blob| blobs.bytes(blob));
            let report = report.and_then(|bytes| serde_json::from_slice::<ItemReport>(&bytes).ok());
            let Some(report) = report else {
                // The machine may have been lost; what is known of that is not asked for again.
                if is_fresh {
                    return unable(no_report(&end, &host));
                }
                is_fresh = true;
                continue;
            };
            match &report.end {
                ItemEnd::Needs(needs) => {
                    let source = self.check.source(item);
                    let programs = self.shared.map_or(&[][..], |shared| &shared.programs);
                    let is_fine =
                        |(name, _): &(String, ReadKind)| may_ask_for(name, source.as_deref(), programs);
                    let before = names.len();
                    names.extend(needs.iter().filter(|need| is_fine(need)).cloned());
                    if names.len() == before {
                        return here("it reads files outside the project");
                    }
                    if names.len() > MOST_READS {
                        return here("it reads too many files");
                    }
                }
                // What is known of a failure may have been the fault of the machine that ran it.
                ItemEnd::Failed { .. } if end.is_known && !is_fresh => is_fresh = true,
                ItemEnd::Failed { system_error: true, chain, .. } => return unable(chain.join(": ")),
                ItemEnd::Made(_) | ItemEnd::Failed { .. } => {
                    let digests = reads.into_iter().map(|(name, kind, digest)| ((name, kind), digest));
                    let digests = digests.collect::<BTreeMap<_, _>>();
                    let is_same = |read: &FileRead| match digests.get(&(read.path.clone(), read.kind)) {
                        Some(sent) => *sent == read.digest,
                        // A program of that machine.
                        None => self.check.current_digest(&read.path, read.kind) == read.digest,
                    };
                    if let Some(other) = report.reads.iter().find(|read| !is_same(read)) {
                        return here(&format!("{} is another file there", other.path));
                    }
                    return self.conclude_elsewhere(request, report, end, started, &host, blobs);
                }
            }
        }
        here("it asked for one more file too often")
    }

    /// Says what the item depends on, so that a change of it makes the run stale.
    fn depends_on(&self, item: ItemIndex, reads: &[(String, ReadKind, Option<Digest>)]) {
        let read = |(name, kind, digest): &(String, ReadKind, Option<Digest>)| {
            Read::of(self.check.folder.join(name), *kind, *digest)
        };
        let reads = reads.iter().map(read).collect::<Vec<_>>();
        self.disk.add_reads(reads.iter().map(|read| (read.path.clone(), read.kind)));
        self.running.set_dependencies(item, Dependencies::Running(Arc::new(Mutex::new(reads))));
    }

    fn conclude_elsewhere(
        &self,
        request: RunRequest,
        report: ItemReport,
        end: RemoteEnd,
        started: Timestamp,
        host: &str,
        blobs: &SharedBlobs,
    ) -> Result<Outcome, Error> {
        let outputs_expected = self.check.plan.items[request.item].files.len().max(1);
        let named = end.outputs[1..].iter().copied().collect::<Option<Vec<_>>>();
        let machine = if end.worker.is_empty() { "a worker".to_owned() } else { end.worker };
        let unable = |because: String| Ok(Outcome::Refused(Refusal::by_fault(because)));
        let (outputs, shared) = match report.end {
            ItemEnd::Needs(_) => return Ok(Outcome::Stopped),
            ItemEnd::Failed { .. } if self.has_changed(&report.reads) => return Ok(Outcome::Stopped),
            ItemEnd::Failed { chain, help, .. } => {
                let failure = Failure { chain, help, cancelled: false, system_error: false };
                (Err(failure.context(format!("on {machine} of {host}"))), None)
            }
            ItemEnd::Made(outputs) => {
                let fits = |named: &Vec<SharedBlob>| {
                    outputs.len() == outputs_expected
                        && named.len() == outputs.len()
                        && outputs.iter().zip(named).all(|(output, blob)| output.bytes == blob.bytes)
                };
                let Some(named) = named.filter(fits) else {
                    return unable(format!("{host} does not have the result"));
                };
                outputs.iter().zip(&named).for_each(|(output, blob)| {
                    blobs.name_of(output.digest, || Some(*blob));
                });
                (Ok(outputs), Some(Shared { host: host.into(), machine: machine.clone(), blobs: named }))
            }
        };
        let is_needed = {
            let stage = &self.check.plan.stages[self.check.plan.items[request.item].stage];
            // The files that are published next: together, because each alone would take a call.
            matches!(stage.product, Product::Files(_))
                || self.shared.is_some_and(|shared| shared.download_all)
        };
        if let (Ok(outputs), true) = (&outputs, is_needed) {
            let lacks = |output: &&Blob| !self.check.state.store.has(output);
            let digests = outputs.iter().filter(lacks).map(|output| output.digest).collect::<Vec<_>>();
            blobs.receive(&self.check.state.store, &digests, &|| self.cancel.is_cancelled());
        }
        let dated = |read: FileRead| FileRead {
            modified: modified(&self.check.folder.join(&read.path)).filter(|_| read.kind != ReadKind::Names),
            ..read
        };
        let ran = Ran {
            outputs,
            reads: report.reads.into_iter().map(dated).collect(),
            milliseconds: report.milliseconds,
            warnings: report.warnings,
            notes: report.notes,
            place: Some(Place::Worker { host: host.into(), name: machine }),
            shared,
            ..Ran::without_result(started)
        };
        match self.conclude(request, ran)? {
            Outcome::Made { unpublished: Some(PublishError::ResultLost), .. } => {
                unable(format!("{host} has lost the result"))
            }
            outcome => Ok(outcome),
        }
    }

    /// Whether a watcher will build again, because one of these files has changed since it was sent.
    fn has_changed(&self, reads: &[FileRead]) -> bool {
        let is_other =
            |read: &FileRead| digest_now(&self.check.folder.join(&read.path), read.kind) != read.digest;
        self.watched.is_some() && reads.iter().any(is_other)
    }

    /// The names that an item is expected to read: its source, and what its last run read.
    fn names(&self, item: ItemIndex) -> ReadableNames {
        let expected = self.check.expected_reads(item).into_iter().map(|(name, kind, _)| (name, kind));
        let mut names = expected.collect::<ReadableNames>();
        let stage = &self.check.plan.stages[self.check.plan.items[item].stage];
        // A worker cannot tell a word from the name of a file that is only here.
        for named in stage.configured.named_paths().into_iter().filter(|named| named.path.is_relative()) {
            let path = self.check.folder.join(&named.path);
            if lies_in(&self.check.plan.out, &path, leads_to) {
                continue;
            }
            let kind = match fs::metadata(&path) {
                Ok(found) if found.is_dir() => ReadKind::Names,
                Ok(_) => ReadKind::Content,
                Err(_) => continue,
            };
            names.insert((path_name(self.check.folder, &normal(&path)), kind));
        }
        let programs = self.shared.map_or(&[][..], |shared| &shared.programs);
        if let Some(latest) = self.check.latest(item) {
            let read = latest.reads().filter(|(name, ..)| !is_in_one_of(Path::new(name), programs));
            names.extend(read.map(|(name, kind, _)| (name.to_owned(), kind)));
        }
        names
    }

    fn item_request(&self, request: &RunRequest, names: &ReadableNames) -> ItemRequest {
        let item = &self.check.plan.items[request.item];
        let stage = &self.check.plan.stages[item.stage];
        let info = &self.check.stages[item.stage];
        let mut digests = request.inputs.iter().map(|used| used.digest);
        let inputs = stage.inputs.iter().zip(&item.inputs).map(|((port, _), made)| PortInputs {
            port: port.clone(),
            items: made
                .iter()
                .zip(&mut digests)
                .map(|(from, digest)| {
                    let from = &self.check.plan.items[*from];
                    InputArtifact {
                        key: if info.shows_keys { from.key.clone() } else { ItemKey::default() },
                        type_name: self.check.plan.stages[from.stage].product.type_name().into(),
                        digest,
                    }
                })
                .collect(),
        });
        let inputs = inputs.collect();
        let path = |name: &str| self.check.folder.join(name);
        // Look-ups are not sent: a worker finds its own programs, and its report says which.
        let asked = |asked: ReadKind| names.iter().filter(move |(_, kind)| *kind == asked);
        let files = asked(ReadKind::Content).map(|(name, kind)| KnownFile {
            name: name.clone(),
            digest: self.check.current_digest(name, *kind),
        });
        let folders = asked(ReadKind::Names)
            .map(|(name, _)| KnownFolder { name: name.clone(), entries: list(&path(name)).ok() });
        let is_many = |port: &str| info.many.contains(port);
        let kind = stage.kind.name();
        ItemRequest {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").into(),
            kind: kind.into(),
            revision: info.revision,
            parameters: stage.parameters.text(),
            canonical: info.parameters.clone(),
            inputs,
            key: info.shows_keys.then(|| item.key.clone()),
            source: self.check.source(request.item),
            out: path_name(self.check.folder, &self.check.plan.out),
            processor: info.processor.map(str::to_owned),
            recipe: matches!(stage.product, Product::Files(_))
                .then(|| recipe(kind, info.revision, &info.parameters, &request.inputs, is_many)),
            files: files.collect(),
            folders: folders.collect(),
        }
    }

    /// Sends an item with everything that it needs, and waits for its end.
    fn send(
        &self,
        sent: &ItemRequest,
        item: ItemIndex,
        options: &ExecutorOptions,
        blobs: &SharedBlobs,
        is_fresh: bool,
    ) -> Result<RemoteEnd, RemoteError> {
        let store = &self.check.state.store;
        let text = serde_json::to_vec(sent).unwrap_or_default();
        let mut contents = vec![(ITEM.to_owned(), ContentOrigin::Bytes(text))];
        let digests = sent.inputs.iter().flat_map(|input| &input.items).map(|made| made.digest);
        let digests = digests.collect::<BTreeSet<_>>();
        contents.extend(
            digests.into_iter().map(|digest| (artifact_place(digest), ContentOrigin::Artifact(digest))),
        );
        let mut places = BTreeSet::new();
        for file in &sent.files {
            let place = file_place(&file.name);
            if let (Some(digest), true) = (file.digest, places.insert(place.clone())) {
                contents.push((place, ContentOrigin::File(file.name.clone(), digest)));
            }
        }
        let read = |index: usize| match &contents[index].1 {
            ContentOrigin::Bytes(bytes) => Some(bytes.clone()),
            ContentOrigin::Artifact(digest) => store.get(*digest).ok().flatten(),
            ContentOrigin::File(name, digest) => {
                let bytes = read_file(&self.check.folder.join(name)).ok();
                bytes.filter(|bytes| Digest::of(bytes) == *digest)
            }
        };
        let executor = &options.executor;
        let mut files = Vec::with_capacity(contents.len());
        let mut bytes = 0;
        for (index, (path, content)) in contents.iter().enumerate() {
            let hash = || read(index).map(|bytes| executor.blob(&bytes));
            let (blob, is_program) = match content {
                ContentOrigin::Bytes(bytes) => (Some(executor.blob(bytes)), false),
                ContentOrigin::Artifact(digest) => (blobs.name_of(*digest, hash), false),
                ContentOrigin::File(name, digest) => {
                    let blob = blobs.name_of(*digest, hash);
                    bytes += blob.map_or(0, |blob| blob.bytes);
                    (blob, is_program(&self.check.folder.join(name)))
                }
            };
            let blob = blob.ok_or(RemoteError::InputGone(index))?;
            files.push(InputFile { path: path.clone(), blob, is_program });
        }
        if bytes > options.most_bytes {
            return Err(RemoteError::TooLarge(too_large(bytes, options)));
        }
        let stage = &self.check.plan.stages[self.check.plan.items[item].stage];
        let outputs = self.check.plan.items[item].files.len().max(1);
        let run = RemoteRun {
            arguments: vec!["run-item".into(), ITEM.into()],
            files,
            read: &read,
            outputs: [REPORT.to_owned()].into_iter().chain((0..outputs).map(output_place)).collect(),
            properties: stage.configured.properties().unwrap_or_default(),
            is_fresh,
        };
        let flag = self.running.stale_flag(item);
        executor.run(&run, &|| self.cancel.is_cancelled() || flag.is_set())
    }
}

impl ItemRequest {
    /// The files and folders that were sent, as records have them.
    fn reads(&self) -> Vec<(String, ReadKind, Option<Digest>)> {
        let files = self.files.iter().map(|file| (file.name.clone(), ReadKind::Content, file.digest));
        let folders = self.folders.iter().map(|folder| {
            let digest = folder.entries.as_ref().map(|entries| listing_digest(entries));
            (folder.name.clone(), ReadKind::Names, digest)
        });
        files.chain(folders).collect()
    }
}

fn too_large(bytes: u64, options: &ExecutorOptions) -> String {
    let mega = |bytes: u64| bytes.div_ceil(1 << 20);
    format!("it reads {} MiB of files, but at most {} are sent", mega(bytes), mega(options.most_bytes))
}

fn no_report(end: &RemoteEnd, host: &str) -> String {
    let machine = if end.worker.is_empty() { "a worker" } else { &end.worker };
    let said = if end.message.is_empty() { String::new() } else { format!(": {}", end.message.trim()) };
    format!("specula did not run on {machine} of {host}, exit code {}{said}", end.exit_code)
}

#[cfg(unix)]
fn is_program(file: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt as _;
    fs::metadata(file).is_ok_and(|found| found.permissions().mode() & 0o111 != 0)
}

#[cfg(not(unix))]
fn is_program(_: &Path) -> bool {
    true
}
