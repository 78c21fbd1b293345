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

pub(crate) use export_engine::ExportEngine;
pub(crate) use export_environment::ExportEnvironment;
pub(crate) use export_light_rig::ExportLightRig;
pub(crate) use export_sh::ExportSh;
pub(crate) use test_pattern::TestPattern;
