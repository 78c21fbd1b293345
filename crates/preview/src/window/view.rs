//! The picture, with what it shows written over it.

use eframe::egui::{Align2, CursorIcon, Id, Pos2, Rect, Sense, Stroke, TextureId, Ui, pos2, vec2};

use super::keys::label;
use super::notices::caption;
use super::numbers;
use super::pointer::{Field, Grip, Pointer};
use super::settings::Arrangement;
use super::state::{Action, State};
use super::studio::Frame;
use super::theme;
use crate::Show;

/// Draws the picture into `rect`, and gathers what the pointer does there.
pub(super) fn view(
    ui: &mut Ui,
    rect: Rect,
    state: &State,
    seen: Option<(TextureId, &Frame)>,
    pointer: &mut Pointer,
    actions: &mut Vec<Action>,
) {
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 0.0, theme::BEHIND);
    if let Some((texture, _)) = seen {
        let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        painter.image(texture, rect, whole, eframe::egui::Color32::WHITE);
    }
    captions(ui, rect, state, seen.map(|(_, frame)| frame));
    let split = state.settings.arrangement == Arrangement::Split;
    let (context, layer) = (ui.ctx().clone(), ui.layer_id());
    let free = |at| context.layer_id_at(at).is_none_or(|over| over == layer);
    // The edges of the panels are to be taken hold of too.
    let picture = rect.shrink2(vec2(4.0, 0.0));
    let field = Field { picture, divider: split.then_some(state.settings.divider), free: &free };
    let response = ui.interact(rect, Id::unique("picture"), Sense::click_and_drag());
    if response.is_pointer_button_down_on()
        && let Some(widget) = ui.memory(|memory| memory.focused())
    {
        // Keys go to the picture again, not to the widget that was used last.
        ui.memory_mut(|memory| memory.surrender_focus(widget));
    }
    if response.double_clicked() {
        actions.push(Action::ResetCamera);
    }
    // `free` asks the same context, which is locked within `input`.
    let events = ui.input(|input| input.events.clone());
    pointer.follow(&events, &field, actions);
    if let Some(at) = field.divider {
        let over = ui.input(|input| input.pointer.hover_pos()).is_some_and(|at| field.is_divider(at));
        divider(ui, rect, at, over || pointer.held() == Some(Grip::Divider));
    }
}

/// What the picture shows, which is a moment behind what is wanted.
fn captions(ui: &Ui, rect: Rect, state: &State, frame: Option<&Frame>) {
    let Some(frame) = frame else { return };
    let inside = rect.shrink(10.0);
    match frame.show {
        Show::One(mode) => caption(ui, inside.left_top(), Align2::LEFT_TOP, label(mode)),
        Show::Split { left, right, .. } => {
            let at = rect.left() + rect.width() * state.settings.divider;
            caption(ui, pos2(at - 10.0, inside.top()), Align2::RIGHT_TOP, label(left));
            caption(ui, pos2(at + 10.0, inside.top()), Align2::LEFT_TOP, label(right));
        }
        Show::Difference { of, from, amplify } => {
            let text = format!("{} less {}, x {amplify:.0}", label(of), label(from));
            caption(ui, inside.left_top(), Align2::LEFT_TOP, &text);
            if let Some(relative) = frame.relative_rms {
                let by = match frame.light_samples {
                    0 => String::new(),
                    count => format!(" by {count} samples of light"),
                };
                let text = format!("RMS {}{by}", numbers::error(relative));
                caption(ui, inside.left_bottom(), Align2::LEFT_BOTTOM, &text);
            }
        }
    }
    if let Some(reason) = &frame.instead {
        let text = format!("drawn by the CPU: {reason}");
        caption(ui, inside.center_top(), Align2::CENTER_TOP, &text);
    }
}

fn divider(ui: &Ui, rect: Rect, at: f32, taken: bool) {
    if taken {
        ui.set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    let x = rect.left() + rect.width() * at;
    let colour = if taken { theme::STRONG } else { theme::LIGHTING };
    ui.painter_at(rect).vline(x, rect.y_range(), Stroke::new(1.0, colour));
}
