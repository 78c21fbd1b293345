//! Which project the watcher watches. It may change while a window is open.

use engine::Cancel;
use parking_lot::Mutex;

use super::project::Project;

pub(crate) struct WatchedProject {
    /// Stops all watching.
    cancel: Cancel,
    state: Mutex<WatchedProjectState>,
}

struct WatchedProjectState {
    project: Project,
    /// Stops the watcher of the project before.
    stop: Cancel,
    /// Whether no watcher has begun with this project.
    is_new: bool,
}

impl WatchedProject {
    pub(crate) fn new(project: Project, cancel: &Cancel) -> Self {
        let state = WatchedProjectState { project, stop: cancel.child(), is_new: true };
        Self { cancel: cancel.clone(), state: Mutex::new(state) }
    }

    /// Watches another project from now on.
    pub(crate) fn change(&self, project: Project) {
        let mut state = self.state.lock();
        state.stop.cancel();
        *state = WatchedProjectState { project, stop: self.cancel.child(), is_new: true };
    }

    /// The project to watch next, and what stops its watcher; `None` if it has been watched to its end.
    pub(crate) fn next(&self) -> Option<(Project, Cancel)> {
        let mut state = self.state.lock();
        let is_new = std::mem::take(&mut state.is_new) && !self.cancel.is_cancelled();
        is_new.then(|| (state.project.clone(), state.stop.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_stops_the_watcher_and_the_next_one_takes_the_latest_project() {
        let project = |name: &str| Project { manifest: name.into(), ..Project::default() };
        let cancel = Cancel::default();
        let watched = WatchedProject::new(project("a"), &cancel);
        let (first, stop) = watched.next().unwrap();
        assert_eq!(first, project("a"));
        assert!(watched.next().is_none(), "it was watched to its end");
        watched.change(project("b"));
        watched.change(project("c"));
        assert!(stop.is_cancelled() && !cancel.is_cancelled());
        let (next, stop) = watched.next().unwrap();
        assert_eq!(next, project("c"));
        assert!(!stop.is_cancelled());
        cancel.cancel();
        assert!(stop.is_cancelled());
        watched.change(project("d"));
        assert!(watched.next().is_none(), "all watching has ended");
    }
}
