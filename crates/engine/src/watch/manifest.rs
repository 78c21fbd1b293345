//! The manifest and its graph as they are now, and the last good ones.

use std::path::PathBuf;

use crate::plan::{self, Asked, Expansion, RecordingFolders};
use crate::{Diagnostics, Graph, Kinds, Plan, Source};

/// A manifest that is read again and again.
pub(super) struct ManifestLoader<'a> {
    manifest: PathBuf,
    kinds: &'a Kinds,
    /// The text that `latest` was made of.
    bytes: Option<Vec<u8>>,
    latest: Result<Graph, Diagnostics>,
    /// The last good graph, and its items.
    good: Option<(Graph, Expansion)>,
    /// Whether that is the latest.
    is_latest_good: bool,
}

/// What a look at the manifest and at the folders that it names gave.
pub(super) struct ManifestSnapshot {
    /// What is to be built: of the last good graph where there are faults; `None` where there never was one.
    pub(super) plan: Option<Plan>,
    /// What is wrong with what the manifest says now.
    pub(super) faults: Option<Diagnostics>,
    /// What was asked of the disk.
    pub(super) asked: Asked,
    /// The sources of the graph as it is now and of the last good one.
    pub(super) sources: Vec<Source>,
}

impl<'a> ManifestLoader<'a> {
    pub(super) fn new(manifest: PathBuf, kinds: &'a Kinds) -> Self {
        let latest = Err(Diagnostics::new("", "", Vec::new()));
        Self { manifest, kinds, bytes: None, latest, good: None, is_latest_good: false }
    }

    /// Reads the manifest where it changed, and expands its sources.
    pub(super) fn look(&mut self) -> ManifestSnapshot {
        match plan::read(&self.manifest) {
            Ok(bytes) => {
                if self.bytes.as_ref() != Some(&bytes) {
                    self.latest = Graph::of_bytes(&self.manifest, &bytes, self.kinds);
                    self.bytes = Some(bytes);
                    self.is_latest_good = false;
                }
            }
            Err(faults) => {
                self.latest = Err(faults);
                self.bytes = None;
                self.is_latest_good = false;
            }
        }
        let folders = RecordingFolders::default();
        let before = self.good.as_ref().filter(|_| self.is_latest_good).map(|(_, expansion)| expansion);
        let expanded = self.latest.as_ref().map_err(Clone::clone);
        let expanded = expanded.and_then(|graph| Ok((graph.clone(), graph.expand_after(&folders, before)?)));
        let faults = match expanded {
            Ok(good) => {
                self.good = Some(good);
                self.is_latest_good = true;
                None
            }
            Err(faults) => {
                if let Some((graph, expansion)) = &mut self.good
                    && let Ok(expanded) = graph.expand_after(&folders, Some(expansion))
                {
                    *expansion = expanded;
                }
                Some(faults)
            }
        };
        let graphs = self.latest.as_ref().ok().into_iter().chain(self.good.as_ref().map(|(graph, _)| graph));
        let sources = graphs.flat_map(|graph| graph.sources().map(|(_, source)| source.clone())).collect();
        let plan = self.good.as_ref().map(|(_, expansion)| expansion.plan.clone());
        ManifestSnapshot { plan, faults, asked: folders.asked(), sources }
    }
}
