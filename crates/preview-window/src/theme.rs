//! The window's theme: neutral greys, so that they do not affect how the picture's colours appear.

use eframe::egui::{
    Color32, Context, CornerRadius, FontId, Shadow, Stroke, TextStyle, Theme, Visuals, style,
};

/// The area of the picture before there is one.
pub(crate) const CANVAS: Color32 = Color32::from_gray(18);
const PANEL: Color32 = Color32::from_gray(30);
const LINE: Color32 = Color32::from_gray(52);
const TEXT: Color32 = Color32::from_gray(190);
/// Values and selected entries.
pub(crate) const STRONG: Color32 = Color32::from_gray(236);
/// Headings and explanations.
pub(crate) const WEAK: Color32 = Color32::from_gray(128);
pub(crate) const GRID: Color32 = Color32::from_gray(58);
/// The two curves of the plot, and failures: the only colours with a hue, all muted.
pub(crate) const LIGHTING: Color32 = Color32::from_gray(210);
pub(crate) const REFLECTED: Color32 = Color32::from_rgb(206, 152, 92);
pub(crate) const FAILED: Color32 = Color32::from_rgb(222, 108, 96);
/// The background of text over the picture.
pub(crate) const VEIL: Color32 = Color32::from_rgba_premultiplied(12, 12, 12, 208);

pub(crate) fn set(context: &Context) {
    context.set_theme(Theme::Dark);
    // Zooming the text would change the picture's size.
    context.options_mut(|options| options.zoom_with_keyboard = false);
    context.all_styles_mut(|style| {
        style.visuals = visuals();
        // Without animations nothing is repainted unless it changed.
        style.animation_time = 0.0;
        style.scroll_animation = style::ScrollAnimation::none();
        style.interaction.tooltip_delay = 0.4;
        style.interaction.selectable_labels = false;
        style.spacing.item_spacing = [8.0, 5.0].into();
        // Scroll bars lie beside the text, not over it.
        style.spacing.scroll.floating_allocated_width = 8.0;
        style.spacing.slider_width = 110.0;
        for (text, size) in [(TextStyle::Body, 13.0), (TextStyle::Button, 13.0), (TextStyle::Heading, 15.0)] {
            style.text_styles.insert(text, FontId::proportional(size));
        }
        style.text_styles.insert(TextStyle::Small, FontId::proportional(11.0));
        style.text_styles.insert(TextStyle::Monospace, FontId::monospace(12.0));
    });
}

fn visuals() -> Visuals {
    let mut visuals = Visuals::dark();
    visuals.panel_fill = PANEL;
    visuals.window_fill = PANEL;
    visuals.window_stroke = Stroke::new(1.0, LINE);
    visuals.window_shadow = Shadow::NONE;
    visuals.popup_shadow = Shadow::NONE;
    visuals.extreme_bg_color = Color32::from_gray(22);
    visuals.error_fg_color = FAILED;
    visuals.weak_text_color = Some(WEAK);
    visuals.selection.bg_fill = Color32::from_gray(74);
    visuals.selection.stroke = Stroke::new(1.0, STRONG);
    let widgets = &mut visuals.widgets;
    widgets.noninteractive.bg_stroke = Stroke::new(1.0, LINE);
    widgets.noninteractive.fg_stroke = Stroke::new(1.0, TEXT);
    widgets.inactive.weak_bg_fill = Color32::from_gray(44);
    widgets.inactive.bg_fill = Color32::from_gray(58);
    widgets.inactive.fg_stroke = Stroke::new(1.0, TEXT);
    widgets.hovered.weak_bg_fill = Color32::from_gray(54);
    widgets.hovered.bg_stroke = Stroke::new(1.0, Color32::from_gray(92));
    widgets.hovered.fg_stroke = Stroke::new(1.0, STRONG);
    widgets.active.weak_bg_fill = Color32::from_gray(66);
    widgets.active.bg_stroke = Stroke::new(1.0, Color32::from_gray(120));
    widgets.active.fg_stroke = Stroke::new(1.0, STRONG);
    widgets.open.weak_bg_fill = Color32::from_gray(54);
    for state in [
        &mut widgets.noninteractive,
        &mut widgets.inactive,
        &mut widgets.hovered,
        &mut widgets.active,
        &mut widgets.open,
    ] {
        state.corner_radius = CornerRadius::same(3);
        state.expansion = 0.0;
    }
    visuals
}
