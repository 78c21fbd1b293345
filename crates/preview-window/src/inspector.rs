//! The panel on the right: the editor of the material, and statistics of the scene and the view.

use eframe::egui::{Align, Button, Label, Layout, RichText, ScrollArea, Ui, Vec2b};
use egui_plot::{GridInput, GridMark, HLine, HoverPosition, Line, LineStyle, Plot, PlotPoints};

use crate::editor::{editor, heading_with};
use crate::error_meter::{ErrorMeter, ModeError};
use crate::numbers;
use crate::scene_statistics::SceneStatistics;
use crate::state::{Action, ShownScene, State};
use crate::theme;
use preview::{Aim, Arrangement, Background, Mode, Named, Scene};

/// The most circular lights that are listed.
const MOST_DISKS: usize = 8;

/// A value that is not known yet.
const UNKNOWN: &str = "...";

/// A value that is not known before there are maps.
const NO_MAPS: &str = "no maps yet";

/// A value that is not known without a BRDF table.
const NO_TABLE: &str = "no BRDF table";
const NO_TRANSFER: &str = "no transfer of this mesh";
const NO_TAPS: &str = "no scale space or no taps";

/// What a light alone lacks.
const NO_MATERIAL: &str = "no material in this pipeline";
const NO_CUBE: &str = "no cube with levels is exported";

pub(crate) fn inspector(ui: &mut Ui, state: &State, error_meter: &ErrorMeter, actions: &mut Vec<Action>) {
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let Some(shown) = &state.shown else {
            ui.label(RichText::new("no scene yet").color(theme::WEAK));
            return;
        };
        light(ui, state, actions);
        editor(ui, state, actions);
        let statistics = error_meter.statistics(shown.scene_id);
        subject(ui, shown, statistics.as_deref());
        errors(ui, state, shown, error_meter);
        energies(ui, statistics.as_deref());
        sizes(ui, shown, statistics.as_deref());
        view(ui, state);
        notes(ui, shown);
    });
}

/// The turn of the light, which can be written to the manifest.
fn light(ui: &mut Ui, state: &State, actions: &mut Vec<Action>) {
    let [is_turned, is_changed] = state.is_light_changed();
    let Aim { yaw, pitch } = state.settings.light;
    let turn = if is_turned { format!("{}, not written", pair(yaw, pitch)) } else { String::new() };
    heading_with(ui, "Turn the light", &turn);
    let buttons = [
        (
            is_turned,
            "write",
            "Write the turn to the manifest; a question says what changes (Ctrl Shift S)",
            Action::SaveLight,
        ),
        (is_changed, "reset", "Turn the light back (Shift Home)", Action::ResetLight),
    ];
    ui.horizontal(|ui| {
        for (enabled, name, explained, action) in buttons {
            if ui.add_enabled(enabled, Button::new(name).small()).on_hover_text(explained).clicked() {
                actions.push(action);
            }
        }
    });
    ui.add_space(4.0);
}

fn subject(ui: &mut Ui, shown: &ShownScene, statistics: Option<&SceneStatistics>) {
    let known = |of: &dyn Fn(&SceneStatistics) -> String| statistics.map_or_else(|| UNKNOWN.to_owned(), of);
    section(
        ui,
        "Subject",
        &[
            ("environment", shown.subject.environment.clone()),
            ("material", shown.subject.material.clone()),
            ("mesh", shown.subject.mesh.clone()),
            (
                "triangles",
                known(&|statistics| match statistics.objects {
                    1 => statistics.triangles.to_string(),
                    objects => format!("{} in {objects} objects", statistics.triangles),
                }),
            ),
            (
                "degree F",
                known(&|statistics| {
                    statistics.f.map_or_else(|| unknown(statistics).to_owned(), |f| f.to_string())
                }),
            ),
            (
                "degree P",
                known(&|statistics| {
                    statistics.p.map_or_else(|| no_maps(statistics).to_owned(), |p| p.to_string())
                }),
            ),
            (
                "lamps kept as lights",
                known(&|statistics| match statistics.lamps {
                    0 => "none".to_owned(),
                    lamps => lamps.to_string(),
                }),
            ),
            ("looked up by", known(&|statistics| statistics.centre.clone())),
        ],
    );
    let levels = shown.scene.objects.iter().filter_map(|object| object.look.prefiltered_cube());
    let levels: Vec<String> = levels.map(|(_, level)| format!("{level:.2}")).collect();
    if !levels.is_empty() {
        explain(ui, &format!("from left to right, read at level {}", levels.join(", ")));
    }
}

/// The value of a property that only a reflection has.
fn unknown(statistics: &SceneStatistics) -> &'static str {
    if statistics.p.is_some() { "unknown for a map" } else { no_maps(statistics) }
}

/// Why a property of maps is not known.
fn no_maps(statistics: &SceneStatistics) -> &'static str {
    if statistics.shows_light { NO_MATERIAL } else { NO_MAPS }
}

/// What a scene lacks for a mode; `None` if it has everything.
pub(crate) fn missing(scene: &Scene, mode: Mode) -> Option<&'static str> {
    let lacks = match mode {
        Mode::Prefiltered if scene.shows_light() => NO_CUBE,
        _ if scene.shows_light() => NO_MATERIAL,
        Mode::Table => NO_TABLE,
        Mode::Transfer => NO_TRANSFER,
        Mode::Taps => NO_TAPS,
        _ => NO_MAPS,
    };
    (!scene.offers(mode)).then_some(lacks)
}

fn errors(ui: &mut Ui, state: &State, shown: &ShownScene, error_meter: &ErrorMeter) {
    let settings = &state.settings;
    let mut modes = vec![settings.first_mode(&shown.scene)];
    if settings.arrangement != Arrangement::One && settings.second != modes[0] {
        modes.push(settings.second);
    }
    let mut samples = 0;
    let rows: Vec<(&str, String)> = modes
        .into_iter()
        .map(|mode| {
            let mode_error = match error_meter.mode_error(mode) {
                None => missing(&shown.scene, mode).unwrap_or(UNKNOWN).to_owned(),
                Some(ModeError::Measured { stops, rms, light_samples }) => {
                    samples = samples.max(light_samples);
                    numbers::apart_in_columns(stops, rms)
                }
                Some(ModeError::None(why)) => why,
            };
            (mode.label(), mode_error)
        })
        .collect();
    section(ui, "Against brute force", &rows);
    if samples > 0 {
        let measured = "stops within which 95 and 99 % are, and relative RMS; in this view at a small size";
        explain(ui, &format!("{measured}, {samples} light samples per pixel"));
    }
}

fn energies(ui: &mut Ui, statistics: Option<&SceneStatistics>) {
    let known = |of: &dyn Fn(&SceneStatistics) -> String| statistics.map_or_else(|| UNKNOWN.to_owned(), of);
    section(
        ui,
        "Energy",
        &[
            (
                "light captured (degree up to F)",
                known(&|statistics| match statistics.p {
                    Some(_) => numbers::percent(statistics.captured()),
                    None => no_maps(statistics).to_owned(),
                }),
            ),
            (
                "does not change with the view",
                known(&|statistics| {
                    statistics.plain.map_or_else(|| unknown(statistics).to_owned(), numbers::percent)
                }),
            ),
        ],
    );
    let Some(statistics) = statistics.filter(|statistics| statistics.p.is_some()) else { return };
    let points = |shares: &[f64]| -> PlotPoints<'static> {
        // Powers of ten; zero has no point.
        let shares = shares.iter().enumerate().filter(|(_, share)| **share > 1e-12);
        shares.map(|(l, share)| [l as f64, share.log10()]).collect()
    };
    let (lighting, reflected) = (points(&statistics.lighting), points(&statistics.reflected));
    let most = statistics.lighting.len().max(2) as f64 - 1.0;
    Plot::new("energy per degree")
        .height(120.0)
        .show_axes(Vec2b::TRUE)
        .show_crosshair(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
        .include_x(0.0)
        .include_x(most)
        .grid_color(theme::GRID)
        .x_grid_spacer(tens)
        .y_grid_spacer(decades)
        .x_axis_formatter(|mark, _| format!("{}", mark.value))
        .y_axis_formatter(|mark, _| power(mark.value))
        .y_axis_min_width(34.0)
        .label_formatter(|at| {
            let HoverPosition::NearDataPoint { plot_name, position, .. } = at else { return None };
            let share = numbers::percent(10_f64.powf(position.y));
            Some(format!("{plot_name}, l = {:.0}: {share}", position.x))
        })
        .show(ui, |plot| {
            plot.line(Line::new("light", lighting).color(theme::LIGHTING).width(1.5));
            plot.line(Line::new("reflected", reflected).color(theme::REFLECTED).width(1.5));
            plot.hline(HLine::new("all", 0.0).color(theme::WEAK).style(LineStyle::dotted_dense()));
        });
    ui.horizontal(|ui| {
        ui.label(RichText::new("share of each degree l:").small().color(theme::WEAK));
        ui.label(RichText::new("light").small().color(theme::LIGHTING));
        ui.label(RichText::new("reflected").small().color(theme::REFLECTED));
    });
}

fn sizes(ui: &mut Ui, shown: &ShownScene, statistics: Option<&SceneStatistics>) {
    let maps = statistics.map(|statistics| statistics.maps.as_slice()).unwrap_or_default();
    let maps: Vec<(&str, String)> =
        maps.iter().map(|(name, size)| (name.as_str(), numbers::bytes(*size))).collect();
    section(ui, "Maps in memory, 32-bit RGB", &maps);
    let exports = &shown.details.exports;
    if !exports.is_empty() {
        let exports: Vec<(&str, String)> =
            exports.iter().map(|export| (export.name.as_str(), numbers::bytes(export.bytes))).collect();
        section(ui, "Exported files", &exports);
    }
}

fn view(ui: &mut Ui, state: &State) {
    let settings = &state.settings;
    let background = match settings.background {
        Background::Flat(_) => "flat grey, 0.18",
        background => background.name(),
    };
    if let Some(shown) = &state.shown {
        let disks = shown.scene.light.disks().iter().take(MOST_DISKS).map(|disk| {
            let [x, y, z] = disk.direction.vector().to_array();
            ("direction", format!("[{x:.3}, {y:.3}, {z:.3}]"))
        });
        let disks: Vec<(&str, String)> = disks.collect();
        if !disks.is_empty() {
            section(ui, "Circular lights", &disks);
            explain(ui, "as in the file of circular-lights; drag one in the background to move it here");
        }
    }
    section(
        ui,
        "View",
        &[
            ("light yaw, pitch", pair(settings.light.yaw, settings.light.pitch)),
            ("camera yaw, pitch", pair(settings.camera.yaw, settings.camera.pitch)),
            ("zoom", format!("{:.2}", settings.zoom)),
            ("exposure", numbers::stops(settings.exposure)),
            ("tone curve", settings.tone.name().to_owned()),
            ("background", background.to_owned()),
            ("output", "sRGB, 8 bits".to_owned()),
        ],
    );
    explain(ui, "radiance is linear Rec. 709; yaw and pitch of the light are as in the kind rotate");
}

fn notes(ui: &mut Ui, shown: &ShownScene) {
    if shown.details.notes.is_empty() {
        return;
    }
    heading(ui, "Notes");
    for note in &shown.details.notes {
        ui.label(note);
    }
}

fn pair(yaw: f64, pitch: f64) -> String {
    format!("{}, {}", numbers::degrees(yaw), numbers::degrees(pitch))
}

fn power(exponent: f64) -> String {
    match exponent {
        0.0 => "1".into(),
        exponent if exponent == exponent.round() => format!("1e{exponent}"),
        _ => String::new(),
    }
}

/// A line for each power of ten, or for every second or third one if there are many.
fn decades(input: GridInput) -> Vec<GridMark> {
    marks(input, |range| (range / 5.0).ceil().max(1.0))
}

/// A line for each degree, or for every tenth, hundredth, ... if there are many.
fn tens(input: GridInput) -> Vec<GridMark> {
    marks(input, |range| 10_f64.powf((range / 15.0).log10().ceil()).max(1.0))
}

fn marks(input: GridInput, step: impl Fn(f64) -> f64) -> Vec<GridMark> {
    let (least, most) = input.bounds;
    let step = step(most - least);
    // egui draws marks that are far apart at full strength.
    let mark = |count: i32| GridMark { value: step * f64::from(count), step_size: 1e6 };
    ((least / step).ceil() as i32..=(most / step).floor() as i32).map(mark).collect()
}

fn heading(ui: &mut Ui, name: &str) {
    ui.add_space(8.0);
    ui.label(RichText::new(name).small().color(theme::WEAK));
}

fn explain(ui: &mut Ui, text: &str) {
    ui.label(RichText::new(text).small().color(theme::WEAK));
}

/// Names on the left, values on the right.
fn section(ui: &mut Ui, name: &str, rows: &[(&str, String)]) {
    heading(ui, name);
    ui.scope(|ui| {
        ui.spacing_mut().item_spacing.y = 2.0;
        for (name, value) in rows {
            ui.horizontal(|ui| {
                ui.label(*name);
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    ui.add(Label::new(RichText::new(value).color(theme::STRONG)).truncate());
                });
            });
        }
    });
}
