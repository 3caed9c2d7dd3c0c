//! Surfaces with coordinates (s, t) in the unit square, on which textured lights choose their points.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::{DMat3, DVec3, Vec2, Vec3};

use crate::math::float::UNIT_ROUNDOFF;
use crate::math::trigonometry;
use crate::tracer::light::bounds::LightBounds;
use crate::tracer::shape::{Cylinder, Disk, Sphere, SurfacePoint, Triangle};

/// A surface that emits, with coordinates of its own.
#[derive(Clone, Debug)]
pub enum EmittingSurface {
    /// A triangle or a parallelogram.
    Flat(FlatPatch),
    /// Of a disk s is the squared radius and t the angle over 2π.
    Disk(Disk),
    /// Of a sphere s is the azimuth over 2π and t half of 1 − cos of the angle to the pole.
    Sphere {
        /// The sphere.
        sphere: Sphere,
        /// Directions from the centre in its own space to those in world space, and back.
        axes: [DMat3; 2],
    },
    /// Of a cylinder s is the angle over 2π and t the height.
    Cylinder(Cylinder),
}

/// A triangle, whose s and t are (a + b)² and b / (a + b) of its barycentric coordinates, or a parallelogram, whose s and t go along
/// its edges.
#[derive(Clone, Debug)]
pub struct FlatPatch {
    half: Triangle,
    is_triangle: bool,
    /// Texture coordinates of the corner, and the steps along both edges.
    uv: [Vec2; 3],
    /// Map an offset from the corner to the shares of the edges.
    to_shares: [DVec3; 2],
}

impl FlatPatch {
    /// The triangle with these texture coordinates at its first corner and steps to the other two.
    pub fn triangle(triangle: Triangle, uv: [Vec2; 3]) -> Self {
        Self::new(triangle, uv, true)
    }

    /// The parallelogram over the first two edges of its first half.
    pub fn parallelogram(half: Triangle, uv: [Vec2; 3]) -> Self {
        Self::new(half, uv, false)
    }

    fn new(half: Triangle, uv: [Vec2; 3], is_triangle: bool) -> Self {
        let (a, b) = (half.e1.as_dvec3(), half.e2.as_dvec3());
        // The reciprocal basis in the plane.
        let cross = a.cross(b);
        let to_shares = [b.cross(cross), cross.cross(a)].map(|v| v / cross.length_squared());
        Self { half, is_triangle, uv, to_shares }
    }

    /// Shares of both edges.
    fn shares(&self, [s, t]: [f32; 2]) -> [f32; 2] {
        match self.is_triangle {
            true => [s.sqrt() * (1.0 - t), s.sqrt() * t],
            false => [s, t],
        }
    }
}

impl EmittingSurface {
    /// The point at (s, t).
    pub(super) fn point(&self, [s, t]: [f32; 2]) -> SurfacePoint {
        let around = if matches!(self, Self::Disk(_)) { t } else { s };
        let (sin, cos) = trigonometry::sin_cos(TAU * around);
        match self {
            Self::Flat(patch) => {
                let mut point = patch.half.point(patch.shares([s, t]));
                // The corner of a parallelogram may be rounded once.
                point.error += point.p.abs() * UNIT_ROUNDOFF;
                point
            }
            Self::Disk(disk) => disk.point_at(s.sqrt() * cos, s.sqrt() * sin),
            Self::Sphere { sphere, axes } => {
                let r = 2.0 * (t * (1.0 - t)).sqrt();
                let d = DVec3::new(f64::from(r * cos), f64::from(r * sin), f64::from(1.0 - 2.0 * t));
                sphere.point_towards((axes[0] * d).normalize_or(DVec3::Z).as_vec3())
            }
            Self::Cylinder(cylinder) => cylinder.point_at([cos, sin], t),
        }
    }

    /// (s, t) of a point on the surface, or of one near it.
    pub(super) fn coordinates(&self, p: Vec3) -> [f32; 2] {
        let turn = |x: f32, y: f32| {
            let share = trigonometry::atan2(y, x) / TAU;
            if share < 0.0 { share + 1.0 } else { share }
        };
        let within = |v: f32| v.clamp(0.0, 1.0);
        match self {
            Self::Flat(patch) => {
                let offset = p.as_dvec3() - patch.half.p0.as_dvec3();
                let [a, b] = patch.to_shares.map(|v| (v.dot(offset) as f32).max(0.0));
                match patch.is_triangle {
                    true if a + b > 0.0 => [within((a + b) * (a + b)), b / (a + b)],
                    _ => [within(a), within(b)],
                }
            }
            Self::Disk(disk) => {
                let [x, y] = disk.coordinates(p);
                [within(x * x + y * y), turn(x, y)]
            }
            Self::Sphere { sphere, axes } => {
                let d = (axes[1] * (p.as_dvec3() - sphere.center.as_dvec3())).normalize_or(DVec3::Z);
                [turn(d.x as f32, d.y as f32), within((0.5 - 0.5 * d.z) as f32)]
            }
            Self::Cylinder(cylinder) => {
                let ([x, y], z) = (cylinder.around(p), cylinder.height(p));
                [turn(x, y), within(z)]
            }
        }
    }

    /// Texture coordinates at (s, t), as Mitsuba defines them for the shape.
    pub(super) fn uv(&self, [s, t]: [f32; 2]) -> Vec2 {
        match self {
            Self::Flat(patch) => {
                let [a, b] = patch.shares([s, t]);
                patch.uv[0] + patch.uv[1] * a + patch.uv[2] * b
            }
            Self::Disk(_) => Vec2::new(s.sqrt(), t),
            Self::Sphere { .. } => Vec2::new(s, (1.0 - 2.0 * t).clamp(-1.0, 1.0).acos() * FRAC_1_PI),
            Self::Cylinder(_) => Vec2::new(s, t),
        }
    }

    /// Steps of the texture coordinates over the whole of s and of t.
    pub(super) fn uv_extent(&self) -> [Vec2; 2] {
        match self {
            Self::Flat(patch) if patch.is_triangle => [patch.uv[1], patch.uv[2] - patch.uv[1]],
            Self::Flat(patch) => [patch.uv[1], patch.uv[2]],
            _ => [Vec2::X, Vec2::Y],
        }
    }

    /// Area per unit of s and t at (s, t).
    pub(super) fn stretch(&self, [s, _]: [f32; 2]) -> f32 {
        match self {
            Self::Flat(FlatPatch { half, is_triangle: true, .. }) => half.area(),
            Self::Flat(FlatPatch { half, .. }) => 2.0 * half.area(),
            Self::Disk(disk) => disk.area(),
            Self::Sphere { sphere, .. } => sphere.area(),
            Self::Cylinder(cylinder) => {
                let (sin, cos) = trigonometry::sin_cos(TAU * s);
                TAU * cylinder.stretch([cos, sin])
            }
        }
    }

    /// The normal of the front at a point.
    pub(super) fn normal(&self, p: Vec3) -> Vec3 {
        match self {
            Self::Flat(patch) => patch.half.n,
            Self::Disk(disk) => disk.n,
            Self::Sphere { .. } | Self::Cylinder(_) => self.point(self.coordinates(p)).ng,
        }
    }

    /// True if the surface itself stands between a point and the front of `target` on it. (In the scene no light shadows itself.)
    pub(super) fn hides(&self, from: Vec3, target: Vec3) -> bool {
        match self {
            Self::Sphere { sphere, .. } => {
                sphere.inward && from.distance_squared(sphere.center) > sphere.radius * sphere.radius
            }
            Self::Cylinder(cylinder) => cylinder.inward && cylinder.hides_inside(from, target),
            _ => false,
        }
    }

    /// Bounds of the light, and corners of the box around it.
    pub(super) fn bounds(&self, power: f32) -> (LightBounds, [Vec3; 2]) {
        match self {
            Self::Flat(patch) => {
                let Triangle { p0, e1, e2, n } = patch.half;
                let far = if patch.is_triangle { e1 } else { e1 + e2 };
                let (lo, hi) = (e1.min(e2).min(far), e1.max(e2).max(far));
                let corners = [p0 + lo.min(Vec3::ZERO), p0 + hi.max(Vec3::ZERO)];
                (LightBounds::flat(corners, n, power), corners)
            }
            Self::Disk(disk) => {
                (LightBounds::flat(disk.bounds().into(), disk.n, power), disk.bounds().into())
            }
            Self::Sphere { sphere, .. } => {
                let radius2 = sphere.radius.powi(2);
                (LightBounds::round(sphere.center, radius2, power), sphere.bounds().into())
            }
            Self::Cylinder(cylinder) => {
                let (lo, hi) = cylinder.bounds();
                let radius2 = 0.25 * (hi - lo).length_squared();
                (LightBounds::round(0.5 * (lo + hi), radius2, power), [lo, hi])
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The stretch of flat surfaces and of disks is the same all over: their area.
    #[test]
    fn the_stretch_of_a_surface_is_its_area() {
        let (a, b) = (Vec3::new(3.0, 0.0, 0.0), Vec3::new(0.0, 5.0, 0.0));
        let half = Triangle::new([Vec3::ZERO, a, b]).expect("a triangle");
        let disk = Disk::new(Vec3::ZERO, a, b, DVec3::Z).expect("a disk");
        for (surface, area) in [
            (EmittingSurface::Flat(FlatPatch::triangle(half, [Vec2::ZERO; 3])), 7.5),
            (EmittingSurface::Flat(FlatPatch::parallelogram(half, [Vec2::ZERO; 3])), 15.0),
            (EmittingSurface::Disk(disk), 15.0 * std::f32::consts::PI),
        ] {
            let stretch = surface.stretch([0.3, 0.6]);
            assert!((stretch / area - 1.0).abs() < 1e-6, "{stretch} instead of {area}");
        }
    }
}
