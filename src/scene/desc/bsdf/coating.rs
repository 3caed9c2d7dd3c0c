//! `coating` and `roughcoating` of version 0.6: a layer of a transparent medium over any other material.

use glam::Vec4;

use super::{BsdfPlugin, Roughness, parts};
use crate::scene::desc::ids::BsdfId;
use crate::scene::desc::texture::SpectrumTexture;
use crate::spectrum::dispersion::SODIUM_D;
use crate::spectrum::{Spectrum, dispersion::Ior};

/// A smooth or rough coat as the tracer uses it.
#[derive(Clone, Copy, Debug)]
pub struct CoatDesc<'a> {
    /// The material under the coat.
    pub bsdf: BsdfId,
    /// Index of the coat over that of the outside, at the sodium line.
    pub eta: f32,
    /// Thickness of the coat, in the units of 1 / `sigma_a`.
    pub thickness: f32,
    /// Absorption coefficient of the coat, unbounded.
    pub sigma_a: &'a SpectrumTexture,
    /// Factor on the reflection of the coat, 1 in nature.
    pub specular_reflectance: &'a SpectrumTexture,
    /// Its microfacets; `None` for a smooth one.
    pub roughness: Option<Roughness>,
}

/// A smooth coat over another material.
#[derive(Clone, Debug)]
pub struct CoatingDesc {
    /// The material under the coat.
    pub bsdf: BsdfId,
    /// Index of the coat; its value at the sodium line counts for all wavelengths.
    pub int_ior: Ior,
    /// Index outside; its value at the sodium line counts for all wavelengths.
    pub ext_ior: Ior,
    /// Thickness of the coat, in the units of 1 / `sigma_a`.
    pub thickness: f32,
    /// Absorption coefficient of the coat, unbounded.
    pub sigma_a: SpectrumTexture,
    /// Factor on the reflection of the coat, 1 in nature.
    pub specular_reflectance: SpectrumTexture,
}

impl CoatingDesc {
    fn coat_of(&self, roughness: Option<Roughness>) -> CoatDesc<'_> {
        let at_sodium = |ior: &Ior| ior.eval(Vec4::splat(SODIUM_D)).x;
        CoatDesc {
            bsdf: self.bsdf,
            eta: at_sodium(&self.int_ior) / at_sodium(&self.ext_ior),
            thickness: self.thickness,
            sigma_a: &self.sigma_a,
            specular_reflectance: &self.specular_reflectance,
            roughness,
        }
    }
}

impl BsdfPlugin for CoatingDesc {
    const NAME: &'static str = "coating";
    const SPECTRAL_INDEX: bool = false;

    parts! {
        reflection: specular_reflectance,
        absorption: sigma_a,
        int_ior: int_ior,
        ext_ior: ext_ior,
    }

    fn number(&self, name: &str) -> Option<f32> {
        (name == "thickness").then_some(self.thickness)
    }

    fn set_number(&mut self, _name: &str, value: f32) {
        self.thickness = value;
    }

    fn nested(&self) -> Vec<BsdfId> {
        vec![self.bsdf]
    }

    fn coat(&self) -> Option<CoatDesc<'_>> {
        Some(self.coat_of(None))
    }
}

/// A rough coat over another material.
#[derive(Clone, Debug)]
pub struct RoughCoatingDesc {
    /// The parameters that it shares with a smooth one.
    pub coating: CoatingDesc,
    /// Microfacets of the coat, the same along both tangents.
    pub roughness: Roughness,
}

impl BsdfPlugin for RoughCoatingDesc {
    const NAME: &'static str = "roughcoating";
    const SPECTRAL_INDEX: bool = false;

    fn parts(&self) -> super::BsdfParts<&SpectrumTexture, &Spectrum, &Ior> {
        self.coating.parts()
    }

    fn parts_mut(&mut self) -> super::BsdfParts<&mut SpectrumTexture, &mut Spectrum, &mut Ior> {
        self.coating.parts_mut()
    }

    fn roughness(&self) -> Option<Roughness> {
        Some(self.roughness)
    }

    fn number(&self, name: &str) -> Option<f32> {
        self.coating.number(name).or_else(|| self.roughness.number(name))
    }

    fn set_number(&mut self, name: &str, value: f32) {
        match name {
            "thickness" => self.coating.set_number(name, value),
            _ => self.roughness.set_number(name, value),
        }
    }

    fn nested(&self) -> Vec<BsdfId> {
        self.coating.nested()
    }

    fn coat(&self) -> Option<CoatDesc<'_>> {
        Some(self.coating.coat_of(Some(self.roughness)))
    }
}
