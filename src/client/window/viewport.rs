//! Where the picture lies in the window: its area beside the panel, and which part of the picture is shown there how large.
//!
//! The area begins at the window's left top corner. At zoom 1 a pixel of the picture is one of the window. Zooming and panning
//! change only what is shown: no sample is traced or drawn anew.

use glam::{DVec2, UVec2};

use crate::gpu::CopyRegion;

/// Largest zoom, window pixels per picture pixel.
pub const MOST_ZOOM: f64 = 64.0;

/// Factor on the zoom per step of the wheel.
const ZOOM_STEP: f64 = 1.25;

/// From this zoom on a grid separates the pixels.
pub const GRID_ZOOM: f64 = 8.0;

/// The area of the picture in the window, and the part of the picture that it shows. Positions are physical pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewport {
    /// Size of the area.
    area: UVec2,
    /// Size of the picture.
    picture: UVec2,
    /// Factor on the picture, from 1 on.
    zoom: f64,
    /// Window pixels per picture pixel at zoom 1: 1, or what fills the area while the picture waits for another size.
    stretch: DVec2,
    /// The point of the picture at the left top corner of the area.
    origin: DVec2,
}

impl Viewport {
    /// The whole picture of this size, as large as it is.
    pub fn new(size: [u32; 2]) -> Self {
        let size = UVec2::from(size).max(UVec2::ONE);
        Self { area: size, picture: size, zoom: 1.0, stretch: DVec2::ONE, origin: DVec2::ZERO }
    }

    /// The area and the picture have these sizes now; the point in the middle of the area stays there. A `stretched` picture fills the
    /// area at zoom 1.
    pub fn set_sizes(&mut self, area: [u32; 2], picture: [u32; 2], stretched: bool) {
        let (area, picture) = (UVec2::from(area).max(UVec2::ONE), UVec2::from(picture).max(UVec2::ONE));
        let stretch = if stretched { area.as_dvec2() / picture.as_dvec2() } else { DVec2::ONE };
        if (area, picture, stretch) == (self.area, self.picture, self.stretch) {
            return;
        }
        let middle = self.to_picture(0.5 * self.area.as_dvec2()) / self.picture.as_dvec2();
        (self.area, self.picture, self.stretch) = (area, picture, stretch);
        self.origin = middle * picture.as_dvec2() - 0.5 * area.as_dvec2() / self.scale();
        self.keep_inside();
    }

    /// Window pixels per picture pixel along both axes.
    fn scale(&self) -> DVec2 {
        self.zoom * self.stretch
    }

    /// Size of the area.
    pub fn area(&self) -> DVec2 {
        self.area.as_dvec2()
    }

    /// Size of the picture.
    pub fn picture(&self) -> DVec2 {
        self.picture.as_dvec2()
    }

    /// Window pixels per picture pixel, where it is not stretched.
    pub fn zoom(&self) -> f64 {
        self.zoom
    }

    /// Whether a position of the window lies in the area.
    pub fn contains(&self, at: DVec2) -> bool {
        at.cmpge(DVec2::ZERO).all() && at.cmplt(self.area()).all()
    }

    /// The place in the picture that is shown at a position of the window.
    pub fn to_picture(&self, at: DVec2) -> DVec2 {
        self.origin + at / self.scale()
    }

    /// The position of the window where a place in the picture is shown.
    pub fn to_window(&self, place: DVec2) -> DVec2 {
        (place - self.origin) * self.scale()
    }

    /// Zooms in by steps of the wheel, out by negative ones; the place at `at` stays there. Returns whether anything changed.
    pub fn zoom_at(&mut self, at: DVec2, steps: f64) -> bool {
        let before = *self;
        let zoom = (self.zoom * ZOOM_STEP.powf(steps)).clamp(1.0, MOST_ZOOM);
        // Pixels have whole sizes where that is near; the small steps of a touchpad would never leave those.
        let is_near = steps.abs() >= 1.0 && (zoom - zoom.round()).abs() < 0.06 * zoom;
        let place = self.to_picture(at);
        self.zoom = if is_near { zoom.round() } else { zoom };
        self.origin = place - at / self.scale();
        self.keep_inside();
        *self != before
    }

    /// Moves the picture by this many pixels of the window; returns whether anything changed.
    pub fn pan(&mut self, by: DVec2) -> bool {
        let before = *self;
        self.origin -= by / self.scale();
        self.keep_inside();
        *self != before
    }

    /// Shows the whole picture as large as it is; returns whether anything changed.
    pub fn reset(&mut self) -> bool {
        let before = *self;
        self.zoom = 1.0;
        self.keep_inside();
        *self != before
    }

    /// The area shows only the picture: its edge is not drawn into it. A picture that is smaller than the area lies at its left top.
    fn keep_inside(&mut self) {
        let most = (self.picture.as_dvec2() - self.area() / self.scale()).max(DVec2::ZERO);
        self.origin = self.origin.clamp(DVec2::ZERO, most);
    }

    /// The copies that show the picture in a window of this extent: pixels of the picture that are wholly visible, and those that
    /// the edges cut.
    pub fn copies(&self, extent: [u32; 2]) -> Vec<CopyRegion> {
        let end = self.area.min(UVec2::from(extent));
        let axes: [Vec<AxisCopy>; 2] =
            [0, 1].map(|i| along(self.origin[i], self.scale()[i], self.picture[i], f64::from(end[i])));
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
    let last = f64::from(picture).min(origin + end / scale);
    // Rounding cuts no pixel.
    let last = if (last - last.round()).abs() < 1e-6 { last.round() } else { last };
    let place = |pixel: f64| ((pixel - origin) * scale).round().clamp(0.0, end) as i32;
    // The wholly visible ones, between those that are cut.
    let (first, after) = (origin.ceil(), last.floor());
    let spans = match first <= after {
        true => vec![(origin.floor(), first), (first, after), (after, last.ceil())],
        // Less than a pixel.
        false => vec![(origin.floor(), last.ceil())],
    };
    let spans = spans.into_iter().filter(|(from, to)| to > from);
    let copies =
        spans.map(|(from, to)| AxisCopy { from: [from as i32, to as i32], to: [place(from), place(to)] });
    copies.filter(|copy| copy.to[1] > copy.to[0]).collect()
}

/// One axis of a copy: from these pixels of the picture to these of the window.
struct AxisCopy {
    from: [i32; 2],
    to: [i32; 2],
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The pixel of the picture that the copies bring to every pixel of the window.
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
        // Beside a panel, and in a window that is still too small.
        assert_eq!(view.copies([90, 30]), view.copies([40, 30]));
        assert_eq!(view.copies([20, 30])[0].from, [[0, 0], [20, 30]]);
    }

    /// Every pixel of the area shows the pixel of the picture that `to_picture` names, at any zoom and place.
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
                    // Sizes of pixels that are no whole numbers are rounded.
                    let away = place[axis] - f64::from(pixel[axis]) - 0.5;
                    assert!(away.abs() < 0.5 + 1.0 / view.zoom, "{middle}: {pixel:?}, {place}, {view:?}");
                }
            }
        }
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

    /// A picture that waits for another size fills the area, larger or smaller, of any shape.
    #[test]
    fn a_stretched_picture_fills_the_area() {
        let mut view = Viewport::new([40, 30]);
        for area in [[80, 30], [41, 29], [13, 90], [3, 2], [1, 1], [40, 30]] {
            view.set_sizes(area, [40, 30], true);
            assert!(shown(&view, area).iter().all(Option::is_some), "{area:?}: {view:?}");
            let copies = view.copies(area);
            assert_eq!(
                copies,
                [CopyRegion { from: [[0, 0], [40, 30]], to: [[0, 0], area.map(|n| n as i32)] }]
            );
            assert!(view.to_picture(view.area()).distance(DVec2::new(40.0, 30.0)) < 1e-9);
        }
        view.set_sizes([40, 30], [40, 30], false);
        assert_eq!(view, Viewport::new([40, 30]));
    }

    #[test]
    fn another_size_keeps_the_middle() {
        let mut view = Viewport::new([400, 300]);
        view.zoom_at(DVec2::new(200.0, 150.0), 6.0);
        let middle = |view: &Viewport| view.to_picture(0.5 * view.area()) / view.picture.as_dvec2();
        let before = middle(&view);
        view.set_sizes([800, 600], [800, 600], false);
        assert!(middle(&view).distance(before) < 0.01, "{} {before}", middle(&view));
    }
}
