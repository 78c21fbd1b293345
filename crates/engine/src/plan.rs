//! The graph of stages and the items that they stand for.
//!
//! A manifest becomes a plan in three steps, whose errors are all reported at once:
//!
//! 1. `manifest.rs`: the text as declarations;
//! 2. `graph.rs`: kinds, parameters, ports, types, order: a [`Graph`], which knows its [`Source`]s;
//! 3. `items.rs`: the files on disk as items, with their keys, inputs and output paths.
//!
//! The first two read no file but the manifest. When files appear or disappear, only the third is repeated:
//! [`Graph::expand`].

mod names_in_out;
mod selection;
mod wanted;

use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use crate::event::ItemName;
use crate::kinds::{Configured, ErasedKind, Kinds, Port, Product, RecipeReader};
use crate::manifest::{Diagnostic, Diagnostics, Document, Table, nearest};
use crate::platform::{self, path_text};
use crate::storage::regular;

pub use names_in_out::names_in_out;
pub(crate) use selection::{Selection, first_item, item_named};
pub use wanted::Wanted;

mod clashes;
mod cycles;
mod folders;
mod glob;
mod graph;
mod index;
mod items;
mod manifest;
mod schema;
mod search;
mod source;
pub(crate) mod template;

use search::Search;

pub use folders::{DiskFolders, Folders, Found, Name};
pub(crate) use folders::{FolderQueries, RecordingFolders};
pub use graph::Graph;
pub use index::{ItemIndex, StageIndex};
pub use items::Item;
pub use source::Source;
pub(crate) use source::listed;

/// A stage of the manifest with its kind, parameters and connections.
#[derive(Clone)]
pub struct Stage {
    /// The name.
    pub name: String,
    /// The kind.
    pub kind: Arc<dyn ErasedKind>,
    /// The kind with this stage's parameters.
    pub configured: Arc<dyn Configured>,
    /// The stage's parameters as the manifest has them.
    pub parameters: Table,
    /// The ports of the kind, or, if the kind accepts any port, those that the stage names.
    pub ports: Vec<Port>,
    /// The connected ports, in the order of `ports`, each with the stage that feeds it.
    pub inputs: Vec<(String, StageIndex)>,
    /// The files that it reads, for a kind that has a source.
    pub source: Option<Source>,
    /// The product of an item of the stage.
    pub product: Product,
}

/// Everything that a manifest describes: stages and items, each before those that need it.
#[derive(Clone)]
pub struct Plan {
    /// The manifest file. Absolute.
    pub manifest: PathBuf,
    /// The folder for exports. Absolute.
    pub out: PathBuf,
    /// The folder that contains `.specula`: the manifest's folder, except in trial builds. Absolute.
    pub state: PathBuf,
    /// The stages, in topological order, ties in the order of the manifest. Clones of the plan share them.
    pub stages: Arc<[Stage]>,
    /// The items, stage by stage in the order of `stages`, sorted by key within one. Clones of the plan share
    /// them.
    pub items: Arc<[Item]>,
    /// Warnings of what a person should check in the manifest, such as a file that a glob misses by its case.
    pub warnings: Diagnostics,
    /// Finds the recipe in an exported file.
    pub recipe_reader: RecipeReader,
    /// Computed when a watcher asks for it.
    pub(crate) output_folders: Arc<OnceLock<Vec<String>>>,
}

/// A manifest: its name in messages, and where it is.
///
/// The place does not depend on the working folder, because a folder may be moved away and another one put in
/// its place: a process keeps the old one as its working folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ManifestFile {
    /// The name in messages, usually as the user gave it.
    pub name: String,
    /// The absolute path.
    pub path: PathBuf,
}

impl ManifestFile {
    /// The manifest at a path, which is relative to the present working folder.
    pub fn of(path: &Path) -> Self {
        Self { name: path_text(path), path: platform::absolute(path) }
    }
}

impl Plan {
    /// Reads a manifest and finds the files that it names.
    ///
    /// # Errors
    /// If the manifest's text, its stages or the files that they match are not valid: all errors. If the text
    /// is not TOML or has another schema, nothing else is checked.
    pub fn load(manifest: &Path, kinds: &Kinds) -> Result<Self, Diagnostics> {
        let manifest = ManifestFile::of(manifest);
        let bytes = read(&manifest)?;
        Self::of_bytes(&manifest, &bytes, kinds, &DiskFolders)
    }

    /// The manifest's file name: several manifests may share a folder, and then its state.
    pub(crate) fn manifest_name(&self) -> String {
        self.manifest.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// For each connected port of a stage, the place of the exported file that it takes; `None` for a port
    /// that takes artifacts or the sizes of files.
    pub(crate) fn files_taken(&self, stage: &Stage) -> Vec<Option<usize>> {
        let taken = |(name, from): &(String, StageIndex)| {
            let port = stage.ports.iter().find(|port| port.name == *name)?;
            port.file_of(&self.stages[*from].product)
        };
        stage.inputs.iter().map(taken).collect()
    }

    /// An item's name.
    pub fn item_name(&self, item: ItemIndex) -> ItemName {
        let item = &self.items[item];
        ItemName { stage: self.stages[item.stage].name.clone(), key: item.key.clone() }
    }

    /// The folders in `out` that exported files are in, sorted.
    pub(crate) fn output_folders(&self) -> &[String] {
        self.output_folders.get_or_init(|| {
            let files = self.items.iter().flat_map(|item| &item.files);
            let mut folders = files.filter_map(|file| Some(file.rsplit_once('/')?.0)).collect::<Vec<_>>();
            folders.dedup();
            folders.sort_unstable();
            folders.dedup();
            folders.into_iter().map(str::to_owned).collect()
        })
    }

    /// Whether it is a clone of another plan.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.items, &other.items)
            && Arc::ptr_eq(&self.stages, &other.stages)
            && (&self.manifest, &self.out, &self.state) == (&other.manifest, &other.out, &other.state)
    }

    /// The plan of a manifest that has been read, among these folders.
    pub(crate) fn of_bytes(
        manifest: &ManifestFile,
        bytes: &[u8],
        kinds: &Kinds,
        folders: &dyn Folders,
    ) -> Result<Self, Diagnostics> {
        let (graph, mut errors) = parse(manifest, bytes, kinds)?;
        let mut search = Search::new(folders);
        let assets = items::assets(&graph, &mut search);
        errors.append(&mut search.errors);
        let items = expand(&graph, &assets, &mut errors);
        assemble(&graph, items, search.warnings, errors)
    }
}

impl Graph {
    /// Reads a manifest, but not the folders that its sources name.
    ///
    /// # Errors
    /// If the manifest is not valid: all errors that do not depend on other files.
    pub fn load(manifest: &Path, kinds: &Kinds) -> Result<Self, Diagnostics> {
        let manifest = ManifestFile::of(manifest);
        Self::of_bytes(&manifest, &read(&manifest)?, kinds)
    }

    /// The graph of a manifest that has been read.
    pub(crate) fn of_bytes(
        manifest: &ManifestFile,
        bytes: &[u8],
        kinds: &Kinds,
    ) -> Result<Self, Diagnostics> {
        let (graph, errors) = parse(manifest, bytes, kinds)?;
        if errors.is_empty() { Ok(graph) } else { Err(graph.diagnostics(errors)) }
    }

    /// The plan for the files that exist now.
    ///
    /// # Errors
    /// If sources do not match files as they should, or items cannot be written to their paths: all errors.
    pub fn expand(&self, folders: &dyn Folders) -> Result<Plan, Diagnostics> {
        self.expand_after(folders, None).map(|expansion| expansion.plan)
    }

    /// The expansion for the files that exist now: if they are those of `before`, an earlier expansion of
    /// this graph, it is that one.
    pub(crate) fn expand_after(
        &self,
        folders: &dyn Folders,
        before: Option<&Expansion>,
    ) -> Result<Expansion, Diagnostics> {
        let mut search = Search::new(folders);
        let assets = items::assets(self, &mut search);
        let Search { mut errors, warnings, .. } = search;
        if let Some(before) = before.filter(|before| errors.is_empty() && before.assets == assets) {
            let warnings = self.diagnostics(warnings);
            return Ok(Expansion { plan: Plan { warnings, ..before.plan.clone() }, assets });
        }
        let items = expand(self, &assets, &mut errors);
        let plan = assemble(self, items, warnings, errors)?;
        Ok(Expansion { plan, assets })
    }
}

/// A plan with the files that its items were made from.
#[derive(Clone)]
pub(crate) struct Expansion {
    pub(crate) plan: Plan,
    assets: Arc<items::Assets>,
}

/// The graph as far as it is valid, and what is not.
fn parse(
    manifest: &ManifestFile,
    bytes: &[u8],
    kinds: &Kinds,
) -> Result<(Graph, Vec<Diagnostic>), Diagnostics> {
    let document = Document::parse(manifest.name.clone(), bytes)?;
    let mut errors = Vec::new();
    let (file, text) = (document.file.clone(), document.text.clone());
    match Graph::parse(manifest.path.clone(), document, kinds, &mut errors) {
        Some(graph) => Ok((graph, errors)),
        None => Err(Diagnostics::new(file, text, errors)),
    }
}

/// The items of a graph; reports those that cannot be published side by side.
fn expand(graph: &Graph, assets: &items::Assets, errors: &mut Vec<Diagnostic>) -> Vec<Item> {
    let items = items::expand(graph, assets, errors);
    errors.extend(clashes::find(graph, &items, assets));
    items
}

/// The plan of a graph, if there are no errors.
fn assemble(
    graph: &Graph,
    items: Vec<Item>,
    warnings: Vec<Diagnostic>,
    errors: Vec<Diagnostic>,
) -> Result<Plan, Diagnostics> {
    if !errors.is_empty() {
        return Err(graph.diagnostics(errors));
    }
    let stages = graph.nodes.iter().map(|node| {
        let kind = node.kind.clone()?;
        let port = |edge: &graph::Edge| node.ports.get(edge.port?).map(|port| port.name.clone());
        let inputs = node.edges.iter().map(|edge| Some((port(edge)?, edge.from)));
        Some(Stage {
            name: node.name.clone(),
            inputs: inputs.collect::<Option<_>>()?,
            ports: node.ports.clone(),
            configured: node.configured.clone()?,
            parameters: node.parameters.clone(),
            source: node.source.clone(),
            product: node.product.clone()?,
            kind,
        })
    });
    match stages.collect::<Option<Arc<[Stage]>>>() {
        Some(stages) => {
            let items = items.into();
            let (manifest, out) = (graph.manifest.clone(), graph.out.clone());
            let state = manifest.parent().unwrap_or(Path::new(".")).to_path_buf();
            let warnings = graph.diagnostics(warnings);
            let (recipe_reader, output_folders) = (graph.recipe_reader, Arc::default());
            Ok(Plan { manifest, out, state, stages, items, warnings, recipe_reader, output_folders })
        }
        // Each unknown part of a stage comes with a diagnostic; if one was forgotten, an error is better than
        // a guess.
        None => {
            Err(graph
                .diagnostics(vec![Diagnostic::of_file("a stage of the manifest could not be understood")]))
        }
    }
}

/// The folder that a manifest exports into; `None` if its text does not say.
pub(crate) fn out_of(manifest: &Path) -> Option<PathBuf> {
    let bytes = read(&ManifestFile::of(manifest)).ok()?;
    let document = Document::parse(path_text(manifest), &bytes).ok()?;
    let declared = manifest::Manifest::parse(&document, &mut Vec::new())?;
    graph::out_folder(&declared.out, manifest.parent()?, &mut Vec::new())
}

/// The bytes of the manifest: at most one more than [`Document::MAX_BYTES`].
pub(crate) fn read(manifest: &ManifestFile) -> Result<Vec<u8>, Diagnostics> {
    let mut bytes = Vec::new();
    let limit = Document::MAX_BYTES as u64 + 1;
    let read = regular::open(&manifest.path).and_then(|(file, _)| file.take(limit).read_to_end(&mut bytes));
    match read {
        Ok(_) => Ok(bytes),
        Err(error) => {
            Err(Diagnostics::new(manifest.name.clone(), "", vec![unreadable(&manifest.path, &error)]))
        }
    }
}

fn unreadable(manifest: &Path, error: &std::io::Error) -> Diagnostic {
    if manifest.is_dir() {
        return Diagnostic::of_file("the manifest is a folder").expected("expected a file, pipeline.toml");
    }
    let is_denied = error.kind() == std::io::ErrorKind::PermissionDenied;
    let error = Diagnostic::of_file(format!("cannot read the manifest: {error}"));
    if is_denied {
        return error.help("check the permissions of the file and its folders");
    }
    let folder = manifest.parent().unwrap_or(manifest);
    let names: Vec<_> = DiskFolders.list(folder).unwrap_or_default();
    let mut names: Vec<_> = names.iter().map(|name| name.name.to_string_lossy().into_owned()).collect();
    names.retain(|name| name.ends_with(".toml"));
    names.sort_unstable();
    let wanted = manifest.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    match nearest(&wanted, names.iter().map(String::as_str)) {
        Some(near) => error.help(format!("did you mean {near:?}?")),
        None if folder.is_dir() && names.is_empty() => error.help("there is no .toml file in that folder"),
        None if folder.is_dir() => error.help(format!("that folder contains {}", source::listed(names))),
        None => error.help("that folder does not exist"),
    }
}

#[cfg(test)]
mod tests;
