//! The light that a picture is lit by.

use engine::{Failure, Inputs};
use preview::Light;

use crate::values::artifacts;

/// The light of the environment, or of lighting without one.
pub(crate) fn light(inputs: &Inputs) -> Result<Light, Failure> {
    if inputs.type_at("environment") == Some(<artifacts::Lighting as engine::Artifact>::TYPE) {
        let lighting = inputs.get::<artifacts::Lighting>("environment")?.0.clone();
        return Light::of_lighting(lighting)
            .ok_or_else(|| Failure::new("the light has a radiance that is not finite"));
    }
    Ok(Light::new(inputs.get::<artifacts::Environment>("environment")?.0.clone(), None))
}
