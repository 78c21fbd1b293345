//! The picture and its captions.

use std::sync::Arc;

use eframe::egui::{
    Align2, Color32, CursorIcon, FontId, Galley, Id, Painter, Pos2, Rect, Sense, Stroke, TextureId, Ui, Vec2,
    pos2, vec2,
};

use crate::error_meter::{ErrorMeter, ModeError};
use crate::numbers;
use crate::pointer::{DragTarget, PictureArea, Pointer};
use crate::render_thread::RenderedFrame;
use crate::state::{Action, State};
use crate::theme;
use preview::{Arrangement, Scene, Shot, Show};
use sphere::Direction;

/// The distance between a caption and the edges of its picture.
const MARGIN: f32 = 10.0;

/// The height of a row of captions.
const ROW: f32 = 26.0;

/// The distance between a caption's text and its edge.
const PAD: Vec2 = vec2(6.0, 3.0);

/// What the captions say about a picture.
#[derive(Clone, Copy)]
pub(crate) struct CaptionSource<'a> {
    /// How far modes are from brute force.
    pub(crate) error_meter: &'a ErrorMeter,
    /// Whether the requested picture cannot be drawn.
    pub(crate) failed: bool,
}

/// Draws the picture into `rect`, and collects the actions of the pointer there.
pub(crate) fn view(
    ui: &mut Ui,
    rect: Rect,
    state: &State,
    frame: Option<(TextureId, &RenderedFrame)>,
    CaptionSource { error_meter, failed }: CaptionSource<'_>,
    pointer: &mut Pointer,
    actions: &mut Vec<Action>,
) {
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 0.0, theme::CANVAS);
    if let Some((texture, _)) = frame {
        let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        painter.image(texture, rect, whole, Color32::WHITE);
    }
    let frame = frame.map(|(_, frame)| frame);
    let split = divider(state, frame, pointer);
    captions(&painter, rect, state, frame, error_meter, split.unwrap_or_default());
    if let Some(text) = pending(state, frame, failed) {
        line(&painter, rect.shrink(MARGIN), rect.center(), Align2::CENTER_CENTER, &text);
    }
    let (context, layer) = (ui.ctx().clone(), ui.layer_id());
    let is_uncovered = |at| context.layer_id_at(at).is_none_or(|over| over == layer);
    // The pointer resizes panels at their edges.
    let picture = rect.shrink2(vec2(4.0, 0.0));
    let is_set = state.settings.arrangement == Arrangement::Split;
    let (camera, light) = (state.settings.camera, state.settings.light);
    let side = (camera.yaw - light.yaw).cos().signum();
    let background = Background::new(state, rect);
    let direction = |at| background.as_ref()?.direction(at);
    let disk = |at| background.as_ref()?.disk(at);
    let area = PictureArea {
        picture,
        divider: split.filter(|_| is_set),
        side,
        direction: &direction,
        disk: &disk,
        is_uncovered: &is_uncovered,
    };
    let response = ui.interact(rect, Id::unique("picture"), Sense::click_and_drag());
    if response.is_pointer_button_down_on()
        && let Some(widget) = ui.memory(|memory| memory.focused())
    {
        // The widget that was used last gives the keyboard back to the picture.
        ui.memory_mut(|memory| memory.surrender_focus(widget));
    }
    // `is_uncovered` reads the same context, which is locked inside `input`.
    let (events, down) = ui.input(|input| (input.events.clone(), input.pointer.any_down()));
    let over = ui.input(|input| input.pointer.latest_pos()).is_some_and(|at| area.is_divider(at));
    if response.double_clicked() && !over {
        actions.push(Action::ResetCamera);
    }
    pointer.follow(&events, down, &area, actions);
    if let Some(at) = split {
        let is_active = over || pointer.dragged() == Some(DragTarget::Divider);
        if is_active {
            ui.set_cursor_icon(CursorIcon::ResizeHorizontal);
        }
        let x = rect.left() + rect.width() * at;
        let colour = if is_active { theme::STRONG } else { theme::LIGHTING };
        painter.vline(x, rect.y_range(), Stroke::new(1.0, colour));
    }
}

/// The background of a picture, behind the surfaces.
struct Background<'a> {
    scene: &'a Scene,
    shot: Shot,
    rect: Rect,
}

impl<'a> Background<'a> {
    fn new(state: &'a State, rect: Rect) -> Option<Self> {
        let shown = state.shown.as_ref()?;
        let size = [rect.width(), rect.height()].map(|side| side.max(1.0) as u32);
        let shot = state.settings.shot(&shown.scene, shown.framing, size);
        Some(Self { scene: &shown.scene, shot, rect })
    }

    /// The direction of a point of the window in the light's frame.
    fn direction(&self, at: Pos2) -> Option<Direction> {
        Some(self.shot.turn.inverse().apply(Direction::new(self.ray(at))?))
    }

    fn ray(&self, at: Pos2) -> sphere::DVec3 {
        let share = (at - self.rect.min) / self.rect.size();
        let size = self.shot.size.map(f64::from);
        self.shot.camera.ray(self.shot.size, [f64::from(share.x) * size[0], f64::from(share.y) * size[1]])
    }

    /// The disk of the light at a point, unless a mesh is in front of it. A small disk can be picked next to
    /// it.
    fn disk(&self, at: Pos2) -> Option<usize> {
        let direction = self.direction(at)?;
        let disks = self.scene.light.disks().iter().enumerate();
        let far = |disk: &sh::Light| disk.direction.dot(direction).clamp(-1.0, 1.0).acos() - disk.radius;
        let (nearest, disk) = disks.min_by(|(_, one), (_, other)| far(one).total_cmp(&far(other)))?;
        let is_hit = far(disk) <= PICK && !self.scene.is_hit(self.shot.camera.eye(), self.ray(at));
        is_hit.then_some(nearest)
    }
}

/// How far from the edge of a disk it can be picked, in radians.
const PICK: f64 = 0.02;

/// The place of the divider as a share of the width: that of the picture on the screen, which may be older
/// than the settings, but while it is dragged that of the pointer.
fn divider(state: &State, frame: Option<&RenderedFrame>, pointer: &Pointer) -> Option<f32> {
    match frame?.of.show {
        Show::Split { .. } if pointer.dragged() == Some(DragTarget::Divider) => Some(state.settings.divider),
        Show::Split { at, .. } => Some(at),
        _ => None,
    }
}

/// The text of what the window waits for, if the picture does not show the selected subject.
fn pending(state: &State, frame: Option<&RenderedFrame>, failed: bool) -> Option<String> {
    let missing = state.missing();
    if !missing.is_empty() {
        let verb = if state.failure.is_some() { "waiting for" } else { "loading" };
        return Some(format!("{verb} {}", missing.join(", ")));
    }
    let Some(shown) = &state.shown else {
        return Some(state.status.clone()).filter(|status| !status.is_empty() && state.failure.is_none());
    };
    let is_other = frame.is_none_or(|frame| frame.scene_id < shown.first_scene_id);
    (is_other && !failed).then(|| format!("drawing {}", shown.subject.material))
}

/// Captions of the picture on the screen, which may be older than the settings, divided at `split`.
fn captions(
    painter: &Painter,
    rect: Rect,
    state: &State,
    frame: Option<&RenderedFrame>,
    error_meter: &ErrorMeter,
    split: f32,
) {
    let Some(frame) = frame else { return };
    let inside = rect.shrink(MARGIN);
    let is_shown = state.shown.as_ref().is_some_and(|shown| shown.scene_id == frame.scene_id);
    let mut note = state.why_brute_force().filter(|_| is_shown).map(str::to_owned);
    match frame.of.show {
        Show::One(mode) if mode.is_brute_force() && note.is_some() => {
            let text = note.take().unwrap_or_default();
            line(painter, inside, inside.left_top(), Align2::LEFT_TOP, &text);
        }
        Show::One(mode) => caption(painter, inside, inside.left_top(), Align2::LEFT_TOP, mode.label()),
        Show::Split { left, right, .. } => {
            let (mut one, mut other) = (inside, inside);
            let at = rect.left() + rect.width() * split;
            (one.max.x, other.min.x) = (at - MARGIN, at + MARGIN);
            caption(painter, one, one.right_top(), Align2::RIGHT_TOP, left.label());
            caption(painter, other, other.left_top(), Align2::LEFT_TOP, right.label());
        }
        Show::Difference { of, from, amplify } => {
            let text = format!("{} minus {}, x {amplify:.0}", of.label(), from.label());
            caption(painter, inside, inside.left_top(), Align2::LEFT_TOP, &text);
            // Stops say what an eye sees; of a picture in the making there is only the RMS.
            let measured = error_meter.mode_error(of).filter(|_| from == of.reference());
            let text = match (measured, frame.relative_rms, frame.light_samples) {
                (Some(ModeError::Measured { stops, rms, .. }), ..) => Some(numbers::apart(stops, rms)),
                (_, Some(relative), 0) => Some(format!("RMS {}", numbers::error(relative))),
                (_, Some(relative), count) => {
                    Some(format!("RMS {} with {count} light samples", numbers::error(relative)))
                }
                (_, None, _) => None,
            };
            if let Some(text) = text {
                caption(painter, inside, inside.left_bottom(), Align2::LEFT_BOTTOM, &text);
            }
        }
    }
    let fallback = frame.fallback_reason.as_ref().map(|reason| format!("drawn on the CPU: {reason}"));
    let notes = note.into_iter().chain(fallback).collect::<Vec<_>>();
    if !notes.is_empty() {
        let below = inside.left_top() + vec2(0.0, ROW);
        line(painter, inside, below, Align2::LEFT_TOP, &notes.join("\n"));
    }
}

/// A short text over the picture; it is omitted if `bounds` is too narrow.
fn caption(painter: &Painter, bounds: Rect, at: Pos2, anchor: Align2, text: &str) {
    let text = painter.layout_no_wrap(text.to_owned(), FontId::proportional(12.0), theme::STRONG);
    if text.size().x + 2.0 * PAD.x <= bounds.width() {
        paint(painter, at, anchor, text);
    }
}

/// A text over the picture, wrapped to the width of `bounds`.
fn line(painter: &Painter, bounds: Rect, at: Pos2, anchor: Align2, text: &str) {
    let width = bounds.width() - 2.0 * PAD.x;
    let text = painter.layout(text.to_owned(), FontId::proportional(12.0), theme::STRONG, width);
    paint(painter, at, anchor, text);
}

fn paint(painter: &Painter, at: Pos2, anchor: Align2, text: Arc<Galley>) {
    let rect = anchor.anchor_size(at, text.size() + 2.0 * PAD);
    painter.rect_filled(rect, 3.0, theme::VEIL);
    painter.galley(rect.min + PAD, text, Color32::PLACEHOLDER);
}
