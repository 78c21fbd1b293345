//! Checks the sources of items without running the items: what their text and headers say.
//!
//! A build finds these errors too, when the item runs. A check takes a moment, because it reads no pixels and
//! writes nothing.

use std::sync::Arc;

use serde::Serialize;

use crate::build::{UpToDateCheck, out_folder};
use crate::cancel::Cancel;
use crate::event::ItemName;
use crate::kinds::Context;
use crate::parallel;
use crate::plan::{Plan, Selection};
use crate::storage::{Disk, Reader, State, path_name};

/// An item whose source has errors, so that a run of the item would fail.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SourceError {
    /// The item.
    pub item: ItemName,
    /// The item's source, relative to the manifest's folder if it is inside.
    pub source: String,
    /// What is wrong, then its causes.
    pub error: Vec<String>,
    /// What to do.
    pub help: Option<String>,
}

/// Checks the sources of all items, in parallel; returns the errors in the order of the plan.
///
/// # Errors
/// If files cannot be published into `out`: that is not a folder. If sources of earlier builds cannot be
/// seen, or the records of those builds cannot be read.
pub fn check_sources(plan: &Plan) -> Result<Vec<SourceError>, crate::error::Error> {
    out_folder::check(plan)?;
    let state = State::read(&plan.state)?;
    let disk = Disk::new(state.now, Arc::default(), &Cancel::default());
    UpToDateCheck::with_records(plan, &state, &disk, &Selection::all(plan), None).check_seen()?;
    let folder = plan.manifest.parent().unwrap_or(&plan.manifest);
    let sources = plan.items.iter().enumerate();
    let sources = sources.filter_map(|(item, of)| Some((item, of.stage, of.source.as_ref()?)));
    let sources = sources.collect::<Vec<_>>();
    // A file that is being written meanwhile is as good as one that is written after the check.
    let files = Reader::new(i64::MAX, &Cancel::default());
    let checked = parallel::map(sources.len(), &|index| {
        let (item, stage, source) = sources[index];
        let context = Context::new(&files).with_source(source.clone()).with_folder(folder.to_path_buf());
        let failure = plan.stages[stage].configured.check_source(&context).err()?;
        let source = path_name(folder, source);
        Some(SourceError { item: plan.item_name(item), source, error: failure.chain, help: failure.help })
    });
    Ok(checked.into_iter().flatten().collect())
}
