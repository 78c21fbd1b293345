//! Light where there is no surface: relightable light probes of a scene.
//!
//! Transport first, lighting second (Sloan, Kautz and Snyder 2002, for points in the air): each probe holds a
//! matrix from the sky's harmonics to those of what arrives, with every reflection at the scene's surfaces in
//! it, and a column for each emissive material and each lamp. A new sky, or a new colour of a lamp, is a
//! product of these; it traces no ray.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod bake;
mod bake_lamps;
mod bricks;
mod cells;
mod closed;
mod cpca;
mod emitters;
mod irradiance_cache;
mod lamp;
mod lattice_cells;
mod leaks;
mod lit_probes;
mod material;
mod options;
mod paths;
mod places;
mod places_parts;
mod plane_tree;
mod random;
mod ringing;
mod rooms;
mod scatter;
mod scene;
mod scene_part;
mod surface_points;
mod surfaces;
mod tetrahedra;
mod texture;
mod transport;
mod validity;
mod volume;

pub use bake::{BakedBricks, bake, bake_bricks, transport_bytes};
pub use bake_lamps::{LampColumns, bake_lamp};
pub use brdf::Wrap;
pub use bricks::{BakeRecord, BrickCounts, Bricks, EarlierBake};
pub use cpca::ClusteredComponents;
pub use lamp::{Lamp, LampError, LampKind};
pub use leaks::{Blend, LEAK_POINTS, Leak, Leaks, leaks};
pub use lit_probes::{LightError, LitProbes, SceneLighting};
pub use material::{Alpha, Emission, MOST_ALBEDO, Material};
pub use options::{BakeError, BakeOptions, MOST_BYTES};
pub use places::{PlacesError, ProbePlaces, Repair};
pub use places_parts::PlacesParts;
pub use plane_tree::{Cut, Side, plane_tree};
pub use ringing::{least_window, window_factor};
pub use rooms::{LEAST_ROOM_STEP, room_step, rooms};
pub use scatter::{SCATTER_RATIO, scatter};
pub use scene::{Corner, NamedBox, Part, Scene, SceneError, SceneParts};
pub use scene_part::ScenePart;
pub use surfaces::Surfaces;
pub use tetrahedra::{Tetrahedra, WholePlace};
pub use texture::{Texture, TextureUse};
pub use transport::{Transport, TransportParts};
pub use validity::{LEAST_DISTANCE, MOST_BACKS};
pub use volume::{Lattice, MOST_ALONG, MOST_PROBES, Volume, VolumeError, neighbours};

/// The revisions of the kernels, for the kinds of stage that call them.
pub mod revisions {
    pub use crate::bake::REVISION as PROBES;
    pub use crate::cpca::REVISION as COMPONENTS;
    pub use crate::leaks::REVISION as LEAKS;
    pub use crate::lit_probes::REVISION as BLEND;
}
