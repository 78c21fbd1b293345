//! A window or a page in a browser, beside a watcher.

use std::sync::mpsc::{Sender, channel};
use std::thread;
use std::time::Instant;

use engine::{Cancel, Event, Wanted};
use parking_lot::Mutex;

use super::controller::{PreviewController, PreviewMessage};
use super::open_page;
#[cfg(feature = "window")]
use super::open_window;
use super::project::Project;
use super::request::{Page, ViewPlace, ViewRequest, initial_view};
use super::watched::WatchedProject;
use crate::build::stop_on_interrupt;
use crate::exit::Exit;
#[cfg(feature = "window")]
use crate::print::say;

/// Opens a view beside a watcher, and returns when both have ended. `watch` watches a project until it is
/// cancelled; if files are dropped on the view, it is called again with their project.
pub(crate) fn run(
    request: &ViewRequest<'_>,
    watch: impl Fn(Project, &Cancel, &Wanted, &(dyn Fn(&Event) + Sync)) -> Exit + Sync,
) -> Exit {
    let (messages, receiver) = channel();
    let cancel = Cancel::default();
    let interrupted = messages.clone();
    stop_on_interrupt(&cancel, move || _ = interrupted.send(PreviewMessage::Close));
    let watched = WatchedProject::new(request.project.clone(), &cancel);
    let controller = PreviewController::new(request, &watched);
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
            // However the watcher ends, the view has nothing more to show.
            let _guard = CloseOnDrop(&cancel, messages.clone());
            let mut exit = Exit::Success;
            while let Some((project, stop)) = watched.next() {
                let _ = messages.send(PreviewMessage::Watched(project.manifest.clone()));
                exit = watch(project, &stop, &wanted, &listener);
            }
            exit
        });
        let shown = show(request, &cancel, &messages);
        cancel.cancel();
        let watched = watcher.join();
        let _ = messages.send(PreviewMessage::End);
        match (watched, controller.join()) {
            (Err(panic), _) | (_, Err(panic)) => std::panic::resume_unwind(panic),
            (Ok(Exit::Success), _) => shown.err().unwrap_or(Exit::Success),
            (Ok(exit), _) => exit,
        }
    })
}

/// Shows the view until it is closed; a page, if there can be no window.
///
/// # Errors
/// If neither can be shown.
#[cfg_attr(not(feature = "window"), allow(unused_variables, reason = "a page ends when it is told to"))]
fn show(request: &ViewRequest<'_>, cancel: &Cancel, messages: &Sender<PreviewMessage>) -> Result<(), Exit> {
    let view = initial_view(&request.project.manifest, request.subject.clone());
    match request.place {
        ViewPlace::Page(page) => open_page::show(page, request, view, messages),
        #[cfg(not(feature = "window"))]
        ViewPlace::Window => open_page::show(Page::IN_BROWSER, request, view, messages),
        #[cfg(feature = "window")]
        ViewPlace::Window => open_window::show(request, view, cancel, messages).or_else(|why| {
            let (error, view) = *why;
            say!("warning: cannot open a window: {error}; a page for browsers takes its place");
            open_page::show(Page::IN_BROWSER, request, view, messages)
        }),
    }
}

/// Runs the controller with threads of its own. The maps that it makes would wait behind a picture by brute
/// force, which occupies the shared ones for long.
fn in_own_pool(run: impl FnOnce() + Send) {
    match rayon::ThreadPoolBuilder::new().thread_name(|_| "preview maps".into()).build() {
        Ok(pool) => pool.install(run),
        Err(_) => run(),
    }
}

/// Stops the watcher and closes the view when it is dropped.
struct CloseOnDrop<'a>(&'a Cancel, Sender<PreviewMessage>);

impl Drop for CloseOnDrop<'_> {
    fn drop(&mut self) {
        self.0.cancel();
        let _ = self.1.send(PreviewMessage::Close);
    }
}
