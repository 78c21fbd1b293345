//! The compact map of a look: a scale space of its light, and the taps of its material.

use std::sync::Arc;

use brdf::Material;
use shrm::Lamps;
use taps::{AnyTable, FacetTable, ScaleSpace, TapTable};

/// What [`crate::Mode::Taps`] shades a look with.
///
/// The scale space is that of the look's light, and one serves all materials; the taps are those of the
/// look's material, and serve under any light.
#[derive(Clone, Debug)]
pub struct CompactMap {
    /// The light, blurred by Gaussians of many widths.
    pub scales: Arc<ScaleSpace>,
    /// The look-ups by which the material reads it.
    pub taps: Arc<CompactTaps>,
    /// The material, which reflects the lights beside the scale space.
    pub material: Material,
}

impl CompactMap {
    /// The lights beside the scale space, and the material that reflects them.
    pub fn lamps(&self) -> Lamps {
        Lamps { lights: self.scales.lights().to_vec(), material: self.material.clone() }
    }
}

/// The taps of a compact map, of either sort.
#[derive(Clone, Debug, PartialEq)]
pub enum CompactTaps {
    /// Taps by the angle of the view: of a material that does not depend on its tangent, or of its mean over
    /// all turns about the normal.
    Angle(TapTable),
    /// Taps by the view in the frame of the surface: of a material that depends on its tangent.
    View(FacetTable),
}

impl CompactTaps {
    /// The table.
    pub fn table(&self) -> AnyTable<'_> {
        match self {
            Self::Angle(table) => AnyTable::Angle(table),
            Self::View(table) => AnyTable::View(table),
        }
    }
}

impl From<AnyTable<'_>> for CompactTaps {
    fn from(table: AnyTable<'_>) -> Self {
        match table {
            AnyTable::Angle(table) => Self::Angle(table.clone()),
            AnyTable::View(table) => Self::View(table.clone()),
        }
    }
}
