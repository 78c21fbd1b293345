//! Opens the window, and again if its device was lost.

use std::sync::Arc;
use std::sync::mpsc::Sender;

use ::preview::{InitialView, Picture, Subject, SubjectRequest};
use engine::Cancel;
use parking_lot::Mutex;
use preview_window::{self as window, Host, UpdateSender, WindowError, WindowSettings};

use super::controller::PreviewMessage;
use super::files::PreviewFiles;
use super::window::{WindowRequest, initial_view};
use crate::print::{self, say};

/// Shows the window until it is closed; where its device is lost, once more. Where there is none, what it would have been.
pub(super) fn show(
    opening: &WindowRequest<'_>,
    cancel: &Cancel,
    letters: &Sender<PreviewMessage>,
) -> Result<(), Box<InitialView>> {
    let keepsakes = PreviewFiles::beside(opening.manifest);
    let InitialView { state, mut request } = initial_view(opening.manifest, opening.wish.clone());
    let state = Arc::new(Mutex::new(state));
    let mut again = true;
    while !cancel.is_cancelled() {
        let view = InitialView { state: state.lock().clone(), request: request.clone() };
        let settings = WindowSettings { view: view.clone(), cpu: opening.cpu, ..WindowSettings::default() };
        let host = WindowHost { letters: letters.clone(), state: Arc::clone(&state) };
        let sender = letters.clone();
        let begin = move |window: UpdateSender| {
            let _ = sender.send(PreviewMessage::Opened(Box::new(move |news| window.send(news))));
        };
        let shown = window::open(settings, Box::new(host), begin);
        match shown {
            Err(WindowError::Lost(reason)) if again => {
                say!("warning: the graphics device is lost ({reason}); the window is opened once more");
                // It comes back as it was left.
                (again, request) = (false, SubjectRequest::default());
            }
            Ok(()) => return Ok(()),
            Err(error) => {
                let file = keepsakes.still();
                let next = if opening.goes_on_without { "; watching goes on" } else { "" };
                let help = format!("a picture is drawn to {} instead{next}", file.display());
                print::error(&[format!("there is no window: {error}")], Some(&help));
                return Err(Box::new(view));
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
