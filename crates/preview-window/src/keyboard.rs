//! The state of the keyboard, which turns key presses into actions.

use std::collections::BTreeSet;

use eframe::egui::{Context, Event, Key, Popup};

use crate::keys;
use crate::state::Action;

/// The state of the keyboard between frames.
#[derive(Debug, Default)]
pub(crate) struct Keyboard {
    /// The keys that are down, by their places: if Shift is released first, `?` is released as `/`.
    down: BTreeSet<Key>,
    /// Whether a text field had the keyboard in the last frame.
    typing: bool,
}

impl Keyboard {
    /// The actions of the keys that were pressed, before a frame is drawn.
    ///
    /// If egui uses Escape to leave a text field or close a drop-down list, it has no other action.
    pub(crate) fn pressed(&mut self, context: &Context) -> Vec<Action> {
        let elsewhere = self.typing || context.text_edit_focused() || Popup::is_any_open(context);
        let widget = context.egui_wants_keyboard_input();
        let events = context.input(|input| input.events.clone());
        let pressed = events.into_iter().filter_map(|event| match event {
            Event::Key { key, physical_key, pressed, modifiers, .. } => {
                let place = physical_key.unwrap_or(key);
                if !pressed {
                    self.down.remove(&place);
                    return None;
                }
                let repeat = !self.down.insert(place);
                let action = keys::action(key, physical_key, modifiers)?;
                let taken = widget && keys::is_of_widgets(key) || repeat && !keys::repeats(action);
                (!elsewhere && !taken).then(|| action.clone())
            }
            Event::WindowFocused(false) => {
                self.down.clear();
                None
            }
            _ => None,
        });
        pressed.collect()
    }

    /// Must be called after a frame was drawn.
    pub(crate) fn end_frame(&mut self, context: &Context) {
        self.typing = context.text_edit_focused();
    }
}
