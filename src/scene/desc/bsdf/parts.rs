//! The parameters of a bsdf by meaning, whatever the plugin.

/// References to the parameters of a bsdf by meaning: textures, spectra and indices of refraction, shared or mutable.
pub(crate) struct BsdfParts<T, S, I> {
    /// Albedo of the diffuse part.
    pub(crate) albedo: Option<T>,
    /// Factor on specular reflection.
    pub(crate) reflection: Option<T>,
    /// Factor on specular transmission.
    pub(crate) transmission: Option<T>,
    /// Real part of the index of refraction of a metal.
    pub(crate) eta: Option<S>,
    /// Imaginary part of the index of refraction of a metal.
    pub(crate) k: Option<S>,
    /// Absorption coefficient of a coat, unbounded.
    pub(crate) absorption: Option<T>,
    /// Index of refraction behind the surface, or of a coat.
    pub(crate) int_ior: Option<I>,
    /// Index of refraction in front of the surface.
    pub(crate) ext_ior: Option<I>,
    /// Share of one of the nested materials, the same at all wavelengths: an opacity, or the weight of a blend.
    pub(crate) share: Option<T>,
}

impl<T, S, I> Default for BsdfParts<T, S, I> {
    fn default() -> Self {
        Self {
            albedo: None,
            reflection: None,
            transmission: None,
            eta: None,
            k: None,
            absorption: None,
            int_ior: None,
            ext_ior: None,
            share: None,
        }
    }
}

/// Implements [`BsdfPlugin::parts`] and [`BsdfPlugin::parts_mut`] by the fields that are the parts.
macro_rules! parts {
    ($($part:ident: $field:ident),* $(,)?) => {
        fn parts(
            &self,
        ) -> crate::scene::desc::BsdfParts<
            &crate::scene::desc::texture::SpectrumTexture,
            &crate::spectrum::Spectrum,
            &crate::spectrum::dispersion::Ior,
        > {
            crate::scene::desc::BsdfParts { $($part: Some(&self.$field),)* ..Default::default() }
        }

        fn parts_mut(
            &mut self,
        ) -> crate::scene::desc::BsdfParts<
            &mut crate::scene::desc::texture::SpectrumTexture,
            &mut crate::spectrum::Spectrum,
            &mut crate::spectrum::dispersion::Ior,
        > {
            crate::scene::desc::BsdfParts { $($part: Some(&mut self.$field),)* ..Default::default() }
        }
    };
}
pub(super) use parts;
