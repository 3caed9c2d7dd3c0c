//! Tests of `tracer::photon_map::photon`.

use glam::{Vec3, Vec4};
use pointillist::spectrum::SampledSpectrum;
use pointillist::tracer::photon_map::*;

fn arrival(flux: Vec4, direction: Vec3) -> Arrival {
    Arrival {
        position: Vec3::ONE,
        direction,
        site: ArrivalSite::Surface(-direction),
        flux: SampledSpectrum(flux),
        wavelengths: wavelength_number(0.3),
        hero_only: false,
        depth: 2,
        group: 0,
    }
}

#[test]
fn flux_survives_over_the_whole_range() {
    for k in -126..=127 {
        let flux = Vec4::new(1.999, 1.0, 0.3, 0.0) * 2f32.powi(k);
        let photon = Photon::new(&arrival(flux, Vec3::Z)).expect("it can be stored");
        let back = photon.flux().0;
        let bound = flux.x / 16_384.0;
        assert!((back - flux).abs().max_element() <= bound, "2^{k}: {flux} became {back}");
        assert_eq!(back.w, 0.0);
    }
}

#[test]
fn directions_survive() {
    for i in 0..20_000 {
        let z = 1.0 - 2.0 * (i as f32 + 0.5) / 20_000.0;
        let (s, c) = (i as f32 * 2.399_963).sin_cos();
        let v = Vec3::new(c * (1.0 - z * z).sqrt(), s * (1.0 - z * z).sqrt(), z);
        let photon = Photon::new(&arrival(Vec4::ONE, v)).expect("it can be stored");
        assert!((photon.direction() - v).length() < 1e-4, "{v}");
        assert!((photon.normal() + v).length() < 1e-4, "{v}");
    }
    for v in [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z] {
        assert!(
            (Photon::new(&arrival(Vec4::ONE, v)).expect("it can be stored").direction() - v).length() < 1e-4,
            "{v}"
        );
    }
}

#[test]
fn what_is_no_photon_is_refused() {
    for flux in [Vec4::ZERO, Vec4::splat(f32::NAN), Vec4::new(1.0, f32::INFINITY, 0.0, 0.0), Vec4::NEG_ONE] {
        assert_eq!(Photon::new(&arrival(flux, Vec3::Z)), None, "{flux}");
    }
    assert_eq!(Photon::new(&arrival(Vec4::ONE, Vec3::ZERO)), None);
    let nowhere = Arrival { position: Vec3::splat(f32::NAN), ..arrival(Vec4::ONE, Vec3::Z) };
    assert_eq!(Photon::new(&nowhere), None);
}

#[test]
fn wavelengths_are_those_of_the_light_path() {
    for u in [0.0, 0.25, 0.7, 1.0 - f32::EPSILON / 2.0] {
        let number = wavelength_number(u);
        let traced = wavelengths(number);
        let mut a = arrival(Vec4::new(1.0, f32::NAN, 2.0, 3.0), Vec3::Z);
        a.wavelengths = number;
        a.hero_only = true;
        let photon = Photon::new(&a).expect("it can be stored");
        assert_eq!(photon.wavelengths().lambda(), traced.lambda());
        assert!(photon.wavelengths().is_hero_only());
        assert_eq!(photon.depth(), 2);
        assert_eq!(photon.flux().0, Vec4::new(1.0, 0.0, 0.0, 0.0));
    }
}

#[test]
fn photons_know_their_medium() {
    use pointillist::tracer::medium::MediumIndex;
    let in_fog = Arrival { site: ArrivalSite::Medium(MediumIndex::VACUUM), ..arrival(Vec4::ONE, Vec3::Z) };
    let photon = Photon::new(&in_fog).expect("it can be stored");
    assert!(photon.is_in(MediumIndex::VACUUM));
    assert!(!Photon::new(&arrival(Vec4::ONE, Vec3::Z)).expect("likewise").is_in(MediumIndex::VACUUM));
}
