//! The window's side: opening it, again where its device was lost, and without it.

use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};
use std::thread;
use std::time::Instant;

use ::preview::Picture;
use ::preview::window::{self, Host, NewsSender, Subject, WindowError, WindowSettings, Wish};
use engine::{Cancel, Event, Kinds};
use parking_lot::Mutex;

use super::controller::{PreviewController, PreviewMessage};
use super::files::PreviewFiles;
use crate::Exit;
use crate::build::stop_on_interrupt;
use crate::print::{self, say};

/// What a window is opened for.
pub(crate) struct WindowRequest<'a> {
    pub(crate) manifest: &'a Path,
    pub(crate) kinds: &'a Kinds,
    /// The stages that are watched; none stand for all.
    pub(crate) stages: &'a [String],
    /// What to show first.
    pub(crate) wish: Wish,
    /// Whether the CPU draws, also where a graphics device could.
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

/// Shows the window until it is closed; where its device is lost, once more. Where there is none, what it would have been.
fn show(
    opening: &WindowRequest<'_>,
    cancel: &Cancel,
    letters: &Sender<PreviewMessage>,
) -> Result<(), Box<WindowSettings>> {
    let keepsakes = PreviewFiles::beside(opening.manifest);
    let kept = keepsakes.state().unwrap_or_else(|reason| {
        say!("warning: {reason}");
        None
    });
    let state = Arc::new(Mutex::new(kept));
    let mut wish = opening.wish.clone();
    let mut again = true;
    while !cancel.is_cancelled() {
        let settings = WindowSettings {
            state: state.lock().clone(),
            wish: wish.clone(),
            cpu: opening.cpu,
            ..WindowSettings::default()
        };
        let host = WindowHost { letters: letters.clone(), state: Arc::clone(&state) };
        let sender = letters.clone();
        let begin = move |window: NewsSender| {
            let _ = sender.send(PreviewMessage::Opened(Box::new(move |news| window.send(news))));
        };
        let shown = window::open(settings.clone(), Box::new(host), begin);
        match shown {
            Err(WindowError::Lost(reason)) if again => {
                say!("warning: the graphics device is lost ({reason}); the window is opened once more");
                // It comes back as it was left.
                (again, wish) = (false, Wish::default());
            }
            Ok(()) => return Ok(()),
            Err(error) => {
                let file = keepsakes.still();
                let next = if opening.goes_on_without { "; watching goes on" } else { "" };
                let help = format!("a picture is drawn to {} instead{next}", file.display());
                print::error(&[format!("there is no window: {error}")], Some(&help));
                return Err(Box::new(settings));
            }
        }
    }
    Ok(())
}

/// Writes letters for the window; it never waits.
struct WindowHost {
    letters: Sender<PreviewMessage>,
    /// The window's state as it was last.
    state: Arc<Mutex<Option<String>>>,
}

impl Host for WindowHost {
    fn show(&mut self, subject: &Subject) {
        let _ = self.letters.send(PreviewMessage::Wanted(subject.clone()));
    }

    fn keep_state(&mut self, json: &str) {
        *self.state.lock() = Some(json.to_owned());
        let _ = self.letters.send(PreviewMessage::Keep(json.to_owned()));
    }

    fn screenshot(&mut self, subject: &Subject, picture: Picture) {
        let _ = self.letters.send(PreviewMessage::Keepsake(subject.clone(), picture));
    }

    fn closed(&mut self) {}
}
