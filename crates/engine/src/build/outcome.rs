//! The two ends of a run: what the run gave, and what the build makes of it.

use std::any::Any;
use std::path::PathBuf;
use std::sync::Arc;

use super::publish::{PublishError, PublishEvent};
use crate::kinds::Failure;
use crate::shared::{Place, Shared};
use crate::storage::{Blob, FileRead, Line};
use crate::timestamp::Timestamp;

/// What a run of an item gave, here or on another machine. Nothing of it has been recorded or published yet.
pub(crate) struct Ran {
    /// The outputs, which are in the store or known to be on a server; or why there are none.
    pub(crate) outputs: Result<Vec<Blob>, Failure>,
    /// The value of an artifact, if it is in memory.
    pub(crate) value: Option<Arc<dyn Any + Send + Sync>>,
    /// The contents of exported files, if they are in memory; `None` for each that the item leaves out.
    pub(crate) files: Option<Vec<Option<Vec<u8>>>>,
    pub(crate) reads: Vec<FileRead>,
    /// Their paths, by which a watcher knows them; of a run on another machine, none.
    pub(crate) paths: Vec<PathBuf>,
    /// The lines of the journal with the stamps of the files that the run read.
    pub(crate) stamps: Vec<Line>,
    pub(crate) started: Timestamp,
    pub(crate) milliseconds: f64,
    pub(crate) warnings: Vec<String>,
    pub(crate) notes: Vec<String>,
    /// Where it ran, in a build that lets items run elsewhere.
    pub(crate) place: Option<Place>,
    /// Where the outputs are, if they are perhaps not here.
    pub(crate) shared: Option<Shared>,
}

impl Ran {
    /// A run that began then and has given nothing so far.
    pub(crate) fn without_result(started: Timestamp) -> Self {
        Self {
            outputs: Err(Failure::cancelled()),
            value: None,
            files: None,
            reads: Vec::new(),
            paths: Vec::new(),
            stamps: Vec::new(),
            started,
            milliseconds: 0.0,
            warnings: Vec::new(),
            notes: Vec::new(),
            place: None,
            shared: None,
        }
    }
}

/// What the build makes of a run of an item, for the scheduler.
pub(crate) enum Outcome {
    /// The run was stopped, or a build that follows will run the item again because of what it read: nothing
    /// of it is recorded or reported.
    Stopped,
    /// The item failed. Nothing of that is recorded yet, because it does not count if a watcher has heard
    /// that a file which the run read has changed since.
    Failed {
        failure: Failure,
        warnings: Vec<String>,
        notes: Vec<String>,
        /// The paths of the files that the run read.
        paths: Vec<PathBuf>,
        /// The lines of the journal that record the failure.
        lines: Vec<Line>,
    },
    /// The item made its outputs, which are stored and recorded.
    Made {
        outputs: Vec<Blob>,
        /// The value of an artifact, if it is in memory.
        value: Option<Arc<dyn Any + Send + Sync>>,
        milliseconds: f64,
        warnings: Vec<String>,
        notes: Vec<String>,
        /// What was done to publish its files.
        events: Vec<PublishEvent>,
        /// Why its files could not be published.
        unpublished: Option<PublishError>,
    },
    /// The item did not run in its place, and goes to the next one.
    Refused(Refusal),
}

/// Why an item does not run in a place.
pub(crate) struct Refusal {
    /// What the item's record says of it.
    pub(crate) because: String,
    /// What is wrong with the place, if it is not the item, and has not been said before.
    pub(crate) trouble: Option<String>,
}

impl Refusal {
    pub(crate) fn of_item(because: impl Into<String>) -> Self {
        Self { because: because.into(), trouble: None }
    }

    /// A refusal because something is wrong with the place.
    pub(crate) fn by_fault(because: String) -> Self {
        Self { trouble: Some(because.clone()), because }
    }
}
