//! What the last build made of items, and whether it was made from what is there now.

use std::sync::Arc;

use engine::{Failure, Handle, ItemIndex, Plan, ResultsSnapshot};

use super::names::stage_name;
use super::{CatalogEntry, PreviewCatalog};

/// The artifact that the last build made of a mesh of the manifest.
pub(super) fn handle_of(
    catalog: &PreviewCatalog,
    results: &ResultsSnapshot,
    mesh: &str,
) -> Result<Arc<Handle>, Failure> {
    let item = catalog.mesh_item(mesh).ok_or_else(|| Failure::new("no stage makes a built-in mesh"))?;
    handle(catalog.plan(), results, item)
}

/// The artifact that the last build made of an item.
pub(super) fn handle(
    plan: &Plan,
    results: &ResultsSnapshot,
    item: ItemIndex,
) -> Result<Arc<Handle>, Failure> {
    results.get(item).ok_or_else(|| {
        let (stage, key) = (stage_name(plan, item), &plan.items[item].key);
        Failure::new(format!("{stage} [{key}] has not been built yet, or its result was removed"))
            .help("run `specula build` and fix what it reports")
    })
}

/// Whether one of the items that make the maps of an entry was made from the present light and material.
pub(super) fn is_current(
    plan: &Plan,
    results: &ResultsSnapshot,
    entry: &CatalogEntry,
    item: ItemIndex,
) -> bool {
    let inputs = || plan.items[item].inputs.iter().flatten();
    !entry.maps.contains(&item)
        || results.is_consistent(plan, item) && inputs().all(|input| is_current(plan, results, entry, *input))
}
