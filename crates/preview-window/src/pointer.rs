//! What the pointer does on the picture.
//!
//! Its events are followed one by one: a drag that begins and ends while a slow picture is drawn is a drag.

use eframe::egui::{Event, MouseWheelUnit, PointerButton, Pos2, Rect};

use crate::state::Action;
use preview::Aim;

/// Radians for every point of a drag: the width of a window is about two turns.
const TURN: f64 = 0.01;

/// How many times nearer for every line of the wheel.
const ZOOM: f64 = 1.1;

/// The points of a line, of touch pads that tell points.
const LINE: f32 = 40.0;

/// Half the width in which the divider is taken hold of, in points.
const GRIP: f32 = 6.0;

/// What the pointer has taken hold of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Grip {
    Camera,
    Light,
    Divider,
}

/// The pointer, from one frame of the window to the next.
#[derive(Debug, Default)]
pub(crate) struct Pointer {
    held: Option<(PointerButton, Grip)>,
    /// [`Field::side`] when it took hold, so that a drag never turns over.
    side: f64,
    at: Option<Pos2>,
}

/// Where the pointer may take hold.
pub(crate) struct Field<'a> {
    pub(crate) picture: Rect,
    /// Where the divider is, as a share of the width, where there is one.
    pub(crate) divider: Option<f32>,
    /// On which side of the light the viewer is: 1 in front of the axis that its pitch turns about, -1 behind it.
    pub(crate) side: f64,
    /// Whether nothing lies over the picture there.
    pub(crate) free: &'a dyn Fn(Pos2) -> bool,
}

impl Field<'_> {
    fn is_free(&self, at: Pos2) -> bool {
        self.picture.contains(at) && (self.free)(at)
    }

    /// Whether the divider is there.
    pub(crate) fn is_divider(&self, at: Pos2) -> bool {
        let on = |share: f32| (self.picture.left() + share * self.picture.width() - at.x).abs() <= GRIP;
        self.divider.is_some_and(on) && self.is_free(at)
    }
}

impl Pointer {
    /// What is held now.
    pub(crate) fn held(&self) -> Option<Grip> {
        self.held.map(|(_, grip)| grip)
    }

    /// Follows the events of a frame. `down` says whether any button is held at its end: a release outside the window may
    /// be no event.
    pub(crate) fn follow(
        &mut self,
        events: &[Event],
        down: bool,
        field: &Field<'_>,
        actions: &mut Vec<Action>,
    ) {
        for event in events {
            match event {
                Event::PointerButton { pos, button, pressed: true, modifiers } if self.held.is_none() => {
                    self.at = Some(*pos);
                    let grip = match button {
                        PointerButton::Primary if field.is_divider(*pos) => Grip::Divider,
                        PointerButton::Primary if !modifiers.shift => Grip::Camera,
                        PointerButton::Primary | PointerButton::Secondary => Grip::Light,
                        _ => continue,
                    };
                    (self.held, self.side) = (field.is_free(*pos).then_some((*button, grip)), field.side);
                }
                Event::PointerButton { pos, button, pressed: false, .. } => {
                    self.moved(*pos, field, actions);
                    self.held = self.held.filter(|(held, _)| held != button);
                }
                Event::PointerMoved(pos) => self.moved(*pos, field, actions),
                // What is held goes on beyond the edge of the window.
                Event::PointerGone if self.held.is_none() => self.at = None,
                Event::WindowFocused(false) => self.held = None,
                Event::MouseWheel { unit, delta, modifiers, .. } if !modifiers.command => {
                    let lines = match unit {
                        MouseWheelUnit::Line | MouseWheelUnit::Page => delta.y,
                        MouseWheelUnit::Point => delta.y / LINE,
                    };
                    if self.at.is_some_and(|at| field.is_free(at)) {
                        actions.push(Action::ZoomBy(ZOOM.powf(lines.into())));
                    }
                }
                _ => {}
            }
        }
        if !down {
            self.held = None;
        }
    }

    fn moved(&mut self, to: Pos2, field: &Field<'_>, actions: &mut Vec<Action>) {
        let by = to - self.at.replace(to).unwrap_or(to);
        let Some((_, grip)) = self.held.filter(|_| by != Default::default()) else { return };
        let turn = Aim { yaw: TURN * f64::from(by.x), pitch: TURN * f64::from(by.y) };
        actions.push(match grip {
            // The scene follows the hand, so that the camera goes the other way around it.
            Grip::Camera => Action::Orbit(Aim { yaw: -turn.yaw, ..turn }),
            // So does what is nearest of the light. Its pitch turns about an axis of its own, which may point the other way.
            Grip::Light => Action::TurnLight(Aim { pitch: self.side * turn.pitch, ..turn }),
            Grip::Divider => Action::Divider((to.x - field.picture.left()) / field.picture.width().max(1.0)),
        });
    }
}

#[cfg(test)]
mod tests {
    use eframe::egui::{Modifiers, MouseWheelSource, TouchPhase, pos2, vec2};

    use super::*;

    const LEFT: PointerButton = PointerButton::Primary;
    const RIGHT: PointerButton = PointerButton::Secondary;

    fn button(x: f32, y: f32, button: PointerButton, pressed: bool) -> Event {
        Event::PointerButton { pos: pos2(x, y), button, pressed, modifiers: Modifiers::NONE }
    }

    fn moved(x: f32, y: f32) -> Event {
        Event::PointerMoved(pos2(x, y))
    }

    /// What comes of events on a picture of 100 x 100 points with its divider in the middle and something over its last
    /// ten rows, all in one frame and one in each.
    fn follow(events: &[Event]) -> Vec<Action> {
        let (mut pointer, mut together) = (Pointer::default(), Vec::new());
        pointer.follow(events, true, &field(1.0), &mut together);
        let (mut pointer, mut apart) = (Pointer::default(), Vec::new());
        for event in events {
            pointer.follow(std::slice::from_ref(event), true, &field(1.0), &mut apart);
        }
        assert_eq!(together, apart, "frames do not matter");
        together
    }

    fn field(side: f64) -> Field<'static> {
        Field {
            picture: Rect::from_min_size(pos2(100.0, 0.0), vec2(100.0, 100.0)),
            divider: Some(0.5),
            side,
            free: &|at| at.y < 90.0,
        }
    }

    fn orbit(x: f64, y: f64) -> Action {
        Action::Orbit(Aim { yaw: -TURN * x, pitch: TURN * y })
    }

    fn light(x: f64, y: f64) -> Action {
        Action::TurnLight(Aim { yaw: TURN * x, pitch: TURN * y })
    }

    #[test]
    fn the_left_button_turns_the_camera_and_the_right_one_the_light() {
        let drag =
            |by| [moved(110.0, 10.0), button(110.0, 10.0, by, true), moved(115.0, 8.0), moved(300.0, 8.0)];
        assert_eq!(follow(&drag(LEFT)), [orbit(5.0, -2.0), orbit(185.0, 0.0)], "also outside the picture");
        assert_eq!(follow(&drag(RIGHT)), [light(5.0, -2.0), light(185.0, 0.0)]);
        assert_eq!(follow(&drag(PointerButton::Middle)), []);
    }

    #[test]
    fn what_is_held_is_let_go_by_its_own_button_alone() {
        let events = [
            button(110.0, 10.0, LEFT, true),
            button(110.0, 10.0, RIGHT, true),
            moved(111.0, 10.0),
            button(111.0, 10.0, RIGHT, false),
            moved(112.0, 10.0),
            button(113.0, 10.0, LEFT, false),
            moved(150.0, 10.0),
        ];
        assert_eq!(follow(&events), [orbit(1.0, 0.0), orbit(1.0, 0.0), orbit(1.0, 0.0)]);
    }

    #[test]
    fn a_drag_goes_on_beyond_the_edge_of_the_window_until_nothing_is_held() {
        let (mut pointer, mut actions) = (Pointer::default(), Vec::new());
        let mut frame = |events: &[Event], down| pointer.follow(events, down, &field(1.0), &mut actions);
        frame(&[button(110.0, 10.0, LEFT, true), moved(111.0, 10.0)], true);
        frame(&[Event::PointerGone], true);
        frame(&[moved(-20.0, 10.0)], true);
        // It was let go where nobody saw it.
        frame(&[], false);
        frame(&[moved(150.0, 10.0)], false);
        assert_eq!(actions, [orbit(1.0, 0.0), orbit(-131.0, 0.0)]);
    }

    #[test]
    fn from_behind_the_light_is_pitched_the_other_way_for_the_whole_drag() {
        let (mut pointer, mut actions) = (Pointer::default(), Vec::new());
        let press = [button(110.0, 10.0, RIGHT, true), moved(112.0, 13.0)];
        pointer.follow(&press, true, &field(-1.0), &mut actions);
        pointer.follow(&[moved(112.0, 14.0)], true, &field(1.0), &mut actions);
        assert_eq!(actions, [light(2.0, -3.0), light(0.0, -1.0)]);
    }

    #[test]
    fn a_drag_that_begins_on_a_panel_or_over_the_picture_does_nothing() {
        for start in [(50.0, 50.0), (110.0, 95.0)] {
            let events = [button(start.0, start.1, LEFT, true), moved(150.0, 50.0), moved(160.0, 50.0)];
            assert_eq!(follow(&events), []);
        }
    }

    #[test]
    fn the_divider_goes_where_the_pointer_is() {
        let events = [button(147.0, 50.0, LEFT, true), moved(120.0, 50.0), moved(500.0, 50.0)];
        assert_eq!(follow(&events), [Action::Divider(0.2), Action::Divider(4.0)]);
        let right = [button(147.0, 50.0, RIGHT, true), moved(148.0, 50.0)];
        assert_eq!(follow(&right), [light(1.0, 0.0)], "the light may be dragged anywhere");
    }

    #[test]
    fn shift_makes_the_left_button_the_right_one() {
        let modifiers = Modifiers { shift: true, ..Modifiers::NONE };
        let press = Event::PointerButton { pos: pos2(110.0, 10.0), button: LEFT, pressed: true, modifiers };
        assert_eq!(follow(&[press, moved(111.0, 10.0)]), [light(1.0, 0.0)]);
    }

    #[test]
    fn the_wheel_zooms_where_the_picture_is() {
        let wheel = |unit, y| Event::MouseWheel {
            unit,
            delta: vec2(0.0, y),
            phase: TouchPhase::Move,
            source: MouseWheelSource::Unknown,
            modifiers: Modifiers::NONE,
        };
        let lines = wheel(MouseWheelUnit::Line, 2.0);
        assert_eq!(follow(&[moved(110.0, 10.0), lines.clone()]), [Action::ZoomBy(ZOOM.powi(2))]);
        let points = wheel(MouseWheelUnit::Point, -LINE);
        assert_eq!(follow(&[moved(110.0, 10.0), points]), [Action::ZoomBy(ZOOM.powi(-1))]);
        assert_eq!(follow(&[moved(50.0, 10.0), lines.clone()]), []);
        assert_eq!(follow(&[lines]), [], "nobody knows where the pointer is");
    }
}
