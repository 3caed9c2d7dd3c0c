//! Spheres around what casts caustics, at which light subpaths are aimed.
//!
//! A mirror or a lens far from a small light is met by few of its rays, and a caustic is made of those alone. Jensen's projection maps
//! (*Global Illumination using Photon Maps*, EGWR 1996) send photons to where such things are seen from the light. Here a share of the rays, [`AIMED`], goes
//! to one of the spheres, uniformly, and the others go as the light sends them. So the density of a ray is a mixture that is known for
//! any ray, MIS weights stay exact, and nothing is learned.

use std::sync::Arc;

use glam::Vec3;

use crate::math::frame::Frame;
use crate::math::warp;
use crate::tracer::bounding_sphere::BoundingSphere;
use crate::tracer::shape::SurfacePoint;

use super::emission::infinite_ray;

/// Share of the rays that are aimed, where there is something to aim at. relMSE at equal time of bidirectional tracing (96², 32 paths a pixel):
///
/// | share | 0 | .15 | .3 |
/// |---|---|---|---|
/// | caustic | .0353 | .0150 | .0122 |
/// | cornell_spheres | .0155 | .0144 | .0142 |
/// | veach_door | .218 | .218 | .203 |
/// | veach-bidir | .0164 | .0155 | .0151 |
/// | staircase2 | .0975 | .0962 | .0961 |
/// | prism | .0160 | .0161 | .0175 |
/// | rough | .0124 | .0125 | .0128 |
pub(super) const AIMED: f32 = 0.25;

/// Most spheres: more objects share some.
const MOST: usize = 16;

/// Squared sine of the greatest half angle under which a sphere is aimed at. Larger ones are met without.
const WIDEST: f32 = 0.75;

/// Spheres around objects of mirror and glass.
#[derive(Clone, Debug, Default)]
pub struct CausticCasters {
    spheres: Arc<[BoundingSphere]>,
}

impl CausticCasters {
    /// The casters in these spheres. Where they are many, those of neighbours become one.
    pub fn new(spheres: Vec<BoundingSphere>) -> Self {
        Self { spheres: BoundingSphere::few(spheres, MOST).into() }
    }

    /// The spheres, in rendering space.
    #[inline]
    pub fn spheres(&self) -> &[BoundingSphere] {
        &self.spheres
    }

    /// The cones, as axes and 1 − cos of half angles, under which spheres are seen from `p`, but for those that are too wide.
    #[inline]
    fn cones(&self, p: Vec3) -> impl Iterator<Item = (Vec3, f32)> {
        self.spheres.iter().filter_map(move |sphere| {
            let offset = sphere.center - p;
            let d2 = offset.length_squared();
            let sin2 = sphere.radius * sphere.radius / d2;
            // False for NaN. Written so that 1 − cos keeps its digits where the cone is narrow.
            (sin2 < WIDEST).then(|| (offset / d2.sqrt(), sin2 / (1.0 + (1.0 - sin2).sqrt())))
        })
    }

    /// A direction from `p` to a sphere that `choice` in [0, 1) chooses, uniform by solid angle; `None` where there is none.
    pub(super) fn direction(&self, p: Vec3, choice: f32, u: [f32; 2]) -> Option<Vec3> {
        let count = self.cones(p).count();
        let (axis, one_minus_cos) = self.cones(p).nth(chosen(choice, count))?;
        Some(Frame::new(axis).to_world(warp::cone(u, one_minus_cos)).normalize())
    }

    /// The density per steradian with which [`Self::direction`] finds `d`; `None` where it finds nothing.
    #[inline]
    pub(super) fn direction_pdf(&self, p: Vec3, d: Vec3) -> Option<f32> {
        let (mut count, mut sum) = (0.0, 0.0);
        for (axis, one_minus_cos) in self.cones(p) {
            count += 1.0;
            // Half the squared distance of two unit vectors is 1 − cos of their angle.
            if 0.5 * (d - axis).length_squared() <= one_minus_cos {
                sum += warp::cone_pdf(one_minus_cos);
            }
        }
        (count > 0.0).then(|| sum / count)
    }

    /// The ray of direction `d` that comes from infinity through a sphere that `choice` in [0, 1) chooses, uniform by area.
    pub(super) fn parallel_ray(
        &self,
        d: Vec3,
        choice: f32,
        u: [f32; 2],
        scene: BoundingSphere,
    ) -> SurfacePoint {
        let sphere = self.spheres[chosen(choice, self.spheres.len())];
        let (through, _) = infinite_ray(d, u, sphere);
        // As far before the scene as any other ray from infinity.
        let before = (through.p - scene.center).dot(d) + scene.radius;
        SurfacePoint { p: through.p - d * before, ..through }
    }

    /// The density per unit of area across it with which [`Self::parallel_ray`] finds the ray of direction `d` through the point `p`.
    #[inline]
    pub(super) fn parallel_pdf(&self, p: Vec3, d: Vec3) -> f32 {
        let pdf = |sphere: &BoundingSphere| {
            let (offset, r2) = (sphere.center - p, sphere.radius * sphere.radius);
            let is_met = (offset - d * offset.dot(d)).length_squared() <= r2;
            if is_met { std::f32::consts::FRAC_1_PI / r2 } else { 0.0 }
        };
        self.spheres.iter().map(pdf).sum::<f32>() / self.spheres.len() as f32
    }
}

/// One of `count` by a number in [0, 1).
#[inline]
fn chosen(choice: f32, count: usize) -> usize {
    ((choice * count as f32) as usize).min(count.saturating_sub(1))
}
