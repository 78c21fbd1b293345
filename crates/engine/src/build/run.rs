//! One run of one item: its context, and what is stored and recorded of what it gave.

use std::any::Any;
use std::collections::HashMap;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;

use super::outcome::{Outcome, Ran};
use super::publish::{PublishError, PublishEvent, Publisher};
use super::running::{Dependencies, RunningBuild};
use super::session::WatchedChanges;
use super::shared_results::{Description, NamedFiles, ResultDescription, SharedBlobs, action, list};
use super::up_to_date::UpToDateCheck;
use crate::cancel::Cancel;
use crate::error::{Error, ErrorKind};
use crate::event::Reason;
use crate::key::{Digest, ItemKey};
use crate::kinds::{
    Artifact, Context, DerivedValues, ExportedFiles, Failure, Gate, Handle, KeyedHandles, Output, Product,
    ShareDone, WHEN_WRITTEN,
};
use crate::own_time::own_time;
use crate::plan::{ItemIndex, Wanted};
use crate::platform::{Stamp, path_text};
use crate::shared::{Place, SharedCacheOptions, Upload, UploadOutputs};
use crate::storage::{
    Blob, Cause, Disk, FileRead, InputUsed, Line, Memory, Read, ReadKind, Reader, Record, Tag, path_name,
    recipe, short, worth_keeping,
};
use crate::timestamp::Timestamp;

/// The context that all running items share.
pub(crate) struct RunContext<'a> {
    pub(crate) check: &'a UpToDateCheck<'a>,
    pub(crate) disk: &'a Disk,
    pub(crate) publisher: &'a Publisher<'a>,
    pub(crate) cancel: &'a Cancel,
    pub(crate) memory: &'a Memory,
    pub(crate) derived: &'a Memory,
    pub(crate) running: &'a Arc<RunningBuild>,
    /// What a watcher knows of files that programs write, if there is a watcher.
    pub(crate) watched: Option<&'a WatchedChanges>,
    /// The items that go first.
    pub(crate) wanted: &'a Wanted,
    /// Where items pause while wanted ones run.
    pub(crate) gate: Arc<Gate>,
    /// Whether the warnings of results that are up to date are reported again.
    pub(crate) repeat_warnings: bool,
    pub(crate) keep_scratch: bool,
    /// The shared cache where results are also stored, and found.
    pub(crate) shared: Option<&'a SharedCacheOptions>,
    /// What is known of the shared cache's blobs.
    pub(crate) shared_blobs: Option<&'a SharedBlobs>,
}

pub(crate) struct RunRequest {
    pub(crate) item: ItemIndex,
    pub(crate) key: Digest,
    pub(crate) inputs: Vec<InputUsed>,
    pub(crate) handles: Vec<(String, KeyedHandles)>,
    pub(crate) reasons: Vec<Reason>,
    pub(crate) causes: Vec<Cause>,
    /// Whether somebody looks at the item.
    pub(crate) is_wanted: bool,
    /// Why it runs here, if other items run elsewhere.
    pub(crate) why_here: Option<String>,
    /// The share of the item's work that is done.
    pub(crate) share: Arc<ShareDone>,
}

/// An item runs at most this many times if the files that it reads keep changing.
const ATTEMPTS: usize = 3;

impl RunContext<'_> {
    /// Runs an item here, stores and records its outputs, and publishes its files.
    ///
    /// # Errors
    /// If the journal cannot be written, so that nothing can be recorded.
    pub(crate) fn run(&self, request: RunRequest) -> Result<Outcome, Error> {
        let started = Timestamp::now();
        let (mut attempts, mut milliseconds) = (0, 0.0);
        let ran = loop {
            attempts += 1;
            let reader = self.disk.reader();
            let ((context, output), time) = own_time(|| {
                let context = self.context(&request, &reader);
                let output = self.call(request.item, &context);
                (context, output)
            });
            milliseconds += time.as_secs_f64() * 1e3;
            let reads = context.files.reads();
            self.disk.add_reads(reads.iter().map(|read| (read.path.clone(), read.kind)));
            let is_cancelled = output.as_ref().is_err_and(|failure| failure.cancelled);
            let changing = changing(&reads).filter(|_| !is_cancelled);
            if changing.is_some() && attempts < ATTEMPTS {
                continue;
            }
            let output = match changing {
                Some(path) if output.is_ok() => {
                    let message = format!("{} changed every time it was read", path_text(path));
                    Err(Failure::new(message).help(WHEN_WRITTEN))
                }
                _ => output,
            };
            let output = match output {
                Err(failure) if !failure.system_error && self.has_changed_since(&reader, &reads) => {
                    Err(Failure::cancelled())
                }
                Ok(_) if self.is_unfinished(&reader, &reads) => Err(Failure::cancelled()),
                output => output,
            };
            let ran = Ran {
                reads: self.reads(&reader, &reads),
                stamps: self.disk.stamps_of(&reader, &reads),
                paths: reads.iter().map(|read| read.path.clone()).collect(),
                milliseconds,
                warnings: context.reporter.warnings(),
                notes: context.reporter.notes(),
                place: request.why_here.clone().map(|because| Place::Here { because }),
                ..Ran::without_result(started)
            };
            break self.store(output, ran);
        };
        self.conclude(request, ran)
    }

    /// Records what a run made, wherever it ran, and publishes its files. A failure is left to the scheduler.
    ///
    /// # Errors
    /// If the journal cannot be written, so that nothing can be recorded.
    pub(crate) fn conclude(&self, request: RunRequest, ran: Ran) -> Result<Outcome, Error> {
        let state = self.check.state;
        let stage = &self.check.plan.stages[self.check.plan.items[request.item].stage];
        let info = &self.check.stages[self.check.plan.items[request.item].stage];
        let Ran {
            outputs,
            value,
            files,
            reads,
            paths,
            stamps,
            started,
            milliseconds,
            warnings,
            notes,
            place,
            shared,
        } = ran;
        // A kind says what is wrong inside its source; which file of the project that is, is known only here.
        let outputs = outputs.map_err(|failure| match self.check.source(request.item) {
            Some(source) if !failure.cancelled => failure.context(format!("source {}", path_text(source))),
            _ => failure,
        });
        if outputs.as_ref().is_err_and(|failure| failure.cancelled) {
            return Ok(Outcome::Stopped);
        }
        let before =
            self.check.latest(request.item).map_or_else(Vec::new, |latest| latest.outputs().to_vec());
        let record = Record {
            manifest: self.check.plan.manifest_name(),
            item: self.check.name(request.item),
            gone: false,
            key: request.key,
            version: env!("CARGO_PKG_VERSION").into(),
            kind: stage.kind.name().into(),
            revision: info.revision,
            parameters: info.parameters.clone(),
            source: self.check.source(request.item),
            mount: self.check.mount(request.item),
            inputs: request.inputs,
            reads,
            outputs: outputs.as_ref().map_or(before, Vec::clone),
            started,
            milliseconds,
            reasons: request.reasons,
            causes: worth_keeping(&request.causes),
            from_cache: None,
            place,
            shared,
            warnings: warnings.clone(),
            notes: notes.clone(),
            failure: outputs.as_ref().err().map(|failure| failure.chain.clone()),
        };
        let mut lines = stamps;
        if outputs.is_ok() {
            lines.push(Line::new(Tag::Result, short(record.key), Some(&record)));
        }
        lines.push(Line::new(Tag::Item, self.check.subject(request.item), Some(&record)));
        let outputs = match outputs {
            Ok(outputs) => outputs,
            Err(failure) => return Ok(Outcome::Failed { failure, warnings, notes, paths, lines }),
        };
        state.journal.append(&lines)?;
        self.share(request.item, &record);
        if let (Some((name, Some(_))), Some(value)) = (info.artifact, &value) {
            self.memory.put(name, outputs[0].digest, outputs[0].bytes, Arc::clone(value));
        }
        let mut events = Vec::new();
        let unpublished = self.publish(request.item, &outputs, files, &mut events).err();
        Ok(Outcome::Made { outputs, value, milliseconds, warnings, notes, events, unpublished })
    }

    /// Looks for the result of an item in the shared cache.
    pub(crate) fn find(&self, item: ItemIndex, key: Digest) -> Option<Record> {
        let record = self.check.shared_record(item, key, self.shared?)?;
        self.shared_blobs?.add(&record);
        Some(record)
    }

    fn share(&self, item: ItemIndex, record: &Record) {
        let stage = &self.check.plan.stages[self.check.plan.items[item].stage];
        let Some(options) = self.shared.filter(|_| stage.configured.is_shared()) else { return };
        let files = |reads: &[FileRead]| -> NamedFiles {
            reads.iter().map(|read| (read.path.clone(), read.kind, read.digest)).collect()
        };
        let (expected, read) = (self.check.expected_reads(item), files(&record.reads));
        let described = |description: Description| serde_json::to_vec(&description).unwrap_or_default();
        let mut entries = Vec::new();
        let mut all = expected.clone();
        let further = read.difference(&expected).map(|(path, kind, _)| (path.clone(), *kind));
        let further = further.collect::<Vec<_>>();
        if !further.is_empty() {
            all.extend(read);
            let first = action(&options.version, record.key, &expected);
            entries.push((first, described(Description::Reads(further))));
        }
        let result = Description::Result(Box::new(ResultDescription::of(record, &options.machine)));
        entries.push((action(&options.version, record.key, &all), described(result)));
        let digests = record.outputs.iter().map(|blob| blob.digest).collect::<Vec<_>>();
        let store = Arc::clone(&self.check.state.store);
        let outputs = match &record.shared {
            Some(shared) => UploadOutputs::There(shared.blobs.clone()),
            None => UploadOutputs::Here {
                count: digests.len(),
                read: Box::new(move |index| store.get(digests[index]).ok().flatten()),
            },
        };
        let this = &self.check.plan.items[item];
        let (list, item) = (list(&options.version, self.check.plan, this.stage), this.key.to_string());
        options.cache.store(Upload { list, item, entries, outputs });
    }

    /// Whether an item's files are published with these outputs, and no file is left that it exported before.
    pub(crate) fn is_published(&self, item: ItemIndex, outputs: &[Blob]) -> bool {
        let files = &self.check.plan.items[item].files;
        files.len() <= outputs.len()
            && files.iter().zip(outputs).all(|(file, blob)| self.publisher.is_intact(file, blob.digest))
            && !self.publisher.has_stale(&|| self.check.name(item))
    }

    /// Puts an item's files in place, and removes those that it no longer exports.
    pub(crate) fn publish(
        &self,
        item: ItemIndex,
        outputs: &[Blob],
        contents: Option<Vec<Option<Vec<u8>>>>,
        events: &mut Vec<PublishEvent>,
    ) -> Result<(), PublishError> {
        let files = self.check.plan.items[item].files.iter().cloned().zip(outputs.iter().copied());
        let name = self.check.name(item);
        self.publisher.publish(&name, &files.collect::<Vec<_>>(), contents, events)?;
        Ok(self.publisher.remove_stale(&name, events)?)
    }

    /// The value of a stored artifact; `None` if it is lost or cannot be decoded. Of an export, the sizes of
    /// its files; `None` if a file that consumers read is lost.
    pub(crate) fn fetch(&self, item: ItemIndex, outputs: &[Blob]) -> Result<Option<Arc<Handle>>, Error> {
        let info = &self.check.stages[self.check.plan.items[item].stage];
        let Some((name, decoder)) = info.artifact else {
            for blob in info.files_read.iter().filter_map(|place| outputs.get(*place)) {
                if self.check.state.store.get(blob.digest)?.is_none() {
                    return Ok(None);
                }
            }
            return Ok(Some(self.exported_files(item, outputs)));
        };
        let Some(Blob { digest, .. }) = outputs.first().copied() else { return Ok(None) };
        let Some(bytes) = self.check.state.store.get(digest)? else { return Ok(None) };
        // Its consumers take the bytes.
        let Some(decoder) = decoder else { return Ok(Some(Arc::new(self.handle(name, digest)))) };
        // An artifact that another version encoded differently is made again.
        match catch_unwind(AssertUnwindSafe(|| decoder(&bytes))) {
            Ok(Ok(value)) => {
                self.memory.put(name, digest, bytes.len() as u64, Arc::clone(&value));
                Ok(Some(Arc::new(self.handle(name, digest).with_value(value))))
            }
            _ => {
                self.check.state.store.remove(digest);
                Ok(None)
            }
        }
    }

    /// The value of a stored artifact that an earlier build left in memory. The stored bytes may have been
    /// damaged since; the value is still good, and a consumer that asks for the bytes gets an error.
    pub(crate) fn value_in_memory(&self, item: ItemIndex, outputs: &[Blob]) -> Option<Arc<Handle>> {
        let (name, _) = self.check.stages[self.check.plan.items[item].stage].artifact?;
        let digest = outputs.first()?.digest;
        let value = self.memory.get(name, digest)?;
        Some(Arc::new(self.handle(name, digest).with_value(value)))
    }

    pub(crate) fn handle(&self, type_name: &'static str, digest: Digest) -> Handle {
        let store = Arc::clone(&self.check.state.store);
        Handle::new(type_name, digest, move || match store.get(digest) {
            Ok(Some(bytes)) => Ok(bytes),
            Ok(None) => {
                let message = format!("the stored artifact {digest} is gone");
                Err(Failure::new(message).help("build again").system_error())
            }
            Err(error) => Err(failure_of(error)),
        })
    }

    /// What consumers learn of the files that an item exported with these outputs.
    pub(crate) fn exported_files(&self, item: ItemIndex, outputs: &[Blob]) -> Arc<Handle> {
        let (files, encoded) = self.check.exported_files(item, outputs);
        // For a consumer that runs on another machine.
        let _ = self.check.state.store.put(&encoded);
        let handle = self.handle(ExportedFiles::TYPE, Digest::of(&encoded));
        Arc::new(handle.with_value(Arc::new(files)))
    }

    /// An exported file, for consumers that read it.
    pub(crate) fn exported_file(&self, file: &Blob) -> Arc<Handle> {
        Arc::new(self.handle(ExportedFiles::TYPE, file.digest))
    }

    /// Calls an item's kind once.
    fn call(&self, item: ItemIndex, context: &Context<'_>) -> Result<Output, Failure> {
        let stage = &self.check.plan.stages[self.check.plan.items[item].stage];
        let called = catch_unwind(AssertUnwindSafe(|| stage.configured.run(context)));
        match called {
            Err(panic) => Err(panicked(stage.kind.name(), panic.as_ref())),
            Ok(_) if context.was_stopped() => Err(Failure::cancelled()),
            // A failure on half an edit is not reported: the next build reports what is wrong with the whole.
            Ok(Err(_)) if context.reporter.is_stale() => Err(Failure::cancelled()),
            Ok(output) => output.and_then(|output| self.checked(item, output)),
        }
    }

    fn context<'c>(&'c self, request: &RunRequest, reader: &'c Reader) -> Context<'c> {
        let item = &self.check.plan.items[request.item];
        let stage = &self.check.plan.stages[item.stage];
        let info = &self.check.stages[item.stage];
        let mut context = Context::new(reader)
            .with_cancel(self.cancel.clone())
            .with_folder(self.check.folder.to_path_buf())
            .with_out(self.check.plan.out.clone())
            .with_scratch(self.check.state.store.temporary_folder());
        context.derived = DerivedValues { memory: Some(self.derived) };
        context.files.kept =
            self.keep_scratch.then(|| self.check.state.store.kept_folder(&self.check.name(request.item)));
        context.reporter.stale = Some(self.running.stale_flag(request.item));
        context.reporter.share = Arc::clone(&request.share);
        context.reporter.gate = (!request.is_wanted).then(|| Arc::clone(&self.gate));
        self.running.set_dependencies(request.item, Dependencies::Running(Arc::clone(&context.files.reads)));
        if let Product::Artifact(name) = stage.product
            && !self.check.is_forced(request.item)
            && let Some(made) = self.check.latest(request.item).and_then(|latest| latest.outputs().first())
        {
            context = context.with_earlier(self.handle(name, made.digest));
        }
        for (port, handles) in &request.handles {
            let shown = |key: &ItemKey| if info.shows_keys { key.clone() } else { ItemKey::default() };
            let handles = handles.iter().map(|(key, handle)| (shown(key), Arc::clone(handle)));
            context = context.with_input(port, handles.collect());
        }
        if let Some(source) = &item.source {
            context = context.with_source(source.clone());
        }
        if info.shows_keys {
            context = context.with_key(item.key.clone());
        }
        // An artifact holds no provenance, so only kinds that export see a recipe.
        if matches!(stage.product, Product::Files(_)) {
            let is_many = |port: &str| info.many.contains(port);
            let kind = stage.kind.name();
            context =
                context.with_recipe(recipe(kind, info.revision, &info.parameters, &request.inputs, is_many));
        }
        context
    }

    /// The output, if it is what the plan says.
    fn checked(&self, item: ItemIndex, output: Output) -> Result<Output, Failure> {
        let item = &self.check.plan.items[item];
        let stage = &self.check.plan.stages[item.stage];
        let fits = match (&output, &stage.product) {
            (Output::Artifact { .. }, Product::Artifact(_)) => true,
            (Output::Files(made), Product::Files(_)) => made.len() == item.files.len(),
            _ => false,
        };
        if !fits {
            return Err(undeclared(stage.kind.name()));
        }
        Ok(output)
    }

    fn store(&self, output: Result<Output, Failure>, ran: Ran) -> Ran {
        let store = &self.check.state.store;
        let output = match output {
            Ok(output) => output,
            Err(failure) => return Ran { outputs: Err(failure), ..ran },
        };
        let put = |bytes: &[u8]| store.put_until(bytes, &|| self.cancel.is_cancelled());
        let stored = output.stored().into_iter().map(put).collect::<Result<Vec<_>, _>>();
        let outputs = stored.map_err(failure_of);
        match output {
            Output::Artifact { value, .. } => Ran { outputs, value: Some(value), ..ran },
            Output::Files(files) => Ran { outputs, files: Some(files), ..ran },
        }
    }

    /// Whether a watcher will build again because one of these files has changed since it was read, or is
    /// still being written. If so, a failure on what was read is not reported. The watcher may not have heard
    /// of the change yet.
    fn has_changed_since(&self, reader: &Reader, reads: &[Read]) -> bool {
        let has_other_stamp = |read: &Read| {
            reader.stamp(&read.path).is_some_and(|stamp| {
                fs::metadata(&read.path).ok().map(|found| Stamp::of(&found)) != Some(stamp)
            })
        };
        self.watched.is_some() && (self.is_unfinished(reader, reads) || reads.iter().any(has_other_stamp))
    }

    /// Whether a program is still writing a file that was read, and a watcher will build again when it is
    /// done.
    fn is_unfinished(&self, reader: &Reader, reads: &[Read]) -> bool {
        self.watched.is_some_and(|watched| watched.are_unfinished(reads, |path| reader.modified(path)))
    }

    fn reads(&self, reader: &Reader, reads: &[Read]) -> Vec<FileRead> {
        let named = reads.iter().map(|read| FileRead {
            path: path_name(self.check.folder, &read.path),
            kind: read.kind,
            digest: read.digest,
            found: read.found.as_deref().map(|found| path_name(self.check.folder, found)),
            modified: reader.modified(&read.path),
        });
        named.collect()
    }
}

/// A file that was read twice with different contents.
fn changing<'r>(reads: &'r [Read]) -> Option<&'r PathBuf> {
    let mut digests = HashMap::<(&'r PathBuf, ReadKind), Option<Digest>>::new();
    let mut differs =
        |read: &'r Read| *digests.entry((&read.path, read.kind)).or_insert(read.digest) != read.digest;
    reads.iter().find_map(|read| differs(read).then_some(&read.path))
}

pub(crate) fn failure_of(error: Error) -> Failure {
    Failure {
        chain: error.chain().to_vec(),
        help: error.help().map(str::to_owned),
        cancelled: error.kind() == ErrorKind::Cancelled,
        system_error: error.kind().is_of_system(),
    }
}

pub(crate) fn panicked(kind: &str, panic: &(dyn Any + Send)) -> Failure {
    bug(kind, &format!("panicked: {}", message_of(panic)))
}

pub(crate) fn message_of(panic: &(dyn Any + Send)) -> &str {
    let message = panic.downcast_ref::<String>().map(String::as_str);
    message.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no message")
}

/// The failure of an item whose kind made something else than it declared.
pub(crate) fn undeclared(kind: &str) -> Failure {
    bug(kind, "its output does not match its declaration")
}

fn bug(kind: &str, what: &str) -> Failure {
    Failure::new(format!("a bug in kind {kind}: {what}")).help(
        "report it to the kind's author with the output of RUST_BACKTRACE=1; its other items and the last \
             good outputs are not affected",
    )
}
