//! Everything that the engine tells: one closed enum, read by progress bars, `--json`, the watcher and the tests.

use std::fmt;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde::{Deserialize, Serialize};

use crate::{Diagnostics, Digest, ItemKey, Timestamp};

/// An event as `--json` prints it: one object on a line of its own.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct EventLine {
    /// The version of this format. Within a version, events and fields are only ever added: pass over those that you do
    /// not know.
    pub v: u32,
    /// When the line was written, in milliseconds since 1970-01-01 00:00 UTC.
    pub time: Timestamp,
    /// What happened.
    #[serde(flatten)]
    pub event: Event,
}

impl EventLine {
    /// The version of the format: raised when an event or a field goes, is renamed or changes its type or meaning.
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
        /// The value at the last run; `null` where it did not exist.
        old: serde_json::Value,
        /// The value now; `null` where it no longer exists.
        new: serde_json::Value,
    },
    /// An artifact that arrives at a port changed.
    Input {
        /// The port.
        port: String,
        /// The item that made it.
        item: ItemName,
        /// The digest at the last run, where it arrived then.
        old: Option<Digest>,
        /// The digest now; `None` where it no longer arrives.
        new: Option<Digest>,
    },
    /// An artifact that arrives at a port would be made anew before; what it will be is not known. Told in a dry run only.
    Awaits {
        /// The port.
        port: String,
        /// The item that would run.
        item: ItemName,
    },
    /// A file that it reads changed.
    File {
        /// The file, relative to the manifest's folder where it lies inside.
        path: String,
        /// The digest at the last run.
        old: Option<Digest>,
        /// The digest now; `None` where it is gone.
        new: Option<Digest>,
        /// When the file had been changed that the last run read, by its file system, where that is on record.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        old_time: Option<Timestamp>,
        /// When it was changed now, by its file system.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        new_time: Option<Timestamp>,
    },
    /// The kind's author changed what it computes, or the stage has another kind.
    Kind {
        /// Kind and revision at the last run.
        old: String,
        /// Kind and revision now.
        new: String,
    },
    /// Its stored result is gone or damaged.
    ResultLost,
    /// It is as it was, but had gone in between: its source or its stage is back.
    Returned,
}

/// Something that happened during a build.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// The graph is loaded; this much may have to be done.
    Planned {
        /// Whether this is a dry run: what follows is what a build would do.
        dry_run: bool,
        /// The number of stages that were selected.
        stages: usize,
        /// The number of their items.
        items: usize,
    },
    /// Another process works in the folder; the build waits for it. Told once, when the wait becomes noticeable.
    Waiting {
        /// Who it is: what it does, its process and since when.
        holder: String,
        /// The longest wait; `None` where it has no limit.
        limit_milliseconds: Option<f64>,
    },
    /// The item's result is in the cache: nothing to run. A watcher does not name the items that a change does not concern.
    UpToDate {
        /// The item.
        item: ItemName,
    },
    /// An item begins to run; in a dry run, would run.
    Started {
        /// The item.
        item: ItemName,
        /// Why: every difference from its last run.
        reasons: Vec<Reason>,
    },
    /// A worker did something for an item: what a timeline is drawn from. What came of it is told next.
    TaskTimed {
        /// The item.
        item: ItemName,
        /// What was done.
        work: Work,
        /// The worker, counted from 0. While a worker waits for others to share its work it may take on another item: that
        /// one's time then lies within the first one's.
        worker: usize,
        /// When it began: the time since the build did.
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
    /// An item ran.
    Finished {
        /// The item.
        item: ItemName,
        /// How long it took.
        milliseconds: f64,
        /// Whether its result differs from the last one; if not, nothing after it reruns on its account.
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
    /// An item was not run because one that it needs failed, because the build was stopped, or because somebody is writing
    /// its file.
    Skipped {
        /// The item.
        item: ItemName,
        /// The item that failed; `None` where the build was stopped or the file is being written.
        because: Option<ItemName>,
    },
    /// A file appeared in `out`, whole.
    Published {
        /// The item that it belongs to.
        item: ItemName,
        /// The file, relative to `out`.
        file: String,
        /// Its size.
        bytes: u64,
        /// Whether it only came back: its content had not changed.
        restored: bool,
    },
    /// A file left `out` because its item has gone.
    Removed {
        /// The file, relative to `out`.
        file: String,
    },
    /// The build ended.
    Ended(Summary),
    /// The watcher listens: told at the start, and whenever the way changes.
    Watching {
        /// The number of folders that it listens to.
        folders: usize,
        /// The time between two looks, where it polls because it was told to or events do not arrive.
        poll_milliseconds: Option<f64>,
        /// Why it polls: the folder where no event arrived, and what was tried.
        because: Option<String>,
    },
    /// Files changed that the graph reads; a build follows.
    Noticed {
        /// The changes, sorted by path.
        changes: Vec<Change>,
        /// The time since the first of them was heard of.
        milliseconds: f64,
    },
    /// The changed manifest, or what it names, has errors; the last valid manifest is still in use. The same errors are
    /// reported only once, unless they are the only answer to a change.
    Rejected {
        /// The first 50 errors, and the number of the others.
        diagnostics: Diagnostics,
    },
    /// The manifest and what it names are sound again, after they were rejected.
    Accepted,
    /// The build as a whole cannot go on: a full disk, a folder that cannot be written. It is tried again, after a pause
    /// and at the next change; told once for the same error, unless it is the answer to a change.
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
    /// It reads and decodes the item's stored artifact, for those that need it.
    Fetch,
    /// It runs the item, stores what it made and publishes its files.
    Run,
    /// It publishes the stored files of an item that was up to date.
    Publish,
}

/// A change that a watcher noticed.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
pub struct Change {
    /// The file or folder, relative to the manifest's folder where it lies inside.
    pub path: String,
    /// What became of it.
    pub what: Changed,
}

/// What became of a file or folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Changed {
    /// It is new, or came back.
    Appeared,
    /// Its content may have changed.
    Changed,
    /// It has gone.
    Gone,
    /// Events were lost, so that everything below is looked at.
    Unknown,
}

/// What a build did.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Summary {
    /// Items that ran.
    pub ran: usize,
    /// Items that were up to date.
    pub up_to_date: usize,
    /// Items that failed.
    pub failed: usize,
    /// How many of them failed because of the system rather than the project: a full disk, a folder that cannot be
    /// written.
    #[serde(default)]
    pub system_errors: usize,
    /// Items that were skipped.
    pub skipped: usize,
    /// Files that were published or restored.
    pub published: usize,
    /// Files that were removed.
    pub removed: usize,
    /// Whether it was stopped before it was done, or left out an item whose file is being written.
    pub cancelled: bool,
    /// How long it took.
    pub milliseconds: f64,
}

#[cfg(test)]
mod tests {
    use expect_test::expect_file;
    use serde_json::Value;

    use super::*;

    /// A change of this file is a change of what programs read: see docs/events.md for what that asks for.
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

    /// Every property but the names of variants says what it is, itself or by what it refers to.
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
