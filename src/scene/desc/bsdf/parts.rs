//! What others may ask of a bsdf without knowing the plugin.

/// The parameters of a bsdf by what they mean, in whichever plugin: references to textures, spectra and indices, shared or mutable.
pub(crate) struct BsdfParts<T, S, I> {
    /// Albedo of the diffuse part.
    pub(crate) albedo: Option<T>,
    /// Factor on specular reflection.
    pub(crate) reflection: Option<T>,
    /// Factor on specular transmission.
    pub(crate) transmission: Option<T>,
    /// Real part of the index of refraction of a metal.
    pub(crate) eta: Option<S>,
    /// Imaginary part of the same.
    pub(crate) k: Option<S>,
    /// What a coat absorbs on a length of 1, without bound.
    pub(crate) absorption: Option<T>,
    /// Index of refraction behind the surface, or of a coat.
    pub(crate) int_ior: Option<I>,
    /// Index of refraction in front of the surface.
    pub(crate) ext_ior: Option<I>,
    /// Share of one of the materials that this one is made of, one number for all wavelengths: an opacity, the weight of a blend.
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

/// Writes [`BsdfPlugin::parts`] and [`BsdfPlugin::parts_mut`]: which field is which part.
macro_rules! parts {
    ($($part:ident: $field:ident),* $(,)?) => {
        fn parts(&self) -> crate::scene::desc::bsdf::BsdfParts<&crate::scene::desc::texture::SpectrumTexture, &Spectrum, &Ior> {
            crate::scene::desc::bsdf::BsdfParts { $($part: Some(&self.$field),)* ..Default::default() }
        }

        fn parts_mut(&mut self) -> crate::scene::desc::bsdf::BsdfParts<&mut crate::scene::desc::texture::SpectrumTexture, &mut Spectrum, &mut Ior> {
            crate::scene::desc::bsdf::BsdfParts { $($part: Some(&mut self.$field),)* ..Default::default() }
        }
    };
}
pub(super) use parts;
