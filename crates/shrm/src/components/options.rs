//! What a map of components is to be, and why there may be none.

use brdf::TableError;
use sh::Stopped;

use super::basis::ComponentBasis;

/// The components with full resolution, if the others have half of it.
pub const FULL_SIZE_COMPONENTS: usize = 4;

/// Central directions at which the error of a map is sampled.
pub(super) const CENTRALS: usize = 192;

/// How many components a map has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ComponentCount {
    /// As many, or all that the material has if these are fewer.
    Fixed(usize),
    /// The least number, up to [`MAX_COMPONENTS`](super::MAX_COMPONENTS), with which 95 and 99 of 100
    /// look-ups are within so many stops; if none is enough, all.
    Accept([f64; 2]),
}

/// What a map of components is to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ComponentOptions {
    /// Texels along the edge of a face, without its border.
    pub edge: usize,
    /// How many components there are.
    pub count: ComponentCount,
    /// Whether the components from the fifth on have half the resolution, rounded up.
    pub half: bool,
    /// Whether lights beside the lighting's series are in the map.
    pub bake: bool,
}

impl ComponentOptions {
    /// About how many times [`fit`](super::fit) asks whether to stop.
    pub fn steps(&self, basis: &ComponentBasis) -> usize {
        let rows = |edge: usize| 6 * (edge + 2);
        let coarse = if self.half && basis.components().len() > FULL_SIZE_COMPONENTS {
            rows(self.edge.div_ceil(2))
        } else {
            0
        };
        let choice = if matches!(self.count, ComponentCount::Accept(_)) { 2 } else { 1 };
        rows(self.edge) + coarse + choice * CENTRALS
    }
}

/// Why there are no components.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ComponentError {
    /// The reflection does not know its material.
    #[error("the reflection does not hold its material, from which the components follow")]
    NoMaterial,
    /// The material is about the tangent.
    #[error(
        "components are about the reflection vector or the normal, and this material is about the tangent"
    )]
    Tangent,
    /// The material has a value that is not finite.
    #[error(transparent)]
    Material(#[from] TableError),
    /// The fit was stopped before its end.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}
