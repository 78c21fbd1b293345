//! The files of a project: programs that make them, what the preview finds in them, and edits of their
//! text.

// The kinds.
mod exec;

// What they share.
mod light_edit;
mod manifest_edit;
mod preview_catalog;

use engine::Kinds;

pub use light_edit::LightEdit;
pub use preview_catalog::{
    CatalogEntry, CompactMapItems, LightAlone, PreviewCatalog, ROUGHNESSES, SceneCache, Unknown,
};

/// Adds the kinds of this folder to a list, in the order in which a pipeline uses them.
pub(crate) fn add_to(kinds: Kinds) -> Kinds {
    kinds.with(exec::Exec)
}
