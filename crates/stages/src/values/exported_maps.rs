//! What an export says of its maps, for a preview that shows maps like them.

use engine::Stage;

/// The sizes of the maps that an export writes, as far as its parameters say, and what they hold. A kind that
/// exports maps returns this as its [`Kind::details`](engine::Kind::details).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExportedMaps {
    /// Texels along the edge of a cube's face with the same angular resolution as the map.
    pub edge: Option<usize>,
    /// The slices of a 3D texture.
    pub slices: Option<usize>,
    /// Whether the map itself holds the lamps that are beside a reflection, with the error of doing so.
    pub holds_lamps: Option<bool>,
    /// Whether one map holds both parts of a material that has two.
    pub joins_parts: Option<bool>,
}

impl ExportedMaps {
    /// What a stage says of its maps; nothing if its kind exports none.
    pub(crate) fn of(stage: &Stage) -> Self {
        let details = stage.configured.details().and_then(|details| details.downcast().ok());
        details.map_or_else(Self::default, |maps| *maps)
    }
}
