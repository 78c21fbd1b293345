//! The names that a path has relative to `out`.

use std::path::Path;

use super::Plan;
use crate::platform::canonicalize;
use crate::storage::{normal, slashed};

/// The names of a path relative to the plan's `out`, if it is inside; that of `out` itself is empty. They may
/// differ if links lead there.
pub fn names_in_out(plan: &Plan, path: &Path) -> Vec<String> {
    let mut names = Vec::new();
    let absolute = std::env::current_dir().map_or_else(|_| path.to_path_buf(), |folder| folder.join(path));
    let mut places = vec![normal(&absolute)];
    if let (Some(folder), Some(name)) = (absolute.parent(), absolute.file_name())
        && let Ok(folder) = canonicalize(folder)
    {
        places.push(folder.join(name));
    }
    let roots = [Some(normal(&plan.out)), canonicalize(&plan.out).ok()];
    for root in roots.iter().flatten() {
        names.extend(places.iter().filter_map(|place| place.strip_prefix(root).ok()).map(slashed));
    }
    names
}
