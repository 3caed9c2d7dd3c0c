//! Maps over the picture in false colours, with what the colours mean.

use std::sync::Arc;

use egui::{
    Align2, Area, Color32, ColorImage, Context, Frame, Id, LayerId, Margin, Order, Rect, TextureHandle,
};
use egui::{TextureOptions, Ui, Vec2, pos2, vec2};

use crate::client::window::panel::known::{MapReadout, Overlay, Show};
use crate::client::window::panel::style;
use crate::color::palette;

/// How much of the picture a map hides.
const OPACITY: f32 = 0.85;

/// Size of the legend's colours, points.
const BAR: Vec2 = vec2(200.0, 10.0);

/// Least distance to the window's edge, points.
const GAP: f32 = 8.0;

/// Draws what lies over the picture, below the panel.
pub(super) fn show(ctx: &Context, overlay: &Overlay) {
    match overlay {
        Overlay::None => {
            // The texture goes with it.
            ctx.data_mut(|data| data.remove::<Drawn>(Id::new("map")));
        }
        Overlay::Map(map) => {
            cover(ctx, map);
            corner(ctx, |ui| legend(ui, map));
        }
        Overlay::Missing(why) => corner(ctx, |ui| {
            ui.colored_label(style::BRIGHT, why);
        }),
    }
}

/// What was drawn last, and its texture.
type Drawn = (Arc<MapReadout>, TextureHandle);

/// The map itself.
fn cover(ctx: &Context, map: &Arc<MapReadout>) {
    let [columns, rows] = map.grid;
    if columns * rows == 0 || map.values.len() != columns * rows || map.cells.iter().any(|n| *n <= 0.0) {
        return;
    }
    let kept = ctx.data(|data| data.get_temp::<Drawn>(Id::new("map")));
    let texture = match kept {
        Some((drawn, texture)) if Arc::ptr_eq(&drawn, map) => texture,
        _ => {
            let texture = ctx.load_texture("map", image(map), options(map.show));
            ctx.data_mut(|data| data.insert_temp::<Drawn>(Id::new("map"), (map.clone(), texture.clone())));
            texture
        }
    };
    let window = ctx.content_rect();
    let extent = vec2(columns as f32 / map.cells[0] as f32, rows as f32 / map.cells[1] as f32);
    let place = Rect::from_min_size(window.min, window.size() * extent);
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    let tint = Color32::WHITE.gamma_multiply(OPACITY);
    ctx.layer_painter(LayerId::background()).with_clip_rect(window).image(texture.id(), place, whole, tint);
}

/// Neighbourhoods are what they are; regions of cost are samples of something smooth.
fn options(show: Show) -> TextureOptions {
    if show == Show::CostMap { TextureOptions::LINEAR } else { TextureOptions::NEAREST }
}

fn image(map: &MapReadout) -> ColorImage {
    let color = |value: &f64| {
        let [r, g, b] = palette::color(map.scale.place(*value));
        Color32::from_rgb(r, g, b)
    };
    ColorImage::new(map.grid, map.values.iter().map(color).collect())
}

/// A sheet at the upper right.
fn corner(ctx: &Context, contents: impl FnOnce(&mut Ui)) {
    let room = ctx.content_rect().shrink(GAP).size();
    if room.x < 60.0 || room.y < 40.0 {
        return;
    }
    let area = Area::new(Id::new("legend")).order(Order::Middle).fade_in(false).interactable(false);
    area.anchor(Align2::RIGHT_TOP, [-GAP, GAP]).show(ctx, |ui| {
        Frame::new().fill(style::BACK).inner_margin(Margin::same(8)).show(ui, |ui| {
            ui.set_max_width(BAR.x.min(room.x - 16.0));
            contents(ui);
        });
    });
}

fn legend(ui: &mut Ui, map: &MapReadout) {
    let title = match map.show {
        Show::CostMap => "Time of a path, µs",
        _ => "Relative error of 8×8 pixels",
    };
    ui.colored_label(style::BRIGHT, title);
    let (bar, _) = ui.allocate_exact_size(vec2(BAR.x.min(ui.available_width()), BAR.y), egui::Sense::hover());
    let steps = 64;
    for i in 0..steps {
        let x = |i: usize| bar.left() + bar.width() * i as f32 / steps as f32;
        let [r, g, b] = palette::color((i as f32 + 0.5) / steps as f32);
        let part = Rect::from_min_max(pos2(x(i), bar.top()), pos2(x(i + 1), bar.bottom()));
        ui.painter().rect_filled(part, 0.0, Color32::from_rgb(r, g, b));
    }
    let words = |value: f64| figure(map.show, value);
    let (text, _) = ui.allocate_exact_size(vec2(bar.width(), 12.0), egui::Sense::hover());
    let font = egui::TextStyle::Small.resolve(ui.style());
    let ends = [
        (text.left_center(), Align2::LEFT_CENTER, map.scale.low),
        (text.center(), Align2::CENTER_CENTER, map.scale.middle()),
        (text.right_center(), Align2::RIGHT_CENTER, map.scale.high),
    ];
    for (at, align, value) in ends {
        ui.painter().text(at, align, words(value), font.clone(), style::BRIGHT);
    }
    if let Some((value, share)) = under_pointer(ui.ctx(), map) {
        let mut line = format!("here {}", words(value));
        if let Some(share) = share {
            line += &format!(", {} of the time", percent(share));
        }
        ui.label(egui::RichText::new(line).small().color(style::DIM));
    } else if let Some(line) = range(&map.shares) {
        ui.label(egui::RichText::new(line).small().color(style::DIM));
    }
}

/// What regions take of the time, from the cheapest to the dearest but for the last hundredths: those may be chance.
fn range(shares: &[f64]) -> Option<String> {
    let mut known: Vec<f64> = shares.iter().copied().filter(|share| *share > 0.0).collect();
    known.sort_by(f64::total_cmp);
    let last = known.len().checked_sub(1)?;
    let [least, most] = [known[last / 50], known[last - last / 50]].map(percent);
    Some(format!("regions take {}–{most} of the time", least.trim_end_matches(" %")))
}

/// Figure and share of the cell under the pointer.
fn under_pointer(ctx: &Context, map: &MapReadout) -> Option<(f64, Option<f64>)> {
    let (window, at) = (ctx.content_rect(), ctx.pointer_latest_pos()?);
    if !window.contains(at) || ctx.layer_id_at(at).is_some_and(|layer| layer.order != Order::Background) {
        return None;
    }
    let place = (at - window.min) / window.size();
    let cell = |place: f32, i: usize| {
        ((f64::from(place) * map.cells[i]) as usize).min(map.grid[i].saturating_sub(1))
    };
    let i = cell(place.y, 1) * map.grid[0] + cell(place.x, 0);
    let value = map.values.get(i).filter(|value| value.is_finite())?;
    Some((*value, map.shares.get(i).copied()))
}

fn figure(show: Show, value: f64) -> String {
    match show {
        Show::CostMap => format!("{} µs", significant(value)),
        _ => percent(value),
    }
}

fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share))
}

/// Two digits or so.
fn significant(value: f64) -> String {
    let decimals = match value {
        v if v >= 9.95 || v == 0.0 => 0,
        v if v >= 0.995 => 1,
        v if v >= 0.0995 => 2,
        _ => 3,
    };
    let text = format!("{value:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn legends_read_well() {
        assert_eq!(
            [0.0, 0.1, 1.0, 2.5, 31.6, 0.0316].map(significant),
            ["0", "0.1", "1", "2.5", "32", "0.032"]
        );
        assert_eq!(figure(Show::CostMap, 1.25), "1.2 µs");
        assert_eq!(figure(Show::ErrorMap, 0.2), "20 %");
        let shares = [0.0, 0.000_52, 0.0013];
        assert_eq!(range(&shares).as_deref(), Some("regions take 0.052–0.13 % of the time"));
        assert_eq!(range(&[0.0]), None);
    }

    #[test]
    fn pictures_of_maps_have_their_colours() {
        let map = MapReadout {
            grid: [2, 1],
            values: vec![0.0, f64::NAN],
            scale: crate::client::window::panel::Scale { low: 0.0, high: 1.0, logarithmic: false },
            ..MapReadout::default()
        };
        let [r, g, b] = palette::NOTHING;
        let image = image(&map);
        assert_eq!((image.size, image.pixels[1]), ([2, 1], Color32::from_rgb(r, g, b)));
    }
}
