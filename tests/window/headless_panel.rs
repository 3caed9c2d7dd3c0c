//! The panel without a window and without tools, frame after frame, with data to be shown.

use std::convert::Infallible;

use egui::{Event, Modifiers, PointerButton, Pos2, RawInput, Rect, Shape};
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
