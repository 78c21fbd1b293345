//! What a watcher tells a build that runs, and what it learns of it.

use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::mpsc::Receiver;

/// A watcher's part in a build.
pub(crate) struct WatchedBuild<'w> {
    pub(crate) heard: HeardChanges,
    /// Becomes the exported files, relative to `out`, that the build removed, even if it fails afterwards.
    pub(crate) removed: &'w mut HashSet<String>,
}

/// The changed files and folders that a watcher has heard of and that the running build was not told of: it
/// will build again because of them. Without a watcher there are none.
#[derive(Default)]
pub(crate) struct HeardChanges {
    paths: HashSet<PathBuf>,
    further: Option<Receiver<PathBuf>>,
}

impl HeardChanges {
    /// The changes before the build, and those that the watcher sends while it runs.
    pub(crate) fn new(paths: HashSet<PathBuf>, further: Receiver<PathBuf>) -> Self {
        Self { paths, further: Some(further) }
    }

    /// Whether one of these files and folders has changed, as far as the watcher has heard until now.
    pub(crate) fn affect(&mut self, read: &[PathBuf]) -> bool {
        self.paths.extend(self.further.iter().flat_map(Receiver::try_iter));
        read.iter().any(|path| self.paths.contains(path))
    }
}

#[cfg(test)]
mod tests {
    use std::slice::from_ref;
    use std::sync::mpsc::channel;

    use super::*;

    #[test]
    fn a_change_counts_from_when_it_is_heard_of() {
        let [before, during, never] = ["before", "during", "never"].map(PathBuf::from);
        let (sender, receiver) = channel();
        let mut heard = HeardChanges::new([before.clone()].into(), receiver);
        assert!(heard.affect(&[never.clone(), before.clone()]) && !heard.affect(from_ref(&during)));
        sender.send(during.clone()).unwrap();
        assert!(heard.affect(from_ref(&during)));
        drop(sender);
        assert!(heard.affect(&[during]) && heard.affect(from_ref(&before)) && !heard.affect(&[never]));
        assert!(!HeardChanges::default().affect(&[before]));
    }
}
