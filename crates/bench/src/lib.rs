//! Benchmarks of the whole program, on frozen manifests: `cargo bench -p bench`.
//!
//! The benchmarks of one crate are in that crate.
