//! The layout of the window: panels around the picture, the picture, and the panels over it.

use eframe::egui::{CentralPanel, Frame, Margin, Panel, Rect, TextureId, Ui, vec2};

use crate::dialog::dialog;
use crate::dropped_files;
use crate::error_meter::ErrorMeter;
use crate::inspector::inspector;
use crate::lists::lists;
use crate::notices;
use crate::pointer::Pointer;
use crate::render_thread::RenderedFrame;
use crate::state::{Action, State};
use crate::toolbar::toolbar;
use crate::view::{CaptionSource, view};
use preview::RenderError;

/// The smallest widths of the picture and of the inspector, which is hidden if there is no room for both.
const LEAST_PICTURE: f32 = 300.0;
const LEAST_INSPECTOR: f32 = 240.0;

/// Everything that the window draws from.
pub(crate) struct PanelLayout<'a> {
    pub(crate) state: &'a State,
    pub(crate) error_meter: &'a ErrorMeter,
    /// The picture on the screen.
    pub(crate) frame: Option<(TextureId, &'a RenderedFrame)>,
    /// Whether the picture on the screen is the one requested last, in full resolution.
    pub(crate) is_current: bool,
    /// Why the requested picture cannot be drawn.
    pub(crate) render_error: Option<&'a RenderError>,
    pub(crate) adapter_name: &'a str,
}

impl PanelLayout<'_> {
    /// Draws everything, collects the actions of the pointer, and returns the picture's size in pixels.
    pub(crate) fn draw(&self, ui: &mut Ui, pointer: &mut Pointer, actions: &mut Vec<Action>) -> [u32; 2] {
        let area = self.panels(ui, actions);
        let (picture, size) = pixels(area, ui.pixels_per_point());
        let source = CaptionSource { error_meter: self.error_meter, failed: self.render_error.is_some() };
        view(ui, picture, self.state, self.frame, source, pointer, actions);
        self.over(ui, picture, actions);
        actions.extend(dropped_files::dropped(ui));
        size
    }

    /// Draws the panels around the picture and returns the area left for it.
    fn panels(&self, ui: &mut Ui, actions: &mut Vec<Action>) -> Rect {
        let settings = &self.state.settings;
        let bar = Frame::side_top_panel(ui.style()).inner_margin(Margin::symmetric(8, 5));
        Panel::top("toolbar").frame(bar).show(ui, |ui| toolbar(ui, self.state, actions));
        Panel::bottom("status").frame(bar).show(ui, |ui| {
            let frame = self.frame.map(|(_, frame)| frame);
            let drawing = self.render_error.is_none() && !self.is_current;
            notices::status(ui, self.state, frame, drawing, self.adapter_name, actions);
        });
        if settings.lists {
            let lists_panel = Panel::left("lists").default_size(176.0).min_size(96.0).max_size(320.0);
            lists_panel.show(ui, |ui| lists(ui, self.state, actions));
        }
        let room = ui.available_width() - LEAST_PICTURE;
        if settings.inspector && room >= LEAST_INSPECTOR {
            let panel =
                Panel::right("inspector").default_size(300.0).min_size(LEAST_INSPECTOR).max_size(room);
            panel.show(ui, |ui| inspector(ui, self.state, self.error_meter, actions));
        }
        CentralPanel::no_frame().show(ui, |ui| ui.available_rect_before_wrap()).inner
    }

    fn over(&self, ui: &Ui, picture: Rect, actions: &mut Vec<Action>) {
        let state = self.state;
        notices::toasts(ui, state, picture);
        match (&state.failure, self.render_error) {
            (Some(lines), _) if !state.failure_hidden => {
                notices::failure(ui, picture, lines, actions);
            }
            (_, Some(error)) => notices::render_error(ui, picture, &error.to_string()),
            _ => {}
        }
        if state.help {
            notices::help(ui, picture);
        }
        dropped_files::hovering(ui, picture);
        if let Some(question) = &state.dialog {
            dialog(ui, question, actions);
        }
    }
}

/// The largest part of an area whose edges lie on pixel boundaries, and its size in pixels.
fn pixels(area: Rect, pixels_per_point: f32) -> (Rect, [u32; 2]) {
    let least = (area.min * pixels_per_point).ceil();
    let most = (area.max * pixels_per_point).floor().max(least + vec2(1.0, 1.0));
    let size: [f32; 2] = (most - least).into();
    let rect = Rect::from_min_max(least / pixels_per_point, most / pixels_per_point);
    (rect, size.map(|side| side.max(1.0) as u32))
}

#[cfg(test)]
mod tests;
