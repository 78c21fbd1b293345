//! Shots: how a scene is drawn.

use envmap::ToneMap;
use sphere::Rotation;

use crate::{Background, Camera, PointSet, Scene, Show};

/// Everything that determines the picture of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    /// The width and height in pixels.
    pub size: [u32; 2],
    /// The number of samples along each side of a pixel, 1 to 4. Each is developed, then they are averaged.
    pub samples: u32,
    /// The camera.
    pub camera: Camera,
    /// The rotation of the light, active: a lamp in direction w shines from `turn` w.
    pub turn: Rotation,
    /// The modes to show.
    pub show: Show,
    /// The background.
    pub background: Background,
    /// The exposure in stops: +1 doubles.
    pub exposure: f64,
    /// The curve from exposed radiance to display values.
    pub tone: ToneMap,
    /// The light samples of each sample of a pixel in brute force.
    pub light_samples: u32,
    /// The points of the unit square that light samples and the diagram of samples are made from.
    pub points: PointSet,
}

/// The samples along each side of a pixel of a screenshot.
const SCREENSHOT_SAMPLES: u32 = 2;

impl Shot {
    /// Returns this shot in the modes in which a scene can be drawn: see [`Scene::available`]. Renderers draw
    /// this.
    #[must_use]
    pub fn of(&self, scene: &Scene) -> Self {
        Self { show: scene.available(self.show), ..self.clone() }
    }

    /// Returns this shot for a screenshot, with smooth outlines and as many light samples per pixel as in the
    /// window.
    #[must_use]
    pub fn for_screenshot(self) -> Self {
        let light_samples = self.light_samples.div_ceil(SCREENSHOT_SAMPLES.pow(2));
        Self { samples: SCREENSHOT_SAMPLES, light_samples, ..self }
    }
}
