//! The window of the preview.
//!
//! [`open`] shows it and returns when it is closed. What it shows comes from outside, as [`News`] through a [`NewsSender`]:
//! which subjects there are, the scene of the one that is wanted, what went wrong. What it wants goes to its [`Host`]. So the
//! window knows no manifest, no watcher and no file.

mod host;

use std::sync::mpsc;

pub use host::{Catalogue, Export, Facts, Host, News, NewsSender, Subject, Wish};

/// How a window begins.
#[derive(Clone, Debug, Default)]
pub struct WindowSettings {
    /// What [`Host::keep_state`] was given last. Of an unknown version or broken, it is left out, and the status line says so.
    pub state: Option<String>,
    /// What to show first; it goes before what the state names.
    pub wish: Wish,
}

/// Why there is no window, or no longer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WindowError {
    /// There is nowhere to open it.
    #[error("no display: {0}")]
    NoDisplay(String),
    /// No graphics device can draw it.
    #[error("no graphics device for a window: {0}")]
    NoAdapter(String),
    /// The graphics device stopped working. The state was kept; the window may be opened once more.
    #[error("the graphics device is lost: {0}")]
    Lost(String),
}

/// Shows the window until it is closed. The calling thread must be the main one of the process.
///
/// `start` is called once the window is there, with what sends it news. News that is sent after the window has closed
/// goes nowhere.
///
/// # Errors
/// Where no window can be opened (then `start` was not called), and where its device is lost.
pub fn open(
    settings: WindowSettings,
    host: Box<dyn Host>,
    start: impl FnOnce(NewsSender),
) -> Result<(), WindowError> {
    let _ = (settings, host, start, mpsc::channel::<News>);
    Err(WindowError::NoDisplay("this build has no window yet".into()))
}
