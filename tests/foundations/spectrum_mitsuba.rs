//! Surfaces under lights, in linear Rec.709, beside the same by Mitsuba 3.9.1 (`scalar_spectral`).
//!
//! Its figures are quadratures of its own spectra against its own observer at 0.25 nm, divided by the constant it
//! normalises with (106.7503, where the integral of its table is 106.857: a spectrum of 1 has Y = 1.001 there).
//! The two observers (5 nm, 1 nm), and Mitsuba's interpolation in a table of coefficients where Pointillist fits each
//! colour, differ by up to 0.4 % of the brightest channel.

use glam::{DVec3, Vec4};
use pointillist::color::{cie, profile};
use pointillist::spectrum::Spectrum;

const MITSUBA_SCALE: f64 = 106.857027 / 106.750259;

#[test]
fn reflected_light_has_the_colour_that_mitsuba_gives_it() {
    let equal_energy = Spectrum::Constant(1.0);
    let orange = Spectrum::emission_rgb([17.0, 12.0, 4.0]);
    let points = [(400.0, 0.2), (500.0, 1.0), (620.0, 3.0), (700.0, 0.1)];
    let measured = Spectrum::table(&points).expect("valid points");
    let (red, green, white) = ([0.63, 0.065, 0.05], [0.14, 0.45, 0.091], [0.725, 0.71, 0.68]);
    let (blue, yellow) = ([0.02, 0.05, 0.8], [1.0, 1.0, 0.0]);

    let mitsuba = [
        (&equal_energy, red, [0.73083, 0.0568, 0.04424]),
        (&equal_energy, green, [0.18172, 0.43043, 0.07628]),
        (&equal_energy, white, [0.87203, 0.67367, 0.61747]),
        (&equal_energy, blue, [0.03328, 0.0432, 0.74633]),
        (&equal_energy, yellow, [1.19353, 0.95291, -0.01339]),
        (&orange, red, [9.73944, 0.7514, 0.05837]),
        (&orange, green, [2.94265, 5.26844, 0.19609]),
        (&orange, white, [12.28692, 8.50137, 2.69344]),
        (&orange, blue, [0.18464, 0.92055, 3.61874]),
        (&orange, yellow, [17.11875, 11.60409, -0.70791]),
        (&measured, red, [1.79338, 0.10274, -0.00874]),
        (&measured, green, [0.64843, 0.73071, -0.00079]),
        (&measured, white, [2.4517, 1.17678, 0.26304]),
        (&measured, blue, [0.07049, 0.12028, 0.41695]),
        (&measured, yellow, [3.391, 1.61136, -0.14606]),
    ];
    for (light, rgb, theirs) in mitsuba {
        let surface = Spectrum::reflectance_rgb(rgb);
        let at = |lambda: f32| (surface.eval(Vec4::splat(lambda)) * light.eval(Vec4::splat(lambda))).x;
        let xyz = cie::integrate(|lambda, _| f64::from(at(lambda)));
        let ours = profile::xyz_from_rec709().inverse() * xyz;
        let theirs = DVec3::from_array(theirs) * MITSUBA_SCALE;
        let off = (ours - theirs).abs().max_element() / theirs.max_element();
        println!("{rgb:?}: {ours:.4}, Mitsuba {theirs:.4}, off by {off:.4}");
        assert!(off < 4e-3, "{rgb:?}: {ours} should be {theirs}");
    }
}
