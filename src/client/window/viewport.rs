//! Placement of the picture in the window: its area beside the panel, and the visible part of the picture with its zoom.
//!
//! The area begins at the window's left top corner. The picture size is independent of it: initially the whole picture is fitted to the
//! area and centred. Resizing the window, zooming and panning change only what is displayed; no sample is traced or rasterised again.
//!
//! What is displayed is the picture, or a view into it where it is a panorama. Only here a position of the window becomes one of the picture.

use glam::{DVec2, UVec2};

use crate::client::post_process::PanoramaView;
use crate::gpu::{CopyFilter, CopyRegion};
use crate::image::stereo::{Eye, StereoLayout};

/// Largest zoom, window pixels per picture pixel.
pub const MOST_ZOOM: f64 = 64.0;

/// Factor on the zoom per step of the wheel.
const ZOOM_STEP: f64 = 1.25;

/// Zoom from which on a grid separates the pixels.
pub const GRID_ZOOM: f64 = 8.0;

/// Zoom from which on pixels have hard edges, whatever their size.
const HARD_ZOOM: f64 = 4.0;

/// The area of the picture in the window, and the part of the picture that it shows. Positions are physical pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewport {
    /// Size of the area.
    area: UVec2,
    /// Size of the picture; of two eyes that of the composed one.
    picture: UVec2,
    /// How the picture is composed of those of two eyes, and the size of each; `None` for one eye.
    eyes: Option<(StereoLayout, UVec2)>,
    /// Selected zoom in window pixels per picture pixel; `None` fits the whole picture to the area.
    zoom: Option<f64>,
    /// Displayed position at the left top corner of the area.
    origin: DVec2,
    /// The view into a panorama that is displayed in its place, at its size.
    look_around: Option<PanoramaView>,
}

impl Viewport {
    /// The whole picture of this size, as large as it is.
    pub fn new(size: [u32; 2]) -> Self {
        let size = UVec2::from(size).max(UVec2::ONE);
        Self { area: size, picture: size, eyes: None, zoom: None, origin: DVec2::ZERO, look_around: None }
    }

    /// Sets the sizes of the area and of the picture of an eye; with a layout, the picture is composed of two of them.
    pub fn set_sizes_of_eyes(&mut self, area: [u32; 2], eye: [u32; 2], layout: Option<StereoLayout>) {
        let size = |layout: StereoLayout| layout.size(eye.map(|n| n as usize));
        let composed = layout.and_then(|layout| Some((layout, size(layout)?.map(|n| n as u32))));
        self.set_sizes(area, composed.map_or(eye, |(_, size)| size));
        self.eyes = composed.map(|(layout, _)| (layout, UVec2::from(eye)));
    }

    /// This viewport with all of a picture of this size, one that was painted in another layout.
    pub fn whole_of(&self, picture: [u32; 2]) -> Self {
        let mut whole = *self;
        whole.set_sizes(self.area.to_array(), picture);
        whole.reset();
        whole
    }

    /// How the picture is composed of those of two eyes; `None` for one eye.
    pub fn layout(&self) -> Option<StereoLayout> {
        self.eyes.map(|(layout, _)| layout)
    }

    /// Size of the picture of an eye.
    pub fn eye(&self) -> DVec2 {
        self.eyes.map_or(self.picture, |(_, size)| size).as_dvec2()
    }

    /// The eye whose picture is shown at a window position, and the displayed place in it; `None` where there is no picture.
    pub fn place_of_eye(&self, at: DVec2) -> Option<(Eye, DVec2)> {
        let place = Some(self.to_shown(at)).filter(|_| self.contains(at))?;
        let Some((layout, size)) = self.eyes else { return Some((Eye::Left, place)) };
        let (eye, place) = layout.place_of_eye(size.to_array().map(|n| n as usize), place.to_array())?;
        Some((eye, place.into()))
    }

    /// Converts a window position to a place in the left eye's picture, as if that went on beyond its edges.
    pub fn to_left_eye(&self, at: DVec2) -> DVec2 {
        let (corner, scale) = self.left_eye();
        (self.to_shown(at) - corner) / scale
    }

    /// Converts a place in the left eye's picture to a window position.
    pub fn of_left_eye(&self, place: DVec2) -> DVec2 {
        let (corner, scale) = self.left_eye();
        self.to_window(corner + scale * place)
    }

    /// Corner and scale of the left eye's picture in the composed one.
    fn left_eye(&self) -> (DVec2, DVec2) {
        let Some((layout, size)) = self.eyes else { return (DVec2::ZERO, DVec2::ONE) };
        let (corner, scale) = layout.left_eye(size.as_dvec2().to_array());
        (corner.into(), scale.into())
    }

    /// Sets the sizes of area and picture. The picture point in the middle of the area stays there, and so does the zoom unless the picture
    /// is fitted.
    pub fn set_sizes(&mut self, area: [u32; 2], picture: [u32; 2]) {
        let (area, picture) = (UVec2::from(area).max(UVec2::ONE), UVec2::from(picture).max(UVec2::ONE));
        if (area, picture) == (self.area, self.picture) {
            return;
        }
        let middle = self.to_shown(0.5 * self.area.as_dvec2()) / self.picture.as_dvec2();
        (self.area, self.picture) = (area, picture);
        self.zoom = self.zoom.filter(|zoom| (self.least_zoom()..=self.most_zoom()).contains(zoom));
        self.origin = middle * picture.as_dvec2() - 0.5 * area.as_dvec2() / self.zoom();
        self.keep_inside();
    }

    /// Sets the view into a panorama that is displayed in its place.
    pub fn set_look_around(&mut self, view: Option<PanoramaView>) {
        self.look_around = view;
        self.keep_inside();
    }

    /// Whether the picture itself is displayed, and no view into it.
    pub fn is_flat(&self) -> bool {
        self.look_around.is_none()
    }

    /// Zoom at which the picture fits the area, or the frame of a view into it, about which the area shows more where there is room.
    fn fit(&self) -> f64 {
        let picture = self.picture.as_dvec2();
        let framed = self.look_around.map_or(picture, |_| PanoramaView::frame(picture));
        (self.area.as_dvec2() / framed).min_element()
    }

    /// Smallest zoom: the fitted one, or 1:1 if that is smaller.
    fn least_zoom(&self) -> f64 {
        self.fit().min(1.0)
    }

    fn most_zoom(&self) -> f64 {
        MOST_ZOOM.max(self.fit())
    }

    fn set_zoom(&mut self, zoom: f64) {
        let zoom = zoom.clamp(self.least_zoom(), self.most_zoom());
        self.zoom = Some(zoom).filter(|zoom| (zoom / self.fit() - 1.0).abs() > 1e-9);
    }

    /// Size of the area.
    pub fn area(&self) -> DVec2 {
        self.area.as_dvec2()
    }

    /// Size of the picture.
    pub fn picture(&self) -> DVec2 {
        self.picture.as_dvec2()
    }

    /// Window pixels per picture pixel.
    pub fn zoom(&self) -> f64 {
        self.zoom.unwrap_or(self.fit())
    }

    /// Whether the picture is fitted to the area.
    pub fn is_whole(&self) -> bool {
        self.zoom.is_none()
    }

    /// Whether a window position lies in the area and on the picture, and there is a position of the picture behind it.
    pub fn contains(&self, at: DVec2) -> bool {
        let is_within = |at: DVec2, size: DVec2| at.cmpge(DVec2::ZERO).all() && at.cmplt(size).all();
        let shown = self.to_shown(at);
        is_within(at, self.area()) && is_within(shown, self.picture()) && self.behind(shown).is_some()
    }

    /// Converts a window position to a position of the picture, which a view into a panorama shows there; to the displayed one where it shows
    /// nothing ([`contains`](Self::contains) is false there).
    pub fn to_picture(&self, at: DVec2) -> DVec2 {
        let shown = self.to_shown(at);
        self.behind(shown).unwrap_or(shown)
    }

    /// The position of the picture that is displayed at this one.
    fn behind(&self, shown: DVec2) -> Option<DVec2> {
        match self.look_around {
            Some(view) => view.to_picture(shown, self.picture.as_vec2()),
            None => Some(shown),
        }
    }

    /// Converts a picture position, of two eyes one of the left, to the window position that shows it; `None` where a view into a panorama does not.
    pub fn seen(&self, place: DVec2) -> Option<DVec2> {
        let shown = match self.look_around {
            Some(view) => view.to_shown(place, self.picture.as_vec2())?,
            None => place,
        };
        Some(self.of_left_eye(shown))
    }

    /// Converts a window position to a displayed position.
    pub fn to_shown(&self, at: DVec2) -> DVec2 {
        self.origin + at / self.zoom()
    }

    /// Converts a displayed position to a window position.
    pub fn to_window(&self, place: DVec2) -> DVec2 {
        (place - self.origin) * self.zoom()
    }

    /// Zooms in by steps of the wheel (out if negative) about `at`. Returns whether anything changed.
    pub fn zoom_at(&mut self, at: DVec2, steps: f64) -> bool {
        let (now, fit) = (self.zoom(), self.fit());
        let zoom = now * ZOOM_STEP.powf(steps);
        // Zooming stops at the fitted picture instead of passing it, and snaps to nearby whole pixel sizes; small touchpad steps could
        // otherwise never leave those.
        let passes_fit = (now < fit && fit < zoom) || (zoom < fit && fit < now);
        let is_near = zoom > 1.0 && steps.abs() >= 1.0 && (zoom - zoom.round()).abs() < 0.06 * zoom;
        self.zoom_to(
            at,
            if passes_fit {
                fit
            } else if is_near {
                zoom.round()
            } else {
                zoom
            },
        )
    }

    /// Shows the picture at 1:1, keeping the point at `at` in place. Returns whether anything changed.
    pub fn show_pixels(&mut self, at: DVec2) -> bool {
        self.zoom_to(at, 1.0)
    }

    fn zoom_to(&mut self, at: DVec2, zoom: f64) -> bool {
        let before = *self;
        let place = self.to_shown(at);
        self.set_zoom(zoom);
        self.origin = place - at / self.zoom();
        self.keep_inside();
        *self != before
    }

    /// Pans by window pixels; returns whether anything changed.
    pub fn pan(&mut self, by: DVec2) -> bool {
        let before = *self;
        self.origin -= by / self.zoom();
        self.keep_inside();
        *self != before
    }

    /// Fits the whole picture; returns whether anything changed.
    pub fn reset(&mut self) -> bool {
        let before = *self;
        self.zoom = None;
        self.keep_inside();
        *self != before
    }

    /// Clamps the origin: a picture larger than the area covers it, a smaller one is centred.
    fn keep_inside(&mut self) {
        let (shown, picture) = (self.area() / self.zoom(), self.picture());
        for i in 0..2 {
            let rest = self.area()[i] - picture[i] * self.zoom();
            self.origin[i] = match rest > -1e-6 {
                true => -(0.5 * rest.max(0.0)).floor() / self.zoom(),
                // The frame of a view is in the middle of a strip.
                false if self.zoom.is_none() => 0.5 * (picture[i] - shown[i]),
                false => self.origin[i].clamp(0.0, picture[i] - shown[i]),
            };
        }
    }

    /// Interpolation between texels: nearest for whole pixel sizes and magnified pixels, so that they keep hard edges.
    pub fn filter(&self) -> CopyFilter {
        let zoom = self.zoom();
        match zoom >= HARD_ZOOM || zoom == zoom.round() {
            true => CopyFilter::Nearest,
            false => CopyFilter::Linear,
        }
    }

    /// Copy regions that show the picture in a window of this extent: fully visible pixels, and those cut by the edges.
    pub fn copies(&self, extent: [u32; 2]) -> Vec<CopyRegion> {
        let end = self.area.min(UVec2::from(extent));
        let axes: [Vec<AxisCopy>; 2] =
            [0, 1].map(|i| along(self.origin[i], self.zoom(), self.picture[i], f64::from(end[i])));
        let [columns, rows] = &axes;
        let both = |y: &AxisCopy, x: &AxisCopy| CopyRegion {
            from: [[x.from[0], y.from[0]], [x.from[1], y.from[1]]],
            to: [[x.to[0], y.to[0]], [x.to[1], y.to[1]]],
        };
        rows.iter().flat_map(|y| columns.iter().map(move |x| both(y, x))).collect()
    }
}

/// The copies along one axis into the pixels 0 … `end` of the window, of a picture with `scale` window pixels per pixel.
fn along(origin: f64, scale: f64, picture: u32, end: f64) -> Vec<AxisCopy> {
    let (from, last) = (origin.max(0.0), f64::from(picture).min(origin + end / scale));
    // Rounding errors must not cut a pixel.
    let last = if (last - last.round()).abs() < 1e-6 { last.round() } else { last };
    let place = |pixel: f64| ((pixel - origin) * scale).round().clamp(0.0, end) as i32;
    // Fully visible pixels, between those that are cut.
    let (first, after) = (from.ceil(), last.floor());
    let spans = match first <= after {
        true => vec![(from.floor(), first), (first, after), (after, last.ceil())],
        // Less than one pixel is visible.
        false => vec![(from.floor(), last.ceil())],
    };
    let spans = spans.into_iter().filter(|(from, to)| to > from);
    let copies =
        spans.map(|(from, to)| AxisCopy { from: [from as i32, to as i32], to: [place(from), place(to)] });
    copies.filter(|copy| copy.to[1] > copy.to[0]).collect()
}

/// One axis of a copy: source pixels of the picture, and target pixels of the window.
struct AxisCopy {
    from: [i32; 2],
    to: [i32; 2],
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::post_process::PanoramaProjection;

    /// The picture pixel that the copies bring to every window pixel.
    fn shown(view: &Viewport, extent: [u32; 2]) -> Vec<Option<[i32; 2]>> {
        let [width, height] = extent.map(|n| n as usize);
        let mut seen = vec![None; width * height];
        for CopyRegion { from, to } in view.copies(extent) {
            let scale = [0, 1].map(|i| f64::from(from[1][i] - from[0][i]) / f64::from(to[1][i] - to[0][i]));
            for y in to[0][1]..to[1][1] {
                for x in to[0][0]..to[1][0] {
                    let texel = |at: i32, i: usize| {
                        from[0][i] + ((f64::from(at - to[0][i]) + 0.5) * scale[i]).floor() as i32
                    };
                    let place = &mut seen[y as usize * width + x as usize];
                    assert_eq!(*place, None, "({x}, {y}) is drawn twice");
                    *place = Some([texel(x, 0), texel(y, 1)]);
                }
            }
        }
        seen
    }

    #[test]
    fn the_whole_picture_is_one_copy_without_scaling() {
        let view = Viewport::new([40, 30]);
        assert_eq!(view.copies([40, 30]), [CopyRegion { from: [[0, 0], [40, 30]], to: [[0, 0], [40, 30]] }]);
        // Beside a panel, and in a window smaller than the area.
        assert_eq!(view.copies([90, 30]), view.copies([40, 30]));
        assert_eq!(view.copies([20, 30])[0].from, [[0, 0], [20, 30]]);
    }

    /// Every pixel of the area shows the picture pixel given by `to_picture`, at any zoom and origin.
    #[test]
    fn copies_agree_with_the_mapping() {
        let mut view = Viewport::new([40, 30]);
        let mut random = crate::math::random::Random(7);
        for _ in 0..200 {
            let at = DVec2::new(random.f64() * 40.0, random.f64() * 30.0);
            view.zoom_at(at, (random.f64() * 8.0 - 3.0).round());
            view.pan(DVec2::new(random.f64() * 20.0 - 10.0, random.f64() * 20.0 - 10.0));
            for (i, pixel) in shown(&view, [40, 30]).into_iter().enumerate() {
                let middle = DVec2::new((i % 40) as f64 + 0.5, (i / 40) as f64 + 0.5);
                let place = view.to_picture(middle);
                let pixel = pixel.unwrap_or_else(|| panic!("{middle} is not drawn: {view:?}"));
                for axis in 0..2 {
                    // Non-integer pixel sizes are rounded.
                    let away = place[axis] - f64::from(pixel[axis]) - 0.5;
                    assert!(away.abs() < 0.5 + 1.0 / view.zoom(), "{middle}: {pixel:?}, {place}, {view:?}");
                }
            }
        }
    }

    /// A view into a panorama maps the middle of the window to its direction; magnified it maps as before.
    #[test]
    fn views_into_panoramas_are_mapped() {
        let mut view = Viewport::new([400, 200]);
        let ahead = PanoramaView::ahead(PanoramaProjection::Spherical);
        view.set_look_around(Some(PanoramaView { yaw: 90.0, ..ahead }));
        let middle = DVec2::new(200.0, 100.0);
        assert!(!view.is_flat() && view.to_shown(middle) == middle);
        assert!(view.to_picture(middle).distance(DVec2::new(300.0, 100.0)) < 1e-3, "a quarter to the right");
        let at = DVec2::new(123.0, 77.0);
        for _ in 0..4 {
            let place = view.to_picture(at);
            assert!(view.seen(place).is_some_and(|seen| seen.distance(at) < 0.05 * view.zoom()), "{view:?}");
            assert!(view.zoom_at(at, 3.0) && view.to_picture(at).distance(place) < 2.0 / view.zoom());
        }
        assert_eq!(view.seen(DVec2::new(100.0, 100.0)), None, "behind");
    }

    /// A view into a strip of faces fills the area with its frame; flat, the whole strip is shown.
    #[test]
    fn views_into_strips_are_framed() {
        let mut view = Viewport::new([600, 100]);
        view.set_sizes([400, 300], [600, 100]);
        let flat = view;
        view.set_look_around(Some(PanoramaView::ahead(PanoramaProjection::CubeRow)));
        assert!(view.zoom() == 2.0 && view.is_whole());
        assert!(view.to_shown(DVec2::new(200.0, 150.0)).distance(DVec2::new(300.0, 50.0)) < 1e-9);
        let [copy] = view.copies([400, 300])[..] else { panic!("{view:?}") };
        assert_eq!(copy, CopyRegion { from: [[200, 0], [400, 100]], to: [[0, 50], [400, 250]] });
        // In the middle of the view is the face in front, the fifth.
        assert!(view.to_picture(DVec2::new(200.0, 150.0)).distance(DVec2::new(450.0, 50.0)) < 1e-3);
        view.set_look_around(None);
        assert_eq!(view, flat);
    }

    #[test]
    fn zooming_keeps_the_place_under_the_cursor() {
        let mut view = Viewport::new([400, 300]);
        let at = DVec2::new(123.0, 77.0);
        let place = view.to_picture(at);
        while view.zoom_at(at, 1.0) {
            assert!(view.to_picture(at).distance(place) < 1.0 / view.zoom(), "{view:?}");
        }
        assert_eq!(view.zoom(), MOST_ZOOM);
        while view.zoom_at(at, -1.0) {}
        assert_eq!(view, Viewport::new([400, 300]));
        assert!(!view.pan(DVec2::splat(50.0)), "nothing lies beyond the edge");
    }

    #[test]
    fn less_than_a_pixel_fills_the_area() {
        let mut view = Viewport::new([10, 10]);
        while view.zoom_at(DVec2::new(4.7, 4.7), 1.0) {}
        assert!(shown(&view, [10, 10]).iter().all(Option::is_some), "{view:?}");
    }

    /// The whole picture is fitted to an area of any size and shape and centred, and its pixels are where the mapping says.
    #[test]
    fn the_whole_picture_fills_the_area() {
        let mut view = Viewport::new([40, 30]);
        for area in [[80, 30], [80, 60], [41, 29], [13, 90], [3, 2], [1, 1], [640, 480], [40, 30]] {
            view.set_sizes(area, [40, 30]);
            let [copy] = view.copies(area)[..] else { panic!("{area:?}: {view:?}") };
            assert_eq!(copy.from, [[0, 0], [40, 30]]);
            let size = [0, 1].map(|i| copy.to[1][i] - copy.to[0][i]);
            let fills = |i: usize| copy.to[0][i] == 0 && copy.to[1][i] == area[i] as i32;
            assert!(fills(0) || fills(1), "{area:?}: {copy:?}");
            for i in 0..2 {
                let rest = area[i] as i32 - copy.to[1][i];
                assert!((0..=1).contains(&(rest - copy.to[0][i])), "{area:?}: {copy:?}");
            }
            if area[0] >= 13 {
                let shape = f64::from(size[0]) / f64::from(size[1]);
                assert!((shape * 0.75 - 1.0).abs() < 0.1, "{area:?}: {size:?}");
            }
            for (corner, place) in [(copy.to[0], DVec2::ZERO), (copy.to[1], DVec2::new(40.0, 30.0))] {
                let at = view.to_window(place) - DVec2::from(corner.map(f64::from));
                assert!(at.abs().max_element() < 1.0, "{area:?}: {at}");
            }
        }
        assert_eq!(view, Viewport::new([40, 30]));
    }

    /// Zooming out of a picture smaller than the area passes the fitted size and ends at 1:1.
    #[test]
    fn a_small_picture_can_be_shown_as_it_is() {
        let mut view = Viewport::new([40, 30]);
        view.set_sizes([100, 100], [40, 30]);
        assert_eq!((view.zoom(), view.is_whole()), (2.5, true));
        assert!(!view.contains(DVec2::new(50.0, 5.0)) && view.contains(DVec2::new(50.0, 50.0)));
        let middle = DVec2::splat(50.0);
        assert!(view.zoom_at(middle, 1.0) && view.zoom_at(middle, -3.0));
        assert!(view.is_whole(), "the whole picture is not passed by");
        assert!(view.show_pixels(middle) && !view.is_whole());
        assert_eq!(
            view.copies([100, 100]),
            [CopyRegion { from: [[0, 0], [40, 30]], to: [[30, 35], [70, 65]] }]
        );
        assert!(!view.zoom_at(middle, -1.0), "{view:?}");
        assert!(view.reset() && view.is_whole());
        // A large picture is reduced.
        view.set_sizes([100, 100], [400, 300]);
        assert_eq!(view.zoom(), 0.25);
        assert!(!view.zoom_at(middle, -1.0) && view.zoom_at(middle, 20.0));
        let zoom = view.zoom();
        view.set_sizes([200, 100], [400, 300]);
        assert_eq!(view.zoom(), zoom, "a window that is resized leaves it");
    }

    /// What is drawn at a place of the left eye's picture is found there by the pointer, at any zoom.
    #[test]
    fn both_eyes_are_found() {
        let mut view = Viewport::new([40, 30]);
        view.set_sizes_of_eyes([100, 30], [40, 30], Some(StereoLayout::SideBySide));
        assert_eq!((view.picture(), view.eye()), (DVec2::new(80.0, 30.0), DVec2::new(40.0, 30.0)));
        let place = DVec2::new(12.5, 7.5);
        for steps in [0.0, 3.0] {
            view.zoom_at(DVec2::new(20.0, 10.0), steps);
            let at = view.of_left_eye(place);
            let (eye, found) = view.place_of_eye(at).expect("within the area");
            assert!(eye == Eye::Left && found.distance(place) < 1e-9, "{found}");
            assert!(view.to_left_eye(at).distance(place) < 1e-9);
        }
        view.reset();
        let (eye, found) = view.place_of_eye(view.to_window(DVec2::new(52.5, 7.5))).expect("within the area");
        assert!(eye == Eye::Right && found.distance(place) < 1e-9, "{found}");
        let painted = view.whole_of([40, 30]);
        assert!(painted.is_whole() && painted.picture() == DVec2::new(40.0, 30.0));
        view.set_sizes_of_eyes([40, 30], [40, 30], None);
        assert_eq!(view, Viewport::new([40, 30]));
    }

    #[test]
    fn another_size_keeps_the_middle() {
        let mut view = Viewport::new([400, 300]);
        view.zoom_at(DVec2::new(200.0, 150.0), 6.0);
        let middle = |view: &Viewport| view.to_picture(0.5 * view.area()) / view.picture.as_dvec2();
        let before = middle(&view);
        view.set_sizes([800, 600], [800, 600]);
        assert!(middle(&view).distance(before) < 0.01, "{} {before}", middle(&view));
    }
}
