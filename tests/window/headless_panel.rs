//! The panel without a window and without tools, frame after frame, with data to be shown.

use std::convert::Infallible;

use egui::{Event, Modifiers, PointerButton, Pos2, RawInput, Rect, Shape, pos2};
use pointillist::client::settings::{Settings, SplatFilter};
use pointillist::client::window::action::{Action, UserAction};
use pointillist::client::window::keys::KeyTable;
use pointillist::client::window::panel::{
    self, CommandPalette, PanelControls, PanelData, PanelLayout, PanelTab, PictureView,
};
use pointillist::client::window::viewport::Viewport;

pub fn readout() -> PanelData {
    PanelData {
        extent: [512, 512],
        undo: Some("move of `ball`".into()),
        redo: Some("orbit of the camera".into()),
        ..PanelData::default()
    }
}

pub fn controls() -> PanelControls {
    PanelControls {
        settings: Settings::default(),
        filter: SplatFilter::default(),
        own_profile: None,
        layout: PanelLayout::new(true),
        help: false,
        palette: CommandPalette::default(),
        enters: false,
        auto_exposure: true,
    }
}

/// Draws the panel without tools; returns the user's actions.
pub fn show(ui: &mut egui::Ui, data: &PanelData, controls: &mut PanelControls) -> Vec<Action> {
    let actions = panel::show(ui, data, controls, &mut (), &KeyTable::<Infallible>::new(Vec::new()));
    let of_window = |action| match action {
        UserAction::Window(action) => action,
        UserAction::Tool(_) | UserAction::ToolAt(..) | UserAction::AskPlace(_) => {
            panic!("there are no tools")
        }
    };
    actions.into_iter().map(of_window).collect()
}

/// The same with a tab in front.
pub fn controls_of(tab: PanelTab) -> PanelControls {
    let mut controls = controls();
    controls.layout.bring(tab);
    controls
}

/// A context that is shown frame after frame.
pub struct Panel {
    pub context: egui::Context,
    pub size: [f32; 2],
    pub time: f64,
}

impl Panel {
    pub fn new(size: [f32; 2]) -> Self {
        Self { context: egui::Context::default(), size, time: 0.0 }
    }

    pub fn frame(
        &mut self,
        events: Vec<Event>,
        readout: &PanelData,
        controls: &mut PanelControls,
    ) -> (Vec<Action>, Vec<egui::epaint::ClippedShape>) {
        self.time += 0.02;
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, self.size.into()));
        let input = RawInput { screen_rect, time: Some(self.time), events, ..RawInput::default() };
        let mut actions = Vec::new();
        // The picture fills what the dock leaves.
        let area = [self.size[0] - controls.layout.width_in(self.size[0]), self.size[1]];
        let view = PictureView { viewport: Viewport::new(area.map(|n| n as u32)), pixels_per_point: 1.0 };
        let readout = &PanelData { view, ..readout.clone() };
        let output = self.context.run_ui(input, |ui| actions.extend(show(ui, readout, controls)));
        let shapes = output.shapes.clone();
        output.drop_without_applying_deltas();
        (actions, shapes)
    }

    pub fn settle(
        &mut self,
        readout: &PanelData,
        controls: &mut PanelControls,
    ) -> Vec<egui::epaint::ClippedShape> {
        for _ in 0..3 {
            let (actions, _) = self.frame(vec![], readout, controls);
            assert_eq!(actions, []);
        }
        self.frame(vec![], readout, controls).1
    }

    pub fn click(&mut self, at: Pos2, readout: &PanelData, controls: &mut PanelControls) -> Vec<Action> {
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
pub fn picture(panel: &mut Panel, name: &str, shapes: Vec<egui::epaint::ClippedShape>) {
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

pub fn texts(shapes: &[egui::epaint::ClippedShape]) -> Vec<(String, Rect)> {
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

pub fn place(shapes: &[egui::epaint::ClippedShape], text: &str) -> Pos2 {
    let all = texts(shapes);
    all.iter().find(|(t, _)| t == text).unwrap_or_else(|| panic!("no {text:?} among {all:?}")).1.center()
}
