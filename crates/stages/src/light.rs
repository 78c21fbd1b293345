//! Light: environments in, their coefficients and lamps, and what turns, adds and samples them.

// The kinds.
mod circular_lights;
mod export_wavelets;
mod import_environment;
mod largest_wavelets;
mod light_field;
mod project_sh;
pub(crate) mod rotate;
mod sample_directions;
mod sample_light;
mod subtract_lights;
mod sum_lighting;
mod white_balance;

// What they share.
mod bad_pixels;
mod colour_space_name;
mod drawn_directions;
mod full_lighting;
mod kept_wavelets;
mod light_input;
pub(crate) mod light_mismatch;
mod panorama;
mod series_alone;
mod six_faces;
mod source_pictures;

use engine::Kinds;

pub(crate) use bad_pixels::repaired;
pub(crate) use full_lighting::{MAX_UNCUT_DEGREE, full};
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
        .with(sample_directions::SampleDirections)
        .with(largest_wavelets::LargestWavelets)
        .with(export_wavelets::ExportWavelets)
        .with(subtract_lights::SubtractLights)
        .with(rotate::Rotate)
        .with(sum_lighting::SumLighting)
        .with(light_field::LightFieldKind)
}
