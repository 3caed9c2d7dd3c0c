//! The medium around a point, found by rays: files need not say which medium a lamp or a camera that moves is in.
//!
//! Where a boundary goes through a lamp, or through the points at which the rays of a camera begin, each ray looks for the medium that it begins
//! in, by the first boundary ahead. That is one more ray for each of them, and only what lies so pays for it.

use std::sync::Arc;

use glam::{DAffine3, Vec3};

use crate::scene::SceneDesc;
use crate::scene::desc::{LightDesc, ShapeDesc};
use crate::stream::UvWindow;
use crate::tracer::accel::Ray;
use crate::tracer::{Camera, Scene};

use super::boundaries::{Boundaries, bounds_of};
use super::{Media, MediumIndex};

/// Directions in which surfaces are looked for: twelve, about evenly spread and not aligned with the axes.
const DIRECTIONS: usize = 12;

/// Most boundaries towards whose middles they are looked for.
const MOST_MIDDLES: usize = 64;

/// Most surfaces along one direction.
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
    /// A boundary of media goes through the points at which they begin: each begins in the medium that lies ahead.
    pub on_boundary: bool,
}

impl CameraMedium {
    /// That of `camera` in a scene, for the whole picture and `window`, so that another window of the picture may take the place of this one.
    pub fn of(scene: &Scene, camera: &Camera, window: &UvWindow) -> Self {
        let UvWindow { min, max } = window;
        let all = UvWindow { min: min.map(|c| c.min(0.0)), max: max.map(|c| c.max(1.0)) };
        let on_boundary = scene.is_cut_by_medium_boundary(camera.ray_origins(&all));
        Self { medium: camera.medium_in(scene, &all), on_boundary }
    }

    /// The medium that this ray of the camera begins in.
    pub fn along(self, scene: &Scene, ray: &Ray) -> MediumIndex {
        if self.on_boundary { scene.medium_ahead(ray) } else { self.medium }
    }
}

/// The media that were found, each with how often.
fn votes(found: impl Iterator<Item = MediumIndex>) -> Vec<(MediumIndex, usize)> {
    let mut votes: Vec<(MediumIndex, usize)> = Vec::new();
    for medium in found {
        match votes.iter_mut().find(|(known, _)| *known == medium) {
            Some((_, count)) => *count += 1,
            None => votes.push((medium, 1)),
        }
    }
    votes
}

fn most_frequent(votes: &[(MediumIndex, usize)]) -> Option<MediumIndex> {
    votes.iter().max_by_key(|(_, count)| *count).map(|(medium, _)| *medium)
}

impl Scene {
    /// The medium at the point `p` of rendering space: a majority vote over rays in a few directions and towards boundaries, each of which votes
    /// for the medium that the first boundary it meets has on the side of `p`. `None` where no boundary is met.
    pub fn medium_around(&self, p: Vec3) -> Option<MediumIndex> {
        let media = self.media()?;
        let around = (0..DIRECTIONS).map(direction);
        // A boundary far away lies in none of these directions.
        let middles = media.boundaries.middles().take(MOST_MIDDLES);
        let towards = middles.filter_map(|middle| (middle - p).try_normalize());
        most_frequent(&votes(around.chain(towards).filter_map(|d| self.medium_seen(media, Ray::new(p, d)))))
    }

    /// True where a boundary goes through the box of rendering space with these corners, but for rounding: the medium depends on the place in it.
    /// Of a boundary of very many faces only its bounding box counts.
    pub fn is_cut_by_medium_boundary(&self, corners: [Vec3; 2]) -> bool {
        self.media().is_some_and(|media| media.boundaries.cut(corners))
    }

    /// The medium that a ray begins in, by the first surface with media that it meets, or else that around the scene.
    pub fn medium_ahead(&self, ray: &Ray) -> MediumIndex {
        let Some(media) = self.media() else { return MediumIndex::VACUUM };
        // Its end does not matter.
        self.medium_seen(media, Ray { t_max: f32::INFINITY, ..*ray }).unwrap_or(media.outside)
    }

    /// The medium that a ray begins in, by the first surface with media that it meets.
    fn medium_seen(&self, media: &Media, mut ray: Ray) -> Option<MediumIndex> {
        for _ in 0..MOST_SURFACES {
            let at = self.first(&ray)?;
            let beside = self.beside(media, &at, ray.direction);
            if let Some(medium) = media.before_all(&at, &beside, ray.direction) {
                return Some(medium);
            }
            ray = at.spawn(ray.direction);
        }
        None
    }

    /// Finds where the boundaries of a description in rendering space are, and the media that all sources of light shine into.
    pub(in crate::tracer) fn place_lights_in_media(&mut self, desc: &SceneDesc) {
        if let Some(media) = &mut self.media {
            Arc::make_mut(media).boundaries = Boundaries::of(desc);
        }
        let Some(media) = self.media() else { return };
        let from_outside = self.media_from_outside(media);
        let outside = most_frequent(&from_outside).unwrap_or(media.outside);
        // Where boundaries are open, as that of a sea, one side of them is another medium, which has no end either.
        let of_far = (from_outside.len() < 2).then_some(outside);
        let emitting = desc.shapes.iter().filter(|shape| shape.emission.is_some());
        let of_shapes = emitting.map(|shape| self.medium_before(desc, shape, outside));
        let of_lights = desc.lights.iter().map(LightDesc::position).map(|position| match position {
            Some(p) => self.medium_within([p.as_vec3(); 2], outside),
            None => of_far,
        });
        let of_sources = of_shapes.chain(of_lights).collect();
        if let Some(media) = &mut self.media {
            let media = Arc::make_mut(media);
            (media.of_sources, media.outside) = (of_sources, outside);
        }
    }

    /// The media that rays from far outside come through first, in a few directions through the middles of boundaries.
    fn media_from_outside(&self, media: &Media) -> Vec<(MediumIndex, usize)> {
        let (low, high) = self.accel().bounds();
        let far = (1.5 * (high - low).length()).max(f32::MIN_POSITIVE);
        let through = media.boundaries.middles().take(MOST_MIDDLES).chain([0.5 * (low + high)]);
        let rays = through
            .flat_map(|p| (0..DIRECTIONS).map(move |i| Ray::new(p - direction(i) * far, direction(i))));
        votes(rays.filter_map(|ray| self.medium_seen(media, ray)))
    }

    /// The medium in front of a shape that emits; `None` where there are several.
    fn medium_before(
        &self,
        desc: &SceneDesc,
        shape: &ShapeDesc,
        outside: MediumIndex,
    ) -> Option<MediumIndex> {
        if shape.medium_interface.is_transition() {
            return Some(shape.medium_interface.exterior.into());
        }
        // Nothing shines from a shape of which there is nothing.
        bounds_of(desc, shape, DAffine3::IDENTITY)
            .map_or(Some(outside), |corners| self.medium_within(corners, outside))
    }

    /// The medium that fills a box; `None` where a boundary goes through it, and `outside` where no boundary is seen.
    fn medium_within(&self, corners: [Vec3; 2], outside: MediumIndex) -> Option<MediumIndex> {
        let [low, high] = corners;
        (!self.is_cut_by_medium_boundary(corners))
            .then(|| self.medium_around(0.5 * (low + high)).unwrap_or(outside))
    }
}
