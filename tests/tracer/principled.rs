//! The principled materials: values are those of Mitsuba, and parameters at fault are told.

use glam::{Vec3, Vec4};

use pointillist::scene::desc::{BsdfDesc, PrincipledDesc, PrincipledLobes};
use pointillist::scene::{SceneError, load_str};
use pointillist::spectrum::{SampledSpectrum, Spectrum};
use pointillist::tracer::bsdf::{Principled, PrincipledThin, ScatteringModel};

/// Value and density for both directions of a line of the table; `None` where Mitsuba has no light because it is not reciprocal.
fn value(plugin: &str, numbers: &[f32], wo: Vec3, wi: Vec3) -> Option<SampledSpectrum> {
    let [r, g, b, eta] = [0, 1, 2, 3].map(|i| numbers[i]);
    let base = SampledSpectrum(Vec4::new(r, g, b, r));
    let means = [base.mean(), 0.212_671 * r + 0.715_160 * g + 0.072_169 * b];
    let thin = plugin == "principledthin";
    let mut rest = numbers[4..].iter().copied();
    let mut next = || rest.next().expect("a number");
    let (roughness, anisotropic) = (next(), next());
    let metallic = if thin { 0.0 } else { next() };
    let (spec_trans, spec_tint, sheen, sheen_tint, flatness) = (next(), next(), next(), next(), next());
    let (clearcoat, clearcoat_gloss) = if thin { (0.0, 0.0) } else { (next(), next()) };
    let lobes = PrincipledLobes {
        roughness,
        anisotropic,
        metallic,
        eta,
        spec_tint,
        sheen,
        sheen_tint,
        flatness,
        clearcoat,
        clearcoat_gloss,
    };
    let found = if thin {
        // Through the surface, off a facet that only one of the directions refuses.
        let [up, folded] = [wo, wi].map(|w| w.with_z(w.z.abs()));
        let below = |w: Vec3| w.with_z(-w.z).dot(up + folded) < 0.0;
        if wo.z * wi.z < 0.0 && below(up) != below(folded) {
            return None;
        }
        PrincipledThin::new(base, means, [spec_trans, 0.5 * next(), 1.0], lobes).eval(wo, wi)
    } else {
        Principled::new(base, means, spec_trans, lobes).eval(wo, wi)
    };
    Some(found.map_or(SampledSpectrum::ZERO, |(f, _)| f))
}

#[test]
fn values_are_those_of_mitsuba() {
    let text = include_str!("principled_values.txt");
    let (mut compared, mut lit, mut worst) = (0, 0, 0f32);
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let (plugin, numbers) = line.split_once(' ').expect("a plugin and numbers");
        let numbers: Vec<f32> = numbers.split(' ').map(|n| n.parse().expect("a number")).collect();
        let (numbers, rest) = numbers.split_at(numbers.len() - 9);
        let [wo, wi, expected] = [0, 3, 6].map(|i| Vec3::from_slice(&rest[i..]));
        let Some(found) = value(plugin, numbers, wo, wi) else { continue };
        let off = (found.0.truncate() - expected).abs().max_element() / expected.max_element().max(1e-4);
        worst = worst.max(off);
        assert!(off < 1e-3, "{line}: {found:?}");
        compared += 1;
        lit += usize::from(expected.max_element() > 1e-3);
    }
    println!("{compared} pairs, {lit} of them lit, largest relative difference {worst:.1e}");
    assert!(2 * lit > compared && compared > 300, "{lit} of {compared} are lit");
}

fn read(inner: &str) -> Result<(PrincipledDesc, usize), SceneError> {
    let text = format!(
        "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/>\n<shape type='disk'>\
         <bsdf type='principled'>{inner}</bsdf></shape></scene>"
    );
    let loaded = load_str("t.xml", &text, &[])?;
    match loaded.desc.bsdfs[loaded.desc.shapes[0].bsdf.0 as usize].clone() {
        BsdfDesc::Principled(desc) => Ok((desc, loaded.warnings.len())),
        other => panic!("{other:?}"),
    }
}

#[test]
fn parameters_and_their_faults() {
    let (desc, warnings) = read("").expect("readable");
    assert!(desc.base_color == Spectrum::Constant(0.5) && desc.spec_trans == Spectrum::Constant(0.0));
    assert_eq!((desc.lobes.roughness, desc.lobes.metallic, warnings), (0.5, 0.0, 0));
    assert!((desc.lobes.eta - 1.5).abs() < 1e-5, "specular 0.5 is glass: {}", desc.lobes.eta);
    let one = |text: &str| read(text).unwrap_or_else(|e| panic!("{text}: {e:?}"));
    assert_eq!(one("<float name='eta' value='1.3'/>").0.lobes.eta, 1.3);
    let (desc, warnings) = one("<float name='roughness' value='3'/><float name='clearcoat' value='-1'/>");
    assert_eq!((desc.lobes.roughness, desc.lobes.clearcoat, warnings), (1.0, 0.0, 2));
    assert_eq!(one("<float name='main_specular_sampling_rate' value='2'/>").1, 1);
    let (film, warnings) = one("<float name='thin_film_weight' value='.5'/>");
    let film = film.thin_film.expect("there is a film");
    assert_eq!((film.eta, film.thickness.scalar(&Default::default()), warnings), (1.3, 400.0, 0));
    assert!(one("<float name='thin_film_thickness' value='300'/>").0.thin_film.is_none());
    let invisible = one("<float name='eta' value='1'/><float name='spec_trans' value='1'/>").0;
    assert!(invisible.lobes.eta > 1.0, "glass without an index has no facets");
    for bad in [
        "<float name='eta' value='1.3'/><float name='specular' value='.3'/>",
        "<float name='eta' value='0'/>",
        "<float name='eta' value='-2'/>",
        "<float name='roughness' value='rough'/>",
        "<rgb name='base_color' value='2, 0, 0'/>",
        "<string name='metallic' value='1'/>",
        "<float name='thin_film_weight' value='1'/><float name='thin_film_eta' value='.5'/>",
        "<float name='thin_film_thickness' value='-1'/>",
    ] {
        let Err(error) = read(bad) else { panic!("this must be refused: {bad}") };
        assert!(format!("{error:?}").contains("t.xml"), "{bad}: {error:?}");
    }
    // Without glass it is one-sided, and may be shown on both sides; with glass it has two sides already.
    let both = |inner: &str| {
        let text = format!(
            "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/><shape type='disk'>\
             <bsdf type='twosided'><bsdf type='principled'>{inner}</bsdf></bsdf></shape></scene>"
        );
        load_str("t.xml", &text, &[])
    };
    assert!(both("<float name='spec_trans' value='0'/>").is_ok());
    assert!(both("<float name='spec_trans' value='.5'/>").is_err());
}
