//! Cameras: from uv to rays, and from points in the world to uv.

mod aperture;
mod batch;
mod check;
mod cube;
mod distortion;
mod film;
mod fisheye;
mod lines;
mod local_ray;
mod meter;
mod panorama;

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3, Vec3};

use crate::math::warp;
use crate::scene::SceneDesc;
use crate::scene::desc::RenderingSpace;
use crate::scene::desc::{CameraDesc, FilmDesc, LensDesc, ProjectionDesc};
use crate::stream::UvWindow;

use film::FilmProjection;

pub use lines::CameraLines;

use super::Scene;
use super::accel::Ray;
use super::medium::MediumIndex;
use super::prepare::{PrepareError, PrepareOptions};

/// A camera with Mitsuba's conventions: in camera space it looks along +z, +y is up and +x is to the left.
///
/// With an aperture it is a thin lens in the plane z = 0 of camera space: all rays of one uv intersect at one point of the
/// plane z = `focus_distance`. Without an aperture it is a pinhole. An orthographic camera sends parallel rays along z, and shows −1 to 1
/// along x. These three stand here; the projections of `film`, which have closed forms of their own, and several cameras side by side
/// (`batch`) are reached by one cold branch.
///
/// Every projection has both ways: [`Camera::ray`] from uv, and [`Camera::view`] from a point of the scene, with the area of the picture
/// around it.
///
/// uv is (0, 0) at the top left corner of the picture (the crop window, if there is one) and (1, 1) at its bottom right. Values
/// outside are overscan and valid as well.
#[derive(Clone, Debug)]
pub struct Camera {
    position: DVec3,
    /// World-space images of the camera's axes, unit length; a sheared transform leaves them oblique.
    axes: DMat3,
    /// z in camera space of a world-space direction is its product with this.
    to_z: DVec3,
    /// Volume of the cube of the axes: 1 unless they are oblique.
    volume: f64,
    /// World space to camera space.
    from_world: DMat3,
    /// uv to the plane z = 1 of camera space, or to the film of a [`FilmProjection`]: `x = offset + scale · uv`.
    scale: DVec2,
    offset: DVec2,
    near: f64,
    far: f64,
    projection: Projection,
    /// Radius of the lens in world units, 0 for a pinhole.
    aperture: f64,
    /// 1 / z of the plane in focus, 0 for a pinhole.
    focus: f64,
    /// The medium that it is in by its description.
    medium: MediumIndex,
}

/// What lies between the film and the rays.
#[derive(Clone, Debug)]
enum Projection {
    /// All in one point.
    Pinhole,
    /// On a lens.
    Lens,
    /// Each in its place of the near clip plane; uv are mapped to the plane z = 0 instead of z = 1.
    Orthographic,
    /// By a formula of its own.
    Film(Arc<FilmProjection>),
    /// By one of several cameras side by side, each of which is in its place in rendering space.
    Batch(Arc<[Camera]>),
}

/// A ray of the camera, with what methods need that also find it from the other end.
#[derive(Clone, Copy, Debug)]
pub struct CameraRay {
    /// The ray.
    pub ray: Ray,
    /// The point of the lens that it goes through; `None` where rays are parallel.
    pub from: Option<Vec3>,
    /// As [`CameraView::uv_per_steradian`]; 0 where no point of the scene finds this ray.
    pub uv_per_steradian: f32,
}

/// The connection of a point to the camera.
#[derive(Clone, Copy, Debug)]
pub struct CameraView {
    /// Screen position.
    pub uv: [f32; 2],
    /// Origin of the camera ray to the point, on the near clip plane.
    pub origin: Vec3,
    /// Unit direction from the camera to the point.
    pub direction: Vec3,
    /// Squared distance of the point from the lens, infinite for a direction; 1 for a camera of parallel rays.
    pub distance2: f32,
    /// Area of the picture, in uv, per steradian at the lens; for a camera of parallel rays per unit of area across them.
    pub uv_per_steradian: f32,
    /// 1 / the probability that the numbers of the lens chose this place of the picture among those that show the point: those of both eyes, of
    /// several cameras, and of the overscan of panoramas. A factor on light that is connected.
    pub choices: f32,
}

impl Camera {
    /// The camera for a film of `options.width × options.height` pixels, of which only the ratio matters. The crop window is
    /// taken from `film` as a fraction of its size.
    ///
    /// # Errors
    ///
    /// [`PrepareError::Camera`] if a number is not finite, the transform is singular, or a field of view or
    /// clip distance is out of range.
    pub fn new(desc: &CameraDesc, film: &FilmDesc, options: &PrepareOptions) -> Result<Self, PrepareError> {
        let bad = |what: &str| Err(PrepareError::Camera { place: desc.place, what: what.to_owned() });
        if options.width == 0 || options.height == 0 || film.width == 0 || film.height == 0 {
            return bad("the film has no pixels; give it a width and a height above 0");
        }
        let to_world = desc.to_world;
        let matrix = to_world.matrix3;
        let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(DVec3::normalize_or_zero);
        let axes = DMat3::from_cols(columns[0], columns[1], columns[2]);
        let regular = axes.determinant().abs() > 1e-6;
        if !to_world.is_finite() || !regular {
            return bad("to_world is singular or not finite");
        }
        if let Err(what) = check::check(desc) {
            return bad(what);
        }
        let clip = desc.near_clip >= 0.0 && desc.near_clip < desc.far_clip;
        if !clip || !desc.principal_point_offset.is_finite() {
            return bad("near_clip must be below far_clip, and the principal point finite");
        }
        let size = DVec2::new(f64::from(options.width), f64::from(options.height));
        let aspect = size.x / size.y;
        // The axes are of unit length, so that scales of an orthographic camera's transform go into its extent.
        let scales = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(DVec3::length);
        let (half, near) = match &desc.projection {
            ProjectionDesc::Perspective(p) => (p.fov_axis.half_extent(p.fov, aspect), desc.near_clip),
            ProjectionDesc::Orthographic => {
                (DVec2::new(scales[0], scales[1] / aspect), desc.near_clip * scales[2])
            }
            ProjectionDesc::Fisheye(f) => {
                let half = f.mapping.radius(0.5 * f.fov.to_radians());
                (f.fov_axis.of_half(half, aspect), desc.near_clip)
            }
            // The film itself.
            _ => (DVec2::ONE, desc.near_clip),
        };
        // From film position s in [0, 1]² (y down) to the plane: x = (1 − 2 s.x) half.x, likewise y. The principal point is
        // added to s, and the crop window replaces s by corner + uv · part.
        let full = DVec2::new(f64::from(film.width), f64::from(film.height));
        let (corner, part) = film.crop.map_or((DVec2::ZERO, DVec2::ONE), |c| {
            let corner = DVec2::new(f64::from(c.x), f64::from(c.y));
            (corner / full, DVec2::new(f64::from(c.width), f64::from(c.height)) / full)
        });
        if part.min_element() <= 0.0 {
            return bad("the crop window is empty");
        }
        let is_on_film = !matches!(
            desc.projection,
            ProjectionDesc::Perspective(_) | ProjectionDesc::Orthographic | ProjectionDesc::Fisheye(_)
        );
        let (scale, offset) = match is_on_film {
            true => (part, corner),
            false => (part * half * -2.0, (1.0 - 2.0 * (corner + desc.principal_point_offset)) * half),
        };
        let projection = Projection::new(desc, options)?;
        let lens = match (&projection, &desc.projection) {
            (Projection::Lens, ProjectionDesc::Perspective(p)) => p.lens,
            _ => LensDesc::PINHOLE,
        };
        Ok(Self {
            position: to_world.translation,
            axes,
            to_z: axes.inverse().row(2),
            volume: axes.determinant().abs(),
            from_world: axes.inverse(),
            scale,
            offset,
            near,
            // Mitsuba scales the distance of the near plane and not that between both.
            far: if desc.is_orthographic() { near + (desc.far_clip - desc.near_clip) } else { desc.far_clip },
            projection,
            aperture: lens.radius,
            focus: if lens.radius > 0.0 { 1.0 / lens.focus_distance } else { 0.0 },
            medium: desc.medium.into(),
        })
    }

    /// This camera in `space`, in which the scene is traced.
    pub fn placed(self, space: &RenderingSpace) -> Self {
        let unit = space.scale;
        let plane = if matches!(self.projection, Projection::Orthographic) { unit } else { 1.0 };
        let projection = match self.projection {
            Projection::Film(film) => Projection::Film(Arc::new(film.scaled(unit))),
            Projection::Batch(cameras) => {
                Projection::Batch(cameras.iter().map(|camera| camera.clone().placed(space)).collect())
            }
            plain => plain,
        };
        Self {
            projection,
            position: space.point(self.position),
            scale: self.scale * plane,
            offset: self.offset * plane,
            near: self.near * unit,
            far: self.far * unit,
            aperture: self.aperture * unit,
            focus: self.focus / unit,
            ..self
        }
    }

    /// This camera with a crop window: the part of its picture from `corner` on, of this `size`, both in uv, is the picture.
    pub fn cropped(self, corner: DVec2, size: DVec2) -> Self {
        Self { offset: self.offset + self.scale * corner, scale: self.scale * size, ..self }
    }

    /// The screen position of a place in the space of this camera, which may lie outside the picture; `None` where it is not in front. Where
    /// several places show it, one of them.
    pub fn screen_position(&self, place: DVec3) -> Option<DVec2> {
        let local = self.from_world * (place - self.position);
        let depth = match &self.projection {
            Projection::Pinhole | Projection::Lens => local.z,
            Projection::Orthographic => 1.0,
            Projection::Film(_) | Projection::Batch(_) => return self.shown_at(place),
        };
        (local.z > 0.0).then(|| (local.truncate() / depth - self.offset) / self.scale)
    }

    /// The camera of a scene in its rendering space, with the film size that its file specifies. It fails as [`Camera::new`] does.
    pub fn of(desc: &SceneDesc) -> Result<Self, PrepareError> {
        let camera = Self::new(&desc.camera, &desc.film, &PrepareOptions::from_film(&desc.film))?;
        Ok(camera.placed(&desc.space))
    }

    /// The ray of `uv` through a point of the lens, from the near to the far clip plane, with a unit direction. `lens` in [0, 1)²
    /// selects the point, and (½, ½) is the centre. A pinhole ignores it. Clip planes of pictures of all directions are spheres. `None` where the
    /// lens shows nothing: beyond its image circle, and where a cross of six faces has none.
    #[inline]
    pub fn ray(&self, uv: [f64; 2], lens: [f32; 2]) -> Option<Ray> {
        let mut xy = self.offset + self.scale * DVec2::from_array(uv);
        let mut from = self.position;
        match &self.projection {
            Projection::Pinhole => (),
            Projection::Lens => {
                let on_lens = warp::disk(lens).as_dvec2() * self.aperture;
                // From `on_lens` to the point (xy, 1) / focus, scaled to z = 1.
                xy -= on_lens * self.focus;
                from += self.axes.mul_vec3(on_lens.extend(0.0));
            }
            Projection::Orthographic => return Some(self.parallel_ray(xy)),
            Projection::Film(_) | Projection::Batch(_) => {
                return self.other_ray(uv, lens).map(|found| found.ray);
            }
        }
        let d = self.axes.mul_vec3(xy.extend(1.0));
        let length = d.length();
        let d = d * (1.0 / length);
        // Along the unit direction, the planes z = near and z = far are `length` times as far.
        let origin = from + d * (self.near * length);
        Some(Ray {
            origin: origin.as_vec3(),
            direction: d.as_vec3(),
            t_max: ((self.far - self.near) * length) as f32,
        })
    }

    /// [`Camera::ray`] with its point of the lens and the area of the picture around it.
    #[inline]
    pub fn start(&self, uv: [f64; 2], lens: [f32; 2]) -> Option<CameraRay> {
        if let Projection::Film(_) | Projection::Batch(_) = &self.projection {
            return self.other_ray(uv, lens);
        }
        let ray = self.ray(uv, lens)?;
        let from = self.lens_point(lens);
        Some(CameraRay { ray, from, uv_per_steradian: self.uv_per_steradian(ray.direction) })
    }

    /// The ray through the point `xy` of the plane z = 0 of camera space, along z.
    #[cold]
    fn parallel_ray(&self, xy: DVec2) -> Ray {
        Ray {
            origin: (self.position + self.axes.mul_vec3(xy.extend(self.near))).as_vec3(),
            direction: self.axes.z_axis.as_vec3(),
            t_max: (self.far - self.near) as f32,
        }
    }

    /// The lines through the centre of the lens. `None` where the picture is no plane of which lines are shown as lines: with a distortion, of
    /// fisheye lenses, of all directions, and of several cameras.
    pub fn lines(&self) -> Option<CameraLines> {
        match &self.projection {
            Projection::Pinhole | Projection::Lens | Projection::Orthographic => (),
            Projection::Film(film) if film.is_plane() => (),
            Projection::Film(_) | Projection::Batch(_) => return None,
        }
        let (first, u, v) = (self.offset.extend(0.0), DVec3::X * self.scale.x, DVec3::Y * self.scale.y);
        let to_world = |vector: DVec3| self.axes.mul_vec3(vector).as_vec3();
        let across = [first, u, v];
        let position = self.position.as_vec3();
        let is_central = !matches!(self.projection, Projection::Orthographic);
        let (origin, direction) = match is_central {
            true => ([position, Vec3::ZERO, Vec3::ZERO], [first + DVec3::Z, u, v].map(to_world)),
            false => {
                let [first, u, v] = across.map(to_world);
                ([position + first, u, v], [to_world(DVec3::Z), Vec3::ZERO, Vec3::ZERO])
            }
        };
        Some(CameraLines {
            origin,
            direction,
            position,
            from_world: self.from_world.as_mat3(),
            offset: self.offset.as_vec2(),
            per_scale: 1.0 / self.scale.as_vec2(),
            near: self.near as f32,
            is_central,
        })
    }

    /// The point of the lens, in world space, that [`Camera::ray`] uses for `lens`: uniform over its area if `lens` is uniform in
    /// [0, 1)². For a pinhole it is the position. `None` where rays are parallel.
    #[inline]
    fn lens_point(&self, lens: [f32; 2]) -> Option<Vec3> {
        let on_lens = self.on_lens(lens)?;
        Some((self.position + self.axes.mul_vec3(on_lens.extend(0.0))).as_vec3())
    }

    /// That point in the plane z = 0 of camera space; `None` for all but pinholes and round lenses.
    #[inline]
    fn on_lens(&self, lens: [f32; 2]) -> Option<DVec2> {
        match &self.projection {
            Projection::Pinhole => Some(DVec2::ZERO),
            Projection::Lens => Some(warp::disk(lens).as_dvec2() * self.aperture),
            Projection::Orthographic | Projection::Film(_) | Projection::Batch(_) => None,
        }
    }

    /// The uv of the world-space point `p` through the point `on_lens` of the plane z = 0 of camera space; it may lie outside the
    /// picture. `None` if `p` lies before the near or behind the far clip plane.
    #[inline]
    fn project(&self, p: Vec3, on_lens: DVec2) -> Option<[f64; 2]> {
        let local = self.from_world * (p.as_dvec3() - self.position);
        let visible = local.z > 0.0 && local.z >= self.near && local.z <= self.far;
        let xy = (local.truncate() - on_lens) / local.z + on_lens * self.focus;
        let uv = (xy - self.offset) / self.scale;
        visible.then_some(uv.to_array())
    }

    /// Connects the world-space point `p` to the point of the lens that `lens` selects, the inverse of [`Camera::ray`]. `None` if it lies before the near or
    /// behind the far clip plane, or outside `window`. Where several places of the window show the point, `lens` chooses among them.
    pub fn view(&self, p: Vec3, lens: [f32; 2], window: &UvWindow) -> Option<CameraView> {
        let Some(on_lens) = self.on_lens(lens) else { return self.other_view(p, lens, window) };
        let uv = self.project(p, on_lens)?;
        if !is_inside(uv, window) {
            return None;
        }
        let from = self.position + self.axes.mul_vec3(on_lens.extend(0.0));
        let offset = p.as_dvec3() - from;
        let distance2 = offset.length_squared();
        Some(self.connection(uv, from, offset / distance2.sqrt(), distance2 as f32))
    }

    /// The ray of a view of a point at infinity, through the point of the lens that `lens` selected for it.
    pub fn ray_of(&self, view: &CameraView, lens: [f32; 2]) -> Option<Ray> {
        let seen_by = match &self.projection {
            Projection::Film(_) => self,
            Projection::Batch(cameras) => self.one_of(cameras, view),
            _ => return self.ray(view.uv.map(f64::from), lens),
        };
        let t_max = seen_by.length_to_far(view.direction);
        Some(Ray { origin: view.origin, direction: view.direction, t_max })
    }

    /// Length of a ray of this direction from the near to the far clip plane.
    fn length_to_far(&self, direction: Vec3) -> f32 {
        let depth = match &self.projection {
            Projection::Film(film) if !film.has_clip_planes() => 1.0,
            _ => direction.as_dvec3().dot(self.to_z),
        };
        ((self.far - self.near) / depth) as f32
    }

    /// [`Camera::view`] of other cameras.
    #[cold]
    fn other_view(&self, p: Vec3, lens: [f32; 2], window: &UvWindow) -> Option<CameraView> {
        match &self.projection {
            Projection::Film(film) => self.film_view(film, p.as_dvec3(), false, lens, window),
            Projection::Batch(cameras) => {
                self.view_of_one(cameras, lens, window, |camera, lens, window| camera.view(p, lens, window))
            }
            _ => self.parallel_view(p, window),
        }
    }

    /// [`Camera::view`] along parallel rays.
    #[cold]
    fn parallel_view(&self, p: Vec3, window: &UvWindow) -> Option<CameraView> {
        let local = self.from_world * (p.as_dvec3() - self.position);
        let uv = ((local.truncate() - self.offset) / self.scale).to_array();
        let visible = local.z >= self.near && local.z <= self.far && is_inside(uv, window);
        visible.then(|| CameraView {
            uv: uv.map(|c| c as f32),
            origin: (self.position + self.axes.mul_vec3(local.truncate().extend(self.near))).as_vec3(),
            direction: self.axes.z_axis.as_vec3(),
            distance2: 1.0,
            uv_per_steradian: self.uv_per_area(),
            choices: 1.0,
        })
    }

    /// Area of the picture, in uv, per unit of area across parallel rays.
    fn uv_per_area(&self) -> f32 {
        // The axes need not be perpendicular: their determinant is the area of the square of x and y, seen along z.
        (1.0 / (self.scale.x * self.scale.y * self.volume).abs()) as f32
    }

    /// As [`Camera::view`], for a point at infinity in the unit direction `direction`. `None` outside `window`, and where rays are
    /// parallel: nothing chooses their direction by chance.
    pub fn view_far(&self, direction: Vec3, lens: [f32; 2], window: &UvWindow) -> Option<CameraView> {
        let Some(on_lens) = self.on_lens(lens) else { return self.other_view_far(direction, lens, window) };
        let d = direction.as_dvec3();
        let local = self.from_world * d;
        if local.z <= 0.0 {
            return None;
        }
        let from = self.position + self.axes.mul_vec3(on_lens.extend(0.0));
        let uv = (local.truncate() / local.z + on_lens * self.focus - self.offset) / self.scale;
        is_inside(uv.to_array(), window).then(|| self.connection(uv.to_array(), from, d, f32::INFINITY))
    }

    /// [`Camera::view_far`] of other cameras.
    #[cold]
    fn other_view_far(&self, direction: Vec3, lens: [f32; 2], window: &UvWindow) -> Option<CameraView> {
        match &self.projection {
            Projection::Film(film) => self.film_view(film, direction.as_dvec3(), true, lens, window),
            Projection::Batch(cameras) => self.view_of_one(cameras, lens, window, |camera, lens, window| {
                camera.view_far(direction, lens, window)
            }),
            _ => None,
        }
    }

    /// The connection in the unit direction `direction` from the point `from` of the lens.
    #[inline]
    fn connection(&self, uv: [f64; 2], from: DVec3, direction: DVec3, distance2: f32) -> CameraView {
        let z = direction.dot(self.to_z);
        CameraView {
            uv: uv.map(|c| c as f32),
            origin: (from + direction * (self.near / z)).as_vec3(),
            direction: direction.as_vec3(),
            distance2,
            uv_per_steradian: self.uv_per_z3(z),
            choices: 1.0,
        }
    }

    /// Area of the picture, in uv, per steradian around the unit world-space `direction`, of a pinhole or a round lens. This is the importance
    /// that turns arriving flux into a density over uv. Divided by the area of the window, it is the density of camera rays.
    ///
    /// A solid angle dω around a direction that is z long in camera space covers the area dω / (V z³) of the plane z = 1 there, where V
    /// is the volume of the axes' cube: dω / cos³ θ unless they are oblique. Where rays are parallel it is the area of the picture per
    /// unit of area across them.
    #[inline]
    fn uv_per_steradian(&self, direction: Vec3) -> f32 {
        if let Projection::Orthographic = self.projection {
            return self.uv_per_area();
        }
        self.uv_per_z3(direction.as_dvec3().dot(self.to_z))
    }

    fn uv_per_z3(&self, z: f64) -> f32 {
        (1.0 / ((self.scale.x * self.scale.y).abs() * self.volume * z * z * z)) as f32
    }

    /// Whether there are rays that are parallel to others: what is infinitely far has no place in their picture.
    pub fn has_parallel_rays(&self) -> bool {
        match &self.projection {
            Projection::Orthographic => true,
            Projection::Batch(cameras) => cameras.iter().any(Self::has_parallel_rays),
            _ => false,
        }
    }

    /// Whether light paths find all that it shows. They do not find rays of one direction that belong to every
    /// place of the picture, as of a radiance meter.
    pub fn is_found_by_light(&self) -> bool {
        match &self.projection {
            Projection::Film(film) => !matches!(**film, FilmProjection::Beam(_)),
            Projection::Batch(cameras) => cameras.iter().all(Self::is_found_by_light),
            _ => true,
        }
    }

    /// Corners of the bounding box of the points in rendering space at which its [rays](Camera::ray) through `window` begin.
    pub fn ray_origins(&self, window: &UvWindow) -> [Vec3; 2] {
        match &self.projection {
            Projection::Film(film) => return self.film_ray_origins(film, window),
            Projection::Batch(cameras) => return batch::ray_origins(cameras),
            _ => (),
        }
        let UvWindow { min, max } = window;
        let uvs = [[min[0], min[1]], [min[0], max[1]], [max[0], min[1]], [max[0], max[1]]]
            .map(|[x, y]| DVec2::new(f64::from(x), f64::from(y)));
        // The corners of a square around the lens.
        let on_lens = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]]
            .map(|corner| DVec2::from_array(corner) * self.aperture);
        let origins = uvs.into_iter().flat_map(|uv| {
            let xy = self.offset + self.scale * uv;
            on_lens.map(|on_lens| {
                let across = match &self.projection {
                    Projection::Orthographic => xy,
                    _ => on_lens + (xy - on_lens * self.focus) * self.near,
                };
                (self.position + self.axes.mul_vec3(across.extend(self.near))).as_vec3()
            })
        });
        origins.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
    }

    /// The medium in which its rays through `window` begin: by the surfaces around, since it may have moved, or where there are none with media by
    /// its description.
    pub fn medium_in(&self, scene: &Scene, window: &UvWindow) -> MediumIndex {
        let [low, high] = self.ray_origins(window);
        scene.medium_around(0.5 * (low + high)).unwrap_or(self.medium)
    }

    /// Position in rendering space: the pinhole, the centre of the lens, or of the plane that parallel rays begin at. Several cameras have that
    /// of their description.
    pub fn position(&self) -> Vec3 {
        self.position.as_vec3()
    }
}

#[inline]
fn is_inside(uv: [f64; 2], window: &UvWindow) -> bool {
    let inside = |i: usize| uv[i] >= f64::from(window.min[i]) && uv[i] < f64::from(window.max[i]);
    inside(0) && inside(1)
}
