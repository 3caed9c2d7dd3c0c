//! Forcing a feature off: the description that is left without it.
//!
//! What depends on the feature is left out of the light transport, so that the picture is another one; who asks for it says so in
//! the picture's file.

use std::sync::Arc;

use glam::Vec4;

use crate::scene::desc::{BsdfDesc, IntegratorKind, LightDesc, SceneDesc};
use crate::spectrum::Spectrum;
use crate::spectrum::dispersion::{Ior, SODIUM_D};

use super::Feature;

/// Takes `feature` out of `desc`:
///
/// | feature | what is left |
/// |---|---|
/// | wavelengths | greys as light as the colours are under D65, lights of their luminance; indices at the sodium line |
/// | dispersion | indices at the sodium line |
/// | transmission | glass that reflects and lets nothing through |
/// | deltas | black mirrors and clear glass; smooth coats without shine |
/// | glossy | the same of rough ones |
/// | environment | lights in the scene only |
/// | lens | a pinhole |
/// | caustic-photons | photon mapping without what mirrors and glass focus |
/// | gather | photon mapping without light that was spread before |
///
/// # Errors
///
/// As [`refusal`].
pub fn without(desc: &mut SceneDesc, feature: Feature) -> Result<(), &'static str> {
    if let Some(advice) = refusal(feature, desc.integrator.kind) {
        return Err(advice);
    }
    match feature {
        // Refused.
        Feature::LightStream | Feature::LightChoice => (),
        Feature::Wavelengths => grey(desc),
        Feature::Dispersion => desc.bsdfs.iter_mut().for_each(|bsdf| each_index(bsdf, at_sodium)),
        Feature::Transmission => desc.bsdfs.iter_mut().for_each(|bsdf| match bsdf {
            BsdfDesc::Dielectric { specular_transmittance, .. }
            | BsdfDesc::RoughDielectric { specular_transmittance, .. } => {
                *specular_transmittance = Spectrum::Constant(0.0);
            }
            _ => (),
        }),
        Feature::Deltas => desc.bsdfs.iter_mut().for_each(|bsdf| match bsdf {
            BsdfDesc::Dielectric { .. } | BsdfDesc::Conductor { .. } => *bsdf = BLACK,
            BsdfDesc::Plastic { diffuse_reflectance, .. } => *bsdf = matt(diffuse_reflectance),
            _ => (),
        }),
        Feature::Glossy => desc.bsdfs.iter_mut().for_each(|bsdf| match bsdf {
            BsdfDesc::RoughDielectric { .. } | BsdfDesc::RoughConductor { .. } => *bsdf = BLACK,
            BsdfDesc::RoughPlastic { diffuse_reflectance, .. } => *bsdf = matt(diffuse_reflectance),
            _ => (),
        }),
        Feature::Environment => {
            let keep: Vec<bool> = desc.lights.iter().map(|light| !light.is_environment()).collect();
            retain(&mut desc.lights, &keep);
            retain(&mut desc.names.lights, &keep);
        }
        Feature::Lens => desc.camera.aperture_radius = 0.0,
        Feature::CausticPhotons => desc.integrator.photons.caustics = false,
        Feature::Gather => desc.integrator.photons.gather = false,
    }
    Ok(())
}

/// Why a feature cannot be left out of what is traced by `kind`: a sentence that says what to do instead.
pub fn refusal(feature: Feature, kind: IntegratorKind) -> Option<&'static str> {
    match feature {
        Feature::LightStream => {
            Some("which streams there are is the method's: choose --integrator path or light")
        }
        Feature::LightChoice => {
            Some("a light is chosen where there are several: leave the others out of the scene")
        }
        Feature::CausticPhotons | Feature::Gather if kind != IntegratorKind::Photon => {
            Some("only photon mapping has photons: choose --integrator photon")
        }
        _ => None,
    }
}

/// What sends nothing back.
const BLACK: BsdfDesc = BsdfDesc::Diffuse { reflectance: Spectrum::Constant(0.0) };

fn matt(reflectance: &Spectrum) -> BsdfDesc {
    BsdfDesc::Diffuse { reflectance: reflectance.clone() }
}

/// Keeps the entries whose `keep` is true; those beyond it too.
fn retain<T>(list: &mut Vec<T>, keep: &[bool]) {
    let mut keep = keep.iter();
    list.retain(|_| keep.next().copied().unwrap_or(true));
}

fn at_sodium(ior: &mut Ior) {
    *ior = Ior::Constant(ior.eval(Vec4::splat(SODIUM_D)).x);
}

fn each_index(bsdf: &mut BsdfDesc, change: fn(&mut Ior)) {
    match bsdf {
        BsdfDesc::Dielectric { int_ior, ext_ior, .. }
        | BsdfDesc::RoughDielectric { int_ior, ext_ior, .. }
        | BsdfDesc::Plastic { int_ior, ext_ior, .. }
        | BsdfDesc::RoughPlastic { int_ior, ext_ior, .. } => [int_ior, ext_ior].into_iter().for_each(change),
        _ => (),
    }
}

/// Leaves no colour.
fn grey(desc: &mut SceneDesc) {
    for bsdf in &mut desc.bsdfs {
        each_index(bsdf, at_sodium);
        match bsdf {
            BsdfDesc::Diffuse { reflectance } => reflected(reflectance),
            BsdfDesc::Dielectric { specular_reflectance: r, specular_transmittance: t, .. }
            | BsdfDesc::RoughDielectric { specular_reflectance: r, specular_transmittance: t, .. } => {
                [r, t].into_iter().for_each(reflected);
            }
            BsdfDesc::Conductor { eta, k, specular_reflectance: r }
            | BsdfDesc::RoughConductor { eta, k, specular_reflectance: r, .. } => {
                [eta, k].into_iter().for_each(|index| {
                    *index = Spectrum::Constant(index.eval(Vec4::splat(SODIUM_D)).x);
                });
                reflected(r);
            }
            BsdfDesc::Plastic { diffuse_reflectance: d, specular_reflectance: r, .. }
            | BsdfDesc::RoughPlastic { diffuse_reflectance: d, specular_reflectance: r, .. } => {
                [d, r].into_iter().for_each(reflected);
            }
            BsdfDesc::TwoSided { .. } => (),
        }
    }
    desc.shapes.iter_mut().filter_map(|shape| shape.emission.as_mut()).for_each(emitted);
    for light in &mut desc.lights {
        match light {
            LightDesc::Map { map, .. } => *map = Arc::new(map.grey()),
            _ => emitted(light.spectrum_mut()),
        }
    }
}

/// The grey that is as light under D65.
fn reflected(spectrum: &mut Spectrum) {
    if !spectrum.is_constant() {
        let [r, g, b] = spectrum.reflected_rgb();
        *spectrum = Spectrum::Constant((0.2126 * r + 0.7152 * g + 0.0722 * b).max(0.0));
    }
}

/// D65 of the same luminance.
fn emitted(spectrum: &mut Spectrum) {
    *spectrum = Spectrum::d65(spectrum.luminance());
}
