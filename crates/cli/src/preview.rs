//! `specula preview`: materials on meshes under environments, in a window or a page that follows every
//! change, or as one picture.
//!
//! The window has the main thread, as systems require. A watcher builds on a second thread, and on a third a
//! [`PreviewController`](controller::PreviewController) turns the watcher's events into what the view shows:
//! the window, or the page of a server, for which the main thread waits.

mod controller;
mod dropped;
mod files;
mod host;
mod light_edit;
mod material_edit;
mod open_page;
#[cfg(feature = "window")]
mod open_window;
mod project;
mod request;
mod status;
mod still;
mod subject;
mod view;
mod watched;

use ::preview::{InitialView, SubjectRequest};
use engine::Kinds;
use stages::PreviewCatalog;

use self::files::SCREENSHOTS;
use self::project::Project;
use self::request::{Page, ViewPlace, ViewRequest};
use self::subject::SubjectError;
use crate::arguments::{Backend, MANIFEST, ManifestArgument, PreviewArguments, WatchArguments};
use crate::command_error::CommandError;
use crate::exit::Exit;
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
    let page = |address| ViewPlace::Page(Page { address, opens_browser: !arguments.page.no_open });
    let place = match arguments.page.serve {
        Some(address) => page(address),
        None if arguments.page.no_open => page(Page::IN_BROWSER.address),
        None => ViewPlace::USUAL,
    };
    let request = ViewRequest {
        project: &project,
        screenshots: &screenshots,
        kinds,
        subject: request,
        cpu: arguments.backend == Some(Backend::Cpu),
        place,
    };
    Ok(view::run(&request, |project, cancel, wanted, listener| {
        let watched = WatchArguments {
            stages: project.stages,
            manifest: ManifestArgument { manifest: project.manifest },
            force: false,
            json: false,
            once: false,
            keep_scratch: false,
            preview: true,
            serve: None,
            watching: arguments.watching.clone(),
        };
        watch::watch(&watched, kinds, cancel, wanted, listener)
    }))
}

/// `specula watch --preview`, and `--serve`.
pub(crate) fn run_with_watch(arguments: &WatchArguments, kinds: &Kinds) -> Exit {
    let manifest = &arguments.manifest.manifest;
    let place = working_folder::path(manifest);
    let project = Project { manifest: place, stages: arguments.stages.clone(), files: Vec::new() };
    let request = ViewRequest {
        project: &project,
        screenshots: &manifest.with_file_name(SCREENSHOTS),
        kinds,
        subject: SubjectRequest::default(),
        cpu: false,
        place: match arguments.serve {
            Some(address) => ViewPlace::Page(Page { address, opens_browser: false }),
            None => ViewPlace::USUAL,
        },
    };
    view::run(&request, |project, cancel, wanted, listener| {
        let watched = WatchArguments {
            stages: project.stages,
            manifest: ManifestArgument { manifest: project.manifest },
            ..arguments.clone()
        };
        watch::watch(&watched, kinds, cancel, wanted, listener)
    })
}
