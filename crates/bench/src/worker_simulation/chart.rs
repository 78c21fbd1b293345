//! The charts of `docs/scale.md`.

use super::Outcome;

/// The charts of these outcomes, each with its file name.
pub fn charts(_: &[Outcome]) -> Vec<(&'static str, String)> {
    Vec::new()
}
