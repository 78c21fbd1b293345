//! What a running item has access to.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;

use super::artifact::{Artifact, Handle};
use super::derived_values::DerivedValues;
use super::inputs::Inputs;
use super::item_files::ItemFiles;
use super::output::is_left_out;
use super::reporter::Reporter;
use crate::cancel::Cancel;
use crate::key::ItemKey;
use crate::storage::Files;

/// What a running item has access to, in parts, so that a function takes only those that it needs.
pub struct Context<'a> {
    /// The artifacts at the item's ports.
    pub inputs: Inputs,
    /// The files that the item reads.
    pub files: ItemFiles<'a>,
    /// Takes warnings, notes and progress, and says whether the item is to stop.
    pub reporter: Reporter,
    /// Keeps what the kind computes from artifacts for later runs.
    pub derived: DerivedValues<'a>,
    earlier: Option<Handle>,
    key: Option<ItemKey>,
    recipe: String,
}

impl<'a> Context<'a> {
    /// A context without inputs; the scheduler and tests of kinds add those of the item.
    pub fn new(files: &'a dyn Files) -> Self {
        Self {
            inputs: Inputs::default(),
            files: ItemFiles::new(files),
            reporter: Reporter::default(),
            derived: DerivedValues::default(),
            earlier: None,
            key: None,
            recipe: String::new(),
        }
    }

    /// Adds the items at a port, sorted by key. Files that items leave out do not arrive.
    #[must_use]
    pub fn with_input(mut self, port: &str, items: Vec<(ItemKey, Arc<Handle>)>) -> Self {
        let exist = items.into_iter().filter(|(_, handle)| !is_left_out(handle.digest()));
        self.inputs.ports.insert(port.into(), exist.collect());
        self
    }

    /// Sets the source file or folder of the item.
    #[must_use]
    pub fn with_source(mut self, source: PathBuf) -> Self {
        self.files.source = Some(source);
        self
    }

    /// Sets the folder for relative paths if the item has no source: the manifest's folder.
    #[must_use]
    pub fn with_folder(mut self, folder: PathBuf) -> Self {
        self.files.folder = Some(folder);
        self
    }

    /// Sets the folder for exports, which no item reads.
    #[must_use]
    pub fn with_out(mut self, out: PathBuf) -> Self {
        self.files.out = Some(out);
        self
    }

    /// Sets the folder for the scratch folders of items. The default is the system's.
    #[must_use]
    pub fn with_scratch(mut self, scratch: PathBuf) -> Self {
        self.files.scratch = scratch;
        self
    }

    /// Lets the item be cancelled.
    #[must_use]
    pub fn with_cancel(mut self, cancel: Cancel) -> Self {
        self.reporter.cancel = cancel;
        self
    }

    /// Sets the artifact that the item made when it last ran.
    #[must_use]
    pub fn with_earlier(mut self, earlier: Handle) -> Self {
        self.earlier = Some(earlier);
        self
    }

    /// Lets the item see its key, for a kind that shows names.
    #[must_use]
    pub fn with_key(mut self, key: ItemKey) -> Self {
        self.key = Some(key);
        self
    }

    /// Sets the recipe that exported files hold.
    #[must_use]
    pub fn with_recipe(mut self, recipe: String) -> Self {
        self.recipe = recipe;
        self
    }

    /// The artifact that the item made when it last ran, for parts that are as they were: the artifact itself
    /// has to say what each part was made from, kernels and parameters included. The output has to have the
    /// same bytes without it. `None` if there is none that can be read, if the item runs on another machine,
    /// or in a build with `force`.
    pub fn earlier<T: Artifact>(&self) -> Option<Arc<T>> {
        let earlier = self.earlier.as_ref()?;
        // Another version may have encoded it differently.
        catch_unwind(AssertUnwindSafe(|| earlier.get())).ok()?.ok()
    }

    /// The item's key; only a kind that shows names (`SHOWS_KEYS`) sees it.
    pub fn key(&self) -> Option<&ItemKey> {
        self.key.as_ref()
    }

    /// The recipe for an exported file: canonical JSON of kind, revision, parameters and input digests.
    pub fn recipe(&self) -> &str {
        &self.recipe
    }

    /// Whether the item was stopped, so that nothing that it returned is of use.
    pub(crate) fn was_stopped(&self) -> bool {
        self.reporter.was_stopped() || self.files.is_interrupted()
    }
}
