//! Benchmarks of the whole program on frozen manifests: `cargo bench -p bench`.
//!
//! The benchmarks of one crate are in that crate. `cargo run --release -p bench --bin watch-latency` prints
//! how long a save takes until its maps are published, with given degrees and with defaults, `--bin
//! stop-latency` how soon items stop that are cancelled, and, with the feature `gpu`, `--bin
//! preview-frame-times` how long the preview takes for a frame, `--bin shading-rates` how many frames a
//! second are shaded with BRDF tables, and `--bin brute-force-noise` what samples of the product of light and
//! material save. `--bin default-errors` prints how close to brute force maps at default
//! settings are, over photographs of the corpus.

pub mod default_errors;
pub mod frames;
pub mod latency;
