//! The tab of the display: histograms above its controls.

use std::sync::Arc;

use egui::{Color32, Rect, RichText, Sense, Shape, Ui, pos2, vec2};

use crate::client::settings::DisplayView;
use crate::client::window::action::Action;
use crate::client::window::panel::{PanelControls, PanelData, controls, style};
use crate::client::zones;

/// Bins of the displayed colours.
pub const DISPLAY_BINS: usize = 64;

/// Range of the luminance histogram, in stops relative to middle grey.
pub const STOPS: [f32; 2] = [-10.0, 8.0];

/// Bins per stop.
pub const BINS_PER_STOP: usize = 4;

/// Height of a histogram, points.
const HEIGHT: f32 = 56.0;

/// Histograms of luminance and displayed colours, as fractions of the pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Histogram {
    /// Exposed luminance before the tone curve, in stops relative to middle grey ([`STOPS`], [`BINS_PER_STOP`]).
    pub luminance: Vec<f32>,
    /// Displayed R, G, B, from 0 to the maximum ([`DISPLAY_BINS`]).
    pub displayed: [Vec<f32>; 3],
    /// Fraction of pixels with a channel at its maximum.
    pub clipped: f32,
    /// Fraction of pixels displayed as black.
    pub black: f32,
}

/// Draws the tab.
pub(super) fn show(ui: &mut Ui, data: &PanelData, panel: &mut PanelControls, actions: &mut Vec<Action>) {
    if let Some(histogram) = &data.histogram {
        histograms(ui, histogram, actions);
        ui.separator();
    }
    controls::show(ui, panel);
    if panel.settings.view == DisplayView::FalseColor {
        ui.separator();
        zone_legend(ui);
    }
}

fn histograms(ui: &mut Ui, histogram: &Arc<Histogram>, actions: &mut Vec<Action>) {
    let [low, high] = STOPS;
    ui.label(RichText::new("Luminance, stops around middle grey").small().color(style::DIM));
    let place = plot(ui, &[(&histogram.luminance, style::DIM)], actions);
    let font = egui::TextStyle::Small.resolve(ui.style());
    for stop in [-8, -4, 0, 4] {
        let x = place.left() + place.width() * (stop as f32 - low) / (high - low);
        ui.painter().vline(x, place.y_range(), (1.0, Color32::from_gray(70)));
        ui.painter().text(
            pos2(x + 2.0, place.top()),
            egui::Align2::LEFT_TOP,
            format!("{stop:+}"),
            font.clone(),
            style::DIM,
        );
    }
    ui.label(RichText::new("Displayed R, G, B").small().color(style::DIM));
    let [red, green, blue] = &histogram.displayed;
    let colors = [
        Color32::from_rgba_unmultiplied(230, 90, 80, 130),
        Color32::from_rgba_unmultiplied(90, 210, 100, 130),
        Color32::from_rgba_unmultiplied(90, 130, 240, 130),
    ];
    plot(ui, &[(red, colors[0]), (green, colors[1]), (blue, colors[2])], actions);
    let share = |share: f32| format!("{:.1} %", 100.0 * share);
    ui.colored_label(
        style::DIM,
        format!("{} white, {} black", share(histogram.clipped), share(histogram.black)),
    )
    .on_hover_text("“View” below marks them with stripes");
}

/// Draws bars; the wheel over them changes the exposure.
fn plot(ui: &mut Ui, bars: &[(&Vec<f32>, Color32)], actions: &mut Vec<Action>) -> Rect {
    let (place, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::hover());
    let painter = ui.painter().with_clip_rect(place);
    painter.rect_filled(place, 0.0, ui.visuals().extreme_bg_color);
    // Square root, so that small bins stay visible beside large ones.
    let top = bars.iter().flat_map(|(shares, _)| shares.iter()).copied().fold(1e-6, f32::max).sqrt();
    for (shares, color) in bars {
        let width = place.width() / shares.len().max(1) as f32;
        for (i, share) in shares.iter().enumerate().filter(|(_, share)| **share > 0.0) {
            let height = share.sqrt() / top * place.height();
            let x = place.left() + i as f32 * width;
            let bar = Rect::from_min_max(pos2(x, place.bottom() - height), pos2(x + width, place.bottom()));
            painter.add(Shape::rect_filled(bar, 0.0, *color));
        }
    }
    if response.on_hover_text("Wheel: brightness").hovered() {
        // The histogram consumes the wheel, so that the surrounding area does not scroll.
        let turned = ui.input_mut(|input| std::mem::take(&mut input.smooth_scroll_delta)).y;
        if turned != 0.0 {
            actions.push(Action::Expose(f64::from(turned) / WHEEL));
        }
    }
    place
}

/// Scroll distance in points that equals one step of the wheel.
const WHEEL: f64 = 40.0;

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
