//! One run of one item: its context, its outcome, what is stored and remembered of it.

use std::any::Any;
use std::collections::HashMap;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use crate::cause::worth_keeping;
use crate::context::WHEN_WRITTEN;
use crate::disk::Disk;
use crate::journal::{Line, Tag, short};
use crate::memory::Memory;
use crate::platform::Stamp;
use crate::publish::{PublishError, PublishEvent, Publisher};
use crate::reader::Reader;
use crate::record::{Record, path_name, recipe};
use crate::running::{RunningBuild, Seen};
use crate::session::PathSet;
use crate::store::Blob;
use crate::up_to_date::{UpToDateCheck, manifest_name};
use crate::{
    Cancel, Cause, Context, Digest, Error, Failure, FileRead, Handle, InputUsed, ItemIndex, ItemKey, Output,
    Product, Read, Reason, Timestamp,
};

/// What running items share.
pub(crate) struct RunContext<'a> {
    pub(crate) judge: &'a UpToDateCheck<'a>,
    pub(crate) disk: &'a Disk,
    pub(crate) publisher: &'a Publisher<'a>,
    pub(crate) cancel: &'a Cancel,
    pub(crate) memory: &'a Memory,
    pub(crate) underway: &'a Arc<RunningBuild>,
    /// The paths that a watcher will act on, if one is at work.
    pub(crate) pending: Option<&'a PathSet>,
}

/// What arrives at a port, sorted by key.
pub(crate) type Inputs = Vec<(ItemKey, Arc<Handle>)>;

/// An item that is to run: what it gets.
pub(crate) struct RunRequest {
    pub(crate) item: ItemIndex,
    pub(crate) key: Digest,
    pub(crate) inputs: Vec<InputUsed>,
    pub(crate) handles: Vec<(String, Inputs)>,
    pub(crate) reasons: Vec<Reason>,
    pub(crate) causes: Vec<Cause>,
}

/// What came of it.
pub(crate) struct Outcome {
    pub(crate) made: Result<Made, Failure>,
    pub(crate) milliseconds: f64,
    pub(crate) warnings: Vec<String>,
    pub(crate) notes: Vec<String>,
    pub(crate) told: Vec<PublishEvent>,
}

/// What a good run made.
pub(crate) struct Made {
    pub(crate) outputs: Vec<Blob>,
    pub(crate) value: Option<Arc<dyn Any + Send + Sync>>,
    /// Why its files could not be published, although they are stored.
    pub(crate) unpublished: Option<Failure>,
}

/// An item is run so often at most where the files that it reads do not hold still.
const ATTEMPTS: usize = 3;

/// A run of a kind.
struct Attempt {
    output: Result<Output, Failure>,
    /// A file that it saw with different contents.
    unsteady: Option<PathBuf>,
    reader: Reader,
    reads: Vec<Read>,
    warnings: Vec<String>,
    notes: Vec<String>,
}

impl Attempt {
    fn is_cancelled(&self) -> bool {
        self.output.as_ref().is_err_and(|failure| failure.cancelled)
    }
}

/// An output that is in the store.
struct Stored {
    outputs: Vec<Blob>,
    /// The value of an artifact.
    value: Option<Arc<dyn Any + Send + Sync>>,
    /// The contents of exported files.
    files: Option<Vec<Vec<u8>>>,
}

impl RunContext<'_> {
    /// Runs an item, stores and remembers its outputs and publishes its files.
    ///
    /// # Errors
    /// Where the journal cannot be written: nothing can be remembered then.
    pub(crate) fn run(&self, order: RunRequest) -> Result<Outcome, Error> {
        let state = self.judge.state;
        let item = &self.judge.plan.items[order.item];
        let stage = &self.judge.plan.stages[item.stage];
        let facts = &self.judge.stages[item.stage];
        let started = Timestamp::now();
        let clock = Instant::now();
        let mut attempt = self.attempt(&order);
        for _ in 1..ATTEMPTS {
            if attempt.unsteady.is_none() || attempt.is_cancelled() {
                break;
            }
            attempt = self.attempt(&order);
        }
        let milliseconds = clock.elapsed().as_secs_f64() * 1e3;
        let Attempt { output, unsteady, reader, reads, warnings, notes } = attempt;
        let output = match unsteady {
            Some(path) if output.is_ok() => {
                let message = format!("{} changed each time that it was read", path.display());
                Err(Failure::new(message).help(WHEN_WRITTEN))
            }
            _ => output,
        };
        let output = match output {
            Err(failure) if !failure.system_error && self.is_overtaken(&reader, &reads) => {
                Err(Failure::cancelled())
            }
            output => output,
        };
        // A kind tells what is wrong inside its source; here is known which file of the project that is.
        let output = output.map_err(|failure| match self.judge.source(order.item) {
            Some(source) if !failure.cancelled => failure.context(format!("source {source}")),
            _ => failure,
        });
        let stored = output.and_then(|output| self.stored(output));
        let mut outcome =
            Outcome { made: Err(Failure::cancelled()), milliseconds, warnings, notes, told: Vec::new() };
        if let Err(failure) = &stored
            && failure.cancelled
        {
            return Ok(outcome);
        }
        let before = self.judge.effect(order.item).map_or_else(Vec::new, |effect| effect.outputs().to_vec());
        let record = Record {
            manifest: manifest_name(self.judge.plan),
            item: self.judge.name(order.item),
            gone: false,
            key: order.key,
            version: env!("CARGO_PKG_VERSION").into(),
            kind: stage.kind.name().into(),
            revision: facts.revision,
            parameters: facts.parameters.clone(),
            source: self.judge.source(order.item),
            inputs: order.inputs,
            reads: self.reads(&reader, &reads),
            outputs: stored.as_ref().map_or(before, |stored| stored.outputs.clone()),
            started,
            milliseconds,
            reasons: order.reasons,
            causes: worth_keeping(&order.causes),
            from_cache: None,
            warnings: outcome.warnings.clone(),
            notes: outcome.notes.clone(),
            failure: stored.as_ref().err().map(|failure| failure.chain.clone()),
        };
        let mut lines = self.disk.stamps_of(&reader, &reads);
        if stored.is_ok() {
            lines.push(Line::new(Tag::Result, short(record.key), Some(&record)));
        }
        lines.push(Line::new(Tag::Item, self.judge.subject(order.item), Some(&record)));
        state.journal.append(&lines)?;
        outcome.made = match stored {
            Err(failure) => Err(failure),
            Ok(Stored { outputs, value, files }) => {
                if let (Some((name, Some(_))), Some(value)) = (facts.artifact, &value) {
                    self.memory.put(name, outputs[0].digest, outputs[0].bytes, Arc::clone(value));
                }
                let published = self.publish(order.item, &outputs, files, &mut outcome.told);
                let unpublished = match published {
                    Ok(()) => None,
                    Err(PublishError::Lost) => {
                        Some(Failure::new("a result that was just stored is gone").system_error())
                    }
                    Err(PublishError::Error(error)) => Some(failure_of(error)),
                };
                Ok(Made { outputs, value, unpublished })
            }
        };
        Ok(outcome)
    }

    /// Whether an item's files are there as these outputs, and nothing else is that it exported before.
    pub(crate) fn is_published(&self, item: ItemIndex, outputs: &[Blob]) -> bool {
        let files = &self.judge.plan.items[item].files;
        files.len() <= outputs.len()
            && files.iter().zip(outputs).all(|(file, blob)| self.publisher.is_intact(file, blob.digest))
            && !self.publisher.has_stale(&|| self.judge.name(item))
    }

    /// Puts an item's files in place, and removes those that it does not export any more.
    ///
    /// # Errors
    /// As [`Publisher::publish`].
    pub(crate) fn publish(
        &self,
        item: ItemIndex,
        outputs: &[Blob],
        bytes: Option<Vec<Vec<u8>>>,
        told: &mut Vec<PublishEvent>,
    ) -> Result<(), PublishError> {
        let files = self.judge.plan.items[item].files.iter().cloned().zip(outputs.iter().copied());
        let name = self.judge.name(item);
        self.publisher.publish(&name, &files.collect::<Vec<_>>(), bytes, told)?;
        Ok(self.publisher.remove_stale(&name, told)?)
    }

    /// The value of a stored artifact; `None` where it is lost or cannot be understood.
    pub(crate) fn fetch(&self, item: ItemIndex, digest: Digest) -> Result<Option<Arc<Handle>>, Error> {
        let Some(bytes) = self.judge.state.store.get(digest)? else { return Ok(None) };
        let Some((name, decoder)) = self.judge.stages[self.judge.plan.items[item].stage].artifact else {
            return Ok(None);
        };
        // Its consumers take the bytes.
        let Some(decoder) = decoder else { return Ok(Some(Arc::new(self.handle(name, digest)))) };
        // What another version encoded otherwise is made again.
        match catch_unwind(AssertUnwindSafe(|| decoder(&bytes))) {
            Ok(Ok(value)) => {
                self.memory.put(name, digest, bytes.len() as u64, Arc::clone(&value));
                Ok(Some(Arc::new(self.handle(name, digest).with_value(value))))
            }
            _ => {
                self.judge.state.store.forget(digest);
                Ok(None)
            }
        }
    }

    /// The value of a stored artifact that an earlier build left in memory. What is stored may have been damaged since:
    /// the value is as good as it was, and who wants the bytes is told.
    pub(crate) fn remembered(&self, item: ItemIndex, digest: Digest) -> Option<Arc<Handle>> {
        let (name, _) = self.judge.stages[self.judge.plan.items[item].stage].artifact?;
        let value = self.memory.get(name, digest)?;
        Some(Arc::new(self.handle(name, digest).with_value(value)))
    }

    /// A handle on a stored artifact.
    pub(crate) fn handle(&self, type_name: &'static str, digest: Digest) -> Handle {
        let store = Arc::clone(&self.judge.state.store);
        Handle::new(type_name, digest, move || match store.get(digest) {
            Ok(Some(bytes)) => Ok(bytes),
            Ok(None) => {
                let message = format!("the stored artifact {digest} is gone");
                Err(Failure::new(message).help("build again").system_error())
            }
            Err(error) => Err(failure_of(error)),
        })
    }

    /// Runs an item, for better or worse.
    fn attempt(&self, order: &RunRequest) -> Attempt {
        let stage = &self.judge.plan.stages[self.judge.plan.items[order.item].stage];
        let reader = self.disk.reader();
        let context = self.context(order, &reader);
        let ran = catch_unwind(AssertUnwindSafe(|| stage.configured.run(&context)));
        let stopped = context.stopped.load(Ordering::Relaxed);
        let output = match ran {
            Err(panic) => Err(panicked(stage.kind.name(), panic.as_ref())),
            Ok(_) if stopped => Err(Failure::cancelled()),
            // Half an edit is no news: the next build tells what is wrong with the whole.
            Ok(Err(_)) if context.is_stale() => Err(Failure::cancelled()),
            Ok(output) => output.and_then(|output| self.checked(order.item, output)),
        };
        let (warnings, notes, reads) = (context.warnings(), context.notes(), context.reads());
        self.disk.note(&reads);
        let unsteady = unsteady(&reads).cloned();
        Attempt { output, unsteady, reader, reads, warnings, notes }
    }

    fn context<'c>(&self, order: &RunRequest, reader: &'c Reader) -> Context<'c> {
        let item = &self.judge.plan.items[order.item];
        let stage = &self.judge.plan.stages[item.stage];
        let facts = &self.judge.stages[item.stage];
        let mut context = Context::new(reader)
            .with_cancel(self.cancel.clone())
            .with_folder(self.judge.folder.to_path_buf())
            .with_scratch(self.judge.state.store.temporaries());
        context.underway = Some((Arc::clone(self.underway), order.item));
        self.underway.saw(order.item, Seen::Now(Arc::clone(&context.reads)));
        for (port, handles) in &order.handles {
            let shown = |key: &ItemKey| if facts.shows_keys { key.clone() } else { ItemKey::default() };
            let handles = handles.iter().map(|(key, handle)| (shown(key), Arc::clone(handle)));
            context = context.with_input(port, handles.collect());
        }
        if let Some(source) = &item.source {
            context = context.with_source(source.clone());
        }
        if facts.shows_keys {
            context = context.with_key(item.key.clone());
        }
        // An artifact holds no provenance, so that only kinds that export see a recipe.
        if matches!(stage.product, Product::Files(_)) {
            let is_many = |port: &str| facts.many.contains(port);
            let kind = stage.kind.name();
            context =
                context.with_recipe(recipe(kind, facts.revision, &facts.parameters, &order.inputs, is_many));
        }
        context
    }

    /// The output, where it is what the plan says.
    fn checked(&self, item: ItemIndex, output: Output) -> Result<Output, Failure> {
        let item = &self.judge.plan.items[item];
        let stage = &self.judge.plan.stages[item.stage];
        let fits = match (&output, &stage.product) {
            (Output::Artifact { .. }, Product::Artifact(_)) => true,
            (Output::Files(made), Product::Files(_)) => made.len() == item.files.len(),
            _ => false,
        };
        if !fits {
            return Err(bug(stage.kind.name(), "its output is not what it declared"));
        }
        Ok(output)
    }

    fn stored(&self, output: Output) -> Result<Stored, Failure> {
        let store = &self.judge.state.store;
        match output {
            Output::Artifact { bytes, value } => {
                let outputs = vec![store.put(&bytes).map_err(failure_of)?];
                Ok(Stored { outputs, value: Some(value), files: None })
            }
            Output::Files(files) => {
                let outputs = files.iter().map(|bytes| store.put(bytes)).collect::<Result<Vec<_>, _>>();
                Ok(Stored { outputs: outputs.map_err(failure_of)?, value: None, files: Some(files) })
            }
        }
    }

    /// Whether a watcher will build again because one of these files has changed since, or is still being written. That
    /// an item failed on what it read is no news then.
    fn is_overtaken(&self, reader: &Reader, reads: &[Read]) -> bool {
        let Some(pending) = self.pending else { return false };
        let is_pending = {
            let pending = pending.lock();
            !pending.is_empty() && reads.iter().any(|read| pending.contains(&read.path))
        };
        // The watcher may not have heard of it yet.
        is_pending
            || reads.iter().any(|read| {
                reader.stamp(&read.path).is_some_and(|stamp| {
                    fs::metadata(&read.path).ok().map(|found| Stamp::of(&found)) != Some(stamp)
                })
            })
    }

    fn reads(&self, reader: &Reader, reads: &[Read]) -> Vec<FileRead> {
        let named = reads.iter().map(|read| FileRead {
            path: path_name(self.judge.folder, &read.path),
            listing: read.listing,
            digest: read.digest,
            modified: reader.modified(&read.path),
        });
        named.collect()
    }
}

/// A file that a run saw with different contents.
fn unsteady<'r>(reads: &'r [Read]) -> Option<&'r PathBuf> {
    let mut digests = HashMap::<(&'r PathBuf, bool), Option<Digest>>::new();
    let mut differs =
        |read: &'r Read| *digests.entry((&read.path, read.listing)).or_insert(read.digest) != read.digest;
    reads.iter().find_map(|read| differs(read).then_some(&read.path))
}

/// The failure of an item that met an error of the engine.
pub(crate) fn failure_of(error: Error) -> Failure {
    Failure {
        chain: error.chain().to_vec(),
        help: error.help().map(str::to_owned),
        cancelled: false,
        system_error: error.kind().is_of_system(),
    }
}

fn panicked(kind: &str, panic: &(dyn Any + Send)) -> Failure {
    bug(kind, &format!("panicked: {}", message_of(panic)))
}

/// What a panic said.
pub(crate) fn message_of(panic: &(dyn Any + Send)) -> &str {
    let message = panic.downcast_ref::<String>().map(String::as_str);
    message.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no message")
}

fn bug(kind: &str, what: &str) -> Failure {
    Failure::new(format!("a bug in kind {kind}: {what}"))
        .help(
            "tell the kind's author, with what RUST_BACKTRACE=1 adds; its other items and the last good outputs are \
             not touched",
        )
}
