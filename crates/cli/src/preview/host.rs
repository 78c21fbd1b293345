//! Opens the window, and reopens it once if its device is lost.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::Sender;

use ::preview::{Aim, InitialView, MaterialForm, Picture, Subject, SubjectRequest};
use engine::Cancel;
use parking_lot::Mutex;
use preview_window::{self as window, Host, UpdateSender, WindowError, WindowSettings};

use super::controller::{MaterialEdit, PreviewMessage};
use super::files::PreviewFiles;
use super::request::{WindowRequest, initial_view};
use crate::print::{self, say};
use crate::working_folder;

/// Shows the window until it is closed. If no window can be opened, the error is what it would have shown.
pub(super) fn show(
    request: &WindowRequest<'_>,
    cancel: &Cancel,
    messages: &Sender<PreviewMessage>,
) -> Result<(), Box<InitialView>> {
    let InitialView { state, request: mut subject } =
        initial_view(&request.project.manifest, request.subject.clone());
    let state = Arc::new(Mutex::new(state));
    let mut may_reopen = true;
    while !cancel.is_cancelled() {
        let view = InitialView { state: state.lock().clone(), request: subject.clone() };
        let settings = WindowSettings { view: view.clone(), cpu: request.cpu, ..WindowSettings::default() };
        let host = WindowHost { messages: messages.clone(), state: Arc::clone(&state) };
        let sender = messages.clone();
        let on_open = move |window: UpdateSender| {
            let _ = sender.send(PreviewMessage::Opened(Box::new(move |update| window.send(update))));
        };
        match window::open(settings, Box::new(host), on_open) {
            Err(WindowError::Lost(reason)) if may_reopen => {
                say!("warning: the graphics device is lost ({reason}); reopening the window");
                // The window shows what it showed last.
                (may_reopen, subject) = (false, SubjectRequest::default());
            }
            Ok(()) => return Ok(()),
            Err(error) => {
                let file = working_folder::name(&PreviewFiles::of(request.project).still());
                let next = if request.continues_without { "; watching continues" } else { "" };
                let help = format!("a picture is drawn to {file} instead{next}");
                print::error(&[format!("cannot open a window: {error}")], Some(&help));
                return Err(Box::new(view));
            }
        }
    }
    Ok(())
}

/// Sends the window's requests to the controller, without waiting for it.
struct WindowHost {
    messages: Sender<PreviewMessage>,
    /// The window's latest state.
    state: Arc<Mutex<Option<String>>>,
}

impl Host for WindowHost {
    fn show(&mut self, subject: &Subject) {
        let _ = self.messages.send(PreviewMessage::Show(subject.clone()));
    }

    fn dropped(&mut self, files: Vec<PathBuf>) {
        let _ = self.messages.send(PreviewMessage::Dropped(files));
    }

    fn return_from_dropped(&mut self) {
        let _ = self.messages.send(PreviewMessage::ReturnFromDropped);
    }

    fn keep_state(&mut self, json: &str) {
        *self.state.lock() = Some(json.to_owned());
        let _ = self.messages.send(PreviewMessage::SaveState(json.to_owned()));
    }

    fn screenshot(&mut self, subject: &Subject, picture: Picture) {
        let _ = self.messages.send(PreviewMessage::SavePicture(subject.clone(), picture));
    }

    fn edit_material(&mut self, material: &str, form: Option<&MaterialForm>) {
        let _ =
            self.messages.send(PreviewMessage::Edit(material.to_owned(), MaterialEdit::Show(form.cloned())));
    }

    fn save_material(&mut self, material: &str, form: &MaterialForm) {
        let _ =
            self.messages.send(PreviewMessage::Edit(material.to_owned(), MaterialEdit::Save(form.clone())));
    }

    fn propose_light(&mut self, turn: Aim) {
        let _ = self.messages.send(PreviewMessage::ProposeLight(turn));
    }

    fn save_light(&mut self, turn: Aim, lines: &[String]) {
        let _ = self.messages.send(PreviewMessage::SaveLight(turn, lines.to_vec()));
    }

    fn closed(&mut self) {}
}
