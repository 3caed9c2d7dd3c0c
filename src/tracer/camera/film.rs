//! Projections that are neither a plain pinhole or lens nor parallel: between places of the film and rays in camera space.
//!
//! Places are in the coordinates that suit a projection: of the plane z = 1 for a lens with a distortion, of the film, with (0, 0) at its top left
//! corner, for all directions. [`Camera`](super::Camera) maps uv to them linearly, and camera space to world space.

use glam::{DVec2, DVec3};

use crate::math::warp;
use crate::scene::desc::{LensDesc, PerspectiveDesc};

use super::aperture::Aperture;
use super::cube::CubeMap;
use super::distortion::Distortion;
use super::fisheye::Fisheye;
use super::local_ray::{FilmImage, LocalRay};
use super::meter::Meter;
use super::panorama::Panorama;

/// A projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum FilmProjection {
    /// A plane seen through a lens with a distortion, or an aperture that is no disk.
    Plane(PlaneLens),
    /// A fisheye lens.
    Fisheye(Fisheye),
    /// All directions by longitude and latitude.
    Panorama(Panorama),
    /// All directions on a cube.
    CubeMap(CubeMap),
    /// All directions above a surface.
    Meter(Meter),
    /// All places have the rays along z from a disk of this radius.
    Beam(f64),
}

/// A thin lens in the plane z = 0 before a picture in the plane z = 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlaneLens {
    distortion: Option<Distortion>,
    /// None for a pinhole.
    aperture: Option<Aperture>,
    /// 1 / z of the plane in focus.
    focus: f64,
}

impl PlaneLens {
    pub(super) fn new(desc: &PerspectiveDesc) -> Self {
        let LensDesc { radius, focus_distance, .. } = desc.lens;
        let has_lens = radius > 0.0;
        Self {
            distortion: desc.distortion.as_ref().map(Distortion::new),
            aperture: has_lens.then(|| Aperture::new(&desc.lens)),
            focus: if has_lens { 1.0 / focus_distance } else { 0.0 },
        }
    }

    fn on_lens(&self, lens: [f32; 2]) -> DVec2 {
        self.aperture.map_or(DVec2::ZERO, |aperture| aperture.at(lens))
    }

    fn ray(&self, at: DVec2, lens: [f32; 2]) -> Option<LocalRay> {
        let (xy, magnification) = match &self.distortion {
            Some(distortion) => distortion.undistort(at)?,
            None => (at, 1.0),
        };
        let on_lens = self.on_lens(lens);
        let direction = (xy - on_lens * self.focus).extend(1.0);
        let density = magnification * direction.length().powi(3);
        Some(LocalRay { from: on_lens.extend(0.0), direction, density })
    }

    fn image(&self, to: DVec3, is_far: bool, lens: [f32; 2]) -> Option<FilmImage> {
        if to.z <= 0.0 {
            return None;
        }
        let on_lens = self.on_lens(lens);
        let from = on_lens.extend(0.0);
        let direction = if is_far { to } else { to - from };
        let across = direction.truncate() / to.z;
        let xy = across + on_lens * self.focus;
        let (at, magnification) = match &self.distortion {
            Some(distortion) => distortion.distort(xy)?,
            None => (xy, 1.0),
        };
        let density = magnification * across.extend(1.0).length().powi(3);
        Some(FilmImage { at, ray: LocalRay { from, direction, density } })
    }
}

impl FilmProjection {
    /// The ray of a place; `None` where the lens shows nothing.
    pub(super) fn ray(&self, at: DVec2, lens: [f32; 2]) -> Option<LocalRay> {
        match self {
            Self::Plane(plane) => plane.ray(at, lens),
            Self::Fisheye(fisheye) => fisheye.ray(at),
            Self::Panorama(panorama) => panorama.ray(at),
            Self::CubeMap(cube) => cube.ray(at),
            Self::Meter(meter) => meter.ray(at, lens),
            Self::Beam(radius) => {
                let from = warp::disk(lens).as_dvec2() * *radius;
                Some(LocalRay { from: from.extend(0.0), direction: DVec3::Z, density: 1.0 })
            }
        }
    }

    /// Adds every place that shows the point `to` of camera space, or the one at infinity in that direction, through the point of the lens that
    /// `lens` chooses.
    pub(super) fn images(&self, to: DVec3, is_far: bool, lens: [f32; 2], mut add: impl FnMut(FilmImage)) {
        match self {
            Self::Plane(plane) => plane.image(to, is_far, lens).into_iter().for_each(add),
            Self::Fisheye(fisheye) => {
                if let Some((at, density)) = fisheye.place(to) {
                    add(FilmImage { at, ray: LocalRay { from: DVec3::ZERO, direction: to, density } });
                }
            }
            Self::Panorama(panorama) => panorama.images(to, is_far, add),
            Self::CubeMap(cube) => cube.images(to, add),
            Self::Meter(meter) => meter.images(to, is_far, lens, add),
            Self::Beam(_) => (),
        }
    }

    /// Whether near and far clip are planes across z; else they are distances along the ray.
    pub(super) fn has_clip_planes(&self) -> bool {
        matches!(self, Self::Plane(_))
    }

    /// Whether lines are shown as lines.
    pub(super) fn is_plane(&self) -> bool {
        matches!(self, Self::Plane(PlaneLens { distortion: None, .. }))
    }

    /// The same in a space whose lengths are `unit` times as long.
    pub(super) fn scaled(&self, unit: f64) -> Self {
        let mut scaled = *self;
        match &mut scaled {
            Self::Plane(PlaneLens { aperture, focus, .. }) => {
                aperture.iter_mut().for_each(|aperture| aperture.radius *= unit);
                *focus /= unit;
            }
            Self::Panorama(panorama) => panorama.radius *= unit,
            Self::Beam(radius) => *radius *= unit,
            Self::Meter(meter) => *meter = meter.scaled(unit),
            Self::Fisheye(_) | Self::CubeMap(_) => (),
        }
        scaled
    }

    /// The radius around the camera within which rays go through their points of the lens.
    pub(super) fn reach(&self) -> f64 {
        match self {
            // Narrower along x, or wider: a squeeze below 1.
            Self::Plane(plane) => plane.aperture.map_or(0.0, |aperture| aperture.reach()),
            Self::Panorama(panorama) => panorama.radius,
            Self::Beam(radius) => *radius,
            Self::Meter(meter) => meter.reach(),
            Self::Fisheye(_) | Self::CubeMap(_) => 0.0,
        }
    }
}
