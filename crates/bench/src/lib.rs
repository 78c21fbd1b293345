//! Benchmarks of the whole program on frozen manifests, and of [RH02, tabs. 4 and 5]: `cargo bench -p bench`.
//!
//! The benchmarks of one crate are in that crate. `cargo run --release -p bench --bin paper-ratios` prints
//! the tables, `--bin watch-latency` how long a save takes until its maps are published, `--bin
//! default-errors` how close to brute force maps at default settings are, and `--bin stop-latency` how soon
//! items stop that are cancelled. `--bin sampling-figures` draws the figures of `docs/sampling.md`, and, with
//! the feature `remote`, `--bin simulate-workers` those of `docs/scale.md`.

pub mod default_errors;
pub mod latency;
pub mod paper;
pub mod sampling_figures;
#[cfg(feature = "remote")]
pub mod worker_simulation;
