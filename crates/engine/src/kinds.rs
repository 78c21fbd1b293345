//! What a kind of stage is, and what it is given when an item runs.

mod artifact;
mod context;
mod derived_values;
mod exported_files;
mod failure;
mod gate;
mod inputs;
mod item_files;
mod kind;
mod output;
mod progress;
mod reporter;
mod steps;

pub use artifact::{Artifact, Handle};
pub use context::Context;
pub use derived_values::DerivedValues;
pub use exported_files::ExportedFiles;
pub use failure::Failure;
pub(crate) use gate::Gate;
pub use inputs::Inputs;
pub(crate) use inputs::KeyedHandles;
pub use item_files::ItemFiles;
pub(crate) use item_files::{HOW_TO_READ_EXPORTS, WHEN_WRITTEN};
pub(crate) use kind::Decoder;
pub use kind::{Configured, ErasedKind, Kind, Kinds, NamedPath, Port, RecipeReader};
pub(crate) use output::is_left_out;
pub use output::{Output, Product, stands_for_no_file};
pub(crate) use progress::ShareDone;
pub use reporter::Reporter;
pub use steps::Steps;
