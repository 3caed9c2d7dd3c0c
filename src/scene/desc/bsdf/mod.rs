//! Descriptions of materials: the parameters of Mitsuba's bsdf plugins as plain data, a smooth plugin and its rough form in one file.
//!
//! Each description implements [`BsdfPlugin`], which says which of its parameters others may ask for without knowing the plugin
//! ([`BsdfParts`]): the editor of colours, the effects that simplify a scene, the checks of `twosided`.
//!
//! A new bsdf takes
//!
//! 1. here, a file with its description, the `mod` line of that file and one line of the enum at the end of this file,
//! 2. in `mitsuba/bsdf/`, a file that reads its parameters, the `mod` line of that file and one line of the table there,
//! 3. in `tracer/bsdf/`, how it scatters light: see `src/tracer/bsdf/mod.rs`.

mod bump;
mod classes;
mod coating;
mod conductor;
mod dielectric;
mod diffuse;
mod diffuse_transmitter;
mod mixed;
mod null;
mod parts;
mod phong;
mod plastic;
mod plugin;
mod principled;
mod principled_thin;
mod rough_diffuse;
mod roughness;
mod textures;
mod thin_dielectric;
mod thin_film;
mod two_sided;
mod ward;

use super::ids::BsdfId;
use super::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

pub use bump::BumpDesc;
pub use coating::CoatDesc;
pub use mixed::MOST_PARTS;
pub(crate) use parts::BsdfParts;
use parts::parts;
pub use phong::SHARPEST_PHONG;
pub(crate) use plugin::BsdfPlugin;
pub(crate) use principled::LobeParameter;
pub use principled::{LobeTexture, PrincipledLobes};
pub use roughness::{AlphaTexture, Facets, Roughness};
pub use thin_film::ThinFilmDesc;
pub use ward::WardVariant;

/// Makes the enum of all descriptions, which forwards the methods of [`BsdfPlugin`].
macro_rules! bsdfs {
    ($($(#[$doc:meta])* $kind:ident = $file:ident::$desc:ident,)*) => {
        $(pub use $file::$desc;)*

        /// A material.
        #[derive(Clone, Debug)]
        pub enum BsdfDesc {
            $($(#[$doc])* $kind($desc),)*
        }

        impl BsdfDesc {
            /// Mitsuba's name of the plugin.
            pub fn plugin(&self) -> &'static str {
                match self {
                    $(Self::$kind(_) => $desc::NAME,)*
                }
            }

            /// The parameters by meaning.
            pub(crate) fn parts(&self) -> BsdfParts<&SpectrumTexture, &Spectrum, &Ior> {
                match self {
                    $(Self::$kind(desc) => desc.parts(),)*
                }
            }

            /// The parameters by meaning, mutably.
            pub(crate) fn parts_mut(&mut self) -> BsdfParts<&mut SpectrumTexture, &mut Spectrum, &mut Ior> {
                match self {
                    $(Self::$kind(desc) => desc.parts_mut(),)*
                }
            }

            /// Roughness of the specular part; `None` for a smooth or a diffuse material.
            pub(crate) fn roughness(&self) -> Option<Roughness> {
                match self {
                    $(Self::$kind(desc) => desc.roughness(),)*
                }
            }

            /// True for anisotropic roughness, if only at some points.
            pub(crate) fn is_brushed(&self) -> bool {
                match self {
                    $(Self::$kind(desc) => desc.is_brushed(),)*
                }
            }

            fn scalars(&self) -> Vec<&SpectrumTexture> {
                match self {
                    $(Self::$kind(desc) => desc.scalars(),)*
                }
            }

            /// The textures of scalar parameters, other than those in [`parts`](Self::parts), mutably.
            pub(crate) fn scalars_mut(&mut self) -> Vec<&mut SpectrumTexture> {
                match self {
                    $(Self::$kind(desc) => desc.scalars_mut(),)*
                }
            }

            /// A scalar parameter by its name in Mitsuba, such as `alpha` or `metallic`, if it is constant over the surface.
            pub(crate) fn number(&self, name: &str) -> Option<f32> {
                match self {
                    $(Self::$kind(desc) => desc.number(name),)*
                }
            }

            /// Changes a parameter for which [`number`](Self::number) returns a value.
            pub(crate) fn set_number(&mut self, name: &str, value: f32) {
                match self {
                    $(Self::$kind(desc) => desc.set_number(name, value),)*
                }
            }

            /// The materials nested in this one; none for most.
            pub(crate) fn nested(&self) -> Vec<BsdfId> {
                match self {
                    $(Self::$kind(desc) => desc.nested(),)*
                }
            }

            /// The perturbation of the shading frame, for a normal map or a bump map.
            pub(crate) fn bump(&self) -> Option<&BumpDesc> {
                match self {
                    $(Self::$kind(desc) => desc.bump(),)*
                }
            }

            /// The coat over the nested material, for a coating.
            pub fn coat(&self) -> Option<CoatDesc<'_>> {
                match self {
                    $(Self::$kind(desc) => desc.coat(),)*
                }
            }

            /// True for a diffuse reflector or transmitter that is not Lambert's reflector.
            pub(crate) fn is_other_diffuse(&self) -> bool {
                match self {
                    $(Self::$kind(_) => $desc::OTHER_DIFFUSE,)*
                }
            }

            /// The index of refraction is evaluated at every wavelength; otherwise at the sodium line only.
            fn has_spectral_index(&self) -> bool {
                match self {
                    $(Self::$kind(_) => $desc::SPECTRAL_INDEX,)*
                }
            }
        }

        $(impl From<$desc> for BsdfDesc {
            fn from(desc: $desc) -> Self {
                Self::$kind(desc)
            }
        })*
    };
}

bsdfs! {
    /// Lambert's cosine law.
    Diffuse = diffuse::DiffuseDesc,
    /// Smooth interface between two transparent media.
    Dielectric = dielectric::DielectricDesc,
    /// Smooth metal.
    Conductor = conductor::ConductorDesc,
    /// Rough interface between two transparent media.
    RoughDielectric = dielectric::RoughDielectricDesc,
    /// Rough metal.
    RoughConductor = conductor::RoughConductorDesc,
    /// Smooth transparent coat over a diffuse base.
    Plastic = plastic::PlasticDesc,
    /// Rough transparent coat over a diffuse base.
    RoughPlastic = plastic::RoughPlasticDesc,
    /// Diffuse, metal, glass and coat by one set of parameters.
    Principled = principled::PrincipledDesc,
    /// Leaves, paper and panes by parameters like those of `Principled`.
    PrincipledThin = principled_thin::PrincipledThinDesc,
    /// Matt surface of V-shaped cavities.
    RoughDiffuse = rough_diffuse::RoughDiffuseDesc,
    /// Lobe around the mirror direction over a diffuse part.
    Phong = phong::PhongDesc,
    /// Elliptic lobe over a diffuse part.
    Ward = ward::WardDesc,
    /// Thin sheet that transmits diffusely.
    DiffuseTransmitter = diffuse_transmitter::DiffuseTransmitterDesc,
    /// Thin smooth pane, which refracts nothing.
    ThinDielectric = thin_dielectric::ThinDielectricDesc,
    /// Invisible surface.
    Null = null::NullDesc,
    /// Two materials in a ratio that may vary.
    Blend = mixed::BlendDesc,
    /// Several materials in fixed shares.
    Mixture = mixed::MixtureDesc,
    /// A material with holes.
    Mask = mixed::MaskDesc,
    /// A material with a normal map.
    NormalMap = bump::NormalMapDesc,
    /// A material with a bump map.
    BumpMap = bump::BumpMapDesc,
    /// A material under a smooth transparent layer.
    Coating = coating::CoatingDesc,
    /// A material under a rough transparent layer.
    RoughCoating = coating::RoughCoatingDesc,
    /// Two one-sided materials, one for each side.
    TwoSided = two_sided::TwoSidedDesc,
}
