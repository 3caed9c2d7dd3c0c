//! Where the picture is in the window; the grid, the zoom and small sheets of text over it.

use egui::{
    Align2, Area, Color32, Context, Frame, Id, LayerId, Margin, Order, Pos2, Rect, Stroke, Ui, Vec2, pos2,
    vec2,
};
use glam::DVec2;

use crate::client::window::panel::data::PictureView;
use crate::client::window::panel::plots::trimmed;
use crate::client::window::panel::style;
use crate::client::window::viewport::GRID_ZOOM;

/// Distance of overlays from the edges of the picture area, points.
pub(super) const GAP: f32 = 8.0;

/// Position of the picture in the window.
#[derive(Clone, Copy, Debug)]
pub struct PictureArea {
    /// The part of the window beside the dock, points.
    pub area: Rect,
    /// The part of the picture shown in it.
    pub view: PictureView,
}

impl PictureArea {
    /// Window position, in points, of a position in pixels of what is displayed; of two eyes that of the left.
    pub fn point(&self, place: DVec2) -> Pos2 {
        self.of_pixels(self.view.viewport.of_left_eye(place))
    }

    /// Window position, in points, that shows a position in pixels of the picture; `None` where a view into a panorama does not.
    pub fn seen(&self, place: DVec2) -> Option<Pos2> {
        self.view.viewport.seen(place).map(|at| self.of_pixels(at))
    }

    /// Position in pixels of what is displayed for a window position in points; of two eyes that of the left.
    pub fn place(&self, point: Pos2) -> DVec2 {
        self.view.viewport.to_left_eye(self.pixels(point))
    }

    /// Window position in points of one in pixels.
    fn of_pixels(&self, at: DVec2) -> Pos2 {
        let at = at / f64::from(self.view.pixels_per_point);
        self.area.min + vec2(at.x as f32, at.y as f32)
    }

    /// Window position in pixels of one in points.
    fn pixels(&self, point: Pos2) -> DVec2 {
        let at = (point - self.area.min) * self.view.pixels_per_point;
        DVec2::new(f64::from(at.x), f64::from(at.y))
    }

    /// Window rectangle of the whole picture, which may exceed the area; of two eyes that of the left.
    pub fn whole(&self) -> Rect {
        let size = self.view.viewport.eye();
        Rect::from_min_max(self.point(DVec2::ZERO), self.point(size))
    }
}

/// Draws the grid between magnified pixels, and the zoom.
pub(super) fn show(ctx: &Context, picture: PictureArea) {
    let zoom = picture.view.viewport.zoom();
    if zoom >= GRID_ZOOM {
        grid(ctx, picture);
    }
    if !picture.view.viewport.is_whole() {
        corner(ctx, picture.area, "zoom", Align2::LEFT_BOTTOM, |ui, _| {
            ui.colored_label(style::BRIGHT, format!("×{}   0: whole picture", trimmed(zoom, 2)));
        });
    }
}

/// Grid lines between magnified pixels.
fn grid(ctx: &Context, picture: PictureArea) {
    let painter = ctx.layer_painter(LayerId::background()).with_clip_rect(picture.area);
    let viewport = &picture.view.viewport;
    let [first, last] =
        [picture.area.min, picture.area.max].map(|at| viewport.to_picture(picture.pixels(at)));
    let (first, last) = (first.floor().max(DVec2::ZERO), last.ceil().min(viewport.picture()));
    let stroke = Stroke::new(1.0 / picture.view.pixels_per_point, Color32::from_white_alpha(40));
    let point = |place: DVec2| picture.of_pixels(viewport.to_window(place));
    let (from, to) = (point(first), point(last));
    for x in first.x as i64..=last.x as i64 {
        let x = point(DVec2::new(x as f64, 0.0)).x;
        painter.line_segment([pos2(x, from.y), pos2(x, to.y)], stroke);
    }
    for y in first.y as i64..=last.y as i64 {
        let y = point(DVec2::new(0.0, y as f64)).y;
        painter.line_segment([pos2(from.x, y), pos2(to.x, y)], stroke);
    }
}

/// Draws a small sheet at an edge of the picture's area; `contents` receives the available size.
pub(super) fn corner(
    ctx: &Context,
    area: Rect,
    id: &str,
    align: Align2,
    contents: impl FnOnce(&mut Ui, Vec2),
) {
    let space = area.shrink(GAP);
    if space.width() < 60.0 || space.height() < 40.0 {
        return;
    }
    let order = if id == "message" { Order::Foreground } else { Order::Middle };
    let sheet = Area::new(Id::new(id)).order(order).fade_in(false).interactable(false);
    sheet.pivot(align).fixed_pos(align.pos_in_rect(&space)).constrain_to(space).show(ctx, |ui| {
        let frame = Frame::new().fill(style::BACK).inner_margin(Margin::same(8));
        frame.show(ui, |ui| contents(ui, space.size()));
    });
}
