//! `specula preview`: materials under environments on meshes, in a window that follows every change, or as one picture.
//!
//! The window has the main thread, as systems want it. A watcher builds on another, and on a third a [`PreviewController`] turns what
//! it hears into what the window shows. Where no window can be opened, the curator draws stills instead.

mod controller;
mod files;
#[cfg(feature = "window")]
mod host;
mod status;
mod still;
mod subject;
mod window;

use ::preview::{InitialView, SubjectRequest};
use engine::Kinds;
use stages::PreviewCatalog;

#[cfg(feature = "window")]
use crate::arguments::Backend;
use crate::arguments::{ManifestArgument, PreviewArguments, WatchArguments};
use crate::{Exit, manifest, print, watch};

pub(crate) use still::{parse_exposure, parse_file as parse_still, parse_size};
pub(crate) use subject::{parse_item, parse_mode};

pub(crate) fn run(arguments: &PreviewArguments, kinds: &Kinds) -> Exit {
    let manifest = ManifestArgument { manifest: arguments.manifest.clone() };
    let plan = match manifest::load(&manifest, kinds) {
        Ok(plan) => plan,
        Err(exit) => return exit,
    };
    let showcase = PreviewCatalog::of(plan);
    if showcase.is_empty() {
        let amiss = subject::nothing(&arguments.manifest, &[]);
        print::error(&[amiss.message], Some(&amiss.help));
        return Exit::Manifest;
    }
    let wish = SubjectRequest { mode: arguments.mode, ..arguments.item.clone().unwrap_or_default() };
    if let Err(unknown) = subject::check(&showcase, &wish) {
        print::error(&[unknown.message], Some(&unknown.help));
        return Exit::Usage;
    }
    if let Some(file) = &arguments.still {
        // As a window shows it that was never opened before.
        let view = InitialView { state: None, request: wish };
        return still::run(arguments, file, showcase, &view);
    }
    open(arguments, kinds, showcase, manifest, wish)
}

/// Opens the window.
#[cfg(feature = "window")]
fn open(
    arguments: &PreviewArguments,
    kinds: &Kinds,
    _: PreviewCatalog,
    manifest: ManifestArgument,
    wish: SubjectRequest,
) -> Exit {
    let watching = WatchArguments {
        stages: Vec::new(),
        manifest,
        json: false,
        once: false,
        preview: true,
        way: arguments.way.clone(),
    };
    let opening = window::WindowRequest {
        manifest: &watching.manifest.manifest,
        kinds,
        stages: &watching.stages,
        wish,
        cpu: arguments.backend == Some(Backend::Cpu),
        goes_on_without: false,
    };
    window::run(&opening, |cancel, also| watch::keep_fresh(&watching, kinds, cancel, also))
}

/// Without the feature `window`: draws what the window would show first.
#[cfg(not(feature = "window"))]
fn open(
    arguments: &PreviewArguments,
    _: &Kinds,
    catalog: PreviewCatalog,
    manifest: ManifestArgument,
    wish: SubjectRequest,
) -> Exit {
    let view = window::initial_view(&manifest.manifest, wish);
    let file = files::PreviewFiles::beside(&manifest.manifest).still();
    let exit = still::run(arguments, &file, catalog, &view);
    if exit == Exit::Success {
        print::say!("{}", window::HINT);
    }
    exit
}

/// `specula watch --preview`.
pub(crate) fn beside_watch(arguments: &WatchArguments, kinds: &Kinds) -> Exit {
    let opening = window::WindowRequest {
        manifest: &arguments.manifest.manifest,
        kinds,
        stages: &arguments.stages,
        wish: SubjectRequest::default(),
        cpu: false,
        goes_on_without: true,
    };
    window::run(&opening, |cancel, also| watch::keep_fresh(arguments, kinds, cancel, also))
}
