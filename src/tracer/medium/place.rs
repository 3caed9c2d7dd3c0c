//! The medium around a point, found by rays: files need not say which medium a lamp or a camera that moves is in.

use std::sync::Arc;

use glam::Vec3;

use crate::tracer::accel::Ray;
use crate::tracer::{Camera, Scene};

use super::{Media, MediumIndex};

/// Directions in which surfaces are looked for: twelve, about evenly spread and not aligned with the axes.
const DIRECTIONS: usize = 12;

/// Most surfaces along one of them.
const MOST_SURFACES: usize = 256;

/// A Fibonacci lattice on the sphere.
fn direction(number: usize) -> Vec3 {
    let z = 1.0 - (2 * number + 1) as f32 / DIRECTIONS as f32;
    let (sin, cos) = (2.399_963_2 * number as f32 + 0.731).sin_cos();
    let r = (1.0 - z * z).sqrt();
    Vec3::new(r * cos, r * sin, z)
}

/// The medium that the rays of a camera begin in.
#[derive(Clone, Copy, Debug)]
pub struct CameraMedium {
    /// That around the camera.
    pub medium: MediumIndex,
    /// The camera stands on the boundary of a medium: each of its rays begins in the medium that lies ahead.
    pub on_boundary: bool,
}

impl CameraMedium {
    /// That of `camera` in a scene.
    pub fn of(scene: &Scene, camera: &Camera) -> Self {
        let on_boundary = scene.is_on_medium_boundary(camera.position());
        Self { medium: camera.medium_in(scene), on_boundary }
    }

    /// The medium that this ray of the camera begins in.
    pub fn along(self, scene: &Scene, ray: &Ray) -> MediumIndex {
        if self.on_boundary { scene.medium_ahead(ray) } else { self.medium }
    }
}

impl Scene {
    /// The medium at the point `p` of rendering space: a majority vote over rays in a few directions and towards boundaries, each of which votes
    /// for the medium that the first boundary it meets has on the side of `p`. `None` where no boundary is met.
    pub fn medium_around(&self, p: Vec3) -> Option<MediumIndex> {
        let media = self.media()?;
        let around = (0..DIRECTIONS).map(direction);
        // A boundary far away lies in none of these directions.
        let towards = media.middles.iter().filter_map(|middle| (*middle - p).try_normalize());
        let found = around.chain(towards).filter_map(|d| self.medium_seen(media, Ray::new(p, d)));
        let mut votes: Vec<(MediumIndex, usize)> = Vec::new();
        for medium in found {
            match votes.iter_mut().find(|(known, _)| *known == medium) {
                Some((_, count)) => *count += 1,
                None => votes.push((medium, 1)),
            }
        }
        votes.into_iter().max_by_key(|(_, count)| *count).map(|(medium, _)| medium)
    }

    /// True where a boundary goes through the point `p` of rendering space, but for rounding: what is around it depends on the direction.
    pub fn is_on_medium_boundary(&self, p: Vec3) -> bool {
        let Some(media) = self.media() else { return false };
        let near = (p.abs().max_element() * (8.0 * f32::EPSILON)).max(f32::MIN_POSITIVE);
        (0..DIRECTIONS).any(|i| {
            let across = Ray::between(p - direction(i) * near, p + direction(i) * near, 1.0);
            self.first(&across).is_some_and(|at| media.interface(at.surface).is_some())
        })
    }

    /// The medium that a ray begins in, by the first surface with media that it meets, or else that around the scene.
    pub fn medium_ahead(&self, ray: &Ray) -> MediumIndex {
        let Some(media) = self.media() else { return MediumIndex::VACUUM };
        self.medium_seen(media, *ray).unwrap_or(media.outside)
    }

    /// The medium that a ray begins in, by the first surface with media that it meets.
    fn medium_seen(&self, media: &Media, mut ray: Ray) -> Option<MediumIndex> {
        for _ in 0..MOST_SURFACES {
            let at = self.first(&ray)?;
            let beside = self.beside(&at, ray.direction);
            if let Some(medium) = media.before_both(&at, beside.as_ref(), ray.direction) {
                return Some(medium);
            }
            ray = at.spawn(ray.direction);
        }
        None
    }

    /// Finds the media around all sources of light.
    pub(in crate::tracer) fn place_lights_in_media(&mut self) {
        let Some(media) = self.media() else { return };
        let lights = self.lights();
        let mut places: Vec<Option<Option<MediumIndex>>> = Vec::new();
        for light in 0..lights.len() as u32 {
            let source = lights.source(light) as usize;
            if places.len() <= source {
                places.resize(source + 1, None);
            }
            if places[source].is_none() {
                places[source] = Some(lights.place(light).and_then(|p| self.medium_around(p)));
            }
        }
        let (lo, hi) = self.accel().bounds();
        let (center, far) = (0.5 * (lo + hi), (hi - lo).length().max(f32::MIN_POSITIVE));
        let seen = |i| self.medium_seen(media, Ray::new(center - direction(i) * far, direction(i)));
        let outside = (0..DIRECTIONS).find_map(seen);
        let outside = outside.unwrap_or(media.outside);
        let of_sources = places.into_iter().map(|place| place.flatten().unwrap_or(outside)).collect();
        self.media = Some(Arc::new(Media { of_sources, outside, ..media.clone() }));
    }
}
