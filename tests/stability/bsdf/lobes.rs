//! The choice between lobes over the random numbers of the sequence, which are multiples of 2⁻²⁴.

use glam::{Vec3, Vec4};

use pointillist::scene::desc::texture::TexturePoint;
use pointillist::scene::desc::{ConductorDesc, DiffuseDesc, Facets};
use pointillist::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum};
use pointillist::tracer::bsdf::{
    Base, Bsdf, BsdfSample, Material, MaterialModel, MaterialPart, MixtureMaterial, Plastic, ScatteringModel,
    ThinDielectric, fresnel,
};

use super::cases::{rough_glass, smooth_glass};
use crate::Row;

const GRID: f64 = (1u64 << 24) as f64;

/// How many numbers of the grid choose the first lobe, and what it returns and the last one, over all numbers.
fn means(sample: impl Fn(f32) -> Option<BsdfSample>) -> [f64; 2] {
    let at = |k: u32| sample((f64::from(k) / GRID) as f32);
    let same = |s: &BsdfSample, of: &BsdfSample| s.transmitted == of.transmitted && s.delta == of.delta;
    let (first, last) = (at(0).unwrap(), at((1 << 24) - 1).unwrap());
    let (mut low, mut high) = (0, 1 << 24);
    while low < high {
        let middle = (low + high) / 2;
        (low, high) = if same(&at(middle).unwrap(), &first) { (middle + 1, high) } else { (low, middle) };
    }
    let share = f64::from(low) / GRID;
    let energy = |s: &BsdfSample| f64::from(s.weight.0.x) * f64::from(s.eta2);
    if same(&first, &last) {
        [0.0, energy(&last)]
    } else {
        [share * energy(&first), (1.0 - share) * energy(&last)]
    }
}

/// The relative error of the two means, the larger; of what a choice by `u < p` returns: both lobes count over `p` and 1 − `p`.
fn errors([first, last]: [f64; 2], exact: [f64; 2]) -> f64 {
    (first / exact[0] - 1.0).abs().max((last / exact[1] - 1.0).abs())
}

fn naive(p: f32, exact: [f64; 2]) -> f64 {
    let share = (f64::from(p) * GRID).ceil() / GRID;
    errors([share * exact[0] / f64::from(p), (1.0 - share) * exact[1] / (1.0 - f64::from(p))], exact)
}

/// Interfaces that reflect little, and coats that are nearly black: what each lobe returns, over all numbers that choose it, is what it
/// should.
#[test]
fn b5_lobes_that_are_rarely_chosen() {
    let one = SampledSpectrum::ONE;
    let (mut worst, mut worst_naive) = (0f64, 0f64);
    let mut take =
        |figure: f64, naive: f64| (worst, worst_naive) = (worst.max(figure), worst_naive.max(naive));
    let wo = Vec3::new(0.6, 0.0, 0.8);
    for eta in [1.0001, 1.0003, 1.001, 1.003, 1.01, 1.1, 1.5, 2.4] {
        let r = fresnel::dielectric(wo.z, Vec4::splat(eta)).x;
        let glass = smooth_glass(eta);
        let exact = [f64::from(r), 1.0 - f64::from(r)];
        take(errors(means(|u| glass.sample(wo, [0.5; 2], u)), exact), naive(r, exact));
        let pane = ThinDielectric::new([SampledSpectrum::splat(eta), one], [one, one]);
        let twice = 2.0 * r / (1.0 + r);
        let exact = [f64::from(twice), 1.0 - f64::from(twice)];
        take(errors(means(|u| pane.sample(wo, [0.5; 2], u)), exact), naive(twice, exact));
        // Along the normal the facet in the middle of the numbers has no masking and the cosine of the view.
        let rough = rough_glass(Facets::Ggx, 0.1, eta);
        let straight = fresnel::dielectric(1.0, Vec4::splat(eta)).x;
        let exact = [f64::from(straight), 1.0 - f64::from(straight)];
        take(errors(means(|u| rough.sample(Vec3::Z, [0.0, 0.5], u)), exact), naive(straight, exact));
    }
    for coat in [1e-7f32, 1e-6, 1e-5, 1e-4, 1e-2] {
        let base = Base {
            albedo: one,
            escape: SampledSpectrum::splat(fresnel::diffuse_escape(1.5)),
            nonlinear: false,
        };
        let plastic =
            Plastic::new([SampledSpectrum::splat(1.5), one], SampledSpectrum::splat(coat), base, false);
        let r = fresnel::dielectric(wo.z, Vec4::splat(1.5)).x;
        let [first, last] = means(|u| plastic.sample(wo, [0.25, 0.5], u));
        // The base at one of its directions: what it would return were it alone.
        let s = plastic.sample(wo, [0.25, 0.5], 1.0 - f32::EPSILON).unwrap();
        let (value, _) = plastic.eval(wo, s.wi).unwrap();
        let base = f64::from(value.0.x) * std::f64::consts::PI / f64::from(s.wi.z);
        let share = r * coat / (coat + 0.9) / (1.0 - r);
        take(errors([first, last], [f64::from(r * coat), base]), naive(share, [f64::from(r * coat), base]));
    }
    for share in [1e-7f32, 1e-6, 1e-5, 1e-4, 1e-2, 0.3] {
        let mirror = ConductorDesc {
            eta: Spectrum::Constant(0.0),
            k: Spectrum::Constant(1.0),
            specular_reflectance: Spectrum::Constant(1.0).into(),
        };
        let white = DiffuseDesc { reflectance: Spectrum::Constant(1.0).into() };
        let part = |material, share: f32| MaterialPart {
            material,
            share: share.into(),
            turned: false,
            bump: None,
            coat: None,
        };
        let parts =
            vec![part(Material::Conductor(mirror), share), part(Material::Diffuse(white), 1.0 - share)];
        let material = MixtureMaterial { parts, has_holes: false };
        let blend = Bsdf::Mixture(material.bsdf(&TexturePoint::default(), &SampledWavelengths::sample(0.3)));
        let exact = [f64::from(share), 1.0 - f64::from(share)];
        take(errors(means(|u| blend.sample(wo, [0.25, 0.5], u)), exact), naive(share, exact));
    }
    Row {
        case: "B5 lobes of interfaces, coats and blends, probabilities of 5e-9 to .4",
        measure: "largest error of what a lobe returns",
        figure: worst,
        naive: ("u < p", worst_naive),
        bound: 1e-6,
    }
    .check();
}
