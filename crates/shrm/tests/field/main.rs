//! The reflected field of general materials: evaluation, maps, look-ups and resolution.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // a test may panic

mod disks;
mod evaluation;
mod head_on;
mod maps;
mod materials;
mod resolution;
