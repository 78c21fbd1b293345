//! The window of the preview.
//!
//! [`open`] shows it and returns when it is closed. What it shows comes from outside, as [`PreviewUpdate`] through a [`UpdateSender`]:
//! which subjects there are, the scene of the one that is wanted, what went wrong. What it wants goes to its [`Host`]. So the
//! window knows no manifest, no watcher and no file.

#![cfg(feature = "window")]

mod adaptive_quality;
mod app;
mod device_health;
mod error_meter;
mod figures;
mod gpu_adapter;
mod host;
mod inspector;
mod keyboard;
mod keys;
mod latest_value;
mod lists;
mod notices;
mod numbers;
mod panel_layout;
mod pointer;
mod render_thread;
mod renderer_adapter;
mod screen;
mod state;
#[cfg(test)]
mod testkit;
mod theme;
mod toolbar;
mod view;

use std::any::Any;
use std::panic::AssertUnwindSafe;
use std::sync::{Arc, PoisonError, mpsc};

use eframe::egui::{IconData, ViewportBuilder};
use eframe::egui_wgpu::{SurfaceConfig, WgpuConfiguration, WgpuSetupCreateNew};
use eframe::{AppCreator, NativeOptions};

use app::{App, Loss};
use preview::{Gpu, InitialView, RenderError};
use state::State;

pub use host::{Host, UpdateSender};

/// How a window begins.
#[derive(Clone, Debug, Default)]
pub struct WindowSettings {
    /// What it shows first. If the kept state cannot be read, a message says so.
    pub view: InitialView,
    /// Whether the CPU draws the pictures even if a graphics device could.
    pub cpu: bool,
    /// Whether the device is destroyed after the first picture, to test the loss of a device.
    pub rehearse_loss: bool,
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
/// `start` is called once the window is there, with what sends it news. PreviewUpdate that is sent after the window has closed
/// goes nowhere.
///
/// # Errors
/// Where no window can be opened (then `start` was not called), and where its device is lost.
pub fn open(
    settings: WindowSettings,
    host: Box<dyn Host>,
    start: impl FnOnce(UpdateSender),
) -> Result<(), WindowError> {
    let state = State::new(settings.view);
    let loss = Loss::default();
    let left = Loss::clone(&loss);
    let options = options(&state);
    let create: AppCreator<'_> = Box::new(move |creation| {
        let gpu = creation.wgpu_render_state.as_ref().ok_or("the window has no graphics device")?;
        let (sender, news) = mpsc::channel();
        let mut app = App::new(creation, gpu, state, host, news, left, settings.cpu)?;
        app.rehearse_loss = settings.rehearse_loss;
        start(UpdateSender::new(sender, creation.egui_ctx.clone()));
        Ok(Box::new(app))
    });
    // What opens windows panics where a display or a device goes away under it.
    let run = AssertUnwindSafe(|| eframe::run_native("specula-preview", options, create));
    let ended = std::panic::catch_unwind(run);
    let lost = loss.lock().unwrap_or_else(PoisonError::into_inner).take();
    match (lost, ended) {
        (Some(reason), _) => Err(WindowError::Lost(reason)),
        (None, Ok(Ok(()))) => Ok(()),
        (None, Ok(Err(error))) => Err(error.into()),
        (None, Err(panic)) => Err(WindowError::Lost(format!("the window stopped: {}", said(panic.as_ref())))),
    }
}

/// What a panic said.
fn said(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("it did not say why").to_owned()
}

/// Works for a thread of the window, and makes an error of a panic: with its thread gone the window would stand still and
/// never say why.
fn guarded<T>(work: impl FnOnce() -> Result<T, RenderError>) -> Result<T, RenderError> {
    let ended = std::panic::catch_unwind(AssertUnwindSafe(work));
    ended.unwrap_or_else(|panic| Err(RenderError::Device(format!("it panicked: {}", said(panic.as_ref())))))
}

fn options(state: &State) -> NativeOptions {
    let mut create = WgpuSetupCreateNew::without_display_handle();
    create.device_descriptor = Arc::new(Gpu::device_descriptor);
    NativeOptions {
        viewport: ViewportBuilder::default()
            .with_title(state.title())
            .with_app_id("specula-preview")
            .with_icon(IconData::default())
            .with_inner_size(state.settings.size)
            .with_maximized(state.settings.maximized)
            .with_min_inner_size([720.0, 400.0]),
        renderer: eframe::Renderer::Wgpu,
        wgpu_options: WgpuConfiguration {
            wgpu_setup: create.into(),
            ..WgpuConfiguration::default().with_surface_config(SurfaceConfig::LOW_LATENCY)
        },
        // The codes of a picture arrive on the screen as they are.
        dithering: false,
        persist_window: false,
        ..NativeOptions::default()
    }
}

impl From<eframe::Error> for WindowError {
    fn from(error: eframe::Error) -> Self {
        match error {
            eframe::Error::Wgpu(error) => Self::NoAdapter(error.to_string()),
            eframe::Error::AppCreation(error) => Self::NoAdapter(error.to_string()),
            eframe::Error::Winit(error) => Self::NoDisplay(without_place(&error.to_string())),
            eframe::Error::WinitEventLoop(error) => Self::NoDisplay(without_place(&error.to_string())),
        }
    }
}

/// A message of winit without the line of its source that it begins with.
fn without_place(message: &str) -> String {
    let place = message.strip_prefix("os error at ").and_then(|rest| rest.split_once(".rs:"));
    let said = place.and_then(|(_, rest)| rest.split_once(": ")).map_or(message, |(_, said)| said);
    said.trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_of_winit_lose_the_place_in_its_source() {
        let long =
            "os error at /home/x/winit-0.30.13/src/platform_impl/linux/mod.rs:788: Failed to open: display";
        assert_eq!(without_place(long), "Failed to open: display");
        assert_eq!(without_place("no place here."), "no place here");
    }
}
