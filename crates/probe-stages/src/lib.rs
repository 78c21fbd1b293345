//! The kinds of stage for light where there is no surface: a scene, the places of probes in it, the
//! transport of light to them, their light, and its files for engines.
//!
//! One file per kind, as in `stages`, whose list they join as a studio's own kinds do. Of `stages` they use
//! nothing but what every studio is promised in docs/plugins.md: [`stages::artifacts`] and
//! [`stages::plugin`].

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod bake_lamps;
mod bake_probes;
mod baking;
mod check_probes;
mod export_probes;
mod ground;
mod import_scene;
mod json;
mod light_probes;
mod name_pattern;
mod place_probes;
mod probe_pattern;
mod scene_part;
mod scene_port;
mod suns;
#[cfg(test)]
mod testkit;

use engine::Kinds;

/// Adds the kinds of this crate to a list, in the order in which a pipeline uses them.
///
/// # Panics
/// If the list has a kind of the same name.
#[must_use]
pub fn add_to(kinds: Kinds) -> Kinds {
    kinds
        .with(import_scene::ImportScene)
        .with(scene_part::ScenePartKind)
        .with(place_probes::PlaceProbes)
        .with(check_probes::CheckProbes)
        .with(bake_probes::BakeProbes)
        .with(bake_lamps::BakeLamps)
        .with(light_probes::LightProbes)
        .with(probe_pattern::ProbePattern)
        .with(export_probes::ExportProbes)
}

/// The JSON Schema of `probes.json`, which `export-probes` writes with `preset = "ktx2"`.
pub fn probes_schema() -> engine::serde_json::Value {
    export_probes::schema()
}
