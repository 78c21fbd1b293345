//! The picture, with what it shows written over it.

use std::sync::Arc;

use eframe::egui::{
    Align2, Color32, CursorIcon, FontId, Galley, Id, Painter, Pos2, Rect, Sense, Stroke, Ui, Vec2, pos2, vec2,
};

use crate::keys::label;
use crate::numbers;
use crate::panel_layout::PanelLayout;
use crate::pointer::{Field, Grip, Pointer};
use crate::render_thread::Frame;
use crate::state::{Action, State};
use crate::theme;
use preview::Arrangement;
use preview::Show;

/// Between a caption and the edges of what it is about.
const MARGIN: f32 = 10.0;

/// From a row of captions to the next.
const ROW: f32 = 26.0;

/// Between a caption's text and its edge.
const PAD: Vec2 = vec2(6.0, 3.0);

/// Draws the picture into `rect`, and gathers what the pointer does there.
pub(crate) fn view(
    ui: &mut Ui,
    rect: Rect,
    desk: &PanelLayout<'_>,
    pointer: &mut Pointer,
    actions: &mut Vec<Action>,
) {
    let PanelLayout { state, seen, refused, .. } = *desk;
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 0.0, theme::BEHIND);
    if let Some((texture, _)) = seen {
        let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        painter.image(texture, rect, whole, Color32::WHITE);
    }
    let frame = seen.map(|(_, frame)| frame);
    let split = divider(state, frame, pointer);
    captions(&painter, rect, frame, split.unwrap_or_default());
    if let Some(text) = awaited(state, frame, refused.is_some()) {
        line(&painter, rect.shrink(MARGIN), rect.center(), Align2::CENTER_CENTER, &text);
    }
    let (context, layer) = (ui.ctx().clone(), ui.layer_id());
    let free = |at| context.layer_id_at(at).is_none_or(|over| over == layer);
    // The edges of the panels are to be taken hold of too.
    let picture = rect.shrink2(vec2(4.0, 0.0));
    let is_set = state.settings.arrangement == Arrangement::Split;
    let (camera, light) = (state.settings.camera, state.settings.light);
    let side = (camera.yaw - light.yaw).cos().signum();
    let field = Field { picture, divider: split.filter(|_| is_set), side, free: &free };
    let response = ui.interact(rect, Id::unique("picture"), Sense::click_and_drag());
    if response.is_pointer_button_down_on()
        && let Some(widget) = ui.memory(|memory| memory.focused())
    {
        // Keys go to the picture again, not to the widget that was used last.
        ui.memory_mut(|memory| memory.surrender_focus(widget));
    }
    // `free` asks the same context, which is locked within `input`.
    let (events, down) = ui.input(|input| (input.events.clone(), input.pointer.any_down()));
    let over = ui.input(|input| input.pointer.latest_pos()).is_some_and(|at| field.is_divider(at));
    if response.double_clicked() && !over {
        actions.push(Action::ResetCamera);
    }
    pointer.follow(&events, down, &field, actions);
    if let Some(at) = split {
        let taken = over || pointer.held() == Some(Grip::Divider);
        if taken {
            ui.set_cursor_icon(CursorIcon::ResizeHorizontal);
        }
        let x = rect.left() + rect.width() * at;
        let colour = if taken { theme::STRONG } else { theme::LIGHTING };
        painter.vline(x, rect.y_range(), Stroke::new(1.0, colour));
    }
}

/// Where the divider is seen, as a share of the width: where the pixels have it, which are a moment behind, but under the
/// hand that holds it.
fn divider(state: &State, frame: Option<&Frame>, pointer: &Pointer) -> Option<f32> {
    match frame?.of.show {
        Show::Split { .. } if pointer.held() == Some(Grip::Divider) => Some(state.settings.divider),
        Show::Split { at, .. } => Some(at),
        _ => None,
    }
}

/// What is to come where the picture does not show the wanted subject.
fn awaited(state: &State, frame: Option<&Frame>, refused: bool) -> Option<String> {
    let missing = state.missing();
    if !missing.is_empty() {
        let verb = if state.failure.is_some() { "waiting for" } else { "loading" };
        return Some(format!("{verb} {}", missing.join(", ")));
    }
    let Some(shown) = &state.shown else {
        return Some(state.status.clone()).filter(|status| !status.is_empty() && state.failure.is_none());
    };
    let is_another = frame.is_none_or(|frame| frame.edition < shown.since);
    (is_another && !refused).then(|| format!("drawing {}", shown.subject.material))
}

/// What the picture shows, which is a moment behind what is wanted; `split` is where the divider is seen.
fn captions(painter: &Painter, rect: Rect, frame: Option<&Frame>, split: f32) {
    let Some(frame) = frame else { return };
    let inside = rect.shrink(MARGIN);
    match frame.of.show {
        Show::One(mode) => caption(painter, inside, inside.left_top(), Align2::LEFT_TOP, label(mode)),
        Show::Split { left, right, .. } => {
            let (mut one, mut other) = (inside, inside);
            let at = rect.left() + rect.width() * split;
            (one.max.x, other.min.x) = (at - MARGIN, at + MARGIN);
            caption(painter, one, one.right_top(), Align2::RIGHT_TOP, label(left));
            caption(painter, other, other.left_top(), Align2::LEFT_TOP, label(right));
        }
        Show::Difference { of, from, amplify } => {
            let text = format!("{} less {}, x {amplify:.0}", label(of), label(from));
            caption(painter, inside, inside.left_top(), Align2::LEFT_TOP, &text);
            if let Some(relative) = frame.relative_rms {
                let by = match frame.light_samples {
                    0 => String::new(),
                    count => format!(" by {count} samples of light"),
                };
                let text = format!("RMS {}{by}", numbers::error(relative));
                caption(painter, inside, inside.left_bottom(), Align2::LEFT_BOTTOM, &text);
            }
        }
    }
    if let Some(reason) = &frame.instead {
        let text = format!("drawn by the CPU: {reason}");
        let below = inside.left_top() + vec2(0.0, ROW);
        line(painter, inside, below, Align2::LEFT_TOP, &text);
    }
}

/// A few words over the picture; they are left out where their place is narrower.
fn caption(painter: &Painter, place: Rect, at: Pos2, anchor: Align2, text: &str) {
    let text = painter.layout_no_wrap(text.to_owned(), FontId::proportional(12.0), theme::STRONG);
    if text.size().x + 2.0 * PAD.x <= place.width() {
        written(painter, at, anchor, text);
    }
}

/// A line over the picture, in as many rows as its place asks for.
fn line(painter: &Painter, place: Rect, at: Pos2, anchor: Align2, text: &str) {
    let width = place.width() - 2.0 * PAD.x;
    written(
        painter,
        at,
        anchor,
        painter.layout(text.to_owned(), FontId::proportional(12.0), theme::STRONG, width),
    );
}

fn written(painter: &Painter, at: Pos2, anchor: Align2, text: Arc<Galley>) {
    let rect = anchor.anchor_size(at, text.size() + 2.0 * PAD);
    painter.rect_filled(rect, 3.0, theme::VEIL);
    painter.galley(rect.min + PAD, text, Color32::PLACEHOLDER);
}
