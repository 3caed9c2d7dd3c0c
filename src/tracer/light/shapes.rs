//! The sorts of lights, and a light of one of them.

use crate::tracer::accel::PrimRange;

use super::cylinder::CylinderLight;
use super::directional::DirectionalLight;
use super::environment::{ConstantLight, EnvironmentMap};
use super::flat::{DiskLight, ParallelogramLight, TriangleLight};
use super::point::PointLight;
use super::projector::ProjectorLight;
use super::source::LightSource;
use super::sphere::SphereLight;
use super::spot::SpotLight;
use super::sun_sky::SunSkyLight;
use super::textured::TexturedLight;

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

pub(super) use with_light;

/// Anything that emits.
#[derive(Clone, Debug)]
pub struct Light {
    /// Its geometry.
    pub shape: LightShape,
    /// Index into the spectra of [`Lights`](super::Lights).
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
