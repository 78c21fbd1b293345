//! The window of the preview.
//!
//! [`open`] shows it and returns when it is closed. The program around it sends what to show through an
//! [`UpdateSender`], each message a [`preview::PreviewUpdate`]: the subjects that exist, the scene of the
//! selected one, errors. The window sends its own requests to its [`Host`]. So it knows no manifest, no
//! watcher and no file.

#![cfg(feature = "window")]

mod adaptive_quality;
mod app;
mod device_health;
mod dialog;
mod dropped_files;
mod editor;
mod error_meter;
mod gpu_adapter;
mod host;
mod inspector;
mod keyboard;
mod keys;
mod latest_value;
mod lists;
mod material_editor;
mod notices;
mod numbers;
mod panel_layout;
mod panics;
mod picture_texture;
mod pointer;
mod render_thread;
mod renderer_adapter;
mod scene_statistics;
mod state;
#[cfg(test)]
mod testkit;
mod theme;
mod toolbar;
mod view;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, PoisonError, mpsc};

use eframe::egui::{IconData, ViewportBuilder};
use eframe::egui_wgpu::{SurfaceConfig, WgpuConfiguration, WgpuSetupCreateNew};
use eframe::{AppCreator, NativeOptions};

use app::{App, DeviceLoss};
use preview::{Gpu, InitialView};
use state::State;

pub use host::UpdateSender;
pub use preview::Host;

/// How a window begins.
#[derive(Clone, Debug, Default)]
pub struct WindowSettings {
    /// The view that the window shows first. If the saved settings cannot be read, a message says so.
    pub view: InitialView,
    /// Whether the CPU draws the pictures even if a graphics device could.
    pub cpu: bool,
    /// Whether to destroy the device after the first picture, to test what follows.
    pub simulate_device_loss: bool,
}

/// Why the window cannot be opened, or why it closed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WindowError {
    /// There is no display.
    #[error("no display: {0}")]
    NoDisplay(String),
    /// No graphics device can draw the window.
    #[error("no graphics device for a window: {0}")]
    NoAdapter(String),
    /// The graphics device stopped working. The host has the settings; the window may be opened again.
    #[error("the graphics device is lost: {0}")]
    Lost(String),
}

/// Shows the window until it is closed. The calling thread must be the main one of the process.
///
/// `start` is called once the window is open, with the sender of its updates. Updates that are sent after the
/// window has closed are dropped.
///
/// # Errors
/// If the window cannot be opened (then `start` was not called), or if its device is lost.
pub fn open(
    settings: WindowSettings,
    host: Box<dyn Host>,
    start: impl FnOnce(UpdateSender),
) -> Result<(), WindowError> {
    let state = State::new(settings.view);
    let loss = DeviceLoss::default();
    let reported = DeviceLoss::clone(&loss);
    let options = options(&state);
    let create: AppCreator<'_> = Box::new(move |creation| {
        let gpu = creation.wgpu_render_state.as_ref().ok_or("the window has no graphics device")?;
        let (sender, updates) = mpsc::channel();
        let mut app = App::new(creation, gpu, state, host, updates, reported, settings.cpu)?;
        app.simulate_device_loss = settings.simulate_device_loss;
        start(UpdateSender::new(sender, creation.egui_ctx.clone()));
        Ok(Box::new(app))
    });
    // eframe and winit panic if the display or the device disappears.
    let ended = catch_unwind(AssertUnwindSafe(|| eframe::run_native("specula-preview", options, create)));
    let lost = loss.lock().unwrap_or_else(PoisonError::into_inner).take();
    match (lost, ended) {
        (Some(reason), _) => Err(WindowError::Lost(reason)),
        (None, Ok(Ok(()))) => Ok(()),
        (None, Ok(Err(error))) => Err(error.into()),
        (None, Err(panic)) => {
            Err(WindowError::Lost(format!("the window panicked: {}", panics::message(panic.as_ref()))))
        }
    }
}

fn options(state: &State) -> NativeOptions {
    let mut create = WgpuSetupCreateNew::without_display_handle();
    create.native_adapter_selector = Some(Arc::new(Gpu::best_adapter));
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
        // The screen shows the picture's codes unchanged.
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
            eframe::Error::Winit(error) => Self::NoDisplay(without_location(&error.to_string())),
            eframe::Error::WinitEventLoop(error) => Self::NoDisplay(without_location(&error.to_string())),
        }
    }
}

/// A message of winit without the source location that it begins with.
fn without_location(message: &str) -> String {
    let location = message.strip_prefix("os error at ").and_then(|rest| rest.split_once(".rs:"));
    let text = location.and_then(|(_, rest)| rest.split_once(": ")).map_or(message, |(_, text)| text);
    text.trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_of_winit_lose_their_source_location() {
        let long =
            "os error at /home/x/winit-0.30.13/src/platform_impl/linux/mod.rs:788: Failed to open: display";
        assert_eq!(without_location(long), "Failed to open: display");
        assert_eq!(without_location("no location here."), "no location here");
    }
}
