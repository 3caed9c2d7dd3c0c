//! Every material × roughness × index.

use glam::{Vec3, Vec4};

use pointillist::scene::desc::texture::{SpectrumTexture, TexturePoint};
use pointillist::scene::desc::{
    BsdfDesc, BsdfId, CoatDesc, DiffuseDesc, Facets, PrincipledLobes, RoughConductorDesc,
    RoughDielectricDesc, Roughness, SHARPEST_PHONG, WardVariant,
};
use pointillist::spectrum::dispersion::Ior;
use pointillist::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum};
use pointillist::tracer::bsdf::{
    Base, Bsdf, Coat, CoatingMaterial, Conductor, Dielectric, Diffuse, DiffuseTransmitter, Material,
    MaterialModel, MaterialPart, Microfacet, MixtureMaterial, PartCoat, Phong, PhongLobe, Plastic,
    Principled, PrincipledThin, RoughConductor, RoughDielectric, RoughDiffuse, RoughPlastic, ThinDielectric,
    ThinFilm, Transmittance, Ward, WardLobe, fresnel, internal_reflectance,
};

use super::quadrature::{density_of_normals, lattice, normal};

pub const ROUGHNESSES: [f32; 7] = [0.0, 1e-6, 1e-4, 1e-2, 0.1, 0.5, 1.0];
pub const INDICES: [f32; 7] = [1.0, 1.0 + 1e-7, 1.0003, 1.5, 2.4, 4.0, 200.0];

const ONE: SampledSpectrum = SampledSpectrum::ONE;

/// How much light a material may return.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Energy {
    /// All.
    All,
    /// All but what a second scattering by GGX's facets would return: by conductors, by dielectrics.
    SingleReflection,
    SingleInterface,
    /// At most this.
    AtMost(f64),
}

/// α of the facets that make the lobes of a material.
#[derive(Clone, Copy, Debug)]
pub struct LobeWidths {
    /// Of those that mirror; of the coat, where that is narrower.
    pub mirror: f64,
    pub refract: f64,
    /// Of those that let through a thin pane.
    pub pane: f64,
}

/// One material.
#[derive(Clone, Debug)]
pub struct Case {
    pub model: &'static str,
    pub bsdf: Bsdf,
    /// How wide its lobes are.
    pub alpha: LobeWidths,
    pub index: f32,
    /// Index behind the surface over that in front of it, as directions are bent.
    pub behind: f64,
    /// It scatters to the other side, and is to be seen from there.
    pub transmits: bool,
    pub energy: Energy,
}

pub fn microfacet(facets: Facets, alpha: f32) -> Microfacet {
    Microfacet::new(Roughness { facets, alpha: [alpha; 2] })
}

pub fn smooth_glass(eta: f32) -> Dielectric {
    Dielectric::new([SampledSpectrum::splat(eta), ONE], [ONE, ONE])
}

pub fn rough_glass(facets: Facets, alpha: f32, eta: f32) -> Bsdf {
    let smooth = smooth_glass(eta);
    RoughDielectric::new(smooth, &microfacet(facets, alpha)).map_or(smooth.into(), Bsdf::RoughDielectric)
}

fn white(escape: f32) -> Base {
    Base { albedo: ONE, escape: SampledSpectrum::splat(escape), nonlinear: false }
}

fn rough_plastic(alpha: f32, eta: f32) -> Bsdf {
    let microfacet = microfacet(Facets::Ggx, alpha);
    let coat = Coat { eta, microfacet, transmittance: Transmittance::of(&microfacet, eta) };
    RoughPlastic::new(&coat, ONE, white(1.0 - internal_reflectance(&microfacet, eta)), false).into()
}

fn lobes(roughness: f32, eta: f32) -> PrincipledLobes {
    PrincipledLobes {
        roughness: roughness.sqrt(),
        anisotropic: 0.0,
        metallic: 0.0,
        eta,
        spec_tint: 0.0,
        sheen: 0.0,
        sheen_tint: 0.0,
        flatness: 0.0,
        clearcoat: 0.0,
        clearcoat_gloss: 0.5,
    }
}

/// Three tenths of rough glass in white.
fn blend(alpha: f32, eta: f32) -> Bsdf {
    let constant = |v: f32| Spectrum::Constant(v);
    let glass = RoughDielectricDesc {
        int_ior: Ior::Constant(eta),
        ext_ior: Ior::Constant(1.0),
        specular_reflectance: constant(1.0).into(),
        specular_transmittance: constant(1.0).into(),
        roughness: Roughness { facets: Facets::Ggx, alpha: [alpha; 2] },
        alpha: None,
    };
    let part = |material, share: f32| MaterialPart {
        material,
        share: share.into(),
        turned: false,
        bump: None,
        coat: None,
    };
    let parts = vec![
        part(Material::RoughDielectric(glass.into()), 0.3),
        part(Material::Diffuse(DiffuseDesc { reflectance: constant(1.0).into() }), 0.7),
    ];
    let lambda = SampledWavelengths::sample(0.3);
    Bsdf::Mixture(MixtureMaterial { parts, has_holes: false }.bsdf(&TexturePoint::default(), &lambda))
}

/// A description's material, with a coat over it.
fn coated(desc: BsdfDesc, coat: CoatDesc<'_>) -> Bsdf {
    let material = Material::new(&desc).expect("one material");
    let coat = Some(PartCoat { coat: CoatingMaterial::new(&coat, []), tilted: false });
    let parts = vec![MaterialPart { material, share: 1.0.into(), turned: false, bump: None, coat }];
    let lambda = SampledWavelengths::sample(0.3);
    Bsdf::Mixture(MixtureMaterial { parts, has_holes: false }.bsdf(&TexturePoint::default(), &lambda))
}

/// Coats of an index, smooth and rough, over white and over metal that loses nothing.
fn coats(alpha: f32, eta: f32) -> [(&'static str, Bsdf); 3] {
    let constant = |v: f32| SpectrumTexture::from(Spectrum::Constant(v));
    let (clear, one) = (constant(0.0), constant(1.0));
    let coat = |roughness| CoatDesc {
        bsdf: BsdfId(0),
        eta,
        thickness: 1.0,
        sigma_a: &clear,
        specular_reflectance: &one,
        roughness,
    };
    let rough = Roughness { facets: Facets::Ggx, alpha: [alpha; 2] };
    let silver = RoughConductorDesc {
        eta: Spectrum::Constant(0.0),
        k: Spectrum::Constant(1.0),
        specular_reflectance: constant(1.0),
        roughness: rough,
        alpha: None,
    };
    [
        ("coating over white", coated(BsdfDesc::grey(1.0), coat(None))),
        ("coating over metal", coated(silver.into(), coat(None))),
        ("roughcoating over white", coated(BsdfDesc::grey(1.0), coat(Some(rough)))),
    ]
}

/// Materials of version 0.6 without an index, with the width of their lobes and the most that they return.
fn empirical(alpha: f32) -> Vec<(&'static str, Bsdf, f32, Energy)> {
    let half = [SampledSpectrum::splat(0.5); 2];
    let exponent = (2.0 / (alpha * alpha) - 2.0).clamp(0.0, SHARPEST_PHONG);
    let ward = |variant| Ward::new(WardLobe::new(variant, [alpha; 2]), half, false).into();
    let at_most = Energy::AtMost;
    let width = (2.0 / (exponent + 2.0)).sqrt();
    vec![
        ("roughdiffuse", RoughDiffuse::new(ONE, alpha, false).into(), 1.0, at_most(1.3)),
        ("roughdiffuse, fast", RoughDiffuse::new(ONE, alpha, true).into(), 1.0, at_most(1.3)),
        ("phong", Phong::new(PhongLobe::new(exponent), half, false).into(), width, at_most(1.0)),
        ("ward, balanced", ward(WardVariant::Balanced), alpha, at_most(1.0)),
        // Without a bound, as published: at 89.9999° this much.
        ("ward", ward(WardVariant::Ward), alpha, at_most(1e4)),
        ("ward-duer", ward(WardVariant::Duer), alpha, at_most(1e7)),
    ]
}

/// The list. The coat of rough plastic lets through what a table over 16 angles says, which is off by .08 where all happens below one
/// degree, at an index of 1.0003; and Burley's principled material does not conserve energy: rough and grazing it returns up to
/// 1.6, and 2.16 at an index of 200.
pub fn all() -> Vec<Case> {
    let mut all = vec![Case {
        model: "diffuse",
        bsdf: Diffuse::new(ONE).into(),
        alpha: LobeWidths { mirror: 1.0, refract: 1.0, pane: 1.0 },
        index: 1.0,
        behind: 1.0,
        transmits: false,
        energy: Energy::All,
    }];
    let sheet = DiffuseTransmitter::new(ONE).into();
    all.push(Case { model: "difftrans", bsdf: sheet, transmits: true, ..all[0].clone() });
    // Narrower lobes around the mirror direction are rounder than those of facets, for which the points of the integrals are chosen.
    for alpha in [0.01, 0.03, 0.1, 0.25, 1.0] {
        for (model, bsdf, width, energy) in empirical(alpha) {
            if model == "phong" && alpha < 0.1 {
                continue;
            }
            let width = f64::from(width).max(1e-4);
            let alpha = LobeWidths { mirror: width, refract: width, pane: 1.0 };
            all.push(Case { model, bsdf, alpha, energy, ..all[0].clone() });
        }
    }
    for index in INDICES {
        let behind = f64::from(index);
        let splat = SampledSpectrum::splat;
        let mut add = |model: &'static str, bsdf: Bsdf, alpha: f32, behind: f64, transmits, energy| {
            // The principled materials have facets of at least 1e-3, and panes are rough on both faces. The coat is as narrow as 0.05.
            let pane = (f64::from(alpha) * (0.65 * f64::from(index) - 0.35).powi(2)).max(1e-3);
            let alpha = f64::from(alpha).max(if model.starts_with("principled") { 1e-3 } else { 1e-4 });
            let mirror = if model == "principled, coated" { alpha.min(0.05) } else { alpha };
            let alpha = LobeWidths { mirror, refract: alpha, pane };
            all.push(Case { model, bsdf, alpha, index, behind, transmits, energy });
        };
        let eta = [splat(index), ONE];
        let metal = |k: f32, factor| Conductor::new(splat(index), splat(k), factor);
        let silver = Conductor::new(SampledSpectrum::ZERO, splat(index), ONE);
        let plastic = Plastic::new(eta, ONE, white(fresnel::diffuse_escape(index)), false);
        add("dielectric", smooth_glass(index).into(), 1.0, behind, true, Energy::All);
        add("thindielectric", ThinDielectric::new(eta, [ONE, ONE]).into(), 1.0, 1.0, true, Energy::All);
        add("conductor, k = 0", metal(0.0, ONE).into(), 1.0, 1.0, false, Energy::AtMost(1.0));
        add("conductor, k = 3", metal(3.0, ONE).into(), 1.0, 1.0, false, Energy::AtMost(1.0));
        add("conductor, index 0", silver.into(), 1.0, 1.0, false, Energy::All);
        add("plastic", plastic.into(), 1.0, 1.0, false, Energy::All);
        for alpha in ROUGHNESSES {
            for facets in [Facets::Ggx, Facets::Beckmann] {
                let ggx = facets == Facets::Ggx;
                let single = |energy| if ggx { energy } else { Energy::AtMost(1.0) };
                let rough = |smooth| RoughConductor::new(smooth, &microfacet(facets, alpha)).into();
                let at_most = Energy::AtMost(1.0);
                add("roughconductor, k = 0", rough(metal(0.0, ONE)), alpha, 1.0, false, at_most);
                add("roughconductor, k = 3", rough(metal(3.0, ONE)), alpha, 1.0, false, at_most);
                add(
                    "roughconductor, index 0",
                    rough(silver),
                    alpha,
                    1.0,
                    false,
                    single(Energy::SingleReflection),
                );
                let glass = rough_glass(facets, alpha, index);
                add("roughdielectric", glass, alpha, behind, true, single(Energy::SingleInterface));
            }
            add("roughplastic", rough_plastic(alpha, index), alpha, 1.0, false, Energy::AtMost(1.1));
            // Light that leaves a coat fans out, and so do its lobes.
            for (model, bsdf) in coats(alpha, index) {
                // Of a roughness of 1e-4 at an index of 1.0003 the density adds up to 1.004 at 89°.
                if model == "coating over metal" && alpha < 1e-2 {
                    continue;
                }
                let wide = if model == "coating over metal" { alpha * index } else { alpha };
                add(model, bsdf, wide, 1.0, false, Energy::AtMost(1.1));
            }
            add("blendbsdf", blend(alpha, index), alpha, behind, true, Energy::AtMost(1.0));
            let burley = Energy::AtMost(2.2);
            let facets = lobes(alpha, index);
            let principled = |glass, lobes| Principled::new(ONE, [1.0, 1.0], glass, lobes).into();
            let coated = PrincipledLobes { clearcoat: 1.0, metallic: 0.3, sheen: 0.3, ..facets };
            add("principled", principled(0.0, facets), alpha, 1.0, false, burley);
            add("principled, coated", principled(0.3, coated), alpha, behind, true, burley);
            add("principled, glass", principled(1.0, facets), alpha, behind, true, burley);
            let film = ThinFilm::new(1.0, 1.4, 350.0, Vec4::new(440.0, 510.0, 580.0, 650.0));
            let iridescent = Principled::new(ONE, [1.0, 1.0], 1.0, facets).under(film).into();
            add("principled, iridescent glass", iridescent, alpha, behind, true, burley);
            let thin = PrincipledThin::new(ONE, [1.0, 1.0], [0.5, 0.5, 1.0], facets).into();
            add("principledthin", thin, alpha, 1.0, true, burley);
        }
    }
    all
}

/// What a material may return to `wo`, least and most, and whether double precision says it exactly.
pub fn bounds(case: &Case, wo: Vec3) -> [f64; 2] {
    match case.energy {
        Energy::All => [1.0; 2],
        Energy::AtMost(most) => [0.0, most],
        Energy::SingleReflection => [single(case, wo, true); 2],
        Energy::SingleInterface => {
            // Where the indices are so close that light passes straight, nothing is hidden.
            let apart = (case.behind - 1.0).abs() * case.alpha.refract > 1e-5;
            [single(case, wo, false), if apart { single(case, wo, false) } else { 1.0 }]
        }
    }
}

/// What GGX facets that lose nothing return by one scattering, in double precision: the mean of G₁ over visible normals.
fn single(case: &Case, wo: Vec3, mirror: bool) -> f64 {
    const POINTS: u32 = 1 << 14;
    let alpha = case.alpha.refract;
    let eta = if wo.z > 0.0 { case.behind } else { 1.0 / case.behind };
    let wo = wo.with_z(wo.z.abs()).as_dvec3().normalize();
    let g1 = |cos: f64| {
        let tan2 = (1.0 - cos * cos).max(0.0) / (cos * cos);
        2.0 / (1.0 + (1.0 + alpha * alpha * tan2).sqrt())
    };
    let (mut sum, mut total) = (0.0, 0.0);
    for i in 0..POINTS {
        let [u, v, _] = lattice(i, POINTS);
        let m = normal(alpha, u, v);
        let cos = wo.dot(m);
        if cos <= 0.0 {
            continue;
        }
        let q = m.truncate().length_squared() / (alpha * alpha) + m.z * m.z;
        let weight = cos / (q * q) / density_of_normals(m, alpha);
        let up = 2.0 * cos * m.z - wo.z;
        let mirrored = if up > 0.0 { g1(up) } else { 0.0 };
        let (reflectance, passed) = match (eta - 1.0) * (eta + 1.0) + cos * cos {
            _ if mirror => (1.0, 0.0),
            through2 if through2 > 0.0 => {
                let through = through2.sqrt();
                let s = (cos - through) / (cos + through);
                let p = (eta * eta * cos - through) / (eta * eta * cos + through);
                let down = (wo.z - m.z * (cos - through)) / eta;
                (0.5 * (s * s + p * p), if down > 0.0 { g1(down) } else { 0.0 })
            }
            _ => (1.0, 0.0),
        };
        sum += weight * (reflectance * mirrored + (1.0 - reflectance) * passed);
        total += weight;
    }
    sum / total
}
