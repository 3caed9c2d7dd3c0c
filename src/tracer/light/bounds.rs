//! Bounds of lights: how much light each, or a group of them, may bring to a point.
//!
//! These are the bounds of Conty Estevez and Kulla, *Importance Sampling of Many Lights with Adaptive Tree Splitting*,
//! HPG 2018, §4.1 (also Pharr, Jakob, Humphreys, *Physically Based Rendering*, 4th ed., §12.6.3): a sphere around the
//! lights, a cone around their normals, and the sum of their powers. All lights here emit by the cosine, evenly or into
//! less than that, so that the angle beyond the normals to which light is sent is always 90°.

use glam::Vec3;

use crate::tracer::bounding_sphere::BoundingSphere;

use super::sample::LightSampleContext;

/// Bounds of a light, or of several.
#[derive(Clone, Copy, Debug)]
pub struct LightBounds {
    /// Centre of the bounding sphere; not used for a light infinitely far away.
    pub(super) center: Vec3,
    /// Its radius squared; negative for a light infinitely far away, whose importance is the same in all places.
    pub(super) radius2: f32,
    /// Unit axis of the cone that holds all normals.
    pub(super) axis: Vec3,
    /// Cosine of its half angle; −1 when there is light in all directions.
    pub(super) cos: f32,
    /// Irradiance at unit distance, straight in front; at any distance, of a light infinitely far away.
    pub(super) power: f32,
}

impl LightBounds {
    /// Bounds of a flat light in the box from `lo` to `hi`, with front normal `axis`.
    pub(super) fn flat([lo, hi]: [Vec3; 2], axis: Vec3, power: f32) -> Self {
        let (center, radius2) = (0.5 * (lo + hi), 0.25 * (hi - lo).length_squared());
        Self { center, radius2, axis, cos: 1.0, power }
    }

    /// Bounds of a light that emits evenly to all sides.
    pub(super) fn round(center: Vec3, radius2: f32, power: f32) -> Self {
        // A quarter of the surface of a sphere is seen, and lit like a disk.
        Self { center, radius2, axis: Vec3::Z, cos: -1.0, power: 0.25 * power }
    }

    /// Bounds of an environment, whose box contains no point.
    pub(super) fn infinite(power: f32, scene: BoundingSphere) -> (Self, [Vec3; 2]) {
        let far = 1.0 / (scene.radius * scene.radius).max(f32::MIN_POSITIVE);
        let bounds =
            Self { power: (0.25 * power * far).min(f32::MAX), ..Self::round(scene.center, -1.0, power) };
        (bounds, [Vec3::INFINITY, Vec3::NEG_INFINITY])
    }

    /// Bounds of light that goes in the unit direction `axis` everywhere.
    pub(super) fn parallel(axis: Vec3, power: f32, scene: BoundingSphere) -> (Self, [Vec3; 2]) {
        // Four times the irradiance of an environment's power: that comes from all around.
        let (bounds, corners) = Self::infinite(4.0 * power, scene);
        (Self { axis, cos: 1.0, ..bounds }, corners)
    }

    /// True for a light infinitely far away.
    pub(super) fn is_far(&self) -> bool {
        self.radius2 < 0.0
    }

    /// An estimate of the unoccluded irradiance at `at`: ≥ 0, and 0 only where no point of the lights can send light to the
    /// seen side of the surface.
    #[inline]
    pub(super) fn importance(&self, at: LightSampleContext) -> f32 {
        if self.radius2 < 0.0 {
            return if self.cos < 0.0 { self.power } else { self.power * received(at, -self.axis, 0.0) };
        }
        let to = self.center - at.p;
        let distance2 = to.length_squared();
        let falloff = self.power / distance2.max(self.radius2).max(LEAST_DISTANCE2);
        if distance2 <= self.radius2 || distance2 == 0.0 {
            return INSIDE * falloff;
        }
        let wi = to * (1.0 / distance2.sqrt());
        // The bounding sphere is seen under a half angle of this sine.
        let sin_u = (self.radius2 / distance2).sqrt();
        let received = received(at, wi, sin_u);
        if self.cos <= -1.0 {
            return falloff * received;
        }
        // The angle to the axis, less the half angle of the cone.
        let cos_w = -wi.dot(self.axis);
        let cos_w = if self.cos == 1.0 {
            cos_w
        } else if cos_w >= self.cos {
            1.0
        } else {
            let sin2 = ((1.0 - cos_w * cos_w) * (1.0 - self.cos * self.cos)).max(0.0);
            cos_w * self.cos + sin2.sqrt()
        };
        falloff * received * mean_cosine(cos_w, sin_u)
    }
}

/// The least squared distance that is distinguished, 2^−120: the quotient of a power, at most 1, stays finite. It knows
/// nothing of the scene, because one huge object in it would make the choice poor everywhere else.
const LEAST_DISTANCE2: f32 = 64.0 * f32::MIN_POSITIVE;

/// Share of the power that counts within the bounding sphere, where angles say nothing.
const INSIDE: f32 = 0.5;

/// The mean cosine at `at` of light that comes from around `wi`, from a half angle of sine `sin_u`.
#[inline]
fn received(at: LightSampleContext, wi: Vec3, sin_u: f32) -> f32 {
    let cos = wi.dot(at.n);
    mean_cosine(if at.through { cos.abs() } else { cos }, sin_u)
}

/// The mean of the positive cosines over a sphere in a direction of cosine `cos` that fills a half angle of sine `sin_u`:
/// `cos` itself where all of it is above the horizon (exact for a sphere of even radiance), 0 where none is, and between
/// them the parabola that goes on smoothly at both ends.
#[inline]
fn mean_cosine(cos: f32, sin_u: f32) -> f32 {
    // Tolerance, so that rounding hides no light that is just visible.
    const SLACK: f32 = 1e-6;
    let (above, u) = (cos + sin_u, sin_u + SLACK);
    if cos >= sin_u { cos + SLACK } else { (above + SLACK).max(0.0).powi(2) / (4.0 * u) }
}
