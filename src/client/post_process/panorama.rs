//! Pictures of all directions, as the tracer's cameras make them, and perspective views into them: which texels show a direction.
//!
//! Directions are in camera space (x to the left, y up, z ahead) and of any length. Places are in texels, (0, 0) at the top left corner.
//! What the shader needs is a twin of `glsl/look_around.frag`, operation by operation; the window maps its pointer by the same functions.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use clap::ValueEnum;
use glam::{DVec2, IVec2, Vec2, Vec3};

use crate::client::post_process::post_pass::number;
use crate::image::Grid;

/// How a picture shows all directions. The shader numbers the values in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PanoramaProjection {
    /// Longitude and latitude (equirectangular); the middle is ahead.
    Spherical,
    /// The same for two eyes, the left one above the right one. Views show what the left one sees.
    OverUnder,
    /// Faces of a cube, 3 × 2: right, left, up; below down, front, back.
    CubeBlock,
    /// Faces of a cube, 6 × 1: right, left, up, down, front, back.
    CubeRow,
    /// The same from top to bottom.
    CubeColumn,
    /// Faces of a cube, 4 × 3: left, front, right, back in the middle row, up and down above and below the front.
    CubeCross,
    /// A fisheye lens, by the radius of an angle θ to its axis: θ.
    FisheyeEquidistant,
    /// 2 sin(θ / 2).
    FisheyeEquisolid,
    /// 2 tan(θ / 2).
    FisheyeStereographic,
    /// sin θ.
    FisheyeOrthographic,
}

/// The faces of a cube (right, left, up, down, front, back): the directions of the middle, the right edge and the upper edge of each.
const FACES: [[Vec3; 3]; 6] = [
    [Vec3::NEG_X, Vec3::NEG_Z, Vec3::Y],
    [Vec3::X, Vec3::Z, Vec3::Y],
    [Vec3::Y, Vec3::NEG_X, Vec3::NEG_Z],
    [Vec3::NEG_Y, Vec3::NEG_X, Vec3::Z],
    [Vec3::Z, Vec3::NEG_X, Vec3::Y],
    [Vec3::NEG_Z, Vec3::X, Vec3::Y],
];

/// Column and row of each face in a cross.
const CROSS: [IVec2; 6] = [
    IVec2::new(2, 1),
    IVec2::new(0, 1),
    IVec2::new(1, 0),
    IVec2::new(1, 2),
    IVec2::new(1, 1),
    IVec2::new(3, 1),
];

impl PanoramaProjection {
    fn is_cube(self) -> bool {
        matches!(self, Self::CubeBlock | Self::CubeRow | Self::CubeColumn | Self::CubeCross)
    }

    /// Whether it is a fisheye lens, which does not show all directions.
    pub fn is_fisheye(self) -> bool {
        !self.is_cube() && !matches!(self, Self::Spherical | Self::OverUnder)
    }

    /// Largest field of view of a fisheye lens, degrees.
    fn widest(self) -> f32 {
        match self {
            Self::FisheyeOrthographic => 180.0,
            Self::FisheyeStereographic => 358.0,
            _ => 360.0,
        }
    }

    /// Radius of an angle to the axis of a fisheye lens, for the focal length 1.
    fn radius(self, angle: f32) -> f32 {
        match self {
            Self::FisheyeEquisolid => 2.0 * (0.5 * angle).sin(),
            Self::FisheyeStereographic => 2.0 * (0.5 * angle).tan(),
            Self::FisheyeOrthographic => angle.sin(),
            _ => angle,
        }
    }

    /// The angle of a radius; `None` beyond the largest.
    fn angle(self, radius: f32) -> Option<f32> {
        match self {
            Self::FisheyeEquisolid => (radius <= 2.0).then(|| 2.0 * (0.5 * radius).asin()),
            Self::FisheyeStereographic => Some(2.0 * (0.5 * radius).atan()),
            Self::FisheyeOrthographic => (radius <= 1.0).then(|| radius.asin()),
            _ => (radius <= PI).then_some(radius),
        }
    }

    /// Radius in the picture of a fisheye lens per length of a direction across its axis; `None` where it shows nothing.
    fn magnification(self, d: Vec3) -> Option<f32> {
        let length = d.length();
        match self {
            Self::FisheyeEquisolid => Some(2.0 / (2.0 * length * (length + d.z).max(1e-6 * length)).sqrt()),
            Self::FisheyeStereographic => (length + d.z > 1e-4 * length).then(|| 2.0 / (length + d.z)),
            Self::FisheyeOrthographic => (d.z >= 0.0).then(|| 1.0 / length),
            _ => {
                let across = d.truncate().length();
                Some(arc_tangent(across, d.z) / across.max(1e-20))
            }
        }
    }

    /// Columns and rows of equal cells, one for each face or eye.
    fn cells(self) -> Vec2 {
        match self {
            Self::OverUnder => Vec2::new(1.0, 2.0),
            Self::CubeBlock => Vec2::new(3.0, 2.0),
            Self::CubeRow => Vec2::new(6.0, 1.0),
            Self::CubeColumn => Vec2::new(1.0, 6.0),
            Self::CubeCross => Vec2::new(4.0, 3.0),
            _ => Vec2::ONE,
        }
    }

    /// Column and row of a face; of the eye that views show.
    fn cell(self, face: usize) -> Vec2 {
        let i = face as i32;
        let cell = match self {
            Self::CubeBlock => IVec2::new(i % 3, i / 3),
            Self::CubeRow => IVec2::new(i, 0),
            Self::CubeColumn => IVec2::new(0, i),
            Self::CubeCross => CROSS[face],
            _ => IVec2::ZERO,
        };
        cell.as_vec2()
    }
}

/// A picture of all directions on a grid of texels.
#[derive(Clone, Copy, Debug)]
pub(super) struct PanoramaGrid {
    projection: PanoramaProjection,
    /// Width and height of a cell, texels; not whole where the grid is coarser than the picture.
    cell: Vec2,
    /// Focal length of a fisheye lens, texels.
    focal: f32,
}

impl PanoramaGrid {
    /// The picture that a view looks into, which covers `size` texels.
    pub(super) fn new(view: &PanoramaView, size: Vec2) -> Self {
        let PanoramaView { projection, lens, .. } = *view;
        let focal = 0.5 * size.min_element() / projection.radius(0.5 * lens.to_radians());
        Self { projection, cell: size / projection.cells(), focal }
    }

    /// Focal length of a fisheye lens, texels.
    pub(super) fn focal(&self) -> f32 {
        self.focal
    }

    /// The picture in a direction, interpolated between the four nearest texels, also those across a seam; black where it shows nothing.
    pub(super) fn sample(&self, picture: &Grid<Vec3>, direction: Vec3) -> Vec3 {
        let Some((face, place)) = self.place(direction) else { return Vec3::ZERO };
        let corner = (place - 0.5).floor();
        let share = place - 0.5 - corner;
        let texel = |x: i32, y: i32| {
            let at = self.texel(face, corner.as_ivec2() + IVec2::new(x, y));
            picture.at(at.x as usize, at.y as usize)
        };
        let (top, bottom) = (texel(0, 0).lerp(texel(1, 0), share.x), texel(0, 1).lerp(texel(1, 1), share.x));
        top.lerp(bottom, share.y)
    }

    /// The face that shows a direction, and the place; `None` where a fisheye lens does not.
    fn place(&self, d: Vec3) -> Option<(usize, Vec2)> {
        if self.projection.is_cube() {
            let face = face_of(d);
            return Some((face, self.on_face(face, d)));
        }
        if self.projection.is_fisheye() {
            let place = 0.5 * self.cell - d.truncate() * (self.projection.magnification(d)? * self.focal);
            let inside = place.cmpge(Vec2::ZERO).all() && place.cmple(self.cell).all();
            return inside.then_some((0, place));
        }
        let x = 0.5 + arc_tangent(-d.x, d.z) / TAU;
        let y = arc_tangent(Vec2::new(d.x, d.z).length(), d.y) / PI;
        Some((0, Vec2::new(x, y) * self.cell))
    }

    /// The place of a direction before the plane of a face.
    fn on_face(&self, face: usize, d: Vec3) -> Vec2 {
        let [ahead, right, up] = FACES[face];
        let across = Vec2::new(d.dot(right), -d.dot(up)) / d.dot(ahead);
        (self.projection.cell(face) + 0.5 * (across + 1.0)) * self.cell
    }

    /// The direction of a place in the plane of a face, which goes on beyond its edges.
    fn on_plane(&self, face: usize, place: Vec2) -> Vec3 {
        let [ahead, right, up] = FACES[face];
        let across = 2.0 * (place / self.cell - self.projection.cell(face)) - 1.0;
        ahead + right * across.x - up * across.y
    }

    /// The first and the last texel whose centre lies on a face.
    fn texels(&self, face: usize) -> [IVec2; 2] {
        let cell = self.projection.cell(face);
        let first = |cell: Vec2| (cell * self.cell - 0.5).ceil().as_ivec2();
        [first(cell), first(cell + 1.0) - 1]
    }

    /// The texel of the picture that stands for this one of a face, which may lie one beyond its edges.
    fn texel(&self, face: usize, texel: IVec2) -> IVec2 {
        let [first, last] = self.texels(face);
        let inside = texel.clamp(first, last);
        if self.projection.is_fisheye() {
            return inside;
        }
        if !self.projection.is_cube() {
            // The edges at the left and at the right continue each other; beyond a pole the picture goes on half a turn farther.
            let width = last.x + 1;
            let turned = if inside.y == texel.y { texel.x } else { texel.x + width / 2 };
            return IVec2::new((turned + width) % width, inside.y);
        }
        // At a corner three faces meet, and there is no fourth texel.
        let beside = if inside.x == texel.x { texel } else { IVec2::new(texel.x, inside.y) };
        if beside == inside {
            return inside;
        }
        let direction = self.on_plane(face, beside.as_vec2() + 0.5);
        let other = face_of(direction);
        let [first, last] = self.texels(other);
        self.on_face(other, direction).floor().as_ivec2().clamp(first, last)
    }

    /// The direction that is shown at a place; `None` where that is no part of what views show.
    fn direction(&self, place: Vec2) -> Option<Vec3> {
        let cell = (place / self.cell).floor();
        if self.projection.is_cube() {
            let face = (0..6).find(|face| self.projection.cell(*face) == cell)?;
            return Some(self.on_plane(face, place));
        }
        if self.projection.is_fisheye() {
            let across = (0.5 * self.cell - place) / self.focal;
            let (sin, cos) = self.projection.angle(across.length())?.sin_cos();
            return Some((across.normalize_or_zero() * sin).extend(cos));
        }
        let (sin, cos) = (TAU * (place.x / self.cell.x - 0.5)).sin_cos();
        let (sin_theta, cos_theta) = (PI * place.y / self.cell.y).sin_cos();
        (cell == Vec2::ZERO).then(|| Vec3::new(-sin * sin_theta, cos_theta, cos * sin_theta))
    }
}

/// The face of a cube that shows a direction.
fn face_of(d: Vec3) -> usize {
    (1..6).fold(0, |best, face| if d.dot(FACES[face][0]) > d.dot(FACES[best][0]) { face } else { best })
}

/// The angle of (x, y) to the x axis, −π to π, with an error below 10⁻⁶ (Abramowitz and Stegun, *Handbook of Mathematical Functions*, 4.4.49).
/// The functions of devices differ by more than the texels of a large panorama.
fn arc_tangent(y: f32, x: f32) -> f32 {
    let (high, low) = (x.abs().max(y.abs()), x.abs().min(y.abs()));
    let a = low / high.max(f32::MIN_POSITIVE);
    let s = a * a;
    let mut sum = 0.002_866_225_8;
    for term in [-0.016_165_737, 0.042_909_615, -0.075_289_64, 0.106_562_64, -0.142_089, 0.199_935_51] {
        sum = sum * s + term;
    }
    let angle = a * (1.0 + s * (sum * s - 0.333_331_47));
    let angle = if y.abs() > x.abs() { FRAC_PI_2 - angle } else { angle };
    let angle = if x < 0.0 { PI - angle } else { angle };
    if y < 0.0 { -angle } else { angle }
}

/// Least and greatest field of view of a view, degrees.
pub const VIEW_FOVS: [f32; 2] = [10.0, 120.0];

/// The angles that follow a projection.
const EXPECTED: &str = "to the right, up, field of view, and that of a fisheye lens";

/// Longer side of the frame of a view, in its shorter sides.
const LONGEST_FRAME: f64 = 2.0;

/// A perspective view into a panorama. Angles are in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PanoramaView {
    /// How the picture shows all directions.
    pub projection: PanoramaProjection,
    /// Angle of the view to the right of the middle of the panorama, −180 to 180.
    pub yaw: f32,
    /// Angle of the view above the horizon, −90 to 90.
    pub pitch: f32,
    /// Field of view along the longer side of the [frame](Self::frame).
    pub fov: f32,
    /// Of a fisheye lens the angle that the shorter side of the picture covers; else of no effect.
    pub lens: f32,
}

impl PanoramaView {
    /// The view ahead; a fisheye lens covers 180 degrees.
    pub fn ahead(projection: PanoramaProjection) -> Self {
        Self { projection, yaw: 0.0, pitch: 0.0, fov: 90.0, lens: 180.0 }
    }

    /// Reads `PROJECTION` or `PROJECTION,YAW,PITCH,FOV`; with the angle of a fisheye lens after that, if it is not 180 degrees.
    ///
    /// # Errors
    ///
    /// A message that says what is expected.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (name, angles) = text.split_once(',').map_or((text, None), |(name, rest)| (name, Some(rest)));
        let projection = PanoramaProjection::from_str(name, false).map_err(|_| {
            let known = PanoramaProjection::value_variants().iter().map(|p| p.name());
            format!("expected a projection: {}", known.collect::<Vec<_>>().join(", "))
        })?;
        let view = Self::ahead(projection);
        let Some(angles) = angles else { return Ok(view) };
        let angles: Vec<_> = angles.split(',').collect();
        let (yaw, pitch, fov, lens) = match angles[..] {
            [yaw, pitch, fov] => (yaw, pitch, fov, view.lens),
            [yaw, pitch, fov, lens] if projection.is_fisheye() => {
                (yaw, pitch, fov, number(lens, 1.0..=projection.widest())?)
            }
            _ => return Err(format!("expected angles after the projection: {EXPECTED}")),
        };
        let fov = number(fov, VIEW_FOVS[0]..=VIEW_FOVS[1])?;
        Ok(Self {
            yaw: number(yaw, -180.0..=180.0)?,
            pitch: number(pitch, -90.0..=90.0)?,
            fov,
            lens,
            projection,
        })
    }

    /// The view as [`parse`](Self::parse) reads it.
    pub fn text(&self) -> String {
        let lens = if self.projection.is_fisheye() { format!(",{}", self.lens) } else { String::new() };
        format!("{},{},{},{}{lens}", self.projection.name(), self.yaw, self.pitch, self.fov)
    }

    /// Turned by a drag over these fractions of a picture of this extent, so that the panorama follows the cursor.
    #[must_use]
    pub fn turned(&self, by: DVec2, extent: Vec2) -> Self {
        let angles = 2.0 * by.as_vec2() * self.half(extent);
        // The circles of latitude are shorter near the poles.
        let yaw = self.yaw - (angles.x / self.pitch.to_radians().cos().max(0.2)).to_degrees();
        let pitch = (self.pitch + angles.y.to_degrees()).clamp(-90.0, 90.0);
        Self { yaw: (yaw + 180.0).rem_euclid(360.0) - 180.0, pitch, ..*self }
    }

    /// Turned to what it shows at a place of a picture of this extent.
    #[must_use]
    pub fn turned_to(&self, shown: DVec2, extent: Vec2) -> Self {
        let d = self.direction(shown.as_vec2(), extent);
        let pitch = d.y.atan2(Vec2::new(d.x, d.z).length()).to_degrees();
        Self { yaw: (-d.x).atan2(d.z).to_degrees(), pitch, ..*self }
    }

    /// With a field of view that is greater by these degrees, within its bounds.
    #[must_use]
    pub fn widened(&self, by: f32) -> Self {
        Self { fov: (self.fov + by).clamp(VIEW_FOVS[0], VIEW_FOVS[1]), ..*self }
    }

    /// Width and height of the part in the middle of a picture of this extent that the field of view is told of: all of the picture, unless that
    /// is a strip, as of six faces of a cube in a row. Along a strip the view goes on beyond the frame.
    pub fn frame(extent: DVec2) -> DVec2 {
        extent.min(DVec2::splat(LONGEST_FRAME * extent.min_element()))
    }

    /// Half its width and height at distance 1, of all of a picture of this extent.
    fn half(&self, extent: Vec2) -> Vec2 {
        let longer = Self::frame(extent.as_dvec2()).max_element() as f32;
        (0.5 * self.fov.to_radians()).tan() * extent / longer
    }

    /// Ahead, right and up as the view has them, unit vectors.
    fn axes(&self) -> [Vec3; 3] {
        let (sin_yaw, cos_yaw) = self.yaw.to_radians().sin_cos();
        let (sin_pitch, cos_pitch) = self.pitch.to_radians().sin_cos();
        [
            Vec3::new(-sin_yaw * cos_pitch, sin_pitch, cos_yaw * cos_pitch),
            Vec3::new(-cos_yaw, 0.0, -sin_yaw),
            Vec3::new(sin_yaw * sin_pitch, cos_pitch, -cos_yaw * sin_pitch),
        ]
    }

    /// The direction of the top left corner of a picture that covers `size` texels, and its changes per texel to the right and down.
    pub(super) fn directions(&self, size: Vec2) -> [Vec3; 3] {
        let ([ahead, right, up], half) = (self.axes(), self.half(size));
        let (right, up) = (right * half.x, up * half.y);
        [ahead - right + up, right * (2.0 / size.x), up * (-2.0 / size.y)]
    }

    /// The direction that a picture of this extent shows at a place.
    fn direction(&self, shown: Vec2, extent: Vec2) -> Vec3 {
        let [corner, across, down] = self.directions(extent);
        corner + across * shown.x + down * shown.y
    }

    /// The place of the panorama that the view shows at a place, both in pixels of a picture of this extent; `None` beyond what a fisheye lens
    /// shows.
    pub fn to_picture(&self, shown: DVec2, extent: Vec2) -> Option<DVec2> {
        let direction = self.direction(shown.as_vec2(), extent);
        let grid = PanoramaGrid::new(self, extent);
        let (face, place) = grid.place(direction)?;
        // What is rounded to an edge stays on its face.
        let cell = self.projection.cell(face);
        let [first, end] = [cell, cell + 1.0].map(|cell| (cell * grid.cell).as_dvec2());
        Some(place.as_dvec2().clamp(first, end - 1e-3))
    }

    /// Where the view shows a place of the panorama, both in pixels of a picture of this extent; it may lie beside the picture. `None` behind
    /// the view, and where the panorama has no direction.
    pub fn to_shown(&self, place: DVec2, extent: Vec2) -> Option<DVec2> {
        let direction = PanoramaGrid::new(self, extent).direction(place.as_vec2())?;
        let ([ahead, right, up], half) = (self.axes(), self.half(extent));
        let depth = direction.dot(ahead);
        let across = Vec2::new(direction.dot(right), -direction.dot(up)) / (depth * half);
        (depth > 1e-3).then(|| (0.5 * (across + 1.0) * extent).as_dvec2())
    }
}

impl PanoramaProjection {
    /// Its name on the command line.
    fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arc_tangents_are_accurate() {
        for i in 0..4000 {
            let (sin, cos) = (f64::from(i) * 0.01 - 20.0).sin_cos();
            let (y, x) = ((3.0 * sin) as f32, (3.0 * cos) as f32);
            let error = f64::from(arc_tangent(y, x)) - f64::from(y).atan2(f64::from(x));
            assert!(error.abs() < 1e-6, "{y}, {x}: {error}");
        }
        assert_eq!(arc_tangent(0.0, 0.0), 0.0);
    }

    /// Texels beyond an edge are those of the face beside it, and never a part of the picture that shows no direction of the view.
    #[test]
    fn seams_continue() {
        let grid = |projection, width, height| {
            PanoramaGrid::new(&PanoramaView::ahead(projection), Vec2::new(width, height))
        };
        let spherical = grid(PanoramaProjection::OverUnder, 8.0, 8.0);
        for (from, to) in [([-1, 2], [7, 2]), ([8, 2], [0, 2]), ([1, -1], [5, 0]), ([6, 4], [2, 3])] {
            assert_eq!(spherical.texel(0, from.into()), IVec2::from(to), "{from:?}");
        }
        let cross = grid(PanoramaProjection::CubeCross, 40.0, 30.0);
        // Right of the right face begins the back one; above the front ends the up face; below the left face lies the left column of down.
        for (face, from, to) in [(0, [30, 13], [30, 13]), (4, [14, 9], [14, 9]), (1, [2, 20], [10, 27])] {
            assert_eq!(cross.texel(face, from.into()), IVec2::from(to), "face {face}, {from:?}");
        }
    }

    #[test]
    fn drags_stay_within_bounds() {
        let (view, extent) = (PanoramaView::ahead(PanoramaProjection::Spherical), Vec2::new(200.0, 100.0));
        // By half the width of a view of 90 degrees, to the right: what was in the middle is at the right edge then.
        let right = view.turned(DVec2::new(0.5, 0.0), extent);
        assert!((right.yaw + 1f32.to_degrees()).abs() < 1e-3 && right.pitch == 0.0, "{right:?}");
        let up = view.turned(DVec2::new(0.0, 9.0), extent);
        assert_eq!(up.pitch, 90.0);
        let around = (0..40).fold(up, |view, _| view.turned(DVec2::new(-0.3, 0.0), extent));
        assert!((-180.0..=180.0).contains(&around.yaw), "{around:?}");
        assert_eq!([view.widened(500.0).fov, view.widened(-500.0).fov], [120.0, 10.0]);
        let to = view.turned_to(DVec2::new(200.0, 50.0), extent);
        assert!((to.yaw - 45.0).abs() < 1e-3 && to.pitch.abs() < 1e-3, "{to:?}");
    }

    /// In a picture of six faces in a row, the view has its angle over twice the height of the row, and not over its length.
    #[test]
    fn views_into_strips_have_a_frame() {
        for (strip, frame) in [([600.0, 100.0], [200.0, 100.0]), ([100.0, 600.0], [100.0, 200.0])] {
            assert_eq!(PanoramaView::frame(strip.into()), DVec2::from(frame));
            let view = PanoramaView::ahead(PanoramaProjection::CubeRow);
            let half = view.half(DVec2::from(strip).as_vec2()) * DVec2::from(frame).as_vec2()
                / DVec2::from(strip).as_vec2();
            assert!(
                (half.max_element() - 1.0).abs() < 1e-6 && (half.min_element() - 0.5).abs() < 1e-6,
                "{half}"
            );
        }
        assert_eq!(PanoramaView::frame(DVec2::new(200.0, 100.0)), DVec2::new(200.0, 100.0));
    }

    #[test]
    fn views_are_read_as_they_are_written() {
        let ahead = PanoramaView::ahead(PanoramaProjection::CubeCross);
        let view = PanoramaView { yaw: -12.5, pitch: 30.0, fov: 75.0, ..ahead };
        let lens = PanoramaView { projection: PanoramaProjection::FisheyeEquisolid, lens: 220.5, ..view };
        for view in [view, lens] {
            assert_eq!(PanoramaView::parse(&view.text()), Ok(view));
        }
        assert_eq!(PanoramaView::parse("spherical"), Ok(PanoramaView::ahead(PanoramaProjection::Spherical)));
        for wrong in [
            "",
            "fisheye",
            "spherical,1",
            "spherical,1,2,3",
            "spherical,0,91,60",
            "spherical,0,0,60,1",
            "fisheye-orthographic,0,0,60,190",
        ] {
            assert!(PanoramaView::parse(wrong).is_err(), "{wrong}");
        }
    }
}
