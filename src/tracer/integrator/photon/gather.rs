//! Photons around a point of a camera path: what they send along it.

use glam::{Vec3, Vec4};

use crate::color::Xyz;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::Scene;
use crate::tracer::bsdf::Bsdf;
use crate::tracer::photon_map::{Disc, Photon, PhotonLayer};
use crate::tracer::wavelength_mis::WavelengthMis;

use super::step::Step;
use super::walk::{Path, Vertex};

/// Photons of a lookup of the caustic layer, which is seen directly, to those of the global one.
const CAUSTIC: usize = 2;

/// Cosine between the normals of a photon and of the point from which it counts.
const SAME_SURFACE: f32 = 0.7;

/// Discs are never smaller than this part of the largest: what many photons hit in one point stays finite.
const SMALLEST: f32 = 1e-4;

/// Half of the first window of wavelengths, nm.
const WINDOW: f32 = 30.0;

impl Path<'_> {
    /// Adds what the photons of `layer` around `vertex` send along the path.
    pub(super) fn gather(&mut self, vertex: &Vertex, layer: PhotonLayer) {
        let forest = self.snapshot.layer(layer);
        if forest.is_empty() {
            return;
        }
        let (wanted, radius, window) = self.reach(layer);
        let ng = vertex.hit.point.ng;
        let normal = if vertex.hit.wo.dot(ng) < 0.0 { -ng } else { ng };
        let segments = self.tracer.context.longest() - self.depth;
        let hero = self.lambda.lambda().x;
        let accept = |photon: &Photon| {
            photon.depth() <= segments
                && photon.normal().dot(normal) > SAME_SURFACE
                && window.is_none_or(|w| lanes_near(photon, hero, w) > 0.0)
        };
        let throughput = self.throughput * self.counts(WavelengthMis::ALL);
        let Self { scratch, tracer, .. } = self;
        let found = forest.nearest(vertex.hit.point.p, radius, wanted, &mut scratch.query, accept);
        let Some(disc) = Disc::new(found, wanted, radius, radius * SMALLEST) else { return };
        let scale = 1.0 / disc.area() / self.snapshot.light_paths() as f32;
        let path =
            Kept { scene: &tracer.context.scene, steps: &scratch.steps, white: tracer.context.white() };
        let (mut xyz, mut value) = (Xyz::BLACK, SampledSpectrum::ZERO);
        for near in disc.counted() {
            let photon = forest.photon(near);
            match window {
                None => xyz += path.at_wavelengths_of(photon, vertex, scale),
                Some(w) => {
                    let flux = lanes_near(photon, hero, w) * scale;
                    value += at_the_hero(photon, vertex, throughput * flux);
                }
            }
        }
        self.banked += xyz;
        self.radiance += value;
    }

    /// How many photons a lookup asks for, within which radius, and within which distance (nm) of the hero where only
    /// that is carried.
    pub(super) fn reach(&self, layer: PhotonLayer) -> (usize, f32, Option<f32>) {
        let wanted = match layer {
            PhotonLayer::Global => self.lookup.neighbours,
            PhotonLayer::Caustic => self.lookup.neighbours * CAUSTIC,
        };
        if !self.lambda.is_hero_only() {
            return (wanted, self.lookup.radius, None);
        }
        // Blur over place and over wavelength shrink together; disc times window holds as many photons as before.
        let shrink = 1.0 / (self.lookup.generations.max(1) as f32).cbrt();
        (wanted, self.tracer.schedule.radius * shrink, Some(WINDOW * shrink))
    }
}

/// The scatterings of a path.
struct Kept<'a> {
    scene: &'a Scene,
    steps: &'a [Step],
    /// What every photon carries, where nothing has a colour.
    white: Option<SampledWavelengths>,
}

impl Kept<'_> {
    /// What a photon sends along the path: throughput and material at the photon's wavelengths.
    #[inline]
    fn at_wavelengths_of(&self, photon: &Photon, vertex: &Vertex, scale: f32) -> Xyz {
        let lambda = self.white.unwrap_or_else(|| photon.wavelengths());
        let bsdf = vertex.material.bsdf(&lambda);
        let Some(f) = scattered(vertex, &bsdf, photon.direction()) else { return Xyz::BLACK };
        let throughput =
            self.steps.iter().fold(SampledSpectrum::ONE, |t, step| t * step.weight(self.scene, &lambda));
        let value = photon.flux() * f * throughput * scale;
        if value.is_finite() { lambda.to_xyz(value) } else { Xyz::BLACK }
    }
}

/// What a photon sends along a path that carries its hero wavelength only; `throughput` includes the flux there.
#[inline]
fn at_the_hero(photon: &Photon, vertex: &Vertex, throughput: SampledSpectrum) -> SampledSpectrum {
    let f = scattered(vertex, &vertex.bsdf, photon.direction());
    let value = f.map_or(SampledSpectrum::ZERO, |f| throughput * f);
    if value.is_finite() { value } else { SampledSpectrum::ZERO }
}

/// f·|cos θₛ| / |cos θ| from the world-space direction `wi` into the path: flux is measured with the geometric cosine.
#[inline]
fn scattered(vertex: &Vertex, bsdf: &Bsdf, wi: Vec3) -> Option<SampledSpectrum> {
    let local = vertex.frame.to_local(wi);
    if !vertex.hit.sides_agree(wi, vertex.wo.z * local.z < 0.0) {
        return None;
    }
    let (f, _) = bsdf.eval(vertex.wo, local)?;
    let cos = if vertex.hit.smooth { wi.dot(vertex.hit.point.ng).abs() } else { local.z.abs() };
    Some(f * (1.0 / cos))
}

/// The photon's flux per nm at `hero`, estimated from its lanes nearer than `window` nm (Epanechnikov's kernel).
#[inline]
fn lanes_near(photon: &Photon, hero: f32, window: f32) -> f32 {
    let lambda = photon.wavelengths();
    let pdf = lambda.pdf();
    let x = (lambda.lambda() - hero) / window;
    let kernel = (1.0 - x * x).max(Vec4::ZERO) * (0.75 / window);
    let carried = pdf.cmpgt(Vec4::ZERO);
    Vec4::select(carried, photon.flux().0 * kernel * 0.25 / pdf, Vec4::ZERO).element_sum()
}
