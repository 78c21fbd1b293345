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
mod white_balance;

// What they share.
mod bad_pixels;
mod colour_space_name;
mod full_lighting;
mod light_input;
pub(crate) mod light_mismatch;
mod panorama;
mod six_faces;
mod source_pictures;

use engine::Kinds;

pub(crate) use bad_pixels::repaired;
pub(crate) use full_lighting::full;
pub(crate) use light_input::light;
pub(crate) use rotate::Rotate;
pub use six_faces::{face_sets, is_face, six_faces};

/// Adds the kinds of this folder to a list, in the order in which a pipeline uses them.
pub(crate) fn add_to(kinds: Kinds) -> Kinds {
    kinds
        .with(import_environment::ImportEnvironment)
        .with(project_sh::ProjectSh)
        .with(circular_lights::CircularLights)
        .with(sample_light::SampleLight)
        .with(subtract_lights::SubtractLights)
        .with(rotate::Rotate)
        .with(sum_lighting::SumLighting)
        .with(light_field::LightFieldKind)
}
