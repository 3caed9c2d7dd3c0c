//! The panel without a window: it leaves untouched values alone, its buttons do what they say, and it fits small windows.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

use std::time::Duration;

use egui::{Event, Modifiers, PointerButton, Pos2, RawInput, Rect, Shape, pos2, vec2};
use pointillist::client::settings::{
    Adaptation, Dither, FilmCounts, Glare, Masking, Output, Reconstruction, Settings, SplatFilter, ToneCurve,
    View,
};
use pointillist::client::window::panel::{
    self, Action, Controls, Effect, Parameter, Readout, Selection, Value,
};
use pointillist::color::Profile;

fn readout() -> Readout {
    Readout {
        device: "llvmpipe (LLVM 15.0.6, 256 bits)".into(),
        method: "path",
        reason: "auto: path — 80 % of what is seen arrives with one bounce or none".into(),
        plan: "processor shared: 1 tracer thread, display 50 %".into(),
        extent: [512, 512],
        detail: 2,
        counts: FilmCounts {
            camera_samples: 12_345_678,
            light_samples: 23_456,
            camera_paths: 1,
            light_paths: 345_678,
        },
        texels: 270_000,
        traced_per_second: 1.234e6,
        rasterised_per_second: 0.99e6,
        lods: [Some(1.25), None],
        ring: (12, 64),
        passes: vec![
            ("splat", 3.1),
            ("mips", 0.7),
            ("variance", 1.1),
            ("reconstruct", 5.2),
            ("tonemap", 0.9),
        ],
        frames: (0..240).map(|i| 14.0 + 4.0 * (i as f32 * 0.7).sin()).collect(),
        percentiles: [14.2, 17.8, 18.0],
        budget: Duration::from_micros(16_667),
        edit_latency: Some(Duration::from_millis(31)),
        edit_latency_p95: Some(Duration::from_millis(48)),
        threads: 1,
        elapsed: Duration::from_secs_f64(12.3),
        message: None,
        selection: Some(Selection {
            name: "shape \"light\"".into(),
            selected: true,
            parameters: vec![
                Parameter { label: "emission".into(), value: Value::Scale(1.7) },
                Parameter { label: "reflectance".into(), value: Value::Color([0.123_456, 0.5, 0.000_1]) },
                Parameter {
                    label: "interior index".into(),
                    value: Value::Number { value: 1.504_6, min: 1.0, max: 3.0 },
                },
            ],
        }),
        effects: vec![
            Effect { name: "dispersion", on: true, reason: "glass".into(), can_switch: true },
            Effect { name: "glare", on: false, reason: "--glare off".into(), can_switch: false },
        ],
        left_out: vec!["lens"],
        camera: "at 278 273 −800, to 278 273 −799".into(),
        fov: 39.307_7,
    }
}

fn controls() -> Controls {
    Controls {
        settings: Settings::default(),
        filter: SplatFilter::default(),
        own_profile: None,
        visible: true,
        help: false,
    }
}

/// A context that is shown frame after frame.
struct Panel {
    context: egui::Context,
    size: [f32; 2],
    time: f64,
}

impl Panel {
    fn new(size: [f32; 2]) -> Self {
        Self { context: egui::Context::default(), size, time: 0.0 }
    }

    fn frame(
        &mut self,
        events: Vec<Event>,
        readout: &Readout,
        controls: &mut Controls,
    ) -> (Vec<Action>, Vec<egui::epaint::ClippedShape>) {
        self.time += 0.02;
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, self.size.into()));
        let input = RawInput { screen_rect, time: Some(self.time), events, ..RawInput::default() };
        let mut actions = Vec::new();
        let output = self.context.run_ui(input, |ui| actions.extend(panel::show(ui, readout, controls)));
        let shapes = output.shapes.clone();
        output.drop_without_applying_deltas();
        (actions, shapes)
    }

    fn settle(&mut self, readout: &Readout, controls: &mut Controls) -> Vec<egui::epaint::ClippedShape> {
        for _ in 0..3 {
            let (actions, _) = self.frame(vec![], readout, controls);
            assert_eq!(actions, []);
        }
        self.frame(vec![], readout, controls).1
    }

    fn click(&mut self, at: Pos2, readout: &Readout, controls: &mut Controls) -> Vec<Action> {
        let button = |pressed| Event::PointerButton {
            pos: at,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        let mut actions = self.frame(vec![Event::PointerMoved(at)], readout, controls).0;
        actions.extend(self.frame(vec![button(true)], readout, controls).0);
        actions.extend(self.frame(vec![button(false)], readout, controls).0);
        self.frame(vec![Event::PointerGone], readout, controls);
        self.time += 1.0;
        actions
    }
}

/// The panel over a grey picture, by a plain rasteriser: set `POINTILLIST_PANEL_PICTURES` to a folder to look at it.
fn picture(panel: &mut Panel, name: &str, shapes: Vec<egui::epaint::ClippedShape>) {
    let Some(folder) = std::env::var_os("POINTILLIST_PANEL_PICTURES") else { return };
    let font = panel.context.fonts(|fonts| fonts.image());
    let [width, height] = panel.size.map(|s| s as usize);
    let mut rgb = vec![[70.0_f32; 3]; width * height];
    for primitive in panel.context.tessellate(shapes, 1.0) {
        let egui::epaint::Primitive::Mesh(mesh) = primitive.primitive else { continue };
        for corner in mesh.indices.as_chunks::<3>().0 {
            let [a, b, c] = corner.map(|i| mesh.vertices[i as usize]);
            let area = (b.pos - a.pos).rot90().dot(c.pos - a.pos);
            let bounds = Rect::from_points(&[a.pos, b.pos, c.pos]).intersect(primitive.clip_rect);
            let columns =
                bounds.left().max(0.0) as usize..(bounds.right().ceil().max(0.0) as usize).min(width);
            let rows = bounds.top().max(0.0) as usize..(bounds.bottom().ceil().max(0.0) as usize).min(height);
            for (x, y) in rows.flat_map(|y| columns.clone().map(move |x| (x, y))) {
                let p = pos2(x as f32 + 0.5, y as f32 + 0.5);
                let edge = |u: Pos2, v: Pos2| (v - u).rot90().dot(p - u) / area;
                let [wa, wb, wc] = [edge(b.pos, c.pos), edge(c.pos, a.pos), edge(a.pos, b.pos)];
                if area == 0.0 || wa < 0.0 || wb < 0.0 || wc < 0.0 || !primitive.clip_rect.contains(p) {
                    continue;
                }
                let uv = wa * a.uv.to_vec2() + wb * b.uv.to_vec2() + wc * c.uv.to_vec2();
                let [tx, ty] =
                    [(uv.x * font.width() as f32) as usize, (uv.y * font.height() as f32) as usize];
                let texel = font[(tx.min(font.width() - 1), ty.min(font.height() - 1))].to_array();
                let mix = |k: usize| {
                    let color =
                        wa * f32::from(a.color[k]) + wb * f32::from(b.color[k]) + wc * f32::from(c.color[k]);
                    color * f32::from(texel[k]) / 255.0
                };
                let over = 1.0 - mix(3) / 255.0;
                let at = &mut rgb[y * width + x];
                *at = [0, 1, 2].map(|k| at[k] * over + mix(k));
            }
        }
    }
    let file = std::fs::File::create(std::path::Path::new(&folder).join(name)).unwrap();
    let mut encoder = png::Encoder::new(file, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    let bytes: Vec<u8> = rgb.iter().flatten().map(|v| v.clamp(0.0, 255.0) as u8).collect();
    encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
}

#[test]
fn pictures_on_demand() {
    for (size, help) in
        [([512.0, 512.0], false), ([1280.0, 720.0], false), ([640.0, 1150.0], false), ([512.0, 512.0], true)]
    {
        let (readout, mut controls, mut panel) = (readout(), controls(), Panel::new(size));
        controls.help = help;
        let shapes = panel.settle(&readout, &mut controls);
        picture(
            &mut panel,
            &format!("panel-{}x{}{}.png", size[0], size[1], if help { "-help" } else { "" }),
            shapes,
        );
    }
}

fn texts(shapes: &[egui::epaint::ClippedShape]) -> Vec<(String, Rect)> {
    fn walk(shape: &Shape, found: &mut Vec<(String, Rect)>) {
        match shape {
            Shape::Text(text) => found.push((text.galley.text().to_owned(), text.visual_bounding_rect())),
            Shape::Vec(shapes) => shapes.iter().for_each(|s| walk(s, found)),
            _ => {}
        }
    }
    let mut found = Vec::new();
    shapes.iter().for_each(|s| walk(&s.shape, &mut found));
    found
}

fn place(shapes: &[egui::epaint::ClippedShape], text: &str) -> Pos2 {
    let all = texts(shapes);
    all.iter().find(|(t, _)| t == text).unwrap_or_else(|| panic!("no {text:?} among {all:?}")).1.center()
}

#[test]
fn buttons_do_what_they_say() {
    let (readout, mut controls, mut panel) = (readout(), controls(), Panel::new([800.0, 1600.0]));
    let shapes = panel.settle(&readout, &mut controls);
    let cases = [
        ("Undo", Action::Undo),
        ("Redo", Action::Redo),
        ("Reset", Action::ResetCamera),
        ("PNG", Action::SavePng),
        ("EXR", Action::SaveExr),
        ("Scene", Action::SaveScene),
        ("Copy command", Action::CopyCommand),
        ("Deselect", Action::Deselect),
    ];
    for (text, action) in cases {
        let at = place(&shapes, text);
        assert_eq!(panel.click(at, &readout, &mut controls), [action], "{text}");
    }
    // Folded at first. What can be left out has a switch, what cannot has none.
    panel.click(place(&shapes, "Effects"), &readout, &mut controls);
    let open = panel.settle(&readout, &mut controls);
    place(&open, "without lens");
    let switched = Action::SetEffect { name: "dispersion", on: false };
    assert_eq!(panel.click(place(&open, "dispersion"), &readout, &mut controls), [switched]);
    assert_eq!(panel.click(place(&open, "glare"), &readout, &mut controls), []);
    panel.click(place(&open, "Effects"), &readout, &mut controls);
    let shapes = panel.settle(&readout, &mut controls);
    assert_eq!(panel.click(place(&shapes, "Keys"), &readout, &mut controls), []);
    assert!(controls.help);
    controls.help = false;
    panel.settle(&readout, &mut controls);
    panel.click(place(&shapes, "Hide"), &readout, &mut controls);
    assert!(!controls.visible);
    assert!(texts(&panel.frame(vec![], &readout, &mut controls).1).is_empty(), "hidden means hidden");
}

#[test]
fn choices_and_resets_change_the_settings() {
    let (readout, mut controls, mut panel) = (readout(), controls(), Panel::new([800.0, 1600.0]));
    let shapes = panel.settle(&readout, &mut controls);
    let name = place(&shapes, "Tone curve");
    panel.click(name + vec2(110.0, 0.0), &readout, &mut controls);
    let open = panel.settle(&readout, &mut controls);
    panel.click(place(&open, "AgX"), &readout, &mut controls);
    assert_eq!(controls.settings.curve, ToneCurve::AgX);
    // Two clicks on the name: the default.
    panel.click(name, &readout, &mut controls);
    panel.time -= 0.95;
    panel.click(name, &readout, &mut controls);
    assert_eq!(controls.settings, Settings::default());
    // A click into the slider of C changes it, and nothing else.
    let c = place(&shapes, "Contrast C");
    panel.click(pos2(name.x + 150.0, c.y), &readout, &mut controls);
    assert_ne!(controls.settings.contrast, 1.0);
    assert_eq!(controls.settings, Settings { contrast: controls.settings.contrast, ..Settings::default() });
}

#[test]
fn untouched_values_stay_bit_for_bit() {
    let mut state = 7u64;
    let mut next = |n: u64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) % n
    };
    for round in 0..60 {
        let mut float = |reach: f32| next(1 << 20) as f32 / (1 << 20) as f32 * reach;
        let settings = Settings {
            // Beyond what the sliders reach, too: the command line allows it.
            vm: float(40.0),
            exposure: float(5.0).powi(6) + 1e-7,
            contrast: float(9.0),
            gamma: float(9.0),
            glare: (round % 2 == 0)
                .then(|| Glare { adaptation: Adaptation::Scotopic, view_angle: float(200.0) }),
            view: [View::Picture, View::CameraVariance, View::LightVariance][round % 3],
            masking: [Masking::LowPass, Masking::Bilateral][round % 2],
            reconstruction: [Reconstruction::CatmullRom, Reconstruction::Mipmap, Reconstruction::None]
                [round % 3],
            curve: [ToneCurve::AgX, ToneCurve::PbrNeutral][round % 2],
            profile: Profile {
                name: if round % 4 == 0 { "mine.icc" } else { "rec2020" }.to_string(),
                ..Profile::srgb()
            },
            dither: [Dither::Ordered, Dither::BlueNoise][round % 2],
            output: [Output::Sdr, Output::ScRgb, Output::Hdr10][round % 3],
        };
        let mut controls = Controls {
            settings: settings.clone(),
            filter: SplatFilter::Tent,
            own_profile: None,
            visible: true,
            help: round % 5 == 0,
        };
        let mut panel = Panel::new([700.0, 1500.0]);
        // settle() also asserts that no action, thus no edit of the selection or the field of view, comes by itself.
        panel.settle(&readout(), &mut controls);
        panel.frame(vec![Event::PointerMoved(pos2(150.0, 20.0 * round as f32))], &readout(), &mut controls);
        assert_eq!(controls.settings, settings);
        assert_eq!(controls.settings.exposure.to_bits(), settings.exposure.to_bits());
        assert_eq!(controls.filter, SplatFilter::Tent);
    }
}

/// Also while the panel is hidden, and only within the window.
#[test]
fn messages_stand_over_the_picture() {
    let mut controls = Controls { visible: false, ..controls() };
    for (size, seen) in [([512.0, 512.0], true), ([320.0, 200.0], true), ([40.0, 30.0], false)] {
        let mut panel = Panel::new(size);
        let said = Readout { message: Some("saved cornell-001.png".into()), ..readout() };
        let shapes = panel.settle(&said, &mut controls);
        assert_eq!(texts(&shapes).iter().any(|(text, _)| text.contains("cornell-001")), seen, "{size:?}");
        for shape in shapes {
            let at = shape.clip_rect.intersect(shape.shape.visual_bounding_rect());
            assert!(
                !at.is_positive() || (at.right() <= size[0] + 0.5 && at.bottom() <= size[1] + 0.5),
                "{at:?}"
            );
        }
        assert!(texts(&panel.settle(&readout(), &mut controls)).is_empty(), "and it goes away");
    }
}

#[test]
fn it_stays_within_windows_of_any_size() {
    for size in [[512.0, 512.0], [1280.0, 720.0], [320.0, 200.0], [40.0, 30.0], [1.0, 1.0], [0.0, 0.0]] {
        let (readout, mut controls, mut panel) = (readout(), controls(), Panel::new(size));
        let shapes = panel.settle(&readout, &mut controls);
        for shape in &shapes {
            // An empty text has no bounds.
            if matches!(&shape.shape, Shape::Text(text) if text.galley.text().is_empty()) {
                continue;
            }
            let seen = shape.clip_rect.intersect(shape.shape.visual_bounding_rect());
            let inside = !seen.is_positive()
                || (seen.right() <= size[0].min(320.0) + 0.5 && seen.bottom() <= size[1] + 0.5);
            assert!(inside, "{size:?}: {seen:?}");
        }
        assert_eq!(texts(&shapes).is_empty(), size[0] < 60.0, "{size:?}");
        controls.help = true;
        panel.settle(&readout, &mut controls);
    }
}

#[test]
fn it_is_cheap_and_its_figures_settle() {
    let (mut readout, mut controls, mut panel) = (readout(), controls(), Panel::new([1280.0, 720.0]));
    let shapes = panel.settle(&readout, &mut controls);
    let triangles: usize = panel
        .context
        .tessellate(shapes, 1.0)
        .iter()
        .map(|p| match &p.primitive {
            egui::epaint::Primitive::Mesh(mesh) => mesh.indices.len() / 3,
            egui::epaint::Primitive::Callback(_) => 0,
        })
        .sum();
    assert!(triangles < 10_000, "{triangles}");
    panel.time += 1.0;
    panel.settle(&readout, &mut controls);
    readout.traced_per_second = 9.87e6;
    panel.time += 1.0;
    let rate = |shapes: &[egui::epaint::ClippedShape]| texts(shapes).iter().any(|(t, _)| t == "9.87 M/s");
    assert!(rate(&panel.frame(vec![], &readout, &mut controls).1));
    readout.traced_per_second = 1e6;
    assert!(rate(&panel.frame(vec![], &readout, &mut controls).1), "20 ms later: the old figure");
    panel.time += 0.2;
    assert!(!rate(&panel.frame(vec![], &readout, &mut controls).1));
}

#[test]
fn hostile_figures_are_shown_without_a_panic() {
    let odd = Readout {
        frames: vec![f32::NAN, f32::INFINITY, -1.0, 0.0],
        percentiles: [f32::NAN, f32::INFINITY, 0.0],
        traced_per_second: f64::NAN,
        rasterised_per_second: f64::INFINITY,
        lods: [Some(f32::NAN), None],
        ring: (5, 0),
        passes: vec![("nothing", f64::NAN)],
        fov: f64::NAN,
        ..readout()
    };
    let mut controls = controls();
    Panel::new([512.0, 512.0]).settle(&odd, &mut controls);
    Panel::new([512.0, 512.0]).settle(&Readout::default(), &mut controls);
}
