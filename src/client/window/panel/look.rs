//! The tab of the display: its controls, and the legend of false colours.

use clap::ValueEnum;
use egui::{Color32, Rect, RichText, Sense, Ui, pos2, vec2};

use crate::client::oidn;
use crate::client::post_process::PostSlider;
use crate::client::settings::{
    Adaptation, ColorOutput, Denoise, DisplayView, Glare, OptionNames, Settings, SplatFilter,
};
use crate::client::window::panel::controls::PanelControls;
use crate::client::window::panel::style;
use crate::client::window::panel::widgets::{Label, choice, choice_if, slide};
use crate::client::zones;
use crate::color::Profile;

/// Draws the controls; a double click on a label resets its default.
pub(super) fn show(ui: &mut Ui, controls: &mut PanelControls) {
    let PanelControls { settings, filter, own_profile, auto_exposure, .. } = controls;
    let default = Settings::default();
    let hint = "The picture, or the relative standard error of a stream";
    option(ui, ("Show", hint), &mut settings.view, default.view);
    let label = ("Reconstruction", "How the sums become a picture while samples are few");
    option(ui, label, &mut settings.reconstruction, default.reconstruction);
    let hint = "How a sample is spread over pixels; starts the film anew";
    option(ui, ("Splat filter", hint), filter, SplatFilter::default());
    let label = ("Adaptive filter", "Light samples are spread wide where they are few, and end at edges");
    option(ui, label, &mut settings.adaptive_filter, default.adaptive_filter);
    noise_filter(ui, &mut settings.denoise);
    let label = ("Noise masking", "Vm: extra blur where the variance is high; 0 is off");
    slide(ui, label, &mut settings.vm, default.vm, 0.0..=16.0);
    ui.add_enabled_ui(settings.vm > 0.0 && settings.denoise == Denoise::Off, |ui| {
        option(ui, ("Masking by", "What hides the noise"), &mut settings.masking, default.masking);
    });
    ui.separator();
    glare(ui, &mut settings.glare);
    for PostSlider { label, hint, value, default, range } in settings.post.sliders() {
        slide(ui, (label, hint), value, default, range);
    }
    ui.separator();
    let exposure = settings.exposure;
    tone(ui, settings, &default, own_profile.as_ref(), auto_exposure);
    *auto_exposure &= settings.exposure == exposure;
    if settings.view == DisplayView::FalseColor {
        ui.separator();
        zone_legend(ui);
    }
}

/// Selects the noise filter. An unavailable one is grey, with the reason in its tooltip.
fn noise_filter(ui: &mut Ui, denoise: &mut Denoise) {
    let hint = "Takes noise out of the picture that is shown; sums and stated error stay as they are";
    let kinds: Vec<_> = Denoise::value_variants().iter().map(|kind| (kind.label(), *kind)).collect();
    choice_if(ui, ("Noise filter", hint), denoise, &Denoise::Wavelet, &kinds, |kind| match kind {
        Denoise::Oidn => oidn::library().err().map(|error| format!("{error}; {}", oidn::HOW_TO_GET)),
        Denoise::Off | Denoise::Wavelet => None,
    });
}

fn glare(ui: &mut Ui, glare: &mut Option<Glare>) {
    let states = Adaptation::value_variants().iter().map(|state| (state.label(), Some(*state)));
    let eyes: Vec<_> = std::iter::once(("Off", None)).chain(states).collect();
    let before = glare.map(|g| g.adaptation);
    let mut now = before;
    choice(ui, ("Glare", "Of the observer's eye, by its adaptation"), &mut now, &None, &eyes);
    if now != before {
        *glare = now.map(|adaptation| Glare { adaptation, ..glare.unwrap_or_default() });
    }
    if let Some(glare) = glare {
        let label = ("View angle", "Degrees that the picture's width fills in the observer's eye");
        slide(ui, label, &mut glare.view_angle, Glare::default().view_angle, 1.0..=120.0);
    }
}

fn tone(
    ui: &mut Ui,
    settings: &mut Settings,
    default: &Settings,
    own: Option<&Profile>,
    auto_exposure: &mut bool,
) {
    let label = ("Tone curve", "From scene to display luminance");
    option(ui, label, &mut settings.curve, default.curve);
    let label = ("Brightness B", "Factor on luminance");
    slide(ui, label, &mut settings.exposure, default.exposure, 1e-3..=1e3);
    let hint = "Brightness follows the light of the scene: its mean becomes a middle grey";
    ui.checkbox(auto_exposure, "Brightness from the scene").on_hover_text(hint);
    let label = ("Contrast C", "Exponent of the tone curve");
    slide(ui, label, &mut settings.contrast, default.contrast, 0.1..=4.0);
    slide(ui, ("Gamma G", "Of the display"), &mut settings.gamma, default.gamma, 1.0..=4.0);
    profile(ui, &mut settings.profile, own);
    option(ui, ("Dither", "Hides the steps of 8 bits"), &mut settings.dither, default.dither);
    option(ui, ("Output", "Used where the window offers it"), &mut settings.output, default.output);
    if settings.output != ColorOutput::Sdr {
        peak(ui, &mut settings.peak, default.peak);
    }
}

/// Selects the peak luminance of the display from a list. A value from the command line is kept until another is selected.
fn peak(ui: &mut Ui, peak: &mut u32, default: u32) {
    let mut known = vec![400, 600, 1000, 1500, 2000, 4000];
    known.push(*peak);
    known.sort_unstable();
    known.dedup();
    let names: Vec<String> = known.iter().map(|peak| format!("{peak} cd/m²")).collect();
    let known: Vec<_> = names.iter().map(String::as_str).zip(known).collect();
    choice(
        ui,
        ("Peak", "Luminance that highlights roll off to: that of the display"),
        peak,
        &default,
        &known,
    );
}

/// Selects a profile by name. A profile from a file is kept until another is selected.
fn profile(ui: &mut Ui, profile: &mut Profile, own: Option<&Profile>) {
    let present = profile.name.clone();
    let mut name = present.as_str();
    let mut known: Vec<_> = Profile::names().map(|name| (name, name)).to_vec();
    known.extend(own.map(|own| (own.name.as_str(), own.name.as_str())));
    choice(ui, ("Profile", "Primaries and white of the display"), &mut name, &"srgb", &known);
    if name != present
        && let Some(chosen) = Profile::named(name).or_else(|| own.filter(|own| own.name == name).cloned())
    {
        *profile = chosen;
    }
}

/// Chooses a value of a display option.
fn option<T: OptionNames + PartialEq>(ui: &mut Ui, name: Label<'_>, value: &mut T, default: T) {
    let kinds: Vec<_> = T::value_variants().iter().map(|kind| (kind.label(), kind.clone())).collect();
    choice(ui, name, value, &default, &kinds);
}

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
