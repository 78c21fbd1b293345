//! The pointer's actions on the picture.
//!
//! Events are handled one by one, so that a drag that starts and ends within one slow frame still counts.

use eframe::egui::{Event, MouseWheelUnit, PointerButton, Pos2, Rect};

use crate::state::Action;
use preview::Aim;
use sphere::Direction;

/// Radians for every point of a drag: the width of a window is about two turns.
const TURN: f64 = 0.01;

/// The magnification for every line of the wheel.
const ZOOM: f64 = 1.1;

/// The points of a line, for touch pads that report points.
const LINE: f32 = 40.0;

/// The distance from which the divider can be dragged, in points.
const DIVIDER_REACH: f32 = 6.0;

/// The target of a drag of the pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DragTarget {
    Camera,
    Light,
    /// One of the disks of the light.
    Disk(usize),
    Divider,
}

/// The pointer, from one frame of the window to the next.
#[derive(Debug, Default)]
pub(crate) struct Pointer {
    drag: Option<(PointerButton, DragTarget)>,
    /// [`PictureArea::side`] when the drag started, so that its direction never flips.
    side: f64,
    at: Option<Pos2>,
}

/// The area of the window where a drag may start.
pub(crate) struct PictureArea<'a> {
    pub(crate) picture: Rect,
    /// The place of the divider as a share of the width, if there is one.
    pub(crate) divider: Option<f32>,
    /// 1 if the viewer is in front of the axis that the light's pitch turns about, -1 if behind it.
    pub(crate) side: f64,
    /// The direction in the light's frame that the background shows at a point.
    pub(crate) direction: &'a dyn Fn(Pos2) -> Option<Direction>,
    /// The disk of the light that is visible at a point.
    pub(crate) disk: &'a dyn Fn(Pos2) -> Option<usize>,
    /// Whether no panel covers the picture at a point.
    pub(crate) is_uncovered: &'a dyn Fn(Pos2) -> bool,
}

impl PictureArea<'_> {
    fn contains(&self, at: Pos2) -> bool {
        self.picture.contains(at) && (self.is_uncovered)(at)
    }

    /// Whether the divider can be dragged at a point.
    pub(crate) fn is_divider(&self, at: Pos2) -> bool {
        let distance = |share: f32| (self.picture.left() + share * self.picture.width() - at.x).abs();
        self.divider.is_some_and(|share| distance(share) <= DIVIDER_REACH) && self.contains(at)
    }
}

impl Pointer {
    pub(crate) fn dragged(&self) -> Option<DragTarget> {
        self.drag.map(|(_, target)| target)
    }

    /// Handles the events of a frame. `down` says whether any button is down at its end, because a release
    /// outside the window may cause no event.
    pub(crate) fn follow(
        &mut self,
        events: &[Event],
        down: bool,
        area: &PictureArea<'_>,
        actions: &mut Vec<Action>,
    ) {
        for event in events {
            match event {
                Event::PointerButton { pos, button, pressed: true, modifiers } if self.drag.is_none() => {
                    self.at = Some(*pos);
                    let target = match button {
                        PointerButton::Primary if area.is_divider(*pos) => DragTarget::Divider,
                        PointerButton::Primary if !modifiers.shift => DragTarget::Camera,
                        PointerButton::Primary | PointerButton::Secondary => {
                            (area.disk)(*pos).map_or(DragTarget::Light, DragTarget::Disk)
                        }
                        _ => continue,
                    };
                    (self.drag, self.side) = (area.contains(*pos).then_some((*button, target)), area.side);
                }
                Event::PointerButton { pos, button, pressed: false, .. } => {
                    self.moved(*pos, area, actions);
                    self.drag = self.drag.filter(|(with, _)| with != button);
                }
                Event::PointerMoved(pos) => self.moved(*pos, area, actions),
                // A drag goes on beyond the edge of the window.
                Event::PointerGone if self.drag.is_none() => self.at = None,
                Event::WindowFocused(false) => self.drag = None,
                Event::MouseWheel { unit, delta, modifiers, .. } if !modifiers.command => {
                    let lines = match unit {
                        MouseWheelUnit::Line | MouseWheelUnit::Page => delta.y,
                        MouseWheelUnit::Point => delta.y / LINE,
                    };
                    if self.at.is_some_and(|at| area.contains(at)) {
                        actions.push(Action::ZoomBy(ZOOM.powf(lines.into())));
                    }
                }
                _ => {}
            }
        }
        if !down {
            self.drag = None;
        }
    }

    fn moved(&mut self, to: Pos2, area: &PictureArea<'_>, actions: &mut Vec<Action>) {
        let by = to - self.at.replace(to).unwrap_or(to);
        let Some((_, target)) = self.drag.filter(|_| by != Default::default()) else { return };
        let turn = Aim { yaw: TURN * f64::from(by.x), pitch: TURN * f64::from(by.y) };
        let divided = (to.x - area.picture.left()) / area.picture.width().max(1.0);
        actions.extend(match target {
            // The scene follows the pointer, so the camera moves the other way.
            DragTarget::Camera => Some(Action::Orbit(Aim { yaw: -turn.yaw, ..turn })),
            // The near side of the light follows it too. The axis of its pitch may point the other way.
            DragTarget::Light => Some(Action::TurnLight(Aim { pitch: self.side * turn.pitch, ..turn })),
            DragTarget::Disk(disk) => (area.direction)(to).map(|at| Action::MoveDisk(disk, at)),
            DragTarget::Divider => Some(Action::Divider(divided)),
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

    /// The actions of events on a picture of 100 x 100 points with its divider in the middle and a panel over
    /// its last ten rows. They are the same for all events in one frame and for one event in each frame.
    fn follow(events: &[Event]) -> Vec<Action> {
        let (mut pointer, mut together) = (Pointer::default(), Vec::new());
        pointer.follow(events, true, &area(1.0), &mut together);
        let (mut pointer, mut apart) = (Pointer::default(), Vec::new());
        for event in events {
            pointer.follow(std::slice::from_ref(event), true, &area(1.0), &mut apart);
        }
        assert_eq!(together, apart, "frames do not matter");
        together
    }

    fn area(side: f64) -> PictureArea<'static> {
        PictureArea {
            picture: Rect::from_min_size(pos2(100.0, 0.0), vec2(100.0, 100.0)),
            divider: Some(0.5),
            side,
            direction: &|at| Direction::new([1.0, f64::from(at.x), f64::from(at.y)].into()),
            // Lights are seen in a corner.
            disk: &|at| (at.x < 104.0 && at.y < 4.0).then_some(1),
            is_uncovered: &|at| at.y < 90.0,
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
        assert_eq!(follow(&drag(LEFT)), [orbit(5.0, -2.0), orbit(185.0, 0.0)], "outside the picture as well");
        assert_eq!(follow(&drag(RIGHT)), [light(5.0, -2.0), light(185.0, 0.0)]);
        assert_eq!(follow(&drag(PointerButton::Middle)), []);
    }

    #[test]
    fn a_drag_of_the_light_moves_the_disk_on_which_it_starts() {
        let drag = |by| [button(103.0, 3.0, by, true), moved(150.0, 20.0)];
        let direction = Direction::new([1.0, 150.0, 20.0].into()).unwrap();
        assert_eq!(follow(&drag(RIGHT)), [Action::MoveDisk(1, direction)]);
        assert_eq!(follow(&drag(LEFT)), [orbit(47.0, 17.0)], "the camera is under every light");
    }

    #[test]
    fn only_its_own_button_ends_a_drag() {
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
    fn a_drag_goes_on_beyond_the_edge_of_the_window_until_no_button_is_down() {
        let (mut pointer, mut actions) = (Pointer::default(), Vec::new());
        let mut frame = |events: &[Event], down| pointer.follow(events, down, &area(1.0), &mut actions);
        frame(&[button(110.0, 10.0, LEFT, true), moved(111.0, 10.0)], true);
        frame(&[Event::PointerGone], true);
        frame(&[moved(-20.0, 10.0)], true);
        // The button was released without an event.
        frame(&[], false);
        frame(&[moved(150.0, 10.0)], false);
        assert_eq!(actions, [orbit(1.0, 0.0), orbit(-131.0, 0.0)]);
    }

    #[test]
    fn seen_from_behind_the_light_pitches_the_other_way_for_the_whole_drag() {
        let (mut pointer, mut actions) = (Pointer::default(), Vec::new());
        let press = [button(110.0, 10.0, RIGHT, true), moved(112.0, 13.0)];
        pointer.follow(&press, true, &area(-1.0), &mut actions);
        pointer.follow(&[moved(112.0, 14.0)], true, &area(1.0), &mut actions);
        assert_eq!(actions, [light(2.0, -3.0), light(0.0, -1.0)]);
    }

    #[test]
    fn a_drag_that_starts_on_a_panel_does_nothing() {
        for start in [(50.0, 50.0), (110.0, 95.0)] {
            let events = [button(start.0, start.1, LEFT, true), moved(150.0, 50.0), moved(160.0, 50.0)];
            assert_eq!(follow(&events), []);
        }
    }

    #[test]
    fn the_divider_follows_the_pointer() {
        let events = [button(147.0, 50.0, LEFT, true), moved(120.0, 50.0), moved(500.0, 50.0)];
        assert_eq!(follow(&events), [Action::Divider(0.2), Action::Divider(4.0)]);
        let right = [button(147.0, 50.0, RIGHT, true), moved(148.0, 50.0)];
        assert_eq!(follow(&right), [light(1.0, 0.0)], "the light may be dragged anywhere");
    }

    #[test]
    fn shift_turns_the_left_button_into_the_right_one() {
        let modifiers = Modifiers { shift: true, ..Modifiers::NONE };
        let press = Event::PointerButton { pos: pos2(110.0, 10.0), button: LEFT, pressed: true, modifiers };
        assert_eq!(follow(&[press, moved(111.0, 10.0)]), [light(1.0, 0.0)]);
    }

    #[test]
    fn the_wheel_zooms_over_the_picture() {
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
        assert_eq!(follow(&[lines]), [], "the pointer's place is unknown");
    }
}
