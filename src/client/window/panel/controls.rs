//! The display controls. Values that the user does not touch keep their bits.

use std::ops::RangeInclusive;

use clap::ValueEnum;
use egui::{Button, ComboBox, Response, Sense, Slider, SliderClamping, Ui};

use crate::client::oidn;
use crate::client::post_process::PostSlider;
use crate::client::settings::{Adaptation, ColorOutput, Denoise, Glare, OptionNames, Settings, SplatFilter};
use crate::client::window::panel::{PanelControls, style};
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

/// Label of a control, and its tooltip.
pub type Label<'a> = (&'a str, &'a str);

/// Draws a label, which senses double clicks.
fn label(ui: &mut Ui, (text, hint): Label<'_>) -> Response {
    let text = egui::Label::new(egui::RichText::new(text).color(style::DIM)).sense(Sense::click());
    let size = egui::vec2(92.0, ui.spacing().interact_size.y);
    let layout = egui::Layout::left_to_right(egui::Align::Center);
    let response = ui.allocate_ui_with_layout(size, layout, |ui| {
        ui.set_min_width(size.x);
        ui.add(text)
    });
    response.inner.on_hover_text(format!("{hint}.\nDouble click: default."))
}

/// Chooses a value of a display option.
fn option<T: OptionNames + PartialEq>(ui: &mut Ui, name: Label<'_>, value: &mut T, default: T) {
    let kinds: Vec<_> = T::value_variants().iter().map(|kind| (kind.label(), kind.clone())).collect();
    choice(ui, name, value, &default, &kinds);
}

/// Chooses one of several values; a double click on the label resets the default.
pub fn choice<T: PartialEq + Clone>(
    ui: &mut Ui,
    name: Label<'_>,
    value: &mut T,
    default: &T,
    kinds: &[(&str, T)],
) {
    choice_if(ui, name, value, default, kinds, |_| None);
}

/// Selects one of several values, some of which are unavailable: `lacking` gives the reason.
fn choice_if<T: PartialEq + Clone>(
    ui: &mut Ui,
    name: Label<'_>,
    value: &mut T,
    default: &T,
    kinds: &[(&str, T)],
    lacking: impl Fn(&T) -> Option<String>,
) {
    ui.horizontal(|ui| {
        if label(ui, name).double_clicked() {
            *value = default.clone();
        }
        let shown = kinds.iter().find(|(_, kind)| kind == value).map_or("from a file", |(text, _)| text);
        ComboBox::from_id_salt(name.0).selected_text(shown).show_ui(ui, |ui| {
            for (text, kind) in kinds {
                let lacking = lacking(kind);
                let button = Button::selectable(kind == value, *text);
                let response = ui.add_enabled(lacking.is_none(), button);
                if response.clicked() {
                    *value = kind.clone();
                }
                if let Some(why) = lacking {
                    response.on_disabled_hover_text(why);
                }
            }
        });
    });
}

/// Chooses a number; a range over more than two decades, or from 0, is logarithmic.
fn slide(ui: &mut Ui, name: Label<'_>, value: &mut f32, default: f32, range: RangeInclusive<f32>) {
    ui.horizontal(|ui| {
        if label(ui, name).double_clicked() {
            *value = default;
        }
        let mut next = *value;
        let (least, greatest) = (*range.start(), *range.end());
        let slider = Slider::new(&mut next, range).clamping(SliderClamping::Edits).max_decimals(3);
        let slider = slider.logarithmic(least == 0.0 || greatest / least > 150.0).smallest_positive(0.01);
        // Widgets may round the displayed value; only a change by the user is stored.
        let response = ui.add(slider);
        if response.double_clicked() {
            *value = default;
        } else if response.changed() && next.is_finite() {
            *value = next;
        }
    });
}
