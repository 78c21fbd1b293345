//! The panel on the left: lists of environments, materials and meshes.

use eframe::egui::{Atom, Button, Id, RichText, ScrollArea, Ui, vec2};

use crate::state::{Action, State};
use crate::theme;
use preview::List;

pub(crate) fn lists(ui: &mut Ui, state: &State, actions: &mut Vec<Action>) {
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        for (list, heading) in
            [(List::Environments, "Environment"), (List::Materials, "Material"), (List::Meshes, "Mesh")]
        {
            ui.add_space(6.0);
            ui.label(RichText::new(heading).small().color(theme::WEAK));
            let (names, chosen) = list.of(&state.catalog, &state.settings.subject);
            if names.is_empty() {
                ui.label(RichText::new("none yet").color(theme::WEAK));
            }
            ui.spacing_mut().item_spacing.y = 1.0;
            for name in names {
                let width = ui.available_width();
                let is_edited = list == List::Materials && state.is_edited(name);
                let text = if is_edited { format!("{name} *") } else { name.clone() };
                let row = Button::selectable(name == chosen, (text, Atom::grow()));
                let row = ui.add(row.truncate().min_size(vec2(width, 20.0)));
                let last = Id::unique(("last choice", heading));
                if name == chosen && ui.data_mut(|data| has_changed(data.get_temp_mut_or_default(last), name))
                {
                    row.scroll_to_me(None);
                }
                if row.clicked() {
                    actions.push(Action::Choose(list, name.clone()));
                }
            }
        }
    });
}

/// Stores a name and says whether it differs from the one before. The first name is not a change.
fn has_changed(before: &mut String, name: &str) -> bool {
    let changed = !before.is_empty() && before != name;
    name.clone_into(before);
    changed
}
