//! What a view is opened for: a window, or a page in a browser.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::Path;

use ::preview::{InitialView, SubjectRequest};
use engine::Kinds;

use super::files::PreviewFiles;
use super::project::Project;
use crate::print::say;

/// A request for a view: what it shows, and how.
pub(crate) struct ViewRequest<'a> {
    pub(crate) project: &'a Project,
    pub(crate) screenshots: &'a Path,
    pub(crate) kinds: &'a Kinds,
    /// The subject that the view shows first.
    pub(crate) subject: SubjectRequest,
    /// Whether the CPU draws in a window, even if there is a graphics device.
    #[cfg_attr(not(feature = "window"), allow(dead_code, reason = "browsers draw by themselves"))]
    pub(crate) cpu: bool,
    pub(crate) place: ViewPlace,
}

/// Where a view opens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ViewPlace {
    /// In a window; if there can be none, in a page.
    Window,
    Page(Page),
}

impl ViewPlace {
    /// A window, if this program has one, and otherwise a page.
    pub(crate) const USUAL: Self =
        if cfg!(feature = "window") { Self::Window } else { Self::Page(Page::IN_BROWSER) };
}

/// How a page is served.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Page {
    /// The address to listen to, of which port 0 is any.
    pub(crate) address: SocketAddr,
    /// Whether the system's browser opens it.
    pub(crate) opens_browser: bool,
}

impl Page {
    /// A page for this machine alone, which its browser opens.
    pub(crate) const IN_BROWSER: Self =
        Self { address: SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 0), opens_browser: true };
}

/// The view that a window or a page shows first.
pub(super) fn initial_view(manifest: &Path, request: SubjectRequest) -> InitialView {
    let state = PreviewFiles::beside(manifest).state().unwrap_or_else(|reason| {
        say!("warning: {reason}");
        None
    });
    InitialView { state, request }
}
