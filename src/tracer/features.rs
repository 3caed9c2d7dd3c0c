//! Feature layers for the noise filter: properties of the first surface on a camera ray, which tell whether neighbouring pixels show the same one.

use glam::Vec3;

use super::Scene;
use super::accel::Ray;
use super::bsdf::{Bsdf, ScatteringModel};
use super::medium::MediumIndex;
use super::vertex::SurfaceVertex;
use crate::spectrum::SampledWavelengths;

/// Mirrors and panes that are followed, at most.
const MOST_DELTAS: u32 = 8;

/// The first surface along a ray that is neither mirror nor clear glass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Features {
    /// Reflectance at three wavelengths, times that of the mirrors and the glass on the way.
    pub albedo: Vec3,
    /// Unit shading normal.
    pub normal: Vec3,
    /// Length of the way to it, in units of the space that the scene is traced in.
    pub distance: f32,
    /// A mirror or clear glass was on the way.
    pub specular: bool,
    /// It emits light to there.
    pub emits: bool,
}

/// Follows `ray`, whose direction has unit length, through mirrors and glass to the first other surface; all zero where there is none. Random
/// decisions are made as by numbers in the middle of their range, so that equal surfaces have equal features.
pub fn features(scene: &Scene, mut ray: Ray, lambda: &SampledWavelengths) -> Features {
    let (mut throughput, mut distance) = (Vec3::ONE, 0.0);
    let mut lambda = *lambda;
    for deltas in 0..MOST_DELTAS {
        let specular = deltas > 0;
        let Some(hit) = scene.closest(&ray) else { return Features { specular, ..Features::default() } };
        distance += hit.point.p.distance(ray.origin);
        let vertex = SurfaceVertex::<Bsdf>::new(scene, hit, &lambda, MediumIndex::VACUUM);
        let sample = vertex.bsdf.sample(vertex.wo, [0.5; 2], 0.5);
        let sample = sample.filter(|s| s.weight.is_finite());
        let weight = sample.map_or(Vec3::ZERO, |s| (s.weight.0 * s.eta2).truncate());
        throughput *= weight.clamp(Vec3::ZERO, Vec3::ONE);
        let Some(sample) = sample.filter(|s| s.delta) else {
            let emits = vertex.hit.emitter().is_some();
            return Features { albedo: throughput, normal: vertex.hit.n, distance, specular, emits };
        };
        if sample.hero_only {
            lambda.terminate_companions();
        }
        ray = vertex.hit.spawn(vertex.frame.to_world(sample.wi));
    }
    Features { distance, specular: true, ..Features::default() }
}
