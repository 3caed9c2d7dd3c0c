//! Labelled controls, and sections that fold. Values that the user does not touch keep their bits.

use std::ops::RangeInclusive;

use egui::{Button, CollapsingHeader, ComboBox, Response, RichText, Sense, Slider, SliderClamping, Ui};

use crate::client::window::panel::style;

/// Draws a section that folds.
pub fn section(ui: &mut Ui, title: &str, open: bool, contents: impl FnOnce(&mut Ui)) {
    // The identifier is the part before a colon, since the rest may change while the section stays open.
    let name = title.split(':').next();
    CollapsingHeader::new(RichText::new(title).color(style::BRIGHT).heading())
        .id_salt(name)
        .default_open(open)
        .show_unindented(ui, |ui| {
            contents(ui);
            ui.add_space(4.0);
        });
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
pub fn choice_if<T: PartialEq + Clone>(
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
pub fn slide(ui: &mut Ui, name: Label<'_>, value: &mut f32, default: f32, range: RangeInclusive<f32>) {
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
