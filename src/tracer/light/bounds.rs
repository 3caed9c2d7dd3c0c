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
    ///
    /// Every case is computed and one is selected: without branches the compiler computes several lights at once ([`BoundsPack`]).
    #[inline(always)]
    pub(super) fn importance(&self, at: LightSampleContext) -> f32 {
        let Self { center, radius2, axis, cos, power } = *self;
        let is_far = radius2 < 0.0;
        let to = center - at.p;
        let distance2 = to.length_squared();
        let falloff = if is_far { power } else { power / distance2.max(radius2).max(LEAST_DISTANCE2) };
        let near = to * (1.0 / distance2.sqrt());
        let wi = Vec3::new(
            if is_far { -axis.x } else { near.x },
            if is_far { -axis.y } else { near.y },
            if is_far { -axis.z } else { near.z },
        );
        // The bounding sphere is seen under a half angle of this sine.
        let sin_u = if is_far { 0.0 } else { (radius2 / distance2).sqrt() };
        let cos_n = wi.dot(at.n);
        let received = mean_cosine(if at.through { cos_n.abs() } else { cos_n }, sin_u);
        // The angle to the axis, less the half angle of the cone.
        let cos_w = -wi.dot(axis);
        let sin2 = ((1.0 - cos_w * cos_w) * (1.0 - cos * cos)).max(0.0);
        let within = if cos_w >= cos { 1.0 } else { cos_w * cos + sin2.sqrt() };
        let emitted = mean_cosine(if cos == 1.0 { cos_w } else { within }, sin_u);
        let is_inside = !is_far && (distance2 <= radius2 || distance2 == 0.0);
        let is_even = cos <= -1.0;
        // A point in a medium receives light from everywhere.
        let in_medium = at.n.x == 0.0 && at.n.y == 0.0 && at.n.z == 0.0;
        let received = if is_far && is_even || in_medium { 1.0 } else { received };
        let emitted = if is_far || is_even { 1.0 } else { emitted };
        if is_inside { INSIDE * falloff } else { falloff * received * emitted }
    }
}

/// The bounds of up to `N` lights, field by field, whose importances are computed at once in the lanes of registers.
#[derive(Clone, Debug)]
pub(super) struct BoundsPack<const N: usize> {
    center: [[f32; N]; 3],
    radius2: [f32; N],
    axis: [[f32; N]; 3],
    cos: [f32; N],
    pub(super) power: [f32; N],
}

impl<const N: usize> BoundsPack<N> {
    /// Of 1 to `N` lights. The other lanes are lights without power.
    pub(super) fn new(lights: &[LightBounds]) -> Self {
        let lane = |i: usize| lights.get(i).copied().unwrap_or(LightBounds { power: 0.0, ..lights[0] });
        let lanes = std::array::from_fn(lane);
        let of = |field: fn(&LightBounds) -> f32| lanes.each_ref().map(field);
        Self {
            center: [of(|b| b.center.x), of(|b| b.center.y), of(|b| b.center.z)],
            radius2: of(|b| b.radius2),
            axis: [of(|b| b.axis.x), of(|b| b.axis.y), of(|b| b.axis.z)],
            cos: of(|b| b.cos),
            power: of(|b| b.power),
        }
    }

    /// The importance of each ([`LightBounds::importance`]).
    #[inline(always)]
    pub(super) fn importances(&self, at: &LightSampleContext) -> [f32; N] {
        let mut importances = [0.0; N];
        for i in 0..N {
            let lane = |rows: &[[f32; N]; 3]| Vec3::new(rows[0][i], rows[1][i], rows[2][i]);
            let bounds = LightBounds {
                center: lane(&self.center),
                radius2: self.radius2[i],
                axis: lane(&self.axis),
                cos: self.cos[i],
                power: self.power[i],
            };
            importances[i] = bounds.importance(*at);
        }
        importances
    }
}

/// The least squared distance that is distinguished, 2^−120: the quotient of a power, at most 1, stays finite. It knows
/// nothing of the scene, because one huge object in it would make the choice poor everywhere else.
const LEAST_DISTANCE2: f32 = 64.0 * f32::MIN_POSITIVE;

/// Share of the power that counts within the bounding sphere, where angles say nothing.
const INSIDE: f32 = 0.5;

/// The mean of the positive cosines over a sphere in a direction of cosine `cos` that fills a half angle of sine `sin_u`:
/// `cos` itself where all of it is above the horizon (exact for a sphere of even radiance), 0 where none is, and between
/// them the parabola that goes on smoothly at both ends.
#[inline(always)]
fn mean_cosine(cos: f32, sin_u: f32) -> f32 {
    // Tolerance, so that rounding hides no light that is just visible.
    const SLACK: f32 = 1e-6;
    let (above, u) = (cos + sin_u, sin_u + SLACK);
    if cos >= sin_u { cos + SLACK } else { (above + SLACK).max(0.0).powi(2) / (4.0 * u) }
}
