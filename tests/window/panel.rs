//! The panel without a window: it leaves untouched values alone, its buttons do what they say, and it fits small windows.

use crate::headless_panel::{Panel, controls, controls_of, place, readout, texts};
use egui::{Event, Shape, pos2, vec2};
use pointillist::client::settings::{
    Adaptation, AdaptiveFilter, ColorOutput, Denoise, DisplayView, Dither, Glare, Masking, Reconstruction,
    ReconstructionKernel, Settings, SplatFilter, ToneCurve,
};
use pointillist::client::window::action::Action;
use pointillist::client::window::panel::{PanelControls, PanelData, PanelLayout, PanelTab};
use pointillist::color::Profile;
use pointillist::image::stereo::StereoLayout;
use pointillist::math::random::Random;

#[test]
fn buttons_do_what_they_say() {
    let (readout, mut controls, mut panel) = (readout(), controls(), Panel::new([800.0, 1600.0]));
    let cases = [
        ("Open…", Action::OpenDialog),
        ("Save…", Action::SaveDialog),
        ("Undo", Action::Undo),
        ("Redo", Action::Redo),
        ("Commands", Action::TogglePalette),
        ("?", Action::ToggleHelp),
    ];
    for (text, action) in cases {
        let shapes = panel.settle(&readout, &mut controls);
        let at = place(&shapes, text);
        assert_eq!(panel.click(at, &readout, &mut controls), [action], "{text}");
    }
    controls.layout.is_open = false;
    assert!(texts(&panel.frame(vec![], &readout, &mut controls).1).is_empty(), "hidden means hidden");
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
            adaptive_filter: [AdaptiveFilter::Off, AdaptiveFilter::Light][round % 2],
            denoise: [Denoise::Off, Denoise::Wavelet][round % 2],
            reproject: round % 2 == 0,
            steer: round % 3 == 0,
            stereo: StereoLayout::ALL[round % 12],
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
            help: round % 5 == 0,
            auto_exposure: round % 2 == 0,
            ..controls_of(PanelTab::ALL[round % 6])
        };
        let mut panel = Panel::new([700.0, 1500.0]);
        // settle() also asserts that no action comes by itself.
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
fn a_panel_without_data_is_shown() {
    for tab in PanelTab::ALL {
        Panel::new([512.0, 512.0]).settle(&PanelData::default(), &mut controls_of(tab));
    }
}
