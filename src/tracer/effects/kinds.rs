//! What kind each material is; and what is left of one without its coat, or becomes of one with a coat.

use glam::Vec4;

use crate::scene::desc::{BsdfDesc, Roughness, SceneDesc};
use crate::spectrum::dispersion::Ior;
use crate::spectrum::{LAMBDA_MAX, LAMBDA_MIN, Spectrum};
use crate::tracer::wavelength_mis;

/// Leaves of every material of which `is` holds what is under its coat, and of one without a coat nothing: black.
pub(super) fn strip(desc: &mut SceneDesc, is: fn(&BsdfDesc) -> bool) {
    desc.bsdfs.iter_mut().filter(|bsdf| is(bsdf)).for_each(|bsdf| {
        let reflectance = match bsdf {
            BsdfDesc::Plastic { diffuse_reflectance, .. }
            | BsdfDesc::RoughPlastic { diffuse_reflectance, .. } => diffuse_reflectance.clone(),
            _ => Spectrum::Constant(0.0),
        };
        *bsdf = BsdfDesc::Diffuse { reflectance };
    });
}

/// Varnishes the first matt material that shapes show, evenly or with this roughness; false where there is none.
pub(super) fn varnish(desc: &mut SceneDesc, roughness: Option<Roughness>) -> bool {
    let Some(bsdf) = shown(desc, |bsdf| matches!(bsdf, BsdfDesc::Diffuse { .. })) else { return false };
    let BsdfDesc::Diffuse { reflectance } = &*bsdf else { return false };
    let (int_ior, ext_ior) = (Ior::Constant(1.5), Ior::Constant(1.0));
    let (diffuse_reflectance, specular_reflectance) = (reflectance.clone(), Spectrum::Constant(1.0));
    let nonlinear = false;
    *bsdf = match roughness {
        None => BsdfDesc::Plastic { int_ior, ext_ior, diffuse_reflectance, specular_reflectance, nonlinear },
        Some(roughness) => BsdfDesc::RoughPlastic {
            int_ior,
            ext_ior,
            diffuse_reflectance,
            specular_reflectance,
            nonlinear,
            roughness,
        },
    };
    true
}

pub(super) fn transmits(bsdf: &BsdfDesc) -> bool {
    match bsdf {
        BsdfDesc::Dielectric { specular_transmittance, .. }
        | BsdfDesc::RoughDielectric { specular_transmittance, .. } => !specular_transmittance.is_black(),
        _ => false,
    }
}

pub(super) fn disperses(bsdf: &BsdfDesc) -> bool {
    transmits(bsdf) && indices(bsdf).is_some_and(|[inside, outside]| parts(inside, outside))
}

pub(super) fn is_delta(bsdf: &BsdfDesc) -> bool {
    let smooth =
        matches!(bsdf, BsdfDesc::Dielectric { .. } | BsdfDesc::Conductor { .. } | BsdfDesc::Plastic { .. });
    smooth && !is_black(bsdf)
}

pub(super) fn is_glossy(bsdf: &BsdfDesc) -> bool {
    let rough = matches!(
        bsdf,
        BsdfDesc::RoughConductor { .. } | BsdfDesc::RoughDielectric { .. } | BsdfDesc::RoughPlastic { .. }
    );
    rough && !is_black(bsdf)
}

/// True for what may make a caustic.
pub(super) fn focuses(bsdf: &BsdfDesc) -> bool {
    is_delta(bsdf) || is_glossy(bsdf)
}

/// True for what has a diffuse part.
pub(super) fn spreads(bsdf: &BsdfDesc) -> bool {
    matches!(bsdf, BsdfDesc::Diffuse { .. } | BsdfDesc::Plastic { .. } | BsdfDesc::RoughPlastic { .. })
}

/// True for what depends on the wavelength in any way.
pub(super) fn is_colored(bsdf: &BsdfDesc) -> bool {
    let spectra: [Option<&Spectrum>; 3] = match bsdf {
        BsdfDesc::Diffuse { reflectance } => [Some(reflectance), None, None],
        BsdfDesc::Dielectric { specular_reflectance: r, specular_transmittance: t, .. }
        | BsdfDesc::RoughDielectric { specular_reflectance: r, specular_transmittance: t, .. } => {
            [Some(r), Some(t), None]
        }
        BsdfDesc::Conductor { eta, k, specular_reflectance: r }
        | BsdfDesc::RoughConductor { eta, k, specular_reflectance: r, .. } => [Some(eta), Some(k), Some(r)],
        BsdfDesc::Plastic { diffuse_reflectance: d, specular_reflectance: r, .. }
        | BsdfDesc::RoughPlastic { diffuse_reflectance: d, specular_reflectance: r, .. } => {
            [Some(d), Some(r), None]
        }
        BsdfDesc::TwoSided { .. } => [None; 3],
    };
    let colored = spectra.iter().flatten().any(|s| !s.is_constant());
    !is_black(bsdf) && (colored || indices(bsdf).is_some_and(|[inside, outside]| parts(inside, outside)))
}

/// True for what sends nothing back by its factors.
fn is_black(bsdf: &BsdfDesc) -> bool {
    match bsdf {
        BsdfDesc::Conductor { specular_reflectance, .. }
        | BsdfDesc::RoughConductor { specular_reflectance, .. } => specular_reflectance.is_black(),
        BsdfDesc::Dielectric { specular_reflectance: r, specular_transmittance: t, .. }
        | BsdfDesc::RoughDielectric { specular_reflectance: r, specular_transmittance: t, .. } => {
            r.is_black() && t.is_black()
        }
        BsdfDesc::Diffuse { .. }
        | BsdfDesc::Plastic { .. }
        | BsdfDesc::RoughPlastic { .. }
        | BsdfDesc::TwoSided { .. } => false,
    }
}

/// The indices of refraction that count at all wavelengths. Of a rough coat one number is taken.
fn indices(bsdf: &BsdfDesc) -> Option<[&Ior; 2]> {
    match bsdf {
        BsdfDesc::Dielectric { int_ior, ext_ior, .. }
        | BsdfDesc::RoughDielectric { int_ior, ext_ior, .. }
        | BsdfDesc::Plastic { int_ior, ext_ior, .. } => Some([int_ior, ext_ior]),
        _ => None,
    }
}

/// The same, to change.
pub(super) fn indices_mut(bsdf: &mut BsdfDesc) -> Option<[&mut Ior; 2]> {
    match bsdf {
        BsdfDesc::Dielectric { int_ior, ext_ior, .. }
        | BsdfDesc::RoughDielectric { int_ior, ext_ior, .. }
        | BsdfDesc::Plastic { int_ior, ext_ior, .. } => Some([int_ior, ext_ior]),
        _ => None,
    }
}

/// The relative index depends on the wavelength: as paths see it, of any four wavelengths that they may carry.
fn parts(inside: &Ior, outside: &Ior) -> bool {
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
