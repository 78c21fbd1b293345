//! Runs the kinds of scenes and probes in memory and on the disk, through the engine's own interface.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod bad_input;
mod export_probes;
mod fixture;
mod import_scene;
mod place_probes;
mod placement;
mod reference;
mod relighting;
mod reruns;
mod room;
mod same_bytes;
mod shaders;
