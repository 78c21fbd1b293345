//! Light where there is no surface: relightable light probes of a scene.
//!
//! Transport first, lighting second (Sloan, Kautz and Snyder 2002, for points in the air): each probe holds a
//! matrix from the sky's harmonics to those of what arrives, with every reflection at the scene's surfaces in
//! it, and a column for each emissive material and each lamp. A new sky, or a new colour of a lamp, is a
//! product of these; it traces no ray.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod bake;
mod bake_lamps;
mod emitters;
mod lamp;
mod material;
mod options;
mod paths;
mod random;
mod scene;
mod surfaces;
mod texture;
mod transport;

pub use bake::{bake, transport_bytes};
pub use bake_lamps::{LampColumns, bake_lamp};
pub use brdf::Wrap;
pub use lamp::{Lamp, LampError, LampKind};
pub use material::{Alpha, Emission, MOST_ALBEDO, Material};
pub use options::{BakeError, BakeOptions, MOST_BYTES};
pub use scene::{Corner, NamedBox, Part, Scene, SceneError, SceneParts};
pub use surfaces::Surfaces;
pub use texture::{Texture, TextureUse};
pub use transport::Transport;

/// The revisions of the kernels, for the kinds of stage that call them.
pub mod revisions {
    pub use crate::bake::REVISION as PROBES;
}
