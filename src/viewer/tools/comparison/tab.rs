//! The tab of comparisons: snapshots and reference pictures, and how the selected one is shown.

use std::sync::Arc;

use egui::{
    Align2, Area, Color32, ColorImage, ComboBox, Context, CursorIcon, Id, LayerId, Order, Rect, RichText,
    Sense, Stroke, TextureHandle, TextureOptions, Ui, pos2, vec2,
};

use crate::client::window::action::ActionQueue;
use crate::client::window::panel::{PictureArea, style};
use crate::viewer::tools::comparison::CompareAction;

/// Size of a thumbnail, pixels.
pub const THUMBNAIL: [u32; 2] = [96, 54];

/// Width of the handle that moves the split, points.
const HANDLE: f32 = 9.0;

/// Mode of comparison.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CompareMode {
    /// The selected picture in place of the present one.
    #[default]
    Whole,
    /// The selected picture at the left of a movable line.
    Split,
    /// The relative difference of luminance.
    Difference,
    /// Perceptual difference (FLIP).
    Flip,
}

impl CompareMode {
    const ALL: [(Self, &str, &str); 4] = [
        (Self::Whole, "A/B", "In the place of the picture; T changes between the two"),
        (Self::Split, "Split", "Drag the line over the picture"),
        (Self::Difference, "Difference", "Relative difference of luminance, pixel by pixel"),
        (Self::Flip, "FLIP", "What is noticed when the two alternate (Andersson et al. 2020)"),
    ];
}

/// User settings of the comparison.
#[derive(Clone, Debug)]
pub struct CompareControls {
    /// Whether the comparison is shown.
    pub is_shown: bool,
    /// Mode of comparison.
    pub mode: CompareMode,
    /// Index of the selected picture in the list.
    pub chosen: usize,
    /// Position of the split line: 0 at the left edge of the picture, 1 at the right.
    pub split: f32,
}

impl Default for CompareControls {
    fn default() -> Self {
        Self { is_shown: false, mode: CompareMode::Whole, chosen: 0, split: 0.5 }
    }
}

/// A picture in 8 bits, in rows from the top.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SmallPicture {
    /// Width and height.
    pub size: [usize; 2],
    /// R, G, B.
    pub rgb: Vec<[u8; 3]>,
}

/// A line of the list of pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct SnapshotRow {
    /// Its name.
    pub name: String,
    /// Samples, time and error of a snapshot; for a file without these, its size.
    pub words: String,
    /// A small picture of it.
    pub thumbnail: Arc<SmallPicture>,
}

/// Data of the comparison.
#[derive(Clone, Debug, Default)]
pub struct ComparisonData {
    /// The pictures that can be chosen.
    pub rows: Vec<SnapshotRow>,
    /// The selected picture, displayed with the present settings, if it is drawn over the present one.
    pub picture: Option<Arc<SmallPicture>>,
    /// The difference as numbers, or why there is none.
    pub summary: String,
}

/// Draws the tab.
pub(super) fn show(
    ui: &mut Ui,
    data: &ComparisonData,
    controls: &mut CompareControls,
    queue: &mut ActionQueue<CompareAction>,
) {
    ui.horizontal_wrapped(|ui| {
        if ui.button("Keep snapshot").on_hover_text("Keeps the present picture  K").clicked() {
            queue.ask(CompareAction::KeepSnapshot);
        }
        let hint = "Compares with a picture from a file, such as a reference";
        if ui.button("Open EXR…").on_hover_text(hint).clicked() {
            queue.ask(CompareAction::ChooseFile);
        }
    });
    if data.rows.is_empty() {
        let hint = "Keep a snapshot, change something, and look at both: here or with T.";
        ui.add(egui::Label::new(RichText::new(hint).color(style::DIM)).wrap());
        return;
    }
    ui.horizontal(|ui| {
        ui.checkbox(&mut controls.is_shown, "Show")
            .on_hover_text("The chosen picture beside the present one  T");
        let name = CompareMode::ALL.iter().find(|(mode, ..)| *mode == controls.mode).map_or("", |all| all.1);
        ComboBox::from_id_salt("compare mode").selected_text(name).show_ui(ui, |ui| {
            for (mode, name, hint) in CompareMode::ALL {
                if ui.selectable_value(&mut controls.mode, mode, name).on_hover_text(hint).clicked() {
                    controls.is_shown = true;
                }
            }
        });
    });
    // The line is reserved even when empty, so that the layout does not jump.
    ui.colored_label(style::ACCENT, if controls.is_shown { data.summary.as_str() } else { "" });
    for (i, row) in data.rows.iter().enumerate() {
        ui.horizontal(|ui| {
            let texture = thumbnail(ui.ctx(), i, &row.thumbnail);
            let size = vec2(THUMBNAIL[0] as f32, THUMBNAIL[1] as f32);
            let image = egui::Image::new((texture.id(), texture.size_vec2()))
                .fit_to_exact_size(size)
                .maintain_aspect_ratio(true);
            let chosen = controls.chosen == i;
            ui.add(image);
            ui.vertical(|ui| {
                if ui.selectable_label(chosen, &row.name).clicked() {
                    controls.chosen = i;
                }
                ui.label(RichText::new(&row.words).small().color(style::DIM));
                if ui.small_button("Forget").clicked() {
                    queue.ask(CompareAction::Forget(i));
                }
            });
        });
    }
}

/// A picture, and its cached texture.
type KeptTexture = (Arc<SmallPicture>, TextureHandle);

/// Texture of a small picture, recreated when the picture changes.
fn texture(ctx: &Context, id: Id, picture: &Arc<SmallPicture>) -> TextureHandle {
    let kept = ctx.data(|data| data.get_temp::<KeptTexture>(id));
    if let Some((known, texture)) = kept
        && Arc::ptr_eq(&known, picture)
    {
        return texture;
    }
    let pixels = picture.rgb.iter().map(|[r, g, b]| Color32::from_rgb(*r, *g, *b)).collect();
    let texture = ctx.load_texture("picture", ColorImage::new(picture.size, pixels), TextureOptions::NEAREST);
    ctx.data_mut(|data| data.insert_temp::<KeptTexture>(id, (picture.clone(), texture.clone())));
    texture
}

fn thumbnail(ctx: &Context, place: usize, picture: &Arc<SmallPicture>) -> TextureHandle {
    texture(ctx, Id::new(("thumbnail", place)), picture)
}

/// Draws the selected picture over the present one, with the split line if there is one.
pub(super) fn draw(
    ctx: &Context,
    picture: PictureArea,
    data: &ComparisonData,
    controls: &mut CompareControls,
) {
    let Some(other) = data.picture.as_ref().filter(|_| controls.is_shown) else {
        // Removing the entry frees the texture.
        return ctx.data_mut(|data| data.remove::<KeptTexture>(Id::new("compared picture")));
    };
    let whole = picture.whole();
    let split = (controls.mode == CompareMode::Split).then(|| handle(ctx, picture, controls));
    let clip = match split {
        Some(x) => Rect::from_min_max(picture.area.min, pos2(x, picture.area.bottom())),
        None => picture.area,
    };
    let texture = texture(ctx, Id::new("compared picture"), other);
    let all = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    let painter = ctx.layer_painter(LayerId::background());
    painter.with_clip_rect(clip.intersect(picture.area)).image(texture.id(), whole, all, Color32::WHITE);
    let name = data.rows.get(controls.chosen).map_or("", |row| row.name.as_str());
    let label = |at: egui::Pos2, align: Align2, words: &str| {
        let galley =
            painter.layout_no_wrap(words.to_owned(), egui::FontId::proportional(12.0), style::BRIGHT);
        let place = align.anchor_size(at, galley.size() + vec2(8.0, 4.0));
        painter.rect_filled(place, 0.0, style::BACK);
        painter.galley(place.min + vec2(4.0, 2.0), galley, style::BRIGHT);
    };
    let top = picture.area.top() + 8.0;
    match split {
        Some(x) => {
            label(pos2(x - 8.0, top), Align2::RIGHT_TOP, name);
            label(pos2(x + 8.0, top), Align2::LEFT_TOP, "now");
        }
        None => label(pos2(picture.area.left() + 8.0, top), Align2::LEFT_TOP, name),
    }
    if let Some(x) = split {
        let stroke = Stroke::new(1.0, style::ACCENT);
        painter.with_clip_rect(picture.area).vline(x, picture.area.y_range(), stroke);
    }
}

/// Draggable handle of the split line; returns the line's position.
fn handle(ctx: &Context, picture: PictureArea, controls: &mut CompareControls) -> f32 {
    let (whole, area) = (picture.whole(), picture.area);
    let x = |split: f32| (whole.left() + split * whole.width()).clamp(area.left(), area.right());
    let corner = pos2(x(controls.split) - 0.5 * HANDLE, area.top());
    let handle =
        Area::new(Id::new("split")).order(Order::Middle).fixed_pos(corner).constrain(false).fade_in(false);
    handle.show(ctx, |ui| {
        let (_, response) = ui.allocate_exact_size(vec2(HANDLE, area.height()), Sense::drag());
        if let Some(at) = response.interact_pointer_pos().filter(|_| response.dragged()) {
            controls.split = ((at.x - whole.left()) / whole.width().max(1.0)).clamp(0.0, 1.0);
        }
        response.on_hover_cursor(CursorIcon::ResizeHorizontal);
    });
    x(controls.split)
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::*;
    use crate::client::window::action::UserAction;
    use crate::client::window::panel::PictureView;
    use crate::client::window::viewport::Viewport;

    #[derive(Default)]
    struct Tab {
        data: ComparisonData,
        controls: CompareControls,
        queue: ActionQueue<CompareAction>,
    }

    #[test]
    fn snapshots_are_chosen_shown_and_forgotten() {
        let row = |name: &str| SnapshotRow {
            name: name.to_owned(),
            words: "12 s, 64.0 paths per pixel, error 3.1 %".to_owned(),
            thumbnail: SmallPicture { size: [2, 1], rgb: vec![[9; 3]; 2] }.into(),
        };
        let data = ComparisonData { rows: vec![row("Snapshot 1"), row("before.exr")], ..Default::default() };
        let draw = |ui: &mut Ui, tab: &mut Tab| show(ui, &tab.data, &mut tab.controls, &mut tab.queue);
        let mut harness = Harness::builder().build_ui_state(draw, Tab { data, ..Tab::default() });
        harness.run_steps(3);
        let click = |harness: &mut Harness<'_, Tab>, label: &str| {
            harness.get_all_by_label(label).next().expect("a widget").click();
            harness.run_steps(2);
            harness.state_mut().queue.take()
        };
        for (label, action) in
            [("Keep snapshot", CompareAction::KeepSnapshot), ("Open EXR…", CompareAction::ChooseFile)]
        {
            assert_eq!(click(&mut harness, label), [UserAction::Tool(action)]);
        }
        click(&mut harness, "before.exr");
        click(&mut harness, "Show");
        let controls = &harness.state().controls;
        assert!((controls.chosen, controls.is_shown, controls.mode) == (1, true, CompareMode::Whole));
        assert_eq!(click(&mut harness, "Forget"), [UserAction::Tool(CompareAction::Forget(0))]);
    }

    /// The line of the split is dragged over the picture, and stops at its edges.
    #[test]
    fn the_split_is_dragged() {
        let picture = SmallPicture { size: [4, 4], rgb: vec![[200; 3]; 16] };
        let data = ComparisonData { picture: Some(picture.into()), ..Default::default() };
        let controls = CompareControls { is_shown: true, mode: CompareMode::Split, ..Default::default() };
        let view = PictureView { viewport: Viewport::new([600, 900]), pixels_per_point: 1.0 };
        let area = Rect::from_min_size(pos2(0.0, 0.0), vec2(600.0, 900.0));
        let draw_over = move |ui: &mut Ui, tab: &mut Tab| {
            draw(ui.ctx(), PictureArea { area, view }, &tab.data, &mut tab.controls);
        };
        let tab = Tab { data, controls, ..Tab::default() };
        let mut harness = Harness::builder().with_size([900.0, 900.0]).build_ui_state(draw_over, tab);
        harness.run_steps(3);
        let at = |x: f32| pos2(x, 450.0);
        harness.drag_at(at(300.0));
        harness.run_steps(2);
        harness.hover_at(at(150.0));
        harness.run_steps(2);
        let split = harness.state().controls.split;
        assert!((split - 0.25).abs() < 0.02, "{split}");
        harness.hover_at(at(-50.0));
        harness.run_steps(2);
        assert_eq!(harness.state().controls.split, 0.0);
        harness.drop_at(at(-50.0));
    }
}
