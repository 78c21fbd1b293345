//! `specula preview`: materials under environments on meshes, in a window that follows every change, or as one picture.
//!
//! The window has the main thread, as systems want it. A watcher builds on another, and on a third a [`PreviewController`] turns what
//! it hears into what the window shows. Where no window can be opened, the curator draws stills instead.

mod controller;
mod files;
mod status;
mod still;
mod subject;
mod window;

use ::preview::window::Wish;
use engine::Kinds;
use stages::PreviewCatalog;

use crate::arguments::{Backend, ManifestArgument, PreviewArguments, WatchArguments};
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
    let wish = Wish { mode: arguments.mode, ..arguments.item.clone().unwrap_or_default() };
    if let Err(unknown) = subject::check(&showcase, &wish) {
        print::error(&[unknown.message], Some(&unknown.help));
        return Exit::Usage;
    }
    if let Some(file) = &arguments.still {
        return still::run(arguments, file, showcase, &wish);
    }
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

/// `specula watch --preview`.
pub(crate) fn beside_watch(arguments: &WatchArguments, kinds: &Kinds) -> Exit {
    let opening = window::WindowRequest {
        manifest: &arguments.manifest.manifest,
        kinds,
        stages: &arguments.stages,
        wish: Wish::default(),
        cpu: false,
        goes_on_without: true,
    };
    window::run(&opening, |cancel, also| watch::keep_fresh(arguments, kinds, cancel, also))
}
