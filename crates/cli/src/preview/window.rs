//! A window, or a still in its place, beside a watcher.

use std::sync::mpsc::{Sender, channel};
use std::thread;
use std::time::Instant;

use engine::{Cancel, Event, Wanted};
use parking_lot::Mutex;

use super::controller::{PreviewController, PreviewMessage};
#[cfg(feature = "window")]
use super::host::show;
use super::project::Project;
use super::request::WindowRequest;
use super::watched::WatchedProject;
use crate::build::stop_on_interrupt;
use crate::exit::Exit;

/// How to get a window.
#[cfg(not(feature = "window"))]
pub(crate) const HINT: &str = "`cargo install --path crates/cli --features window` opens a window";

/// Opens a window beside a watcher, and returns when both have ended. `watch` watches a project until it is
/// cancelled; if files are dropped on the window, it is called again with their project.
pub(crate) fn run(
    request: &WindowRequest<'_>,
    watch: impl Fn(Project, &Cancel, &Wanted, &(dyn Fn(&Event) + Sync)) -> Exit + Sync,
) -> Exit {
    let (messages, receiver) = channel();
    let cancel = Cancel::default();
    let interrupted = messages.clone();
    stop_on_interrupt(&cancel, move || _ = interrupted.send(PreviewMessage::Close));
    let watched = WatchedProject::new(request.project.clone(), &cancel);
    let controller = PreviewController::new(request, &cancel, &watched);
    let wanted = controller.goes_first();
    thread::scope(|scope| {
        let controller = scope.spawn(move || in_own_pool(move || controller.run(&receiver)));
        let watcher = scope.spawn(|| {
            let events = Mutex::new(messages.clone());
            let listener = |event: &Event| {
                // Only a timeline needs to know what each worker did.
                if !matches!(event, Event::TaskTimed { .. }) {
                    let _ = events.lock().send(PreviewMessage::Event(event.clone(), Instant::now()));
                }
            };
            // However the watcher ends, the window has nothing more to show.
            let _guard = CloseOnDrop(&cancel, messages.clone());
            let mut exit = Exit::Success;
            while let Some((project, stop)) = watched.next() {
                let _ = messages.send(PreviewMessage::Watched(project.manifest.clone()));
                exit = watch(project, &stop, &wanted, &listener);
            }
            exit
        });
        let shown = show(request, &cancel, &messages);
        let has_window = shown.is_ok();
        match shown {
            Ok(()) => cancel.cancel(),
            Err(view) => _ = messages.send(PreviewMessage::NoWindow(view)),
        }
        let watched = watcher.join();
        let _ = messages.send(PreviewMessage::End);
        match (watched, controller.join()) {
            (Err(panic), _) | (_, Err(panic)) => std::panic::resume_unwind(panic),
            // The window that was asked for could not be opened.
            (Ok(Exit::Success), _) if !has_window && !request.continues_without => Exit::System,
            (Ok(exit), _) => exit,
        }
    })
}

/// Runs the controller with threads of its own. The maps that it makes would wait behind a picture by brute
/// force, which occupies the shared ones for long.
fn in_own_pool(run: impl FnOnce() + Send) {
    match rayon::ThreadPoolBuilder::new().thread_name(|_| "preview maps".into()).build() {
        Ok(pool) => pool.install(run),
        Err(_) => run(),
    }
}

/// Stops the watcher and closes the window when it is dropped.
struct CloseOnDrop<'a>(&'a Cancel, Sender<PreviewMessage>);

impl Drop for CloseOnDrop<'_> {
    fn drop(&mut self) {
        self.0.cancel();
        let _ = self.1.send(PreviewMessage::Close);
    }
}

/// Without the feature `window` a still is drawn in place of the window.
#[cfg(not(feature = "window"))]
fn show(
    request: &WindowRequest<'_>,
    _: &Cancel,
    _: &Sender<PreviewMessage>,
) -> Result<(), Box<::preview::InitialView>> {
    let file = super::files::PreviewFiles::of(request.project).still();
    crate::print::say!(
        "{HINT}; this program keeps a picture in {} up to date instead",
        crate::working_folder::name(&file)
    );
    Err(Box::new(super::request::initial_view(&request.project.manifest, request.subject.clone())))
}
