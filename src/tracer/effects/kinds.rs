//! What the descriptions of materials call for, and how a coat is taken off or put on.

use glam::Vec4;

use crate::scene::desc::{BsdfDesc, DiffuseDesc, PlasticDesc, RoughPlasticDesc, Roughness, SceneDesc};
use crate::spectrum::dispersion::Ior;
use crate::spectrum::{LAMBDA_MAX, LAMBDA_MIN, Spectrum};
use crate::tracer::wavelength_mis;

/// Replaces every material of which `is` holds by its diffuse part; one without a diffuse part becomes black.
pub(super) fn strip(desc: &mut SceneDesc, is: fn(&BsdfDesc) -> bool) {
    desc.bsdfs.iter_mut().filter(|bsdf| is(bsdf)).for_each(|bsdf| {
        let reflectance = bsdf.parts().albedo.cloned().unwrap_or(Spectrum::Constant(0.0));
        *bsdf = DiffuseDesc { reflectance }.into();
    });
}

/// Coats the first diffuse material that shapes show, smoothly or with this roughness; false where there is none.
pub(super) fn varnish(desc: &mut SceneDesc, roughness: Option<Roughness>) -> bool {
    let Some(bsdf) = shown(desc, |bsdf| matches!(bsdf, BsdfDesc::Diffuse(_))) else { return false };
    let BsdfDesc::Diffuse(DiffuseDesc { reflectance }) = &*bsdf else { return false };
    let (int_ior, ext_ior) = (Ior::Constant(1.5), Ior::Constant(1.0));
    let (diffuse_reflectance, specular_reflectance) = (reflectance.clone(), Spectrum::Constant(1.0));
    let nonlinear = false;
    *bsdf = match roughness {
        None => PlasticDesc { int_ior, ext_ior, diffuse_reflectance, specular_reflectance, nonlinear }.into(),
        Some(roughness) => RoughPlasticDesc {
            int_ior,
            ext_ior,
            diffuse_reflectance,
            specular_reflectance,
            nonlinear,
            roughness,
        }
        .into(),
    };
    true
}

/// True for a material that splits light into its colours.
pub(super) fn disperses(bsdf: &BsdfDesc) -> bool {
    bsdf.transmits() && has_dispersive_index(bsdf)
}

/// True for a material that depends on the wavelength in any way.
pub(super) fn is_colored(bsdf: &BsdfDesc) -> bool {
    let parts = bsdf.parts();
    let spectra = [parts.albedo, parts.reflection, parts.transmission, parts.eta, parts.k];
    let colored = spectra.into_iter().flatten().any(|s| !s.is_constant());
    !bsdf.is_black() && (colored || has_dispersive_index(bsdf))
}

/// True where the relative index depends on the wavelength, as paths see it: for any four wavelengths that they may carry.
fn has_dispersive_index(bsdf: &BsdfDesc) -> bool {
    let Some([inside, outside]) = bsdf.spectral_indices() else { return false };
    if !inside.is_dispersive() && !outside.is_dispersive() {
        return false;
    }
    let at = |lambda: f32| inside.eval(Vec4::splat(lambda)).x / outside.eval(Vec4::splat(lambda)).x;
    let first = at(LAMBDA_MIN);
    let steps = (1..=64).map(|i| LAMBDA_MIN + (LAMBDA_MAX - LAMBDA_MIN) * i as f32 / 64.0);
    steps.into_iter().any(|lambda| wavelength_mis::part(Vec4::new(first, at(lambda), first, first)))
}

/// The first material that shapes show and of which `is` holds, to change.
pub(super) fn shown(desc: &mut SceneDesc, is: fn(&BsdfDesc) -> bool) -> Option<&mut BsdfDesc> {
    let index = super::used::Used::of(desc).first(is)?;
    desc.bsdfs.get_mut(index)
}
