//! The histogram of the displayed picture, refreshed a few times a second while it is visible.

use std::convert::Infallible;
use std::time::{Duration, Instant};

use egui::{Color32, Rect, RichText, Sense, Shape, Ui, pos2, vec2};

use crate::client::pass::repaint::ShownTexels;
use crate::client::window::action::{Action, ActionQueue};
use crate::client::window::panel::{PanelData, PanelTab, SectionPlace, style};
use crate::client::zones;
use crate::gpu::Region;
use crate::viewer::picture::LivePicture;
use crate::viewer::tools::tool::{Tool, ToolContext};

/// Shortest interval between two histograms.
const REFRESH: Duration = Duration::from_millis(300);

/// Most pixels read back for one histogram; a larger picture is sampled in evenly spaced bands of rows.
const MOST_PIXELS: u32 = 1 << 18;

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

/// The last histogram.
#[derive(Default)]
pub struct HistogramTool {
    last: Option<(Instant, Histogram)>,
    is_shown: bool,
}

impl Tool for HistogramTool {
    type Action = Infallible;

    fn update(&mut self, context: &mut ToolContext<'_>, _: &mut PanelData) {
        let controls = &context.panel.controls;
        self.is_shown = controls.layout.shows(PanelTab::Look) && !controls.settings.view.is_error();
        if self.is_shown
            && self.last.as_ref().is_none_or(|(made, _)| made.elapsed() >= REFRESH)
            && let Some(shown) = rows(context.picture, context.session.size())
        {
            self.last = Some((Instant::now(), histogram(&shown, controls.settings.exposure)));
        }
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, queue: &mut ActionQueue<Infallible>) {
        if let Some((_, histogram)) = self.last.as_ref().filter(|_| self.is_shown)
            && place == SectionPlace::LookTop
        {
            show(ui, histogram, queue);
            ui.separator();
        }
    }
}

/// Pixels of the whole picture, or of evenly spaced bands of rows.
fn rows(picture: &mut LivePicture, [width, height]: [u32; 2]) -> Option<ShownTexels> {
    let every = width.saturating_mul(height).div_ceil(MOST_PIXELS).max(1);
    if every == 1 {
        return picture.shown(Region { origin: [0, 0], extent: [width, height] }).ok().flatten();
    }
    // A few bands rather than many single rows, because each is a separate readback.
    let bands = 16.min(height);
    let rows = (height / bands / every).max(1);
    let mut all = ShownTexels::default();
    for band in 0..bands {
        let region = Region { origin: [0, band * (height / bands)], extent: [width, rows] };
        let shown = picture.shown(region).ok().flatten()?;
        all.xyz.extend(shown.xyz);
        all.displayed.extend(shown.displayed);
    }
    Some(all)
}

fn histogram(shown: &ShownTexels, exposure: f32) -> Histogram {
    let [low, high] = STOPS;
    let stops = (high - low) as usize;
    let mut made = Histogram {
        luminance: vec![0.0; stops * BINS_PER_STOP],
        displayed: std::array::from_fn(|_| vec![0.0; DISPLAY_BINS]),
        ..Histogram::default()
    };
    let share = 1.0 / shown.xyz.len().max(1) as f32;
    let middle = zones::middle() as f32;
    for [_, y, _] in &shown.xyz {
        let stop = (exposure * y / middle).log2();
        if stop >= low && stop < high {
            made.luminance[((stop - low) * BINS_PER_STOP as f32) as usize] += share;
        }
    }
    // Same thresholds as the clipping view, encoded with a gamma of 2.2.
    let black = zones::BLACK.powf(1.0 / 2.2);
    for rgb in &shown.displayed {
        for (bins, value) in made.displayed.iter_mut().zip(rgb) {
            let bin = (value.clamp(0.0, 1.0) * DISPLAY_BINS as f32) as usize;
            bins[bin.min(DISPLAY_BINS - 1)] += share;
        }
        made.clipped += if rgb.iter().any(|c| *c > 0.998) { share } else { 0.0 };
        made.black += if rgb.iter().all(|c| *c < black) { share } else { 0.0 };
    }
    made
}

fn show(ui: &mut Ui, histogram: &Histogram, queue: &mut ActionQueue<Infallible>) {
    let [low, high] = STOPS;
    ui.label(RichText::new("Luminance, stops around middle grey").small().color(style::DIM));
    let place = plot(ui, &[(&histogram.luminance, style::DIM)], queue);
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
    plot(ui, &[(red, colors[0]), (green, colors[1]), (blue, colors[2])], queue);
    let share = |share: f32| format!("{:.1} %", 100.0 * share);
    ui.colored_label(
        style::DIM,
        format!("{} white, {} black", share(histogram.clipped), share(histogram.black)),
    )
    .on_hover_text("“Show: Clipping” below marks them with stripes");
}

/// Draws bars; the wheel over them changes the exposure.
fn plot(ui: &mut Ui, bars: &[(&Vec<f32>, Color32)], queue: &mut ActionQueue<Infallible>) -> Rect {
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
            queue.ask_window(Action::Expose(f64::from(turned) / WHEEL));
        }
    }
    place
}

/// Scroll distance in points that equals one step of the wheel.
const WHEEL: f64 = 40.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_those_of_the_pixels() {
        let middle = zones::middle() as f32;
        let shown = ShownTexels {
            xyz: vec![[0.0, middle, 0.0], [0.0, 2.0 * middle, 0.0], [0.0; 3], [0.0, 1e9, 0.0]],
            displayed: vec![[0.18; 3], [0.5, 0.4, 0.3], [0.0; 3], [1.0, 1.0, 0.9]],
        };
        let made = histogram(&shown, 1.0);
        let zero = (-STOPS[0]) as usize * BINS_PER_STOP;
        assert_eq!((made.luminance[zero], made.luminance[zero + BINS_PER_STOP]), (0.25, 0.25));
        assert_eq!(made.luminance.iter().sum::<f32>(), 0.5, "what lies outside is not shown");
        assert_eq!((made.clipped, made.black), (0.25, 0.25));
        assert_eq!(made.displayed[0].iter().sum::<f32>(), 1.0);
        let brighter = histogram(&shown, 2.0);
        assert_eq!(brighter.luminance[zero + BINS_PER_STOP], 0.25);
    }

    #[test]
    fn the_histogram_is_told() {
        use egui_kittest::kittest::Queryable;
        let histogram = Histogram {
            luminance: vec![0.01; 72],
            displayed: std::array::from_fn(|_| vec![0.015; 64]),
            clipped: 0.031,
            black: 0.0,
        };
        let mut queue = ActionQueue::default();
        let mut harness = egui_kittest::Harness::new_ui(|ui| show(ui, &histogram, &mut queue));
        harness.run_steps(2);
        harness.get_by_label("3.1 % white, 0.0 % black");
    }
}
