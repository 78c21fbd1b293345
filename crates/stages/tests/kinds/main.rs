//! Runs every kind in memory, those of `mesh-stages` and `probe-stages` too, through the engine's own interface.

#![allow(clippy::unwrap_used, clippy::disallowed_methods, missing_docs)] // a test may panic

mod bad_input;
mod brdf_table;
mod brute_force;
mod check_source;
mod circular_lights;
mod corpus;
mod engines;
#[cfg(unix)]
mod exec;
mod explicit_maps;
mod export_environment;
mod export_gltf;
mod export_matrices;
mod export_page;
mod export_reflection_map;
mod export_sh;
mod export_shrm;
mod fixture;
mod import_environment;
mod import_material;
mod import_mesh;
mod lamps_at_vertices;
mod light_field;
mod light_kept;
mod light_probes;
mod light_rig;
mod list;
mod own_materials;
mod part_of_sphere;
mod parts;
mod pipeline;
mod prefilter;
mod preview;
mod preview_catalog;
mod preview_light;
mod preview_light_field;
mod progress;
mod project_sh;
mod reference;
mod reflect;
mod relighting;
mod report;
mod report_degrees;
mod report_shrm;
mod report_trade;
mod revisions;
mod rotate;
mod same_bytes;
mod sample_directions;
mod small_maps;
mod taps;
mod varied_materials;
mod vertices;
mod wavelets;
