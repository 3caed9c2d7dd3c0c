//! Everything that emits, and how one of many lights is sampled.
//!
//! ```text
//! flat sphere cylinder textured                        the sorts of lights (LightSource): surfaces,
//! point spot projector                                 points,
//! directional environment sun_sky                      what is infinitely far away
//! lights      all lights of a scene: sampling one from a lit point, and the density of a direction; rays that leave lights, and
//!             their densities: how light subpaths begin
//! subtended rectangle spherical_triangle               points on flat lights that are close by
//! casters     what light subpaths are aimed at
//! selector    which light a point samples: one, few that are all looked at, or a tree of them; how much light each may bring
//! tree        the tree of many lights
//! ```
//!
//! Conventions: `wi` points from the lit point to the light, unit length, world space. A density is per
//! steradian at the lit point and includes the probability of choosing the light; sample and pdf are pairs:
//! [`Lights::pdf`] returns for a direction exactly what [`Lights::sample`] would have reported for it, and 0
//! where it would never have chosen it. Where each light is sampled ([`LightSampleContext::glossy`]) the probability of
//! choosing a light is 1. A delta light has the probability of its choice as density and
//! [`LightSample::delta`] set. Of an environment next-event estimation looks for a part only ([`LightSource::sought_share`]): its density is 0
//! where scattering alone finds the light. `None` means that sampling failed: no light from there.
//!
//! # Adding a light
//!
//! 1. A file here with a struct that implements [`LightSource`]: `point.rs` is the shortest, `sphere.rs` one that paths can
//!    hit, `environment.rs` has those around the scene.
//! 2. One line in the table of [`LightShape`] below. Next-event estimation, light subpaths, the choice among lights and the
//!    densities of hits then work by themselves.
//! 3. What makes one: a variant of `scene::desc::LightDesc` and its reader in `scene/mitsuba/emitter.rs`, and
//!    `Geometry::add_light` in `tracer/prepare/lights.rs`, which makes the struct of the description. A shape that emits needs
//!    neither: it is registered there with its primitives.
//! 4. Tests: `tests/tracer/lights.rs` compares the irradiance with its exact value, `light_choice.rs` samples with densities.

mod casters;
mod cylinder;
mod directional;
mod environment;
mod flat;
mod lights;
mod point;
mod projector;
mod rectangle;
mod selector;
mod sphere;
mod spherical_triangle;
mod spot;
mod subtended;
mod sun_sky;
mod textured;
mod tree;

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};

use super::accel::PrimRange;
use super::bounding_sphere::BoundingSphere;
use super::sampler::LightNumbers;
use super::shape::SurfacePoint;
use selector::LightBounds;

pub use casters::CausticCasters;
pub use cylinder::CylinderLight;
pub use directional::DirectionalLight;
pub use environment::{ConstantLight, DirectionSampling, EnvironmentMap};
pub use flat::{DiskLight, ParallelogramLight, TriangleLight};
pub use lights::{Emission, EmissionOrigin, EmissionPdf, LightSample, LightSampleContext, Lights};
pub use point::PointLight;
pub use projector::ProjectorLight;
pub use sphere::SphereLight;
pub use spot::{SpotLight, SpotTexture};
pub use sun_sky::{SunDisc, SunSkyLight};
pub(super) use textured::LuminancePyramid;
pub use textured::{EmittingSurface, FlatPatch, TexturedLight};

/// A light of one kind. Densities here are without the probability of choosing the light, unless said.
pub trait LightSource {
    /// Samples a direction from the lit point `at` by the numbers `u`.
    fn sample(&self, at: LightSampleContext, u: [f32; 2]) -> Option<LightSample>;

    /// The density of [`LightSource::sample`] for the direction `wi`, which hit the light at `hit`; that is `None` for an
    /// environment.
    fn pdf(&self, at: LightSampleContext, wi: Vec3, hit: Option<&SurfacePoint>) -> PdfW;

    /// Power over π of a light of spectrum 1: its area for a surface.
    fn power(&self, scene: BoundingSphere) -> f32;

    /// Bounds of the light of power `power` (over π), for choosing among lights, and corners of the box around it.
    fn bounds(&self, power: f32, scene: BoundingSphere) -> (LightBounds, [Vec3; 2]);

    /// Samples a ray that leaves the light: origin, for an environment on a disk before the scene, and direction.
    fn emit(&self, u: &LightNumbers, scene: BoundingSphere) -> Option<(SurfacePoint, Vec3)>;

    /// The densities of [`LightSource::emit`] for the ray from `p` (not used for an environment) in `direction`, where the
    /// light is chosen with probability `choice`.
    fn emission_pdf(&self, p: Vec3, direction: Vec3, scene: BoundingSphere, choice: f32) -> EmissionPdf;

    /// True if it surrounds the scene, infinitely far away. A scene has at most one of these.
    #[inline]
    fn is_environment(&self) -> bool {
        false
    }

    /// True if its emission depends on the place or the direction.
    #[inline]
    fn varies(&self) -> bool {
        false
    }

    /// The factor on the light's spectrum for light from the point `p` of it (not used for an environment) that arrives along
    /// `wi`, where that [varies](LightSource::varies).
    #[inline]
    fn factor(&self, _p: Vec3, _wi: Vec3, _lambda: &SampledWavelengths) -> SampledSpectrum {
        SampledSpectrum::ONE
    }

    /// The factor for a ray of [`LightSource::emit`], from `p` in `direction`.
    #[inline]
    fn emitted(&self, p: Vec3, direction: Vec3, lambda: &SampledWavelengths) -> SampledSpectrum {
        self.factor(p, -direction, lambda)
    }

    /// True if each of its points emits in one direction only: neither next-event estimation nor a hit finds its light, but
    /// light subpaths do.
    fn is_beam(&self) -> bool {
        false
    }

    /// Share of its light that next-event estimation looks for, which the choice among lights goes by. The rest is found by
    /// scattering alone (an environment's), or from the light (a beam's). With 0, the light is never sampled.
    fn sought_share(&self) -> f32 {
        if self.is_beam() { 0.0 } else { 1.0 }
    }

    /// True if it emits nothing whatever its spectrum.
    fn is_black(&self) -> bool {
        false
    }
}

/// Makes [`LightShape`] of the table of lights, and the macro `with_light` that reaches the [`LightSource`] in one by a match.
macro_rules! light_shapes {
    ($d:tt $($(#[$doc:meta])* $variant:ident($light:ty),)*) => {
        /// The geometry of a light.
        #[derive(Clone, Debug)]
        pub enum LightShape {
            $($(#[$doc])* $variant($light),)*
        }

        macro_rules! with_light {
            ($d shape:expr, $d light:ident => $d value:expr) => {
                match $d shape { $($crate::tracer::light::LightShape::$variant($d light) => $d value,)* }
            };
        }
    };
}

light_shapes! {
    $
    /// One triangle of a mesh.
    Triangle(TriangleLight),
    /// A rectangle under an affine map.
    Parallelogram(ParallelogramLight),
    /// A disk.
    Disk(DiskLight),
    /// A sphere.
    Sphere(SphereLight),
    /// A cylinder without its ends.
    Cylinder(CylinderLight),
    /// A point.
    Point(PointLight),
    /// A surface that emits by a texture, or along its normal.
    Textured(Box<TexturedLight>),
    /// A point that emits into a cone.
    Spot(SpotLight),
    /// A point that projects a picture.
    Projector(Box<ProjectorLight>),
    /// Light from one direction, infinitely far away.
    Directional(DirectionalLight),
    /// The same radiance from all around.
    Constant(ConstantLight),
    /// A picture of what is all around.
    Map(EnvironmentMap),
    /// A sky with a sun in it.
    SunSky(SunSkyLight),
}

use with_light;

/// Anything that emits.
#[derive(Clone, Debug)]
pub struct Light {
    /// Its geometry.
    pub shape: LightShape,
    /// Index into the spectra of [`Lights`].
    pub spectrum: u32,
    /// Its own primitives, which never shadow it: one convex surface. (Each triangle of a mesh is a light of its own, which the
    /// others shadow; what emits inwards tests by itself whether it is in its own way.)
    pub prims: PrimRange,
}

impl Light {
    /// True for light that comes from infinitely far, from all around; a scene has at most one.
    #[inline]
    pub fn is_environment(&self) -> bool {
        with_light!(&self.shape, l => l.is_environment())
    }

    /// True when it gives no light whatever its spectrum.
    pub fn is_black(&self) -> bool {
        with_light!(&self.shape, l => l.is_black())
    }
}
