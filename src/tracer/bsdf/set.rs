//! The macro that makes a set of models: an enum that hands every call on to the model it holds.

/// Makes an enum of models that hands every call on to the model it holds, for paths with these credits of lights, in these media. A set for paths
/// in media has phase functions beside models of surfaces.
macro_rules! bsdf_set {
    (
        $(#[$set_doc:meta])* $set:ident, $credits:ty, $media:ty {
            $($(#[$doc:meta])* $kind:ident,)*
            $(; $(#[$phase_doc:meta])* $phase:ident)?
        }
    ) => {
        $(#[$set_doc])*
        #[derive(Clone, Copy, Debug)]
        #[allow(clippy::large_enum_variant, reason = "a bsdf lives on the stack, where a box would cost an allocation per vertex")]
        pub enum $set {
            $($(#[$doc])* $kind($kind),)*
            $($(#[$phase_doc])* $phase($phase),)?
        }

        $(impl From<$kind> for $set {
            #[inline]
            fn from(bsdf: $kind) -> Self {
                Self::$kind(bsdf)
            }
        })*

        impl Scattering for $set {
            type Credits = $credits;
            type Media = $media;

            #[inline]
            fn of(material: &Material, context: &MaterialEvalContext, lambda: &SampledWavelengths) -> Self {
                match material {
                    $(Material::$kind(material) => material.at(context, lambda).into(),)*
                    #[allow(unreachable_patterns, reason = "the largest set has all models")]
                    _ => Diffuse::new(SampledSpectrum::ZERO).into(),
                }
            }

            $(
                #[inline]
                fn of_phase(phase: $phase) -> Self {
                    Self::$phase(phase)
                }
            )?
        }

        impl ScatteringModel for $set {
            #[inline]
            fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
                match self {
                    $(Self::$kind(bsdf) => bsdf.eval(wo, wi),)*
                    $(Self::$phase(phase) => phase.eval(wo, wi),)?
                }
            }

            #[inline]
            fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
                match self {
                    $(Self::$kind(bsdf) => bsdf.sample(wo, u, lobe),)*
                    $(Self::$phase(phase) => phase.sample(wo, u, lobe),)?
                }
            }

            #[inline]
            fn sample_from_light(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
                match self {
                    $(Self::$kind(bsdf) => bsdf.sample_from_light(wo, u, lobe),)*
                    $(Self::$phase(phase) => phase.sample_from_light(wo, u, lobe),)?
                }
            }

            #[inline]
            fn pdf_from_light(&self, wo: Vec3, wi: Vec3) -> f32 {
                match self {
                    $(Self::$kind(bsdf) => bsdf.pdf_from_light(wo, wi),)*
                    $(Self::$phase(phase) => phase.pdf_from_light(wo, wi),)?
                }
            }

            #[inline]
            fn projected_area(&self, d: Vec3) -> f32 {
                match self {
                    $(Self::$kind(bsdf) => bsdf.projected_area(d),)*
                    $(Self::$phase(phase) => phase.projected_area(d),)?
                }
            }

            #[inline]
            fn as_diffuse(&self) -> Option<&Diffuse> {
                match self {
                    $(Self::$kind(bsdf) => bsdf.as_diffuse(),)*
                    $(Self::$phase(phase) => phase.as_diffuse(),)?
                }
            }

            #[inline]
            fn has_diffuse_part(&self) -> bool {
                match self {
                    $(Self::$kind(bsdf) => bsdf.has_diffuse_part(),)*
                    $(Self::$phase(phase) => phase.has_diffuse_part(),)?
                }
            }

            #[inline]
            fn is_delta(&self) -> bool {
                match self {
                    $(Self::$kind(bsdf) => bsdf.is_delta(),)*
                    $(Self::$phase(phase) => phase.is_delta(),)?
                }
            }

            #[inline]
            fn is_glossy(&self) -> bool {
                match self {
                    $(Self::$kind(bsdf) => bsdf.is_glossy(),)*
                    $(Self::$phase(phase) => phase.is_glossy(),)?
                }
            }

            #[inline]
            fn transmits(&self) -> bool {
                match self {
                    $(Self::$kind(bsdf) => bsdf.transmits(),)*
                    $(Self::$phase(phase) => phase.transmits(),)?
                }
            }

            #[inline]
            fn is_dispersive(&self) -> bool {
                match self {
                    $(Self::$kind(bsdf) => bsdf.is_dispersive(),)*
                    $(Self::$phase(phase) => phase.is_dispersive(),)?
                }
            }

            #[inline]
            fn dispersion(&self, wo: Vec3, wi: Vec3) -> Dispersion {
                match self {
                    $(Self::$kind(bsdf) => bsdf.dispersion(wo, wi),)*
                    $(Self::$phase(phase) => phase.dispersion(wo, wi),)?
                }
            }

            #[inline]
            fn delta_lobes(&self, wo: Vec3) -> DeltaLobes {
                match self {
                    $(Self::$kind(bsdf) => bsdf.delta_lobes(wo),)*
                    $(Self::$phase(phase) => phase.delta_lobes(wo),)?
                }
            }

            #[inline]
            fn delta_lobe(&self, wo: Vec3, lobe: f32, transmitted: bool) -> f32 {
                match self {
                    $(Self::$kind(bsdf) => bsdf.delta_lobe(wo, lobe, transmitted),)*
                    $(Self::$phase(phase) => phase.delta_lobe(wo, lobe, transmitted),)?
                }
            }

            #[inline]
            fn refract(&self, wo: Vec3, lane: usize) -> Option<(Vec3, f32)> {
                match self {
                    $(Self::$kind(bsdf) => bsdf.refract(wo, lane),)*
                    $(Self::$phase(phase) => phase.refract(wo, lane),)?
                }
            }
        }
    };
}

pub(super) use bsdf_set;
