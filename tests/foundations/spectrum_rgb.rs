//! RGB to spectrum: what a light of the scene file looks like after it has become a spectrum. Reflectances are in `stability/colors.rs`.

use glam::{DVec3, Vec4};
use pointillist::color::{cie, profile};
use pointillist::spectrum::Spectrum;

#[test]
fn emission_has_the_colour_asked_for() {
    for rgb in [
        [1.0, 1.0, 1.0],
        [17.0, 12.0, 4.0],
        [0.2, 3.0, 0.5],
        [1.0, 0.0, 0.0],
        [0.0, 0.0, 1e-3],
        [5e4, 4e4, 0.0],
    ] {
        let light = Spectrum::emission_rgb(rgb);
        let xyz = cie::integrate(|lambda, _| f64::from(light.eval(Vec4::splat(lambda)).x));
        let got = profile::xyz_from_rec709().inverse() * xyz;
        let asked = DVec3::from_array(rgb.map(f64::from));
        assert!((got - asked).abs().max_element() < 1e-4 * asked.max_element(), "{asked} {got}");
    }
}
