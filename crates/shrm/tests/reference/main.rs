//! Reflected light against values that were made without this project's code.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // a test may panic, and reads reference files

mod brute_force;
mod coefficients;
mod given;
mod prefilter;
mod radial;
