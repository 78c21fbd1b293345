//! Light in the files that game engines and other tools load.

// The kinds.
mod export_engine;
mod export_environment;
mod export_light_rig;
mod export_sh;
mod test_pattern;

// What they share.
mod engine_files;
mod irradiance;

pub use export_engine::ENGINE_FILE_STEM;

use engine::Kinds;

/// Adds the kinds of this folder to a list, in the order in which a pipeline uses them.
pub(crate) fn add_to(kinds: Kinds) -> Kinds {
    kinds
        .with(test_pattern::TestPattern)
        .with(export_engine::ExportEngine)
        .with(export_environment::ExportEnvironment)
        .with(export_sh::ExportSh)
        .with(export_light_rig::ExportLightRig)
}
