//! The gizmo over the selected object: handles along the world axes that move, rotate or scale it.

use egui::{Color32, Context, LayerId, Shape, Stroke, StrokeKind, Ui, vec2};
use glam::DVec2;

use crate::client::window::action::Action;
use crate::client::window::panel::{PictureArea, style};

/// Mode of the gizmo.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GizmoMode {
    /// Moves the object.
    #[default]
    Move,
    /// Rotates the object.
    Turn,
    /// Scales the object.
    Scale,
}

impl GizmoMode {
    /// All modes with their names.
    pub const ALL: [(Self, &str); 3] = [(Self::Move, "Move"), (Self::Turn, "Turn"), (Self::Scale, "Scale")];

    /// The mode after this one.
    pub fn next(self) -> Self {
        match self {
            Self::Move => Self::Turn,
            Self::Turn => Self::Scale,
            Self::Scale => Self::Move,
        }
    }
}

/// A part of the gizmo that can be dragged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GizmoHandle {
    /// Along or about a world axis: 0, 1, 2 for x, y, z.
    Axis(usize),
    /// Move: in the picture plane; turn: about its normal; scale: uniformly.
    Center,
}

/// Geometry of the gizmo. Positions are pixels of the picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GizmoDrawing {
    /// Mode of the gizmo.
    pub mode: GizmoMode,
    /// Centre of the object.
    pub pivot: [f64; 2],
    /// Line vertices of each axis.
    pub axes: [Vec<[f64; 2]>; 3],
    /// The handle being dragged or under the pointer.
    pub hot: Option<GizmoHandle>,
}

/// Colours of the axes x, y and z.
const AXES: [Color32; 3] =
    [Color32::from_rgb(235, 85, 80), Color32::from_rgb(110, 200, 90), Color32::from_rgb(85, 140, 245)];

/// Half the side of the handles' squares, points.
const KNOB: f32 = 4.0;

/// Draws it over the picture.
pub(super) fn draw(ctx: &Context, picture: PictureArea, gizmo: &GizmoDrawing) {
    let painter = ctx.layer_painter(LayerId::background()).with_clip_rect(picture.area);
    let point = |place: &[f64; 2]| picture.point(DVec2::from(*place));
    let color = |handle: GizmoHandle, color: Color32| {
        if gizmo.hot == Some(handle) { style::ACCENT } else { color }
    };
    for (axis, line) in gizmo.axes.iter().enumerate() {
        let color = color(GizmoHandle::Axis(axis), AXES[axis]);
        let points: Vec<_> = line.iter().map(point).collect();
        // A dark outline beneath keeps it visible on any picture.
        painter.add(Shape::line(points.clone(), Stroke::new(4.0, Color32::from_black_alpha(110))));
        painter.add(Shape::line(points.clone(), Stroke::new(2.0, color)));
        let Some(end) = points.last().filter(|_| gizmo.mode != GizmoMode::Turn) else { continue };
        match gizmo.mode {
            GizmoMode::Scale => {
                let square = egui::Rect::from_center_size(*end, vec2(2.0 * KNOB, 2.0 * KNOB));
                painter.rect_filled(square, 0.0, color);
            }
            _ => _ = painter.circle_filled(*end, KNOB, color),
        }
    }
    let center = egui::Rect::from_center_size(point(&gizmo.pivot), vec2(2.0 * KNOB, 2.0 * KNOB));
    let color = color(GizmoHandle::Center, Color32::WHITE);
    painter.rect_stroke(center, 0.0, Stroke::new(1.5, color), StrokeKind::Middle);
}

/// Draws the buttons that select the mode.
pub(super) fn choice(ui: &mut Ui, mode: GizmoMode, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        for (choice, name) in GizmoMode::ALL {
            let button = ui.selectable_label(choice == mode, name);
            if button.on_hover_text("Drag a handle over the object in the picture  G").clicked() {
                actions.push(Action::SetGizmo(choice));
            }
        }
    });
}
