//! Runs a manifest on the disk.

use std::path::Path;

use engine::{BuildOptions, Cancel, Event, Plan, Summary, build};
use tempfile::TempDir;

use crate::fixture::kinds;

/// A manifest in a folder of its own.
pub(crate) struct Pipeline {
    folder: TempDir,
}

impl Pipeline {
    /// A manifest, less its first lines. `CORPUS` in its text is replaced.
    pub(crate) fn new(stages: &str, corpus: &Path) -> Self {
        let folder = TempDir::new().unwrap();
        let stages = stages.replace("CORPUS", &corpus.to_str().unwrap().replace('\\', "/"));
        std::fs::write(folder.path().join("pipeline.toml"), format!("schema = 1\nout = \"out\"\n\n{stages}"))
            .unwrap();
        Self { folder }
    }

    /// A file beside the manifest.
    pub(crate) fn file(self, name: &str, bytes: &[u8]) -> Self {
        std::fs::write(self.folder.path().join(name), bytes).unwrap();
        self
    }

    /// Builds all of it; nothing may fail.
    pub(crate) fn build(&self, jobs: usize) -> Summary {
        let plan = Plan::load(&self.folder.path().join("pipeline.toml"), &kinds())
            .unwrap_or_else(|errors| panic!("{errors}"));
        let options = BuildOptions { jobs: Some(jobs), keep_going: true, ..BuildOptions::default() };
        let record = |event: Event| {
            if let Event::Failed { item, error, .. } = event {
                eprintln!("{item}: {}", error.join(": "));
            }
        };
        let summary = build(&plan, &options, &Cancel::default(), &record).unwrap();
        assert_eq!(summary.failed + summary.skipped, 0);
        summary
    }

    /// A file that was published.
    pub(crate) fn out(&self, file: &str) -> Vec<u8> {
        let path = self.folder.path().join("out").join(file);
        std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    /// The coefficients in a published file.
    pub(crate) fn lighting(&self, file: &str) -> sh::Expansion {
        containers::tensors::decode_lighting(&self.out(file)).unwrap().series
    }
}
