//! The way from the program to the window.

use std::sync::mpsc::Sender;

use preview::PreviewUpdate;

/// Sends updates to a window and repaints it, from any thread.
#[derive(Clone, Debug)]
pub struct UpdateSender {
    updates: Sender<PreviewUpdate>,
    window: eframe::egui::Context,
}

impl UpdateSender {
    pub(crate) fn new(updates: Sender<PreviewUpdate>, window: eframe::egui::Context) -> Self {
        Self { updates, window }
    }

    /// Sends an update. After the window has closed this does nothing.
    pub fn send(&self, update: PreviewUpdate) {
        if self.updates.send(update).is_ok() {
            self.window.request_repaint();
        }
    }
}
