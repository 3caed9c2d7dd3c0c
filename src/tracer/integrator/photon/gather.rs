//! Density estimation: what the photons around a vertex of a camera path contribute to it.

use glam::{Vec3, Vec4};

use crate::color::Xyz;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::Scene;
use crate::tracer::bsdf::{Bsdf, Material, ScatteringModel};
use crate::tracer::interaction::SurfaceVertex;
use crate::tracer::photon_map::{Disc, Photon, PhotonLayer};

use super::camera_path::{CameraPath, RecordedScattering};

/// Photons of a lookup in the caustic layer, which is seen directly, over those of one in the global layer.
const CAUSTIC: usize = 2;

/// Photons count whose normal has at least this cosine to that of the vertex.
const SAME_SURFACE: f32 = 0.7;

/// Least radius of a disc over the largest: where many photons lie in one point the estimate stays finite.
const SMALLEST: f32 = 1e-4;

/// Half of the first window of wavelengths, nm.
const WINDOW: f32 = 30.0;

impl CameraPath<'_> {
    /// Adds what the photons of `layer` around `vertex` contribute.
    pub(super) fn gather(&mut self, vertex: &SurfaceVertex, layer: PhotonLayer) {
        let forest = self.snapshot.layer(layer);
        if forest.is_empty() {
            return;
        }
        let (wanted, radius, window) = self.reach(layer);
        let normal = vertex.hit.facing_normal();
        // The last segment leads here.
        let segments = self.tracer.context.longest() - (self.state.depth + 1);
        let hero = self.state.lambda.lambda().x;
        let accept = |photon: &Photon| {
            photon.depth() <= segments
                && photon.normal().dot(normal) > SAME_SURFACE
                && window.is_none_or(|w| lanes_near(photon, hero, w) > 0.0)
        };
        let throughput = self.state.throughput * self.state.wavelength_weight;
        let Self { scratch, tracer, .. } = self;
        let found = forest.nearest(vertex.hit.point.p, radius, wanted, &mut scratch.query, accept);
        let Some(disc) = Disc::new(found, wanted, radius, radius * SMALLEST) else { return };
        let scale = 1.0 / disc.area / self.snapshot.light_paths as f32;
        let scene = &tracer.context.scene;
        let path = RecordedPath {
            scene,
            scatterings: &scratch.scatterings,
            material: scene.material(&vertex.hit).0,
            white: tracer.context.white(),
        };
        let (mut xyz, mut value) = (Xyz::BLACK, SampledSpectrum::ZERO);
        for near in disc.counted {
            let photon = forest.photon(near);
            match window {
                None => xyz += path.at_wavelengths_of(photon, vertex, scale),
                Some(w) => {
                    let flux = lanes_near(photon, hero, w) * scale;
                    value += at_the_hero(photon, vertex, throughput * flux);
                }
            }
        }
        self.xyz += xyz;
        self.state.radiance += value;
    }

    /// How many photons a lookup asks for, within which radius, and within which distance (nm) of the hero if the path
    /// carries that alone.
    pub(super) fn reach(&self, layer: PhotonLayer) -> (usize, f32, Option<f32>) {
        let wanted = match layer {
            PhotonLayer::Global => self.lookup.neighbours,
            PhotonLayer::Caustic => self.lookup.neighbours * CAUSTIC,
        };
        if !self.state.lambda.is_hero_only() {
            return (wanted, self.lookup.radius, None);
        }
        // Blur over place and over wavelength shrink together; disc times window holds as many photons as before.
        let shrink = 1.0 / (self.lookup.generations.max(1) as f32).cbrt();
        (wanted, self.tracer.schedule.radius * shrink, Some(WINDOW * shrink))
    }
}

/// A path to be evaluated again at the wavelengths of photons.
struct RecordedPath<'a> {
    scene: &'a Scene,
    scatterings: &'a [RecordedScattering],
    /// The material where the photons are.
    material: &'a Material,
    /// The wavelengths of every photon, where nothing has a colour.
    white: Option<SampledWavelengths>,
}

impl RecordedPath<'_> {
    /// What a photon contributes: throughput and material are evaluated at the photon's wavelengths.
    #[inline]
    fn at_wavelengths_of(&self, photon: &Photon, vertex: &SurfaceVertex, scale: f32) -> Xyz {
        let lambda = self.white.unwrap_or_else(|| photon.wavelengths());
        let bsdf = self.material.bsdf(&lambda);
        let Some(f) = scattered(vertex, &bsdf, photon.direction()) else { return Xyz::BLACK };
        let weight = |t: SampledSpectrum, s: &RecordedScattering| t * s.weight(self.scene, &lambda);
        let throughput = self.scatterings.iter().fold(SampledSpectrum::ONE, weight);
        let value = photon.flux() * f * throughput * scale;
        if value.is_finite() { lambda.to_xyz(value) } else { Xyz::BLACK }
    }
}

/// What a photon contributes to a path that carries its hero wavelength only; `throughput` includes the flux there.
#[inline]
fn at_the_hero(photon: &Photon, vertex: &SurfaceVertex, throughput: SampledSpectrum) -> SampledSpectrum {
    let f = scattered(vertex, &vertex.bsdf, photon.direction());
    let value = f.map_or(SampledSpectrum::ZERO, |f| throughput * f);
    if value.is_finite() { value } else { SampledSpectrum::ZERO }
}

/// f·|cos θₛ| / |cos θ| from the world-space direction `wi` into the path: flux is measured with the geometric cosine.
#[inline]
fn scattered(vertex: &SurfaceVertex, bsdf: &Bsdf, wi: Vec3) -> Option<SampledSpectrum> {
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
