//! A window, or a still in its place, beside a watcher.

use std::path::Path;
use std::sync::mpsc::{Sender, channel};
use std::thread;
use std::time::Instant;

use ::preview::InitialView;
use ::preview::SubjectRequest;
use engine::{Cancel, Event, Kinds};
use parking_lot::Mutex;

use super::controller::{PreviewController, PreviewMessage};
use super::files::PreviewFiles;
use crate::Exit;
use crate::build::stop_on_interrupt;
use crate::print::say;

#[cfg(feature = "window")]
use super::host::show;

/// How to get a window.
#[cfg(not(feature = "window"))]
pub(crate) const HINT: &str = "`cargo install --path crates/cli --features window` opens a window";

/// What a window is opened for.
pub(crate) struct WindowRequest<'a> {
    pub(crate) manifest: &'a Path,
    pub(crate) kinds: &'a Kinds,
    /// The stages that are watched; none stand for all.
    pub(crate) stages: &'a [String],
    /// What to show first.
    pub(crate) wish: SubjectRequest,
    /// Whether the CPU draws, also where a graphics device could.
    #[cfg_attr(not(feature = "window"), allow(dead_code, reason = "stills are drawn by the CPU"))]
    pub(crate) cpu: bool,
    /// Whether the watcher goes on where no window can be opened.
    pub(crate) goes_on_without: bool,
}

/// Opens a window beside a watcher, and returns when both have ended.
pub(crate) fn run(
    opening: &WindowRequest<'_>,
    watch: impl FnOnce(&Cancel, &(dyn Fn(&Event) + Sync)) -> Exit + Send,
) -> Exit {
    let (letters, desk) = channel();
    let cancel = Cancel::default();
    let closing = letters.clone();
    stop_on_interrupt(&cancel, move || _ = closing.send(PreviewMessage::Close));
    let curator = PreviewController::new(opening, &cancel);
    thread::scope(|scope| {
        let curator = scope.spawn(move || curator.run(&desk));
        let watcher = scope.spawn(|| {
            let heard = Mutex::new(letters.clone());
            let also = |event: &Event| {
                // What each worker did when is a timeline's business.
                if !matches!(event, Event::TaskTimed { .. }) {
                    let _ = heard.lock().send(PreviewMessage::Event(event.clone(), Instant::now()));
                }
            };
            // However it ends, nothing is left to be shown.
            let _closing = Closing(&cancel, letters.clone());
            watch(&cancel, &also)
        });
        let shown = show(opening, &cancel, &letters);
        let is_shown = shown.is_ok();
        match shown {
            Ok(()) => cancel.cancel(),
            Err(settings) => _ = letters.send(PreviewMessage::NoWindow(settings)),
        }
        let watched = watcher.join();
        let _ = letters.send(PreviewMessage::End);
        let ended = curator.join();
        match (watched, ended) {
            (Err(panic), _) | (_, Err(panic)) => std::panic::resume_unwind(panic),
            // Who asked for a window has none.
            (Ok(Exit::Success), _) if !is_shown && !opening.goes_on_without => Exit::Machine,
            (Ok(exit), _) => exit,
        }
    })
}

/// Stops the watcher and closes the window when it is dropped.
struct Closing<'a>(&'a Cancel, Sender<PreviewMessage>);

impl Drop for Closing<'_> {
    fn drop(&mut self) {
        self.0.cancel();
        let _ = self.1.send(PreviewMessage::Close);
    }
}

/// What a window or the still in its place shows first.
pub(super) fn initial_view(manifest: &Path, request: SubjectRequest) -> InitialView {
    let state = PreviewFiles::beside(manifest).state().unwrap_or_else(|reason| {
        say!("warning: {reason}");
        None
    });
    InitialView { state, request }
}

/// Without the feature `window` there is none: a still is drawn in its place.
#[cfg(not(feature = "window"))]
fn show(opening: &WindowRequest<'_>, _: &Cancel, _: &Sender<PreviewMessage>) -> Result<(), Box<InitialView>> {
    let file = PreviewFiles::beside(opening.manifest).still();
    say!("{HINT}; this program keeps a picture in {} up to date instead", file.display());
    Err(Box::new(initial_view(opening.manifest, opening.wish.clone())))
}
