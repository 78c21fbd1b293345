//! Light: environments in, their coefficients and lamps, and what turns, adds and samples them.

// The kinds.
mod circular_lights;
mod import_environment;
mod light_field;
mod project_sh;
pub(crate) mod rotate;
mod sample_light;
mod subtract_lights;
mod sum_lighting;

// What they share.
mod bad_pixels;
mod colour_space_name;
mod full_lighting;
mod light_input;
pub(crate) mod light_mismatch;
mod panorama;
mod six_faces;

pub(crate) use bad_pixels::repaired;
pub(crate) use circular_lights::CircularLights;
pub(crate) use full_lighting::full;
pub(crate) use import_environment::ImportEnvironment;
pub(crate) use light_field::LightFieldKind;
pub(crate) use light_input::light;
pub(crate) use project_sh::ProjectSh;
pub(crate) use rotate::Rotate;
pub(crate) use sample_light::SampleLight;
pub use six_faces::{face_sets, is_face, six_faces};
pub(crate) use subtract_lights::SubtractLights;
pub(crate) use sum_lighting::SumLighting;
