//! Maps over the picture, with their legends.

use std::sync::Arc;

use crate::headless_panel::{Panel, controls, readout, texts};
use egui::epaint::ClippedShape;
use egui::{Event, Shape, TextureId, pos2};
use pointillist::client::window::panel::{ColorScale, FalseColorMap, MapChoice, PanelData, PictureOverlay};

fn says(shapes: &[ClippedShape], what: &str) -> bool {
    texts(shapes).iter().any(|(text, _)| text.contains(what))
}

fn map(kind: MapChoice) -> Arc<FalseColorMap> {
    let values: Vec<f64> = (0..12).map(|i| 0.002 * 1.5f64.powi(i)).collect();
    let shares = if kind == MapChoice::Cost { vec![1.0 / 12.0; 12] } else { Vec::new() };
    let scale = ColorScale { low: 0.002, high: 0.2, logarithmic: true };
    Arc::new(FalseColorMap { kind, grid: [4, 3], cells: [3.5, 3.0], values, scale, shares })
}

/// Rectangles of the texture of a map.
fn maps(shapes: &[ClippedShape]) -> Vec<egui::Rect> {
    let of = |shape: &ClippedShape| match &shape.shape {
        Shape::Rect(rect) if rect.fill_texture_id() != TextureId::default() => Some(rect.rect),
        Shape::Mesh(mesh) if mesh.texture_id != TextureId::default() => Some(mesh.calc_bounds()),
        _ => None,
    };
    shapes.iter().filter_map(of).collect()
}

#[test]
fn maps_lie_over_the_picture_with_a_legend() {
    let (mut controls, mut panel) = (controls(), Panel::new([800.0, 600.0]));
    assert!(maps(&panel.settle(&readout(), &mut controls)).is_empty());
    // Also without the panel.
    for visible in [true, false] {
        controls.layout.is_open = visible;
        let width = 800.0 - controls.layout.width_in(800.0);
        let shown = PanelData { overlay: PictureOverlay::Map(map(MapChoice::Error)), ..readout() };
        let shapes = panel.settle(&shown, &mut controls);
        let [rect] = maps(&shapes)[..] else { panic!("one map") };
        // The last column hangs over.
        assert!((rect.width() - width * 4.0 / 3.5).abs() < 0.1 && (rect.height() - 600.0).abs() < 0.1);
        for what in ["Relative error of 8×8 pixels", "0.2 %", "2 %", "20 %"] {
            assert!(says(&shapes, what), "no {what:?} among {:?}", texts(&shapes));
        }
    }
    let shown = PanelData { overlay: PictureOverlay::Map(map(MapChoice::Cost)), ..readout() };
    panel.frame(vec![Event::PointerMoved(pos2(790.0, 590.0))], &shown, &mut controls);
    let shapes = panel.frame(vec![], &shown, &mut controls).1;
    assert!(
        says(&shapes, "Time of a path, µs") && says(&shapes, "8.3 % of the time"),
        "{:?}",
        texts(&shapes)
    );
    let why = "no cost map: paths do not start at the picture";
    let shown = PanelData { overlay: PictureOverlay::Missing(why.into()), ..readout() };
    let shapes = panel.settle(&shown, &mut controls);
    assert!(says(&shapes, why) && maps(&shapes).is_empty());
}

#[test]
fn the_legend_stays_within_windows_of_any_size() {
    for size in [[512.0, 512.0], [320.0, 200.0], [90.0, 60.0], [40.0, 30.0], [0.0, 0.0]] {
        for overlay in [
            PictureOverlay::Map(map(MapChoice::Cost)),
            PictureOverlay::Missing("no cost map: why not".into()),
        ] {
            let (mut controls, mut panel) = (controls(), Panel::new(size));
            controls.layout.is_open = false;
            for shape in panel.settle(&PanelData { overlay, ..readout() }, &mut controls) {
                let seen = shape.clip_rect.intersect(shape.shape.visual_bounding_rect());
                let inside =
                    seen.left() >= -0.5 && seen.right() <= size[0] + 0.5 && seen.bottom() <= size[1] + 0.5;
                assert!(!seen.is_positive() || inside, "{size:?}: {seen:?}");
            }
        }
    }
}
