//! What the window asks before something is written or lost, and what follows the answer.

use preview::{Aim, List};
use sphere::Rotation;

use super::{Answer, Dialog, Effect, State, turned};

impl State {
    /// Closes the window, unless there are values that are not saved: then it asks.
    pub(super) fn close(&mut self) -> Option<Effect> {
        let unsaved = self.unsaved();
        if unsaved.is_empty() {
            return Some(Effect::Close);
        }
        self.dialog = Some(Dialog::Unsaved(unsaved));
        None
    }

    pub(super) fn answer(&mut self, answer: Answer) -> Option<Effect> {
        match (self.dialog.take()?, answer) {
            (Dialog::SaveLight { turn, lines }, Answer::Save) => Some(Effect::SaveLight(turn, lines)),
            (Dialog::Unsaved(materials), Answer::Save) => self.save_and_close(materials),
            (Dialog::Unsaved(materials), Answer::Discard) => Some(Effect::DiscardAndClose(materials)),
            _ => None,
        }
    }

    fn save_and_close(&mut self, materials: Vec<String>) -> Option<Effect> {
        let editor = |state: &Self, material: &String| state.editors.get(material)?.as_ref().ok().cloned();
        let has_conflict =
            |material: &&String| editor(self, material).is_some_and(|editor| editor.conflict().is_some());
        if let Some(material) = materials.iter().find(has_conflict).cloned() {
            let reason =
                "its file has changed on the disk: load the file or keep these values, then close again";
            self.toast(format!("{material} was not saved"), vec![reason.into()]);
            return self.choose(List::Materials, material);
        }
        self.closing = materials.iter().cloned().collect();
        let forms = materials.into_iter().filter_map(|material| match self.editors.get_mut(&material) {
            Some(Ok(editor)) => editor.save().map(|form| (material, form)),
            _ => None,
        });
        Some(Effect::SaveAndClose(forms.collect()))
    }

    /// A material was saved or not. If the window waits for that to close, it closes after the last one; a
    /// material that cannot be saved is shown instead.
    pub(super) fn saved(&mut self, material: &str, saved: bool) -> Option<Effect> {
        if let Some(Ok(editor)) = self.editors.get_mut(material) {
            editor.saved(saved);
        }
        if !self.closing.remove(material) {
            return None;
        }
        if !saved {
            self.closing.clear();
            return self.choose(List::Materials, material.to_owned());
        }
        if self.closing.is_empty() { self.close() } else { None }
    }

    /// Turns the light back by what was written to the manifest: the scene's own light is turned by it.
    pub(super) fn turn_back(&mut self) {
        let Some(Aim { yaw, pitch }) = self.saved_turn.take() else { return };
        if let Some((_, directions)) = &mut self.moved_disks {
            let turn = Rotation::from_yaw_pitch_roll(yaw, pitch, 0.0);
            directions.iter_mut().for_each(|direction| *direction = turn.apply(*direction));
        }
        self.settings.light = turned(self.settings.light, Aim { yaw: -yaw, pitch: -pitch });
        self.settings = std::mem::take(&mut self.settings).within_bounds();
    }

    /// The materials with values that are not saved.
    pub(crate) fn unsaved(&self) -> Vec<String> {
        self.editors.keys().filter(|material| self.is_edited(material)).cloned().collect()
    }

    /// Whether the light is turned, and whether it is that or some of its disks are moved.
    pub(crate) fn is_light_changed(&self) -> [bool; 2] {
        let is_turned = self.settings.light != Aim::default();
        [is_turned, is_turned || self.moved_disks.is_some()]
    }
}
