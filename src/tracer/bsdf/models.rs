//! The models of scattering, and the sets of them that code is compiled for.

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::scene::desc::BsdfDesc;
use crate::scene::desc::texture::TexturePoint;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::light_groups::{GroupCredits, LightCredits};
use crate::tracer::medium::{MediumSides, PathMedia, PhaseFunction};
use crate::tracer::record::{PathEvent, record};
use crate::tracer::wavelength_mis::Dispersion;

use super::mixture::{Mixture, MixtureMaterial};
use super::scattering::{BsdfSample, DeltaLobes, MaterialEvalContext, MaterialModel, ScatteringModel};
use super::set::bsdf_set;

/// A set of models that covers the materials of a scene. Integrators are generic over it, so that the code for a scene of diffuse
/// surfaces contains no mirrors, glass or rough metal.
///
/// Speed of the code for the smallest set over that of the code for all, same program, 95 % over random orders of its functions
/// (`tools/bench effects`), and instructions per path:
///
/// | scene | code for | path tracing | | bidirectional |
/// |---|---|---|---|---|
/// | Cornell box | [`Diffuse`] | 1.069 [1.064, 1.073] | 28 800, not 30 900 | 1.097 [1.074, 1.121] |
/// | lit from a cove | [`Diffuse`] | | | 1.064 [1.035, 1.094] |
/// | with mirror and glass balls | [`Smooth`] | 1.056 [1.048, 1.064] | 32 200, not 33 100 | 1.033 [1.024, 1.041] |
pub trait Scattering: ScatteringModel + From<Diffuse> {
    /// Whether a path [records](crate::tracer::record) what it does.
    const RECORDS: bool = false;

    /// The radiance of a path by [groups of lights](crate::tracer::light_groups).
    type Credits: LightCredits;

    /// The media at a vertex of a path; `()` in a set for scenes without media.
    type Media: PathMedia;

    /// Records what the path does, if it records anything.
    #[inline(always)]
    fn record(event: impl FnOnce() -> PathEvent) {
        if Self::RECORDS {
            record(event());
        }
    }

    /// The material at a point and the wavelengths of a path. A material whose model is not in the set is black.
    fn of(material: &Material, context: &MaterialEvalContext, lambda: &SampledWavelengths) -> Self;

    /// The scattering of a medium, of sets for scenes with [`media`](Self::Media); of others, which never ask for it, black.
    #[inline]
    fn of_phase(_: PhaseFunction) -> Self {
        Diffuse::new(SampledSpectrum::ZERO).into()
    }
}

impl Scattering for Diffuse {
    type Credits = ();
    type Media = ();

    #[inline]
    fn of(material: &Material, context: &MaterialEvalContext, lambda: &SampledWavelengths) -> Self {
        match material {
            Material::Diffuse(material) => material.at(context, lambda),
            _ => Diffuse::new(SampledSpectrum::ZERO),
        }
    }
}

/// Makes [`Material`], [`Bsdf`], [`CreditedBsdf`], [`InMedia`], [`Unmixed`] and [`Smooth`] from the models: `Model: super::file::Material`.
macro_rules! bsdfs {
    (
        smooth { $($(#[$smooth_doc:meta])* $smooth:ident: super::$smooth_file:ident::$smooth_material:ident,)* }
        rough { $($(#[$rough_doc:meta])* $rough:ident: super::$rough_file:ident::$rough_material:ident,)* }
    ) => {
        $(pub use super::$smooth_file::{$smooth, $smooth_material};)*
        $(pub use super::$rough_file::{$rough, $rough_material};)*

        /// A one-sided material. Two-sidedness is a pair of these per surface, see [`Sides`](super::Sides).
        #[derive(Clone, Debug)]
        pub enum Material {
            $($(#[$smooth_doc])* $smooth($smooth_material),)*
            $($(#[$rough_doc])* $rough($rough_material),)*
            /// Several of the others.
            Mixture(MixtureMaterial),
        }

        impl Material {
            /// Prepares a description; `None` for one that is made of others, or of nothing.
            pub fn new(desc: &BsdfDesc) -> Option<Self> {
                Some(match desc.clone() {
                    $(BsdfDesc::$smooth(desc) => Self::$smooth(desc.into()),)*
                    $(BsdfDesc::$rough(desc) => Self::$rough(desc.into()),)*
                    BsdfDesc::Blend(_)
                    | BsdfDesc::BumpMap(_)
                    | BsdfDesc::Coating(_)
                    | BsdfDesc::Mask(_)
                    | BsdfDesc::Mixture(_)
                    | BsdfDesc::NormalMap(_)
                    | BsdfDesc::Null(_)
                    | BsdfDesc::RoughCoating(_)
                    | BsdfDesc::TwoSided(_) => return None,
                })
            }

            /// The material at a point and the wavelengths of a path, whatever its model.
            #[inline]
            pub fn bsdf(&self, context: &MaterialEvalContext, lambda: &SampledWavelengths) -> Bsdf {
                Bsdf::of(self, context, lambda)
            }

            /// Its colour in a layer beside the picture ([`MaterialModel::diffuse_reflectance`]), seen from `wo`.
            pub fn diffuse_reflectance(&self, at: &TexturePoint, lambda: &SampledWavelengths, wo: Vec3) -> SampledSpectrum {
                match self {
                    $(Self::$smooth(material) => material.diffuse_reflectance(at, lambda, wo),)*
                    $(Self::$rough(material) => material.diffuse_reflectance(at, lambda, wo),)*
                    Self::Mixture(material) => material.diffuse_reflectance(at, lambda, wo),
                }
            }
        }

        bsdf_set! {
            /// Every model of scattering.
            Bsdf, (), () {
                $($(#[$smooth_doc])* $smooth,)*
                $($(#[$rough_doc])* $rough,)*
                /// Several of the others.
                Mixture,
            }
        }

        bsdf_set! {
            /// Every model of scattering, for paths that tell which [group of lights](crate::tracer::light_groups) their light comes from.
            CreditedBsdf, GroupCredits, MediumSides {
                $($(#[$smooth_doc])* $smooth,)*
                $($(#[$rough_doc])* $rough,)*
                /// Several of the others.
                Mixture,
                ;
                /// The phase function of a medium.
                PhaseFunction
            }
        }

        bsdf_set! {
            /// Every model of scattering, for paths through [media](crate::tracer::medium).
            InMedia, (), MediumSides {
                $($(#[$smooth_doc])* $smooth,)*
                $($(#[$rough_doc])* $rough,)*
                /// Several of the others.
                Mixture,
                ;
                /// The phase function of a medium.
                PhaseFunction
            }
        }

        impl From<Unmixed> for Bsdf {
            #[inline]
            fn from(bsdf: Unmixed) -> Self {
                match bsdf {
                    $(Unmixed::$smooth(bsdf) => Self::$smooth(bsdf),)*
                    $(Unmixed::$rough(bsdf) => Self::$rough(bsdf),)*
                }
            }
        }

        impl From<Unmixed> for CreditedBsdf {
            #[inline]
            fn from(bsdf: Unmixed) -> Self {
                match bsdf {
                    $(Unmixed::$smooth(bsdf) => Self::$smooth(bsdf),)*
                    $(Unmixed::$rough(bsdf) => Self::$rough(bsdf),)*
                }
            }
        }

        impl From<Unmixed> for InMedia {
            #[inline]
            fn from(bsdf: Unmixed) -> Self {
                match bsdf {
                    $(Unmixed::$smooth(bsdf) => Self::$smooth(bsdf),)*
                    $(Unmixed::$rough(bsdf) => Self::$rough(bsdf),)*
                }
            }
        }

        bsdf_set! {
            /// Every model but mixtures, which are several times as large.
            Unmixed, (), () {
                $($(#[$smooth_doc])* $smooth,)*
                $($(#[$rough_doc])* $rough,)*
            }
        }

        bsdf_set! {
            /// The models without rough parts: what most scenes of mirrors and glass are made of.
            Smooth, (), () { $($(#[$smooth_doc])* $smooth,)* }
        }
    };
}

bsdfs! {
    smooth {
        /// Lambert's cosine law.
        Diffuse: super::diffuse::DiffuseMaterial,
        /// Smooth interface between two transparent media.
        Dielectric: super::dielectric::DielectricMaterial,
        /// Smooth metal.
        Conductor: super::conductor::ConductorMaterial,
        /// Smooth coat over a diffuse base.
        Plastic: super::plastic::PlasticMaterial,
        /// Smooth pane that light passes straight.
        ThinDielectric: super::thin::ThinDielectricMaterial,
    }
    rough {
        /// Rough metal.
        RoughConductor: super::conductor::RoughConductorMaterial,
        /// Rough interface between two transparent media.
        RoughDielectric: super::dielectric::RoughDielectricMaterial,
        /// Rough coat over a diffuse base.
        RoughPlastic: super::plastic::RoughPlasticMaterial,
        /// Diffuse, metal, glass and coat by one set of parameters.
        Principled: super::principled::PrincipledMaterial,
        /// Leaves, paper and panes by parameters like those of `Principled`.
        PrincipledThin: super::principled_thin::PrincipledThinMaterial,
        /// Matt surface of V-shaped cavities.
        RoughDiffuse: super::rough_diffuse::RoughDiffuseMaterial,
        /// Lobe around the mirror direction over a diffuse part.
        Phong: super::phong::PhongMaterial,
        /// Elliptic lobe over a diffuse part.
        Ward: super::ward::WardMaterial,
        /// Sheet that spreads light to its other side.
        DiffuseTransmitter: super::diffuse_transmitter::DiffuseTransmitterMaterial,
    }
}
