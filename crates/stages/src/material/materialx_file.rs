//! Which files are MaterialX.

use std::path::Path;

/// Whether a file's name is that of a MaterialX file.
pub fn is_materialx_file(name: &str) -> bool {
    Path::new(name).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mtlx"))
}
