//! The weights of a chain's levels in a GGX lobe, printed by
//! `cargo run --release --manifest-path research/Cargo.toml --bin fit-fast-prefilter`.

/// The entries of an octave of spot sizes.
pub(super) const PER_OCTAVE: f64 = 4.0;

/// log2(spot / 2 a) of the first entry.
pub(super) const FIRST: f64 = -2.25;

/// Weights; the last is 0.
pub(super) const WEIGHTS: [f64; 34] = [
    0.0, 0.008, 0.042, 0.1059, 0.2115, 0.3433, 0.4555, 0.5327, 0.5343, 0.4609, 0.3559, 0.2349, 0.1506,
    0.1159, 0.1057, 0.1125, 0.0986, 0.0662, 0.0283, 0.0, 0.0, 0.0012, 0.0125, 0.0125, 0.0036, 0.003, 0.0,
    0.0014, 0.0013, 0.0013, 0.0, 0.0001, 0.0, 0.0,
];
