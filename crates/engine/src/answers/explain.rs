//! Why an item would run or not, and what its last run did.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;

use super::verify::{Origin, Records};
use crate::build::{Forecast, Published, Publisher, UpToDateCheck, forecast, forecast_causes};
use crate::cancel::Cancel;
use crate::error::{Error, ErrorKind};
use crate::event::{ItemName, Reason};
use crate::key::Digest;
use crate::kinds::is_left_out;
use crate::manifest::nearest;
use crate::plan::{ItemIndex, Plan, Selection, first_item, item_named, names_in_out};
use crate::shared::Place;
use crate::storage::{
    Cause, Disk, FileRead, FromCache, InputUsed, Record, State, hash, modified, normal, recipe, slashed,
};
use crate::timestamp::Timestamp;

/// The explanation of one item.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Explanation {
    /// The item.
    pub item: ItemName,
    /// Whether a build would run it now.
    pub would_run: bool,
    /// Why it would run: every difference from its last run. Empty if it would not.
    pub reasons: Vec<Reason>,
    /// The causes of the rerun: the files, parameters and kinds that changed first. At most eight.
    pub causes: Vec<Cause>,
    /// Whether a build takes the result of an earlier run from the cache.
    pub restored: bool,
    /// The run that made the present result and why the item has it, or the failure of the last run; `None`
    /// if there is neither.
    pub last: Option<LastRun>,
    /// The files that it exports.
    pub files: Vec<ExportedFile>,
    /// The files that its outputs are, also those that it leaves out; empty if its output is an artifact.
    pub outputs: Vec<String>,
}

/// What a run did. If its result came from the cache, the times and the version are those of the run that
/// made it, and everything else is this item's own.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LastRun {
    /// When the run started.
    pub started: Timestamp,
    /// How long the run took.
    pub milliseconds: f64,
    /// The version of the program that ran the item.
    pub version: String,
    /// The kind and its revision: `project-sh 3`.
    pub kind: String,
    /// Why the item ran, or why its result came from the cache.
    pub reasons: Vec<Reason>,
    /// The causes of the run, in the form of [`Explanation::causes`].
    pub causes: Vec<Cause>,
    /// The origin of the result if it came from the cache; `None` if the item ran for these reasons.
    pub from_cache: Option<FromCache>,
    /// Where the item ran, in a build with other machines, and if here, why.
    pub place: Option<Place>,
    /// The warnings of the run.
    pub warnings: Vec<String>,
    /// The notes of the run.
    pub notes: Vec<String>,
    /// The artifacts at the item's ports.
    pub inputs: Vec<InputOrigin>,
    /// Everything that the run read: files, names in folders, and where PATH leads.
    pub reads: Vec<FileRead>,
    /// The item's parameters with defaults filled in, kind, revision and input digests: canonical JSON, as
    /// exported files hold it.
    pub recipe: String,
    /// The digests of its outputs; empty if it failed. An export has one for each of its files, in the order
    /// of [`Explanation::outputs`].
    pub results: Vec<Digest>,
    /// The files that it and the items before it were made from.
    pub sources: Vec<String>,
    /// What happened and its causes, if the run failed.
    pub failure: Option<Vec<String>>,
}

/// An artifact that a run used, and what that was made from.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InputOrigin {
    /// The artifact.
    #[serde(flatten)]
    pub used: InputUsed,
    /// The files that it was made from; empty if the record of the run that made it is gone.
    pub sources: Vec<String>,
}

/// A file in `out`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExportedFile {
    /// The path relative to `out`.
    pub file: String,
    /// The digest of what was published there last; `None` if nothing was.
    pub digest: Option<Digest>,
    /// The file's present state.
    pub state: FileState,
}

/// The present state of an exported file.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "state", rename_all = "kebab-case")]
pub enum FileState {
    /// The file is as it was published.
    AsPublished,
    /// The file was published and no longer exists.
    Gone,
    /// Someone else changed the file since it was published.
    Altered {
        /// The digest of the file's present content; `None` if it cannot be read.
        digest: Option<Digest>,
        /// When the file was modified, by its file system.
        modified: Option<Timestamp>,
        /// The origin of the file's present content; `None` if no run made it.
        made_by: Option<Origin>,
    },
    /// No file was published at this path.
    NeverPublished,
}

/// Explains the items of a stage, one of them, or the item that exports a file.
///
/// `target` is a stage's name, an item as events name it (`reflection [sky, gold]`), or a file of `out`:
/// relative to `out`, relative to the current folder, or absolute. Nothing is written, and a build may be
/// running.
///
/// # Errors
/// If there is no such stage or file, or the records cannot be read.
pub fn explain(plan: &Plan, target: &str) -> Result<Vec<Explanation>, Error> {
    let items = targets(plan, target)?;
    let stages = items.iter().map(|item| plan.stages[plan.items[*item].stage].name.clone());
    let selected = Selection::of(plan, &stages.take(1).collect::<Vec<_>>())?;
    let state = State::read(&plan.state)?;
    let disk = Disk::new(state.now, Arc::default(), &Cancel::default());
    let check = UpToDateCheck::new(plan, &state, &disk, &selected);
    let publisher = Publisher::new(plan, &state);
    let records = Records::new(&check);
    let mut forecasts = forecast(&check, &selected);
    let mut causes = forecast_causes(&check, &forecasts);
    let explained = items.into_iter().map(|item| {
        let (reasons, restored) = match forecasts[item].take() {
            Some(Forecast::Runs(reasons)) => (Some(reasons), false),
            Some(Forecast::Current { restored, .. }) => (None, restored),
            None => (None, false),
        };
        let outputs = check.latest(item).map_or(&[][..], |latest| latest.outputs());
        let is_left_out = |output: usize| outputs.get(output).is_some_and(|blob| is_left_out(blob.digest));
        let files = plan.items[item].files.iter().enumerate().filter(|(output, _)| !is_left_out(*output));
        let files = files.map(|(_, file)| exported(&records, &publisher, file));
        Explanation {
            item: check.name(item),
            would_run: reasons.is_some(),
            causes: if reasons.is_some() { std::mem::take(&mut causes[item]) } else { Vec::new() },
            reasons: reasons.unwrap_or_default(),
            restored,
            last: check.record(item).map(|record| last_run(&records, item, &record)),
            files: files.collect(),
            outputs: plan.items[item].files.clone(),
        }
    });
    Ok(explained.collect())
}

/// The present state of a file of `out`.
fn exported(records: &Records<'_>, publisher: &Publisher<'_>, file: &str) -> ExportedFile {
    let plan = records.check.plan;
    let digest = publisher.entry(file).as_ref().and_then(Published::owned);
    let place = plan.out.join(file);
    let state = match digest {
        None => FileState::NeverPublished,
        Some(digest) if publisher.is_in_place(file, digest) => FileState::AsPublished,
        Some(_) if std::fs::symlink_metadata(&place).is_err() => FileState::Gone,
        Some(_) => {
            let digest = hash(&place).ok();
            let made_by = digest.and_then(|digest| records.origin(digest, &place));
            FileState::Altered { digest, modified: modified(&place), made_by }
        }
    };
    ExportedFile { file: file.into(), digest, state }
}

fn last_run(records: &Records<'_>, item: ItemIndex, record: &Record) -> LastRun {
    let check = records.check;
    let many = &check.stages[check.plan.items[item].stage].many;
    let is_many = |port: &str| many.contains(port);
    let failed = record.failure.is_some();
    let inputs = record
        .inputs
        .iter()
        .map(|used| InputOrigin { used: used.clone(), sources: records.sources_of_input(used) });
    LastRun {
        started: record.started,
        milliseconds: record.milliseconds,
        version: record.version.clone(),
        kind: record.kind_name(),
        reasons: record.reasons.clone(),
        causes: check.causes_of(item, record),
        from_cache: record.from_cache.clone(),
        place: record.place.clone(),
        warnings: record.warnings.clone(),
        notes: record.notes.clone(),
        inputs: inputs.collect(),
        reads: record.reads.clone(),
        recipe: recipe(&record.kind, record.revision, &record.parameters, &record.inputs, is_many),
        results: record.outputs.iter().filter(|_| !failed).map(|blob| blob.digest).collect(),
        sources: records.sources(Some(item), record),
        failure: record.failure.clone(),
    }
}

/// The items of a stage, one item, the item that exports a file, or those whose source it is.
fn targets(plan: &Plan, target: &str) -> Result<Vec<ItemIndex>, Error> {
    if let Some(stage) = plan.stages.iter().position(|stage| stage.name == target) {
        return Ok((0..plan.items.len()).filter(|item| plan.items[*item].stage == stage).collect());
    }
    if let Some(item) = item_named(plan, target) {
        return Ok(vec![item]);
    }
    let names = names_of(plan, target);
    let exports = |item: &ItemIndex| plan.items[*item].files.iter().any(|file| names.contains(file));
    if let Some(item) = (0..plan.items.len()).find(exports) {
        return Ok(vec![item]);
    }
    let read = items_of_source(plan, Path::new(target));
    if !read.is_empty() {
        return Ok(read);
    }
    let message = format!("{target:?} is not a stage, an item, an exported file or a source file");
    let error = Error::new(ErrorKind::UnknownTarget, message);
    let stages = plan.stages.iter().map(|stage| stage.name.as_str());
    let files = plan.items.iter().flat_map(|item| item.files.iter().map(String::as_str));
    Err(match (nearest(target, stages.chain(files)), first_item(plan, target)) {
        (_, Some(first)) => error.with_help(first),
        (Some(near), _) => error.with_help(format!("did you mean {near:?}?")),
        _ => error.with_help("name a stage, an item as builds name it, or a file in out"),
    })
}

/// The items whose source a path is, relative to the working folder or to the manifest's.
fn items_of_source(plan: &Plan, path: &Path) -> Vec<ItemIndex> {
    let folders = [std::env::current_dir().ok(), plan.manifest.parent().map(Path::to_path_buf)];
    let places = folders.iter().flatten().map(|folder| normal(&folder.join(path))).collect::<Vec<_>>();
    let is_meant = |source: &PathBuf| places.contains(&normal(source));
    (0..plan.items.len()).filter(|item| plan.items[*item].source.as_ref().is_some_and(is_meant)).collect()
}

/// The names that a path may have relative to `out`.
fn names_of(plan: &Plan, target: &str) -> Vec<String> {
    let path = Path::new(target);
    let mut names = vec![slashed(&normal(path))];
    names.extend(names_in_out(plan, path));
    names
}
