//! The two directions between the window and the program around it.

use std::sync::mpsc::Sender;

use preview::{Picture, PreviewUpdate, Subject};

/// Sends news to a window and wakes it, from any thread.
#[derive(Clone, Debug)]
pub struct UpdateSender {
    news: Sender<PreviewUpdate>,
    window: eframe::egui::Context,
}

impl UpdateSender {
    pub(crate) fn new(news: Sender<PreviewUpdate>, window: eframe::egui::Context) -> Self {
        Self { news, window }
    }

    /// Sends. After the window has closed this does nothing.
    pub fn send(&self, news: PreviewUpdate) {
        if self.news.send(news).is_ok() {
            self.window.request_repaint();
        }
    }
}

/// The program around the window. It is called on the window's thread, so that no method may wait for anything.
pub trait Host: Send {
    /// The window wants a subject; [`PreviewUpdate::Scene`] is to follow, or [`PreviewUpdate::Failure`]. An earlier wish is no longer wanted.
    fn show(&mut self, subject: &Subject);

    /// What to give to the next window as [`WindowSettings::state`]: JSON. Called a moment after the last change, and
    /// when the window closes.
    ///
    /// [`WindowSettings::state`]: super::WindowSettings::state
    fn keep_state(&mut self, json: &str);

    /// Keeps a picture of a subject. A [`PreviewUpdate::Toast`] is to say where, or why not.
    fn screenshot(&mut self, subject: &Subject, picture: Picture);

    /// The window has closed.
    fn closed(&mut self);
}
