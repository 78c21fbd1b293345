//! `specula preview`: materials on meshes under environments, in a window that follows every change, or as
//! one picture.
//!
//! The window has the main thread, as systems require. A watcher builds on a second thread, and on a third a
//! [`PreviewController`](controller::PreviewController) turns the watcher's events into what the window
//! shows. If no window can be opened, the controller draws stills instead.

mod controller;
mod dropped;
mod files;
#[cfg(feature = "window")]
mod host;
mod light_edit;
mod material_edit;
mod project;
mod request;
mod status;
mod still;
mod subject;
mod watched;
mod window;

use std::path::PathBuf;

use ::preview::{InitialView, SubjectRequest};
use engine::Kinds;
use stages::PreviewCatalog;

use self::files::SCREENSHOTS;
use self::project::Project;
use self::request::WindowRequest;
use self::subject::SubjectError;
#[cfg(feature = "window")]
use crate::arguments::Backend;
use crate::arguments::{MANIFEST, ManifestArgument, PreviewArguments, WatchArguments};
use crate::command_error::CommandError;
use crate::exit::Exit;
#[cfg(not(feature = "window"))]
use crate::print::say;
use crate::{assets, manifest, print, watch, working_folder};

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
    let mut manifest = ManifestArgument { manifest: path };
    let mut project = Project { manifest: working_folder::path(&manifest.manifest), ..Project::default() };
    if !is_project {
        project = Project::of_files(&arguments.files)?;
        manifest.manifest.clone_from(&project.manifest);
        screenshots = SCREENSHOTS.into();
    }
    let catalog = PreviewCatalog::of(manifest::load(&manifest, kinds).map_err(CommandError::print)?);
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
    open(arguments, kinds, catalog, project, screenshots, request)
}

#[cfg(feature = "window")]
fn open(
    arguments: &PreviewArguments,
    kinds: &Kinds,
    _: PreviewCatalog,
    project: Project,
    screenshots: PathBuf,
    subject: SubjectRequest,
) -> Result<Exit, Exit> {
    let request = WindowRequest {
        project: &project,
        screenshots: &screenshots,
        kinds,
        subject,
        cpu: arguments.backend == Some(Backend::Cpu),
        continues_without: false,
    };
    Ok(window::run(&request, |project, cancel, wanted, listener| {
        let watched = WatchArguments {
            stages: project.stages,
            manifest: ManifestArgument { manifest: project.manifest },
            force: false,
            json: false,
            once: false,
            keep_scratch: false,
            preview: true,
            watching: arguments.watching.clone(),
        };
        watch::watch(&watched, kinds, cancel, wanted, listener)
    }))
}

/// Without the feature `window`: draws what the window would show first.
#[cfg(not(feature = "window"))]
fn open(
    arguments: &PreviewArguments,
    _: &Kinds,
    catalog: PreviewCatalog,
    project: Project,
    _: PathBuf,
    subject: SubjectRequest,
) -> Result<Exit, Exit> {
    let view = request::initial_view(&project.manifest, subject);
    let file = files::PreviewFiles::of(&project).still();
    let exit = still::run(arguments, &file, catalog, &view)?;
    if exit == Exit::Success {
        say!("{}", window::HINT);
    }
    Ok(exit)
}

/// `specula watch --preview`.
pub(crate) fn run_with_watch(arguments: &WatchArguments, kinds: &Kinds) -> Exit {
    let manifest = &arguments.manifest.manifest;
    let place = working_folder::path(manifest);
    let project = Project { manifest: place, stages: arguments.stages.clone(), files: Vec::new() };
    let request = WindowRequest {
        project: &project,
        screenshots: &manifest.with_file_name(SCREENSHOTS),
        kinds,
        subject: SubjectRequest::default(),
        cpu: false,
        continues_without: true,
    };
    window::run(&request, |project, cancel, wanted, listener| {
        let watched = WatchArguments {
            stages: project.stages,
            manifest: ManifestArgument { manifest: project.manifest },
            ..arguments.clone()
        };
        watch::watch(&watched, kinds, cancel, wanted, listener)
    })
}
