//! Materials: one list of one-sided ones, and what each description shows to either side.

use glam::Vec4;

use crate::scene::SceneDesc;
use crate::scene::desc::{BsdfDesc, BsdfId, ShapeKind};
use crate::spectrum::Spectrum;
use crate::spectrum::dispersion::{Ior, SODIUM_D};
use crate::tracer::bsdf::{Coat, Microfacet, Sides, Transmittance, coat, fresnel};
use crate::tracer::material::Material;

use super::PrepareError;

/// The one-sided materials of a scene, and which of them each of its shapes shows, those in groups after the others.
pub(super) fn of(desc: &SceneDesc) -> Result<(Vec<Material>, Vec<Sides>), PrepareError> {
    let (materials, sides) = prepare(&desc.bsdfs)?;
    let sides_of = |id: BsdfId| sides.get(id.0 as usize).copied().ok_or(PrepareError::UnknownMaterial { id });
    let of_groups = desc.groups.iter().flat_map(|group| &group.shapes);
    let surfaces = desc.shapes.iter().chain(of_groups).map(|shape| match shape.kind {
        // Never asked for: what is met has the surface of a shape in the group.
        ShapeKind::Instance(_) => Ok(Sides::Single(0)),
        _ => sides_of(shape.bsdf),
    });
    let surfaces = surfaces.collect::<Result<_, _>>()?;
    Ok((materials, surfaces))
}

/// The one-sided materials, and for every description (by id) which of them it shows.
///
/// The back of a two-sided material is lit as its front would be, so that a two-sided one nested in another
/// counts with its own front.
fn prepare(descs: &[BsdfDesc]) -> Result<(Vec<Material>, Vec<Sides>), PrepareError> {
    let mut materials = Vec::new();
    let own: Vec<Option<u32>> = descs
        .iter()
        .map(|desc| {
            one_sided(desc).map(|material| {
                materials.push(material);
                materials.len() as u32 - 1
            })
        })
        .collect();
    let front_of = |mut id: BsdfId| {
        for _ in 0..=descs.len() {
            match descs.get(id.0 as usize) {
                None => return Err(PrepareError::UnknownMaterial { id }),
                Some(BsdfDesc::TwoSided { front, .. }) => id = *front,
                Some(_) => return own[id.0 as usize].ok_or(PrepareError::UnknownMaterial { id }),
            }
        }
        Err(PrepareError::NestedTwoSided { id })
    };
    let sides = descs
        .iter()
        .enumerate()
        .map(|(i, desc)| match desc {
            BsdfDesc::TwoSided { front, back } => {
                Ok(Sides::Two { front: front_of(*front)?, back: front_of(*back)? })
            }
            _ => front_of(BsdfId(i as u32)).map(Sides::Single),
        })
        .collect::<Result<_, _>>()?;
    Ok((materials, sides))
}

/// The material of a description, `None` for a two-sided pair.
fn one_sided(desc: &BsdfDesc) -> Option<Material> {
    Some(match desc.clone() {
        BsdfDesc::Diffuse { reflectance } => Material::Diffuse { reflectance },
        BsdfDesc::Dielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance } => {
            let factors = [specular_reflectance, specular_transmittance];
            Material::Dielectric { int_ior, ext_ior, factors }
        }
        BsdfDesc::Conductor { eta, k, specular_reflectance } => {
            Material::Conductor { eta, k, reflectance: specular_reflectance }
        }
        BsdfDesc::RoughConductor { eta, k, specular_reflectance, roughness } => Material::RoughConductor {
            index: [eta, k],
            reflectance: specular_reflectance,
            microfacet: Microfacet::new(roughness),
        },
        BsdfDesc::RoughDielectric {
            int_ior,
            ext_ior,
            specular_reflectance,
            specular_transmittance,
            roughness,
        } => Material::RoughDielectric {
            int_ior,
            ext_ior,
            factors: [specular_reflectance, specular_transmittance],
            microfacet: Microfacet::new(roughness),
        },
        BsdfDesc::Plastic { int_ior, ext_ior, diffuse_reflectance, specular_reflectance, nonlinear } => {
            Material::Plastic {
                internal: internal_reflectance(&int_ior, &ext_ior),
                ior: [int_ior, ext_ior],
                coat: specular_reflectance,
                base: diffuse_reflectance,
                nonlinear,
            }
        }
        BsdfDesc::RoughPlastic {
            int_ior,
            ext_ior,
            diffuse_reflectance,
            specular_reflectance,
            nonlinear,
            roughness,
        } => {
            let coat = rough_coat(&int_ior, &ext_ior, Microfacet::new(roughness));
            Material::RoughPlastic {
                internal: coat::internal_reflectance(&coat.microfacet, coat.eta),
                coat,
                reflectance: specular_reflectance,
                base: diffuse_reflectance,
                nonlinear,
            }
        }
        BsdfDesc::TwoSided { .. } => return None,
    })
}

/// A coat by its index at the sodium line.
fn rough_coat(int_ior: &Ior, ext_ior: &Ior, microfacet: Microfacet) -> Coat {
    let lambda = Vec4::splat(SODIUM_D);
    let eta = int_ior.eval(lambda).x / ext_ior.eval(lambda).x;
    Coat { eta, microfacet, transmittance: Transmittance::of(&microfacet, eta) }
}

/// What a coat reflects of diffuse light from within; a table over wavelengths where a medium disperses.
fn internal_reflectance(int_ior: &Ior, ext_ior: &Ior) -> Spectrum {
    let at = |nm: f32| {
        let lambda = Vec4::splat(nm);
        fresnel::diffuse_within(int_ior.eval(lambda).x / ext_ior.eval(lambda).x)
    };
    let constant = Spectrum::Constant(at(550.0));
    if !int_ior.is_dispersive() && !ext_ior.is_dispersive() {
        return constant;
    }
    let points: Vec<(f32, f32)> = (0..=50).map(|i| 350.0 + 10.0 * i as f32).map(|nm| (nm, at(nm))).collect();
    Spectrum::table(&points).unwrap_or(constant)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two(front: u32, back: u32) -> BsdfDesc {
        BsdfDesc::TwoSided { front: BsdfId(front), back: BsdfId(back) }
    }

    #[test]
    fn nested_and_circular_pairs() {
        let diffuse = || BsdfDesc::Diffuse { reflectance: Spectrum::Constant(0.5) };
        let (materials, sides) = prepare(&[two(2, 1), diffuse(), two(3, 1), diffuse()]).expect("valid");
        assert_eq!(materials.len(), 2);
        assert_eq!(sides[0], Sides::Two { front: 1, back: 0 });
        assert_eq!(sides[1], Sides::Single(0));
        assert!(matches!(prepare(&[two(0, 0)]), Err(PrepareError::NestedTwoSided { .. })));
        assert!(matches!(prepare(&[two(7, 0)]), Err(PrepareError::UnknownMaterial { .. })));
    }
}
