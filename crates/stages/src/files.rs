//! The files of a project: programs that make them, what the preview finds in them, and edits of their
//! text.

// The kinds.
mod exec;

// What they share.
mod light_edit;
mod manifest_edit;
mod preview_catalog;

pub(crate) use exec::Exec;
pub use light_edit::LightEdit;
pub use preview_catalog::{CatalogEntry, PreviewCatalog, SceneCache, Unknown};
