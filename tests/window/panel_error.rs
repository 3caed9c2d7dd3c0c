//! The error in the panel: the plot and its text, the target, maps with their legends.

use std::sync::Arc;

use crate::headless_panel::{Panel, controls, picture, place, readout, texts};
use egui::epaint::ClippedShape;
use egui::{Event, Shape, TextureId, pos2, vec2};
use pointillist::client::window::panel::{
    ColorScale, ErrorSummary, FalseColorMap, MapChoice, PanelData, PictureOverlay,
};

const SIZE: [f32; 2] = [800.0, 1600.0];

fn known() -> ErrorSummary {
    let curve = |t: f64| [t, 0.2 * t.powf(-0.6)];
    let word = |value: &str, interval: &str| [value.to_owned(), interval.to_owned()];
    ErrorSummary {
        quantiles: Some([
            word("1.10 %", "1.05–1.16 %"),
            word("2.31 %", "2.19–2.44 %"),
            word("3.40 %", "3.11–3.72 %"),
        ]),
        filtered: Some("0.91 % (0.84–0.99 %) through the noise filter".into()),
        checkpoints: (0..16).map(|i| curve(0.6 * 1.25f64.powi(i))).collect(),
        fit: (0..20).map(|i| curve(3.0 * 1.25f64.powi(i))).collect(),
        prediction: Some([62.0, 56.0, 75.0]),
        warning: None,
        unfound: None,
        message: "1 % in about 42 s (90 %: 36–55 s)".into(),
        seconds: 20.0,
        compared: Vec::new(),
    }
}

fn with(error: ErrorSummary) -> PanelData {
    PanelData { error: Some(Arc::new(error)), selection: None, ..readout() }
}

fn says(shapes: &[ClippedShape], what: &str) -> bool {
    texts(shapes).iter().any(|(text, _)| text.contains(what))
}

#[test]
fn error_curve_and_prediction_are_told() {
    let (mut controls, mut panel) = (controls(), Panel::new(SIZE));
    let shapes = panel.settle(&with(known()), &mut controls);
    for what in [
        "2.31 %",
        "or less in 95 % (90 %: 2.19–2.44 %)",
        "median 1.10 % (1.05–1.16 %)",
        "99 % 3.40 %",
        "0.91 % (0.84–0.99 %) through the noise filter",
        "1 % in about 42 s (90 %: 36–55 s)",
        "1 s",
        "10 s",
        "1 min",
        "10 %",
    ] {
        assert!(says(&shapes, what), "no {what:?} among {:?}", texts(&shapes));
    }
    picture(&mut panel, "error.png", shapes);
    // Nothing known yet, and nothing to be known.
    let early = ErrorSummary {
        message: "not known yet: after 4 samples per pixel".into(),
        ..ErrorSummary::default()
    };
    let shapes = Panel::new(SIZE).settle(&with(early), &mut controls);
    assert!(says(&shapes, "error not known yet: after 4 samples per pixel") && !says(&shapes, "2.31 %"));
    let shapes = Panel::new(SIZE).settle(&readout(), &mut controls);
    assert!(says(&shapes, "one randomisation only"));
}

#[test]
fn the_target_is_chosen() {
    let (readout, mut controls, mut panel) = (with(known()), controls(), Panel::new(SIZE));
    let shapes = panel.settle(&readout, &mut controls);
    assert_eq!(controls.target, 0.01, "and stays what it is");
    panel.click(place(&shapes, "Target") + vec2(50.0, 0.0), &readout, &mut controls);
    let open = panel.settle(&readout, &mut controls);
    panel.click(place(&open, "0.5 %"), &readout, &mut controls);
    assert_eq!(controls.target, 0.005);
}

#[test]
fn hostile_errors_are_shown_without_a_panic() {
    let odd = [f64::NAN, f64::INFINITY, -1.0, 0.0, 1e300, 1e-300];
    for a in odd {
        for b in odd {
            let error = ErrorSummary {
                checkpoints: vec![[a, b], [b, a]],
                fit: vec![[a, a], [b, b]],
                prediction: Some([a, b, a]),
                seconds: b,
                ..known()
            };
            Panel::new([512.0, 512.0]).settle(&with(error), &mut controls());
        }
    }
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
