//! A camera path of photon mapping: lights are hit and sampled, photons gathered.

use glam::{Vec3, Vec4};

use crate::color::Xyz;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::accel::Ray;
use crate::tracer::bsdf::{Bsdf, BsdfSample, Material, ScatteringModel};
use crate::tracer::integrator::direct_lighting::{PathState, Splitting};
use crate::tracer::interaction::{SurfaceInteraction, SurfaceVertex};
use crate::tracer::photon_map::{Lookup, PhotonLayer, Snapshot};
use crate::tracer::sampler::VertexNumbers;
use crate::tracer::{Sampler, Scene};

use super::{PhotonScratch, PhotonTracer};

/// A path whose wavelength MIS weight exceeds this goes on with the hero alone: 1 is no dispersion, 4 is complete.
const DISPERSED: f32 = 2.0;

/// A lobe number that chooses whatever comes last: transmission.
const LAST_LOBE: f32 = 1.0 - f32::EPSILON / 2.0;

/// What the path has scattered from, as far as it decides who finds a light that is hit now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PathClass {
    /// Mirrored only: lights that are hit and lights that are sampled both count.
    Mirrored,
    /// Spread last: likewise.
    Spread,
    /// Spread, then mirrored: a light found from here is a caustic, which the photons show.
    Caustic,
}

/// A camera path on its way.
pub(super) struct CameraPath<'a> {
    pub tracer: &'a PhotonTracer,
    pub snapshot: &'a Snapshot,
    pub lookup: Lookup,
    pub scratch: &'a mut PhotonScratch,
    pub state: PathState,
    /// What photons contributed, and what was found before the companion wavelengths were dropped.
    pub xyz: Xyz,
    class: PathClass,
    /// Photons stand for all that follows, but for a light that the next ray hits.
    gathered: bool,
}

impl<'a> CameraPath<'a> {
    /// A path that sees these photons; `wavelength` in [0, 1) chooses its wavelengths.
    pub fn new(
        tracer: &'a PhotonTracer,
        snapshot: &'a Snapshot,
        lookup: Lookup,
        scratch: &'a mut PhotonScratch,
        wavelength: f32,
    ) -> Self {
        scratch.scatterings.clear();
        let state = PathState::new(tracer.context.wavelengths(wavelength), Splitting::Never);
        let (xyz, class) = (Xyz::BLACK, PathClass::Mirrored);
        Self { tracer, snapshot, lookup, scratch, state, xyz, class, gathered: false }
    }

    /// Follows the path along `ray` to its end and returns what it found.
    pub fn trace(mut self, mut ray: Ray, sampler: &Sampler) -> Xyz {
        let context = &self.tracer.context;
        while let Some(hit) = self.state.arrive(context, &ray, self.class != PathClass::Caustic) {
            if self.gathered {
                break;
            }
            // The last ray was too short for the photons at its end to stand for what it saw.
            let (_, radius, _) = self.reach(PhotonLayer::Global);
            let near = ray.origin.distance_squared(hit.point.p) < radius * radius;
            match self.shade(hit, near, &sampler.vertex(self.state.depth)) {
                Some(next) => ray = next,
                None => break,
            }
        }
        self.xyz + self.state.lambda.to_xyz(self.state.radiance)
    }

    /// Samples a light, gathers photons (global ones unless `near`) and chooses the ray to go on with.
    fn shade(&mut self, hit: SurfaceInteraction, near: bool, u: &VertexNumbers) -> Option<Ray> {
        let scene = &self.tracer.context.scene;
        let vertex = SurfaceVertex::<Bsdf>::new(scene, hit, &self.state.lambda);
        let diffuse = vertex.bsdf.has_diffuse_part();
        if diffuse || self.class == PathClass::Mirrored && !vertex.bsdf.is_delta() {
            self.state.add_direct(scene, &vertex, u);
        }
        if diffuse {
            self.gather(&vertex, PhotonLayer::Caustic);
            if self.class != PathClass::Mirrored && !near {
                self.gather(&vertex, PhotonLayer::Global);
                self.gathered = true;
            }
        }
        self.scatter(&vertex, diffuse, u)
    }

    fn scatter(&mut self, vertex: &SurfaceVertex, diffuse: bool, u: &VertexNumbers) -> Option<Ray> {
        let s = vertex.bsdf.sample(vertex.wo, u.bsdf, u.lobe)?;
        let wi = vertex.frame.to_world(s.wi);
        if !vertex.hit.sides_agree(wi, s.transmitted) {
            return None;
        }
        self.state.scatter(vertex, &s);
        // Where a photon's wavelengths would hardly have come this way, only the hero does. All heroes of a path decide alike.
        let dispersed =
            s.transmitted && vertex.bsdf.parts_colors() && self.state.wavelength_mis.weight() > DISPERSED;
        if s.hero_only || dispersed {
            self.xyz += self.state.lambda.to_xyz(self.state.radiance);
            self.state.drop_companions();
        }
        let spread = diffuse && !s.delta;
        self.class = match self.class {
            _ if spread => PathClass::Spread,
            PathClass::Mirrored => PathClass::Mirrored,
            PathClass::Spread | PathClass::Caustic => PathClass::Caustic,
        };
        // The coat's mirror was not in what the photons contributed.
        self.gathered &= spread;
        let factor = self.state.roulette(self.tracer.context.rr_depth, u.roulette)?;
        self.scratch.scatterings.push(RecordedScattering::new(vertex, &s, factor));
        Some(vertex.hit.spawn(wi))
    }
}

/// One scattering of a camera path, to be evaluated again at the wavelengths of a photon.
#[derive(Clone, Copy, Debug)]
pub(super) struct RecordedScattering {
    hit: SurfaceInteraction,
    wo: Vec3,
    wi: Vec3,
    delta: bool,
    transmitted: bool,
    /// Roulette's factor over the density with which the direction, or the delta, was chosen.
    scale: f32,
}

impl RecordedScattering {
    /// The scattering `sample` at `vertex`, which roulette has let go on with this factor.
    fn new(vertex: &SurfaceVertex, sample: &BsdfSample, roulette: f32) -> Self {
        let BsdfSample { wi, pdf, delta, transmitted, .. } = *sample;
        let scale = 1.0 / pdf.0 * roulette;
        Self { hit: vertex.hit, wo: vertex.wo, wi, delta, transmitted, scale }
    }

    /// The weight of this scattering at other wavelengths.
    #[inline]
    pub fn weight(&self, scene: &Scene, lambda: &SampledWavelengths) -> SampledSpectrum {
        let (material, _) = scene.material(&self.hit);
        let bsdf = material.bsdf(lambda);
        let value = if self.delta {
            // The same lobe; where these wavelengths never choose it, its value is zero.
            let lobe = if self.transmitted { LAST_LOBE } else { 0.0 };
            match bsdf.sample(self.wo, [0.5; 2], lobe) {
                Some(s) if s.delta && s.transmitted == self.transmitted => s.weight * s.pdf.0,
                _ => SampledSpectrum::ZERO,
            }
        } else {
            self.value(material, &bsdf, lambda)
        };
        value * self.scale
    }

    /// f·|cos| per lane. Where colours part, values hold a factor of the hero's, so each wavelength is evaluated alone.
    #[inline]
    fn value(&self, material: &Material, bsdf: &Bsdf, lambda: &SampledWavelengths) -> SampledSpectrum {
        let at = |bsdf: &Bsdf| bsdf.eval(self.wo, self.wi).map_or(SampledSpectrum::ZERO, |(f, _)| f);
        if !bsdf.parts_colors() {
            return at(bsdf);
        }
        let lane = |i: usize| at(&material.bsdf(&lambda.alone(i))).0[i];
        SampledSpectrum(Vec4::from_array([0, 1, 2, 3].map(lane)))
    }
}
