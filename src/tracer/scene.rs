//! The prepared scene, and what paths ask of it.

use std::sync::Arc;

use glam::Vec3;

use crate::math::frame::Frame;
use crate::scene::desc::RenderingSpace;
use crate::spectrum::{SampledWavelengths, White};

use super::accel::{Accel, Hit, PrimRange, Ray, SimdKernel};
use super::bsdf::{Material, MaterialEvalContext, Scattering, Sides};
use super::interaction::SurfaceInteraction;
use super::light::{LightSample, Lights};
use super::medium::{Media, MediumIndex, PhaseFunction};
use super::opacity::Opacity;
use super::prepare::{SceneStructure, SpecularUse};
use super::primitives::Primitives;
use super::specular_chain::ChainBounds;

/// The material that a surface shows at a point to the side that it is seen from.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceMaterial<'a> {
    /// The material.
    pub material: &'a Material,
    /// The shading frame that it is evaluated in.
    pub frame: Frame,
    /// The point at which it is evaluated.
    pub context: MaterialEvalContext,
}

impl SurfaceMaterial<'_> {
    /// The material at the wavelengths of a path.
    #[inline(always)]
    pub fn bsdf<B: Scattering>(&self, lambda: &SampledWavelengths) -> B {
        B::of(self.material, &self.context, lambda)
    }
}

/// The class of materials in a scene. Integrators have special code for each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaterialClass {
    /// Diffuse materials only.
    Diffuse,
    /// Also mirrors, clear glass and smooth coats.
    Specular,
    /// All materials but mixtures.
    General,
    /// All materials.
    Mixed,
    /// All materials, and participating media.
    InMedia,
}

/// What paths record while they find light. [`Plain`](Self::Plain) code is compiled for each [`MaterialClass`], that of the other modes for all
/// materials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TracingMode {
    /// Nothing else.
    #[default]
    Plain,
    /// Paths [record](super::record) what they do.
    Record,
    /// Paths tell which [group of lights](super::light_groups) their light comes from.
    LightGroups,
}

/// A scene ready for tracing: immutable, shared by all workers. The camera belongs to the integrator, so that moving it or
/// changing the size of the picture leaves the scene as it is. A copy shares geometry.
#[derive(Clone, Debug)]
pub struct Scene {
    pub(super) primitives: Arc<Primitives>,
    /// Materials by side of every surface: one for each shape, in their order, then one for each shape of the groups.
    pub(super) surfaces: Vec<Sides>,
    pub(super) materials: Vec<Material>,
    /// How much of each surface is there; `None` where all of every surface is, so that no ray asks.
    pub(super) opacities: Option<Box<[Opacity]>>,
    pub(super) lights: Lights,
    /// The role of each surface in caustics and chains of deltas, in the order of [`SceneDesc::surfaces`](crate::scene::SceneDesc::surfaces).
    pub(super) specular_uses: Box<[SpecularUse]>,
    /// Bounds of all that a chain of deltas can lead to.
    pub(super) chains: ChainBounds,
    /// Participating media; `None` where there are none.
    pub(super) media: Option<Arc<Media>>,
    /// The white of all light, if nothing has a colour.
    pub(super) white: Option<White>,
    pub(super) material_class: MaterialClass,
    pub(super) tracing_mode: TracingMode,
    pub(super) notices: Vec<String>,
    pub(super) space: RenderingSpace,
    /// The description that the primitives and the lights were made from.
    pub(super) structure: Arc<SceneStructure>,
}

impl Scene {
    /// This scene with rays traced by `kernel`: samples are the same bits, and only their time differs. `None` where the
    /// processor lacks what `kernel` needs, or while another scene, [edited](Scene::edited) from this one, shares the tree.
    pub fn with_kernel(mut self, kernel: SimdKernel) -> Option<Scene> {
        self.lights.set_kernel(kernel.available()?);
        let set = |alone: &mut Primitives| alone.accel.set_kernel(kernel);
        let is_set = self.kernel() == kernel || Arc::get_mut(&mut self.primitives).is_some_and(set);
        is_set.then_some(self)
    }

    /// This scene, whose paths [record](super::record) what they do.
    pub fn recorded(self) -> Scene {
        Scene { tracing_mode: TracingMode::Record, ..self }
    }

    /// This scene, whose paths tell which group of lights their light comes from: of `count` groups, at most
    /// [`MOST_GROUPS`](crate::stream::MOST_GROUPS). `of_sources` has the group of each [source](Lights::source), and then of each medium of the
    /// description.
    pub fn with_light_groups(&self, of_sources: &[u8], count: usize) -> Scene {
        let lights = self.lights.clone().grouped(of_sources, count);
        Scene { tracing_mode: TracingMode::LightGroups, lights, ..self.clone() }
    }

    /// The kernel that traces rays: the fastest that the processor has, unless another was asked for.
    pub fn kernel(&self) -> SimdKernel {
        self.primitives.accel.kernel()
    }

    /// The white of all light, where nothing in the scene has a colour.
    pub fn white(&self) -> Option<White> {
        self.white
    }

    /// The class of the materials, as planned.
    #[inline]
    pub fn material_class(&self) -> MaterialClass {
        self.material_class
    }

    /// The mode of tracing: what paths record while they find light.
    #[inline]
    pub fn tracing_mode(&self) -> TracingMode {
        self.tracing_mode
    }

    /// Notices for the user about the scene, one sentence each.
    pub fn notices(&self) -> &[String] {
        &self.notices
    }

    /// The participating media, if there are any.
    #[inline]
    pub fn media(&self) -> Option<&Media> {
        self.media.as_deref()
    }

    /// The medium in which `ray`, which leaves a light, begins.
    #[inline]
    pub(super) fn medium_of_light(&self, light: u32, ray: &Ray) -> MediumIndex {
        let Some(media) = self.media() else { return MediumIndex::VACUUM };
        media.of_source(self.lights.source(light)).unwrap_or_else(|| self.medium_ahead(ray))
    }

    /// The phase function of a medium at the point `p`; in vacuum, where nothing scatters, that of all directions alike.
    #[inline]
    pub(super) fn phase_function(&self, medium: MediumIndex, p: Vec3) -> PhaseFunction {
        self.media().and_then(|media| media.phase(medium, p)).unwrap_or(PhaseFunction::ISOTROPIC)
    }

    /// The lights.
    pub fn lights(&self) -> &Lights {
        &self.lights
    }

    /// The geometry.
    pub fn accel(&self) -> &Accel {
        &self.primitives.accel
    }

    /// The first hit of `ray`, whose direction has unit length. Surfaces that are not all there are passed by chance.
    #[inline(always)]
    pub fn closest(&self, ray: &Ray) -> Option<SurfaceInteraction> {
        let mut ray = *ray;
        let hit = self.hit(&mut ray)?;
        Some(self.interaction(&ray, &hit))
    }

    /// As [`closest`](Self::closest): the hit alone, and `ray` then begins behind what it has passed. What is out of line returns a hit rather
    /// than a [`SurfaceInteraction`], so that the compiler keeps the latter in registers.
    #[inline(always)]
    fn hit(&self, ray: &mut Ray) -> Option<Hit> {
        match self.opacities {
            None => self.primitives.accel.closest(ray),
            Some(_) => self.hit_met(ray),
        }
    }

    /// Where `ray` has met what is there.
    #[inline(always)]
    pub(super) fn interaction(&self, ray: &Ray, hit: &Hit) -> SurfaceInteraction {
        self.primitives.interaction(ray, hit)
    }

    /// The first hit of `ray`, however little of the surface is there.
    #[inline(always)]
    pub fn first(&self, ray: &Ray) -> Option<SurfaceInteraction> {
        self.primitives.accel.closest(ray).map(|hit| self.interaction(ray, &hit))
    }

    /// The space that it is traced in.
    pub fn space(&self) -> &RenderingSpace {
        &self.space
    }

    /// The number of the object that was hit: the shape, or the instance that shows it. An index into
    /// [`SceneDesc::shapes`](crate::scene::SceneDesc::shapes).
    pub fn shape(&self, at: &SurfaceInteraction) -> u32 {
        self.primitives.placement(at).map_or(at.surface, |placement| placement.shape)
    }

    /// The number of a triangle that was hit in the file of its shape; 0 of anything else.
    pub fn index_in_shape(&self, at: &SurfaceInteraction) -> u32 {
        self.primitives.index_in_shape(at.hit.prim)
    }

    /// The share of light that reaches `from` from the light of `sample`: 1 where nothing stands in between.
    #[inline(always)]
    pub fn visible(&self, from: &SurfaceInteraction, light: u32, sample: &LightSample) -> f32 {
        match sample.target {
            Some(target) => self.open_share(&from.spawn_to(target, sample.wi), self.lights.prims(light)),
            None => self.open_share(&from.spawn(sample.wi), PrimRange::NONE),
        }
    }

    /// The share of light that goes all along `ray`, the primitives of `skip` excepted: 1 where nothing lies on it, 0 where something does that
    /// is all there.
    #[inline(always)]
    pub(super) fn open_share(&self, ray: &Ray, skip: PrimRange) -> f32 {
        match self.primitives.accel.occluded(ray, skip) {
            false => 1.0,
            true if self.opacities.is_some() => self.passed_share(ray, skip),
            true => 0.0,
        }
    }

    /// The first hit of `ray` that is not on a light; `ray` then begins behind what it has passed.
    #[cold]
    #[inline(never)]
    pub(super) fn hit_unlit(&self, ray: &mut Ray) -> Option<Hit> {
        loop {
            let hit = self.hit(ray)?;
            let at = self.interaction(ray, &hit);
            if at.light.is_none() {
                return Some(hit);
            }
            *ray = Ray { t_max: f32::INFINITY, ..at.spawn(ray.direction) };
        }
    }

    /// True where some surfaces are not all there.
    #[inline(always)]
    pub fn has_holes(&self) -> bool {
        self.opacities.is_some()
    }

    /// The index of the material that is seen at a hit.
    pub(super) fn material_index(&self, hit: &SurfaceInteraction) -> u32 {
        self.surfaces[hit.surface as usize].seen_from(hit.wo, hit.n).0
    }

    /// The material with this index.
    pub(super) fn material(&self, index: u32) -> &Material {
        &self.materials[index as usize]
    }

    /// The material that is seen at a hit, ready to be evaluated.
    #[inline(always)]
    pub fn surface_material(&self, hit: &SurfaceInteraction) -> SurfaceMaterial<'_> {
        match self.is_parametrized() {
            false => self.uniform_material(hit),
            true => self.evaluated_with(hit, self.primitives.material_context(hit)),
        }
    }

    /// As [`surface_material`](Self::surface_material) in a scene that is not [parametrized](Self::is_parametrized).
    #[inline(always)]
    pub(super) fn uniform_material(&self, hit: &SurfaceInteraction) -> SurfaceMaterial<'_> {
        self.evaluated_with(hit, MaterialEvalContext::uniform(hit.n, hit.point.ng))
    }

    /// True where some surface has a (u, v) parametrization that its material asks for: it is textured, brushed or bumpy.
    #[inline(always)]
    pub(super) fn is_parametrized(&self) -> bool {
        self.primitives.is_parametrized()
    }

    #[inline(always)]
    fn evaluated_with(&self, hit: &SurfaceInteraction, context: MaterialEvalContext) -> SurfaceMaterial<'_> {
        let frame = context.frame();
        let (material, turned) = self.surfaces[hit.surface as usize].seen_from(hit.wo, hit.n);
        let frame = if turned { frame.turned() } else { frame };
        SurfaceMaterial { material: &self.materials[material as usize], frame, context }
    }
}
