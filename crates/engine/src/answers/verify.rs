//! Whether an exported file is what its recipe says, and whether anything that it was made from has changed
//! since.
//!
//! A file is recognized by its place in `out`, or, if it was moved or copied, by its digest or by the recipe
//! in it. From the record of the run that made it, its ancestry is followed up to the source files.

use std::cell::{LazyCell, OnceCell};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;

use crate::build::{Forecast, Published, Publisher, UpToDateCheck, forecast, forecast_causes, has_made};
use crate::cancel::Cancel;
use crate::error::{Error, ErrorKind};
use crate::event::ItemName;
use crate::key::Digest;
use crate::plan::{ItemIndex, Plan, Selection, names_in_out};
use crate::platform::path_text;
use crate::shared::Shared;
use crate::storage::{
    Cause, Disk, FromCache, InputUsed, ReadKind, Record, State, modified, read_file, recipe,
};
use crate::timestamp::Timestamp;

mod out;

pub use out::{FilesToVerify, MissingFile, OutVerification, verify_out};

/// The verification of an exported file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verification {
    /// The requested file.
    pub file: String,
    /// The digest of the file's bytes.
    pub digest: Digest,
    /// The item that exports it; `None` if the manifest no longer has one that does.
    pub item: Option<ItemName>,
    /// When the run that made the file started.
    pub made: Timestamp,
    /// The item of that run: another one if the item took over a result from the cache.
    pub maker: ItemName,
    /// Whether the file's bytes are the last result, an earlier one, or none.
    pub content: ContentState,
    /// The file's recipe, compared with the record's.
    pub recipe: RecipeState,
    /// The files that the exported file and its ancestors were made from.
    pub sources: Vec<SourceFile>,
    /// The parameters and kinds in its ancestry that have changed since.
    pub revised: Vec<Cause>,
    /// The ancestors that the manifest no longer has.
    pub gone: Vec<ItemName>,
    /// The ancestors without a remaining record: what they were made from is not known.
    pub forgotten: Vec<ItemName>,
    /// Whether a build would make the file again, as far as that can be known.
    pub would_run: bool,
    /// The causes of that rerun.
    pub causes: Vec<Cause>,
}

impl Verification {
    /// Whether a build would leave the file as it is.
    pub fn is_current(&self) -> bool {
        self.content == ContentState::Current
            && !matches!(self.recipe, RecipeState::Differs { .. })
            && self.sources.iter().all(|source| source.old == source.new)
            && self.revised.is_empty()
            && self.gone.is_empty()
            && !self.would_run
    }
}

/// Whether the bytes of an exported file are the last result of its item, an earlier one, or none.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "content", rename_all = "kebab-case")]
pub enum ContentState {
    /// The bytes are the last result of the file's item.
    Current,
    /// The bytes are a result of an earlier run.
    Earlier,
    /// The bytes are no result: someone changed the file.
    Altered {
        /// The digest of the result.
        made: Option<Digest>,
    },
}

/// The recipe of an exported file, and whether it is that of the run which made the file.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "recipe", rename_all = "kebab-case")]
pub enum RecipeState {
    /// The file holds the recipe of its record.
    AsRecorded {
        /// The file beside it that holds the recipe, if its own format cannot.
        beside: Option<PathBuf>,
    },
    /// The file holds another recipe.
    Differs {
        /// The recipe that the file holds.
        found: String,
        /// The recipe of the file's record.
        recorded: String,
    },
    /// Neither the file nor one beside it holds a recipe.
    Absent,
}

/// Something that a result was made from: a file, the names in a folder, or where PATH leads.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SourceFile {
    /// The path, relative to the manifest's folder if it is inside; for a look-up, the program's name.
    pub path: String,
    /// What was asked of the path: in JSON, `listing` and, for a look-up, `lookup`.
    #[serde(flatten)]
    pub kind: ReadKind,
    /// The digest when it was read; `None` if it was looked for and did not exist.
    pub old: Option<Digest>,
    /// The digest now; `None` if it does not exist.
    pub new: Option<Digest>,
    /// The file that a look-up found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub old_found: Option<String>,
    /// The file that a look-up finds now.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub new_found: Option<String>,
    /// When the file that was read had been modified, by its file system, if that was recorded.
    pub old_time: Option<Timestamp>,
    /// When the present file was modified, by its file system.
    pub new_time: Option<Timestamp>,
}

/// The item that made a result, and the sources of that.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Origin {
    /// The item.
    pub item: ItemName,
    /// The files that it and the items before it were made from.
    pub sources: Vec<String>,
}

/// Reports whether an exported file is as it was published, and whether that is up to date.
///
/// `bytes` are the file's; `recipe_of` reads the recipe from a file of any format. Nothing is written, and a
/// build may be running.
///
/// # Errors
/// If no output of this manifest is known by that place, content or recipe, or the records cannot be read.
pub fn verify(
    plan: &Plan,
    file: &Path,
    bytes: &[u8],
    recipe_of: &RecipeOf<'_>,
) -> Result<Verification, Error> {
    Verifier::open(plan, recipe_of, |verifier| {
        let names = names_in_out(plan, file);
        verifier.verify(file, &names, &FileContent::of(bytes, recipe_of)).ok_or_else(|| unknown(file))
    })
}

struct FileContent {
    digest: Digest,
    recipe: Option<String>,
}

impl FileContent {
    fn of(bytes: &[u8], recipe_of: &dyn Fn(&[u8]) -> Option<String>) -> Self {
        Self { digest: Digest::of(bytes), recipe: recipe_of(bytes) }
    }
}

/// Verifies files of one plan: what a build would do is found out once for all of them.
struct Verifier<'a> {
    check: &'a UpToDateCheck<'a>,
    publisher: Publisher<'a>,
    records: Records<'a>,
    forecasts: Vec<Option<Forecast>>,
    causes: Vec<Vec<Cause>>,
    recipe_of: &'a RecipeOf<'a>,
}

/// Reads the recipe from a file of any format.
type RecipeOf<'a> = dyn Fn(&[u8]) -> Option<String> + Sync + 'a;

impl Verifier<'_> {
    /// Opens the records of a plan for a function that verifies files.
    fn open<T>(
        plan: &Plan,
        recipe_of: &RecipeOf<'_>,
        act: impl FnOnce(&Verifier<'_>) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let state = State::read(&plan.state)?;
        let disk = Disk::new(state.now, Arc::default(), &Cancel::default());
        let selected = Selection::all(plan);
        let check = UpToDateCheck::new(plan, &state, &disk, &selected);
        check.check_seen()?;
        let forecasts = forecast(&check, &selected);
        act(&Verifier {
            check: &check,
            publisher: Publisher::new(plan, &state),
            records: Records::new(&check),
            causes: forecast_causes(&check, &forecasts),
            forecasts,
            recipe_of,
        })
    }

    /// Verifies a file with these names in `out`, if it is there; `None` if no record has its place, its
    /// digest or its recipe.
    fn verify(&self, file: &Path, names: &[String], read: &FileContent) -> Option<Verification> {
        let (check, records, digest) = (self.check, &self.records, read.digest);
        let found = records.by_path(names, digest).or_else(|| records.by_digest(digest, file));
        let found = found.or_else(|| records.by_recipe(read.recipe.as_deref()?, file));
        let Match { item, record, output, content } = found?;
        let published = |name: &String| self.publisher.entry(name).as_ref().and_then(Published::owned);
        let content = match content {
            ContentState::Altered { made: None } => {
                let made = record.outputs.get(output).map(|blob| blob.digest);
                ContentState::Altered { made: names.iter().find_map(published).or(made) }
            }
            content => content,
        };
        let would_run = item.is_some_and(|item| matches!(self.forecasts[item], Some(Forecast::Runs(_))));
        let mut ancestry = Ancestry::default();
        ancestry.follow(records, item, &record);
        Some(Verification {
            file: file.display().to_string(),
            digest,
            item: item.map(|item| check.name(item)),
            made: record.started,
            maker: record.maker().0.clone(),
            content,
            recipe: records.compare_recipe(read.recipe.clone(), self.recipe_of, file, item, output, &record),
            sources: ancestry.sources,
            revised: ancestry.revised,
            gone: ancestry.gone,
            forgotten: ancestry.forgotten,
            would_run,
            causes: item.filter(|_| would_run).map_or_else(Vec::new, |item| self.causes[item].clone()),
        })
    }
}

fn unknown(file: &Path) -> Error {
    let message = format!(
        "{} was not produced by this manifest: no record has its path in out, its digest or its recipe",
        path_text(file)
    );
    Error::new(ErrorKind::UnknownTarget, message).with_help(
        "name an exported file and, with --manifest, the manifest that exported it; `specula inspect` \
         describes any file",
    )
}

/// The run that made a file.
struct Match {
    /// The item, if the plan has it.
    item: Option<ItemIndex>,
    record: Record,
    /// Which of the item's outputs the file is.
    output: usize,
    content: ContentState,
}

/// The records of the last runs, and the earlier ones that remain.
pub(crate) struct Records<'a> {
    pub(crate) check: &'a UpToDateCheck<'a>,
    manifest: String,
    items: HashMap<ItemName, ItemIndex>,
    /// The files of the plan, each with its item and which of the item's outputs it is.
    places: OnceCell<HashMap<&'a str, (ItemIndex, usize)>>,
    /// The latest records, as far as they were needed.
    last: Vec<OnceCell<Option<Record>>>,
    earlier: LazyCell<Vec<Record>, Box<dyn FnOnce() -> Vec<Record> + 'a>>,
}

impl<'a> Records<'a> {
    pub(crate) fn new(check: &'a UpToDateCheck<'a>) -> Self {
        let items = (0..check.plan.items.len()).map(|item| (check.name(item), item)).collect();
        let read: Box<dyn FnOnce() -> Vec<Record> + 'a> = Box::new(|| {
            let mut records = check
                .state
                .journal
                .results_by_age::<Record>()
                .into_iter()
                .map(|(_, record)| record)
                .collect::<Vec<_>>();
            // The newest first.
            records.sort_by_key(|record| std::cmp::Reverse(record.started));
            records
        });
        let last = vec![OnceCell::new(); check.plan.items.len()];
        let (manifest, places) = (check.plan.manifest_name(), OnceCell::new());
        Self { check, manifest, items, places, last, earlier: LazyCell::new(read) }
    }

    /// The origin of a file with this content, which may be in any place; `None` if no record has it.
    pub(crate) fn origin(&self, digest: Digest, file: &Path) -> Option<Origin> {
        let Match { item, record, .. } = self.by_digest(digest, file)?;
        Some(Origin { item: record.item.clone(), sources: self.sources(item, &record) })
    }

    /// The files that the artifact of another item was made from; none if its record is gone.
    pub(crate) fn sources_of_input(&self, used: &InputUsed) -> Vec<String> {
        let record = self.maker(&used.item, used.digest);
        record.map_or_else(Vec::new, |record| self.sources(self.items.get(&used.item).copied(), record))
    }

    /// The files that the result of a run was made from, by the item itself and by those before it.
    pub(crate) fn sources(&self, item: Option<ItemIndex>, record: &Record) -> Vec<String> {
        let mut ancestry = Ancestry::default();
        ancestry.follow(self, item, record);
        let is_file = |source: &SourceFile| source.kind == ReadKind::Content && source.old.is_some();
        let files = ancestry.sources.into_iter().filter(is_file);
        files.map(|source| source.path).collect()
    }

    /// The latest record of an item.
    fn record(&self, item: ItemIndex) -> Option<&Record> {
        self.last[item].get_or_init(|| self.check.record(item)).as_ref()
    }

    /// The latest record of an item, if it is not a failure.
    fn last(&self, item: ItemIndex) -> Option<&Record> {
        self.record(item).filter(|record| record.failure.is_none())
    }

    /// The item that exports a file, and which of its outputs the file is.
    fn place(&self, file: &str) -> Option<(ItemIndex, usize)> {
        let places = self.places.get_or_init(|| {
            let items = self.check.plan.items.iter().enumerate();
            let files = items.flat_map(|(item, this)| {
                this.files.iter().enumerate().map(move |(output, file)| (file.as_str(), (item, output)))
            });
            files.collect()
        });
        places.get(file).copied()
    }

    /// The run that made a file of the plan, whatever the file contains now.
    fn by_path(&self, names: &[String], digest: Digest) -> Option<Match> {
        let (item, output) = names.iter().find_map(|name| self.place(name))?;
        let is_this = |record: &Record| record.outputs.get(output).is_some_and(|blob| blob.digest == digest);
        let found = |record, content| Some(Match { item: Some(item), record, output, content });
        if let Some(record) = self.last(item).filter(|record| is_this(record)) {
            return found(record.clone(), ContentState::Current);
        }
        if let Some(record) = self.earlier_of(item, is_this) {
            return found(record, ContentState::Earlier);
        }
        let made = self.record(item)?.outputs.get(output)?.digest;
        let of_made = |record: &Record| record.outputs.get(output).is_some_and(|blob| blob.digest == made);
        let record = self.last(item).cloned().or_else(|| self.earlier_of(item, of_made))?;
        found(record, ContentState::Altered { made: None })
    }

    /// The newest earlier record of an item that `is_this` accepts. If there is none, that of another item
    /// with the same inputs, as if it were this one's.
    fn earlier_of(&self, item: ItemIndex, is_this: impl Fn(&Record) -> bool) -> Option<Record> {
        let mut found = self.earlier.iter().filter(|record| is_this(record));
        let own = found.clone().find(|record| self.check.is_of(item, record));
        own.cloned().or_else(|| found.find_map(|record| self.adopted(item, record)))
    }

    /// Another item's record with this item's inputs; `None` if the two have different kinds or ports.
    fn adopted(&self, item: ItemIndex, record: &Record) -> Option<Record> {
        let inputs = self.check.inputs(item, |_| &[]);
        let is_like = record.kind == self.check.plan.stages[self.check.plan.items[item].stage].kind.name()
            && record.source == self.check.source(item)
            && inputs.iter().map(|used| &used.port).eq(record.inputs.iter().map(|used| &used.port));
        let digests = record.inputs.iter().map(|used| used.digest);
        let inputs = inputs.into_iter().zip(digests).map(|(used, digest)| InputUsed { digest, ..used });
        let (maker, manifest) = record.maker();
        let from_cache = FromCache {
            since: record.started,
            item: maker.clone(),
            manifest: manifest.into(),
            shared: record.shared.as_ref().map(Shared::origin),
        };
        is_like.then(|| Record {
            item: self.check.name(item),
            inputs: inputs.collect(),
            from_cache: Some(from_cache),
            ..record.clone()
        })
    }

    /// A copy of an exported file, under any name. If several items made the same, one whose file has the
    /// name of the copy.
    fn by_digest(&self, digest: Digest, file: &Path) -> Option<Match> {
        let exports = |item: &ItemIndex| !self.check.plan.items[*item].files.is_empty();
        let is_called = |item: ItemIndex| {
            let mut files = self.check.plan.items[item].files.iter();
            files.any(|name| Path::new(name).file_name() == file.file_name())
        };
        let place = |record: &Record| record.outputs.iter().position(|blob| blob.digest == digest);
        let last = (0..self.check.plan.items.len()).filter(exports).filter_map(|item| {
            let record = self.last(item)?;
            Some((item, record, place(record)?))
        });
        if let Some((item, record, output)) = last.min_by_key(|(item, ..)| !is_called(*item)) {
            let content = ContentState::Current;
            return Some(Match { item: Some(item), record: record.clone(), output, content });
        }
        let earlier = self.earlier.iter();
        let earlier = earlier.filter_map(|record| Some((self.item_of(record), record, place(record)?)));
        let (item, record, output) =
            earlier.min_by_key(|(item, ..)| item.map_or(2, |item| usize::from(!is_called(item))))?;
        Some(Match { item, record: record.clone(), output, content: ContentState::Earlier })
    }

    /// The run that made a file of which this is a copy that was changed, except for its recipe.
    fn by_recipe(&self, embedded: &str, file: &Path) -> Option<Match> {
        let exports = |item: &ItemIndex| !self.check.plan.items[*item].files.is_empty();
        let mut last = (0..self.check.plan.items.len()).filter(exports);
        let last = last.find_map(|item| {
            let record = self.last(item)?;
            (self.recipe(Some(item), record) == embedded).then_some((Some(item), record))
        });
        let (item, record) = last.or_else(|| {
            let mut earlier = self.earlier.iter().map(|record| (self.item_of(record), record));
            earlier.find(|(item, record)| self.recipe(*item, record) == embedded)
        })?;
        let files = item.map_or(&[][..], |item| &self.check.plan.items[item].files[..]);
        let output =
            files.iter().position(|name| Path::new(name).extension() == file.extension()).unwrap_or(0);
        Some(Match { item, record: record.clone(), output, content: ContentState::Altered { made: None } })
    }

    /// The item of the plan with an earlier record.
    fn item_of(&self, record: &Record) -> Option<ItemIndex> {
        self.items.get(&record.item).copied().filter(|_| record.manifest == self.manifest)
    }

    /// The record of an item's artifact: its latest one, or the newest with the same output. Not that of
    /// another item, which read other files.
    fn maker(&self, name: &ItemName, digest: Digest) -> Option<&Record> {
        let made = |record: &&Record| has_made(record, digest);
        let last = self.items.get(name).and_then(|item| self.last(*item)).filter(made);
        let is_of = |record: &&Record| record.item == *name && record.manifest == self.manifest;
        last.or_else(|| self.earlier.iter().filter(is_of).find(made))
    }

    fn recipe(&self, item: Option<ItemIndex>, record: &Record) -> String {
        let is_many = |port: &str| match item {
            Some(item) => self.check.stages[self.check.plan.items[item].stage].many.contains(port),
            None => record.inputs.iter().filter(|used| used.port == port).count() > 1,
        };
        recipe(&record.kind, record.revision, &record.parameters, &record.inputs, is_many)
    }

    fn compare_recipe(
        &self,
        embedded: Option<String>,
        recipe_of: &dyn Fn(&[u8]) -> Option<String>,
        file: &Path,
        item: Option<ItemIndex>,
        output: usize,
        record: &Record,
    ) -> RecipeState {
        let beside = || self.beside(file, item?, output, recipe_of);
        let (found, beside) = match embedded.map(|found| (found, None)).or_else(beside) {
            Some(found) => found,
            None => return RecipeState::Absent,
        };
        let recorded = self.recipe(item, record);
        if found == recorded {
            RecipeState::AsRecorded { beside }
        } else {
            RecipeState::Differs { found, recorded }
        }
    }

    /// The recipe in another file of the item, beside it or in `out`, if the file's own format holds none.
    fn beside(
        &self,
        file: &Path,
        item: ItemIndex,
        output: usize,
        recipe_of: &dyn Fn(&[u8]) -> Option<String>,
    ) -> Option<(String, Option<PathBuf>)> {
        let files = &self.check.plan.items[item].files;
        let folder = Path::new(files.get(output)?).parent()?;
        let others = files.iter().enumerate().filter(|(index, _)| *index != output);
        let places = others.flat_map(|(_, name)| {
            let near = Path::new(name).strip_prefix(folder).ok();
            let near = near.and_then(|name| Some(file.parent()?.join(name)));
            near.into_iter().chain([self.check.plan.out.join(name)])
        });
        places.into_iter().find_map(|place| Some((recipe_of(&read_file(&place).ok()?)?, Some(place))))
    }
}

/// The ancestry of a file: everything that it was made from, up to its sources.
#[derive(Default)]
struct Ancestry {
    sources: Vec<SourceFile>,
    revised: Vec<Cause>,
    gone: Vec<ItemName>,
    forgotten: Vec<ItemName>,
}

impl Ancestry {
    fn follow(&mut self, records: &Records<'_>, item: Option<ItemIndex>, record: &Record) {
        let check = records.check;
        let mut seen = HashSet::new();
        let mut open =
            vec![(item, item.map(|item| check.name(item)).into_iter().collect::<Vec<_>>(), record)];
        while let Some((item, chain, record)) = open.pop() {
            for reason in item.map_or_else(Vec::new, |item| check.revisions(item, record)) {
                self.revised.push(Cause { reason, chain: chain.clone() });
            }
            for read in &record.reads {
                if self.sources.iter().any(|known| known.path == read.path && known.kind == read.kind) {
                    continue;
                }
                self.sources.push(SourceFile {
                    path: read.path.clone(),
                    kind: read.kind,
                    old: read.digest,
                    new: check.current_digest(&read.path, read.kind),
                    old_found: read.found.clone(),
                    new_found: (read.kind == ReadKind::Lookup).then(|| check.program(&read.path)).flatten(),
                    old_time: read.modified,
                    new_time: modified(&check.folder.join(&read.path)),
                });
            }
            for used in &record.inputs {
                if !seen.insert((&used.item, used.digest)) {
                    continue;
                }
                let item = records.items.get(&used.item).copied();
                if item.is_none() {
                    self.gone.push(used.item.clone());
                }
                match records.maker(&used.item, used.digest) {
                    Some(record) => {
                        let chain = [std::slice::from_ref(&used.item), &chain[..]].concat();
                        open.push((item, chain, record));
                    }
                    None => self.forgotten.push(used.item.clone()),
                }
            }
        }
        self.sources.sort_by(|a, b| a.path.cmp(&b.path));
    }
}
