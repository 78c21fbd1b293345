//! What the inspector shows of an entry beside its picture.

use brdf::Material;
use engine::{Artifact, ItemIndex, Plan, ResultsSnapshot};
use preview::{Export, SubjectDetails};

use super::last_build::is_current;
use super::light_alone::exported_light;
use super::names::stage_name;
use super::{CatalogEntry, PreviewCatalog, artifact};
use crate::values::artifacts;

impl PreviewCatalog {
    /// Whether the light of a scene of an entry is turned as the manifest says. Light that no environment
    /// made only is when its `rotate` stage has run.
    pub fn is_light_turned(&self, results: &ResultsSnapshot, entry: &CatalogEntry) -> bool {
        let plan = self.plan();
        artifact(plan, entry.environment) == Some(artifacts::Environment::TYPE)
            || entry.lighting.is_some_and(|item| is_current(plan, results, entry, item))
    }

    /// The material of an entry, as the last build made it.
    pub fn material(&self, results: &ResultsSnapshot, entry: &CatalogEntry) -> Option<Material> {
        let material = results.get(entry.material?)?.get::<artifacts::Material>().ok()?;
        Some(material.0.clone())
    }

    /// The facts that the inspector shows about an entry: the sizes of its exported files, the warnings and
    /// notes of its stages, and the warnings of its exports.
    pub fn facts(&self, results: &ResultsSnapshot, entry: &CatalogEntry) -> SubjectDetails {
        let plan = self.plan();
        let exports = entry.exports.iter().filter_map(|&item| {
            let stage = &plan.stages[plan.items[item].stage];
            let parameters = stage.configured.canonical();
            let format =
                parameters["format"].as_str().map_or_else(String::new, |format| format!(", {format}"));
            let sizes = results.file_sizes(item);
            let name = format!("{}{format}", stage.kind.name());
            (!sizes.is_empty()).then(|| Export { name, bytes: sizes.iter().sum() })
        });
        let warnings = |item| {
            let stage = stage_name(plan, item);
            results.warnings(item).iter().map(move |warning| format!("{stage}: warning: {warning}"))
        };
        let messages = entry.ancestry.iter().flat_map(|&item| {
            let stage = stage_name(plan, item);
            warnings(item).chain(results.notes(item).iter().map(move |note| format!("{stage}: {note}")))
        });
        let messages = messages.chain(entry.exports.iter().flat_map(|&item| warnings(item)));
        let outdated = outdated(plan, results, entry).map(|item| {
            let stage = stage_name(plan, item);
            format!("{stage}: this is older than its inputs")
        });
        let export = entry.light_alone.and_then(|light| light.export);
        let remarks = export.and_then(|item| Some((item, exported_light(plan, item)?)));
        let remarks = remarks.and_then(|(item, light)| {
            let stage = stage_name(plan, item);
            light.remark().map(|remark| format!("{stage}: {remark}"))
        });
        SubjectDetails {
            exports: exports.collect(),
            notes: remarks.into_iter().chain(outdated).chain(messages).collect(),
        }
    }
}

/// The items of an entry that are older than their inputs.
fn outdated(plan: &Plan, results: &ResultsSnapshot, entry: &CatalogEntry) -> impl Iterator<Item = ItemIndex> {
    entry.ancestry.iter().copied().filter(|item| !results.is_consistent(plan, *item))
}
