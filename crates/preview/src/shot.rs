//! How a scene is seen.

use envmap::ToneMap;
use sphere::Rotation;

use crate::{Background, Camera, Show};

/// How a scene is seen: everything of a picture but what is in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Samples along each side of a pixel, 1 to 4: each is developed, then they are averaged.
    pub samples: u32,
    /// From where.
    pub camera: Camera,
    /// The turn of the light, active: a lamp in direction w shines from `turn` w.
    pub turn: Rotation,
    /// Which modes.
    pub show: Show,
    /// What lies behind.
    pub background: Background,
    /// In stops: +1 doubles.
    pub exposure: f64,
    /// From exposed radiance to display values.
    pub tone: ToneMap,
    /// The light samples of each sample of a pixel in [`crate::Mode::BruteForce`].
    pub light_samples: u32,
}

/// The samples along each side of a pixel of a picture that is kept.
const KEPT_SAMPLES: u32 = 2;

impl Shot {
    /// This shot as it is kept: with smooth outlines, and with as many light samples per pixel as the window shows.
    #[must_use]
    pub fn to_keep(self) -> Self {
        let light_samples = self.light_samples.div_ceil(KEPT_SAMPLES.pow(2));
        Self { samples: KEPT_SAMPLES, light_samples, ..self }
    }
}
