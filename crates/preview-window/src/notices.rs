//! Panels over the picture: the failure, toasts and the help; and the status line below it.

use eframe::egui::{
    Align, Align2, Area, Button, Frame, Grid, Id, Label, Layout, Margin, Order, Rect, RichText, ScrollArea,
    Sense, Stroke, Ui,
};

use crate::keys::{POINTER, bindings};
use crate::render_thread::RenderedFrame;
use crate::state::{Action, State};
use crate::{numbers, theme};
use preview::{Mode, Subject};

/// The line below the picture: the program's status on the left, how the picture was drawn on the right.
///
/// `drawing` says whether the requested picture is still being drawn.
pub(crate) fn status(
    ui: &mut Ui,
    state: &State,
    frame: Option<&RenderedFrame>,
    drawing: bool,
    adapter_name: &str,
    actions: &mut Vec<Action>,
) {
    ui.horizontal(|ui| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let drawn = frame.map_or_else(|| adapter_name.to_owned(), drawn);
            ui.label(RichText::new(drawn).color(theme::WEAK));
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| match &state.failure {
                Some(lines) if state.failure_hidden => {
                    let first = lines.get(1).or(lines.first()).map_or("failed", String::as_str);
                    let line = RichText::new(format!("failed: {first} (W)")).color(theme::FAILED);
                    if ui.add(Label::new(line).truncate().sense(Sense::click())).clicked() {
                        actions.push(Action::ShowFailure);
                    }
                }
                _ => {
                    ui.add(Label::new(progress(state, drawing)).truncate());
                }
            });
        });
    });
}

fn progress(state: &State, drawing: bool) -> String {
    let Subject { environment, material, mesh } = &state.settings.subject;
    if state.waits() {
        return format!("loading {environment}, {material}, {mesh}");
    }
    let note = state.why_brute_force();
    if let Some(shown) = state.shown.as_ref().filter(|_| drawing && note.is_none()) {
        let modes = shown.scene.available(state.settings.show(&shown.scene)).modes();
        let modes: Vec<&str> = modes.map(Mode::label).collect();
        return format!("drawing {environment}, {material}, {mesh}: {}", modes.join(", "));
    }
    match note {
        Some(note) if state.status.is_empty() => note.to_owned(),
        Some(note) => format!("{note}  ·  {}", state.status),
        None => state.status.clone(),
    }
}

/// How many light samples the picture has, how long it took, its size and its renderer.
fn drawn(frame: &RenderedFrame) -> String {
    let [width, height] = frame.size;
    let samples = match frame.light_samples {
        0 => String::new(),
        1 => "1 light sample so far  ·  ".to_owned(),
        count if frame.unfinished => format!("{count} light samples so far  ·  "),
        count => format!("{count} light samples  ·  "),
    };
    format!("{samples}{}  ·  {width} x {height}  ·  {}", numbers::seconds(frame.seconds), frame.renderer)
}

/// The failure, a headline and its details, at the lower edge of the picture.
pub(crate) fn failure(ui: &Ui, picture: Rect, lines: &[String], actions: &mut Vec<Action>) {
    let Some((headline, lines)) = lines.split_first() else { return };
    let width = (picture.width() - AROUND).clamp(120.0, 860.0);
    over(ui, "failure", picture, Align2::CENTER_BOTTOM, Stroke::new(1.0, theme::FAILED), |ui| {
        ui.set_width(width);
        ui.with_layout(Layout::right_to_left(Align::Min), |ui| {
            let hide = Button::new("hide").small();
            if ui.add(hide).on_hover_text("Escape; W shows it again").clicked() {
                actions.push(Action::HideFailure);
            }
            let most = (picture.height() * 0.4).max(48.0);
            ui.with_layout(Layout::top_down(Align::Min), |ui| {
                ScrollArea::vertical().max_height(most).show(ui, |ui| {
                    ui.add(Label::new(RichText::new(headline).color(theme::FAILED)).wrap());
                    for line in lines {
                        let line = RichText::new(line).monospace().color(theme::STRONG);
                        ui.add(Label::new(line).selectable(true));
                    }
                });
            });
        });
    });
}

pub(crate) fn render_error(ui: &Ui, picture: Rect, reason: &str) {
    over(ui, "render error", picture, Align2::CENTER_CENTER, Stroke::NONE, |ui| {
        ui.set_max_width((picture.width() - AROUND).clamp(120.0, 560.0));
        ui.label(RichText::new(reason).color(theme::STRONG));
    });
}

/// Messages in the upper right corner.
pub(crate) fn toasts(ui: &Ui, state: &State, picture: Rect) {
    if state.toasts.is_empty() && !state.taking_screenshot {
        return;
    }
    over(ui, "toasts", picture, Align2::RIGHT_TOP, Stroke::NONE, |ui| {
        ui.set_max_width((picture.width() - AROUND).clamp(120.0, 360.0));
        if state.taking_screenshot {
            ui.label(RichText::new("drawing a screenshot").color(theme::STRONG));
            ui.label(RichText::new("Escape cancels it").small());
        }
        for (at, toast) in state.toasts.iter().enumerate() {
            if at > 0 || state.taking_screenshot {
                ui.add_space(6.0);
            }
            ui.label(RichText::new(&toast.title).color(theme::STRONG));
            for line in &toast.lines {
                ui.label(RichText::new(line).small());
            }
        }
    });
}

pub(crate) fn help(ui: &Ui, picture: Rect) {
    over(ui, "help", picture, Align2::CENTER_CENTER, Stroke::NONE, |ui| {
        let [width, height] = [picture.width(), picture.height()].map(|side| (side - AROUND).max(0.0));
        let count = ((width / COLUMN) as usize).clamp(1, 3);
        ScrollArea::both().max_width(width).max_height(height).show(ui, |ui| {
            ui.horizontal_top(|ui| {
                for column in columns(count) {
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

/// The groups of key bindings and the pointer's actions, in `count` columns.
fn columns(count: usize) -> Vec<Vec<Group>> {
    let mut groups: Vec<Group> = Vec::new();
    for binding in bindings() {
        if matches!(binding.action, Action::Second(_)) {
            continue;
        }
        let row = (binding.chord.name(), binding.name.clone());
        match groups.last_mut() {
            Some((group, rows)) if *group == binding.group => rows.push(row),
            _ => groups.push((binding.group, vec![row])),
        }
    }
    // The second mode has the keys of the first, with Shift.
    if let Some((_, modes)) = groups.first_mut() {
        modes.push(("with Shift".to_owned(), "second mode".to_owned()));
    }
    groups.push(("Pointer", POINTER.map(|(what, does)| (what.to_owned(), does.to_owned())).to_vec()));
    let share = groups.iter().map(|(_, rows)| rows.len() + 2).sum::<usize>().div_ceil(count);
    let (mut columns, mut filled) = (vec![Vec::new(); count], 0);
    for group in groups {
        let height = group.1.len() + 2;
        let column: &mut Vec<Group> = &mut columns[((filled + height / 2) / share.max(1)).min(count - 1)];
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

/// The gaps, margins and lines around the content of a panel over the picture, in points.
const AROUND: f32 = 50.0;

/// The width of a column of keys.
const COLUMN: f32 = 240.0;

/// A panel over the picture.
pub(crate) fn over(
    ui: &Ui,
    name: &str,
    picture: Rect,
    at: Align2,
    stroke: Stroke,
    show: impl FnOnce(&mut Ui),
) {
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
