//! Layers beside the picture: quantities of the surface that a camera ray meets first ([`AovKind`]).

use glam::Vec3;

use crate::color::profile::rec709_from_xyz;
use crate::scene::desc::{AovDesc, AovKind};
use crate::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum};

use super::Scene;
use super::accel::Ray;
use super::scene::SurfaceMaterial;

/// Sets of four wavelengths at which a reflectance becomes a colour.
const SETS: usize = 8;

/// Finds the values of layers along rays.
#[derive(Debug)]
pub struct AovTracer<'a> {
    scene: &'a Scene,
    kinds: Vec<AovKind>,
    /// Wavelengths with the light of D65 there.
    lambdas: [(SampledWavelengths, SampledSpectrum); SETS],
    /// Linear Rec.709 of a perfect reflector at these wavelengths, nearly 1.
    white: Vec3,
}

impl<'a> AovTracer<'a> {
    /// A tracer of these layers.
    pub fn new(scene: &'a Scene, layers: &[AovDesc]) -> Self {
        let d65 = Spectrum::D65(1.0);
        let lambdas = std::array::from_fn(|i| {
            let lambda = SampledWavelengths::sample((i as f32 + 0.5) / (4 * SETS) as f32);
            (lambda, d65.sample(&lambda))
        });
        let kinds = layers.iter().map(|layer| layer.kind).collect();
        let mut tracer = Self { scene, kinds, lambdas, white: Vec3::ONE };
        tracer.white = tracer.color(|_| SampledSpectrum::ONE);
        tracer
    }

    /// Writes what is seen along `ray`, whose direction has unit length, to `values`, one number for each channel; 0 where that is nothing.
    pub fn along(&self, ray: &Ray, values: &mut [f32]) {
        values.fill(0.0);
        let Some(hit) = self.scene.first(ray) else { return };
        let mut places = values.iter_mut();
        let mut put = |found: &[f32]| {
            for (value, place) in found.iter().zip(&mut places) {
                *place = *value;
            }
        };
        let (surface, space) = (self.scene.surface_material(&hit), self.scene.space());
        for kind in &self.kinds {
            match kind {
                AovKind::Albedo => put(&self.albedo(&surface, hit.wo).to_array()),
                AovKind::Depth => put(&[space.world_length(hit.point.p.distance(ray.origin))]),
                AovKind::Position => put(&space.world_point(hit.point.p).as_vec3().to_array()),
                AovKind::Uv => put(&surface.context.texture.uv.to_array()),
                AovKind::GeometricNormal => put(&hit.point.ng.to_array()),
                AovKind::ShadingNormal => put(&hit.n.to_array()),
                AovKind::PrimIndex => put(&[self.scene.index_in_shape(&hit) as f32]),
                AovKind::ShapeIndex => put(&[self.scene.shape(&hit) as f32 + 1.0]),
            }
        }
    }

    /// Linear Rec.709 of the diffuse reflectance under D65.
    fn albedo(&self, surface: &SurfaceMaterial<'_>, wo: Vec3) -> Vec3 {
        let (SurfaceMaterial { material, context, .. }, wo) = (surface, surface.frame.to_local(wo));
        self.color(|lambda| material.diffuse_reflectance(&context.texture, lambda, wo)) / self.white
    }

    fn color(&self, reflectance: impl Fn(&SampledWavelengths) -> SampledSpectrum) -> Vec3 {
        let xyz = self.lambdas.iter().fold(Vec3::ZERO, |sum, (lambda, light)| {
            let xyz = lambda.to_xyz(reflectance(lambda) * *light);
            sum + Vec3::new(xyz.x, xyz.y, xyz.z)
        });
        rec709_from_xyz() * (xyz / SETS as f32)
    }
}
