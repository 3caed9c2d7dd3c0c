//! The panel without a window: it leaves untouched values alone, its buttons do what they say, and it fits small windows.

use crate::headless_panel::{Panel, controls, controls_of, picture, place, readout, texts};
use egui::{Event, Shape, pos2, vec2};
use pointillist::client::settings::{
    Adaptation, ColorOutput, Denoise, DisplayView, Dither, Glare, Masking, Reconstruction,
    ReconstructionKernel, Settings, SplatFilter, ToneCurve,
};
use pointillist::client::window::action::Action;
use pointillist::client::window::panel::{
    CommandPalette, DEFAULT_TARGET, FileChooser, PanelControls, PanelData, PanelLayout, PanelTab,
    ParameterValue, SceneParameter, Selection,
};
use pointillist::color::Profile;
use pointillist::math::random::Random;

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

#[test]
fn buttons_do_what_they_say() {
    let (readout, mut controls, mut panel) = (readout(), controls(), Panel::new([800.0, 1600.0]));
    let cases = [
        (PanelTab::Render, "Open…", Action::OpenDialog),
        (PanelTab::Render, "Save…", Action::SaveDialog),
        (PanelTab::Render, "Undo", Action::Undo),
        (PanelTab::Render, "Redo", Action::Redo),
        (PanelTab::Render, "Commands", Action::TogglePalette),
        (PanelTab::Render, "?", Action::ToggleHelp),
        (PanelTab::Scene, "Deselect", Action::Deselect),
        (PanelTab::Files, "PNG", Action::SavePng),
        (PanelTab::Files, "EXR", Action::SaveExr),
        (PanelTab::Files, "Save scene", Action::SaveScene),
        (PanelTab::Files, "Copy command", Action::CopyCommand),
    ];
    for (tab, text, action) in cases {
        controls.layout.bring(tab);
        let shapes = panel.settle(&readout, &mut controls);
        let at = place(&shapes, text);
        assert_eq!(panel.click(at, &readout, &mut controls), [action], "{text}");
    }
    controls.layout.bring(PanelTab::Render);
    place(&panel.settle(&readout, &mut controls), "without lens");
    controls.layout.is_open = false;
    assert!(texts(&panel.frame(vec![], &readout, &mut controls).1).is_empty(), "hidden means hidden");
}

/// A switch asks for its other state, as a change of its own; a point shows its three numbers.
#[test]
fn switches_and_points_are_edited() {
    let (mut readout, mut panel) = (readout(), Panel::new([800.0, 1600.0]));
    let mut controls = controls_of(PanelTab::Scene);
    readout.selection = Some(Selection {
        name: "wall".into(),
        selected: true,
        lens_from: 2,
        parameters: vec![
            SceneParameter {
                label: "position".into(),
                value: ParameterValue::Vector { value: [1.25, -2.5, 0.125], step: 0.01 },
            },
            SceneParameter { label: "textures".into(), value: ParameterValue::Switch(true) },
        ],
    });
    let shapes = panel.settle(&readout, &mut controls);
    let shown = texts(&shapes);
    for number in ["1.25", "-2.50", "0.125"] {
        assert!(shown.iter().any(|(text, _)| text.replace('−', "-") == number), "{number} in {shown:?}");
    }
    let (_, label) = shown.iter().find(|(text, _)| text == "textures").expect("the label of the switch");
    let actions = panel.click(pos2(label.left() - 16.0, label.center().y), &readout, &mut controls);
    let switched = Action::Edit { index: 1, value: ParameterValue::Switch(false) };
    assert_eq!(actions, [switched, Action::EndMove]);
}

/// A click on the count of rejected values opens their list, which stays open while the count grows.
#[test]
fn rejected_values_are_listed_at_a_click() {
    let (mut readout, mut controls, mut panel) = (readout(), controls(), Panel::new([800.0, 1600.0]));
    let listed =
        |shapes: &[_]| texts(shapes).iter().any(|(text, _)| text.contains("path 7: light sample infinite"));
    let shapes = panel.settle(&readout, &mut controls);
    assert!(!listed(&shapes), "folded at first");
    panel.click(place(&shapes, "Rejected: 3"), &readout, &mut controls);
    assert!(listed(&panel.settle(&readout, &mut controls)));
    readout.rejected.total = 4;
    let shapes = panel.settle(&readout, &mut controls);
    place(&shapes, "Rejected: 4");
    assert!(listed(&shapes));
    readout.rejected = Default::default();
    let shapes = panel.settle(&readout, &mut controls);
    assert!(texts(&shapes).iter().all(|(text, _)| !text.contains("Rejected")));
}

#[test]
fn choices_and_resets_change_the_settings() {
    let (readout, mut controls, mut panel) =
        (readout(), controls_of(PanelTab::Look), Panel::new([800.0, 1600.0]));
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
    panel.click(pos2(name.x + 130.0, c.y), &readout, &mut controls);
    assert_ne!(controls.settings.contrast, 1.0);
    assert_eq!(controls.settings, Settings { contrast: controls.settings.contrast, ..Settings::default() });
    assert!(controls.auto_exposure);
    // One into the slider of B fixes the brightness.
    let b = place(&shapes, "Brightness B");
    panel.click(pos2(name.x + 130.0, b.y), &readout, &mut controls);
    assert!(!controls.auto_exposure && controls.settings.exposure != 1.0);
}

#[test]
fn another_method_can_be_chosen() {
    let (readout, mut controls, mut panel) = (readout(), controls(), Panel::new([800.0, 1600.0]));
    let shapes = panel.settle(&readout, &mut controls);
    panel.click(place(&shapes, "automatic: path"), &readout, &mut controls);
    let open = panel.settle(&readout, &mut controls);
    let actions = panel.click(place(&open, "bidirectional"), &readout, &mut controls);
    assert_eq!(actions, [Action::SetMethod(Some("bidirectional"))]);
}

#[test]
fn untouched_values_stay_bit_for_bit() {
    let mut random = Random(7);
    for round in 0..60 {
        let mut float = |reach: f32| random.f32() * reach;
        let settings = Settings {
            // Beyond what the sliders reach, too: the command line allows it.
            vm: float(40.0),
            exposure: float(5.0).powi(6) + 1e-7,
            contrast: float(9.0),
            gamma: float(9.0),
            glare: (round % 2 == 0)
                .then(|| Glare { adaptation: Adaptation::Scotopic, view_angle: float(200.0) }),
            view: [DisplayView::Picture, DisplayView::CameraVariance, DisplayView::LightVariance][round % 3],
            masking: [Masking::LowPass, Masking::Bilateral][round % 2],
            denoise: [Denoise::Off, Denoise::Wavelet][round % 2],
            reproject: round % 2 == 0,
            reconstruction: [Reconstruction::CatmullRom, Reconstruction::Mipmap, Reconstruction::None]
                [round % 3],
            kernel: ReconstructionKernel { taps: 2 + round as u32 % 7, exponent: round as u32 % 5 },
            curve: [ToneCurve::AgX, ToneCurve::PbrNeutral][round % 2],
            profile: Profile {
                name: if round % 4 == 0 { "mine.icc" } else { "rec2020" }.to_string(),
                ..Profile::srgb()
            },
            post: Default::default(),
            dither: [Dither::Ordered, Dither::BlueNoise][round % 2],
            output: [ColorOutput::Sdr, ColorOutput::ScRgb, ColorOutput::Hdr10][round % 3],
            peak: [203, 777, 10_000][round % 3],
        };
        let mut controls = PanelControls {
            settings: settings.clone(),
            filter: SplatFilter::Tent,
            own_profile: None,
            layout: PanelLayout::new(true),
            help: round % 5 == 0,
            palette: CommandPalette::default(),
            open_dialog: FileChooser::default(),
            save_dialog: FileChooser::default(),
            enters: false,
            auto_exposure: round % 2 == 0,
            target: DEFAULT_TARGET,
        };
        let mut panel = Panel::new([700.0, 1500.0]);
        controls.layout.bring(PanelTab::ALL[round % 6]);
        // settle() also asserts that no action, thus no edit of the selection or the field of view, comes by itself.
        panel.settle(&readout(), &mut controls);
        panel.frame(vec![Event::PointerMoved(pos2(150.0, 20.0 * round as f32))], &readout(), &mut controls);
        assert_eq!(controls.settings, settings);
        assert_eq!(controls.settings.exposure.to_bits(), settings.exposure.to_bits());
        assert_eq!(controls.filter, SplatFilter::Tent);
        assert_eq!(controls.auto_exposure, round % 2 == 0);
    }
}

/// A noise filter that is not installed cannot be chosen; one that is can.
#[test]
fn the_noise_filters_that_there_are_can_be_chosen() {
    let is_there = pointillist::client::oidn::library().is_ok();
    for (text, kind, can_be_had) in [
        ("Off", Denoise::Off, true),
        ("Wavelets", Denoise::Wavelet, true),
        ("Open Image Denoise", Denoise::Oidn, is_there),
    ] {
        for before in [Denoise::Off, Denoise::Wavelet] {
            let (readout, mut panel) = (readout(), Panel::new([800.0, 1600.0]));
            let mut controls = controls_of(PanelTab::Look);
            controls.settings.denoise = before;
            let shapes = panel.settle(&readout, &mut controls);
            panel.click(place(&shapes, "Noise filter") + vec2(110.0, 0.0), &readout, &mut controls);
            let open = panel.settle(&readout, &mut controls);
            // The last one of this name: the open list is over the panel.
            let at = texts(&open).into_iter().rfind(|(found, _)| found == text).unwrap().1.center();
            panel.click(at, &readout, &mut controls);
            assert_eq!(controls.settings.denoise, if can_be_had { kind } else { before }, "{text}");
        }
    }
}

/// Also while the panel is hidden, and only within the window.
#[test]
fn messages_stand_over_the_picture() {
    let mut controls = PanelControls { layout: PanelLayout::new(false), ..controls() };
    for (size, seen) in [([512.0, 512.0], true), ([320.0, 200.0], true), ([40.0, 30.0], false)] {
        let mut panel = Panel::new(size);
        let said = PanelData { message: Some("saved cornell-001.png".into()), ..readout() };
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
            let inside =
                !seen.is_positive() || (seen.right() <= size[0] + 0.5 && seen.bottom() <= size[1] + 0.5);
            assert!(inside, "{size:?}: {seen:?}");
        }
        assert_eq!(texts(&shapes).is_empty(), size[0] < 216.0, "{size:?}");
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
    let odd = PanelData {
        frames: vec![f32::NAN, f32::INFINITY, -1.0, 0.0],
        percentiles: [f32::NAN, f32::INFINITY, 0.0],
        traced_per_second: f64::NAN,
        rasterised_per_second: f64::INFINITY,
        lods: [Some(f32::NAN), None],
        ring: (5, 0),
        passes: vec![("nothing", f64::NAN)],
        ..readout()
    };
    for tab in PanelTab::ALL {
        let mut controls = controls_of(tab);
        Panel::new([512.0, 512.0]).settle(&odd, &mut controls);
        Panel::new([512.0, 512.0]).settle(&PanelData::default(), &mut controls);
    }
}
