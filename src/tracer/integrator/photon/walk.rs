//! One path from the camera: lights met and sampled, photons gathered.

use glam::{Vec3, Vec4};

use crate::color::Xyz;
use crate::math::frame::Frame;
use crate::math::pdf::PdfW;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::accel::Ray;
use crate::tracer::bsdf::Bsdf;
use crate::tracer::interaction::SurfaceInteraction;
use crate::tracer::light::{LightSample, LitPoint};
use crate::tracer::material::Material;
use crate::tracer::photon_map::{Lookup, PhotonLayer, Snapshot};
use crate::tracer::sampler::VertexNumbers;
use crate::tracer::wavelength_mis::WavelengthMis;
use crate::tracer::{Sampler, mis, roulette};

use super::step::Step;
use super::{PhotonScratch, PhotonTracer, spreads};

/// What a path counts for from which its wavelengths have parted: 1 is not at all, 4 is for good.
const PARTED: f32 = 2.0;

/// What has happened to the light between the eye and here; who finds a light that is met now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Mirrored only: met and sampled lights both count.
    Mirrored,
    /// Spread last: likewise.
    Spread,
    /// Spread, then mirrored: a light found from here is a caustic, which the photons show.
    Caustic,
}

/// A path on its way.
pub(super) struct Path<'a> {
    pub tracer: &'a PhotonTracer,
    pub snapshot: &'a Snapshot,
    pub lookup: Lookup,
    pub scratch: &'a mut PhotonScratch,
    pub lambda: SampledWavelengths,
    /// Product of the weights so far.
    pub throughput: SampledSpectrum,
    /// Radiance found so far at the present wavelengths.
    pub radiance: SampledSpectrum,
    /// What photons gave, and what was found before the companions were dropped.
    pub banked: Xyz,
    /// The wavelengths that would have chosen the same way, while more than the hero is carried.
    wavelength_mis: WavelengthMis,
    /// Segments so far.
    pub depth: u32,
    /// Undoes the radiance scaling of refraction for roulette.
    eta2: f32,
    /// How the last direction was chosen; `None` by a delta.
    last: Option<(LitPoint, PdfW)>,
    stage: Stage,
    /// Photons stand for all that follows, but for a light that the next ray meets.
    gathered: bool,
}

/// A hit with its material at the wavelengths of the path.
pub(super) struct Vertex<'a> {
    pub hit: &'a SurfaceInteraction,
    pub material: &'a Material,
    /// The frame `wo` and the material are in.
    pub frame: Frame,
    pub bsdf: Bsdf,
    pub wo: Vec3,
}

impl Vertex<'_> {
    #[inline]
    fn lit_point(&self) -> LitPoint {
        LitPoint::of(self.hit.point.p, &self.frame, (&self.bsdf, self.wo))
    }
}

impl<'a> Path<'a> {
    /// A path that sees these photons; `wavelength` in [0, 1) chooses its wavelengths.
    pub fn new(
        tracer: &'a PhotonTracer,
        (snapshot, lookup): (&'a Snapshot, Lookup),
        scratch: &'a mut PhotonScratch,
        wavelength: f32,
    ) -> Self {
        scratch.steps.clear();
        Self {
            tracer,
            snapshot,
            lookup,
            scratch,
            lambda: tracer.context.wavelengths(wavelength),
            throughput: SampledSpectrum::ONE,
            radiance: SampledSpectrum::ZERO,
            banked: Xyz::BLACK,
            wavelength_mis: WavelengthMis::ALL,
            depth: 0,
            eta2: 1.0,
            last: None,
            stage: Stage::Mirrored,
            gathered: false,
        }
    }

    /// All radiance found.
    pub fn xyz(&self) -> Xyz {
        self.banked + self.lambda.to_xyz(self.radiance)
    }

    /// Follows the path from its first ray to its end.
    pub fn walk(&mut self, mut ray: Ray, sampler: &Sampler) {
        let context = &self.tracer.context;
        let (scene, longest) = (&context.scene, context.longest());
        while self.depth < longest {
            let hidden = self.depth == 0 && context.hide_emitters;
            let hit = if hidden { scene.closest_unlit(ray) } else { scene.closest(&ray) };
            let Some(hit) = hit else {
                if !hidden && let Some(light) = scene.lights.environment() {
                    self.meet(light, ray.direction, |at| scene.lights.pdf(light, at, (ray.direction, None)));
                }
                return;
            };
            if let Some(light) = hit.light
                && hit.wo.dot(hit.point.ng) > 0.0
            {
                let to = (ray.direction, Some(&hit.point));
                self.meet(light, ray.direction, |at| scene.lights.pdf(light, at, to));
            }
            self.depth += 1;
            if self.gathered || self.depth == longest {
                return;
            }
            let (_, radius, _) = self.reach(PhotonLayer::Global);
            let near = ray.origin.distance_squared(hit.point.p) < radius * radius;
            match self.arrive(&hit, near, &sampler.vertex(self.depth - 1)) {
                Some(next) => ray = next,
                None => return,
            }
        }
    }

    /// Samples a light, gathers photons and chooses the ray to go on with. `near`: the last ray was too short for the
    /// photons at its end to stand for what it saw.
    fn arrive(&mut self, hit: &SurfaceInteraction, near: bool, u: &VertexNumbers) -> Option<Ray> {
        let (material, frame) = self.tracer.context.scene.material(hit);
        let bsdf = material.bsdf(&self.lambda);
        let vertex = Vertex { hit, material, frame, bsdf, wo: frame.to_local(hit.wo) };
        let spreads = spreads(&bsdf);
        if spreads || self.stage == Stage::Mirrored && !bsdf.is_delta() {
            self.direct(&vertex, u);
        }
        if spreads {
            self.gather(&vertex, PhotonLayer::Caustic);
            if self.stage != Stage::Mirrored && !near {
                self.gather(&vertex, PhotonLayer::Global);
                self.gathered = true;
            }
        }
        self.scatter(&vertex, spreads, u)
    }

    fn scatter(&mut self, vertex: &Vertex, spreads: bool, u: &VertexNumbers) -> Option<Ray> {
        let s = vertex.bsdf.sample(vertex.wo, u.bsdf, u.lobe)?;
        let wi = vertex.frame.to_world(s.wi);
        if !vertex.hit.sides_agree(wi, s.transmitted) {
            return None;
        }
        self.throughput *= s.weight;
        self.eta2 *= s.eta2;
        self.last = (!s.delta).then(|| (vertex.lit_point(), s.pdf));
        if s.hero_only {
            self.drop_companions();
        } else if s.transmitted && vertex.bsdf.parts_colors() {
            self.wavelength_mis = self.wavelength_mis.and(vertex.bsdf.part(vertex.wo, s.wi).wavelength_mis);
            // Where a photon's wavelengths would hardly have come this way, only the hero does. All heroes of a path decide alike.
            if self.wavelength_mis.weight() > PARTED {
                self.drop_companions();
            }
        }
        let spread = spreads && !s.delta;
        self.stage = match self.stage {
            _ if spread => Stage::Spread,
            Stage::Mirrored => Stage::Mirrored,
            Stage::Spread | Stage::Caustic => Stage::Caustic,
        };
        // The coat's mirror was not in what the photons gave.
        self.gathered &= spread;
        let armed = self.depth >= self.tracer.context.rr_depth.min(roulette::LATEST);
        let factor = roulette::survivor(self.throughput.max_element() * self.eta2, armed, u.roulette)?;
        self.throughput *= factor;
        let mut step = Step::new(vertex.hit, vertex.wo, &s);
        step.boost(factor);
        self.scratch.steps.push(step);
        Some(vertex.hit.spawn(wi))
    }

    /// Light that arrives straight from a sampled light.
    fn direct(&mut self, vertex: &Vertex, u: &VertexNumbers) {
        let context = &self.tracer.context;
        let scene = &context.scene;
        if self.depth + 1 > context.longest() {
            return;
        }
        let numbers = (u.light_choice, u.light);
        let found = scene
            .lights
            .sample_by(vertex.lit_point(), numbers, |light, sample| self.unshadowed(vertex, (light, sample)));
        if let Some((light, sample, value)) = found
            && scene.visible(vertex.hit, light, &sample)
        {
            self.radiance += value;
        }
    }

    /// What a sample of a light adds if nothing shadows it; `None` for nothing.
    fn unshadowed(&self, vertex: &Vertex, (light, sample): (u32, &LightSample)) -> Option<SampledSpectrum> {
        let wi = vertex.frame.to_local(sample.wi);
        let (f, pdf) = vertex.bsdf.eval(vertex.wo, wi)?;
        if !vertex.hit.sides_agree(sample.wi, vertex.wo.z * wi.z < 0.0) {
            return None;
        }
        let weight = if sample.delta { 1.0 } else { mis::power(sample.pdf, pdf) };
        let emission = self.tracer.context.scene.lights.spectrum(light, sample.wi, &self.lambda);
        let counts = self.counts(vertex.bsdf.part(vertex.wo, wi).wavelength_mis);
        let value = self.throughput * f * emission * (counts * sample.scale * weight / sample.pdf.0);
        (!value.is_black()).then_some(value)
    }

    /// Adds the emission of a light met by chance along `wi`; `pdf` is its density for light sampling from a lit point.
    fn meet(&mut self, light: u32, wi: Vec3, pdf: impl FnOnce(LitPoint) -> PdfW) {
        if self.stage == Stage::Caustic {
            return;
        }
        let weight = self.last.map_or(1.0, |(at, chosen)| mis::power(chosen, pdf(at)));
        let emission = self.tracer.context.scene.lights.spectrum(light, wi, &self.lambda);
        self.radiance += self.throughput * emission * (weight * self.counts(WavelengthMis::ALL));
    }

    /// What the path counts for, with one more refraction; four times the hero alone is a matter of its wavelengths.
    #[inline]
    pub fn counts(&self, next: WavelengthMis) -> f32 {
        let wavelength_mis = self.wavelength_mis.and(next);
        if self.lambda.is_hero_only() {
            0.25 * wavelength_mis.and(WavelengthMis::ALONE).weight()
        } else {
            wavelength_mis.weight()
        }
    }

    /// From here on only the hero wavelength is right. What was found so far was right for all and stays so.
    #[cold]
    fn drop_companions(&mut self) {
        self.banked += self.lambda.to_xyz(self.radiance);
        self.radiance = SampledSpectrum::ZERO;
        self.lambda.terminate_companions();
        self.throughput = SampledSpectrum(self.throughput.0 * Vec4::X);
    }
}
