//! The tab of the display: its controls, and the legend of false colours.

use egui::{Color32, Rect, RichText, Sense, Ui, pos2, vec2};

use crate::client::settings::DisplayView;
use crate::client::window::panel::{PanelControls, controls, style};
use crate::client::zones;

/// Draws the tab.
pub(super) fn show(ui: &mut Ui, panel: &mut PanelControls) {
    controls::show(ui, panel);
    if panel.settings.view == DisplayView::FalseColor {
        ui.separator();
        zone_legend(ui);
    }
}

/// The colours of the zones, each with its stops.
fn zone_legend(ui: &mut Ui) {
    ui.label(RichText::new("Stops around middle grey").small().color(style::DIM));
    let (place, _) = ui.allocate_exact_size(vec2(ui.available_width(), 26.0), Sense::hover());
    let width = place.width() / zones::ZONES as f32;
    let font = egui::TextStyle::Small.resolve(ui.style());
    for (zone, color) in zones::ZONE_COLORS.iter().enumerate() {
        let corner = pos2(place.left() + zone as f32 * width, place.top());
        let [r, g, b] = color.map(crate::color::srgb::encode_8bit);
        let patch = Rect::from_min_size(corner, vec2(width, 13.0));
        ui.painter().rect_filled(patch, 0.0, Color32::from_rgb(r, g, b));
        let stops = zones::stops(zone);
        let words = if stops == 0 { "0".to_owned() } else { format!("{stops:+}") };
        let at = pos2(patch.center().x, place.bottom());
        ui.painter().text(at, egui::Align2::CENTER_BOTTOM, words, font.clone(), style::DIM);
    }
}
