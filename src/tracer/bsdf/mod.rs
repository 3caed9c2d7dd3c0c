//! Scattering at a surface point, at the wavelengths of one path.
//!
//! A [`Material`] says what a surface is made of, before the wavelengths of a path are known. A [`Bsdf`] is a material at one point and
//! at the wavelengths of one path. Both are enums that the table below and `set.rs` make from one file per model of scattering. Paths call them
//! through the traits of `scattering.rs`. [`microfacet`] and [`fresnel`] hold what several models share, and [`Sides`] says which
//! material a surface shows to which side. A [`Mixture`] is made of several of the others; it is several times as large, so that
//! scenes without one are traced by code that knows [`Unmixed`] models only.
//!
//! # Conventions
//!
//! Directions are unit vectors in the local shading space, z the front; `wo` points to where the path came from, `wi` to where it goes
//! on, both away from the surface. Values **include the cosine** of `wi`: [`ScatteringModel::eval`] is f·|cos θᵢ|, the weight of a sample
//! is f·|cos θᵢ| / pdf. Radiance is carried from light to eye, so that transmission scales by (nₒ/nᵢ)². Delta materials evaluate to
//! `None` and can only be sampled. A material that mixes a delta with another lobe evaluates only that lobe; its density
//! includes the probability of choosing the lobe. `None` from `sample` ends the path.
//!
//! # Adding a bsdf
//!
//! A bsdf is one file and one line in a table three times: its description, how that is read, and how it scatters light. For a model
//! called `Velvet`:
//!
//! 1. **Description**: `src/scene/desc/bsdf/velvet.rs` holds `VelvetDesc`, the parameters as plain data. Implement `BsdfPlugin` for it: the
//!    plugin's name, under `parts!` which parameters are an albedo, a factor, an index, `roughness` if a
//!    specular part is rough, and under `scalars` the textures that numbers are read from.
//!    [`material_class`](crate::tracer::effects::material_class) follows from these: a scene whose materials have an
//!    albedo alone is traced by code that knows [`Diffuse`] only, and one without a rough part by code that knows [`Smooth`] only.
//!    A diffuse model other than Lambert's says so by `OTHER_DIFFUSE` and is traced by code for all models. With that, colours
//!    and indices can be edited, and the plan of effects knows whether the scene needs wavelengths, dispersion, deltas and so on.
//!    Add the `mod` line and a line to the table in `src/scene/desc/bsdf/mod.rs`.
//! 2. **Reader**: `src/scene/mitsuba/bsdf/velvet.rs` reads the parameters. Add the `mod` line and a line to the table in `mod.rs`
//!    beside it, and what is special about the plugin to `tools/make/plugins/notes.rs`; `tools/plugins` writes its row in
//!    `scenes/README.md`.
//! 3. **Model**: `src/tracer/bsdf/velvet.rs` holds `VelvetMaterial`, made by `From<VelvetDesc>` (tables, integrals: whatever does not
//!    depend on the path; a type alias of the description if there is nothing to prepare), and `Velvet`, the material at the
//!    wavelengths of a path. Implement [`MaterialModel`] for the first and [`ScatteringModel`] for the second, whose flags
//!    (`is_delta`, `is_glossy`, `transmits` and so on) are false unless you say otherwise; one with deltas names them in `delta_lobes`, if it can. Add the `mod` line and a
//!    line to the table below: under `smooth` if the model has no rough part, else under `rough`.
//! 4. **Contract**: `sample` chooses directions with exactly the density that `eval` states, over all of its random numbers; its weight
//!    is `eval`'s value over that density. `eval` and `sample` agree on which lobe exists. Nothing but black, `None` or finite
//!    numbers leaves either. Where the model is reciprocal, f(wo, wi)/nᵢ² = f(wi, wo)/nₒ². No more light leaves than arrives.
//! 5. **Tests**: add the model to each of these lists by hand. `materials()` in `tests/tracer/bsdf.rs` (chi² of `sample` against `eval`'s density,
//!    weights against values, reciprocity, energy, grazing and normal directions); the generator of random scenes in
//!    `tests/tracer/effects_check.rs`; the furnaces of `tests/agreement/furnace.rs` and the agreement of all methods in
//!    `tests/agreement/meshes.rs`; the plugin's defaults and faults in `tests/scene`; a scene of it, `scenes/plugins/bsdf_velvet.xml`,
//!    that agrees with Mitsuba (`tools/compare_mitsuba`), and its golden picture (`tools/golden bsdf_velvet`).
//!
//! [`Diffuse`] with `DiffuseDesc` is the shortest example, [`RoughPlastic`] one with a table made ahead. The smooth and the rough form
//! of one material stand in one file.

mod bump;
mod coating;
mod conductor;
mod dielectric;
mod diffuse;
mod diffuse_transmitter;
pub mod fresnel;
mod lobe;
pub mod microfacet;
mod mixture;
mod phong;
mod plastic;
mod principled;
mod principled_thin;
mod rough_diffuse;
mod scattering;
mod set;
mod share;
mod thin;
mod thin_film;
mod two_sided;
mod ward;

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::scene::desc::BsdfDesc;
use crate::scene::desc::texture::TexturePoint;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::light_groups::GroupCredits;
use crate::tracer::wavelength_mis::Dispersion;

pub use bump::{BumpMaterial, Mirrors};
pub use coating::{Coating, CoatingMaterial};
pub use lobe::{Lobe, LobeOverDiffuse};
pub use microfacet::Microfacet;
pub use mixture::{MaterialPart, Mixture, MixtureMaterial, PartCoat};
pub use phong::PhongLobe;
pub use plastic::{Base, Coat, Transmittance, internal_reflectance};
pub use scattering::{
    BsdfSample, DeltaLobes, MaterialEvalContext, MaterialModel, Scattering, ScatteringModel,
};
use set::bsdf_set;
pub use share::SurfaceShare;
pub use thin_film::ThinFilm;
pub use two_sided::Sides;
pub use ward::WardLobe;

/// Makes [`Material`], [`Bsdf`], [`CreditedBsdf`], [`Unmixed`] and [`Smooth`] from the models: `Model: file::Material`.
macro_rules! bsdfs {
    (
        smooth { $($(#[$smooth_doc:meta])* $smooth:ident: $smooth_file:ident::$smooth_material:ident,)* }
        rough { $($(#[$rough_doc:meta])* $rough:ident: $rough_file:ident::$rough_material:ident,)* }
    ) => {
        $(pub use $smooth_file::{$smooth, $smooth_material};)*
        $(pub use $rough_file::{$rough, $rough_material};)*

        /// A one-sided material. Two-sidedness is a pair of these per surface, see [`Sides`].
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
            Bsdf, () {
                $($(#[$smooth_doc])* $smooth,)*
                $($(#[$rough_doc])* $rough,)*
                /// Several of the others.
                Mixture,
            }
        }

        bsdf_set! {
            /// Every model of scattering, for paths that tell which [group of lights](crate::tracer::light_groups) their light comes from.
            CreditedBsdf, GroupCredits {
                $($(#[$smooth_doc])* $smooth,)*
                $($(#[$rough_doc])* $rough,)*
                /// Several of the others.
                Mixture,
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

        bsdf_set! {
            /// Every model but mixtures, which are several times as large.
            Unmixed, () {
                $($(#[$smooth_doc])* $smooth,)*
                $($(#[$rough_doc])* $rough,)*
            }
        }

        bsdf_set! {
            /// The models without rough parts: what most scenes of mirrors and glass are made of.
            Smooth, () { $($(#[$smooth_doc])* $smooth,)* }
        }
    };
}

bsdfs! {
    smooth {
        /// Lambert's cosine law.
        Diffuse: diffuse::DiffuseMaterial,
        /// Smooth interface between two transparent media.
        Dielectric: dielectric::DielectricMaterial,
        /// Smooth metal.
        Conductor: conductor::ConductorMaterial,
        /// Smooth coat over a diffuse base.
        Plastic: plastic::PlasticMaterial,
        /// Smooth pane that light passes straight.
        ThinDielectric: thin::ThinDielectricMaterial,
    }
    rough {
        /// Rough metal.
        RoughConductor: conductor::RoughConductorMaterial,
        /// Rough interface between two transparent media.
        RoughDielectric: dielectric::RoughDielectricMaterial,
        /// Rough coat over a diffuse base.
        RoughPlastic: plastic::RoughPlasticMaterial,
        /// Diffuse, metal, glass and coat by one set of parameters.
        Principled: principled::PrincipledMaterial,
        /// Leaves, paper and panes by parameters like those of `Principled`.
        PrincipledThin: principled_thin::PrincipledThinMaterial,
        /// Matt surface of V-shaped cavities.
        RoughDiffuse: rough_diffuse::RoughDiffuseMaterial,
        /// Lobe around the mirror direction over a diffuse part.
        Phong: phong::PhongMaterial,
        /// Elliptic lobe over a diffuse part.
        Ward: ward::WardMaterial,
        /// Sheet that spreads light to its other side.
        DiffuseTransmitter: diffuse_transmitter::DiffuseTransmitterMaterial,
    }
}
