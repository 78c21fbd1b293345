//! What lies over the picture: the failure, toasts, the help; and the line below it.

use eframe::egui::{
    Align, Align2, Area, Button, Color32, Frame, Grid, Id, Label, Layout, Margin, Order, Rect, RichText,
    ScrollArea, Sense, Stroke, Ui, vec2,
};

use super::keys::{POINTER, bindings, label};
use super::state::{Action, State};
use super::studio::Frame as Seen;
use super::{Subject, numbers, theme};

/// The line below the picture: what goes on, and how the picture was made.
pub(super) fn status(
    ui: &mut Ui,
    state: &State,
    seen: Option<&Seen>,
    adapter: &str,
    actions: &mut Vec<Action>,
) {
    ui.horizontal(|ui| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.label(RichText::new(made(seen, adapter)).color(theme::WEAK));
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| match &state.failure {
                Some(lines) if state.failure_aside => {
                    let first = lines.first().map_or("failed", String::as_str);
                    let line = RichText::new(format!("failed: {first} (W)")).color(theme::FAILED);
                    if ui.add(Label::new(line).truncate().sense(Sense::click())).clicked() {
                        actions.push(Action::ShowFailure);
                    }
                }
                _ => {
                    ui.add(Label::new(said(state, seen)).truncate());
                }
            });
        });
    });
}

fn said(state: &State, seen: Option<&Seen>) -> String {
    let Subject { environment, material, mesh } = &state.settings.subject;
    if state.waits() {
        return format!("loading {environment}, {material}, {mesh}");
    }
    let Some(shown) = &state.shown else { return state.status.clone() };
    let show = state.settings.show();
    let is_wanted = |seen: &&Seen| seen.edition == shown.edition && seen.show.modes().eq(show.modes());
    if seen.filter(is_wanted).is_none() {
        let modes: Vec<&str> = show.modes().map(label).collect();
        return format!("drawing {environment}, {material}, {mesh}: {}", modes.join(", "));
    }
    state.status.clone()
}

/// By what the picture was made, how large it is and how long it took.
fn made(seen: Option<&Seen>, adapter: &str) -> String {
    let Some(seen) = seen else { return adapter.to_owned() };
    let [width, height] = seen.size;
    let samples = match seen.light_samples {
        0 => String::new(),
        1 => "1 sample of light so far  ·  ".to_owned(),
        count if seen.unfinished => format!("{count} samples of light so far  ·  "),
        count => format!("{count} samples of light  ·  "),
    };
    format!("{samples}{}  ·  {width} x {height}  ·  {}", numbers::seconds(seen.seconds), seen.by)
}

/// The failure, at the lower edge of the picture, which stays in sight.
pub(super) fn failure(ui: &Ui, picture: Rect, lines: &[String], actions: &mut Vec<Action>) {
    let width = (picture.width() - 32.0).clamp(120.0, 860.0);
    over(ui, "failure", picture, Align2::CENTER_BOTTOM, Stroke::new(1.0, theme::FAILED), |ui| {
        ui.set_width(width);
        ui.horizontal(|ui| {
            ui.label(
                RichText::new("This did not work; the picture is the last good one").color(theme::FAILED),
            );
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if ui.add(Button::new("aside").small()).on_hover_text("Escape; W brings it back").clicked() {
                    actions.push(Action::Dismiss);
                }
            });
        });
        let most = (picture.height() * 0.4).max(48.0);
        ScrollArea::vertical().max_height(most).show(ui, |ui| {
            for line in lines {
                ui.add(Label::new(RichText::new(line).monospace().color(theme::STRONG)).selectable(true));
            }
        });
    });
}

/// What cannot be drawn, and why.
pub(super) fn refusal(ui: &Ui, picture: Rect, reason: &str) {
    over(ui, "refusal", picture, Align2::CENTER_CENTER, Stroke::NONE, |ui| {
        ui.set_max_width((picture.width() - 48.0).clamp(120.0, 560.0));
        ui.label(RichText::new(reason).color(theme::STRONG));
    });
}

/// What happened lately, in the upper right corner.
pub(super) fn toasts(ui: &Ui, state: &State, picture: Rect) {
    if state.toasts.is_empty() {
        return;
    }
    over(ui, "toasts", picture, Align2::RIGHT_TOP, Stroke::NONE, |ui| {
        ui.set_max_width((picture.width() - 32.0).clamp(120.0, 360.0));
        for (at, toast) in state.toasts.iter().enumerate() {
            if at > 0 {
                ui.add_space(6.0);
            }
            ui.label(RichText::new(&toast.title).color(theme::STRONG));
            for line in &toast.lines {
                ui.label(RichText::new(line).small());
            }
        }
    });
}

/// All keys.
pub(super) fn help(ui: &Ui, picture: Rect) {
    over(ui, "help", picture, Align2::CENTER_CENTER, Stroke::NONE, |ui| {
        ScrollArea::vertical().max_height(picture.height() - 48.0).show(ui, |ui| {
            ui.horizontal_top(|ui| {
                for column in columns() {
                    ui.vertical(|ui| {
                        for (group, rows) in column {
                            keys(ui, group, &rows);
                        }
                    });
                    ui.add_space(16.0);
                }
            });
        });
    });
}

type Group = (&'static str, Vec<(String, String)>);

/// The groups of the table of keys and what the pointer does, in three columns.
fn columns() -> [Vec<Group>; 3] {
    let mut groups: Vec<Group> = Vec::new();
    for binding in bindings() {
        let row = (binding.chord.name(), binding.name.clone());
        match groups.last_mut() {
            Some((group, rows)) if *group == binding.group => rows.push(row),
            _ => groups.push((binding.group, vec![row])),
        }
    }
    groups.push(("Pointer", POINTER.map(|(what, does)| (what.to_owned(), does.to_owned())).to_vec()));
    let third = groups.iter().map(|(_, rows)| rows.len() + 2).sum::<usize>().div_ceil(3);
    let (mut columns, mut filled) = ([const { Vec::new() }; 3], 0);
    for group in groups {
        let height = group.1.len() + 2;
        let column: &mut Vec<Group> = &mut columns[(filled + height / 2).div_euclid(third.max(1)).min(2)];
        column.push(group);
        filled += height;
    }
    columns
}

fn keys(ui: &mut Ui, group: &str, rows: &[(String, String)]) {
    ui.label(RichText::new(group).small().color(theme::WEAK));
    Grid::new(group).num_columns(2).spacing([10.0, 2.0]).min_col_width(64.0).show(ui, |ui| {
        for (key, name) in rows {
            ui.label(RichText::new(key).color(theme::STRONG));
            ui.label(name);
            ui.end_row();
        }
    });
    ui.add_space(8.0);
}

/// A panel over the picture.
fn over(ui: &Ui, name: &str, picture: Rect, at: Align2, stroke: Stroke, show: impl FnOnce(&mut Ui)) {
    let inside = picture.shrink(12.0);
    let frame =
        Frame::new().fill(theme::VEIL).stroke(stroke).corner_radius(4.0).inner_margin(Margin::same(12));
    Area::new(Id::unique(name))
        .order(Order::Foreground)
        .default_size(inside.size())
        .pivot(at)
        .fixed_pos(at.pos_in_rect(&inside))
        .constrain_to(inside)
        .show(ui, |ui| frame.show(ui, show));
}

/// A word over the picture, in one of its corners.
pub(super) fn caption(ui: &Ui, at: eframe::egui::Pos2, anchor: Align2, text: &str) {
    let font = eframe::egui::FontId::proportional(12.0);
    let text = ui.painter().layout_no_wrap(text.to_owned(), font, theme::STRONG);
    let rect = anchor.anchor_size(at, text.size() + vec2(12.0, 6.0));
    ui.painter().rect_filled(rect, 3.0, theme::VEIL);
    ui.painter().galley(rect.min + vec2(6.0, 3.0), text, Color32::PLACEHOLDER);
}
