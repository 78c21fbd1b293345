//! `specula preview`: materials on meshes under environments, in a window that follows every change, or as
//! one picture.
//!
//! The window has the main thread, as systems require. A watcher builds on a second thread, and on a third a
//! [`PreviewController`](controller::PreviewController) turns the watcher's events into what the window
//! shows. If no window can be opened, the controller draws stills instead.

mod controller;
mod files;
#[cfg(feature = "window")]
mod host;
mod request;
mod status;
mod still;
mod subject;
mod window;

use ::preview::{InitialView, SubjectRequest};
use engine::Kinds;
use stages::PreviewCatalog;

use self::request::WindowRequest;
#[cfg(feature = "window")]
use crate::arguments::Backend;
use crate::arguments::{ManifestArgument, PreviewArguments, WatchArguments};
use crate::exit::Exit;
use crate::{manifest, print, watch};

pub(crate) fn run(arguments: &PreviewArguments, kinds: &Kinds) -> Exit {
    let manifest = ManifestArgument { manifest: arguments.manifest.clone() };
    let plan = match manifest::load(&manifest, kinds) {
        Ok(plan) => plan,
        Err(exit) => return exit,
    };
    let catalog = PreviewCatalog::of(plan);
    if catalog.is_empty() {
        let error = subject::nothing_to_preview(&arguments.manifest, &[]);
        print::error(&[error.message], Some(&error.help));
        return Exit::Manifest;
    }
    let request = SubjectRequest { mode: arguments.mode, ..arguments.item.clone().unwrap_or_default() };
    if let Err(unknown) = subject::check(&catalog, &request) {
        print::error(&[unknown.message], Some(&unknown.help));
        return Exit::Usage;
    }
    if let Some(file) = &arguments.still {
        // The view of a window that was never opened before.
        let view = InitialView { state: None, request };
        return still::run(arguments, file, catalog, &view);
    }
    open(arguments, kinds, catalog, manifest, request)
}

/// Opens the window.
#[cfg(feature = "window")]
fn open(
    arguments: &PreviewArguments,
    kinds: &Kinds,
    _: PreviewCatalog,
    manifest: ManifestArgument,
    subject: SubjectRequest,
) -> Exit {
    let watched = WatchArguments {
        stages: Vec::new(),
        manifest,
        json: false,
        once: false,
        preview: true,
        watching: arguments.watching.clone(),
    };
    let request = WindowRequest {
        manifest: &watched.manifest.manifest,
        kinds,
        stages: &watched.stages,
        subject,
        cpu: arguments.backend == Some(Backend::Cpu),
        continues_without: false,
    };
    window::run(&request, |cancel, listener| watch::watch(&watched, kinds, cancel, listener))
}

/// Without the feature `window`: draws what the window would show first.
#[cfg(not(feature = "window"))]
fn open(
    arguments: &PreviewArguments,
    _: &Kinds,
    catalog: PreviewCatalog,
    manifest: ManifestArgument,
    subject: SubjectRequest,
) -> Exit {
    let view = request::initial_view(&manifest.manifest, subject);
    let file = files::PreviewFiles::beside(&manifest.manifest).still();
    let exit = still::run(arguments, &file, catalog, &view);
    if exit == Exit::Success {
        print::say!("{}", window::HINT);
    }
    exit
}

/// `specula watch --preview`.
pub(crate) fn run_with_watch(arguments: &WatchArguments, kinds: &Kinds) -> Exit {
    let request = WindowRequest {
        manifest: &arguments.manifest.manifest,
        kinds,
        stages: &arguments.stages,
        subject: SubjectRequest::default(),
        cpu: false,
        continues_without: true,
    };
    window::run(&request, |cancel, listener| watch::watch(arguments, kinds, cancel, listener))
}
