//! The compact map of a look: a scale space of its light, and the taps of its material.

use std::sync::Arc;

use brdf::Material;
use shrm::Lamps;
use taps::{ScaleSpace, TapTable};

/// What [`crate::Mode::Taps`] shades a look with.
///
/// The scale space is that of the look's light, and one serves all materials; the taps are those of the
/// look's material, and serve under any light.
#[derive(Clone, Debug)]
pub struct CompactMap {
    /// The light, blurred by Gaussians of many widths.
    pub scales: Arc<ScaleSpace>,
    /// The look-ups by which the material reads it.
    pub taps: Arc<TapTable>,
    /// The material, which reflects the lights beside the scale space.
    pub material: Material,
}

impl CompactMap {
    /// The lights beside the scale space, and the material that reflects them.
    pub fn lamps(&self) -> Lamps {
        Lamps { lights: self.scales.lights().to_vec(), material: self.material.clone() }
    }
}
