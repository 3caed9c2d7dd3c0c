//! Maps over the picture in false colours, with their legend.

use std::sync::Arc;

use egui::{
    Align2, Color32, ColorImage, Context, Id, LayerId, Order, Rect, TextureHandle, TextureOptions, Ui, Vec2,
    pos2, vec2,
};

use crate::client::window::panel::data::{FalseColorMap, MapChoice, PictureOverlay};
use crate::client::window::panel::over_picture::{PictureArea, corner};
use crate::client::window::panel::plots::trimmed;
use crate::client::window::panel::style;
use crate::color::palette;

/// Opacity of a map over the picture.
const OPACITY: f32 = 0.85;

/// Size of the legend's colour bar, points.
const BAR: Vec2 = vec2(200.0, 10.0);

/// Draws the map over the picture, below the panel.
pub(super) fn show(ctx: &Context, picture: PictureArea, overlay: &PictureOverlay) {
    match overlay {
        PictureOverlay::None => {
            // Removing the entry frees the texture.
            ctx.data_mut(|data| data.remove::<Drawn>(Id::new("map")));
        }
        PictureOverlay::Map(map) => {
            cover(ctx, picture, map);
            upper_right(ctx, picture, |ui| legend(ui, picture, map));
        }
        PictureOverlay::Missing(why) => upper_right(ctx, picture, |ui| {
            ui.colored_label(style::BRIGHT, why);
        }),
    }
}

fn upper_right(ctx: &Context, picture: PictureArea, contents: impl FnOnce(&mut Ui)) {
    corner(ctx, picture.area, "legend", Align2::RIGHT_TOP, |ui, room| {
        ui.set_max_width(BAR.x.min(room.x - 16.0));
        contents(ui);
    });
}

/// The last drawn map, and its texture.
type Drawn = (Arc<FalseColorMap>, TextureHandle);

/// Draws the map itself.
fn cover(ctx: &Context, picture: PictureArea, map: &Arc<FalseColorMap>) {
    let [columns, rows] = map.grid;
    if columns * rows == 0 || map.values.len() != columns * rows || map.cells.iter().any(|n| *n <= 0.0) {
        return;
    }
    let kept = ctx.data(|data| data.get_temp::<Drawn>(Id::new("map")));
    let texture = match kept {
        Some((drawn, texture)) if Arc::ptr_eq(&drawn, map) => texture,
        _ => {
            let texture = ctx.load_texture("map", image(map), options(map.kind));
            ctx.data_mut(|data| data.insert_temp::<Drawn>(Id::new("map"), (map.clone(), texture.clone())));
            texture
        }
    };
    let extent = vec2(columns as f32 / map.cells[0] as f32, rows as f32 / map.cells[1] as f32);
    let place = Rect::from_min_size(picture.whole().min, picture.whole().size() * extent);
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    let tint = Color32::WHITE.gamma_multiply(OPACITY);
    let painter = ctx.layer_painter(LayerId::background()).with_clip_rect(picture.area);
    painter.image(texture.id(), place, whole, tint);
}

/// Errors belong to single cells and are not interpolated; costs are samples of a smooth function, so they are.
fn options(kind: MapChoice) -> TextureOptions {
    if kind == MapChoice::Cost { TextureOptions::LINEAR } else { TextureOptions::NEAREST }
}

fn image(map: &FalseColorMap) -> ColorImage {
    let color = |value: &f64| {
        let [r, g, b] = palette::color(map.scale.position(*value));
        Color32::from_rgb(r, g, b)
    };
    ColorImage::new(map.grid, map.values.iter().map(color).collect())
}

fn legend(ui: &mut Ui, picture: PictureArea, map: &FalseColorMap) {
    let title = match map.kind {
        MapChoice::Cost => "Time of a path, µs",
        MapChoice::Difference => "Relative difference of luminance",
        MapChoice::Flip => "FLIP: what is noticed",
        MapChoice::Error | MapChoice::None => "Relative error of 8×8 pixels",
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
    let words = |value: f64| figure(map.kind, value);
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
    if let Some((value, share)) = under_pointer(ui.ctx(), picture, map) {
        let mut line = format!("here {}", words(value));
        if let Some(share) = share {
            line += &format!(", {} of the time", percent(share));
        }
        ui.label(egui::RichText::new(line).small().color(style::DIM));
    } else if let Some(line) = range(&map.shares) {
        ui.label(egui::RichText::new(line).small().color(style::DIM));
    }
}

/// Range of the regions' shares of time, without the lowest and highest 2 %, which may be noise.
fn range(shares: &[f64]) -> Option<String> {
    let mut known: Vec<f64> = shares.iter().copied().filter(|share| *share > 0.0).collect();
    known.sort_by(f64::total_cmp);
    let last = known.len().checked_sub(1)?;
    let [least, most] = [known[last / 50], known[last - last / 50]].map(percent);
    Some(format!("regions take {}–{most} of the time", least.trim_end_matches(" %")))
}

/// Value and share of the cell under the pointer.
fn under_pointer(ctx: &Context, picture: PictureArea, map: &FalseColorMap) -> Option<(f64, Option<f64>)> {
    let at = ctx.pointer_latest_pos()?;
    if !picture.area.contains(at) || ctx.layer_id_at(at).is_some_and(|layer| layer.order != Order::Background)
    {
        return None;
    }
    let place = (at - picture.whole().min) / picture.whole().size();
    let cell = |place: f32, i: usize| {
        ((f64::from(place) * map.cells[i]) as usize).min(map.grid[i].saturating_sub(1))
    };
    let i = cell(place.y, 1) * map.grid[0] + cell(place.x, 0);
    let value = map.values.get(i).filter(|value| value.is_finite())?;
    Some((*value, map.shares.get(i).copied()))
}

fn figure(kind: MapChoice, value: f64) -> String {
    match kind {
        MapChoice::Cost => format!("{} µs", significant(value)),
        MapChoice::Flip => significant(value),
        _ => percent(value),
    }
}

fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share))
}

/// Writes two significant digits.
fn significant(value: f64) -> String {
    let decimals = match value {
        v if v >= 9.95 || v == 0.0 => 0,
        v if v >= 0.995 => 1,
        v if v >= 0.0995 => 2,
        _ => 3,
    };
    trimmed(value, decimals)
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
        assert_eq!(figure(MapChoice::Cost, 1.25), "1.2 µs");
        assert_eq!(figure(MapChoice::Error, 0.2), "20 %");
        let shares = [0.0, 0.000_52, 0.0013];
        assert_eq!(range(&shares).as_deref(), Some("regions take 0.052–0.13 % of the time"));
        assert_eq!(range(&[0.0]), None);
    }

    #[test]
    fn pictures_of_maps_have_their_colours() {
        let map = FalseColorMap {
            grid: [2, 1],
            values: vec![0.0, f64::NAN],
            scale: crate::client::window::panel::data::ColorScale { low: 0.0, high: 1.0, logarithmic: false },
            ..FalseColorMap::default()
        };
        let [r, g, b] = palette::NOTHING;
        let image = image(&map);
        assert_eq!((image.size, image.pixels[1]), ([2, 1], Color32::from_rgb(r, g, b)));
    }
}
