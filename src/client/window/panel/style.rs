//! The panel's look: neutral greys, so that they do not bias the judgement of colours, and one accent. No shadows, no visibly rounded
//! corners, no animation: on a device that is the CPU every pixel of the panel costs time.

use egui::style::WidgetVisuals;
use egui::{Color32, CornerRadius, FontFamily, FontId, Shadow, Stroke, TextStyle};

/// Accent colour of active elements, warnings, and values over budget.
pub const ACCENT: Color32 = Color32::from_rgb(232, 168, 76);
/// Text of labels.
pub const DIM: Color32 = Color32::from_gray(165);
/// Text of figures.
pub const BRIGHT: Color32 = Color32::from_gray(230);
/// Background of the panel, over the picture.
pub const BACK: Color32 = Color32::from_rgba_premultiplied(20, 20, 20, 226);

/// Sets the style, once for a context.
pub fn apply(ctx: &egui::Context) {
    let id = egui::Id::new("pointillist style");
    if ctx.data(|data| data.get_temp::<bool>(id)).is_some() {
        return;
    }
    ctx.data_mut(|data| data.insert_temp(id, true));
    ctx.set_theme(egui::Theme::Dark);
    ctx.all_styles_mut(|style| {
        style.animation_time = 0.0;
        style.interaction.selectable_labels = false;
        let font = |size| FontId::new(size, FontFamily::Proportional);
        style.text_styles = [
            (TextStyle::Small, font(10.0)),
            (TextStyle::Body, font(12.0)),
            (TextStyle::Button, font(12.0)),
            (TextStyle::Heading, font(13.0)),
            (TextStyle::Monospace, FontId::new(11.0, FontFamily::Monospace)),
        ]
        .into();
        let spacing = &mut style.spacing;
        spacing.item_spacing = egui::vec2(6.0, 3.0);
        spacing.button_padding = egui::vec2(6.0, 2.0);
        spacing.interact_size = egui::vec2(30.0, 17.0);
        spacing.slider_width = 104.0;
        spacing.combo_width = 150.0;
        spacing.icon_width = 12.0;
        spacing.indent = 10.0;
        spacing.scroll = egui::style::ScrollStyle::thin();
        visuals(&mut style.visuals);
    });
}

fn visuals(visuals: &mut egui::Visuals) {
    visuals.window_shadow = Shadow::NONE;
    visuals.popup_shadow = Shadow::NONE;
    visuals.window_corner_radius = CornerRadius::ZERO;
    visuals.menu_corner_radius = CornerRadius::ZERO;
    visuals.window_fill = Color32::from_gray(28);
    visuals.panel_fill = Color32::from_gray(28);
    visuals.window_stroke = Stroke::new(1.0, Color32::from_gray(70));
    visuals.extreme_bg_color = Color32::from_gray(12);
    visuals.faint_bg_color = Color32::from_gray(34);
    visuals.selection.bg_fill = Color32::from_gray(96);
    visuals.selection.stroke = Stroke::new(1.0, Color32::WHITE);
    visuals.hyperlink_color = ACCENT;
    visuals.warn_fg_color = ACCENT;
    visuals.slider_trailing_fill = true;
    visuals.indent_has_left_vline = false;
    let look = |fill: u8, text: u8| WidgetVisuals {
        bg_fill: Color32::from_gray(fill),
        weak_bg_fill: Color32::from_gray(fill),
        bg_stroke: Stroke::NONE,
        corner_radius: CornerRadius::ZERO,
        fg_stroke: Stroke::new(1.0, Color32::from_gray(text)),
        expansion: 0.0,
    };
    visuals.widgets.noninteractive = look(28, 205);
    visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, Color32::from_gray(60));
    visuals.widgets.inactive = look(58, 220);
    visuals.widgets.hovered = look(80, 245);
    visuals.widgets.active = look(104, 255);
    visuals.widgets.open = look(66, 235);
}
