//! Feature layers for the noise filter: properties of the first surface on a camera ray, which tell whether neighbouring pixels show the same one.
//!
//! Where media scatter light before that surface, features are means over both, weighted by the shares in which they are seen when equal light
//! comes from everywhere. Nothing of that is left to chance, so that it adds no noise.

use glam::Vec3;

use super::Scene;
use super::accel::Ray;
use super::bsdf::{Bsdf, ScatteringModel};
use super::interaction::SurfaceInteraction;
use super::medium::{MarchSteps, MediumIndex};
use super::opacity::meets;
use super::vertex::SurfaceVertex;
use crate::spectrum::SampledWavelengths;

/// Mirrors and panes that are followed, at most.
const MOST_DELTAS: u32 = 8;

/// A surface of which at least this share is seen through media moves with the camera as if there were none.
const CLEAR: f32 = 0.95;

/// Beyond a smaller share of what is infinitely far, the medium before it is what moves.
const CLEAR_SKY: f32 = 0.5;

/// From this share on a light behind media is brighter than they are.
const LIGHT_SHARE: f32 = 0.01;

/// The first surface along a ray that is neither mirror nor clear glass, and the media before it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Features {
    /// Reflectance at three wavelengths, times that of the mirrors and the glass on the way. In media, times their transmittance, and added to the
    /// share of light that they scatter.
    pub albedo: Vec3,
    /// Unit shading normal, times the share in which the surface is seen.
    pub normal: Vec3,
    /// Length of the way to it, in units of the space that the scene is traced in; in media, mean of the ways to all that scatters. 0 for
    /// what is infinitely far.
    pub distance: f32,
    /// What is seen does not move as this surface does: a mirror or clear glass was on the way, or media are much of what is seen.
    pub is_detached: bool,
    /// It emits light to there.
    pub emits: bool,
}

/// Follows `ray`, whose direction has unit length and which begins in `medium`, through mirrors and glass to the first other surface; all zero
/// where there is nothing. Random decisions are made as by numbers in the middle of their range, so that equal surfaces have equal features.
pub fn features(scene: &Scene, mut ray: Ray, medium: MediumIndex, lambda: &SampledWavelengths) -> Features {
    let (mut throughput, mut distance) = (Vec3::ONE, 0.0);
    let mut fog = scene.media().map(|_| Fog::new(medium, *lambda));
    let mut lambda = *lambda;
    for deltas in 0..MOST_DELTAS {
        let is_detached = deltas > 0;
        let origin = ray.origin;
        let hit = match &mut fog {
            None => scene.closest(&ray),
            Some(fog) => fog.look(scene, &mut ray, throughput, distance),
        };
        let Some(hit) = hit else {
            return Features { is_detached, ..Features::default() }.seen_through(fog);
        };
        distance += hit.point.p.distance(origin);
        let vertex = SurfaceVertex::<Bsdf>::new(scene, hit, &lambda, MediumIndex::VACUUM);
        let sample = vertex.bsdf.sample(vertex.wo, [0.5; 2], 0.5);
        let sample = sample.filter(|s| s.weight.is_finite());
        let weight = sample.map_or(Vec3::ZERO, |s| (s.weight.0 * s.eta2).truncate());
        throughput *= weight.clamp(Vec3::ZERO, Vec3::ONE);
        let Some(sample) = sample.filter(|s| s.delta) else {
            let emits = vertex.hit.emitter().is_some();
            let (albedo, normal) = (throughput, vertex.hit.n);
            return Features { albedo, normal, distance, is_detached, emits }.seen_through(fog);
        };
        if sample.hero_only {
            lambda.terminate_companions();
        }
        let d = vertex.frame.to_world(sample.wi);
        if let Some(fog) = &mut fog {
            fog.medium = scene.medium_towards(&vertex.hit, d, fog.medium);
        }
        ray = vertex.hit.spawn(d);
    }
    Features { distance, is_detached: true, ..Features::default() }.seen_through(fog)
}

impl Features {
    /// These features of a surface, seen through `fog` if there is any.
    fn seen_through(self, fog: Option<Fog>) -> Self {
        let Some(Fog { transmittance, behind, scattered, moment, .. }) = fog else { return self };
        let (behind, all) = (mean(behind), mean(behind + scattered));
        // Where all is dark, it is as if there were no media.
        let (share, distance) = match all > 0.0 {
            true => (behind / all, (moment + behind * self.distance) / all),
            false => (1.0, self.distance),
        };
        let clear = if self.distance > 0.0 { CLEAR } else { CLEAR_SKY };
        Self {
            albedo: self.albedo * transmittance + scattered,
            normal: self.normal * share,
            distance,
            is_detached: self.is_detached || share < clear,
            emits: self.emits && share >= LIGHT_SHARE,
        }
    }
}

/// What media on the way do.
struct Fog {
    lambda: SampledWavelengths,
    /// The medium that the ray is in.
    medium: MediumIndex,
    /// Their transmittance.
    transmittance: Vec3,
    /// The share of light that comes from behind the media of the last segment, times the reflectance of mirrors and glass before.
    behind: Vec3,
    /// The share of light that they scatter, times the same.
    scattered: Vec3,
    /// The mean of that over wavelengths, times the length of the way to where it is scattered.
    moment: f32,
}

impl Fog {
    fn new(medium: MediumIndex, lambda: SampledWavelengths) -> Self {
        let (transmittance, behind, scattered) = (Vec3::ONE, Vec3::ONE, Vec3::ZERO);
        Self { lambda, medium, transmittance, behind, scattered, moment: 0.0 }
    }

    /// The first surface that `ray` meets, to whose beginning light came with `throughput` over a way of this length.
    fn look(
        &mut self,
        scene: &Scene,
        ray: &mut Ray,
        throughput: Vec3,
        length: f32,
    ) -> Option<SurfaceInteraction> {
        let (hit, line) = scene.look(ray, &mut self.medium, meets);
        let seen = line.media(&self.lambda, MarchSteps::Boxes);
        let [transmittance, scattered, moment] =
            [seen.transmittance, seen.scattered, seen.moment].map(|value| value.as_vec4().truncate());
        let reaching = throughput * self.transmittance;
        self.scattered += reaching * scattered;
        self.moment += mean(reaching * (moment + length * scattered));
        self.transmittance *= transmittance;
        self.behind = reaching * transmittance;
        hit
    }
}

/// Mean over three wavelengths.
fn mean(value: Vec3) -> f32 {
    value.element_sum() / 3.0
}
