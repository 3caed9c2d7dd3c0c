//! The tab of the inspector: the pixel under the pointer, and the paths of the pixel that was clicked at.

use std::sync::Arc;

use egui::{Color32, Context, Grid, LayerId, Rect, Sense, Shape, Stroke, Ui, vec2};
use egui_plot::{Line, PlotPoints};
use glam::DVec2;

use crate::client::window::panel::{PictureArea, still_plot, style, trimmed};

/// Pixels that the loupe shows on each side of the central one.
pub const LOUPE: u32 = 5;

/// Size of a pixel in the loupe, points.
const LOUPE_PIXEL: f32 = 11.0;

/// Colour of vertices in media, and the radius of their dots, points.
const SCATTERED: Color32 = Color32::from_rgb(170, 235, 140);
const SCATTERING_RADIUS: f32 = 2.5;

/// Bins of a spectrum.
pub const SPECTRUM_BINS: usize = 30;

/// Range of wavelengths of a spectrum, nm. Outside, the eye sees next to nothing, and paths rarely have such wavelengths.
pub const WAVELENGTHS: [f64; 2] = [400.0, 700.0];

/// Values at one pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PixelReading {
    /// The pixel.
    pub pixel: [u32; 2],
    /// Scene-linear X, Y, Z before the tone curve.
    pub xyz: [f32; 3],
    /// Exposed luminance in stops relative to middle grey; `None` for black.
    pub stops: Option<f32>,
    /// Displayed R, G, B, 0 … 1.
    pub displayed: [f32; 3],
    /// Sum of weights of the camera samples; their number if the splat filter is a box.
    pub samples: f64,
    /// Relative error of the surrounding 8×8 pixels, once known.
    pub error: Option<f64>,
    /// Level of detail of camera and light stream, `None` without samples.
    pub lods: [Option<f32>; 2],
    /// Visible object; `None` for the environment.
    pub object: Option<String>,
    /// Its material.
    pub material: Option<String>,
    /// Distance from the camera, in scene units.
    pub distance: Option<f64>,
    /// Displayed colours of the surrounding square, (2 · [`LOUPE`] + 1)², row-major; `None` outside the picture.
    pub loupe: Vec<Option<[u8; 3]>>,
}

/// Paths that contributed to a pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PixelPaths {
    /// The pixel.
    pub pixel: [u32; 2],
    /// Number of camera paths through the pixel whose samples are retained.
    pub known: u64,
    /// Number of these that were traced again.
    pub traced: usize,
    /// Number of traced paths that found light.
    pub lit: usize,
    /// Note on missing paths, with the reason; empty if none are missing.
    pub note: &'static str,
    /// Mean spectral radiance in [`SPECTRUM_BINS`] bins over [`WAVELENGTHS`], relative to the radiance 1 with Y = 1; empty in a scene
    /// without colour.
    pub spectrum: Vec<f64>,
    /// Line segments of the brightest paths.
    pub segments: Vec<PathSegment>,
    /// Where these are scattered in media.
    pub scatterings: Vec<[f32; 2]>,
    /// Names of these media, and how often paths are scattered in each.
    pub media: Vec<(String, usize)>,
}

/// Kind of a path segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SegmentKind {
    /// A segment of a camera path.
    Path,
    /// A connection to a light, or to a light path.
    Light,
}

/// A segment of a path. Positions are pixels of the picture, possibly outside of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathSegment {
    /// Start of the segment.
    pub from: [f32; 2],
    /// End of the segment.
    pub to: [f32; 2],
    /// Kind of segment.
    pub kind: SegmentKind,
}

/// Draws the tab.
pub fn show(ui: &mut Ui, reading: Option<&PixelReading>, paths: Option<&Arc<PixelPaths>>, busy: bool) {
    match reading {
        Some(reading) => figures(ui, reading),
        None => {
            _ = ui.colored_label(style::DIM, "Point at the picture to read a pixel, click to see its paths.")
        }
    }
    ui.separator();
    match paths {
        _ if busy => _ = ui.colored_label(style::DIM, "tracing the paths of the pixel again …"),
        Some(paths) => path_figures(ui, paths),
        None => _ = ui.colored_label(style::DIM, "No pixel was clicked at since the last change."),
    }
}

fn figures(ui: &mut Ui, reading: &PixelReading) {
    loupe(ui, &reading.loupe);
    let three = |values: [f32; 3], decimals: usize| values.map(|v| format!("{v:.decimals$}")).join("  ");
    let lod = |lod: Option<f32>| lod.map_or("–".to_owned(), |lod| format!("{lod:.2}"));
    Grid::new("pixel").num_columns(2).min_col_width(96.0).spacing([8.0, 1.0]).show(ui, |ui| {
        let mut line = |name: &str, value: String| {
            ui.colored_label(style::DIM, name);
            ui.colored_label(style::BRIGHT, value);
            ui.end_row();
        };
        line("Pixel", format!("{}, {}", reading.pixel[0], reading.pixel[1]));
        let stops =
            reading.stops.map_or(String::new(), |stops| format!(", {stops:+.1} stops from middle grey"));
        line("Luminance", significant(reading.xyz[1]) + &stops);
        line("X Y Z", reading.xyz.map(significant).join("  "));
        line("Displayed", three(reading.displayed.map(|c| c * 255.0), 0));
        line("Samples", format!("{:.1} of the camera", reading.samples));
        line(
            "Relative error",
            reading.error.map_or("–".to_owned(), |e| format!("{} %", trimmed(100.0 * e, 2))),
        );
        line("Level of detail", format!("{} camera, {} light", lod(reading.lods[0]), lod(reading.lods[1])));
        line("Object", reading.object.clone().unwrap_or_else(|| "environment".to_owned()));
        if let Some(material) = &reading.material {
            line("Material", material.clone());
        }
        if let Some(distance) = reading.distance {
            line("Distance", significant(distance as f32));
        }
    });
}

/// Four significant digits.
fn significant(value: f32) -> String {
    let magnitude = value.abs();
    match magnitude {
        0.0 => "0".to_owned(),
        m if !(1e-4..1e5).contains(&m) => format!("{value:.3e}"),
        m => format!("{value:.*}", (3 - m.log10().floor() as i32).clamp(0, 7) as usize),
    }
}

/// Draws the pixels around the pointer as squares.
fn loupe(ui: &mut Ui, pixels: &[Option<[u8; 3]>]) {
    let side = 2 * LOUPE as usize + 1;
    if pixels.len() != side * side {
        return;
    }
    let size = vec2(side as f32, side as f32) * LOUPE_PIXEL;
    let (place, _) = ui.allocate_exact_size(size, Sense::hover());
    let square = |i: usize| {
        let corner = vec2((i % side) as f32, (i / side) as f32) * LOUPE_PIXEL;
        Rect::from_min_size(place.min + corner, vec2(LOUPE_PIXEL, LOUPE_PIXEL))
    };
    let painter = ui.painter();
    for (i, pixel) in pixels.iter().enumerate() {
        let color = pixel.map_or(Color32::TRANSPARENT, |[r, g, b]| Color32::from_rgb(r, g, b));
        painter.rect_filled(square(i).shrink(0.5), 0.0, color);
    }
    let middle = square(side * side / 2);
    painter.rect_stroke(middle, 0.0, Stroke::new(1.0, style::ACCENT), egui::StrokeKind::Outside);
}

fn path_figures(ui: &mut Ui, paths: &PixelPaths) {
    let PixelPaths { pixel, known, traced, lit, note, spectrum, media, .. } = paths;
    ui.colored_label(
        style::BRIGHT,
        format!("Pixel {}, {}: {known} paths from the camera", pixel[0], pixel[1]),
    );
    if *traced > 0 {
        ui.colored_label(
            style::DIM,
            format!("{traced} traced again, {lit} of them found light; the brightest are drawn"),
        );
    }
    for (medium, count) in media {
        let times = if *count == 1 { "once".to_owned() } else { format!("{count} times") };
        ui.colored_label(SCATTERED, format!("● scattered in {medium}, {times}"));
    }
    if !note.is_empty() {
        ui.colored_label(style::DIM, *note);
    }
    if spectrum.is_empty() {
        return;
    }
    ui.colored_label(style::DIM, "Mean spectral radiance of further paths, 400 to 700 nm");
    let [first, last] = WAVELENGTHS;
    let middle = |i: usize| first + (last - first) * (i as f64 + 0.5) / spectrum.len() as f64;
    let points: PlotPoints<'_> = spectrum.iter().enumerate().map(|(i, v)| [middle(i), *v]).collect();
    let top = spectrum.iter().copied().fold(1e-12, f64::max) * 1.1;
    still_plot("spectrum", 80.0)
        .show_axes([true, false])
        .show_grid([true, false])
        .default_x_bounds(first, last)
        .show(ui, |plot| {
            plot.set_plot_bounds_y(0.0..=top);
            plot.line(Line::new("radiance", points).color(style::BRIGHT).width(1.5));
        });
}

/// Draws the paths over the picture.
pub fn draw_paths(ctx: &Context, picture: PictureArea, paths: &PixelPaths) {
    let painter = ctx.layer_painter(LayerId::background()).with_clip_rect(picture.area);
    let point = |[x, y]: [f32; 2]| picture.point(DVec2::new(f64::from(x), f64::from(y)));
    for segment in &paths.segments {
        let color = match segment.kind {
            SegmentKind::Path => Color32::from_rgba_unmultiplied(90, 200, 255, 150),
            SegmentKind::Light => Color32::from_rgba_unmultiplied(255, 220, 110, 110),
        };
        painter.add(Shape::line_segment([point(segment.from), point(segment.to)], Stroke::new(1.0, color)));
    }
    for place in &paths.scatterings {
        painter.circle_filled(point(*place), SCATTERING_RADIUS, SCATTERED);
    }
    let corner = |x: u32, y: u32| picture.point(DVec2::new(f64::from(x), f64::from(y)));
    let [x, y] = paths.pixel;
    let pixel = Rect::from_min_max(corner(x, y), corner(x + 1, y + 1)).expand(2.0);
    painter.rect_stroke(pixel, 0.0, Stroke::new(1.0, style::ACCENT), egui::StrokeKind::Outside);
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::*;

    #[test]
    fn the_pixel_is_told() {
        let reading = PixelReading {
            pixel: [12, 34],
            xyz: [0.123_456, 2.5, 0.0],
            stops: Some(3.66),
            displayed: [1.0, 0.5, 0.0],
            samples: 64.0,
            error: Some(0.0231),
            object: Some("ball".to_owned()),
            material: Some("gold (roughconductor)".to_owned()),
            distance: Some(3.25),
            ..PixelReading::default()
        };
        let media = vec![("medium \"fog\"".to_owned(), 37), ("medium \"smoke\"".to_owned(), 1)];
        let paths = Arc::new(PixelPaths { media, ..PixelPaths::default() });
        let mut harness = Harness::new_ui(|ui| show(ui, Some(&reading), Some(&paths), false));
        harness.run_steps(2);
        harness.get_by_label("● scattered in medium \"fog\", 37 times");
        harness.get_by_label("● scattered in medium \"smoke\", once");
        for words in
            ["12, 34", "0.1235  2.500  0", "255  128  0", "2.31 %", "ball", "gold (roughconductor)", "3.250"]
        {
            harness.get_by_label(words);
        }
    }
}
