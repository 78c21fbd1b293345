//! Everything that the engine reports: one closed enum, read by progress bars, `--json`, the watcher and the
//! tests.

use std::fmt;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde::{Deserialize, Serialize};

use crate::key::{Digest, ItemKey};
use crate::manifest::Diagnostics;
use crate::platform::path_text;
use crate::shared::Traffic;
use crate::timestamp::Timestamp;

/// An event as `--json` prints it: one object on a line of its own.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct EventLine {
    /// The version of this format. Within a version, events and fields are only ever added: ignore those that
    /// you do not know.
    pub v: u32,
    /// When the line was written, in milliseconds since 1970-01-01 00:00 UTC.
    pub time: Timestamp,
    /// What happened.
    #[serde(flatten)]
    pub event: Event,
}

impl EventLine {
    /// The version of the format: raised when an event or a field is removed or renamed, or changes its type
    /// or meaning.
    pub const VERSION: u32 = 2;

    /// The line of an event that happens now.
    pub fn now(event: Event) -> Self {
        Self { v: Self::VERSION, time: Timestamp::now(), event }
    }

    /// The JSON Schema (draft 2020-12) of every line.
    pub fn schema() -> serde_json::Value {
        let settings = SchemaSettings::draft2020_12().for_serialize();
        settings.into_generator().into_root_schema_for::<Self>().to_value()
    }
}

/// An item's name in events: its stage and its key.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
pub struct ItemName {
    /// The stage.
    pub stage: String,
    /// The key.
    pub key: ItemKey,
}

impl fmt::Display for ItemName {
    /// `reflection [sky, gold]`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.key.is_empty() {
            f.write_str(&self.stage)
        } else {
            write!(f, "{} [{}]", self.stage, self.key)
        }
    }
}

/// Why an item runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "reason", rename_all = "kebab-case")]
pub enum Reason {
    /// There is no record of it.
    NeverBuilt,
    /// Its last run failed.
    FailedBefore,
    /// A parameter changed.
    Parameter {
        /// The parameter's name.
        name: String,
        /// The value at the last run; `null` if there was none.
        old: serde_json::Value,
        /// The value now; `null` if there is none.
        new: serde_json::Value,
    },
    /// An artifact at a port changed.
    Input {
        /// The port.
        port: String,
        /// The item that made it.
        item: ItemName,
        /// The digest at the last run; `null` if the item was not connected then.
        old: Option<Digest>,
        /// The digest now; `null` if the item is no longer connected.
        new: Option<Digest>,
    },
    /// An artifact at a port would be made again first, and its content is not known yet. Reported only in a
    /// dry run.
    Awaits {
        /// The port.
        port: String,
        /// The item that would run.
        item: ItemName,
    },
    /// A file that it reads changed.
    File {
        /// The file, relative to the manifest's folder if it is inside.
        path: String,
        /// The digest at the last run.
        old: Option<Digest>,
        /// The digest now; `null` if the file no longer exists.
        new: Option<Digest>,
        /// When the version that the last run read was modified, by its file system, if that was recorded.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        old_time: Option<Timestamp>,
        /// When the current version was modified, by its file system.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        new_time: Option<Timestamp>,
    },
    /// PATH leads to another file for a program that it runs.
    Program {
        /// The program's name.
        name: String,
        /// The file that was found at the last run, relative to the manifest's folder if it is inside; `null`
        /// if there was none.
        old: Option<String>,
        /// The file that is found now; `null` if there is none.
        new: Option<String>,
    },
    /// The kind has a new revision, or the stage has another kind.
    Kind {
        /// Kind and revision at the last run.
        old: String,
        /// Kind and revision now.
        new: String,
    },
    /// Its stored result is lost or damaged.
    ResultLost,
    /// Its source or its stage was removed and is back, unchanged.
    Returned,
    /// The build was asked to run it even if it is up to date.
    Forced,
}

/// Something that happened during a build.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// The graph is loaded; these stages and items may have to run.
    Planned {
        /// Whether this is a dry run: what follows is what a build would do.
        dry_run: bool,
        /// The number of stages that were selected.
        stages: usize,
        /// The number of their items.
        items: usize,
    },
    /// The manifest is valid, but a person should look at something: a file that a glob misses by its case,
    /// or an exclusion without effect. A watcher reports each only when it is new.
    ManifestWarnings {
        /// The warnings, with their places in the manifest.
        diagnostics: Diagnostics,
    },
    /// Another process has the folder locked; the build waits for it. Reported once, when the wait becomes
    /// noticeable.
    Waiting {
        /// The other process: what it does, its number and its start.
        holder: String,
        /// The longest wait; `null` if it has no limit.
        limit_milliseconds: Option<f64>,
    },
    /// The item's result is in the cache: nothing to run. A watcher does not report the items that a change
    /// does not affect.
    UpToDate {
        /// The item.
        item: ItemName,
        /// The shared cache in which its result was found; `null` if the cache of this folder has it.
        host: Option<String>,
    },
    /// The server of the shared cache or of the workers cannot be used, or only in part; the build
    /// continues without it. Reported once for all consequences.
    SharedCache {
        /// The server.
        host: String,
        /// What is wrong, and what that means for the build.
        message: String,
    },
    /// An item starts to run; in a dry run, it would run.
    Started {
        /// The item.
        item: ItemName,
        /// Why: every difference from its last run.
        reasons: Vec<Reason>,
        /// The server whose workers run it; `null` if it runs on this machine. If it cannot run there, a
        /// second such event without a server follows.
        host: Option<String>,
    },
    /// An item is still running, and this share of its work is done. Reported at most ten times a second
    /// for items that run for more than a second and know the share.
    Progress {
        /// The item.
        item: ItemName,
        /// The share of its work that is done, 0 to 1. It rises from one such event of an item to the next.
        share: f64,
    },
    /// A worker spent time on an item; use it to draw a timeline. The outcome is reported next.
    TaskTimed {
        /// The item.
        item: ItemName,
        /// What the worker did.
        work: Work,
        /// The worker, counted from 0. While a worker waits for others that share its work, it may run
        /// another item, whose time is then within that of the first.
        worker: usize,
        /// When the work started, counted from the start of the build.
        start_milliseconds: f64,
        /// How long it took.
        milliseconds: f64,
    },
    /// A warning of a running item.
    Warning {
        /// The item.
        item: ItemName,
        /// The warning.
        message: String,
    },
    /// A fact about a running item's result.
    Note {
        /// The item.
        item: ItemName,
        /// The fact.
        message: String,
    },
    /// An item ran successfully.
    Finished {
        /// The item.
        item: ItemName,
        /// How long it took.
        milliseconds: f64,
        /// Whether its result differs from the last one; if not, no item that depends on it needs to rerun
        /// because of it.
        changed: bool,
    },
    /// An item failed; its last good outputs stay.
    Failed {
        /// The item.
        item: ItemName,
        /// What happened, then its causes.
        error: Vec<String>,
        /// What to do.
        help: Option<String>,
    },
    /// An item did not run because an item that it needs failed, because the build was stopped, or because
    /// its file is still being written.
    Skipped {
        /// The item.
        item: ItemName,
        /// The item that failed; `null` if the build was stopped or the file is being written.
        because: Option<ItemName>,
    },
    /// A complete file appeared in `out`.
    Published {
        /// The item that it belongs to.
        item: ItemName,
        /// The file, relative to `out`.
        file: String,
        /// Its size.
        bytes: u64,
        /// Whether the file was only restored: its content had not changed.
        restored: bool,
    },
    /// A file was removed from `out` because nothing exports it any more.
    Removed {
        /// The item that had exported it.
        item: ItemName,
        /// The file, relative to `out`.
        file: String,
        /// Why: what happened to the source or the stage that it was made from.
        because: RemovalCause,
    },
    /// A folder has files that earlier builds published and no manifest exports any more, because a
    /// manifest was renamed or deleted, or its `out` changed. They stay until `specula prune` removes them.
    Leftovers {
        /// The folder, relative to the manifest's.
        folder: String,
        /// The number of those files that have not changed since they were published.
        files: usize,
        /// The manifests that published them, by their names in the folder of `manifest`.
        published_by: Vec<String>,
        /// The manifest that is built.
        manifest: String,
    },
    /// The build ended.
    Ended(Summary),
    /// The watcher is running: reported at the start, and whenever it switches between events and polling.
    Watching {
        /// The number of folders that it watches.
        folders: usize,
        /// The interval of polling, if it polls because it was asked to or because events do not arrive.
        poll_milliseconds: Option<f64>,
        /// Why it polls: the folder from which no event arrived, and what was tried.
        because: Option<String>,
    },
    /// Files changed that the graph reads; a build follows.
    Noticed {
        /// The changes, sorted by path.
        changes: Vec<Change>,
        /// The time since the first of the changes.
        milliseconds: f64,
    },
    /// More than ten builds in ten seconds triggered each other by their own changes: a program that a
    /// stage runs writes files that the graph reads, or a file in `out` is also a source under another
    /// name. Such changes no longer start builds. Building continues with the next other change.
    RebuildLoop {
        /// The item with which the last of them began.
        item: ItemName,
        /// The files that changed last.
        files: Vec<String>,
    },
    /// The manifest, or a file that it names, has errors. This ends a build; a watcher keeps using the last
    /// valid manifest. It reports the same errors only once, and again if they are the only result of a
    /// change.
    Rejected {
        /// The first 50 errors, and the number of further ones.
        diagnostics: Diagnostics,
    },
    /// The manifest and the files that it names are valid again after they were rejected.
    Accepted,
    /// The build as a whole cannot continue: a disk is full, a folder cannot be written, or an option is
    /// not valid. This ends a build; a watcher tries again after a pause and at the next change. It reports
    /// the same error only once, and again if it is the result of a change.
    BuildError {
        /// What happened, then its causes.
        error: Vec<String>,
        /// What to do.
        help: Option<String>,
    },
}

/// What a worker does for an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Work {
    /// It reads and decodes the item's stored artifact, for the items that need it, or looks for the item's
    /// result in a shared cache.
    Fetch,
    /// It runs the item, stores its outputs and publishes its files.
    Run,
    /// It publishes the stored files of an item that was up to date.
    Publish,
}

/// A change that a watcher noticed.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
pub struct Change {
    /// The file or folder, relative to the manifest's folder if it is inside; `.` is that folder itself.
    pub path: String,
    /// How it changed.
    pub what: Changed,
}

/// How a file or folder changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Changed {
    /// It is new, or exists again.
    Appeared,
    /// Its content may have changed.
    Changed,
    /// It no longer exists.
    Gone,
    /// Events were lost, so everything below is checked.
    Unknown,
}

/// Why a file is removed from `out`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, JsonSchema)]
#[serde(tag = "cause", rename_all = "kebab-case")]
pub enum RemovalCause {
    /// A source was deleted.
    SourceDeleted {
        /// The source, relative to the manifest's folder if it is inside.
        path: String,
    },
    /// A source now has another name.
    SourceRenamed {
        /// The source, relative to the manifest's folder if it is inside.
        path: String,
        /// Its current name, relative to the manifest's folder if it is inside.
        to: String,
    },
    /// A file is no longer a source of a stage.
    SourceExcluded {
        /// The file, relative to the manifest's folder if it is inside.
        path: String,
        /// The stage.
        stage: String,
    },
    /// The manifest no longer has a stage.
    StageGone {
        /// The stage.
        stage: String,
        /// The manifest.
        manifest: String,
    },
    /// A stage has other items, because its inputs changed.
    ItemsChanged {
        /// The stage.
        stage: String,
    },
    /// A stage exports files with other names.
    FilesChanged {
        /// The stage.
        stage: String,
    },
}

impl fmt::Display for RemovalCause {
    /// What happened, as a clause: `hdri/studio.hdr was deleted`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SourceDeleted { path } => write!(f, "{} was deleted", path_text(path)),
            Self::SourceRenamed { path, to } => {
                write!(f, "{} was renamed to {}", path_text(path), path_text(to))
            }
            Self::SourceExcluded { path, stage } => {
                write!(f, "{} is no longer a source of stage {stage}", path_text(path))
            }
            Self::StageGone { stage, manifest } => write!(f, "stage {stage} is no longer in {manifest}"),
            Self::ItemsChanged { stage } => write!(f, "stage {stage} has other items now"),
            Self::FilesChanged { stage } => write!(f, "stage {stage} exports other files now"),
        }
    }
}

/// What a build did.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Summary {
    /// Items that ran.
    pub ran: usize,
    /// How many of them ran on other machines.
    #[serde(default)]
    pub ran_elsewhere: usize,
    /// Items that were up to date.
    pub up_to_date: usize,
    /// How many of them have a result that was found in a shared cache.
    #[serde(default)]
    pub shared: usize,
    /// What was received from a shared cache, and sent to it; `null` without one.
    pub shared_traffic: Option<Traffic>,
    /// Items that failed.
    pub failed: usize,
    /// How many of them failed because of the system rather than the project: a disk is full, a folder cannot
    /// be written.
    #[serde(default)]
    pub system_errors: usize,
    /// Items that were skipped.
    pub skipped: usize,
    /// How many of the items that failed or were skipped have outputs of an earlier run, which stay.
    #[serde(default)]
    pub kept: usize,
    /// Files that were published or restored.
    pub published: usize,
    /// Files that were removed.
    pub removed: usize,
    /// Whether it stopped before the end, or left out an item whose file is still being written.
    pub cancelled: bool,
    /// How long it took.
    pub milliseconds: f64,
}

#[cfg(test)]
mod tests {
    use expect_test::expect_file;
    use serde_json::Value;

    use super::*;

    /// A change of this file is a change of what programs read; docs/events.md says what that requires.
    /// `UPDATE_EXPECT=1 cargo test -p engine` writes it.
    #[test]
    fn the_schema_of_the_events_is_the_one_that_was_reviewed() {
        let text = serde_json::to_string_pretty(&EventLine::schema()).unwrap() + "\n";
        expect_file!["../../../docs/events.schema.json"].assert_eq(&text);
    }

    #[test]
    fn every_event_and_every_field_is_described() {
        let schema = EventLine::schema();
        let events = schema["oneOf"].as_array().unwrap();
        assert!(events.len() >= 15, "{} events", events.len());
        for event in events {
            let name = &event["properties"]["event"]["const"];
            assert!(name.is_string() && event["description"].is_string(), "{event:#}");
        }
        let mut fields = 0;
        check(&schema, &mut fields);
        assert!(fields >= 60, "{fields} fields");
    }

    /// Every property except the names of variants has a description, its own or that of the definition that
    /// it refers to.
    fn check(schema: &Value, fields: &mut usize) {
        match schema {
            Value::Object(object) => {
                for (name, field) in object.get("properties").and_then(Value::as_object).into_iter().flatten()
                {
                    *fields += 1;
                    let described = field["description"].is_string() || field["const"].is_string();
                    assert!(described, "{name} is not described: {field:#}");
                }
                object.values().for_each(|inner| check(inner, fields));
            }
            Value::Array(all) => all.iter().for_each(|inner| check(inner, fields)),
            _ => {}
        }
    }
}
