//! Loads the manifest and its graph, and keeps the last valid ones.

use crate::kinds::Kinds;
use crate::manifest::Diagnostics;
use crate::plan;
use crate::plan::{Expansion, FolderQueries, Graph, ManifestFile, Plan, RecordingFolders, Source};

/// A manifest that is read again and again.
pub(super) struct ManifestLoader<'a> {
    manifest: ManifestFile,
    kinds: &'a Kinds,
    /// The text of `latest`.
    bytes: Option<Vec<u8>>,
    latest: Result<Graph, Diagnostics>,
    /// The last valid graph, and its items.
    valid: Option<(Graph, Expansion)>,
    is_latest_valid: bool,
}

/// The state of the manifest and of the folders that it names.
pub(super) struct ManifestSnapshot {
    /// The plan to build: that of the last valid graph, if there are errors; `None` if there never was a
    /// valid one.
    pub(super) plan: Option<Plan>,
    /// The errors of the manifest as it is now.
    pub(super) diagnostics: Option<Diagnostics>,
    /// What was asked of the disk.
    pub(super) queries: FolderQueries,
    /// The sources of the latest graph and of the last valid one.
    pub(super) sources: Vec<Source>,
}

impl<'a> ManifestLoader<'a> {
    pub(super) fn new(manifest: ManifestFile, kinds: &'a Kinds) -> Self {
        let latest = Err(Diagnostics::new("", "", Vec::new()));
        Self { manifest, kinds, bytes: None, latest, valid: None, is_latest_valid: false }
    }

    /// Parses the manifest if it changed, and expands its sources.
    pub(super) fn load(&mut self) -> ManifestSnapshot {
        match plan::read(&self.manifest) {
            Ok(bytes) => {
                if self.bytes.as_ref() != Some(&bytes) {
                    self.latest = Graph::of_bytes(&self.manifest, &bytes, self.kinds);
                    self.bytes = Some(bytes);
                    self.is_latest_valid = false;
                }
            }
            Err(diagnostics) => {
                self.latest = Err(diagnostics);
                self.bytes = None;
                self.is_latest_valid = false;
            }
        }
        let folders = RecordingFolders::default();
        let before = self.valid.as_ref().filter(|_| self.is_latest_valid).map(|(_, expansion)| expansion);
        let expanded = self.latest.as_ref().map_err(Clone::clone);
        let expanded = expanded.and_then(|graph| Ok((graph.clone(), graph.expand_after(&folders, before)?)));
        let diagnostics = match expanded {
            Ok(valid) => {
                self.valid = Some(valid);
                self.is_latest_valid = true;
                None
            }
            Err(diagnostics) => {
                if let Some((graph, expansion)) = &mut self.valid
                    && let Ok(expanded) = graph.expand_after(&folders, Some(expansion))
                {
                    *expansion = expanded;
                }
                Some(diagnostics)
            }
        };
        let graphs = self.latest.as_ref().ok().into_iter().chain(self.valid.as_ref().map(|(graph, _)| graph));
        let sources = graphs.flat_map(|graph| graph.sources().map(|(_, source)| source.clone())).collect();
        let plan = self.valid.as_ref().map(|(_, expansion)| expansion.plan.clone());
        ManifestSnapshot { plan, diagnostics, queries: folders.queries(), sources }
    }
}
