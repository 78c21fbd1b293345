//! What the keyboard does.

use std::collections::BTreeSet;

use eframe::egui::{Context, Event, Key, Popup};

use crate::keys;
use crate::state::Action;

/// What is known of the keyboard from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct Keyboard {
    /// The keys that are held down, by their places: `?` goes up as `/` where Shift was let go before it.
    down: BTreeSet<Key>,
    /// Whether the last frame left it to a text field.
    typing: bool,
}

impl Keyboard {
    /// What the keys ask for that were pressed, before a frame is drawn.
    ///
    /// Escape has taken the keyboard away from a text field before anyone is asked, as it closes a list that has dropped down,
    /// and does no more.
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

    /// To be told after a frame was drawn.
    pub(crate) fn drawn(&mut self, context: &Context) {
        self.typing = context.text_edit_focused();
    }
}
