//! Takes lights out of an environment, for scenes in which a sun is a separate light.
//!
//! ```toml
//! [stage.sky]
//! kind = "subtract-lights"
//! inputs = { environment = "environment", lights = "lighting" }
//! ```
//!
//! A separate light must not be in the environment too: it would count twice, and a series of the
//! environment would ring around it. The lights can be those that `project-sh` found, those of
//! `sample-light`, or a sun of `circular-lights` at the place of the sun in the picture.
//!
//! Each light, the strongest first, takes its energy from the brightest texels around its direction, within
//! twice its angular radius: they are cut down to one level, so that exactly the light's energy is gone, in
//! each colour. If that level would be below the surroundings, the circle grows to at most four radii. Only
//! if a light is stronger than all texels in the circle does it take from farther away. No texel becomes
//! negative. So the rest and the lights together are the whole; the build notes how well, and warns if the
//! picture has less light there than the lights.
//!
//! A rig contains all light of its environment, so nothing would be left. To keep a soft part, use the
//! lights of a lighting with separate lamps, or only the strongest of a rig: at most `most` lights are
//! subtracted.
//!
//! The series of the lighting is not used.

use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, parameters};
use sh::Light;

use crate::values::{artifacts, share};

parameters! {
    /// Parameters of `subtract-lights`.
    pub(crate) struct Parameters {
        /// How many lights are subtracted, the strongest first. Default: all.
        #[range(1..)]
        most: Option<usize> = None,
    }
}

/// The share of the light that may be missing without a warning.
const MISSING: f64 = 1e-3;

/// The kind `subtract-lights`.
pub(crate) struct SubtractLights;

impl Kind for SubtractLights {
    type Parameters = Parameters;

    const NAME: &'static str = "subtract-lights";
    const REVISION: u32 = 2;
    const KERNELS: &'static [u32] = &[envmap::revisions::WITHOUT_LIGHTS];
    const TEXT: &'static str = include_str!("subtract_lights.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Environment>("environment"), Port::one::<artifacts::Lighting>("lights")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Environment::TYPE)
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let environment = context.inputs.get::<artifacts::Environment>("environment")?;
        let lighting = context.inputs.get::<artifacts::Lighting>("lights")?;
        let power = |light: &Light| light.flux().iter().sum::<f64>();
        let mut lights = lighting.0.lights.clone();
        lights.sort_by(|a, b| power(b).total_cmp(&power(a)));
        lights.truncate(parameters.most.unwrap_or(usize::MAX));
        if lights.is_empty() {
            reporter.warn("the lighting has no separate lights, so the environment did not change");
            return Output::artifact((*environment).clone());
        }
        if let Some(light) =
            lights.iter().flat_map(|light| light.irradiance).find(|value| value.is_nan() || *value < 0.0)
        {
            return Err(Failure::new(format!("a light has the irradiance {light}: it cannot be subtracted")));
        }
        let subtracted = environment.0.without_lights(&lights);
        let whole: f64 = environment.0.integral().iter().sum();
        let taken: f64 = subtracted.taken.iter().sum();
        let wanted: f64 = lights.iter().map(power).sum();
        reporter.note(match lights.len() {
            1 => format!("1 light removed {} of the light", share(taken / whole)),
            count => format!("{count} lights removed {} of the light", share(taken / whole)),
        });
        let missing = (wanted - taken).abs();
        reporter.note(format!("the rest and the lights together are the whole to {:.1e}", missing / whole));
        if missing > MISSING * wanted {
            reporter.warn(format!(
                "the lights have more light than the environment: only {} of it could be subtracted",
                share(taken / wanted)
            ));
        }
        Output::artifact(artifacts::Environment(subtracted.rest))
    }
}
