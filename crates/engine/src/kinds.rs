//! What a kind of stage is, and what it is given when an item runs.

mod artifact;
mod context;
mod failure;
mod gate;
mod kind;
mod progress;
mod steps;

pub use artifact::{Artifact, Handle};
pub use context::Context;
pub(crate) use context::{HOW_TO_READ_EXPORTS, WHEN_WRITTEN};
pub use failure::Failure;
pub(crate) use gate::Gate;
pub use kind::{
    Configured, ErasedKind, Kind, Kinds, LEFT_OUT, MapSizes, NamedPath, Output, Port, Product, RecipeReader,
};
pub(crate) use kind::{Decoder, is_left_out};
pub(crate) use progress::ShareDone;
pub use steps::Steps;
