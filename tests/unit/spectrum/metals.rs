//! Tests of `spectrum::metals`.

use glam::Vec4;
use pointillist::spectrum::LAMBDA_MIN;
use pointillist::spectrum::metals::*;

/// Reflectance at normal incidence (Fresnel).
fn reflectance(name: &str, lambda: f32) -> f32 {
    let (eta, k) = named(name).expect(name);
    let (n, k) = (eta.eval(Vec4::splat(lambda)).x, k.eval(Vec4::splat(lambda)).x);
    ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k)
}

#[test]
fn mirrors_reflect_what_was_measured() {
    // Freshly evaporated films, G. Hass in the American Institute of Physics Handbook, 3rd ed. (1972), §6g.
    // Laboratories differ by 1–3 %, at the edges of gold and copper by more.
    let published = [
        ("Ag", 450.0, 0.971),
        ("Ag", 550.0, 0.983),
        ("Ag", 650.0, 0.988),
        ("Al", 450.0, 0.922),
        ("Al", 550.0, 0.915),
        ("Al", 650.0, 0.905),
        ("Au", 450.0, 0.387),
        ("Au", 550.0, 0.817),
        ("Au", 650.0, 0.955),
        ("Cu", 450.0, 0.552),
        ("Cu", 550.0, 0.669),
        ("Cu", 650.0, 0.966),
    ];
    let tolerance = 0.05;
    for (name, lambda, measured) in published {
        let got = reflectance(name, lambda);
        println!("{name} {lambda} nm: {got:.3}, published {measured}");
        assert!((got - measured).abs() <= tolerance, "{name} at {lambda} nm: {got}, published {measured}");
    }
}

#[test]
fn gold_is_yellow_copper_is_red_and_the_rest_are_grey() {
    for (name, ratio) in [("Au", 1.8), ("Cu", 1.5)] {
        assert!(reflectance(name, 650.0) > ratio * reflectance(name, 480.0), "{name}");
    }
    for name in ["Ag", "Al", "Be", "Cr", "Ni", "Pd", "Pt", "Ti", "W"] {
        let (blue, red) = (reflectance(name, 450.0), reflectance(name, 650.0));
        println!("{name}: {blue:.3} {red:.3}");
        assert!((0.4..1.0).contains(&blue) && (blue / red - 1.0).abs() < 0.3, "{name}: {blue} {red}");
    }
}

#[test]
fn every_name_gives_positive_figures_over_the_whole_range() {
    for name in names() {
        let (eta, k) = named(name).expect(name);
        for i in 0..=470 {
            let lambda = Vec4::splat(LAMBDA_MIN + i as f32);
            assert!(eta.eval(lambda).x > 0.0 && k.eval(lambda).x >= 0.0, "{name} {lambda}");
        }
    }
    for none in ["Unobtainium", "", "#", "_palik", "# rutile, ordinary ray: Devore 1951"] {
        assert_eq!(named(none), None, "{none}");
    }
    assert_eq!(named("Nb_palik"), named("Nb"));
}

/// Mitsuba's own figures at 550 nm (`data/ior` of its package, from Palik's handbook), by the reflectance that they give.
#[test]
fn the_rest_of_mitsubas_list_reflects_as_there() {
    let mitsuba = [
        ("a-C", 2.357, 0.834),
        ("AlAs", 3.252, 0.0),
        ("AlSb", 4.261, 0.137),
        ("CsI", 1.795, 0.0),
        ("d-C", 2.423, 0.0),
        ("Hg", 1.552, 4.652),
        ("Ir", 2.229, 4.314),
        ("K", 0.049, 1.444),
        ("Li", 0.206, 2.474),
        ("MgO", 1.740, 0.0),
        ("Mo", 3.777, 3.521),
        ("Na", 0.059, 2.248),
        ("Nb", 2.930, 2.870),
        ("Rh", 1.967, 5.016),
        ("SiC", 2.662, 0.0),
        ("Ta", 2.471, 1.838),
        ("ThF4", 1.521, 0.0),
        ("TiC", 2.994, 2.506),
        ("TiN", 1.252, 2.104),
        ("TiO2", 2.955, 0.0),
        ("TiO2-e", 2.650, 0.0),
        ("V", 3.680, 3.019),
        ("VC", 2.914, 2.341),
        ("VN", 2.249, 2.194),
    ];
    for (name, n, k) in mitsuba {
        let (n, k): (f32, f32) = (n, k);
        let there = ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k);
        let here = reflectance(name, 550.0);
        println!("{name}: {here:.3}, Mitsuba {there:.3}");
        assert!((here - there).abs() < 0.05, "{name}: {here}, Mitsuba {there}");
        // A constant or a table that is cut short would do at 550 nm.
        assert!(named(name).is_some_and(|(eta, _)| eta.eval(Vec4::splat(830.0)).x > 0.0));
    }
}
