//! A subpath: a random walk from the camera or from a light, with the densities that bidirectional MIS weights need.
//!
//! Every bidirectional method is made of these. A subpath arrives at a vertex; the integrator uses it (connects it, stores it
//! as a photon); then the subpath scatters there, as [`Walk`] says, and goes on.

use glam::Vec3;

use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::stream::{FaultyValue, faults};

use super::Scene;
use super::accel::Ray;
use super::bsdf::{Bsdf, BsdfSample, Scattering};
use super::interaction::SurfaceInteraction;
use super::light::{Emission, EmissionOrigin};
use super::medium::MediumIndex;
use super::record::PathEvent;
use super::roulette::{self, Policy};
use super::sampler::VertexNumbers;
use super::subpath_mis::{CONNECTION_SAMPLES, SubpathMis};
use super::vertex::SurfaceVertex;
use super::walk::Walk;
use super::wavelength_mis::WavelengthMis;

/// One vertex of a subpath, its endpoint on the camera or the light excepted.
#[derive(Clone, Copy, Debug)]
pub struct SubpathVertex<B: Scattering = Bsdf> {
    /// The hit and its material; `surface.hit.wo` points back along the walk.
    pub surface: SurfaceVertex<B>,
    /// Product of the weights on the way here.
    pub throughput: SampledSpectrum,
    /// The wavelengths that would have chosen the way here.
    pub wavelength_mis: WavelengthMis,
    /// Number of segments on the way here, at least 1.
    pub depth: u32,
    /// Densities of the subpath, for MIS weights.
    pub mis: SubpathMis,
}

/// How a vertex scatters to a direction that another subpath brings.
#[derive(Clone, Copy, Debug)]
pub struct VertexScattering {
    /// f·|cos|, the cosine that of the direction towards the light in a camera subpath and of the direction towards the
    /// camera in a light subpath.
    pub value: SampledSpectrum,
    /// The wavelengths that would have chosen this direction.
    pub wavelength_mis: WavelengthMis,
    /// Density per steradian of going on in this direction.
    pub fwd_w: f32,
    /// Density per steradian of going back along the walk, coming from this direction.
    pub rev_w: f32,
    /// |cos| of the direction to the geometric normal; 1 in a medium.
    pub cos: f32,
    /// True if the direction goes through the surface.
    pub through: bool,
}

impl<B: Scattering> SubpathVertex<B> {
    /// Scattering between the way back and the world-space direction `d`; `FROM_LIGHT` tells which sort of walk this
    /// vertex belongs to. `None` where it is zero.
    #[inline]
    pub fn scatter_to<const FROM_LIGHT: bool>(&self, d: Vec3) -> Option<VertexScattering> {
        let SurfaceVertex { hit, frame, bsdf, wo, .. } = &self.surface;
        let local = frame.to_local(d);
        let through = local.z * wo.z < 0.0;
        if !hit.sides_agree(d, through) {
            return None;
        }
        let cos = self.surface.cosine(d);
        let (eye, light) = if FROM_LIGHT { (local, *wo) } else { (*wo, local) };
        let from_eye = bsdf.eval(eye, light);
        let pdf_from_light = bsdf.pdf_from_light(light, eye);
        let pdf_from_eye = from_eye.map_or(0.0, |(_, pdf)| pdf.0);
        let (fwd_w, rev_w) =
            if FROM_LIGHT { (pdf_from_light, pdf_from_eye) } else { (pdf_from_eye, pdf_from_light) };
        let mut value = from_eye?.0;
        if FROM_LIGHT {
            // |cos θₛ(l)| is in the value; the flux that arrives was measured with |cos θ(l)|.
            let cos_light = self.surface.cosine(hit.wo);
            value *= cos / cos_light;
        }
        let wavelength_mis = match bsdf.is_dispersive() {
            true => bsdf.dispersion(*wo, local).wavelength_mis,
            false => WavelengthMis::ALL,
        };
        (!value.is_black()).then_some(VertexScattering { value, wavelength_mis, fwd_w, rev_w, cos, through })
    }
}

/// A subpath between two vertices.
#[derive(Clone, Debug)]
pub struct Subpath<const FROM_LIGHT: bool> {
    /// Throughput, wavelengths and depth.
    pub walk: Walk<FROM_LIGHT>,
    /// When Russian roulette ends it.
    pub policy: Policy,
    /// The last vertex, as the densities of the next one depend on it.
    pub previous: PreviousVertex,
}

/// The last vertex, as far as the densities of the next one depend on it.
#[derive(Clone, Copy, Debug)]
pub struct PreviousVertex {
    /// Its position; `None` for a direction (parallel light or rays).
    from: Option<Vec3>,
    /// |cos| there.
    cos: f32,
    /// Density of the direction per steradian; of the environment's rays per unit of area of their disk.
    fwd_w: f32,
    /// c of the next vertex; 0 after a delta.
    pub link: f32,
    /// Density of the last vertex.
    fwd: f32,
    /// c of the last vertex.
    previous_link: f32,
    /// S up to the vertex before the last.
    tail: f64,
}

impl PreviousVertex {
    /// The densities of a next vertex that has the density `fwd` and takes densities per steradian to `back` times those per
    /// area at this one.
    #[inline]
    fn next(&self, fwd: f32, back: f32) -> SubpathMis {
        SubpathMis {
            fwd,
            fwd_w: self.fwd_w,
            back,
            link: [self.link; 2],
            previous_fwd: self.fwd,
            previous_link: self.previous_link,
            tail: self.tail,
        }
    }

    /// The densities of a next vertex that is infinitely far away: they are per steradian.
    pub fn infinite(&self) -> SubpathMis {
        self.next(self.fwd_w, self.cos)
    }
}

impl Subpath<false> {
    /// A subpath from the point `origin` of the camera's lens; `None` where all its rays are parallel. `pdf` is the density of its directions
    /// per steradian, or of parallel rays per unit of area across them. `splats` is the number of samples that connecting
    /// a light subpath to the camera counts as in weights.
    /// It begins in `medium`.
    pub fn from_camera(
        lambda: SampledWavelengths,
        origin: Option<Vec3>,
        pdf: f32,
        splats: f32,
        medium: MediumIndex,
    ) -> Self {
        // Nothing can choose the camera: its own sum is 0.
        let previous = PreviousVertex {
            from: origin,
            cos: 1.0,
            fwd_w: pdf,
            link: splats,
            fwd: 1.0,
            previous_link: 0.0,
            tail: 0.0,
        };
        Self::new(Walk::new(lambda, SampledSpectrum::ONE, 1.0, medium), previous)
    }
}

impl Scene {
    /// The subpath that begins with `emission` of the spectrum `emitted`; `None` as of [`Subpath::from_light`], and where the light comes
    /// infinitely far through a medium that takes all of it.
    #[inline]
    pub(super) fn light_subpath(
        &self,
        lambda: SampledWavelengths,
        emission: &Emission,
        emitted: SampledSpectrum,
    ) -> Option<Subpath<true>> {
        let Some(media) = self.media() else {
            return Subpath::from_light(lambda, emission, emitted, MediumIndex::VACUUM);
        };
        let medium = self.medium_of_light(emission.light, &emission.ray());
        let arriving = match emission.pdf.origin.is_far() {
            true => emitted * media.share_from_infinity(medium, &lambda),
            false => emitted,
        };
        Subpath::from_light(lambda, emission, arriving, medium)
    }
}

impl Subpath<true> {
    /// A subpath that begins with `emission` of the spectrum `emitted` in `medium`; `None` when that is black, or no number, which is a fault.
    pub fn from_light(
        lambda: SampledWavelengths,
        emission: &Emission,
        emitted: SampledSpectrum,
        medium: MediumIndex,
    ) -> Option<Self> {
        let pdf = emission.pdf;
        let throughput = emitted * emission.scale();
        let most = throughput.max_element();
        if !throughput.is_finite() {
            faults::raise(FaultyValue::LightPath, throughput.into(), None, Some(emission.light));
            return None;
        }
        if most <= 0.0 {
            return None;
        }
        let previous = PreviousVertex {
            from: (!pdf.origin.is_far()).then_some(emission.from.p),
            cos: pdf.cos,
            fwd_w: pdf.next,
            link: if pdf.origin == EmissionOrigin::Beam { 0.0 } else { 1.0 },
            fwd: pdf.vertex,
            previous_link: if pdf.origin.is_delta() { 0.0 } else { 1.0 },
            tail: 0.0,
        };
        Some(Self::new(Walk::new(lambda, throughput, 1.0 / most, medium), previous))
    }
}

impl<const FROM_LIGHT: bool> Subpath<FROM_LIGHT> {
    const POLICY: Policy = if FROM_LIGHT { roulette::FROM_LIGHT } else { roulette::FROM_CAMERA };

    fn new(walk: Walk<FROM_LIGHT>, previous: PreviousVertex) -> Self {
        Self { walk, policy: Self::POLICY, previous }
    }

    /// The vertex at `hit`.
    #[inline(always)]
    pub fn arrive<B: Scattering>(&mut self, scene: &Scene, hit: SurfaceInteraction) -> SubpathVertex<B> {
        self.walk.depth += 1;
        let previous = &self.previous;
        let surface = SurfaceVertex::new(scene, hit, &self.walk.lambda, self.walk.medium);
        let cos = surface.cosine(hit.wo);
        let (to_area, back) = match previous.from {
            Some(from) => {
                let inverse = 1.0 / from.distance_squared(hit.point.p);
                (cos * inverse, previous.cos * inverse)
            }
            None => (cos, 1.0),
        };
        SubpathVertex {
            mis: previous.next(previous.fwd_w * to_area, back),
            surface,
            throughput: self.walk.throughput,
            wavelength_mis: self.walk.wavelength_mis,
            depth: self.walk.depth,
        }
    }

    /// Scatters at `vertex`, the last one, and returns the next ray; `None` when the subpath ends there. Russian roulette may end it once
    /// it has `rr_depth` segments.
    #[inline(always)]
    pub fn scatter<B: Scattering>(
        &mut self,
        vertex: &SubpathVertex<B>,
        u: &VertexNumbers,
        rr_depth: u32,
    ) -> Option<Ray> {
        let s = Walk::<FROM_LIGHT>::sample(&vertex.surface, u)?;
        self.scatter_into(vertex, &s, u, rr_depth)
    }

    /// As [`Subpath::scatter`], into the direction of `s`.
    #[inline(always)]
    pub fn scatter_into<B: Scattering>(
        &mut self,
        vertex: &SubpathVertex<B>,
        s: &BsdfSample,
        u: &VertexNumbers,
        rr_depth: u32,
    ) -> Option<Ray> {
        if s.hero_only {
            self.walk.keep_hero();
        }
        self.follow(vertex, s, u.roulette, rr_depth)
    }

    /// As [`Subpath::scatter`], but at a dispersive delta this subpath ends and continues as four single-wavelength subpaths with the same
    /// random numbers, which `each` takes.
    #[inline]
    pub fn scatter_each<B: Scattering>(
        &mut self,
        vertex: &SubpathVertex<B>,
        u: &VertexNumbers,
        rr_depth: u32,
        each: impl FnMut(Self, Ray),
    ) -> Option<Ray> {
        let s = Walk::<FROM_LIGHT>::sample(&vertex.surface, u)?;
        if s.hero_only {
            self.split(vertex, s.weight, u.roulette, rr_depth, each);
            return None;
        }
        self.follow(vertex, &s, u.roulette, rr_depth)
    }

    /// The subpaths of the four wavelengths after the dispersive delta of this weight.
    #[cold]
    fn split<B: Scattering>(
        &self,
        vertex: &SubpathVertex<B>,
        weight: SampledSpectrum,
        u: f32,
        rr_depth: u32,
        mut each: impl FnMut(Self, Ray),
    ) {
        for (walk, s) in self.walk.split_wavelengths(&vertex.surface, weight) {
            let mut own = Self { walk, ..*self };
            if let Some(ray) = own.follow(vertex, &s, u, rr_depth) {
                each(own, ray);
            }
        }
    }

    /// Scatters into the direction of `s`, keeps the densities for the next vertex, and plays Russian roulette.
    #[inline(always)]
    fn follow<B: Scattering>(
        &mut self,
        vertex: &SubpathVertex<B>,
        s: &BsdfSample,
        u: f32,
        rr_depth: u32,
    ) -> Option<Ray> {
        let SubpathVertex { surface, mis, .. } = vertex;
        let SurfaceVertex { hit, bsdf, wo, .. } = surface;
        let wi = self.walk.scatter(surface, s)?;
        let (fwd_w, rev_w) = match s.delta {
            true => (1.0, 1.0),
            false if FROM_LIGHT => (s.pdf.0, bsdf.eval(s.wi, *wo).map_or(0.0, |(_, pdf)| pdf.0)),
            false => (s.pdf.0, bsdf.pdf_from_light(s.wi, *wo)),
        };
        self.previous = PreviousVertex {
            from: Some(hit.point.p),
            cos: surface.cosine(wi),
            fwd_w,
            link: if s.delta { 0.0 } else { CONNECTION_SAMPLES },
            fwd: mis.fwd,
            previous_link: if s.delta { 0.0 } else { mis.link[usize::from(s.transmitted)] },
            tail: mis.previous_sum(rev_w),
        };
        let Policy { latest, survival } = self.policy;
        let probability = survival * self.walk.throughput.max_element() * self.walk.relative;
        self.walk.survive(probability, rr_depth.min(latest), u)?;
        B::record(|| PathEvent::Throughput(self.walk.throughput));
        Some(hit.spawn(wi))
    }
}
