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
mod material_edit;
mod project;
mod request;
mod status;
mod still;
mod subject;
mod window;

use std::path::PathBuf;

use ::preview::{InitialView, SubjectRequest};
use engine::Kinds;
use stages::PreviewCatalog;

use self::files::SCREENSHOTS;
use self::request::WindowRequest;
use self::subject::SubjectError;
#[cfg(feature = "window")]
use crate::arguments::Backend;
use crate::arguments::{MANIFEST, ManifestArgument, PreviewArguments, WatchArguments};
use crate::exit::Exit;
#[cfg(not(feature = "window"))]
use crate::print::say;
use crate::{assets, manifest, print, watch};

pub(crate) fn run(arguments: &PreviewArguments, kinds: &Kinds) -> Result<Exit, Exit> {
    let is_project = match &arguments.files[..] {
        [] => true,
        [file] => assets::is_manifest(file),
        _ => false,
    };
    if arguments.manifest {
        if is_project {
            print::error(&["there is a manifest already".into()], None);
            return Err(Exit::Usage);
        }
        return Ok(print::data(&project::manifest_to_keep(&arguments.files)?));
    }
    let mut path = arguments.files.first().cloned().unwrap_or_else(|| MANIFEST.into());
    manifest::find(&mut path);
    let mut screenshots = path.with_file_name(SCREENSHOTS);
    if !is_project {
        path = project::prepare(&arguments.files)?;
        screenshots = SCREENSHOTS.into();
    }
    let manifest = ManifestArgument { manifest: path };
    let catalog = PreviewCatalog::of(manifest::load(&manifest, kinds)?);
    if catalog.is_empty() {
        subject::nothing_to_preview(&manifest.manifest, &[]).print();
        return Err(Exit::Manifest);
    }
    let request = SubjectRequest { mode: arguments.mode, ..arguments.item.clone().unwrap_or_default() };
    subject::check(&catalog, &request).map_err(SubjectError::print)?;
    if let Some(file) = &arguments.still {
        // The view of a window that was never opened before.
        let view = InitialView { state: None, request };
        return still::run(arguments, file, catalog, &view);
    }
    open(arguments, kinds, catalog, (manifest, screenshots), request)
}

/// Opens the window.
#[cfg(feature = "window")]
fn open(
    arguments: &PreviewArguments,
    kinds: &Kinds,
    _: PreviewCatalog,
    (manifest, screenshots): (ManifestArgument, PathBuf),
    subject: SubjectRequest,
) -> Result<Exit, Exit> {
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
        screenshots: &screenshots,
        kinds,
        stages: &watched.stages,
        subject,
        cpu: arguments.backend == Some(Backend::Cpu),
        continues_without: false,
    };
    Ok(window::run(&request, |cancel, wanted, listener| {
        watch::watch(&watched, kinds, cancel, wanted, listener)
    }))
}

/// Without the feature `window`: draws what the window would show first.
#[cfg(not(feature = "window"))]
fn open(
    arguments: &PreviewArguments,
    _: &Kinds,
    catalog: PreviewCatalog,
    (manifest, _): (ManifestArgument, PathBuf),
    subject: SubjectRequest,
) -> Result<Exit, Exit> {
    let view = request::initial_view(&manifest.manifest, subject);
    let file = files::PreviewFiles::beside(&manifest.manifest).still();
    let exit = still::run(arguments, &file, catalog, &view)?;
    if exit == Exit::Success {
        say!("{}", window::HINT);
    }
    Ok(exit)
}

/// `specula watch --preview`.
pub(crate) fn run_with_watch(arguments: &WatchArguments, kinds: &Kinds) -> Exit {
    let request = WindowRequest {
        manifest: &arguments.manifest.manifest,
        screenshots: &arguments.manifest.manifest.with_file_name(SCREENSHOTS),
        kinds,
        stages: &arguments.stages,
        subject: SubjectRequest::default(),
        cpu: false,
        continues_without: true,
    };
    window::run(&request, |cancel, wanted, listener| watch::watch(arguments, kinds, cancel, wanted, listener))
}
