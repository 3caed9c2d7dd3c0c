//! Meters of irradiance.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec2, DVec3};

use crate::math::warp;
use crate::scene::desc::MeterSurface;

use super::local_ray::{FilmImage, LocalRay, OVERSCAN};

/// All directions above a surface. The numbers of the lens choose a point of the surface, uniformly; the place in the film is the direction in the
/// frame of the normal there: x = sin² θ, so that equal areas of the film have equal projected solid angles, and y is the angle around the normal.
/// The film goes on beyond its edges: mirrored along x and around along y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Meter {
    surface: MeterSurface,
    /// Half of the extent along x and y of a flat surface.
    half: DVec2,
}

impl Meter {
    /// A meter on a shape whose axes have these lengths; those of a sphere are equal.
    pub(super) fn new(surface: MeterSurface, scales: DVec3) -> Self {
        let surface = match surface {
            MeterSurface::Sphere { center, radius } => {
                MeterSurface::Sphere { center: center * scales, radius: radius * scales.x }
            }
            flat => flat,
        };
        Self { surface, half: scales.truncate() }
    }

    pub(super) fn scaled(&self, unit: f64) -> Self {
        Self { half: self.half * unit, ..Self::new(self.surface, DVec3::splat(unit)) }
    }

    /// The radius around the origin within which the surface lies.
    pub(super) fn reach(&self) -> f64 {
        match self.surface {
            MeterSurface::Rectangle => self.half.length(),
            MeterSurface::Disk => self.half.max_element(),
            MeterSurface::Sphere { center, radius } => center.length() + radius.abs(),
        }
    }

    /// A point of the surface, and the frame there with the normal as its z.
    fn point(&self, lens: [f32; 2]) -> (DVec3, DMat3) {
        match self.surface {
            MeterSurface::Rectangle => {
                let on = 2.0 * DVec2::from_array(lens.map(f64::from)) - 1.0;
                ((on * self.half).extend(0.0), DMat3::IDENTITY)
            }
            MeterSurface::Disk => ((warp::disk(lens).as_dvec2() * self.half).extend(0.0), DMat3::IDENTITY),
            MeterSurface::Sphere { center, radius } => {
                let outwards = warp::sphere(lens).as_dvec3().normalize_or(DVec3::Z);
                let normal = outwards * radius.signum();
                let (x, y) = normal.any_orthonormal_pair();
                (center + outwards * radius.abs(), DMat3::from_cols(x, y, normal))
            }
        }
    }

    pub(super) fn ray(&self, at: DVec2, lens: [f32; 2]) -> Option<LocalRay> {
        let within = at.cmpge(DVec2::splat(-OVERSCAN)) & at.cmplt(DVec2::splat(1.0 + OVERSCAN));
        if !within.all() {
            return None;
        }
        let sin2 = if at.x > 1.0 { 2.0 - at.x } else { at.x.abs() };
        let (from, frame) = self.point(lens);
        let cos = (1.0 - sin2).sqrt();
        let direction = frame * (DVec2::from_angle(TAU * at.y) * sin2.sqrt()).extend(cos);
        Some(LocalRay { from, direction, density: cos / PI })
    }

    /// Adds every place of the film and its overscan that shows a point, or one at infinity in that direction.
    pub(super) fn images(&self, to: DVec3, is_far: bool, lens: [f32; 2], mut add: impl FnMut(FilmImage)) {
        let (from, frame) = self.point(lens);
        let direction = if is_far { to } else { to - from };
        let local = frame.transpose() * direction.normalize_or_zero();
        if local.z <= 0.0 {
            return;
        }
        let across = local.truncate();
        let (sin2, turn) = (across.length_squared(), (across.y.atan2(across.x) / TAU).rem_euclid(1.0));
        let ray = LocalRay { from, direction, density: local.z / PI };
        let limits = -OVERSCAN..1.0 + OVERSCAN;
        for x in [sin2, -sin2, 2.0 - sin2] {
            for y in [turn, turn - 1.0, turn + 1.0] {
                if limits.contains(&x) && limits.contains(&y) {
                    add(FilmImage { at: DVec2::new(x, y), ray });
                }
            }
        }
    }
}
