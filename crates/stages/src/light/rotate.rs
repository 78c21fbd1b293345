//! Turns a lighting, an environment or a reflection.
//!
//! ```toml
//! [stage.turned]
//! kind = "rotate"
//! input = "lighting"
//! yaw = 30.0
//! ```
//!
//! The rotation is active and right-handed in Specula's frame (+Z up, +X the image centre):
//!
//! > R = R_z(yaw) R_y(pitch) R_x(roll)
//!
//! A positive yaw moves the light that was at +X toward +Y, to the left of a lat-long image; a positive
//! pitch tilts the horizon at +X down. You can give a `quaternion` instead of angles.
//!
//! Coefficients are rotated exactly for all angles, degree by degree (the coefficients of each l mix among
//! themselves). The pixels of an environment are resampled, which loses a little sharpness. If you can
//! rotate either, rotate the lighting.
//!
//! A `reflection` of `convolve` turns with its light, as exactly as coefficients do [RH02, eq. 5]: it is the
//! reflection of the turned light, lamps and parts included, and of the same degrees. So one `convolve`
//! serves a light that turns:
//!
//! ```toml
//! [stage.evening]
//! kind = "rotate"
//! input = "reflection"
//! yaw = 120.0
//! ```
//!
//! A reflection map that was read back (`shrm`) cannot be turned exactly, because its texels would have to be
//! resampled: rotate what it was made from.

use engine::{
    Artifact, Context, Diagnostic, Failure, Kind, Output, Parameter, Port, Product, Stage, Value, parameters,
    unexpected,
};
use serde_json::json;
use sphere::Rotation;

use crate::values::{UntilStopped, artifacts};

/// A rotation as [x, y, z, w].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Quaternion([f64; 4]);

impl Parameter for Quaternion {
    fn expected() -> String {
        "[x, y, z, w], not all 0".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let numbers = Vec::<f64>::parse(value)?;
        <[f64; 4]>::try_from(numbers)
            .ok()
            .filter(|&[x, y, z, w]| Rotation::from_quaternion(x, y, z, w).is_some())
            .map(Self)
            .ok_or_else(|| unexpected(value, &Self::expected()))
    }

    fn canonical(&self) -> serde_json::Value {
        self.0.iter().map(Parameter::canonical).collect()
    }

    fn schema() -> serde_json::Value {
        json!({ "type": "array", "items": f64::schema(), "minItems": 4, "maxItems": 4 })
    }
}

parameters! {
    /// Parameters of `rotate`.
    pub(crate) struct Parameters {
        /// The turn about +Z, in degrees, counter-clockwise as seen from above.
        yaw: f64 = 0.0,
        /// The turn about +Y, in degrees, applied before yaw; a positive pitch tilts the horizon at +X down.
        pitch: f64 = 0.0,
        /// The turn about +X, in degrees, applied first.
        roll: f64 = 0.0,
        /// The rotation as a quaternion [x, y, z, w] instead of angles; its length does not matter.
        quaternion: Option<Quaternion> = None,
    }
}

impl Parameters {
    pub(crate) fn rotation(&self) -> Rotation {
        let Some(Quaternion([x, y, z, w])) = self.quaternion else {
            let [yaw, pitch, roll] = self.angles().map(f64::to_radians);
            return Rotation::from_yaw_pitch_roll(yaw, pitch, roll);
        };
        Rotation::from_quaternion(x, y, z, w).unwrap_or(Rotation::IDENTITY)
    }

    /// The yaw, pitch and roll, in degrees.
    pub(crate) fn angles(&self) -> [f64; 3] {
        [self.yaw, self.pitch, self.roll]
    }

    /// The quaternion [x, y, z, w] that is given instead of angles.
    pub(crate) fn quaternion(&self) -> Option<[f64; 4]> {
        self.quaternion.map(|Quaternion(quaternion)| quaternion)
    }
}

/// The turn that a stage gives to the light that arrives; the identity if the stage is of another kind.
pub(crate) fn turn_of(stage: &Stage) -> Rotation {
    match stage.kind.name() {
        Rotate::NAME => parameters_of(stage).rotation(),
        _ => Rotation::IDENTITY,
    }
}

/// The parameters of a stage of this kind.
pub(crate) fn parameters_of(stage: &Stage) -> Parameters {
    let parameters = stage.configured.canonical();
    let angle = |name: &str| parameters[name].as_f64().unwrap_or_default();
    let quaternion = serde_json::from_value::<[f64; 4]>(parameters["quaternion"].clone());
    let quaternion = quaternion.ok().map(Quaternion);
    Parameters { yaw: angle("yaw"), pitch: angle("pitch"), roll: angle("roll"), quaternion }
}

/// The kind `rotate`.
pub(crate) struct Rotate;

impl Kind for Rotate {
    type Parameters = Parameters;

    const NAME: &'static str = "rotate";
    const REVISION: u32 = 2;
    const KERNELS: &'static [u32] = &[sh::revisions::ROTATION, envmap::revisions::RESAMPLING];
    const TEXT: &'static str = include_str!("rotate.rs");

    fn ports() -> Vec<Port> {
        let port = Port::one::<artifacts::Lighting>("lighting");
        vec![port.or::<artifacts::Environment>().or::<artifacts::Reflection>()]
    }

    /// Returns the type of the artifact that arrives.
    fn product(_: &Parameters, types: &[(&str, &'static str)]) -> Product {
        let arrives = types.iter().find(|(port, _)| *port == "lighting").map(|(_, arrives)| *arrives);
        Product::Artifact(arrives.unwrap_or(artifacts::Lighting::TYPE))
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let angles = [parameters.yaw, parameters.pitch, parameters.roll];
        if parameters.quaternion.is_some() && angles != [0.0; 3] {
            return vec![("quaternion", "yaw, pitch or roll already set the rotation".into())];
        }
        Vec::new()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let rotation = parameters.rotation();
        if context.inputs.type_at("lighting") == Some(artifacts::Environment::TYPE) {
            let environment = context.inputs.get::<artifacts::Environment>("lighting")?;
            let turned = context.reporter.until_stopped(|stop| environment.0.rotated(rotation, stop))?;
            return Output::artifact(artifacts::Environment(turned));
        }
        if context.inputs.type_at("lighting") == Some(artifacts::Reflection::TYPE) {
            let reflection = context.inputs.get::<artifacts::Reflection>("lighting")?;
            return Output::artifact(artifacts::Reflection(reflection.0.rotated(rotation)));
        }
        let lighting = context.inputs.get::<artifacts::Lighting>("lighting")?;
        Output::artifact(artifacts::Lighting(lighting.0.rotated(rotation)))
    }
}
