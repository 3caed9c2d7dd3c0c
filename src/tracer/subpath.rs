//! The one walk: a subpath grows from the camera or from a light, vertex by vertex.
//!
//! Every bidirectional method is made of these. A walk arrives at a vertex, whoever drives it does with it what the method
//! is about (connects, stores, gathers), and the walk scatters there and goes on. What the two directions have in common
//! is here once; they differ only in what a scattering does to the throughput:
//!
//! - from the camera it is the weight of the BSDF sample, scaled as radiance is by refraction;
//! - from a light that scaling is undone, and where the shading normal differs from the geometric one the weight gets
//!   |cos θₛ(l) cos θ(e)| / |cos θ(l) cos θₛ(e)|, l towards the light and e towards the eye, s for shading
//!   (Veach 1997, §5.2 and §5.3).

use glam::{Vec3, Vec4};

use crate::math::frame::Frame;
use crate::math::pdf::PdfW;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};

use super::accel::Ray;
use super::bsdf::{Bsdf, BsdfSample, Scattering};
use super::chain::Chain;
use super::interaction::SurfaceInteraction;
use super::light::{Emission, LitPoint, Origin};
use super::sampler::VertexNumbers;
use super::wavelength_mis::WavelengthMis;
use super::{Scene, roulette};

/// One point of a subpath, its endpoint excepted.
#[derive(Clone, Copy, Debug)]
pub struct Vertex<B = Bsdf> {
    /// Where; `hit.wo` looks back along the walk.
    pub hit: SurfaceInteraction,
    /// The frame of `bsdf`.
    pub frame: Frame,
    /// The material at the wavelengths of the walk.
    pub bsdf: B,
    /// `hit.wo` in `frame`.
    pub wo: Vec3,
    /// Product of the weights on the way here.
    pub throughput: SampledSpectrum,
    /// The wavelengths that would have chosen the way here.
    pub wavelength_mis: WavelengthMis,
    /// Number of segments on the way here, at least 1.
    pub depth: u32,
    /// Densities.
    pub chain: Chain,
}

/// What scattering at a vertex gives for a direction that another subpath brings.
#[derive(Clone, Copy, Debug)]
pub struct Scattered {
    /// f·|cos| of the direction towards the light in a camera subpath, and of the direction towards the camera in a
    /// light subpath.
    pub value: SampledSpectrum,
    /// The wavelengths that would have chosen this direction.
    pub wavelength_mis: WavelengthMis,
    /// Density per steradian of going on in this direction.
    pub fwd_w: f32,
    /// Density per steradian of going back along the walk, coming from this direction.
    pub rev_w: f32,
    /// |cos| of the direction to the geometric normal.
    pub cos: f32,
    /// Through the surface.
    pub through: bool,
}

impl<B: Scattering> Vertex<B> {
    /// What is looked at when light is sampled from here, seen from the side of the local direction `eye`.
    #[inline]
    pub fn lit_point(&self, eye: Vec3) -> LitPoint {
        LitPoint::of(self.hit.point.p, &self.frame, (&self.bsdf, eye))
    }

    /// Scattering between the way back and the world-space direction `d`; `FROM_LIGHT` is which sort of walk this
    /// vertex belongs to. `None` where it is zero.
    #[inline]
    pub fn scatter_to<const FROM_LIGHT: bool>(&self, d: Vec3) -> Option<Scattered> {
        let local = self.frame.to_local(d);
        let through = local.z * self.wo.z < 0.0;
        if !self.hit.sides_agree(d, through) {
            return None;
        }
        let cos = d.dot(self.hit.point.ng).abs();
        let there = self.bsdf.eval(self.wo, local);
        let back = self.bsdf.eval(local, self.wo);
        let pdf = |e: Option<(SampledSpectrum, PdfW)>| e.map_or(0.0, |(_, pdf)| pdf.0);
        let (fwd_w, rev_w) = (pdf(there), pdf(back));
        let value = if FROM_LIGHT {
            // |cos θₛ(l)| is in the value; the flux that arrives was measured with |cos θ(l)|.
            let cos_light = self.hit.wo.dot(self.hit.point.ng).abs();
            back?.0 * (cos / cos_light)
        } else {
            there?.0
        };
        let wavelength_mis = if self.bsdf.parts_colors() {
            self.bsdf.part(self.wo, local).wavelength_mis
        } else {
            WavelengthMis::ALL
        };
        let usable = value.is_finite() && !value.is_black();
        usable.then_some(Scattered { value, wavelength_mis, fwd_w, rev_w, cos, through })
    }
}

/// A subpath on its way.
#[derive(Clone, Debug)]
pub struct Walk<const FROM_LIGHT: bool> {
    /// What materials and lights are evaluated at: the wavelengths of the path, or one of them alone.
    pub lambda: SampledWavelengths,
    /// Product of the weights so far.
    pub throughput: SampledSpectrum,
    /// The wavelengths that would have chosen the same way.
    pub wavelength_mis: WavelengthMis,
    /// Takes the throughput to what roulette compares with 1.
    relative: f32,
    /// Segments so far.
    depth: u32,
    /// The vertex that was left last, as the next one sees it.
    step: Step,
}

/// What the last vertex leaves for the densities of the next.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Its position; `None` where it is a direction.
    from: Option<Vec3>,
    /// |cos| there.
    pub cos: f32,
    /// Density of the direction per steradian; of the environment's rays per unit of area of their disk.
    pub fwd_w: f32,
    /// c of the next vertex.
    pub link: f32,
    /// Density of the last vertex.
    pub fwd: f32,
    /// c of the last vertex.
    pub previous_link: f32,
    /// S up to the vertex before the last.
    pub tail: f64,
}

impl Step {
    /// The chain of a vertex that is infinitely far away: its densities are per steradian.
    pub fn far(&self) -> Chain {
        Chain {
            fwd: self.fwd_w,
            fwd_w: self.fwd_w,
            back: self.cos,
            link: [self.link; 2],
            previous_fwd: self.fwd,
            previous_link: self.previous_link,
            tail: self.tail,
        }
    }
}

impl Walk<false> {
    /// A walk from a pinhole at `origin`, whose directions have density `pdf` per steradian, where every such walk comes with
    /// `lights` light subpaths, each shown to the camera.
    pub fn from_camera(lambda: SampledWavelengths, origin: Vec3, (pdf, lights): (f32, f32)) -> Self {
        let (from, throughput) = (Some(origin), SampledSpectrum::ONE);
        // Nothing can choose the camera: its own sum is 0.
        let step = Step { from, cos: 1.0, fwd_w: pdf, link: lights, fwd: 1.0, previous_link: 0.0, tail: 0.0 };
        Self { lambda, throughput, wavelength_mis: WavelengthMis::ALL, relative: 1.0, depth: 0, step }
    }
}

impl Walk<true> {
    /// A walk that begins with `emission` of the spectrum `emitted`; `None` when that is black or not finite.
    pub fn from_light(
        lambda: SampledWavelengths,
        emission: &Emission,
        emitted: SampledSpectrum,
    ) -> Option<Self> {
        let pdf = emission.pdf;
        let throughput = emitted * emission.scale();
        let most = throughput.max_element();
        if !(throughput.is_finite() && most > 0.0) {
            return None;
        }
        let from = (pdf.origin != Origin::Far).then_some(emission.from.p);
        let previous_link = if pdf.origin == Origin::Point { 0.0 } else { 1.0 };
        let (cos, fwd_w, fwd) = (pdf.cos, pdf.next, pdf.vertex);
        let step = Step { from, cos, fwd_w, link: 1.0, fwd, previous_link, tail: 0.0 };
        Some(Self {
            lambda,
            throughput,
            wavelength_mis: WavelengthMis::ALL,
            relative: 1.0 / most,
            depth: 0,
            step,
        })
    }
}

impl<const FROM_LIGHT: bool> Walk<FROM_LIGHT> {
    /// What the last vertex left behind, where the walk leaves the scene.
    pub fn step(&self) -> &Step {
        &self.step
    }

    /// Segments so far.
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// The vertex at `hit`.
    #[inline]
    pub fn arrive<B: Scattering>(&mut self, scene: &Scene, hit: SurfaceInteraction) -> Vertex<B> {
        self.depth += 1;
        let (material, frame) = scene.material(&hit);
        let step = &self.step;
        let cos = hit.wo.dot(hit.point.ng).abs();
        let (to_area, back) = match step.from {
            Some(from) => {
                let inverse = 1.0 / from.distance_squared(hit.point.p);
                (cos * inverse, step.cos * inverse)
            }
            None => (cos, 1.0),
        };
        let chain = Chain {
            fwd: step.fwd_w * to_area,
            fwd_w: step.fwd_w,
            back,
            link: [step.link; 2],
            previous_fwd: step.fwd,
            previous_link: step.previous_link,
            tail: step.tail,
        };
        Vertex {
            hit,
            frame,
            bsdf: B::of(material, &self.lambda),
            wo: frame.to_local(hit.wo),
            throughput: self.throughput,
            wavelength_mis: self.wavelength_mis,
            depth: self.depth,
            chain,
        }
    }

    /// Chooses where to go on from `vertex`, the last one; `None` when the walk ends there. Roulette may end it once
    /// it has `rr_depth` segments.
    #[inline]
    pub fn scatter<B: Scattering>(
        &mut self,
        vertex: &Vertex<B>,
        u: &VertexNumbers,
        rr_depth: u32,
    ) -> Option<Ray> {
        let s = vertex.bsdf.sample(vertex.wo, u.bsdf, u.lobe)?;
        if s.hero_only {
            // Materials stay at all four wavelengths: both ends of a path must agree on how a lobe is chosen.
            self.throughput = SampledSpectrum(self.throughput.0 * Vec4::X);
            self.wavelength_mis = self.wavelength_mis.and(WavelengthMis::ALONE);
        }
        self.go_on(vertex, &s, (u.roulette, rr_depth))
    }

    /// Like [`Walk::scatter`], but where colours part for good this walk ends and all four wavelengths are followed, each
    /// by a walk of its own with the same numbers: `each` takes them.
    #[inline]
    pub fn scatter_each<B: Scattering>(
        &mut self,
        vertex: &Vertex<B>,
        (u, rr_depth): (&VertexNumbers, u32),
        each: impl FnMut(Self, Ray),
    ) -> Option<Ray> {
        let s = vertex.bsdf.sample(vertex.wo, u.bsdf, u.lobe)?;
        if s.hero_only {
            self.part(vertex, &s, (u.roulette, rr_depth), each);
            return None;
        }
        self.go_on(vertex, &s, (u.roulette, rr_depth))
    }

    /// The walks of the four wavelengths, which refract each in its own direction.
    #[cold]
    fn part<B: Scattering>(
        &self,
        vertex: &Vertex<B>,
        s: &BsdfSample,
        at: (f32, u32),
        mut each: impl FnMut(Self, Ray),
    ) {
        for lane in 0..4 {
            let Some((wi, eta2)) = vertex.bsdf.refract(vertex.wo, lane) else { continue };
            let mut own = self.clone();
            own.lambda = own.lambda.alone(lane);
            own.throughput = SampledSpectrum(own.throughput.0 * Vec4::AXES[lane]);
            if let Some(ray) = own.go_on(vertex, &BsdfSample { wi, eta2, ..*s }, at) {
                each(own, ray);
            }
        }
    }

    /// Goes on as `s` says.
    #[inline]
    fn go_on<B: Scattering>(
        &mut self,
        vertex: &Vertex<B>,
        s: &BsdfSample,
        (u, rr_depth): (f32, u32),
    ) -> Option<Ray> {
        let Vertex { hit, frame, bsdf, wo, chain, .. } = vertex;
        let wi = frame.to_world(s.wi);
        if !hit.sides_agree(wi, s.transmitted) {
            return None;
        }
        let cos = wi.dot(hit.point.ng).abs();
        self.throughput *= s.weight;
        if s.transmitted && bsdf.parts_colors() {
            let parted = bsdf.part(*wo, s.wi);
            self.wavelength_mis = self.wavelength_mis.and(parted.wavelength_mis);
            if FROM_LIGHT {
                self.throughput *= SampledSpectrum(parted.eta2);
            }
        }
        if FROM_LIGHT {
            self.throughput *= s.eta2;
            if hit.smooth {
                let shading = (wo.z * cos) / (hit.wo.dot(hit.point.ng) * s.wi.z);
                self.throughput *= shading.abs();
            }
        } else {
            self.relative *= s.eta2;
        }
        let (fwd_w, rev_w) = match s.delta {
            true => (1.0, 1.0),
            false => (s.pdf.0, bsdf.eval(s.wi, *wo).map_or(0.0, |(_, pdf)| pdf.0)),
        };
        self.step = Step {
            from: Some(hit.point.p),
            cos,
            fwd_w,
            link: if s.delta { 0.0 } else { 1.0 },
            fwd: chain.fwd,
            previous_link: if s.delta { 0.0 } else { chain.link[usize::from(s.transmitted)] },
            tail: chain.previous_sum(rev_w),
        };
        let policy = if FROM_LIGHT { roulette::FROM_LIGHT } else { roulette::FROM_CAMERA };
        let armed = self.depth >= rr_depth.min(policy.latest);
        let wanted = policy.sparing * self.throughput.max_element() * self.relative;
        let factor = roulette::survivor_of(wanted, armed, u)?;
        self.throughput *= factor;
        self.throughput.is_finite().then(|| hit.spawn(wi))
    }
}
