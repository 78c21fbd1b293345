//! What a view asks the program for.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::Sender;

use ::preview::{Aim, Host, MaterialForm, Picture, Subject};
use parking_lot::Mutex;

use super::controller::{MaterialEdit, PreviewMessage};

/// Sends the requests of a view to the controller, without waiting for it.
pub(super) struct ViewHost {
    pub(super) messages: Sender<PreviewMessage>,
    /// The view's latest state.
    pub(super) state: Arc<Mutex<Option<String>>>,
}

impl Host for ViewHost {
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
