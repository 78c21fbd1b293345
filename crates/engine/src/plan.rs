//! The graph of stages and the items that they stand for.

use std::path::PathBuf;
use std::sync::Arc;

use crate::{Configured, ErasedKind, ItemKey, Product};

/// The place of a stage in [`Plan::stages`].
pub type StageIndex = usize;
/// The place of an item in [`Plan::items`].
pub type ItemIndex = usize;

/// A stage of the manifest with its kind, parameters and connections.
#[derive(Clone)]
pub struct Stage {
    /// The name.
    pub name: String,
    /// The kind.
    pub kind: Arc<dyn ErasedKind>,
    /// The kind with this stage's parameters.
    pub configured: Arc<dyn Configured>,
    /// The connected ports, in the order of the kind's ports, each with the stage that feeds it.
    pub inputs: Vec<(&'static str, StageIndex)>,
    /// What an item of the stage makes.
    pub product: Product,
}

/// One instance of a stage.
#[derive(Clone, Debug)]
pub struct Item {
    /// The stage.
    pub stage: StageIndex,
    /// What tells it from its siblings.
    pub key: ItemKey,
    /// For each of the stage's inputs, in order: the items that arrive there, sorted by key.
    pub inputs: Vec<Vec<ItemIndex>>,
    /// The source file or folder, for a kind that has one. Absolute.
    pub source: Option<PathBuf>,
    /// The exported files, relative to `out`, with `/` between folders, in the order of [`Product::Files`].
    pub files: Vec<String>,
}

/// Everything that a manifest asks for: stages and items, each before those that need it.
#[derive(Clone)]
pub struct Plan {
    /// The manifest file. Absolute.
    pub manifest: PathBuf,
    /// The folder that exports land in. Absolute.
    pub out: PathBuf,
    /// The stages, in topological order, ties in the order of the manifest.
    pub stages: Vec<Stage>,
    /// The items, stage by stage in the order of `stages`, sorted by key within one.
    pub items: Vec<Item>,
}
