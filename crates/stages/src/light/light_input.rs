//! The light that a picture is lit by.

use engine::{Context, Failure};
use preview::Light;

use crate::values::artifacts;

/// The light of the environment, or of lighting without one.
pub(crate) fn light(context: &Context<'_>) -> Result<Light, Failure> {
    if context.type_at("environment") == Some(<artifacts::Lighting as engine::Artifact>::TYPE) {
        let lighting = context.get::<artifacts::Lighting>("environment")?.0.clone();
        return Light::of_lighting(lighting)
            .ok_or_else(|| Failure::new("the light has a radiance that is not finite"));
    }
    Ok(Light::new(context.get::<artifacts::Environment>("environment")?.0.clone(), None))
}
