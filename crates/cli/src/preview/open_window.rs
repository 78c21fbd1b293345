//! Opens the window, and reopens it once if its device is lost.

use std::sync::Arc;
use std::sync::mpsc::Sender;

use ::preview::{InitialView, SubjectRequest};
use engine::Cancel;
use parking_lot::Mutex;
use preview_window::{self as window, UpdateSender, WindowError, WindowSettings};

use super::controller::PreviewMessage;
use super::host::ViewHost;
use super::request::ViewRequest;
use crate::print::say;

/// Shows the window until it is closed.
///
/// # Errors
/// If no window can be opened: why, and what it would have shown.
pub(super) fn show(
    request: &ViewRequest<'_>,
    view: InitialView,
    cancel: &Cancel,
    messages: &Sender<PreviewMessage>,
) -> Result<(), Box<(WindowError, InitialView)>> {
    let InitialView { state, request: mut subject } = view;
    let state = Arc::new(Mutex::new(state));
    let mut may_reopen = true;
    while !cancel.is_cancelled() {
        let view = InitialView { state: state.lock().clone(), request: subject.clone() };
        let settings = WindowSettings { view: view.clone(), cpu: request.cpu, ..WindowSettings::default() };
        let host = ViewHost { messages: messages.clone(), state: Arc::clone(&state) };
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
            Err(error) => return Err(Box::new((error, view))),
        }
    }
    Ok(())
}
