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
