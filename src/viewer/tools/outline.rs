//! The outline of the selected object: the silhouette of its visible part, found by rays on a background thread.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use egui::{Color32, Context, LayerId, Stroke};
use glam::DVec2;

use crate::client::window::action::ActionQueue;
use crate::client::window::panel::{PanelData, PictureArea, ToolPresence, style};
use crate::job::{Job, StopFlag};
use crate::stream::Epoch;
use crate::tracer::{Camera, Scene};
use crate::viewer::tools::tool::{Tool, ToolContext};

/// The selected object is outlined once nothing has been edited for this long.
const STILL: Duration = Duration::from_millis(60);

/// Most grid cells along the longer side of the picture.
const CELLS: u32 = 512;

/// Lens numbers of the ray through the centre of the lens.
const CENTER: [f32; 2] = [0.5; 2];

/// Line segments in pixels of the picture.
type OutlineLines = Vec<[[f32; 2]; 2]>;

/// Inputs of an outline: shape, epoch and picture size.
#[derive(Clone, Copy, Debug, PartialEq)]
struct OutlineKey {
    shape: u32,
    epoch: Epoch,
    size: [u32; 2],
}

/// An outline being traced.
struct TracedOutline {
    key: OutlineKey,
    job: Job<OutlineLines>,
}

/// The outline of the selected object.
#[derive(Default)]
pub struct Outline {
    traced: Option<TracedOutline>,
    known: Option<(OutlineKey, Arc<OutlineLines>)>,
    /// The outline as the panel shows it.
    drawn: Option<Arc<OutlineLines>>,
}

impl Tool for Outline {
    type Action = Infallible;

    /// Begins to trace the outline of the selected object once the view has come to rest.
    fn poll(&mut self, context: &mut ToolContext<'_>) -> bool {
        let has_new = self.take();
        let (size, epoch) = (context.session.size(), context.session.epoch());
        let key = context.editor.selected().map(|shape| OutlineKey { shape, epoch, size });
        if self.follows(key) {
            return has_new;
        }
        let Some(key) = key else {
            self.clear();
            return has_new;
        };
        let picture = &context.picture;
        let rests = !context.session.is_stale() && picture.is_seen() && picture.since_edit() > STILL;
        if let Some(camera) = context.editor.seeing_camera(size).ok().filter(|_| rests) {
            self.begin(key, context.editor.scene(), camera);
        }
        has_new
    }

    fn update(&mut self, context: &mut ToolContext<'_>, _: &mut PanelData) {
        let (epoch, size) = (context.session.epoch(), context.session.size());
        let known = self.known.as_ref().filter(|(key, _)| key.epoch == epoch && key.size == size);
        self.drawn = known.map(|(_, lines)| lines.clone());
    }

    fn over_picture(&mut self, ctx: &Context, picture: PictureArea, _: &mut ActionQueue<Infallible>) {
        if let Some(lines) = &self.drawn {
            draw(ctx, picture, lines);
        }
    }

    fn presence(&self, context: &ToolContext<'_>) -> ToolPresence {
        if context.editor.selected().is_some() { ToolPresence::Drawn } else { ToolPresence::Hidden }
    }

    fn is_busy(&self) -> bool {
        self.traced.is_some()
    }
}

impl Outline {
    /// Whether the outline of this key is traced or being traced.
    fn follows(&self, key: Option<OutlineKey>) -> bool {
        let traced = self.traced.as_ref().map(|traced| traced.key);
        traced.or(self.known.as_ref().map(|(key, _)| *key)) == key
    }

    /// Forgets the outline.
    fn clear(&mut self) {
        (self.traced, self.known) = (None, None);
    }

    /// Begins to trace an outline, which replaces the present one.
    fn begin(&mut self, key: OutlineKey, scene: Arc<Scene>, camera: Camera) {
        self.clear();
        let job = Job::start("the outline", move |stop| outline(&scene, &camera, key, stop));
        // If no thread can be started there is no outline; the panel still names the selection.
        self.traced = job.ok().map(|job| TracedOutline { key, job });
    }

    /// Takes over a traced outline; true if there is a new one.
    fn take(&mut self) -> bool {
        let Some(traced) = self.traced.take_if(|traced| traced.job.is_finished()) else { return false };
        let lines = traced.job.wait().inspect_err(|panic| tracing::error!("{panic}"));
        self.known = lines.ok().map(|lines| (traced.key, Arc::new(lines)));
        true
    }
}

/// Outline of the selected object, with a dark line beneath so that it is visible on any picture.
fn draw(ctx: &Context, picture: PictureArea, lines: &[[[f32; 2]; 2]]) {
    let place = picture.area.intersect(picture.whole());
    let painter = ctx.layer_painter(LayerId::background()).with_clip_rect(place);
    let point = |[x, y]: [f32; 2]| picture.seen(DVec2::new(f64::from(x), f64::from(y)));
    let seen = lines.iter().filter_map(|[from, to]| Some([point(*from)?, point(*to)?]));
    let seen: Vec<_> = seen.collect();
    for (width, color) in [(3.0, Color32::from_black_alpha(110)), (1.2, style::ACCENT)] {
        for line in &seen {
            painter.line_segment(*line, Stroke::new(width, color));
        }
    }
}

/// Traces a ray through the centre of every grid cell and follows the border of the cells that see the shape.
fn outline(scene: &Scene, camera: &Camera, key: OutlineKey, stop: &StopFlag) -> OutlineLines {
    let [width, height] = key.size;
    let step = width.max(height).div_ceil(CELLS).max(1);
    let [columns, rows] = [width, height].map(|n| n.div_ceil(step));
    let place = |i: u32, of: u32| (f64::from(i * step) + 0.5 * f64::from(step)) / f64::from(of);
    let mut seen = vec![false; (columns * rows) as usize];
    for y in 0..rows {
        if stop.is_set() {
            return Vec::new();
        }
        for x in 0..columns {
            let ray = camera.ray([place(x, width), place(y, height)], CENTER);
            let pick = ray.and_then(|ray| scene.pick(&ray));
            seen[(y * columns + x) as usize] = pick.is_some_and(|pick| pick.shape == key.shape);
        }
    }
    border(&seen, columns as usize, step as f32)
}

/// Marching squares over the cell centres; cells outside the grid count as not seeing the shape.
fn border(seen: &[bool], columns: usize, step: f32) -> OutlineLines {
    let rows = seen.len() / columns.max(1);
    let cell = |x: i64, y: i64| {
        let inside = x >= 0 && y >= 0 && x < columns as i64 && y < rows as i64;
        inside && seen[y as usize * columns + x as usize]
    };
    let mut lines = Vec::new();
    for y in -1..rows as i64 {
        for x in -1..columns as i64 {
            let at = |dx: f32, dy: f32| [(x as f32 + 0.5 + dx) * step, (y as f32 + 0.5 + dy) * step];
            let [top, right, bottom, left] = [at(0.5, 0.0), at(1.0, 0.5), at(0.5, 1.0), at(0.0, 0.5)];
            let corners = [cell(x, y), cell(x + 1, y), cell(x + 1, y + 1), cell(x, y + 1)];
            let pairs: &[[[f32; 2]; 2]] = match corners.map(u8::from) {
                [0, 0, 0, 0] | [1, 1, 1, 1] => &[],
                [1, 0, 0, 0] | [0, 1, 1, 1] => &[[left, top]],
                [0, 1, 0, 0] | [1, 0, 1, 1] => &[[top, right]],
                [0, 0, 1, 0] | [1, 1, 0, 1] => &[[right, bottom]],
                [0, 0, 0, 1] | [1, 1, 1, 0] => &[[bottom, left]],
                [1, 1, 0, 0] | [0, 0, 1, 1] => &[[left, right]],
                [1, 0, 0, 1] | [0, 1, 1, 0] => &[[top, bottom]],
                [1, 0, 1, 0] => &[[left, top], [right, bottom]],
                _ => &[[top, right], [bottom, left]],
            };
            lines.extend_from_slice(pairs);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn borders_are_closed() {
        // Every end point is shared by another segment.
        let mut random = crate::math::random::Random(3);
        let seen: Vec<bool> = (0..15 * 11).map(|_| random.f64() < 0.5).collect();
        let lines = border(&seen, 15, 2.0);
        let mut ends = std::collections::HashMap::new();
        for end in lines.iter().flatten() {
            *ends.entry(end.map(f32::to_bits)).or_insert(0) += 1;
        }
        assert!(!lines.is_empty() && ends.values().all(|count| *count == 2), "{ends:?}");
        assert_eq!(border(&[true], 1, 1.0).len(), 4);
        assert!(border(&[false; 6], 3, 1.0).is_empty());
    }

    #[test]
    fn a_ball_has_a_circle() {
        let text = "<scene version=\"3.0.0\"><sensor type=\"orthographic\"><transform name=\"to_world\">\
                    <lookat origin=\"0,0,5\" target=\"0,0,0\" up=\"0,1,0\"/></transform>\
                    <film type=\"hdrfilm\"><integer name=\"width\" value=\"300\"/>\
                    <integer name=\"height\" value=\"300\"/></film></sensor>\
                    <shape type=\"sphere\"><float name=\"radius\" value=\"0.5\"/></shape><emitter type=\"constant\"/></scene>";
        let desc = crate::scene::load_str("t.xml", text, &[]).expect("valid").desc;
        let (scene, camera) = (Scene::prepare(&desc).expect("valid"), Camera::of(&desc).expect("valid"));
        let key = OutlineKey { shape: 0, epoch: Epoch(1), size: [300, 300] };
        let lines = outline(&scene, &camera, key, &StopFlag::default());
        assert!(lines.len() > 100);
        for [x, y] in lines.iter().flatten() {
            let radius = (x - 150.0).hypot(y - 150.0);
            // The picture spans −1 to 1.
            assert!((radius - 75.0).abs() < 1.5, "{radius}");
        }
    }
}
