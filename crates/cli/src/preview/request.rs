//! What a window is opened for.

use std::path::Path;

use ::preview::{InitialView, SubjectRequest};
use engine::Kinds;

use super::files::PreviewFiles;
use super::project::Project;
use crate::print::say;

/// A request for a window: what it shows, and how.
pub(crate) struct WindowRequest<'a> {
    pub(crate) project: &'a Project,
    pub(crate) screenshots: &'a Path,
    pub(crate) kinds: &'a Kinds,
    /// The subject that the window shows first.
    pub(crate) subject: SubjectRequest,
    /// Whether the CPU draws, even if there is a graphics device.
    #[cfg_attr(not(feature = "window"), allow(dead_code, reason = "stills are drawn by the CPU"))]
    pub(crate) cpu: bool,
    /// Whether the watcher continues if no window can be opened.
    pub(crate) continues_without: bool,
}

/// The view that a window, or the still that replaces it, shows first.
pub(super) fn initial_view(manifest: &Path, request: SubjectRequest) -> InitialView {
    let state = PreviewFiles::beside(manifest).state().unwrap_or_else(|reason| {
        say!("warning: {reason}");
        None
    });
    InitialView { state, request }
}
