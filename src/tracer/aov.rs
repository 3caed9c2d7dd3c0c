//! Layers beside the picture: quantities of the surface that a camera ray meets first, and of the media before it ([`AovKind`]).

use glam::{DVec3, DVec4, Vec3};

use crate::color::profile::rec709_from_xyz;
use crate::scene::desc::{AovDesc, AovKind};
use crate::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum};
use crate::stream::UvWindow;

use super::accel::Ray;
use super::interaction::SurfaceInteraction;
use super::medium::{CameraMedium, LineMedia, LineOfSight, MarchSteps};
use super::scene::SurfaceMaterial;
use super::{Camera, Scene};

/// Sets of four wavelengths at which a reflectance becomes a colour.
const SETS: usize = 8;

/// Length of a ray, in rendering space, at whose end all that is seen has the disparity of infinity.
const ENDLESS: f64 = 1e12;

/// Finds the values of layers along rays.
#[derive(Debug)]
pub struct AovTracer<'a> {
    scene: &'a Scene,
    kinds: Vec<AovKind>,
    /// Some kind is of media.
    asks_for_media: bool,
    /// What camera rays begin in.
    medium: CameraMedium,
    /// Wavelengths with the light of D65 there.
    lambdas: [(SampledWavelengths, SampledSpectrum); SETS],
    /// Linear Rec.709 of a perfect reflector at these wavelengths, nearly 1.
    white: Vec3,
    /// The cameras of the left and the right eye, and the width of their pictures in pixels, if there are two.
    eyes: Option<([&'a Camera; 2], u32)>,
}

impl<'a> AovTracer<'a> {
    /// A tracer of these layers for rays of `camera`.
    pub fn new(scene: &'a Scene, camera: &Camera, layers: &[AovDesc]) -> Self {
        let d65 = Spectrum::D65(1.0);
        let lambdas = std::array::from_fn(|i| {
            let lambda = SampledWavelengths::sample((i as f32 + 0.5) / (4 * SETS) as f32);
            (lambda, d65.sample(&lambda))
        });
        let kinds: Vec<AovKind> = layers.iter().map(|layer| layer.kind).collect();
        let of_media = [AovKind::Transmittance, AovKind::ScatteringDepth];
        let asks_for_media = kinds.iter().any(|kind| of_media.contains(kind));
        let medium = CameraMedium::of(scene, camera, &UvWindow::PICTURE);
        let mut tracer = Self { scene, kinds, asks_for_media, medium, lambdas, white: Vec3::ONE, eyes: None };
        tracer.white = tracer.color(|_, _| SampledSpectrum::ONE);
        tracer
    }

    /// As `self`, with disparities between the pictures of the left and of the right eye, which are `width` pixels wide.
    pub fn with_eyes(self, eyes: [&'a Camera; 2], width: u32) -> Self {
        Self { eyes: Some((eyes, width)), ..self }
    }

    /// Writes what is seen along `ray`, whose direction has unit length, to `values`, one number for each channel.
    pub fn along(&self, ray: &Ray, values: &mut [f32]) {
        let sees = |_: &Ray, at: &SurfaceInteraction, _: f32| !self.scene.is_unseen(at);
        let mut medium = self.medium.along(self.scene, ray);
        let (hit, line) = self.scene.look(&mut { *ray }, &mut medium, sees);
        let media = self.asks_for_media.then(|| self.media(&line));
        let surface = hit.map(|hit| (hit, self.scene.surface_material(&hit)));
        let mut places = values.iter_mut();
        for kind in &self.kinds {
            let found = match (kind, &surface, &media) {
                (AovKind::Transmittance, _, Some(media)) => self.transmittance(media),
                (AovKind::ScatteringDepth, _, Some(media)) => self.scattering_depth(media),
                (AovKind::Disparity, surface, _) => {
                    let end = || ray.origin.as_dvec3() + ray.direction.as_dvec3() * ENDLESS;
                    self.disparity(surface.as_ref().map_or_else(end, |(hit, _)| hit.point.p.as_dvec3()))
                }
                (_, Some((hit, surface)), _) => self.of_surface(*kind, ray, hit, surface),
                _ => Vec3::ZERO,
            };
            for (value, place) in found.to_array().iter().zip(places.by_ref().take(kind.channels().len())) {
                *place = *value;
            }
        }
    }

    /// A quantity of the surface at `hit`; only as many numbers count as it has channels.
    fn of_surface(
        &self,
        kind: AovKind,
        ray: &Ray,
        hit: &SurfaceInteraction,
        surface: &SurfaceMaterial<'_>,
    ) -> Vec3 {
        let space = self.scene.space();
        match kind {
            AovKind::Albedo => self.albedo(surface, hit.wo),
            AovKind::Depth => Vec3::splat(space.world_length(hit.point.p.distance(ray.origin))),
            AovKind::Position => space.world_point(hit.point.p).as_vec3(),
            AovKind::Uv => surface.context.texture.uv.extend(0.0),
            AovKind::GeometricNormal => hit.point.ng,
            AovKind::ShadingNormal => hit.n,
            AovKind::PrimIndex => Vec3::splat(self.scene.index_in_shape(hit) as f32),
            AovKind::ShapeIndex => Vec3::splat(self.scene.shape(hit) as f32 + 1.0),
            // Not of a surface alone; these are asked for above.
            AovKind::Transmittance | AovKind::ScatteringDepth | AovKind::Disparity => Vec3::ZERO,
        }
    }

    /// Disparity of a place in rendering space, pixels; 0 without two eyes that have it before them.
    fn disparity(&self, place: DVec3) -> Vec3 {
        let pixels = self.eyes.and_then(|([left, right], width)| {
            let [left, right] = [left.screen_position(place)?, right.screen_position(place)?];
            Some((left.x - right.x) * f64::from(width))
        });
        Vec3::splat(pixels.unwrap_or(0.0) as f32)
    }

    /// Linear Rec.709 of the diffuse reflectance under D65.
    fn albedo(&self, surface: &SurfaceMaterial<'_>, wo: Vec3) -> Vec3 {
        let (SurfaceMaterial { material, context, .. }, wo) = (surface, surface.frame.to_local(wo));
        self.color(|_, lambda| material.diffuse_reflectance(&context.texture, lambda, wo)) / self.white
    }

    /// What the media on a line do at each set of wavelengths.
    fn media(&self, line: &LineOfSight<'_>) -> [LineMedia; SETS] {
        let at = |set: usize| line.media(&self.lambdas[set].0, MarchSteps::Cells);
        if line.is_grey() { [at(0); SETS] } else { std::array::from_fn(at) }
    }

    /// Linear Rec.709 of the transmittance under D65.
    fn transmittance(&self, media: &[LineMedia; SETS]) -> Vec3 {
        self.color(|set, _| spectrum(media[set].transmittance)) / self.white
    }

    /// Mean distance of scattering; 0 where nothing scatters.
    fn scattering_depth(&self, media: &[LineMedia; SETS]) -> Vec3 {
        let luminance = |of: fn(&LineMedia) -> DVec4| self.xyz(|set, _| spectrum(of(&media[set]))).y;
        let (moment, scattered) = (luminance(|media| media.moment), luminance(|media| media.scattered));
        let distance = if scattered > 0.0 { moment / scattered } else { 0.0 };
        Vec3::splat(self.scene.space().world_length(distance))
    }

    /// Linear Rec.709 under D65 of what is given for each set of wavelengths.
    fn color(&self, value: impl Fn(usize, &SampledWavelengths) -> SampledSpectrum) -> Vec3 {
        rec709_from_xyz() * (self.xyz(value) / SETS as f32)
    }

    /// The sum over the sets of wavelengths of its XYZ.
    fn xyz(&self, value: impl Fn(usize, &SampledWavelengths) -> SampledSpectrum) -> Vec3 {
        self.lambdas.iter().enumerate().fold(Vec3::ZERO, |sum, (set, (lambda, light))| {
            let xyz = lambda.to_xyz(value(set, lambda) * *light);
            sum + Vec3::new(xyz.x, xyz.y, xyz.z)
        })
    }
}

fn spectrum(value: DVec4) -> SampledSpectrum {
    SampledSpectrum(value.as_vec4())
}
