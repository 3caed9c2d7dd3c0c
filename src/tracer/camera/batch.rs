//! The camera rays and views of projections that are not plain, and of several cameras side by side.

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};

use crate::scene::desc::{CameraDesc, FilmDesc, ProjectionDesc};
use crate::stream::UvWindow;
use crate::tracer::accel::Ray;
use crate::tracer::prepare::{PrepareError, PrepareOptions};

use super::cube::CubeMap;
use super::film::{FilmProjection, PlaneLens};
use super::fisheye::Fisheye;
use super::local_ray::FilmImage;
use super::meter::Meter;
use super::panorama::Panorama;
use super::{Camera, CameraRay, CameraView, Projection, is_inside};

/// Steps along uv in which the origins of rays through a lens with a distortion are looked for.
const STEPS: u32 = 8;

impl Projection {
    /// That of a description, for a film of this size.
    pub(super) fn new(desc: &CameraDesc, options: &PrepareOptions) -> Result<Self, PrepareError> {
        let film = match &desc.projection {
            ProjectionDesc::Perspective(p) if p.distortion.is_some() => {
                FilmProjection::Plane(PlaneLens::new(p))
            }
            ProjectionDesc::Perspective(p) if p.lens.radius > 0.0 => match p.lens.is_round() {
                true => return Ok(Self::Lens),
                false => FilmProjection::Plane(PlaneLens::new(p)),
            },
            ProjectionDesc::Perspective(_) => return Ok(Self::Pinhole),
            ProjectionDesc::Orthographic => return Ok(Self::Orthographic),
            ProjectionDesc::Fisheye(fisheye) => FilmProjection::Fisheye(Fisheye::new(fisheye)),
            ProjectionDesc::Spherical => FilmProjection::Panorama(Panorama::SPHERICAL),
            ProjectionDesc::Stereo(stereo) => FilmProjection::Panorama(Panorama::stereo(stereo)),
            ProjectionDesc::CubeMap(layout) => FilmProjection::CubeMap(CubeMap::new(*layout)),
            ProjectionDesc::Irradiance(surface) => {
                let matrix = desc.to_world.matrix3;
                let lengths = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(DVec3::length);
                FilmProjection::Meter(Meter::new(*surface, DVec3::from_array(lengths)))
            }
            ProjectionDesc::Beam(radius) => FilmProjection::Beam(*radius),
            ProjectionDesc::Batch(cameras) => {
                // The proportions of one part.
                let (width, height) = (options.width, options.height.saturating_mul(cameras.len() as u32));
                let film = FilmDesc { width, height, crop: None, rfilter: None };
                let options = PrepareOptions { width, height };
                let cameras = cameras.iter().map(|camera| {
                    let to_world = desc.to_world * camera.to_world;
                    Camera::new(&CameraDesc { to_world, ..camera.clone() }, &film, &options)
                });
                return Ok(Self::Batch(cameras.collect::<Result<_, _>>()?));
            }
        };
        Ok(Self::Film(Arc::new(film)))
    }
}

impl Camera {
    /// [`Camera::start`] of a [`FilmProjection`] or of several cameras.
    #[cold]
    pub(super) fn other_ray(&self, uv: [f64; 2], lens: [f32; 2]) -> Option<CameraRay> {
        let at = self.offset + self.scale * DVec2::from_array(uv);
        match &self.projection {
            Projection::Film(film) => self.film_ray(film, at, lens),
            Projection::Batch(cameras) => {
                let (number, place) = part_of(cameras.len(), at);
                let found = cameras[number].start(place.to_array(), lens)?;
                let uv_per_steradian = found.uv_per_steradian * self.uv_per_part(cameras.len());
                Some(CameraRay { uv_per_steradian, ..found })
            }
            _ => None,
        }
    }

    fn film_ray(&self, film: &FilmProjection, at: DVec2, lens: [f32; 2]) -> Option<CameraRay> {
        let local = film.ray(at, lens)?;
        let from = self.position + self.axes.mul_vec3(local.from);
        let along = self.axes.mul_vec3(local.direction);
        let length = along.length();
        let direction = along / length;
        let per_clip = self.per_clip(film, local.direction, length);
        let is_found = !matches!(film, FilmProjection::Beam(_));
        Some(CameraRay {
            ray: Ray {
                origin: (from + direction * (self.near * per_clip)).as_vec3(),
                direction: direction.as_vec3(),
                t_max: ((self.far - self.near) * per_clip) as f32,
            },
            from: Some(from.as_vec3()),
            uv_per_steradian: if is_found {
                self.uv_density(local.density, local.direction, length)
            } else {
                0.0
            },
        })
    }

    /// Length along a ray per unit of clip distance. The ray has this direction in camera space, and there is its length in the world.
    fn per_clip(&self, film: &FilmProjection, local: DVec3, length: f64) -> f64 {
        if film.has_clip_planes() { length / local.z } else { 1.0 }
    }

    /// Area of the picture in uv per steradian, from that of the film per steradian of camera space around a direction that is `length` long in
    /// the world. Oblique axes take the solid angle dω around a unit vector that becomes l long to V dω / l³.
    fn uv_density(&self, density: f64, local: DVec3, length: f64) -> f32 {
        let stretch = length / local.length();
        (density * stretch.powi(3) / (self.volume * (self.scale.x * self.scale.y).abs())) as f32
    }

    /// [`Camera::view`] and [`Camera::view_far`] of a [`FilmProjection`].
    pub(super) fn film_view(
        &self,
        film: &FilmProjection,
        to: DVec3,
        is_far: bool,
        lens: [f32; 2],
        window: &UvWindow,
    ) -> Option<CameraView> {
        let local = self.from_world * if is_far { to } else { to - self.position };
        // The surface of a meter needs the numbers that choose among places: a cell of its film is chosen first, which has one place for a direction.
        let (lens, cell, cells) = match film {
            FilmProjection::Meter(_) => self.cell(lens, window),
            _ => (lens, None, 1),
        };
        let sees = |image: &FilmImage| {
            let uv = (image.at - self.offset) / self.scale;
            // Also false for what is no number.
            let distance = match film.has_clip_planes() {
                true => local.z,
                false => self.axes.mul_vec3(image.ray.direction).length(),
            };
            let visible = is_far || distance > 0.0 && distance >= self.near && distance <= self.far;
            let is_chosen = cell.is_none_or(|cell| image.at.floor() == cell);
            visible && is_chosen && is_inside(uv.to_array(), window)
        };
        let mut count = 0;
        film.images(local, is_far, lens, |image| count += u32::from(sees(&image)));
        if count == 0 {
            return None;
        }
        // No other projection of several places has a lens, so that its numbers are free.
        let chosen = ((lens[1] * count as f32) as u32).min(count - 1);
        let (mut number, mut found) = (0, None);
        film.images(local, is_far, lens, |image| {
            if sees(&image) {
                if number == chosen {
                    found = Some(image);
                }
                number += 1;
            }
        });
        let FilmImage { at, ray } = found?;
        let along = self.axes.mul_vec3(ray.direction);
        let length = along.length();
        let direction = along / length;
        let near = self.near * self.per_clip(film, ray.direction, length);
        Some(CameraView {
            uv: ((at - self.offset) / self.scale).to_array().map(|c| c as f32),
            origin: (self.position + self.axes.mul_vec3(ray.from) + direction * near).as_vec3(),
            direction: direction.as_vec3(),
            distance2: if is_far { f32::INFINITY } else { (length * length) as f32 },
            uv_per_steradian: self.uv_density(ray.density, ray.direction, length),
            choices: (count * cells) as f32,
        })
    }

    /// The cell of the film and its overscan, of the size of the film, that `lens` chooses among those in the window, what is left of the numbers, and
    /// the number of these cells.
    fn cell(&self, lens: [f32; 2], window: &UvWindow) -> ([f32; 2], Option<DVec2>, u32) {
        let [low, high] = [window.min, window.max]
            .map(|uv| self.offset + self.scale * DVec2::new(f64::from(uv[0]), f64::from(uv[1])));
        let first = low.floor();
        let size = (high.ceil() - first).max(DVec2::ONE);
        let cells = (size.x * size.y) as u32;
        let scaled = lens[1] * cells as f32;
        let number = (scaled as u32).min(cells - 1);
        let place = DVec2::new(f64::from(number) % size.x, (f64::from(number) / size.x).floor());
        ([lens[0], (scaled - number as f32).min(LAST)], Some(first + place), cells)
    }

    /// The view of the camera that `lens` chooses among several.
    pub(super) fn view_of_one(
        &self,
        cameras: &[Self],
        lens: [f32; 2],
        window: &UvWindow,
        view: impl Fn(&Self, [f32; 2], &UvWindow) -> Option<CameraView>,
    ) -> Option<CameraView> {
        let count = cameras.len();
        let scaled = lens[0] * count as f32;
        let number = (scaled as usize).min(count - 1);
        // What is left of the number chooses the point of the lens.
        let lens = [(scaled - number as f32).min(1.0 - f32::EPSILON), lens[1]];
        let [min, max] = [window.min, window.max].map(|corner| {
            let at = self.offset + self.scale * DVec2::new(f64::from(corner[0]), f64::from(corner[1]));
            DVec2::new(at.x * count as f64 - number as f64, at.y)
        });
        // Only the outer ones have overscan at their sides.
        let low = if number == 0 { min.x } else { min.x.max(0.0) };
        let high = if number + 1 == count { max.x } else { max.x.min(1.0) };
        let part = UvWindow { min: [low as f32, min.y as f32], max: [high as f32, max.y as f32] };
        let found = view(&cameras[number], lens, &part)?;
        let at = DVec2::new((f64::from(found.uv[0]) + number as f64) / count as f64, f64::from(found.uv[1]));
        Some(CameraView {
            uv: ((at - self.offset) / self.scale).to_array().map(|c| c as f32),
            uv_per_steradian: found.uv_per_steradian * self.uv_per_part(count),
            choices: found.choices * count as f32,
            ..found
        })
    }

    /// The camera of a view of one of several.
    pub(super) fn one_of<'a>(&self, cameras: &'a [Self], view: &CameraView) -> &'a Self {
        let at = self.offset + self.scale * DVec2::from_array(view.uv.map(f64::from));
        &cameras[part_of(cameras.len(), at).0]
    }

    /// Area in uv per area in the uv of one of several cameras.
    fn uv_per_part(&self, count: usize) -> f32 {
        (1.0 / (count as f64 * (self.scale.x * self.scale.y).abs())) as f32
    }

    /// [`Camera::screen_position`] of a [`FilmProjection`] or of several cameras.
    pub(super) fn shown_at(&self, place: DVec3) -> Option<DVec2> {
        let at = match &self.projection {
            Projection::Film(film) => {
                let mut first = None;
                let local = self.from_world * (place - self.position);
                film.images(local, false, [0.5; 2], |image| {
                    first.get_or_insert(image.at);
                });
                first?
            }
            Projection::Batch(cameras) => cameras.iter().enumerate().find_map(|(number, camera)| {
                let uv = camera.screen_position(place)?;
                let inside = (uv.cmpge(DVec2::ZERO) & uv.cmplt(DVec2::ONE)).all();
                inside.then(|| DVec2::new((uv.x + number as f64) / cameras.len() as f64, uv.y))
            })?,
            _ => return None,
        };
        Some((at - self.offset) / self.scale)
    }

    /// [`Camera::ray_origins`] of a [`FilmProjection`].
    pub(super) fn film_ray_origins(&self, film: &FilmProjection, window: &UvWindow) -> [Vec3; 2] {
        if !film.has_clip_planes() {
            let reach = film.reach() + self.near;
            return [self.position - reach, self.position + reach].map(|corner| corner.as_vec3());
        }
        let along = |i: u32, axis: usize| {
            let (low, high) = (f64::from(window.min[axis]), f64::from(window.max[axis]));
            low + (high - low) * f64::from(i) / f64::from(STEPS)
        };
        let places = (0..=STEPS).flat_map(|y| (0..=STEPS).map(move |x| [x, y]));
        let mut corners = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        for [x, y] in places {
            for lens in [[0.0, 0.0], [0.0, LAST], [LAST, 0.0], [LAST, LAST], [0.5, 0.5]] {
                if let Some(found) = self.other_ray([along(x, 0), along(y, 1)], lens) {
                    corners = [corners[0].min(found.ray.origin), corners[1].max(found.ray.origin)];
                }
            }
        }
        // Sides of the aperture stand out between these points of it.
        let reach = Vec3::splat(film.reach() as f32);
        match corners[0].is_finite() {
            true => [corners[0] - reach, corners[1] + reach],
            false => [self.position.as_vec3(); 2],
        }
    }
}

/// The largest lens number.
const LAST: f32 = 1.0 - f32::EPSILON;

/// The camera of a place of the film, and the uv of its own.
fn part_of(count: usize, at: DVec2) -> (usize, DVec2) {
    let scaled = at.x * count as f64;
    let number = scaled.floor().clamp(0.0, count as f64 - 1.0);
    (number as usize, DVec2::new(scaled - number, at.y))
}

/// [`Camera::ray_origins`] of several cameras over their whole pictures.
pub(super) fn ray_origins(cameras: &[Camera]) -> [Vec3; 2] {
    let boxes = cameras.iter().map(|camera| camera.ray_origins(&UvWindow::PICTURE));
    boxes.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], [a, b]| [low.min(a), high.max(b)])
}
