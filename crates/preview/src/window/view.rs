//! The picture, and what the pointer does on it.

use eframe::egui::{
    Align2, CursorIcon, Id, PointerButton, Pos2, Rect, Response, Sense, Stroke, TextureId, Ui, pos2, vec2,
};

use super::keys::label;
use super::notices::caption;
use super::numbers;
use super::settings::{Aim, Arrangement};
use super::state::{Action, State};
use super::studio::Frame;
use super::theme;
use crate::Show;

/// Radians for every point of a drag: the width of a window is about two turns.
const TURN: f64 = 0.01;

/// How many times nearer for every point of the wheel.
const ZOOM: f64 = 1.0015;

/// Half the width in which the divider is taken hold of, in points.
const GRIP: f32 = 6.0;

/// Draws the picture into `rect`, and gathers what the pointer does there.
pub(super) fn view(
    ui: &mut Ui,
    rect: Rect,
    state: &State,
    picture: Option<(TextureId, &Frame)>,
    actions: &mut Vec<Action>,
) {
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 0.0, theme::BEHIND);
    if let Some((texture, _)) = picture {
        let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        painter.image(texture, rect, whole, eframe::egui::Color32::WHITE);
    }
    let response = ui.interact(rect, Id::unique("picture"), Sense::click_and_drag());
    pointer(ui, &response, actions);
    captions(ui, rect, state, picture.map(|(_, frame)| frame));
    if state.settings.arrangement == Arrangement::Split {
        divider(ui, rect, state.settings.divider, actions);
    }
}

fn pointer(ui: &Ui, response: &Response, actions: &mut Vec<Action>) {
    if response.is_pointer_button_down_on() {
        // Keys go to the picture again, not to the widget that was used last.
        if let Some(id) = ui.memory(|memory| memory.focused()) {
            ui.memory_mut(|memory| memory.surrender_focus(id));
        }
    }
    let drag = response.drag_delta();
    let by = Aim { yaw: TURN * f64::from(drag.x), pitch: TURN * f64::from(drag.y) };
    if drag != vec2(0.0, 0.0) {
        if response.dragged_by(PointerButton::Primary) {
            // The scene follows the hand, so that the camera goes the other way around it.
            actions.push(Action::Orbit(Aim { yaw: -by.yaw, ..by }));
        } else if response.dragged_by(PointerButton::Secondary) {
            actions.push(Action::TurnLight(by));
        }
    }
    if response.double_clicked() {
        actions.push(Action::ResetCamera);
    }
    if response.contains_pointer() {
        let wheel = ui.input(|input| input.smooth_scroll_delta().y);
        if wheel != 0.0 {
            actions.push(Action::ZoomBy(ZOOM.powf(f64::from(wheel))));
        }
    }
}

fn captions(ui: &Ui, rect: Rect, state: &State, frame: Option<&Frame>) {
    let settings = &state.settings;
    let inside = rect.shrink(10.0);
    match settings.arrangement {
        Arrangement::One => caption(ui, inside.left_top(), Align2::LEFT_TOP, label(settings.mode)),
        Arrangement::Split => {
            let at = rect.left() + rect.width() * settings.divider;
            caption(ui, pos2(at - 10.0, inside.top()), Align2::RIGHT_TOP, label(settings.mode));
            caption(ui, pos2(at + 10.0, inside.top()), Align2::LEFT_TOP, label(settings.second));
        }
        Arrangement::Difference => {
            let text = format!(
                "{} less {}, x {:.0}",
                label(settings.mode),
                label(settings.second),
                settings.amplify
            );
            caption(ui, inside.left_top(), Align2::LEFT_TOP, &text);
            let edition = state.shown.as_ref().map(|shown| shown.edition);
            let of_this = |frame: &&Frame| {
                matches!(frame.show, Show::Difference { .. }) && Some(frame.edition) == edition
            };
            if let Some(relative) = frame.filter(of_this).and_then(|frame| frame.relative_rms) {
                let text = format!("RMS {}", numbers::error(relative));
                caption(ui, inside.left_bottom(), Align2::LEFT_BOTTOM, &text);
            }
        }
    }
    if let Some(reason) = frame.and_then(|frame| frame.instead.as_ref()) {
        let text = format!("drawn by the CPU: {reason}");
        caption(ui, inside.center_top(), Align2::CENTER_TOP, &text);
    }
}

fn divider(ui: &Ui, rect: Rect, at: f32, actions: &mut Vec<Action>) {
    let x = rect.left() + rect.width() * at;
    let grip = Rect::from_x_y_ranges(x - GRIP..=x + GRIP, rect.y_range()).intersect(rect);
    let response = ui.interact(grip, Id::unique("divider"), Sense::drag());
    let held = response.hovered() || response.dragged();
    if held {
        ui.set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    if response.dragged()
        && let Some(pointer) = response.interact_pointer_pos()
    {
        actions.push(Action::Divider((pointer.x - rect.left()) / rect.width().max(1.0)));
    }
    let colour = if held { theme::STRONG } else { theme::LIGHTING };
    ui.painter_at(rect).vline(x, rect.y_range(), Stroke::new(1.0, colour));
}
