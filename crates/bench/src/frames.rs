//! What the programs that time frames share: the light, and the times of some frames.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use envmap::{Environment, Layout};
use preview::Light;
use sh::{Degree, Transform};

/// The times of some frames.
pub struct Times {
    sorted: Vec<Duration>,
}

impl Times {
    /// The times in any order.
    ///
    /// # Panics
    /// If there are none.
    pub fn new(mut times: Vec<Duration>) -> Self {
        assert!(!times.is_empty(), "a frame");
        times.sort();
        Self { sorted: times }
    }

    /// The least time in seconds that so large a share of the frames does not pass.
    pub fn percentile(&self, share: f64) -> f64 {
        let rank = (share * self.sorted.len() as f64).ceil() as usize;
        self.sorted[rank.saturating_sub(1).min(self.sorted.len() - 1)].as_secs_f64()
    }
}

/// The sample assets' studio, with its coefficients up to degree 30.
///
/// # Errors
/// If the file cannot be read.
pub fn studio() -> Result<Arc<Light>, String> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/environments/studio.exr");
    let bytes = std::fs::read(&file).map_err(|error| format!("{}: {error}", file.display()))?;
    let image = containers::read_image(&bytes, &containers::ReadOptions::default())
        .map_err(|error| error.to_string())?
        .image;
    let environment =
        Environment::from_image(image, Layout::LatLong, None).map_err(|error| error.to_string())?;
    let degree = Degree::new(30).map_err(|error| error.to_string())?;
    let transform = Transform::new(environment.grid(), degree).map_err(|error| error.to_string())?;
    let lighting = transform.analyse(environment.pixels());
    Ok(Arc::new(Light::new(environment, Some(lighting))))
}
