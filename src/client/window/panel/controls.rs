//! The display controls. A value that the user does not touch stays bit for bit what it was.

use std::ops::RangeInclusive;

use egui::{ComboBox, Response, Sense, Slider, SliderClamping, Ui};

use crate::client::settings::{
    Adaptation, Dither, Glare, Masking, Output, Reconstruction, Settings, SplatFilter, ToneCurve, View,
};
use crate::client::window::panel::{MapChoice, PanelControls, style};
use crate::color::Profile;

/// Draws the controls; a double click on a label sets its default again.
pub(super) fn show(ui: &mut Ui, controls: &mut PanelControls) {
    let PanelControls { settings, filter, own_profile, map, .. } = controls;
    let default = Settings::default();
    let maps = [("Picture", MapChoice::None), ("Error map", MapChoice::Error), ("Cost map", MapChoice::Cost)];
    let hint = "The picture, over it its relative error, or the time that paths take by region";
    choice(ui, ("Show", hint), map, &MapChoice::default(), &maps);
    let views = [
        ("Picture", View::Picture),
        ("Error, camera", View::CameraVariance),
        ("Error, light", View::LightVariance),
    ];
    let hint = "The picture, or the relative standard error of a stream";
    choice(ui, ("View", hint), &mut settings.view, &default.view, &views);
    use Reconstruction as R;
    let kinds =
        [("Gaussian", R::Gaussian), ("Catmull–Rom", R::CatmullRom), ("Mipmap", R::Mipmap), ("None", R::None)];
    let label = ("Reconstruction", "How the sums become a picture while samples are few");
    choice(ui, label, &mut settings.reconstruction, &default.reconstruction, &kinds);
    let filters =
        [("Gaussian", SplatFilter::Gaussian), ("Tent", SplatFilter::Tent), ("Box", SplatFilter::Box)];
    let hint = "How a sample is spread over pixels; starts the film anew";
    choice(ui, ("Filter", hint), filter, &SplatFilter::default(), &filters);
    let label = ("Noise masking", "Vm: extra blur where the variance is high; 0 is off");
    slide(ui, label, &mut settings.vm, default.vm, 0.0..=16.0);
    let kinds = [("Low-pass", Masking::LowPass), ("Bilateral", Masking::Bilateral)];
    ui.add_enabled_ui(settings.vm > 0.0, |ui| {
        choice(ui, ("Masking by", "What hides the noise"), &mut settings.masking, &default.masking, &kinds);
    });
    ui.separator();
    glare(ui, &mut settings.glare);
    ui.separator();
    tone(ui, settings, &default, own_profile.as_ref());
}

fn glare(ui: &mut Ui, glare: &mut Option<Glare>) {
    let eyes = [
        ("Off", None),
        ("Day (photopic)", Some(Adaptation::Photopic)),
        ("Dusk (mesopic)", Some(Adaptation::Mesopic)),
        ("Night (scotopic)", Some(Adaptation::Scotopic)),
    ];
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

fn tone(ui: &mut Ui, settings: &mut Settings, default: &Settings, own: Option<&Profile>) {
    let curves = [
        ("1 − exp(−(B·Y)^C)", ToneCurve::Paper),
        ("PBR Neutral", ToneCurve::PbrNeutral),
        ("AgX", ToneCurve::AgX),
    ];
    let label = ("Tone curve", "From scene to display luminance");
    choice(ui, label, &mut settings.curve, &default.curve, &curves);
    let label = ("Brightness B", "Factor on luminance");
    slide(ui, label, &mut settings.exposure, default.exposure, 1e-3..=1e3);
    let label = ("Contrast C", "Exponent of the tone curve");
    slide(ui, label, &mut settings.contrast, default.contrast, 0.1..=4.0);
    slide(ui, ("Gamma G", "Of the display"), &mut settings.gamma, default.gamma, 1.0..=4.0);
    profile(ui, &mut settings.profile, own);
    let kinds = [("None", Dither::None), ("Ordered", Dither::Ordered), ("Blue noise", Dither::BlueNoise)];
    choice(ui, ("Dither", "Hides the steps of 8 bits"), &mut settings.dither, &default.dither, &kinds);
    let outputs = [("8 bits", Output::Sdr), ("scRGB", Output::ScRgb), ("HDR10", Output::Hdr10)];
    let label = ("Output", "Used where the window offers it");
    choice(ui, label, &mut settings.output, &default.output, &outputs);
}

/// Chooses a profile by name. A profile from a file stays until another is chosen.
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

/// Text of a control in the left column, and the hint that stands under the pointer.
type Label<'a> = (&'a str, &'a str);

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

/// Chooses one of several values.
fn choice<T: PartialEq + Clone>(
    ui: &mut Ui,
    name: Label<'_>,
    value: &mut T,
    default: &T,
    kinds: &[(&str, T)],
) {
    ui.horizontal(|ui| {
        if label(ui, name).double_clicked() {
            *value = default.clone();
        }
        let shown = kinds.iter().find(|(_, kind)| kind == value).map_or("from a file", |(text, _)| text);
        ComboBox::from_id_salt(name.0).selected_text(shown).show_ui(ui, |ui| {
            for (text, kind) in kinds {
                if ui.selectable_label(kind == value, *text).clicked() {
                    *value = kind.clone();
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
        // Widgets may round what they show; only a change by the user counts.
        let response = ui.add(slider);
        if response.double_clicked() {
            *value = default;
        } else if response.changed() && next.is_finite() {
            *value = next;
        }
    });
}
