//! Everything that the engine tells: one closed enum, read by progress bars, `--json`, the watcher and the tests.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::{Digest, Faults, ItemKey};

/// An item's name in events: its stage and its key.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ItemName {
    /// The stage.
    pub stage: String,
    /// The key.
    pub key: ItemKey,
}

impl fmt::Display for ItemName {
    /// `reflection [sky, gold]`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.key.0.is_empty() {
            f.write_str(&self.stage)
        } else {
            write!(f, "{} [{}]", self.stage, self.key)
        }
    }
}

/// Why an item runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
        /// The digest now; `None` where it no longer arrives, or (in a dry run) is not yet known.
        new: Option<Digest>,
    },
    /// A file that it reads changed.
    File {
        /// The file, relative to the manifest's folder where it lies inside.
        path: String,
        /// The digest at the last run.
        old: Option<Digest>,
        /// The digest now; `None` where it is gone.
        new: Option<Digest>,
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
}

/// Something that happened during a build.
#[derive(Clone, Debug, PartialEq, Serialize)]
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
    /// The item's result is in the cache: nothing to run.
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
    /// An item was not run because one that it needs failed, or the build was stopped.
    Skipped {
        /// The item.
        item: ItemName,
        /// The item that failed; `None` where the build was stopped.
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
    /// The changed manifest, or what it names, has faults; the last good graph goes on. Told once for the same faults.
    Rejected {
        /// The faults.
        faults: Faults,
    },
    /// The manifest and what it names are sound again, after [`Event::Rejected`].
    Accepted,
    /// The build as a whole cannot go on: a lock, a full disk. Told once for the same error; the watcher tries again.
    Hindered {
        /// What happened, then its causes.
        error: Vec<String>,
        /// What to do.
        help: Option<String>,
    },
}

/// A change that a watcher noticed.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Change {
    /// The file or folder, relative to the manifest's folder where it lies inside.
    pub path: String,
    /// What became of it.
    pub what: Changed,
}

/// What became of a file or folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
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
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Items that ran.
    pub ran: usize,
    /// Items that were up to date.
    pub up_to_date: usize,
    /// Items that failed.
    pub failed: usize,
    /// Items that were skipped.
    pub skipped: usize,
    /// Files that were published or restored.
    pub published: usize,
    /// Files that were removed.
    pub removed: usize,
    /// Whether it was stopped before it was done.
    pub cancelled: bool,
    /// How long it took.
    pub milliseconds: f64,
}
